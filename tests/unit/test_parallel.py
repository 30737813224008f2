"""Parallel creases: geometry of one pattern for all curvatures, and chains of arcs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import meshes
from meshes import ArcChain, PatternError
from meshes.curved import lift
from meshes.curves import sample


@pytest.mark.parametrize("k", [0.0, 1e-9, 0.01, -0.01])
def test_ends_of_the_first_crease(k: float) -> None:
    pattern = meshes.parallel_creases(k, 100.0, 5.0, 3)
    ends = pattern.creases[0].curve.point(np.array([0.0, 1.0]))
    assert ends[0] == pytest.approx([0.0, 0.0], abs=1e-6)
    half = 50.0 * k
    chord = 100.0 * (math.sin(half) / half if half else 1.0)
    assert ends[1] == pytest.approx([chord * math.cos(half), chord * math.sin(half)], abs=1e-5)
    assert [c.fold for c in pattern.creases] == ["mountain", "valley", "mountain"]


@pytest.mark.parametrize("k", [0.0, 0.01, -0.01])
def test_area_is_that_of_a_strip_about_a_curve(k: float) -> None:
    """Pappus: length of the middle line times the width."""
    mesh = meshes.unstructured(meshes.parallel_creases(k, 100.0, 5.0, 3), size=1.5)
    assert mesh.areas.sum() == pytest.approx(100.0 * (1.0 - 5.0 * k) * 20.0, rel=1e-4)


def test_a_chain_of_equal_arcs_is_the_arc() -> None:
    u = np.linspace(0.0, 1.0, 13)
    one, many = (
        meshes.parallel_creases(k, length, 5.0, 2).rails
        for k, length in ((0.01, 100.0), ((0.01, 0.01), (30.0, 70.0)))
    )
    for a, b in zip(one, many, strict=True):
        assert a.point(u) == pytest.approx(b.point(u), abs=1e-12)
        assert a.length == pytest.approx(b.length, rel=1e-14)


def test_a_chain_is_smooth_where_its_pieces_meet() -> None:
    chain = ArcChain((1.0, 2.0), 0.3, (0.02, 0.0, -0.03), (40.0, 20.0, 30.0), offset=4.0)
    for at in chain.breaks[1:-1]:
        x = chain.point(at + np.array([-1e-7, 0.0, 1e-7]))
        before, after = np.diff(x, axis=0)
        assert before / np.linalg.norm(before) == pytest.approx(after / np.linalg.norm(after), abs=1e-6)
    fine = chain.point(np.linspace(0.0, 1.0, 200001))
    assert np.linalg.norm(np.diff(fine, axis=0), axis=1).sum() == pytest.approx(chain.length, rel=1e-9)
    coarse = sample(chain)
    near = np.linalg.norm(fine[::20, None] - coarse[None], axis=2).argmin(axis=1)
    assert len(coarse) < 200
    for point, k in zip(fine[::20][::50], near[::50], strict=True):
        a, b = coarse[max(k - 1, 0)], coarse[min(k + 1, len(coarse) - 1)]
        middle = coarse[k]
        gaps = [
            abs((q - p)[0] * (point - p)[1] - (q - p)[1] * (point - p)[0]) / np.linalg.norm(q - p)
            for p, q in ((a, middle), (middle, b))
            if np.linalg.norm(q - p) > 0.0
        ]
        assert min(gaps) < 2e-3


def test_chains_are_meshed_lifted_stored() -> None:
    from bh import Model, Sheet
    from bh.model.serialise import describe, fingerprint, rebuild

    pattern = meshes.parallel_creases((0.02, 0.0, -0.01), (40.0, 20.0, 40.0), 5.0, 2)
    for mesh in (meshes.structured(pattern, along=50), meshes.unstructured(pattern, size=2.5)):
        lift(mesh)
        model = Model(mesh, Sheet(E=4000.0, t=0.1), formulation="bars-and-hinges")
        assert fingerprint(rebuild(*describe(model))) == fingerprint(model)


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ((0.1, 100.0, 5.0, 3), "radius of 10 mm"),
        ((-0.3, 100.0), "to that side"),
        ((0.0, -1.0), "must be positive"),
        ((0.0, 10.0, 1.0, 0), "whole number from 1"),
        (((0.0, 0.1), (10.0,)), "one of each"),
        ((math.nan, 10.0), "curvature = nan"),
    ],
)
def test_what_cannot_be(how: tuple[Any, ...], words: str) -> None:
    with pytest.raises(PatternError, match=words):
        meshes.parallel_creases(*how)
