"""Bending stiffness by direction from the tangent, and designs found over it."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from bh import ModelError
from bh.analysis.stiffness_probe import Probe
from bh.applications.corrugation import POLYESTER, Folded, fold, tangent_bending, top_down
from bh.applications.corrugation.design import (
    BOUNDS,
    Design,
    Front,
    Task,
    _design,
    _numbers,
    pareto,
    with_ratio,
)
from meshes.unstructured import sheet_area


@cache
def folded(kind: str, formulation: str = "bars-and-hinges", along: int = 24, rows: int = 1) -> Folded:
    return fold(kind, 6.0, along=along, rows=rows, formulation=formulation)


def test_kept_sections_bend_as_a_beam() -> None:
    """The straight one about y: 48 E I / L^3, less what the panels shear."""
    sheet = folded("straight", "consistent", 24, 3)
    beam = 48.0 * POLYESTER.E * top_down(sheet, 0.5 * math.pi) / 50.0**3
    kept = tangent_bending(sheet, [0.5 * math.pi]).stiffness[0]
    # 48 x 6 cells: 0.622 of it, and 0.663 with constant strains, which come down from 0.763 with 24 x 3
    assert kept == pytest.approx(0.622 * beam, rel=0.1)


def test_symmetric_patterns_are_symmetric() -> None:
    found = tangent_bending(folded("parabolic-edge"), 12)
    assert found.stiffness[1:] == pytest.approx(found.stiffness[:0:-1], rel=1e-4)
    assert found.stiffness.min() > 0.0
    assert found.isotropy == pytest.approx(found.weakest / found.stiffness.max())
    assert found.about(math.pi) == found.stiffness[0]
    assert found.about(0.5 * math.pi + 0.01) == found.stiffness[6]


def test_straight_is_the_least_isotropic() -> None:
    kinds = ("straight", "parabolic-edge", "elliptical-edge")
    isotropy = {kind: tangent_bending(folded(kind), 12).isotropy for kind in kinds}
    assert isotropy["straight"] < 0.02 < min(isotropy["parabolic-edge"], isotropy["elliptical-edge"])


def test_stiffness_against_patterns_of_loads() -> None:
    """`Probe.against` of unit forces at nodes is `Probe.reduced`; twice the load is a quarter of the stiffness."""
    sheet = folded("parabolic-edge")
    probe = Probe(sheet.path)
    nodes = [3, 40, 60, 80]
    loads = np.zeros((4, len(sheet.points), 3))
    for k, node in enumerate(nodes):
        loads[k, node, 2] = 1.0
    exact = probe.reduced((nodes, "z"))
    assert np.abs(probe.against(loads) - exact).max() < 1e-9 * np.abs(exact).max()
    assert np.abs(probe.against(2.0 * loads) - 0.25 * exact).max() < 1e-9 * np.abs(exact).max()
    with pytest.raises(ModelError, match="loads must be finite"):
        probe.against(np.zeros((2, 3, 3)))


TASK = Task(along=12, rows=1, formulation="bars-and-hinges", directions=4)


def test_designs_have_the_wanted_area() -> None:
    for design in (Design(2.0, 1.0, 0.0, 5), Design(3.1, 1.7, 0.4, 4)):
        assert sheet_area(design.pattern(5000.0)) == pytest.approx(5000.0, rel=1e-3)


def test_numbers_and_designs_are_each_others_inverse() -> None:
    for design in (Design(2.0, 1.0, 0.0, 5), Design(3.9, 2.2, 0.7, 6)):
        again = _design(_numbers(design, TASK), TASK)
        assert again.panels == design.panels
        assert [getattr(again, name) for name in BOUNDS] == pytest.approx(
            [getattr(design, name) for name in BOUNDS]
        )
    with pytest.raises(ModelError, match="9 panels"):
        _numbers(Design(2.0, 1.0, 0.0, 9), TASK)


def test_front_beats_what_it_began_with() -> None:
    """Nothing on the front is beaten in both, nothing beats it, and the known design is beaten or on it."""
    pytest.importorskip("pymoo")
    known = Design(2.0, 1.0, 0.0, 5)
    front = pareto(TASK, population=4, generations=2, known=[known], seed=2)
    assert isinstance(front, Front)
    assert len(front.candidates) == 8
    best = front.best
    assert [c.isotropy for c in best] == sorted(c.isotropy for c in best)
    assert [c.weakest for c in best] == sorted((c.weakest for c in best), reverse=True)
    for item in front.candidates:
        assert any(b.weakest >= item.weakest and b.isotropy >= item.isotropy for b in best)
    first = TASK.simulate(known)
    assert any(c.weakest == pytest.approx(first.weakest, rel=1e-9) for c in front.candidates)
    again = pareto(TASK, population=4, generations=2, known=[known], seed=2)
    assert [c.weakest for c in again.candidates] == [c.weakest for c in front.candidates]


def test_wanted_ratio() -> None:
    found = with_ratio(0.6, TASK, iterations=1, population=2)
    assert found.ratio == pytest.approx(0.6, rel=0.4)


def test_what_cannot_be_says_so_in_one_line() -> None:
    deep = Task(along=16, rows=1, formulation="bars-and-hinges", depth=80.0).simulate(
        Design(2.0, 1.0, 0.0, 5)
    )
    assert deep.bending is None
    assert deep.why
    assert "\n" not in deep.why
    assert deep.weakest == deep.isotropy == 0.0
    for how in ({"depth": 0.0}, {"area": -1.0}, {"panels": ()}):
        with pytest.raises(ModelError):
            Task(**how)
    with pytest.raises(ModelError, match="k_x / k_y = -1"):
        with_ratio(-1.0)
    with pytest.raises(ModelError, match="both supports"):
        tangent_bending(folded("straight"), 4, span=500.0)
