"""The sheets whose Newton iterations are timed, and one iteration taken apart."""

from __future__ import annotations

import math
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bh
import meshes
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from bh.mechanics.bars_and_hinges.system import BarsAndHingesSystem
from bh.runtime.threads import one_blas_thread
from bh.solvers import pardiso

SHEET = bh.Sheet(E=4000.0, nu=0.0, t=0.127)
STRIPS = (64, 142, 1428, 14_285, 42_856)  # cells along the crease: 456 to 300,000 unknowns
SHEETS = (4, 6, 20, 65, 112)  # rows of cells a side, four times as many along: 440 to 302,510 unknowns


def supported(mesh: meshes.SheetMesh) -> bh.Model:
    """Supports of App. B (a), with a spring crease: the tangent of the flat state is positive definite."""
    model = (
        bh.Model(mesh, SHEET, formulation="bars-and-hinges")
        .support("corner:inner-start", "xyz")
        .support("corner:outer-start", "yz")
    )
    model = model.support("edge:inner", "z").support("edge:outer", "z")
    return model.fold("crease", rest=math.pi / 2, Lstar=25.0)


def strip(along: int) -> bh.Model:
    """One row of cells a side, as App. B (a), lengthened at fixed cells."""
    pattern = meshes.annulus_sector(100.0 * max(along, 16) / 64, 10.0, math.pi / 4)
    return supported(meshes.structured(pattern, along=along))


def sector(along: int, rows: int) -> meshes.SheetMesh:
    """The sheet of App. B, staggered."""
    return meshes.structured(meshes.annulus_sector(100.0, 10.0, math.pi / 4), along=along, rows=rows)


def wide(rows: int) -> bh.Model:
    """A sheet 60 mm wide and 150 mm long, refined both ways."""
    return supported(meshes.structured(meshes.annulus_sector(100.0, 30.0, 1.5), along=4 * rows, rows=rows))


def least(job: Callable[[], object], seconds: float = 1.0, most: int = 200) -> float:
    """Least processor time of a job that runs in this thread, s, over at least three runs and about `seconds`.

    On a quiet machine that is the wall time; on a busy one it leaves out the time of others.
    """
    best, spent, runs = math.inf, 0.0, 0
    while runs < 3 or (spent < seconds and runs < most):
        began = time.thread_time()
        job()
        took = time.thread_time() - began
        best, spent, runs = min(best, took), spent + took, runs + 1
    return best


def peak() -> float:
    """Most memory that this process has had so far, bytes."""
    unit = 1 if sys.platform == "darwin" else 1024
    return unit * float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)


def resident() -> float:
    """Memory that this process has now, bytes; where the system does not tell, the most it has had."""
    statm = Path("/proc/self/statm")
    return float(statm.read_text().split()[1]) * resource.getpagesize() if statm.is_file() else peak()


def one_iteration(make: Callable[[], bh.Model]) -> dict[str, Any]:
    """Times (s) and peak memory (bytes, above what the process had before) of the phases of one Newton iteration."""
    before, memory = resident(), {}
    model = make()
    memory["mesh and model"] = peak()
    system = formulation(model.formulation).system(model, load_steps(model)[0], None)
    q = system.start()
    memory["system"] = peak()
    assert isinstance(system, BarsAndHingesSystem)
    began = time.thread_time()
    pattern = system._pattern
    took_pattern = time.thread_time() - began
    memory["pattern"] = peak()
    with one_blas_thread():
        now = system.evaluate(q, 0.0)
        evaluate = least(lambda: system.evaluate(q, 0.0))
        assemble = least(lambda: system.tangent(q, 0.0, now.forces))
        matrix = system.tangent(q, 0.0, now.forces).matrix
        began = time.thread_time()
        matrix.factorise()
        first = time.thread_time() - began
        factorise = least(matrix.factorise)
        factor = matrix.factorise()
        b = now.residual + 1.0
        solve = least(lambda: factor.solve(b))
    memory["iteration"] = peak()
    if pattern.banded:
        solver = f"band, b = {pattern.bandwidth}"
    else:
        solver = "PARDISO" if pardiso.pays(system.size) else "multifrontal"
    return {
        "unknowns": system.size,
        "solver": solver,
        "pattern": took_pattern,
        "analysis": max(first - factorise, 0.0),
        "evaluate": evaluate,
        "assemble": assemble,
        "factorise": factorise,
        "solve": solve,
        "total": evaluate + assemble + factorise + solve,
        "memory": {phase: value - before for phase, value in memory.items()},
    }
