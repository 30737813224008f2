"""States of a coarser mesh as places to begin at: interpolation, a ring that buckles, and sheets that need none."""

from __future__ import annotations

import numpy as np
import pytest

import meshes
from bh import Model, Outcome, Path, Sheet
from bh.solving.coarser import places
from bh.solving.follow import follow

RING = meshes.full_annulus(100.0, 10.0)
SECTOR = meshes.annulus_sector(100.0, 10.0, 0.8)


def folded(pattern: meshes.CreasePattern, along: int, rows: int, coarser: Path | None = None) -> Path:
    mesh = meshes.structured(pattern, along=along, rows=rows)
    return follow(Model(mesh, Sheet(E=4000.0, t=0.127)).fold("crease", to=2.2), coarser=coarser)


@pytest.mark.parametrize("pattern", [RING, SECTOR])
def test_linear_fields_are_interpolated_exactly(pattern: meshes.CreasePattern) -> None:
    coarse = meshes.structured(pattern, along=12, rows=1)
    points = meshes.structured(pattern, along=24, rows=2).points
    triangles, weights = places(coarse, points)
    assert np.einsum("nk,nkd->nd", weights, coarse.points[triangles]) == pytest.approx(points, abs=1e-9)
    own, weights = places(coarse, coarse.points)
    assert weights.min() == pytest.approx(0.0, abs=1e-9)
    assert own[np.arange(len(own)), weights.argmax(axis=1)] == pytest.approx(np.arange(len(own)))


def test_a_buckled_ring_is_found_from_the_coarser_one() -> None:
    """Two waves round and nothing to minimise: the coarser mesh alone needs some 75 iterations to its first state."""
    coarse = folded(RING, 32, 1)
    guided = folded(RING, 64, 2, coarse)
    assert guided.outcome is Outcome.REACHED
    assert guided.stable
    assert np.ptp(guided[-1].points[:, 2]) == pytest.approx(np.ptp(coarse[-1].points[:, 2]), rel=0.1)
    assert guided.records[1].iterations < 0.4 * coarse.records[1].iterations


def test_where_newton_finds_its_own_way_nothing_changes() -> None:
    coarse = folded(SECTOR, 8, 1)
    alone, guided = folded(SECTOR, 16, 2), folded(SECTOR, 16, 2, coarse)
    assert [record.lam for record in guided.records] == [record.lam for record in alone.records]
    assert np.array_equal(guided.records[-1].q, alone.records[-1].q)
