"""The table of speeds: one case measured, and the page that was written last; records of benchmarks.

Times are not judged here.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from benchmarks import studio, studio_dragging, studio_gallery, studio_latency, studio_start, table
from benchmarks.record import Measured
from bh.solvers import pardiso
from reports.records import Results, read
from verification.framework.printed import printed
from verification.framework.run import RECORDS

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


# --- records ------------------------------------------------------------------------------------------------------


def values(found: Results, quantity: str) -> list[float | None]:
    return [check.value for check in found.checks if check.quantity == quantity]


def test_a_record_is_one_as_cases_have(tmp_path: Path) -> None:
    """By the strict model of the report; its source is the command, and there is nothing to judge."""
    file = tmp_path / "r.json"
    studio.main(["1", "--session", "--record", str(file)])
    found = read(file)
    (info,) = found.cases
    assert (info.name, info.verdict, info.quick) == ("bench_studio", "reported", False)
    assert {check.case for check in found.checks} == {"bench_studio"}
    command = f"python -m benchmarks.studio 1 --session --record {file}"
    assert {check.source for check in found.checks} == {f"measured by `{command}`"}
    assert {"model", "load at the start", "cores"} <= set(found.machine)
    assert (info.wall_time_s or 0.0) > 0.0
    medians, most = (values(found, f"time of an event, {words}") for words in ("median", "95th percentile"))
    assert len(medians) == len(most) == 4  # dragged and at rest, by the clock and of the processor
    assert all(0.0 < a <= b < 10_000.0 for a, b in zip(medians, most, strict=True) if a and b)
    assert [check.unknowns for check in found.checks] == [894] * 8


def test_the_other_programs_keep_what_they_measure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Times that are known in place of measured ones: the record has them under the words that docs will print."""
    monkeypatch.setattr(studio_latency, "measured", lambda *_: ([10.0, 20.0, 30.0], [1.0, 2.0, 3.0]))
    studio_latency.main(["1", "--record", str(tmp_path / "latency.json")])
    found = read(tmp_path / "latency.json")
    assert values(found, "time from the slider to the picture, median") == [20.0, 20.0]
    assert values(found, "time from the slider to the picture, 95th percentile") == [29.0, 29.0]
    assert values(found, "processor time of an event, median") == [2.0, 2.0]
    assert {check.params["moved"] for check in found.checks} == {"drag", "pause"}
    monkeypatch.setattr(studio_start, "start", lambda _: (3.0, 2.0))
    monkeypatch.setattr(studio_start, "seen", lambda _: (4.0, 5.0))
    studio_start.main(["a.svg", "--browser", "--record", str(tmp_path / "start.json")])
    found = read(tmp_path / "start.json")
    assert values(found, "time from the command to the folded picture, median") == [3.0, 4.0]
    assert values(found, "processor time of the start, median") == [2.0, 5.0]
    assert found.checks[0].params == {"file": "a.svg", "by": "socket", "events": studio_start.RUNS}
    (tmp_path / "a.svg").write_text("")
    monkeypatch.setenv("BH_DRAWINGS", str(tmp_path))
    monkeypatch.setattr(studio_gallery, "run", lambda _: studio_gallery.Run(0.1, 2.0, 3.0, 50, "", 80.0))
    studio_gallery.main(["--record", str(tmp_path / "gallery.json")])
    found = read(tmp_path / "gallery.json")
    assert values(found, "drawings") == [1, 1, 1, 0]
    assert values(found, "slowest answer, median") == [2.0]


def test_what_a_random_hand_saw_is_kept(tmp_path: Path) -> None:
    hand = studio_dragging.Hand(3)
    hand.act()
    found = Measured("studio_dragging", "Random handling", ["--seconds", "1"])
    studio_dragging.keep(found, hand, [200.0, 230.0, 210.0], 4)
    found.write(tmp_path / "r.json")
    kept = read(tmp_path / "r.json")
    assert values(kept, "frames") == [hand.log.frames]
    assert values(kept, "memory from the base on") == [200.0, 200.0, 230.0, 210.0, 10.0]


def test_without_the_option_nothing_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Measured("x", "nothing").write(None)
    assert list(tmp_path.iterdir()) == []


def case(unknowns: int, seconds: float) -> dict[str, Any]:
    phases = dict.fromkeys(("pattern", "analysis", "evaluate", "assemble", "factorise", "solve"), seconds)
    memory = {"mesh and model": 1e3 * unknowns, "iteration": 2e3 * unknowns}
    return {"unknowns": unknowns, "solver": "band, b = 17", "total": 4 * seconds, "memory": memory, **phases}


def test_figures_of_the_table_lead_to_its_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every figure of the tables of iterations is a link, and says what the record says."""
    monkeypatch.setattr(
        table, "measure", lambda kind, size, backend: case(100_000 + size, 1.2345e-3 * (1 + size))
    )
    monkeypatch.setattr(table, "STRIPS", (1, 2))
    monkeypatch.setattr(table, "SHEETS", (3, 30))
    found = Measured("table", "Newton iterations and folds", [])
    lines = table.tables(table.Keep(found))
    (tmp_path / "docs").mkdir()
    (tmp_path / "verification" / "records").mkdir(parents=True)
    found.write(tmp_path / "verification" / "records" / "bench_table.json")
    page = tmp_path / "docs" / "performance.md"
    page.write_text("\n".join(lines))
    figures = list(printed(page))
    backends = 2 if pardiso.available() else 1
    assert len(figures) == 6 * (4 + backends) + 2 * (1 + 2)
    assert [problem for figure in figures if (problem := figure.wrong())] == []


def test_kept_records_of_benchmarks_are_of_runs_as_they_are_typed() -> None:
    """Named after the module whose command is told, and of a commit without changes."""
    for file in sorted(RECORDS.glob("bench_*.json")):
        found, module = read(file), file.stem.removeprefix("bench_")
        assert {check.case for check in found.checks} == {file.stem}
        assert all(f"python -m benchmarks.{module}" in (check.source or "") for check in found.checks)
        assert (ROOT / "benchmarks" / f"{module}.py").is_file()
        assert "changes" not in found.versions["git commit"]
