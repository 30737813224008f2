"""Measure the speed of one Newton iteration and of whole folds, and write docs/performance.md: `make bench-table`.

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
from bh.commands.warm_up import warm_up
from bh.model.refinement import with_mesh
from bh.paths.provenance import versions
from bh.runtime.threads import one_blas_thread
from bh.solvers import pardiso
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


def row(found: dict[str, Any]) -> str:
    """A case as a row of a table."""
    ms = {key: 1e3 * found[key] for key in ("evaluate", "assemble", "factorise", "solve", "total")}
    target = near(found["unknowns"])
    goal = "" if target is None else f"{target:g} ({'met' if ms['total'] <= target else 'missed'})"
    kilobytes = found["memory"]["iteration"] / found["unknowns"] / 1e3
    memory = f"{kilobytes:.1f}" if found["unknowns"] > 5_000 else ""
    cells = [
        f"{found['unknowns']:,}",
        found["solver"],
        number(ms["evaluate"] + ms["assemble"]),
        number(ms["factorise"]),
        number(ms["solve"]),
        number(ms["total"]),
        goal,
        number(1e3 * found["pattern"] + 1e3 * found["analysis"]),
        memory,
    ]
    return "| " + " | ".join(cells) + " |"


def number(value: float) -> str:
    """Three digits, or whole numbers from 100 on."""
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def exponent(cases: list[dict[str, Any]]) -> float:
    """Slope of log time over log unknowns from about 1e3 to 3e5 unknowns, least squares."""
    points = [(case["unknowns"], case["total"]) for case in cases if case["unknowns"] > 900]
    unknowns, seconds = np.log(np.array(points).T)
    return float(np.polyfit(unknowns, seconds, 1)[0])


HEAD = (
    "| unknowns | solver | assembly, ms | factorisation, ms | solve, ms | iteration, ms | target, ms "
    "| pattern once, ms | peak memory, kB an unknown |\n|---|---|---|---|---|---|---|---|---|"
)


def tables() -> list[str]:
    """Newton iterations of growing sheets, phase by phase."""
    lines: list[str] = []
    for kind, sizes, title in (
        ("strip", STRIPS, "Strips (one row of cells a side of the crease, as App. B)"),
        ("wide", SHEETS, "Wide sheets (refined both ways)"),
    ):
        cases = [measure(kind, size, "chosen") for size in sizes]
        lines += [f"## {title}", "", HEAD, *map(row, cases), ""]
        grows = exponent(cases)
        verdict = "met" if grows <= EXPONENT_TARGET else "missed"
        lines += [
            f"Time grows with the unknowns to the power {grows:.2f} (target {EXPONENT_TARGET}: {verdict}).",
            "",
        ]
        at = next(case for case in cases if 9e4 < case["unknowns"] < 1.1e5)
        phases = ", ".join(
            f"{phase} {value / at['unknowns'] / 1e3:.2f}"
            for phase, value in at["memory"].items()
            if phase != "before"
        )
        verdict = "met" if at["memory"]["iteration"] / at["unknowns"] / 1e3 <= MEMORY_TARGET else "missed"
        lines += [
            f"Peak memory at {at['unknowns']:,} unknowns after each phase, kB an unknown: {phases} "
            f"(target {MEMORY_TARGET:g}: {verdict}).",
            "",
        ]
        if kind == "wide":
            lines += ["Wide sheets by who factorises:", "", HEAD]
            for backend in ("multifrontal", *(["PARDISO"] if pardiso.available() else [])):
                lines += [row(measure(kind, size, backend)) for size in sizes if size >= 20]
            lines.append("")
    return lines


def folds() -> list[str]:
    """Whole folds: time and iterations against their targets."""
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
        lines.append(
            f"| {name} | {path.unknowns} | {path.iterations} | {most} ({few}) | {took:.1f} | {ms:g} ({quick}) |"
        )
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
        lines.append(
            f"| {name} | {along} x {rows} | {path.unknowns:,} | {path.iterations} | {took:.1f} | {ms:g} ({quick}) |"
        )
    path = bh.trace(appendix_b("a"))
    system, record = path.solved()

    def iteration() -> None:
        now = system.evaluate(record.q, 0.95)  # a residual as in the middle of an increment
        system.tangent(record.q, 0.95, now.forces).matrix.factorise().solve(now.residual)

    with one_blas_thread():
        took = 1e3 * least(iteration)
    goal = "met" if took <= 0.3 else "missed"
    lines += [
        "",
        f"One iteration at the end of App. B (a), the crease held exactly: {took:.2f} ms (0.3: {goal}).",
    ]
    return [*lines, ""]


def machine() -> str:
    """What it was measured on."""
    name = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.is_file():
        name = next(
            (line.split(":")[1].strip() for line in info.read_text().splitlines() if "model name" in line),
            name,
        )
    extra = "with pypardiso" if pardiso.available() else "without pypardiso"
    parts = ", ".join(f"{key} {value}" for key, value in versions().items())
    load = os.getloadavg()[0]
    return (
        f"Measured on {datetime.now(UTC):%Y-%m-%d} on {name}, {os.cpu_count()} cores, {platform.system()}, {parts}, "
        f"{extra}. One thread; least processor time of several runs; load of the machine at the start {load:.1f}."
    )


HEAD = (
    "Written by `make bench-table`; do not edit. Every figure is of the run of that command that is told below, but "
    "for those of the two sections that tell of runs of their own: this page is the record."
)
TEXT = (Path(__file__).with_name("performance.txt")).read_text(encoding="utf-8")


def main() -> None:
    """Measure one case for `measure`, or all of them for the page."""
    if len(sys.argv) == 4:
        print(json.dumps(run_case(sys.argv[1], int(sys.argv[2]), sys.argv[3])))
        return
    about = machine()
    body = [*tables(), *folds()]
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


if __name__ == "__main__":
    main()
