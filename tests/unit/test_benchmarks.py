"""The table of speeds: one case measured, and the page that was written last. Times are not judged here."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_one_case() -> None:
    """A case in a process of its own gives every phase a time, and the memory that grows from phase to phase."""
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.table", "wide", "2", "chosen"],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    found = json.loads(done.stdout)
    phases = ("evaluate", "assemble", "factorise", "solve")
    assert all(found[phase] > 0.0 for phase in phases)
    assert found["total"] == sum(found[phase] for phase in phases)
    assert found["solver"].startswith("band")
    nodes = 3 * 9 + 2 * 10  # five lines of nodes
    assert found["unknowns"] == 3 * nodes - 3 - 2 - 16  # supports: two corners, the rest of two edges
    memory = list(found["memory"].values())
    assert memory == sorted(memory)


def test_page_is_of_this_text() -> None:
    """docs/performance.md ends with the text that its script has now: who changes the text writes the page anew."""
    page = (ROOT / "docs" / "performance.md").read_text(encoding="utf-8")
    text = (ROOT / "benchmarks" / "performance.txt").read_text(encoding="utf-8")
    assert page.endswith(text)
    for title in ("## Strips", "## Wide sheets", "## Whole folds", "Peak memory at", "to the power"):
        assert title in page
