"""What README.md and docs/ promise: their code runs, their links lead somewhere, their commands exist."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest
import typer.main

import bh
import bh.commands.cli
from bh.plotting import offscreen
from verification.framework.cases import ALL_CASES

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), ROOT / "examples" / "README.md"]
README = PAGES[0].read_text(encoding="utf-8")
GROUP = typer.main.get_command(bh.commands.cli.app)
assert isinstance(GROUP, typer.core.TyperGroup)
COMMANDS = GROUP.commands

FENCED = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
INDENTED = re.compile(r"^(?:    .*\n)+", re.MULTILINE)
SPAN = re.compile(r"`([^`\n]+)`")
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")


def drawable() -> bool:
    try:
        offscreen.window()
    except offscreen.PlotError:
        return False
    return True


def block(language: str) -> str:
    """The one block of README in this language."""
    (found,) = (text for name, text in FENCED.findall(README) if name == language)
    return str(found)


def code(text: str) -> Iterator[str]:
    """The lines of a page that are meant to be typed or looked up: blocks and `spans`, without comments."""
    for _, found in FENCED.findall(text):
        yield from (line.split("#")[0] for line in found.splitlines())
    prose = FENCED.sub("", text)
    for found in INDENTED.findall(prose):
        yield from (line.split("#")[0] for line in found.splitlines())
    yield from SPAN.findall(prose)


def all_code() -> list[str]:
    return [line for page in PAGES for line in code(page.read_text(encoding="utf-8"))]


def broken_links(page: Path) -> list[str]:
    """Relative links of a page to files that are not there."""
    links = LINK.findall(page.read_text(encoding="utf-8"))
    local = [link for link in links if not re.match(r"[a-z]+:|#", link)]
    return [link for link in local if not (page.parent / link.split("#")[0]).exists()]


def make_targets(lines: list[str]) -> set[str]:
    words = [re.findall(r"^\s*(?:\w+=\S+ )*make ([a-z]+)", line) for line in lines]
    return {target for found in words for target in found}


def bh_lines(lines: list[str]) -> list[list[str]]:
    """Command lines of `bh`, split into words, without `bh` itself."""
    found = [re.match(r"\s*(?:\S*/)?bh (.+)", line) for line in lines]
    return [match[1].split() for match in found if match]


# --- the code of the README -------------------------------------------------------------------------------------


@pytest.mark.skipif(not drawable(), reason="no OpenGL library: apt-get install libegl1 libgl1-mesa-dri")
def test_python_of_readme_runs(tmp_path: Path) -> None:
    (tmp_path / "ten_lines.py").write_text(block("python"), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "ten_lines.py"], cwd=tmp_path, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    first, last = done.stdout.splitlines()
    assert first.startswith("reached ")
    bending, fold = map(float, last.split())
    assert bending > 0.0
    assert fold == pytest.approx(3.141592653589793 - 1.571, abs=1e-9)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["folded.png", "ten_lines.py"]
    assert (tmp_path / "folded.png").read_bytes().startswith(b"\x89PNG")


def test_scene_of_readme_reaches_its_end(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(block("toml"), encoding="utf-8")
    scene = bh.load_scene(tmp_path / "scene.toml")
    path = bh.trace(scene.model)
    assert path.outcome == "reached"
    # against the spring the crease stays behind its rest angle, which the README gives with two decimals
    assert 1.0 < path[-1].fold_angle("crease").mean() < 3.141592653589793 - 1.57


# --- links ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    assert broken_links(page) == []


def test_links_are_found(tmp_path: Path) -> None:
    """The README has links, and one that leads nowhere would be told."""
    assert len(LINK.findall(README)) >= 6
    page = tmp_path / "page.md"
    page.write_text("[a](page.md) [b](page.md#part) ![c](no.png) [d](https://example.org/no) [e](no/)")
    assert broken_links(page) == ["no.png", "no/"]


# --- commands ---------------------------------------------------------------------------------------------------


def test_make_targets_exist() -> None:
    assert make_targets(list(code(README))) >= {"report", "test"}
    there = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    assert make_targets(all_code()) <= there


def test_bh_commands_and_their_options_exist(capsys: pytest.CaptureFixture[str]) -> None:
    lines = bh_lines(all_code())
    assert {words[0] for words in lines} >= {"run", "verify"}
    assert bh.commands.cli.main(["--help"]) == 0
    of_any = set(
        re.findall(r"--allow-[a-z]+", capsys.readouterr().out)
    )  # what any command takes stands there
    for name, *words in lines:
        if name.startswith("-"):  # an option of `bh` itself
            assert bh.commands.cli.main(["--help"]) == 0
            assert name in capsys.readouterr().out
            continue
        assert name in COMMANDS, f"bh {name}"
        assert bh.commands.cli.main([name, "--help"]) == 0
        options = set(re.findall(r"(?<![\w-])--?[a-z][a-z-]*", capsys.readouterr().out))
        assert {word for word in words if word.startswith("-")} <= options | of_any, f"bh {name}"
        if name == "verify":
            assert {word for word in words if not word.startswith("-")} <= {*ALL_CASES, "CASE"}


def test_names_of_the_library_exist() -> None:
    names = {name for line in all_code() for name in re.findall(r"\b(?:bh|meshes)(?:\.[A-Za-z_]\w*)+", line)}
    assert "bh.trace" in names
    for name in sorted(names):
        thing: object = None
        for part in name.split("."):
            if thing is None:
                thing = import_module(part)
            elif hasattr(thing, part):
                thing = getattr(thing, part)
            else:
                thing = import_module(f"{getattr(thing, '__name__', '')}.{part}")
