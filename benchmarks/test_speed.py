"""Speed of the main job: `make bench` (pytest-benchmark). Run it on a quiet machine with one BLAS thread.

Targets on the developers' machine (two cores, one thread used), after warm-up:
App. B (a), 64 cells, one row a side: 20 ms or less, 35 Newton iterations or less; one iteration 0.4 ms or less.
"""

from __future__ import annotations

import pytest

import bh
from bh.formulations import formulation
from bh.program import program
from bh.solvers.increments import point
from bh.solvers.trace import Walk, walk
from verification.appendix_b import model


@pytest.fixture(scope="module")
def annulus() -> bh.Model:
    bh.trace(model("a"))  # warm up
    return model("a")


def test_trace_of_appendix_b(benchmark, annulus):
    """The whole job: program, pattern, all increments, records."""
    path = benchmark(bh.trace, annulus)
    benchmark.extra_info["iterations"] = path.iterations
    benchmark.extra_info["unknowns"] = path.unknowns
    assert path.outcome == "reached"


def test_solver_alone(benchmark, annulus):
    """System, pattern and all increments, without path, records and provenance: the surroundings are the difference."""
    steps = program(annulus)

    def fold():
        system = formulation(annulus.formulation).system(annulus, steps[0], None)
        start = point(system, system.start(), 0.0)
        return list(walk(Walk(system, bh.Automatic(), (start,))))

    increments = benchmark(fold)
    assert increments[-1].outcome == "reached"


def test_trace_to_a_file(benchmark, annulus, tmp_path):
    """With every state on disk before the next increment begins."""
    file = tmp_path / "path.bh"
    assert benchmark(lambda: bh.trace(annulus, file=file)).outcome == "reached"


@pytest.mark.parametrize("held", [True, False], ids=["held crease", "spring crease"])
def test_one_iteration(benchmark, annulus, held):
    """Assembly, factorisation and solve of one Newton iteration at the folded state."""
    spring = bh.Model(annulus.mesh, annulus.sheet, annulus.supports).fold("crease", rest=1.6, Lstar=25.0)
    sheet = annulus if held else spring
    path = bh.trace(sheet)
    system, q = path._system(0), path.records[-1].q

    def iteration():
        now = system.evaluate(q, 1.0)
        return system.tangent(q, 1.0, now.forces).factorise().solve(now.residual)

    benchmark(iteration)
