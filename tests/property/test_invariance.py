"""What must not matter: place, orientation, numbering, handedness, mountain or valley, unit of length."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import bh
import meshes
from bh import Displace, Fold, Force, Model, Sheet, trace
from meshes import SheetMesh

Array = NDArray[np.float64]
QUICK = settings(deadline=None, derandomize=True, max_examples=8)
SHEET = Sheet(E=4000.0, t=0.127)
FOLDS: dict[str, dict[str, Any]] = {"held": {"to": 2.0}, "spring": {"rest": 1.5, "Lstar": 25.0}}
KINDS = ("staggered", "alternating")
SAME = 1e-8


def sector(kind: str = "staggered", fold: str = "mountain", along: int = 8) -> SheetMesh:
    pattern = meshes.annulus_sector(100.0, 10.0, math.pi / 4, fold)  # type: ignore[arg-type]
    return meshes.structured(pattern, along=along, kind=kind)  # type: ignore[arg-type]


def free(mesh: SheetMesh) -> Model:
    """A free sheet for imposed angles and springs alike: nothing singles out a direction."""
    return Model(mesh, SHEET, formulation="bars-and-hinges")


def solve(model: Model) -> bh.State:
    path = trace(model)
    assert path.outcome == "reached", path.reason
    return path[-1]


def assert_same_energies(one: bh.State, two: bh.State, factor: float = 1.0) -> None:
    scale = one.energy.total
    for kind, value in one.energy.as_dict().items():
        assert two.energy.as_dict()[kind] / factor == pytest.approx(value, rel=SAME, abs=SAME * scale), kind
    assert two.energy.total / factor == pytest.approx(one.energy.total, rel=SAME)


def assert_same_shape(one: Array, two: Array) -> None:
    """Node positions (n, 3) alike but for a rigid motion: where a free sheet comes to lie depends on its way there."""
    a, b = one - one.mean(axis=0), two - two.mean(axis=0)
    left, _, right = np.linalg.svd(a.T @ b)
    turn = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    assert np.abs(a @ turn - b).max() < 1e-5  # mm
    assert np.abs(one - two).max() < 0.1  # and not far off


def renumbered(mesh: SheetMesh, seed: int) -> tuple[SheetMesh, NDArray[np.int64]]:
    """Nodes and triangles in another order, triangles begun at another corner; `new` of each old node."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(mesh.points))  # old node of each new one
    new = np.empty_like(order)
    new[order] = np.arange(len(order))
    triangles = new[mesh.triangles][rng.permutation(len(mesh.triangles))]
    triangles = np.array([np.roll(row, rng.integers(3)) for row in triangles])
    bare = SheetMesh(mesh.points[order], triangles)
    assert mesh.spans is not None
    found = mesh.topology.find_edges(order[bare.topology.edges])
    return (
        replace(
            bare,
            edge_sets={name: new[pairs] for name, pairs in mesh.edge_sets.items()},
            corners={name: int(new[node]) for name, node in mesh.corners.items()},
            folds=mesh.folds,
            spans=mesh.spans[found],
        ),
        new,
    )


def mirrored(mesh: SheetMesh) -> SheetMesh:
    """Seen in a mirror x -> -x: triangles turned round so that they stay counter-clockwise from +z."""
    return replace(mesh, points=mesh.points * np.array([-1.0, 1.0, 1.0]), triangles=mesh.triangles[:, ::-1])


CASES = list(itertools.product(KINDS, FOLDS))
every = pytest.mark.parametrize(("kind", "how"), CASES)


@cache
def base_state(kind: str, how: str) -> bh.State:
    return solve(free(sector(kind)).fold("crease", **FOLDS[how]))


def test_base_is_not_trivial() -> None:
    for kind, how in CASES:
        state = base_state(kind, how)
        assert state.energy.total > 1e-2
        assert (state.energy.folding > 0.0) is (how == "spring")


@every
@QUICK
@given(seed=st.integers(0, 10_000))
def test_rotated_and_translated(kind: str, how: str, seed: int) -> None:
    """The flat sheet anywhere in space: same energies and angles, positions moved along."""
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    Q = Q * np.sign(np.linalg.det(Q))
    shift = 100.0 * rng.normal(size=3)
    mesh = sector(kind)
    base = base_state(kind, how)
    moved = solve(free(replace(mesh, points=mesh.points @ Q.T + shift)).fold("crease", **FOLDS[how]))
    assert_same_energies(base, moved)
    assert np.abs(moved.dihedral_angles - base.dihedral_angles).max() < 1e-7
    assert_same_shape(moved.points, base.points @ Q.T + shift)


@every
@QUICK
@given(seed=st.integers(0, 10_000))
def test_renumbered(kind: str, how: str, seed: int) -> None:
    mesh, new = renumbered(sector(kind), seed)
    base = base_state(kind, how)
    state = solve(free(mesh).fold("crease", **FOLDS[how]))
    assert_same_energies(base, state)
    assert_same_shape(state.points[new], base.points)
    assert state.dihedral("crease") == pytest.approx(base.dihedral("crease"), abs=1e-7)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [1, 2])
def test_renumbered_and_stretched(kind: str, seed: int) -> None:
    """The same where the bars carry much of the load: clamped at one end, pulled and bent up at the other."""

    def pulled(mesh: SheetMesh) -> bh.State:
        up = Displace("corner:inner-end", "z", 1.0)
        pull = Displace("corner:outer-end", (-1.0, 1.0, 0.0), 0.2)
        return solve(Model(mesh, SHEET, formulation="bars-and-hinges").support("edge:start").step(pull, up))

    base = pulled(sector(kind))
    assert base.energy.stretching > 0.01 * base.energy.total
    mesh, new = renumbered(sector(kind), seed)
    state = pulled(mesh)
    assert_same_energies(base, state)
    assert np.abs(state.points[new] - base.points).max() < 1e-6


@every
@pytest.mark.parametrize("scale", [1e-3, 2.0, 1e3])
def test_unit_of_length(kind: str, how: str, scale: float) -> None:
    """Millimetres to metres (1e-3): E / s^2 in N / m^2, energies x s in N m; the numbers differ, the sheet does not."""
    mesh = sector(kind)
    assert mesh.spans is not None
    other = replace(mesh, points=mesh.points * scale, spans=mesh.spans * scale)
    sheet = Sheet(E=SHEET.E / scale**2, t=SHEET.t * scale)
    fold = dict(FOLDS[how])
    if "Lstar" in fold:
        fold["Lstar"] *= scale
    state = solve(Model(other, sheet, formulation="bars-and-hinges").fold("crease", **fold))
    assert_same_energies(base_state(kind, how), state, factor=scale)
    assert_same_shape(state.points / scale, base_state(kind, how).points)


@every
@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_unit_of_force(kind: str, how: str, factor: float) -> None:
    """E times a factor: all energies times that factor, same shape (a spring by its L* goes along)."""
    state = solve(
        Model(sector(kind), Sheet(E=SHEET.E * factor, t=SHEET.t), formulation="bars-and-hinges").fold(
            "crease", **FOLDS[how]
        )
    )
    assert_same_energies(base_state(kind, how), state, factor=factor)
    assert_same_shape(state.points, base_state(kind, how).points)


def test_similar_sheets() -> None:
    """All lengths times s with the same E: energies times s^3."""
    base, s = base_state("staggered", "held"), 3.0
    pattern = meshes.annulus_sector(100.0 * s, 10.0 * s, math.pi / 4)
    state = solve(
        Model(
            meshes.structured(pattern, along=8),
            Sheet(E=SHEET.E, t=SHEET.t * s),
            formulation="bars-and-hinges",
        ).fold("crease", to=2.0)
    )
    assert_same_energies(base, state, factor=s**3)


@every
def test_valley_mirrors_mountain(kind: str, how: str) -> None:
    """The same fold downwards: every dihedral angle explementary, heights reversed, same energies."""
    base = base_state(kind, how)
    fold = {
        key: (2.0 * math.pi - value if key in ("to", "rest") else value) for key, value in FOLDS[how].items()
    }
    state = solve(free(sector(kind, "valley")).fold("crease", **fold))
    assert_same_energies(base, state)
    assert np.abs(state.dihedral_angles + base.dihedral_angles - 2.0 * math.pi).max() < 1e-7
    assert_same_shape(state.points, base.points * [1, 1, -1])


@every
def test_fold_by_is_mountain_or_valley_as_drawn(kind: str, how: str) -> None:
    fold: dict[str, Any] = {"by": 1.0} if how == "held" else {"by": 1.0, "Lstar": 25.0}
    up = solve(free(sector(kind, "mountain")).fold("crease", **fold))
    down = solve(free(sector(kind, "valley")).fold("crease", **fold))
    assert_same_energies(up, down)
    assert (up.dihedral("crease") < math.pi).all()
    assert (up.fold_angle("crease") > 0.0).all()
    assert (down.dihedral("crease") > math.pi).all()
    lift = up.crease_points("crease")[:, 2].mean() - up.points[up.mesh.nodes("edge:outer"), 2].mean()
    assert lift > 1.0  # mm: the crease of a mountain goes to +z


@every
def test_left_and_right_are_alike(kind: str, how: str) -> None:
    """The mirrored mesh (other handedness of all triangles and diagonals) stores the same."""
    base = base_state(kind, how)
    mesh = mirrored(sector(kind))
    assert np.array_equal(np.sort(mesh.topology.edges.ravel()), np.sort(base.mesh.topology.edges.ravel()))
    state = solve(free(mesh).fold("crease", **FOLDS[how]))
    assert_same_energies(base, state)
    assert_same_shape(state.points, base.points * [-1, 1, 1])
    assert state.dihedral("crease") == pytest.approx(base.dihedral("crease"), abs=1e-7)


def test_left_and_right_with_loads_and_supports() -> None:
    """Oblique supports, a force and an unsymmetric support, seen in the mirror."""
    mesh = sector()
    flip = np.array([-1.0, 1.0, 1.0])

    def model(mesh: SheetMesh, s: Array) -> Model:
        def vector(*v: float) -> list[float]:
            return [float(x) for x in np.array(v) * s]

        supported = (
            Model(mesh, SHEET, formulation="bars-and-hinges")
            .support("corner:inner-start", "xyz")
            .support("corner:outer-start", "yz")
        )
        supported = supported.support("corner:outer-end", [vector(1.0, 0.3, 2.0)])
        return supported.step(
            Fold("crease", to=2.3),
            Force("edge:end", each=vector(1e-3, 0.0, 2e-3)),
            Force([5], each=vector(0, 1e-3, 0)),
        )

    one, two = solve(model(mesh, np.ones(3))), solve(model(mirrored(mesh), flip))
    assert_same_energies(one, two)
    assert np.abs(two.points - one.points * flip).max() < 1e-5
    assert np.abs(two.reactions - one.reactions * flip).max() < 1e-6


def test_turned_over() -> None:
    """Triangles counted clockwise: what was below is above, so a mountain becomes a valley of the same energy."""
    mesh = sector()
    over = replace(mesh, triangles=mesh.triangles[:, ::-1])
    state = solve(free(over).fold("crease", to=2.0 * math.pi - 2.0))
    assert_same_energies(base_state("staggered", "held"), state)
    assert_same_shape(state.points, base_state("staggered", "held").points)


def test_same_input_same_numbers() -> None:
    """Bit for bit."""
    again = solve(free(sector()).fold("crease", to=2.0))
    assert np.array_equal(again.points, base_state("staggered", "held").points)
    assert again.energy == base_state("staggered", "held").energy


FAR_FOLDS: dict[str, dict[str, Any]] = {**FOLDS, "pulled": {}}


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent"])
@pytest.mark.parametrize("how", FAR_FOLDS)
def test_far_origins(formulation: str, how: str) -> None:
    """A sheet at 1e8 mm, where coordinates are rounded to 1e-8 mm, folds like one at the origin."""

    def model(shift: float) -> Model:
        mesh = sector(along=6)
        mesh = replace(mesh, points=mesh.points + shift * np.array([1.0, -1.0, 0.5]))
        made = Model(mesh, SHEET, formulation=formulation)
        if how != "pulled":
            return made.fold("crease", **FAR_FOLDS[how])
        made = made.support("corner:inner-start", "xyz").support("corner:outer-start", "yz")
        held = made.support("corner:inner-end", "z").fold("crease", by=0.3)
        return held.step(Displace("corner:outer-end", "z", 1.0), Force([4], each=(0, 0, 1e-4)))

    here, there = trace(model(0.0)), trace(model(1e8))
    assert there.reached, there.reason
    for number in range(len(here.model.steps)):
        one = [s for s in here if s.step == number][-1]
        other = [s for s in there if s.step == number][-1]
        assert other.energy.total == pytest.approx(one.energy.total, rel=1e-6)
        assert np.abs(other.dihedral_angles - one.dihedral_angles).max() < 1e-5
    assert np.abs(there[-1].points - [1e8, -1e8, 5e7] - here[-1].points).max() < 1e-4
