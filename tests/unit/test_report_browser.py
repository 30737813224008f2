"""The report in a real browser: no errors, no requests, sheets to turn, links, axe-core, a phone, the dark."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

import bh
import meshes
from bh.plotting import interactive
from reports.build import build
from tests.unit.browsers import needs_browser
from tests.unit.test_report import results, write

pytestmark = needs_browser
PAGES = ("report.html", "report/chapter-3.html", "report/appendix-b.html", "report/solver.html")
PATIENCE = 120_000  # ms; on a busy machine plotly takes its time
HARMLESS = "willReadFrequently"  # advice to plotly about its speed


@dataclass
class Visit:
    """A page that is open, and what the browser had to say."""

    page: Any
    told: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)

    def settle(self) -> None:
        """Wait until all sheets are drawn; they begin when they come into view."""
        for sheet in self.page.query_selector_all(".sheet3d"):
            sheet.scroll_into_view_if_needed()
            self.page.wait_for_selector(f"#{sheet.get_attribute('id')}[data-ready=yes]", timeout=PATIENCE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report whose chapter 3 has two models of a sheet to turn."""
    found = tmp_path_factory.mktemp("results")
    data = results(found)
    paths = {}
    for along in (4, 8):
        mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.8), along=along)
        model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127)).support("rigid-body")
        for angle in (2.8, 2.4, 2.0, 1.6):
            model = model.fold("crease", to=angle)
        paths[f"{along} cells"] = bh.trace(model)
    (found / "cone.frames.json").write_text(json.dumps(interactive.view(paths).data))
    scene = {
        "file": "cone.frames.json",
        "still": "sheet.png",
        "title": "Two meshes",
        "alt": "A folded sector",
    }
    data["cases"][1]["scenes"] = [scene]
    write(found, data)
    build(found, found / "report.html")
    return found


def visit(chromium: Any, file: Path, width: int = 1200, **options: Any) -> Visit:
    page = chromium.new_page(viewport={"width": width, "height": 900}, **options)
    page.set_default_timeout(PATIENCE)
    found = Visit(page)
    page.on("console", lambda message: found.told.append(f"{message.type}: {message.text}"))
    page.on("pageerror", lambda error: found.told.append(f"error: {error}"))
    page.on("request", lambda request: found.asked.append(request.url))
    page.goto(file.as_uri())
    return found


@pytest.mark.parametrize("name", PAGES)
def test_pages_load_by_themselves(chromium: Any, folder: Path, name: str) -> None:
    """No error, no warning, and nothing is asked of any other machine."""
    seen = visit(chromium, folder / name)
    seen.settle()
    assert [told for told in seen.told if HARMLESS not in told] == []
    home = folder.as_uri()
    assert [
        url for url in seen.asked if not url.startswith((home, "data:", f"blob:{home}", "blob:null"))
    ] == []
    if name.endswith("chapter-3.html"):
        assert any(url.endswith("plotly.min.js") for url in seen.asked)
    seen.page.close()


def test_the_slider_changes_the_picture(chromium: Any, folder: Path) -> None:
    seen = visit(chromium, folder / "report" / "chapter-3.html")
    seen.settle()
    page = seen.page
    sheet = page.locator(".sheet3d")
    assert not sheet.locator("img").is_visible()  # the still picture has made room
    slider, energies = sheet.locator("input[type=range]"), sheet.locator(".energies")
    last = int(slider.get_attribute("max"))
    assert last >= 4
    assert slider.input_value() == str(last)

    def pictured(frame: int) -> tuple[bytes, str]:
        slider.fill(str(frame))
        page.wait_for_selector(f'.sheet3d[data-frame="{frame}"]')
        page.wait_for_timeout(300)
        return sheet.locator(".canvas").screenshot(), energies.inner_text()

    folded, flat = pictured(last), pictured(0)
    assert folded[0] != flat[0]
    assert coloured(folded[0]) > 2_000  # a sheet is drawn at all
    assert coloured(flat[0]) > 2_000
    assert flat[1] == "Bending energy, N mm: 4 cells 0 · 8 cells 0"
    assert folded[1] != flat[1]
    slider.focus()
    page.keyboard.press("ArrowRight")
    page.wait_for_selector('.sheet3d[data-frame="1"]')
    sheet.locator("select").select_option("stretching")
    assert seen.told == [told for told in seen.told if HARMLESS in told]
    page.close()


def coloured(picture: bytes) -> int:
    """How many pixels of a picture are neither grey nor white."""
    import io

    import numpy as np
    from PIL import Image

    pixels = np.asarray(Image.open(io.BytesIO(picture)).convert("RGB"), dtype=int)
    return int((np.ptp(pixels, axis=2) > 40).sum())


def test_without_scripts_there_is_a_picture(chromium: Any, folder: Path) -> None:
    seen = visit(chromium, folder / "report" / "chapter-3.html", java_script_enabled=False)
    assert seen.page.locator(".sheet3d img").is_visible()
    assert not seen.page.locator(".sheet3d .controls").is_visible()
    seen.page.close()


def test_links_lead_to_pages_and_places(chromium: Any, folder: Path) -> None:
    seen = visit(chromium, folder / "report.html")
    page = seen.page
    for name in ("Chapter 3", "Solver", "Verdict"):
        page.get_by_role("navigation").get_by_role("link", name=name).click()
        assert page.get_by_role("navigation").locator("[aria-current=page]").inner_text().endswith(name)
    page.locator("summary").click()
    page.locator(".failures a").first.click()
    page.wait_for_url("**/report/chapter-3.html#check-*")
    assert page.evaluate("document.querySelector(':target').classList.contains('fail')")
    page.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("name", PAGES)
def test_no_serious_violation_of_accessibility(chromium: Any, folder: Path, name: str, scheme: Any) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed").Axe()
    # the policy of the pages keeps foreign scripts out, this one too
    bare = chromium.new_page(bypass_csp=True, color_scheme=scheme)
    bare.goto((folder / name).as_uri())
    Visit(bare).settle()
    found = [
        f"{item['id']}: {item['nodes'][0]['html'][:160]}"
        for item in axe.run(bare).response["violations"]
        if item["impact"] in ("serious", "critical")
    ]
    assert found == []
    bare.close()


@pytest.mark.parametrize("width", [500, 360])
@pytest.mark.parametrize("name", PAGES)
def test_nothing_is_wider_than_a_phone(chromium: Any, folder: Path, name: str, width: int) -> None:
    seen = visit(chromium, folder / name, width=width)
    seen.settle()
    assert seen.page.evaluate("document.documentElement.scrollWidth") <= width
    seen.page.close()


def test_a_notebook_shows_the_sheet(chromium: Any, tmp_path: Path) -> None:
    """What a notebook puts into its page draws itself there, apart from the page's own scripts."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.8), along=4)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127)).fold("crease", to=2.4)
    shown = interactive.view(bh.trace(model))._repr_html_()
    notebook = tmp_path / "notebook.html"
    notebook.write_text(f"<!DOCTYPE html><title>Notebook</title><body>{shown}</body>", encoding="utf-8")
    seen = visit(chromium, notebook)
    frame = seen.page.frame_locator("iframe")
    frame.locator(".sheet3d[data-ready=yes]").wait_for(timeout=PATIENCE)
    assert frame.locator("canvas").count() >= 1
    assert [told for told in seen.told if HARMLESS not in told] == []
    seen.page.close()
