"""Measure the speed of one Newton iteration and of whole folds, and write docs/performance.md: `make bench-table`.

What was measured is kept as a record, verification/records/bench_table.json, which the figures of the page lead to.

Every case runs in a process of its own, so that its peak memory is its own, with one thread.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

import bh
from benchmarks.cases import SHEETS, STRIPS, least, one_iteration, sector, strip, wide
from benchmarks.record import Measured, Params, link, processor
from bh.commands.warm_up import warm_up
from bh.model.refinement import with_mesh
from bh.paths.provenance import versions
from bh.runtime.threads import one_blas_thread
from bh.solvers import pardiso
from verification.framework.run import RECORDS
from verification.studies.app_b.appendix_b import model as appendix_b
from verification.theory.array_annulus import ENERGIES, ROWS, array_annulus

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "performance.md"
TARGETS = {450: 0.3, 1_000: 0.8, 10_000: 50.0, 100_000: 900.0}  # ms an iteration
FOLDS = (  # formulation, cells along the crease, rows a side, ms a fold
    ("bars-and-hinges", 64, 1, 5.0),
    ("consistent", 32, 4, 20.0),
    ("consistent", 64, 4, 40.0),
    ("linear-shell", 64, 4, 45.0),
    ("shell", 32, 2, 65.0),
)
MEMORY_TARGET, EXPONENT_TARGET = 8.0, 1.3  # kB an unknown at 1e5; over 1e3 to 3e5 unknowns


def measure(kind: str, size: int, backend: str) -> dict[str, Any]:
    """One case in a process of its own."""
    ones = dict.fromkeys(("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"), "1")
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.table", kind, str(size), backend],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
        env={**os.environ, **ones},
    )
    print(f"{kind} {size} {backend}: done", file=sys.stderr)
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def run_case(kind: str, size: int, backend: str) -> dict[str, Any]:
    """One case in this process; `kind` and `backend` as for `measure`."""
    make = {"strip": strip, "wide": wide}[kind]
    warm_up()
    if backend != "chosen":
        pardiso.FEWEST = 0 if backend == "PARDISO" else 10**12
    return one_iteration(lambda: make(size))


def near(unknowns: int) -> float | None:
    """The target (ms) for about this many unknowns."""
    return next((ms for n, ms in TARGETS.items() if 0.9 < unknowns / n < 1.1), None)


def row(found: dict[str, Any], keep: Keep, **which: str) -> str:
    """A case as a row of a table; `keep` takes its figures, `which` tells them from those of other rows."""
    size = found["unknowns"]
    target = near(size)
    goal = "" if target is None else f"{target:g} ({'met' if 1e3 * found['total'] <= target else 'missed'})"
    seconds = {
        "assembly": found["evaluate"] + found["assemble"],
        "factorisation": found["factorise"],
        "solve": found["solve"],
        "iteration": found["total"],
        "pattern once": found["pattern"] + found["analysis"],
    }
    params: Params = {**which, "unknowns": size}
    ms = {key: keep(f"time of {key}", 1e3 * value, "ms", params) for key, value in seconds.items()}
    kilobytes = found["memory"]["iteration"] / size / 1e3
    memory = keep("peak memory an unknown", kilobytes, "kB", params, ".1f") if size > 5_000 else ""
    cells = [
        f"{size:,}",
        found["solver"],
        *(ms[key] for key in list(ms)[:4]),
        goal,
        ms["pattern once"],
        memory,
    ]
    return "| " + " | ".join(cells) + " |"


def number(value: float, digits: str = "") -> str:
    """As `digits` says; without it three digits, or whole numbers from 100 on."""
    return f"{value:{digits or (',.0f' if value >= 100 else '.3g')}}"


class Keep:
    """Puts a figure into the record, and gives it as a link to there."""

    def __init__(self, found: Measured) -> None:
        """`found` takes the figures."""
        self.found = found

    def __call__(self, quantity: str, value: float, unit: str, params: Params, digits: str = "") -> str:
        """The figure as `number` writes it, for a table or a line of text."""
        self.found.add(quantity, value, unit, params)
        title = " | ".join([quantity, *(f"{key}={value}" for key, value in params.items())])
        return link(number(value, digits), "table", title)


def exponent(cases: list[dict[str, Any]]) -> float:
    """Slope of log time over log unknowns from about 1e3 to 3e5 unknowns, least squares."""
    points = [(case["unknowns"], case["total"]) for case in cases if case["unknowns"] > 900]
    unknowns, seconds = np.log(np.array(points).T)
    return float(np.polyfit(unknowns, seconds, 1)[0])


HEAD = (
    "| unknowns | solver | assembly, ms | factorisation, ms | solve, ms | iteration, ms | target, ms "
    "| pattern once, ms | peak memory, kB an unknown |\n|---|---|---|---|---|---|---|---|---|"
)


def tables(keep: Keep) -> list[str]:
    """Newton iterations of growing sheets, phase by phase; `keep` takes the figures."""
    lines: list[str] = []
    for kind, sizes, title in (
        ("strip", STRIPS, "Strips (one row of cells a side of the crease, as App. B)"),
        ("wide", SHEETS, "Wide sheets (refined both ways)"),
    ):
        cases = [measure(kind, size, "chosen") for size in sizes]
        lines += [f"## {title}", "", HEAD, *(row(case, keep, kind=kind, by="chosen") for case in cases), ""]
        grows = exponent(cases)
        told = keep("exponent of time over unknowns", grows, "", {"kind": kind}, ".2f")
        verdict = "met" if grows <= EXPONENT_TARGET else "missed"
        lines += [
            f"Time grows with the unknowns to the power {told} (target {EXPONENT_TARGET}: {verdict}).",
            "",
        ]
        at = next(case for case in cases if 9e4 < case["unknowns"] < 1.1e5)
        words = "peak memory an unknown after a phase"
        memory = {phase: value / at["unknowns"] / 1e3 for phase, value in at["memory"].items()}
        phases = ", ".join(
            f"{phase} {keep(words, value, 'kB', {'kind': kind, 'phase': phase}, '.2f')}"
            for phase, value in memory.items()
        )
        verdict = "met" if memory["iteration"] <= MEMORY_TARGET else "missed"
        lines += [
            f"Peak memory at {at['unknowns']:,} unknowns after each phase, kB an unknown: {phases} "
            f"(target {MEMORY_TARGET:g}: {verdict}).",
            "",
        ]
        if kind == "wide":
            lines += ["Wide sheets by who factorises:", "", HEAD]
            for backend in ("multifrontal", *(["PARDISO"] if pardiso.available() else [])):
                large = [measure(kind, size, backend) for size in sizes if size >= 20]
                lines += [row(case, keep, kind=kind, by=backend) for case in large]
            lines.append("")
    return lines


def folds(keep: Keep) -> list[str]:
    """Whole folds: time and iterations against their targets; `keep` takes the figures."""
    lines = ["## Whole folds from flat to 90 degrees", ""]
    lines += ["| case | unknowns | iterations | target | time, ms | target |", "|---|---|---|---|---|---|"]
    cases = [("App. B (a), 64 cells, staggered", appendix_b("a"), 22, 10.0)]
    for columns in ENERGIES:
        cases.append((f"array problem annulus_{ROWS}x{columns}", array_annulus(columns).model(), 30, 25.0))
    for name, model, most, ms in cases:
        path = bh.trace(model)
        took = 1e3 * least(lambda model=model: bh.trace(model), 2.0)  # type: ignore[misc]
        assert path.outcome == "reached"
        few, quick = (["missed", "met"][ok] for ok in (path.iterations <= most, took <= ms))
        count = keep("iterations of a fold", path.iterations, "", {"case": name}, ".0f")
        told = keep("time of a fold", took, "ms", {"case": name}, ".1f")
        lines.append(f"| {name} | {path.unknowns} | {count} | {most} ({few}) | {told} | {ms:g} ({quick}) |")
    lines += ["", "The sector of App. B (a) by every formulation, default settings:", ""]
    lines += [
        "| formulation | cells | unknowns | iterations | time, ms | target |",
        "|---|---|---|---|---|---|",
    ]
    for name, along, rows, ms in FOLDS:
        model = with_mesh(appendix_b("a"), sector(along, rows), name)
        path = bh.trace(model)
        took = 1e3 * least(lambda model=model: bh.trace(model), 2.0)  # type: ignore[misc]
        assert path.outcome == "reached"
        quick = "met" if took <= ms else "missed"
        params: Params = {"formulation": name, "cells": f"{along} x {rows}"}
        count = keep("iterations of a fold", path.iterations, "", params, ".0f")
        told = keep("time of a fold", took, "ms", params, ".1f")
        cells = f"{along} x {rows} | {path.unknowns:,} | {count} | {told} | {ms:g} ({quick})"
        lines.append(f"| {name} | {cells} |")
    path = bh.trace(appendix_b("a"))
    system, record = path.solved()

    def iteration() -> None:
        now = system.evaluate(record.q, 0.95)  # a residual as in the middle of an increment
        system.tangent(record.q, 0.95, now.forces).matrix.factorise().solve(now.residual)

    with one_blas_thread():
        took = 1e3 * least(iteration)
    goal = "met" if took <= 0.3 else "missed"
    told = keep("time of an iteration at the end of App. B (a)", took, "ms", {}, ".2f")
    lines += [
        "",
        f"One iteration at the end of App. B (a), the crease held exactly: {told} ms (0.3: {goal}).",
    ]
    return [*lines, ""]


def machine() -> str:
    """What it was measured on."""
    extra = "with pypardiso" if pardiso.available() else "without pypardiso"
    parts = ", ".join(f"{key} {value}" for key, value in versions().items())
    load = os.getloadavg()[0]
    return (
        f"Measured on {datetime.now(UTC):%Y-%m-%d} on {processor()}, {os.cpu_count()} cores, {platform.system()}, "
        f"{parts}, {extra}. One thread; least processor time of several runs; load of the machine at the start "
        f"{load:.1f}."
    )


HEAD = (
    "Written by `make bench-table`; do not edit. Every figure is of the run of that command that is told below, and "
    "leads to its record, but for the last section, which tells of a run of its own."
)
TEXT = (Path(__file__).with_name("performance.txt")).read_text(encoding="utf-8")


def main() -> None:
    """Measure one case for `measure`, or all of them for the page."""
    if len(sys.argv) == 4:
        print(json.dumps(run_case(sys.argv[1], int(sys.argv[2]), sys.argv[3])))
        return
    about, found = machine(), Measured("table", "Newton iterations and folds")
    keep = Keep(found)
    body = [*tables(keep), *folds(keep)]
    page = [
        "# Performance",
        "",
        HEAD,
        "",
        about,
        "",
        *body,
        TEXT.strip(),
        "",
    ]
    PAGE.write_text("\n".join(page), encoding="utf-8")
    print(f"wrote {PAGE}")
    found.write(RECORDS / "bench_table.json")


if __name__ == "__main__":
    main()
