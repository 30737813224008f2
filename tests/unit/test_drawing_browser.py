"""Mutations of SVG drawings as a browser draws them: what was read lies where ink is, or a remark says why not."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from meshes.errors import InputError
from meshes.io.drawing import read_drawing
from meshes.io.strokes import Rules
from meshes.io.svg import read_svg
from tests.unit.browsers import needs_browser, opened
from verification.studies.solver.drawings_mutations import mutant, seeds

pytestmark = [needs_browser, pytest.mark.slow]
WIDE, HIGH = 1000, 800  # px of the view; what lies beyond is compared by neither
PX = 25.4 / 96.0  # mm
LINE = 3.0  # px, the width of every line in the browser
OFF = 2.5  # px between what is read and what is drawn: half of a line and rounding
PART = 0.01  # of the pixels that may differ
COUNT = 300  # mutations, of which about a third are SVG drawings that are read
OWN = Path(__file__).parents[1] / "data"
SCALE, LOW = 0.5, -300.0  # px of the view a px of the page; px of the page at the view's upper left corner
# lines of one width, whatever their scale; what readers leave out is not drawn
STYLE = f"""* {{ stroke-width: {LINE}px !important; vector-effect: non-scaling-stroke !important;
fill: none !important; stroke-dasharray: none !important; stroke-linejoin: round !important;
marker: none !important; filter: none !important; }} text, image {{ display: none !important; }}"""
# the page's own scale is kept, but what lies beside the page is seen, too
SCRIPT = """([css, scale, low, wide, high]) => {
const root = document.documentElement, at = root.getScreenCTM();
const tag = document.createElementNS('http://www.w3.org/2000/svg', 'style');
tag.textContent = css; root.appendChild(tag);
const box = [(low - at.e) / at.a, (low - at.f) / at.d, wide / scale / at.a, high / scale / at.d];
root.setAttribute('viewBox', box.join(' ')); root.setAttribute('preserveAspectRatio', 'none');
root.setAttribute('width', wide + 'px'); root.setAttribute('height', high + 'px'); }"""

Picture = NDArray[np.bool_]


@pytest.fixture(scope="module")
def page() -> Iterator[Any]:
    with opened() as chromium:
        yield chromium.new_page(viewport={"width": WIDE, "height": HIGH}, bypass_csp=True)


def inked(page: Any, file: Path) -> Picture | None:
    """Pixels (HIGH, WIDE) that the browser draws lines on; None where it takes the file for no drawing."""
    import io

    import matplotlib.pyplot as plt

    page.goto(file.as_uri())
    if not page.evaluate("document.documentElement instanceof SVGSVGElement"):
        return None  # XML that is no SVG any more: nothing to compare with
    page.evaluate(SCRIPT, [STYLE, SCALE, LOW, WIDE, HIGH])
    picture = np.asarray(plt.imread(io.BytesIO(page.screenshot())))
    return np.asarray(picture[..., :3].min(axis=-1) < 0.9)


def read(file: Path) -> tuple[Picture, Picture]:
    """Pixels that lines are read at, those that are ignored among them or not."""
    found, rules = read_svg(file), Rules(None)
    every, kept = np.zeros((HIGH, WIDE), dtype=bool), np.zeros((HIGH, WIDE), dtype=bool)
    for stroke in found.strokes:
        points = SCALE * (stroke.sample(0.05) * found.unit / PX * (1.0, -1.0) - LOW)
        for a, b in pairwise(points):
            steps = int(min(4.0 * np.abs(b - a).max(), 1e5)) + 2
            x, y = (a + np.linspace(0.0, 1.0, steps)[:, None] * (b - a)).T
            seen = (x >= 0.0) & (x < WIDE) & (y >= 0.0) & (y < HIGH)
            at = y[seen].astype(int), x[seen].astype(int)
            every[at] = True
            if rules.kind(stroke) != "ignore":
                kept[at] = True
    return every, kept


def apart(ink: Picture, every: Picture, kept: Picture) -> float:
    """The larger part of the ink that was not read, and of what was read that is no ink."""

    def far(one: Picture, other: Picture) -> float:
        if not one.any():
            return 0.0
        return float((distance_transform_edt(~other)[one] > OFF).mean()) if other.any() else 1.0

    return max(far(ink, every), far(kept, ink))


@pytest.mark.parametrize("file", sorted(OWN.glob("*.svg")), ids=lambda file: file.stem)
def test_own_drawings_lie_where_the_browser_draws_them(page: Any, file: Path) -> None:
    ink = inked(page, file)
    assert ink is not None
    assert ink.sum() > 500
    assert apart(ink, *read(file)) < PART


def test_no_mutation_differs_without_a_remark(page: Any, tmp_path: Path) -> None:
    files = seeds(OWN, tmp_path)
    usual: dict[str, tuple[str, ...]] = {}
    for name, text in files:
        (tmp_path / name).write_bytes(text)
        if name.endswith(".svg"):
            usual[name] = read_drawing(tmp_path / name).remarks
    compared, differing = 0, []
    for number in range(COUNT):
        name, text = mutant(files, number)
        file = tmp_path / f"mutation-{number}.svg"
        if not name.endswith(".svg"):
            continue
        file.write_bytes(text)
        try:
            drawing = read_drawing(file)
        except InputError:
            continue
        if (ink := inked(page, file)) is None:
            continue
        compared += 1
        off = apart(ink, *read(file))
        if off > PART and not {*drawing.remarks} - {*usual[name]}:
            differing.append(f"{number} ({name}): {off:.1%}")
    assert compared > 50
    assert differing == []
