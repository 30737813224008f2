"""Speed of the main jobs: `make bench` (pytest-benchmark), on a quiet machine. `make bench-table` writes the page.

Targets (one thread, after warm-up) are those of `benchmarks.table`. What a user waits for comes first, then single
Newton iterations of growing sheets, phase by phase.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

import bh
from benchmarks.cases import strip, wide
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from bh.runtime.threads import one_blas_thread
from bh.solvers.points import Increment, point
from bh.solvers.walk import Walk, walk
from verification.studies.app_b.appendix_b import model
from verification.theory.array_annulus import ENERGIES, array_annulus


@pytest.fixture(scope="module")
def annulus() -> bh.Model:
    """The sheet of App. B (a), with warm kernels."""
    bh.trace(model("a"))  # warm up
    return model("a")


def test_trace_of_appendix_b(benchmark: BenchmarkFixture, annulus: bh.Model) -> None:
    """The whole job: program, pattern, all increments, records."""
    path = benchmark(bh.trace, annulus)
    benchmark.extra_info["iterations"] = path.iterations
    benchmark.extra_info["unknowns"] = path.unknowns
    assert path.outcome == "reached"


def test_solver_alone(benchmark: BenchmarkFixture, annulus: bh.Model) -> None:
    """System, pattern and all increments, without path, records and provenance: the surroundings are the difference."""
    steps = load_steps(annulus)

    def fold() -> list[Increment]:
        system = formulation(annulus.formulation).system(annulus, steps[0], None)
        start = point(system, system.start(), 0.0)
        return list(walk(Walk(system, bh.Automatic(), (start,))))

    increments = benchmark(fold)
    assert increments[-1].outcome == "reached"


def test_trace_to_a_file(benchmark: BenchmarkFixture, annulus: bh.Model, tmp_path: Path) -> None:
    """With every state on disk before the next increment begins."""
    file = tmp_path / "path.bh"
    assert benchmark(lambda: bh.trace(annulus, file=file)).outcome == "reached"


@pytest.mark.parametrize("held", [True, False], ids=["held crease", "spring crease"])
def test_one_iteration(benchmark: BenchmarkFixture, annulus: bh.Model, held: bool) -> None:
    """Assembly, factorisation and solve of one Newton iteration at the folded state."""
    spring = bh.Model(annulus.mesh, annulus.sheet, annulus.supports, formulation="bars-and-hinges").fold(
        "crease", rest=1.6, Lstar=25.0
    )
    sheet = annulus if held else spring
    path = bh.trace(sheet)
    system, record = path.solved()
    q = record.q

    def iteration() -> None:
        now = system.evaluate(q, 1.0)
        system.tangent(q, 1.0, now.forces).matrix.factorise().solve(now.residual)

    benchmark(iteration)


@pytest.mark.parametrize("columns", ENERGIES)
def test_array_problem(benchmark: BenchmarkFixture, columns: int) -> None:
    """The annulus of plain arrays from flat to a rest angle of 90 degrees."""
    path = benchmark(bh.trace, array_annulus(columns).model())
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
def test_phase(benchmark: BenchmarkFixture, make: Callable[[int], bh.Model], size: int, phase: str) -> None:
    """One phase of one Newton iteration in the flat state."""
    model = make(size)
    steps = load_steps(model)

    def make_system() -> None:
        made = formulation(model.formulation).system(model, steps[0], None)
        assert made._pattern.size > 0

    make_system()
    system = formulation(model.formulation).system(model, steps[0], None)
    q = system.start()
    benchmark.extra_info["unknowns"] = system.size
    with one_blas_thread():
        now = system.evaluate(q, 0.0)
        matrix = system.tangent(q, 0.0, now.forces).matrix
        factor = matrix.factorise()
        jobs = {
            "pattern": make_system,
            "evaluate": lambda: system.evaluate(q, 0.0),
            "assemble": lambda: system.tangent(q, 0.0, now.forces),
            "factorise": matrix.factorise,
            "solve": lambda: factor.solve(now.residual),
        }
        if size > 50 and make is wide:
            benchmark.pedantic(jobs[phase], rounds=3)  # type: ignore[no-untyped-call]
        else:
            benchmark(jobs[phase])
