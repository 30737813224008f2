"""The window in a real browser: drop, slide, pull, undo, export; no errors, nobody else is asked, axe-core, a phone."""

from __future__ import annotations

import base64
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bh
from bh.scene.load import load_scene
from bh.studio import server
from bh.studio.opening import Opened
from bh.studio.sheets import of_library
from tests.unit.browsers import needs_browser
from tests.unit.studio_visits import PATIENCE, Visit

pytestmark = needs_browser
DATA = Path(__file__).resolve().parents[1] / "data"
PLAYED = """async ([data, type]) => {
  const video = document.createElement("video"), bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
  await new Promise((done) => {
    video.onloadeddata = done; video.onerror = done; video.src = URL.createObjectURL(new Blob([bytes], { type }));
  });
  return { width: video.videoWidth, error: video.error && video.error.message };
}"""
MIDDLE = """(name) => {
  const box = document.querySelector(`#flat g[data-crease=${name}] .hit`).getBoundingClientRect();
  return [box.left + box.width / 2, box.top + box.height / 2];
}"""


def test_fold_pull_undo_export(window: Visit, tmp_path: Path) -> None:
    """What a person does in three minutes; the scene that comes out ends in the shape that was seen."""
    page = window.page
    page.set_input_files("#file", DATA / "pleats.svg")
    page.wait_for_function("studio.sheet.name === 'pleats.svg'")
    page.locator("#percent").fill("30")
    window.rests("Object.values(head.asked)[0] > 0.5")
    assert page.locator("#badge").inner_text().startswith(("in equilibrium", "refined"))
    folded = window.points()
    node = int(np.argmax(folded[:, 0] + folded[:, 1]))
    x, y = page.evaluate(f"studio.place({node})")
    inside = page.evaluate(
        f"studio.place({int(np.argmin(np.linalg.norm(folded - folded.mean(axis=0), axis=1)))})"
    )
    x, y = x + 0.02 * (inside[0] - x), y + 0.02 * (inside[1] - y)  # just inside the rim
    page.mouse.move(x, y)
    page.mouse.down()
    for k in range(1, 6):
        page.mouse.move(x, y - 8 * k)
    page.mouse.up()
    window.rests("Object.keys(head.forces).length === 1")
    assert page.locator("#force").inner_text().endswith(" N")
    page.locator("#let-go").click()
    window.rests("Object.keys(head.forces).length === 0")
    np.testing.assert_allclose(window.points(), folded, atol=1e-3)
    page.locator("#percent").fill("40")
    window.rests("Object.values(head.asked)[0] > 1.2")
    page.keyboard.press("Control+z")
    window.rests("Object.values(head.asked)[0] < 1.2")
    np.testing.assert_allclose(window.points(), folded, atol=1e-3)
    with page.expect_download() as waiting:
        page.locator("#export").select_option("scene")
    waiting.value.save_as(tmp_path / "scene.zip")
    with zipfile.ZipFile(tmp_path / "scene.zip") as archive:
        archive.extractall(tmp_path)
    path = bh.trace(load_scene(tmp_path / "pleats.toml").model)
    np.testing.assert_allclose(path[-1].points, window.points(), atol=1e-3)
    assert window.told == []
    home = page.url.split("?")[0]
    assert [
        url for url in window.asked if not url.startswith((home, "ws://127.0.0.1", "blob:", "data:"))
    ] == []


def test_two_points_are_pinched_by_a_stroke_a_jaw_and_a_slider(window: Visit) -> None:
    """From one point to another jaws are set; dragged towards each other they press, and both by the same force."""
    page = window.page
    page.locator("#percent").fill("35")
    window.rests("Object.values(head.asked)[0] > 1")
    page.locator("#hand-pinch").check()
    (x, y), (u, v) = (page.evaluate(f"studio.place({node})") for node in (12, 165))
    page.mouse.move(x + 0.04 * (u - x), y + 0.04 * (v - y))
    page.mouse.down()
    page.mouse.move(x + 0.96 * (u - x), y + 0.96 * (v - y), steps=3)
    page.mouse.up()
    window.rests("head.pinches.length === 1")
    pinch = page.evaluate("studio.head.pinches[0]")
    assert pinch["force"] == pytest.approx(0.0, abs=1e-9)
    middle, along = np.array(pinch["middle"]), np.array(pinch["along"])
    (x, y), (u, v) = (
        page.evaluate(f"studio.spot({at.tolist()})") for at in (middle + 0.5 * pinch["gap"] * along, middle)
    )
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 0.2 * (u - x), y + 0.2 * (v - y), steps=3)
    page.mouse.up()
    window.rests("head.pinches[0].force > 0.1")
    closed = page.evaluate("studio.head.pinches[0]")
    assert closed["gap"] < 0.95 * pinch["gap"]
    one, two = (np.array(force) for force in page.evaluate("Object.values(studio.head.forces)"))
    assert np.linalg.norm(one + two) < 0.02 * np.linalg.norm(one)
    text = page.locator("#force").inner_text()
    assert text.startswith("pinch ")
    assert text.endswith("mm apart")
    page.locator("#gap").focus()
    page.keyboard.press("ArrowLeft")
    window.rests(f"head.pinches[0].gap < {closed['gap']}")
    page.locator("#let-go").click()
    window.rests("head.pinches.length === 0 && Object.keys(head.forces).length === 0")
    assert window.told == []


def test_a_finer_mesh_that_comes_during_a_stroke_is_put_off(
    window: Visit, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a hand points at stays the mesh that it took hold of, so that no stroke is lost."""
    monkeypatch.setattr(server, "QUIET", 1.5)  # long enough for the button to be down
    page, before = window.page, window.finer
    page.locator("#percent").fill("35")
    window.rests("Object.values(head.asked)[0] > 1")
    page.locator("#hand-pinch").check()
    (x, y), (u, v) = (page.evaluate(f"studio.place({node})") for node in (12, 165))
    page.mouse.move(x + 0.04 * (u - x), y + 0.04 * (v - y))
    page.mouse.down()
    for _ in range(PATIENCE // 100):
        page.wait_for_timeout(100)
        if window.finer > before:
            break
    assert window.finer > before
    assert not page.evaluate("studio.refined")
    page.mouse.move(x + 0.96 * (u - x), y + 0.96 * (v - y), steps=3)
    page.mouse.up()
    window.rests("head.pinches.length === 1")
    pinch = page.evaluate("studio.head.pinches[0]")
    assert pinch["a"] == 12
    ends = [page.evaluate(f"studio.place({node})") for node in (pinch["b"], 165)]
    assert np.linalg.norm(np.subtract(*ends)) < 60.0  # pixels: the end of the stroke, or its neighbour
    assert window.told == []


def test_the_sheet_that_is_turned_is_seen_refined_again(window: Visit) -> None:
    """A hand beside the sheet asks for nothing: when it lets go, the finer mesh that is there is shown."""
    page = window.page
    page.locator("#percent").fill("30")
    page.wait_for_function("studio.refined && Object.values(studio.head.asked)[0] > 0.5")
    box = page.locator("#folded").bounding_box()
    before = page.evaluate("studio.place(12)")
    page.mouse.move(box["x"] + 8, box["y"] + 8)
    page.mouse.down()
    assert not page.evaluate("studio.refined")
    page.mouse.move(box["x"] + 60, box["y"] + 30, steps=3)
    page.mouse.up()
    assert page.evaluate("studio.refined")
    assert (
        np.linalg.norm(np.subtract(page.evaluate("studio.place(12)"), before)) > 5.0
    )  # pixels: it was turned
    assert window.told == []


def test_a_recording_is_played_and_saved_as_a_film_and_a_picture(window: Visit, tmp_path: Path) -> None:
    page, image = window.page, pytest.importorskip("PIL.Image")
    page.locator("#record").click()
    for value in (10, 20, 30):
        page.locator("#percent").fill(str(value))
        window.rests(f"Math.abs(Object.values(head.asked)[0] - {0.01 * value} * Math.PI) < 0.01")
    page.locator("#record").click()
    page.locator("#percent").fill("5")
    window.rests("Object.values(head.asked)[0] < 0.2")
    for what, frames in (("film", 3), ("picture", 1)):
        with page.expect_download() as waiting:
            page.locator("#export").select_option(what)
        file = tmp_path / waiting.value.suggested_filename
        waiting.value.save_as(file)
        with image.open(file) as found:
            assert getattr(found, "n_frames", 1) >= frames
            colours = found.convert("RGB").getcolors(10**6)
            assert len(colours) > 50  # the sheet is on it
    window.rests("Object.values(head.asked)[0] > 0.9")
    with page.expect_download() as waiting:  # as the browser writes it
        page.locator("#export").select_option("mp4")
    kind = waiting.value.suggested_filename.rsplit(".", 1)[1]
    assert kind.lower() in page.locator("#export option[value=mp4]").inner_text().lower()
    waiting.value.save_as(tmp_path / f"film.{kind}")
    data = (tmp_path / f"film.{kind}").read_bytes()
    assert data[4:8] == b"ftyp" if kind == "mp4" else data[:4] == b"\x1a\x45\xdf\xa3"
    shown = page.evaluate(PLAYED, [base64.b64encode(data).decode(), f"video/{kind}"])
    assert shown["width"] > 300
    assert shown["error"] is None
    assert window.told == []


def test_numbers_of_a_pattern_and_springs_of_creases(window: Visit) -> None:
    page = window.page
    page.locator("#values input[data-key=width]").fill("35")
    page.locator("#values input[data-key=width]").press("Enter")
    page.wait_for_function("studio.sheet.values.width === 35")
    page.locator("#percent").fill("30")
    page.locator("#each summary").click()
    page.locator("#Lstar").fill("10")
    page.locator("#spring").click()
    page.wait_for_function("studio.sheet.springs.crease === 10")
    window.rests("head.folds.crease > 0.5 && head.folds.crease < 0.999 * head.asked.crease")


def test_who_has_no_pointer_pulls_and_pinches_by_numbers(window: Visit) -> None:
    page = window.page
    page.get_by_text("Pull or pinch by numbers").first.click()
    page.locator("#node-a").fill("12")
    page.locator("#take").press("Enter")
    page.locator("#lift").press("ArrowRight")
    window.rests("Object.keys(head.forces).length === 1 && Math.hypot(...head.forces[12]) > 0")
    page.locator("#node-b").fill("165")
    page.locator("#take").press("Enter")
    window.rests("head.pinches.length === 1 && Object.keys(head.forces).length === 2")


def test_what_cannot_be_opened_is_said_in_the_window(window: Visit, tmp_path: Path) -> None:
    bad = tmp_path / "bad.svg"
    bad.write_text("no drawing at all")
    window.page.set_input_files("#file", bad)
    window.page.wait_for_function(
        "!document.getElementById('message').hidden && /bad/.test(message.textContent)"
    )
    assert window.page.evaluate("studio.sheet.name") == "arc"


def test_a_point_pulled_to_infinity_is_one_line_and_the_sheet_stays(window: Visit) -> None:
    """Places beyond all sense are refused; then it folds on."""
    page = window.page
    page.locator("#percent").fill("20")
    window.rests("Object.values(head.asked)[0] > 0.5")
    before = window.points()
    for to, words in (("[1e999, 0, 0]", "cannot be asked"), ("[1e9, 0, 1e9]", "mm away, the sheet is")):
        page.evaluate(
            f"import('./static/common.js').then((all) => all.ask({{ do: 'pull', node: 0, to: {to} }}))"
        )
        page.locator("#message", has_text=words).wait_for()
        assert "\n" not in page.locator("#message").inner_text()
        np.testing.assert_array_equal(window.points(), before)
    page.locator("#percent").fill("25")
    window.rests("Object.values(head.asked)[0] > 0.7")
    assert window.told == []


def test_a_network_that_drops_is_one_line_and_the_last_state_stays(chromium: Any) -> None:
    """The server goes; the sheet stays on the screen, one line says so, and a new server is found again."""
    opened = Opened(of_library("strip"))
    port = int(opened.address.split(":")[2].split("/")[0])
    seen = Visit(chromium, opened.address)
    seen.page.locator("#percent").fill("20")
    seen.rests("Object.values(head.asked)[0] > 0.5")
    before = seen.points()
    opened.close()
    line = seen.page.locator("#message", has_text="The connection to bh is gone")
    line.wait_for()
    assert "\n" not in line.inner_text()
    seen.page.locator("#percent").fill("40")  # nobody hears it
    np.testing.assert_array_equal(seen.points(), before)
    assert seen.page.locator("#badge").inner_text() == "not connected"
    again = Opened(of_library("strip"), port)
    again._studio.token = opened._studio.token  # so that the page finds it
    seen.page.locator(
        "#message", has_text="is back"
    ).wait_for()  # else the state of before is the one that rests
    seen.rests("Object.values(head.asked)[0] > 0.5")
    np.testing.assert_allclose(seen.points(), before, atol=1e-3)
    again.close()
    seen.context.close()


def test_a_crease_lights_up_and_a_dot_holds(window: Visit) -> None:
    page = window.page
    page.locator("#flat g[data-crease]").first.focus()
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.dataset.crease") == "crease"
    assert "lit" in (page.locator("#flat g[data-crease]").first.get_attribute("class") or "")
    held = page.evaluate("studio.sheet.held.length")
    page.locator("#flat circle:not(.held)").first.focus()
    page.keyboard.press("Space")
    page.wait_for_function(f"studio.sheet.held.length === {held + 1}")


def test_kinds_of_creases_and_contact_are_changed(window: Visit) -> None:
    """By a click and a choice, by a key, and by the box: the crease goes the other way, panels stop each other."""
    page = window.page
    page.locator("#library").select_option("strip")
    page.wait_for_function("studio.sheet.name === 'strip'")
    page.locator("#percent").fill("20")
    window.rests("Object.values(head.asked)[0] > 0.5")
    page.mouse.click(*page.evaluate(MIDDLE, "crease-2"))  # a straight line has no box to click
    assert page.evaluate("document.activeElement.dataset.crease") == "crease-2"
    assert page.locator("#kind").input_value() == "valley"
    page.locator("#kind").select_option("flat")
    window.rests("Object.keys(head.folds).length === 1")
    page.locator("#flat g[data-crease=crease-2]").focus()
    page.keyboard.press("m")
    window.rests("Math.abs(head.folds['crease-2'] - 0.2 * Math.PI) < 1e-6")
    assert page.evaluate("studio.sheet.creases[1].fold") == "mountain"
    assert page.evaluate("document.activeElement.dataset.crease") == "crease-2"  # it stays where it was
    assert page.locator("#spring-of").input_value() == "crease-2"
    page.locator("#contact").check()
    page.wait_for_function("studio.sheet.contact")
    window.rests("Object.values(head.asked)[0] > 0.5")
    assert page.locator("#meets").inner_text() == "stop each other"
    assert window.told == []


def test_colours_have_a_scale_with_a_unit(window: Visit) -> None:
    page = window.page
    page.locator("#percent").fill("30")
    window.rests("Object.values(head.asked)[0] > 0.5")
    for name, unit in (("stress", "MPa"), ("curvature", "1/mm"), ("bending", "N mm / mm²")):
        page.locator("#colour").select_option(name)
        page.wait_for_function(f"document.getElementById('unit').textContent.endsWith('{unit}')")
        assert float(page.locator("#top").inner_text()) > 0.0
    page.locator("#colour").select_option("none")
    page.wait_for_function("document.getElementById('scale').hidden")


def test_at_rest_it_is_refined_and_a_hand_brings_the_coarse_mesh_back(window: Visit) -> None:
    page = window.page
    page.locator("#percent").fill("30")
    page.wait_for_function("studio.refined && Object.values(studio.head.asked)[0] > 0.5", timeout=60_000)
    assert page.locator("#badge").inner_text().startswith("refined: 1164 triangles, energy within about ")
    x, y = page.evaluate("studio.place(150)")
    page.mouse.move(x, y)
    page.mouse.down()
    assert not page.evaluate("studio.refined")  # at once
    page.mouse.up()
    page.locator("#percent").fill("35")
    assert not page.evaluate("studio.refined")
    page.wait_for_function("studio.refined && Object.values(studio.head.asked)[0] > 1.0", timeout=60_000)
    assert window.told == []


def test_the_frame_of_a_notebook_is_the_same_window(chromium: Any) -> None:
    """In a page of another origin, as Jupyter's is: it folds there."""
    opened = Opened(of_library("strip"))
    page = chromium.new_context(bypass_csp=True).new_page()
    page.set_content(f"<h1>a notebook</h1>{opened._repr_html_()}")
    frame = page.frame_locator("iframe")
    frame.locator("#percent").fill("30", timeout=PATIENCE)
    frame.locator("#percent-out", has_text="30.0 %").wait_for(timeout=PATIENCE)
    page.close()
    opened.close()


@pytest.mark.parametrize(("width", "scheme"), [(360, "dark"), (1400, "light"), (2560, "dark")])
def test_nobody_is_shut_out(chromium: Any, address: str, width: int, scheme: str) -> None:
    """axe-core finds nothing, and nothing is wider than the window."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed").Axe()
    seen = Visit(chromium, address, width, color_scheme=scheme)
    violations = axe.run(seen.page).response["violations"]
    assert [(item["id"], [node["html"][:90] for node in item["nodes"]]) for item in violations] == []
    assert seen.page.evaluate("document.documentElement.scrollWidth") <= width
    seen.context.close()


def test_where_a_run_from_flat_ends_is_told_of_what_is_seen_only(window: Visit) -> None:
    """A word of it that comes behind the next wish is old."""
    window.page.locator("#percent").fill("30")
    window.rests("Object.values(head.asked)[0] > 0.5")
    badges = window.page.evaluate(
        """async () => {
          const { branch } = await import("./static/finer.js"), { ask } = await import("./static/common.js");
          const told = () => {
            branch({ here: false, said: "elsewhere" });
            return document.getElementById("badge").textContent;
          };
          const before = told();
          ask({ do: "percent", value: 31 });
          return [before, told()];
        }"""
    )
    assert ["another branch" in badge for badge in badges] == [True, False]


def test_a_drawing_that_was_refused_is_not_laid_again(chromium: Any, tmp_path: Path) -> None:
    """Behind a network that drops lies what was seen before, in its material and not the file that was no drawing."""
    first = Opened(of_library("strip"))
    port = int(first.address.split(":")[2].split("/")[0])
    seen = Visit(chromium, first.address)
    seen.page.locator("#library").select_option("arc")
    seen.page.wait_for_function("studio.sheet.name === 'arc'")
    seen.page.locator("#t").fill("0.4")
    seen.page.keyboard.press("Enter")
    seen.page.wait_for_function("studio.sheet.material.t === 0.4")
    (tmp_path / "bad.svg").write_text("no drawing at all")
    seen.page.set_input_files("#file", tmp_path / "bad.svg")
    seen.page.locator("#message", has_text="bad").wait_for()
    seen.page.locator("#percent").fill("20")
    seen.rests("Object.values(head.asked)[0] > 0.5")
    first.close()
    seen.page.locator("#message", has_text="is gone").wait_for()
    again = Opened(of_library("strip"), port)
    again._studio.token = first._studio.token  # so that the page finds it
    seen.page.locator("#message", has_text="is back").wait_for()
    seen.rests("Object.values(head.asked)[0] > 0.5")
    assert seen.page.evaluate("[studio.sheet.name, studio.sheet.material.t]") == ["arc", 0.4]
    again.close()
    seen.context.close()
