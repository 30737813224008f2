"""The documentation site: every example runs, it builds without a warning, and its links lead somewhere."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
import subprocess
import sys
from importlib import util
from pathlib import Path
from types import ModuleType
from typing import Any
from urllib.parse import unquote

import pytest

import bh
from bh.formulations.protocols import Formulation
from bh.loading.builder import load_steps
from bh.scene.load import load_scene
from bh.solvers.system import System
from tests.unit.browsers import needs_browser
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


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The sources of the reference, by the name of the module that each describes, and its index."""
    folder = tmp_path_factory.mktemp("sources") / "reference"
    site_builder().write_reference(folder)
    return {file.stem: file.read_text(encoding="utf-8") for file in folder.glob("*.rst")}


def own_names(module: ModuleType) -> list[str]:
    """Classes and functions that are defined in a module and have no underscore."""
    return [
        name
        for name, value in vars(module).items()
        if not name.startswith("_")
        and (inspect.isclass(value) or inspect.isfunction(value))
        and value.__module__ == module.__name__
    ]


def modules_of(package: str) -> list[ModuleType]:
    path = importlib.import_module(package).__path__
    return [importlib.import_module(found.name) for found in pkgutil.walk_packages(path, f"{package}.")]


def described(reference: dict[str, str]) -> set[int]:
    """Identities of all objects that the reference has a description of."""
    found = set()
    for text in reference.values():
        for line in text.splitlines():
            if line.startswith((".. autoclass::", ".. autofunction::")):
                module, _, name = line.split(":: ")[1].rpartition(".")
                found.add(id(getattr(importlib.import_module(module), name)))
    return found


def test_reference_has_every_public_name_of_bh(reference: dict[str, str]) -> None:
    assert len(bh.__all__) >= 30
    for name in bh.__all__:
        assert f":: bh.{name}\n" in reference["bh"]


@pytest.mark.parametrize("short", sorted(bh._SUBMODULES))
def test_reference_has_every_public_module_of_bh(reference: dict[str, str], short: str) -> None:
    module = getattr(bh, short)
    page = reference[module.__name__]
    assert f"``bh.{short}``" in page
    assert f"   {module.__name__}\n" in reference["index"]
    public = [
        name for name in getattr(module, "__all__", own_names(module)) if callable(getattr(module, name))
    ]
    assert public
    missing = [name for name in public if id(getattr(module, name)) not in described(reference)]
    assert missing == []


@pytest.mark.parametrize("package", ["fem", "meshes"])
def test_reference_has_every_public_class(reference: dict[str, str], package: str) -> None:
    there = described(reference)
    found = {
        f"{module.__name__}.{name}": getattr(module, name)
        for module in modules_of(package)
        for name in own_names(module)
        if inspect.isclass(getattr(module, name))
    }
    assert len(found) >= 15
    assert [name for name, value in found.items() if id(value) not in there] == []


def test_reference_has_what_extensions_are_made_from(reference: dict[str, str]) -> None:
    """The bases of what docs/extending.md adds, wherever they are defined."""
    there = described(reference)
    for base in (bh.Support.__bases__[0], bh.Fold.__bases__[0], Formulation, System):
        assert id(base) in there, base


def test_what_docs_import_by_its_full_name_is_in_the_reference(reference: dict[str, str]) -> None:
    there = described(reference)
    imports = r"^from ((?:bh|fem|meshes)[\w.]*) import ([\w, ]+)$"
    found = [
        (file.name, module, name)
        for file in (*(ROOT / "docs").glob("*.md"), ROOT / "README.md", *(ROOT / "examples").rglob("*.py"))
        if file.name != "extending.md"  # imports what it derives from, private modules of a formulation too
        for module, names in re.findall(imports, file.read_text(encoding="utf-8"), re.MULTILINE)
        for name in names.split(", ")
    ]
    assert len(found) >= 5
    values = [(file, name, getattr(importlib.import_module(module), name)) for file, module, name in found]
    assert [(file, name) for file, name, value in values if callable(value) and id(value) not in there] == []


def test_every_example_is_in_the_readme_of_the_examples() -> None:
    text = (ROOT / "examples" / "README.md").read_text(encoding="utf-8")
    for file in (*SCENES, *SCRIPTS):
        assert f"`{file.name}`" in text


def built(folder: Path, *options: str) -> Path:
    """The pages of the site, built by its own command."""
    pytest.importorskip("sphinx", reason="sphinx is not installed")
    done = subprocess.run(
        [sys.executable, str(ROOT / "docs" / "build_site.py"), str(folder), *options],
        capture_output=True,
        text=True,
        check=False,
        timeout=SECONDS,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return folder / "html"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With the gallery, which runs every example for some two minutes, and without the reference."""
    return built(tmp_path_factory.mktemp("docs"), "--no-reference")


def links_lead_somewhere(site: Path) -> None:
    """Every link of every page, and every name in a page that a link leads to; nothing comes from elsewhere."""
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


def test_pages_link_to_each_other_and_load_nothing_from_elsewhere(tmp_path: Path) -> None:
    """The pages alone; with gallery and reference they are slow tests, and what `make docs` builds."""
    links_lead_somewhere(built(tmp_path, "--no-reference", "--no-gallery"))


@pytest.mark.parametrize("file", SCENES, ids=lambda file: file.stem)
def test_scenes_of_the_gallery_are_read(file: Path) -> None:
    """And meshed, and their steps become loads; the gallery solves them."""
    model = load_scene(file).model
    assert len(load_steps(model)) == len(model.steps)


@pytest.mark.slow
@needs_opengl
def test_the_gallery(site: Path) -> None:
    links_lead_somewhere(site)
    gallery = {file.stem for file in (site / "gallery").glob("*.html")}
    assert gallery == {"index", "cookbook", *(file.stem for file in (*SCENES, *SCRIPTS))}


@pytest.mark.slow
def test_the_whole_site(tmp_path: Path) -> None:
    """With the reference, whose docstrings give no warning, and the listings of source."""
    site = built(tmp_path, "--no-gallery")
    links_lead_somewhere(site)
    assert len(list((site / "reference").glob("*.html"))) > 50


@pytest.mark.slow
@needs_opengl
@pytest.mark.parametrize("file", SCRIPTS, ids=lambda file: file.stem)
def test_scripts_of_the_gallery_run(file: Path, site: Path) -> None:
    """Every file that a script names is there afterwards, and no other; the site is built by running each."""
    text = file.read_text(encoding="utf-8")
    folder = site.parent / "source" / "gallery"
    cookbook = {entry.stem for entry in (ROOT / "examples" / "cookbook").glob("*.py")}  # their pictures
    there = [found for found in folder.iterdir() if found.stem not in cookbook]
    made = {found.name for found in there if found.name.startswith(file.stem) and found.suffix != ".md"}
    assert made
    for name in made:
        assert f'"{name}"' in text
    assert {part for part in text.split('"') if part.startswith(f"{file.stem}") and "." in part} == made
    stems = tuple(other.stem for other in (*SCENES, *SCRIPTS))
    others = {found.name for found in there if not found.name.startswith(stems)}
    assert others == {"index.md", "cookbook.md"}


@pytest.mark.slow
@needs_opengl
@needs_browser
def test_sheets_of_the_gallery_turn(chromium: Any, site: Path) -> None:
    from tests.unit.test_report_browser import HARMLESS, visit

    seen = visit(chromium, site / "gallery" / "pleats.html")
    seen.settle()
    assert [told for told in seen.told if HARMLESS not in told] == []
    assert all(url.startswith(("file:", "data:", "blob:")) for url in seen.asked)
