"""Every entry of the cookbook runs and its number is right; ten of them are judged by the shell."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from tests.unit.test_documentation import site_builder
from tests.unit.test_plotting import needs_opengl

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "examples" / "cookbook"
ENTRIES = sorted(FOLDER.glob("*.py"))
PAGE = (FOLDER / "README.md").read_text(encoding="utf-8")
JOBS = re.findall(
    r"^\| \[[^\]]+\]\((\w+)\.py\) \| [^|]+ \| ([-+\d.]+) % \|$", PAGE, re.MULTILINE
)  # against the shell


def run(file: Path, shell: bool = False) -> dict[str, Any]:
    """Names of an entry after it ran, without its picture; by the shell without its asserts, which are of its model."""
    text = file.read_text(encoding="utf-8")
    if shell:
        text = text.replace('formulation="consistent"', 'formulation="shell"')
        text = re.sub(r"^assert .*$", "", text, flags=re.MULTILINE)
    names: dict[str, Any] = {"__name__": "cookbook", "__file__": str(file)}
    exec(compile(text, file.name, "exec"), names)
    return names


@pytest.mark.parametrize("file", ENTRIES, ids=lambda file: file.stem)
def test_entries_run(file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert isinstance(run(file)["found"], int | float)


@pytest.mark.parametrize("file", ENTRIES, ids=lambda file: file.stem)
def test_entries_are_short_and_have_an_idea_a_number_and_a_picture(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    about, body, picture = re.split(r'"""\n|if __name__ == "__main__":\n', text)[-3:]
    title, rest = about.removeprefix('"""').split("\n\n", 1)
    assert len(title) < 110
    assert 1 <= rest.count("\n") <= 3
    lines = [line for line in body.splitlines() if line.strip()]
    assert len(lines) <= 25
    assert re.search(r"^assert .*found", body, re.MULTILINE)
    assert re.search(rf'"{file.stem}\.(png|svg)"', picture)
    assert f"]({file.name})" in PAGE


def test_there_are_thirty() -> None:
    assert len(ENTRIES) >= 30
    assert len(JOBS) == 10


@pytest.mark.slow
@pytest.mark.parametrize(("name", "off"), JOBS)
def test_the_shell_says_the_same(
    name: str, off: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Within 5 %, and as far off as the page prints."""
    monkeypatch.chdir(tmp_path)
    file = FOLDER / f"{name}.py"
    found, shell = run(file)["found"], run(file, shell=True)
    assert found / shell["found"] - 1.0 == pytest.approx(float(off) / 100.0, abs=1e-3)
    assert abs(found / shell["found"] - 1.0) < 0.05


@pytest.mark.slow
@needs_opengl
def test_pictures(tmp_path: Path) -> None:
    site_builder().write_cookbook(tmp_path)
    pictures = [file for file in tmp_path.iterdir() if file.suffix in (".png", ".svg")]
    assert len(pictures) == len(ENTRIES)
    text = (tmp_path / "cookbook.md").read_text(encoding="utf-8")
    for file in pictures:
        assert f"]({file.name})" in text
        assert 500 < file.stat().st_size < 400_000, file
