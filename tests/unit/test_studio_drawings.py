"""Ten drawings in a real browser: dropped, folded, pulled, taken back, saved, and run again by `bh run`."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from bh.paths.path import Path as Trace
from tests.unit.browsers import needs_browser
from tests.unit.studio_visits import Visit

pytestmark = [needs_browser, pytest.mark.slow]
ROOT = Path(__file__).resolve().parents[2]
DATA, EXAMPLES = ROOT / "tests" / "data", ROOT / "examples"
DRAWINGS = (
    DATA / "pleats.svg",
    DATA / "miura.svg",
    DATA / "fan.svg",
    DATA / "ring_pleats.svg",
    DATA / "steps_popup.svg",
    DATA / "cone_pleat.svg",
    DATA / "no_outline.svg",
    DATA / "rigid_miura.fold",
    EXAMPLES / "miura.fold",
    EXAMPLES / "kirigami.svg",
    EXAMPLES / "wave.svg",
)
SLOW = 180_000  # ms; on a machine with much else to do
SEEN = 1e-5  # of the sheet's size: the window has positions as float32


def middle_of_a_far_triangle(window: Visit) -> list[float]:
    """Where on the page a triangle far from the middle of the sheet is seen, pixels."""
    points = window.points()
    corners = points[np.array(window.page.evaluate("studio.sheet.triangles")).reshape(-1, 3)]
    middles = corners.mean(axis=1)
    far = int(np.argmax(np.linalg.norm(middles - points.mean(axis=0), axis=1)))
    found: list[float] = window.page.evaluate(f"studio.spot({middles[far].tolist()})")
    return found


@pytest.mark.parametrize("drawing", DRAWINGS, ids=lambda each: each.name if isinstance(each, Path) else None)
def test_a_drawing_is_dropped_handled_saved_and_run_again(
    window: Visit, drawing: Path, tmp_path: Path
) -> None:
    """The shape of the run is that which was seen; undo and redo lead back and forth; the console stays empty."""
    page = window.page
    page.set_default_timeout(SLOW)
    window.drop(drawing)
    page.locator("#percent").focus()
    for percent in (8, 16, 24):
        page.locator("#percent").fill(str(percent))
    full = "Object.fromEntries(studio.sheet.creases.map((c) => [c.name, c.full]))"
    window.rests(f"Object.entries(head.asked).every(([name, a]) => Math.abs(a - 0.24 * {full}[name]) < 1e-6)")
    folded, size = window.points(), float(np.ptp(window.points(), axis=0).max())
    x, y = middle_of_a_far_triangle(window)
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 5):
        page.mouse.move(x, y - 3 * step)
    page.mouse.up()
    window.rests("Object.keys(head.forces).length === 1")
    assert page.locator("#force").inner_text().endswith(" N")
    pulled = window.points()
    page.keyboard.press("Control+z")
    window.rests("Object.keys(head.grips).length === 0 && Object.keys(head.forces).length === 0")
    snapped = page.evaluate("studio.head.left")
    if not snapped:  # behind one the way back may lead elsewhere
        np.testing.assert_allclose(window.points(), folded, atol=SEEN * size)
    page.keyboard.press("Control+y")
    window.rests("Object.keys(head.forces).length === 1")
    if not page.evaluate("studio.head.left"):
        np.testing.assert_allclose(window.points(), pulled, atol=SEEN * size)
    seen = window.points()
    with page.expect_download() as waiting:
        page.locator("#export").select_option("scene")
    waiting.value.save_as(tmp_path / "scene.zip")
    with zipfile.ZipFile(tmp_path / "scene.zip") as archive:
        archive.extractall(tmp_path)
    left = page.evaluate("studio.head.left")
    command = [
        sys.executable,
        str(ROOT / "bh_command.py"),
        "run",
        f"{drawing.stem}.toml",
        *(["--resume"] * left),
    ]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    path = Trace.load(next((tmp_path / f"{drawing.stem}-out").glob("*.bh")))
    np.testing.assert_allclose(path[-1].points, seen, atol=SEEN * size)
    assert window.told == []
