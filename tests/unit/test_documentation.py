"""The documentation site: every example runs, it builds without a warning, and its links lead somewhere."""

from __future__ import annotations

import subprocess
import sys
from importlib import util
from pathlib import Path
from types import ModuleType
from urllib.parse import unquote

import pytest

import bh
from reports.pdf import browser
from tests.unit.test_plotting import needs_opengl
from tests.unit.test_report import Page

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = sorted((ROOT / "examples").glob("*.py"))
SCENES = sorted((ROOT / "examples").glob("*.toml"))
SECONDS = 600


def site_builder() -> ModuleType:
    spec = util.spec_from_file_location("build_site", ROOT / "docs" / "build_site.py")
    assert spec is not None
    assert spec.loader is not None
    found = util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


@needs_opengl
@pytest.mark.parametrize("file", SCRIPTS, ids=lambda file: file.stem)
def test_scripts_of_the_gallery_run(file: Path, tmp_path: Path) -> None:
    """Every file that a script names is there afterwards."""
    done = subprocess.run(
        [sys.executable, str(file)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=SECONDS,
    )
    assert done.returncode == 0, done.stderr
    text = file.read_text(encoding="utf-8")
    made = {found.name for found in tmp_path.iterdir()}
    assert made
    for name in made:
        assert f'"{name}"' in text
    assert {part for part in text.split('"') if part.startswith(f"{file.stem}") and "." in part} == made


def test_reference_has_every_public_name(tmp_path: Path) -> None:
    builder = site_builder()
    builder.write_reference(tmp_path / "reference")
    pages = {file.stem: file.read_text(encoding="utf-8") for file in (tmp_path / "reference").glob("*.rst")}
    everything = "\n".join(pages.values())
    for name in (
        "bh.Model",
        "bh.trace",
        "bh.Path",
        "meshes.structured",
        "bh.plotting.response",
        "bh.plotting.interactive.view",
    ):
        assert f":: {name}\n" in everything
    for name in bh.__all__:
        assert f":: bh.{name}\n" in pages["bh"]
    assert "   bh.plotting" in pages["index"]


def test_every_example_is_in_the_readme_of_the_examples() -> None:
    text = (ROOT / "examples" / "README.md").read_text(encoding="utf-8")
    for file in (*SCENES, *SCRIPTS):
        assert f"`{file.name}`" in text


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("sphinx", reason="sphinx is not installed")
    folder = tmp_path_factory.mktemp("docs")
    done = subprocess.run(
        [sys.executable, str(ROOT / "docs" / "build_site.py"), str(folder)],
        capture_output=True, text=True, check=False, timeout=SECONDS,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return folder / "html"


@needs_opengl
def test_pages_link_to_each_other_and_load_nothing_from_elsewhere(site: Path) -> None:
    files = {file: Page(file.read_text(encoding="utf-8")) for file in site.rglob("*.html")}
    shown = {file: page for file, page in files.items() if "_downloads" not in file.parts}
    assert len(shown) > 30
    ids = {file: {a["id"] for _, a in page.found if a.get("id")} for file, page in shown.items()}
    for file, page in shown.items():
        for tag, attributes in page.found:
            for name in ("src", "href"):
                link = attributes.get(name) or ""
                outside = "://" in link.split("?")[0]
                assert not outside or tag == "a", f"{file.name}: <{tag} {name}={link}>"
                if outside or link.startswith(("data:", "mailto:")) or not link:
                    continue
                other, _, anchor = unquote(link).partition("#")
                there = (file.parent / other.split("?")[0]).resolve() if other else file
                assert there.exists(), f"{file.name}: {link}"
                # listings of source link back to the page, at times with the name that another page gives it
                if anchor and there in ids and tag == "a" and "_modules" not in file.parts:
                    assert anchor in ids[there], f"{file.name}: {link}"
    gallery = {file.stem for file in (site / "gallery").glob("*.html")}
    assert gallery == {"index", *(file.stem for file in (*SCENES, *SCRIPTS))}


@needs_opengl
@pytest.mark.skipif(browser() is None, reason="no chromium or chrome on this machine; .ci/run installs it")
def test_sheets_of_the_gallery_turn(site: Path) -> None:
    from tests.unit.test_report_browser import HARMLESS, OPTIONS, visit

    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with api.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=browser(), args=[*OPTIONS, "--no-sandbox"])
        seen = visit(chromium, site / "gallery" / "pleats.html")
        seen.settle()
        assert [told for told in seen.told if HARMLESS not in told] == []
        assert all(url.startswith(("file:", "data:", "blob:")) for url in seen.asked)
        chromium.close()
