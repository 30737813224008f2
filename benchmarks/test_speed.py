"""Speed of the main jobs: `make bench` (pytest-benchmark), on a quiet machine. `make bench-table` writes the page.

Targets (one thread, after warm-up) are those of `benchmarks.table`. What a user waits for comes first, then single
Newton iterations of growing sheets, phase by phase.
"""

from __future__ import annotations

import pytest

import bh
from benchmarks.cases import array_problem, strip, wide
from bh.formulations.registry import formulation
from bh.loading.program import program
from bh.runtime.threads import one_blas_thread
from bh.solvers.increments import point
from bh.solvers.trace import Walk, walk
from verification.studies.app_b.appendix_b import model


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


@pytest.mark.parametrize("name", ["annulus_5x31", "annulus_5x61"])
def test_array_problem(benchmark, name):
    """Published arrays from flat to a rest angle of 90 degrees."""
    problem = array_problem(name)
    if problem is None:
        pytest.skip("the array problems are not here")
    path = benchmark(bh.trace, problem)
    benchmark.extra_info["iterations"] = path.iterations
    assert path.outcome == "reached"


SIZES = [
    pytest.param(strip, 142, id="strip-1000"),
    pytest.param(strip, 1428, id="strip-10000"),
    pytest.param(wide, 6, id="wide-1000"),
    pytest.param(wide, 20, id="wide-10000"),
    pytest.param(wide, 65, id="wide-100000"),
]
PHASES = ("pattern", "evaluate", "assemble", "factorise", "solve")


@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize(("make", "size"), SIZES)
def test_phase(benchmark, make, size, phase):
    """One phase of one Newton iteration in the flat state."""
    model = make(size)
    steps = program(model)

    def build():
        system = formulation(model.formulation).system(model, steps[0], None)
        assert system._pattern.size > 0
        return system

    system = build()
    q = system.start()
    benchmark.extra_info["unknowns"] = system.size
    with one_blas_thread():
        now = system.evaluate(q, 0.0)
        matrix = system.tangent(q, 0.0, now.forces)
        factor = matrix.factorise()
        jobs = {
            "pattern": build,
            "evaluate": lambda: system.evaluate(q, 0.0),
            "assemble": lambda: system.tangent(q, 0.0, now.forces),
            "factorise": matrix.factorise,
            "solve": lambda: factor.solve(now.residual),
        }
        if size > 50 and make is wide:
            benchmark.pedantic(jobs[phase], rounds=3)
        else:
            benchmark(jobs[phase])
