"""Numbers that README and docs print are what the kept records say, and lead to them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from markdown_it import MarkdownIt

from verification.framework.printed import Printed, printed

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md"))]
FIGURES = [figure for page in PAGES for figure in printed(page)]
FEWEST = 1742  # figures that lead to records; more may be linked, none may be lost


def test_every_printed_figure_is_what_its_record_says() -> None:
    wrong = [problem for figure in FIGURES if (problem := figure.wrong())]
    assert not wrong, "\n".join(wrong)
    assert len(FIGURES) >= FEWEST


def test_links_in_tables_are_links() -> None:
    """A bar in the title of a link would end the cell, and the link with it."""
    for page in PAGES:
        if not printed_in_tables(page):
            continue
        found = MarkdownIt("commonmark").enable("table").render(page.read_text(encoding="utf-8"))
        links = found.count('.json" title=')
        assert links == len(list(printed(page))), page.name


def printed_in_tables(page: Path) -> bool:
    lines = page.read_text(encoding="utf-8").splitlines()
    return any(line.startswith("|") and "verification/records" in line for line in lines)


def check(quantity: str, value: float | None, **params: Any) -> dict[str, Any]:
    return {"quantity": quantity, "value": value, "error": 0.5, "params": params}


@pytest.fixture
def page(tmp_path: Path) -> Path:
    folder = tmp_path / "verification" / "records"
    folder.mkdir(parents=True)
    checks = [check("size", 0.08833, a=1), check("size", 12345.6, a=2), check("none", None)]
    series = [{"label": "fine, 4 rows", "x": [12.34, 56.7], "y": [0.25, 0.125]}]
    cases = [{"plots": [{"id": "error-time", "series": series}]}]
    (folder / "c.json").write_text(json.dumps({"checks": checks, "cases": cases}))
    (tmp_path / "docs").mkdir()
    return tmp_path / "docs" / "page.md"


@pytest.mark.parametrize(
    ("words", "title", "problem"),
    [
        ("0.088 mm", "size | a=1", ""),
        ("0.09", "size | a=1", ""),
        ("8.83 %", "size | a=1 | times 100", ""),
        ("12,346", "size | a=2", ""),
        ("12,346", "size \\| a=2", ""),
        ("1.2e4 mm", "size | largest", ""),
        ("2", "size | number", ""),
        ("0.5", "size | a=1 | read error", ""),
        ("9.8 %", "size | a=1 | times 100 | plus 1", ""),
        ("0.13", "error-time | series=fine, 4 rows | point=2", ""),
        ("57 ms", "error-time | series=fine, 4 rows | point=2 | read x", ""),
        ("12.3", "error-time | least | read x", ""),
        ("0.2", "error-time | series=fine, 4 rows | point=2", "the record says 0.125"),
        ("0.2", "error-time | series=coarse", "no records"),
        ("0.2", "error-time | series=fine, 4 rows", "2 records"),
        ("a = 2", "size | a=2 | read params.a", ""),
        ("0.089 mm", "size | a=1", "the record says 0.08833"),
        ("0.09", "size", "2 records"),
        ("0.09", "size | a=3", "no records"),
        ("0.09", "length", "no records"),
        ("0.09", "size | a=1 | twice", "'twice' says neither"),
        ("0.09", "none", "is no number"),
        ("small", "size | a=1", "has no number"),
    ],
)
def test_a_figure_has_to_be_the_records(page: Path, words: str, title: str, problem: str) -> None:
    page.write_text(f'First.\n\nIt is [{words}](../verification/records/c.json "{title}").\n')
    (figure,) = printed(page)
    assert figure.line == 3
    found = figure.wrong()
    assert (problem in found) if problem else found == ""


def test_a_file_that_is_not_there_is_told(page: Path) -> None:
    found = Printed(page, 1, "1", "../verification/records/d.json", "size").wrong()
    assert "no records in '../verification/records/d.json'" in found
