"""Supports and the rigid-body support: what they take out, and that they leave the deformation alone."""

from __future__ import annotations

import math
import tracemalloc
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh import Displace, Fold, Force, Model, ModelError, RigidBody, Sheet, Support, trace
from bh.mechanics.bars_and_hinges.system import BarsAndHingesSystem
from bh.model.constraints import Prescribed, free_motions, resolve, rigid_motions
from bh.model.supports import directions, select
from meshes import MeshError, SheetMesh

Array = NDArray[np.float64]
SHEET = Sheet(E=4000.0, t=0.127)
MESH = meshes.structured(meshes.annulus_sector(100.0, 10.0, math.pi / 4), along=8)
SMALL = SheetMesh(np.array([[0, 0], [2, 0], [2, 1], [0, 1]]), np.array([[0, 1, 2], [0, 2, 3]]))
FOLDS: dict[str, dict[str, Any]] = {"held": {"to": 2.0}, "spring": {"rest": 1.5, "Lstar": 25.0}}


def solve(model: Model) -> bh.Path:
    path = trace(model)
    assert path.outcome == "reached", path.reason
    return path


def three_two_one(mesh: SheetMesh, a: int, b: int, c: int) -> tuple[Support, ...]:
    """A statically determinate support of a flat sheet: a fully, b across the line a-b, c out of plane."""
    along = mesh.points[b] - mesh.points[a]
    normal = np.array([0.0, 0.0, 1.0])
    across = np.cross(normal, along)
    return Support([a]), Support([b], [across.tolist(), normal.tolist()]), Support([c], "z")


# --------------------------------------------------------------------------------------- words


def test_directions() -> None:
    assert np.array_equal(directions("xz"), [[1, 0, 0], [0, 0, 1]])
    assert np.allclose(directions([[3.0, 0.0, 4.0]]), [[0.6, 0.0, 0.8]])
    assert np.allclose(directions([3.0, 0.0, 4.0]), [[0.6, 0.0, 0.8]])  # type: ignore[list-item]


@pytest.mark.parametrize(
    ("fix", "says"),
    [("xw", "'xw'"), ("", "''"), ("xx", "'xx'"), ([[0.0, 0.0, 0.0]], "zero vector"), ([[1.0, 2.0]], "three"),
     ([[math.nan, 0.0, 1.0]], "finite"), ("XY", "'XY'")],
)  # fmt: skip
def test_wrong_directions(fix: str | Sequence[Sequence[float]], says: str) -> None:
    with pytest.raises(ModelError, match=says) as caught:
        directions(fix)
    assert "\n" not in str(caught.value)


def test_select() -> None:
    assert select(MESH, "corner:inner-start").tolist() == [MESH.corners["corner:inner-start"]]
    assert select(MESH, "node:3").tolist() == [3]
    assert select(MESH, [4, 2]).tolist() == [4, 2]
    assert len(select(MESH, "all")) == len(MESH.points)
    with pytest.raises(MeshError, match="corner:inner-start"):
        select(MESH, "corner:nowhere")
    with pytest.raises(ModelError, match="not in the mesh"):
        select(MESH, [len(MESH.points)])
    wrong: Any
    for wrong in ([-1], [], [0.5], [[1]]):
        with pytest.raises(ModelError):
            select(MESH, wrong)


# --------------------------------------------------------------------------------------- resolve


def test_axes_need_no_frames() -> None:
    """Supports along x, y, z, also written as vectors of any length and sign, keep global axes."""
    supports = [
        Support([0], "xz"),
        Support([0], [[0.0, -3.0, 0.0]]),
        Support([1], [[0.0, 0.0, 2.0]]),
        RigidBody(),
    ]
    found = resolve(SMALL, supports)
    assert found.fixed.tolist() == [[True] * 3, [False, False, True], [False] * 3, [False] * 3]
    assert (found.frame_of == -1).all()
    assert found.frames.shape == (0, 3, 3)
    assert found.rigid_body


@pytest.mark.parametrize("by", [0.5, -0.5])
@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)])
def test_prescribed_along_an_axis(by: float, direction: tuple[float, float, float]) -> None:
    found = resolve(
        SMALL, [Support([0], "xyz"), RigidBody()], [Prescribed(np.array([2]), direction, 0.0, by)]
    )
    assert found.fixed[2].tolist() == [False, False, True]
    assert found.end[2, 2] == by * direction[2]


def test_a_displacement_that_begins_where_it_is_leaves_an_oblique_support_known() -> None:
    across, along = (-0.6, 0.0, 0.8), (0.8, 0.0, 0.6)
    found = resolve(
        SMALL, [Support([2], [across]), RigidBody()], [Prescribed(np.array([2]), along, math.nan, 0.5)]
    )
    axes = found.frames[found.frame_of[2]]
    support, moved = (int(np.argmax(np.abs(axes @ np.array(d)))) for d in (across, along))
    assert (found.start[2, support], found.end[2, support]) == (0.0, 0.0)
    assert math.isnan(found.start[2, moved])
    assert abs(found.end[2, moved]) == pytest.approx(0.5)


def test_oblique_frames_are_orthonormal_and_carry_the_displacement() -> None:
    u = np.array([0.6, 0.0, 0.8])
    found = resolve(
        SMALL, [Support([2], "y"), RigidBody()], [Prescribed(np.array([2]), (0.6, 0.0, 0.8), 0.1, 0.7)]
    )
    frame = found.frames[found.frame_of[2]]
    assert np.allclose(frame @ frame.T, np.eye(3), atol=1e-15)
    assert found.fixed[2].tolist() == [True, True, False]
    for values, expected in ((found.start, 0.1), (found.end, 0.7)):
        moved = frame.T @ (values[2] * found.fixed[2])
        assert moved @ u == pytest.approx(expected, abs=1e-15)
        assert moved @ [0, 1, 0] == pytest.approx(0.0, abs=1e-15)


def test_two_oblique_displacements_at_one_node() -> None:
    """Directions that are not orthogonal: both components come out as prescribed."""
    one, two = np.array([1.0, 1.0, 0.0]) / math.sqrt(2.0), np.array([0.0, 0.6, 0.8])
    items = [Prescribed(np.array([2]), tuple(d), 0.0, by) for d, by in ((one, 0.3), (two, -0.2))]
    found = resolve(SMALL, [RigidBody()], items)
    moved = found.frames[found.frame_of[2]].T @ (found.end[2] * found.fixed[2])
    assert moved @ one == pytest.approx(0.3, abs=1e-15)
    assert moved @ two == pytest.approx(-0.2, abs=1e-15)


def test_supports_in_one_direction_twice_are_one() -> None:
    twice = [
        Support([2], [[1.0, 1.0, 0.0]]),
        Support([2], [[-2.0, -2.0, 0.0]]),
        Support([2], "z"),
        RigidBody(),
    ]
    found = resolve(SMALL, twice)
    assert found.fixed[2].sum() == 2


@pytest.mark.parametrize(
    ("supports", "prescribed"),
    [
        ([Support([2], "z")], [((0.0, 0.0, 1.0), 0.5)]),
        ([Support([2], "xyz")], [((0.6, 0.0, 0.8), 0.5)]),
        ([Support([2], [[1.0, 1.0, 0.0]])], [((-1.0, -1.0, 0.0), 0.5)]),
        ([], [((1.0, 0.0, 0.0), 0.5), ((0.0, 1.0, 0.0), 0.5), ((0.6, 0.8, 0.0), 0.1)]),
    ],
)
def test_contradictions_name_the_node(supports: list[Support], prescribed: list[Any]) -> None:
    items = [Prescribed(np.array([2]), direction, 0.0, end) for direction, end in prescribed]
    with pytest.raises(ModelError, match="node 2"):
        resolve(SMALL, [*supports, RigidBody()], items)


def test_displacements_that_agree_are_no_contradiction() -> None:
    items = [
        Prescribed(np.array([2]), d, 0.0, by)
        for d, by in (((1, 0, 0), 0.5), ((0, 1, 0), 0.5), ((0.6, 0.8, 0), 0.7))
    ]
    assert resolve(SMALL, [RigidBody()], items).fixed[2].tolist() == [True, True, False]


# --------------------------------------------------------------------------------------- rigid motions


def test_rigid_motions_stretch_nothing() -> None:
    x = np.random.default_rng(0).normal(size=(7, 3))
    motions = rigid_motions(x)
    assert motions.shape == (21, 6)
    assert np.linalg.matrix_rank(motions) == 6
    for motion in motions.T:
        u = motion.reshape(-1, 3)
        for i in range(7):
            for j in range(i):
                assert abs((u[i] - u[j]) @ (x[i] - x[j])) < 1e-14


FREE: list[tuple[list[Support], int]] = [
    ([], 6),
    ([Support([0], "x")], 5),
    ([Support([0], "xyz")], 3),
    ([Support([0], "xyz"), Support([1], "z")], 2),
    ([Support([0], "xyz"), Support([1], "yz")], 1),
    ([Support([0], "xyz"), Support([1], "xyz")], 1),  # still turns about the line 0-1
    ([Support([0], "xyz"), Support([1], "yz"), Support([2], "z")], 0),
    ([Support("all", "z")], 3),
    ([Support("all", "xyz")], 0),
    (
        [Support([0], "xyz"), Support([1], "xz"), Support([2], "z")],
        1,
    ),  # turns about z: x at node 1 does not help
    ([Support([0], [[1.0, 1.0, 1.0]]), Support([1], [[1.0, -1.0, 0.5]])], 4),
    ([Support([0], [[1.0, 1.0, 1.0], [2.0, 2.0, 2.0]])], 5),
]


@pytest.mark.parametrize(("supports", "left"), FREE)
@pytest.mark.parametrize("unit", [1.0, 1e-9, 1e9])
def test_number_of_free_motions(supports: list[Support], left: int, unit: float) -> None:
    """Exactly six for a free sheet, fewer with partial supports, in any unit of length."""
    mesh = replace(SMALL, points=SMALL.points * unit)
    found = resolve(mesh, [*supports, RigidBody()])
    motions = free_motions(mesh.points, found)
    assert motions.shape == (6, left)
    assert np.linalg.matrix_rank(motions, tol=1e-12) == left
    u = (rigid_motions(mesh.points) @ motions).reshape(len(mesh.points), 3, left)
    for node in np.flatnonzero(found.frame_of >= 0):
        u[node] = found.frames[found.frame_of[node]] @ u[node]
    assert np.abs(u[found.fixed]).max(initial=0.0) < 1e-9 * max(1.0, np.abs(u).max(initial=0.0))


@pytest.mark.parametrize(("supports", "left"), FREE)
def test_missing_supports_are_counted(supports: list[Support], left: int) -> None:
    """Without a support at "rigid-body" a motion that is left free is an error that counts and names it."""
    if not supports:
        assert resolve(SMALL, []).rigid_body  # no support at all: taken out by itself
    elif left == 0:
        assert not resolve(SMALL, supports).rigid_body
    else:
        with pytest.raises(ModelError, match=rf"leave {left} of 6 rigid motions") as caught:
            resolve(SMALL, supports)
        assert "rigid-body" in str(caught.value)


def test_many_supported_nodes_need_little_memory() -> None:
    """Work and memory grow with the number of supported directions, not with its square (1.3 GB for 9,000 once)."""
    mesh = meshes.structured(meshes.strip(100.0, 10.0, [5.0]), along=1000)
    found = resolve(mesh, [Support("all", "z"), RigidBody()])
    tracemalloc.start()
    try:
        motions = free_motions(mesh.points, found)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert motions.shape == (6, 3)
    assert peak < 20e6  # bytes; a (3005, 3005) matrix alone has 72e6


def test_free_motion_is_named() -> None:
    with pytest.raises(ModelError, match=r"rotation about x\)"):
        resolve(SMALL, [Support("all", "xy"), Support([0], "z"), Support([1], "z")])


# --------------------------------------------------------------------------------------- the rigid-body support


def internal_forces(path: bh.Path) -> tuple[Array, Array]:
    """Nodes (n, 3) and forces (n, 3) of bars and hinges on them, in the last state of a free sheet."""
    record = path.records[-1]
    system = path.system(record.step)
    assert isinstance(system, BarsAndHingesSystem)
    _, _, forces, _, _ = system.internal_forces(path[-1].points, record.q, record.lam)
    return path[-1].points, forces


@pytest.mark.parametrize("how", FOLDS)
@pytest.mark.parametrize("kind", ["staggered", "alternating"])
def test_free_sheet_is_held_without_force(how: str, kind: str) -> None:
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, math.pi / 4), along=8, kind=kind)  # type: ignore[arg-type]
    path = solve(Model(mesh, SHEET, formulation="bars-and-hinges").fold("crease", **FOLDS[how]))
    for state in path:
        assert np.abs(state.reactions).max() == 0.0
    system = path.system(0)
    assert isinstance(system, BarsAndHingesSystem)
    assert system.primal == 3 * len(mesh.points)  # nothing is fixed, not even invisibly
    x, forces = internal_forces(path)
    typical = np.abs(system.evaluate(path.records[-1].q, 1.0).forces[: len(system.elements.bars)]).max()
    rounding = 1e-14 * system.elements.bar_stiffness.max() * np.abs(x).max()
    assert np.abs(forces.sum(axis=0)).max() < 1e-9 * typical + rounding
    assert np.abs(np.cross(x, forces).sum(axis=0)).max() < 1e-9 * typical * 100.0 + rounding * 100.0
    # far from equilibrium, where forces do not vanish, their sums still do
    q = path.records[-1].q.copy()
    q[: system.primal] += 0.1 * np.random.default_rng(0).normal(size=system.primal)
    x = system.positions(q, 1.0)
    _, _, forces, _, _ = system.internal_forces(x, q, 1.0)
    size = np.abs(forces).max()
    assert size > 1.0
    assert np.abs(forces.sum(axis=0)).max() < 1e-12 * size
    assert np.abs(np.cross(x, forces).sum(axis=0)).max() < 1e-11 * size * np.abs(x).max()


@pytest.mark.parametrize("how", FOLDS)
def test_free_sheet_stores_what_determinate_supports_let_it_store(how: str) -> None:
    """Any 3-2-1 support, at any three nodes, has no force in it: same energy, same angles, no reactions."""
    free = solve(Model(MESH, SHEET, formulation="bars-and-hinges").fold("crease", **FOLDS[how]))
    rng = np.random.default_rng(7)
    triples = [(0, len(MESH.points) - 1, 4)]
    while len(triples) < 4:
        a, b, c = (int(i) for i in rng.choice(len(MESH.points), 3, replace=False))
        p = MESH.points[[a, b, c]]
        if np.linalg.norm(np.cross(p[1] - p[0], p[2] - p[0])) > 100.0:  # mm^2: not nearly in a line
            triples.append((a, b, c))
    for a, b, c in triples:
        held = solve(
            replace(
                Model(MESH, SHEET, formulation="bars-and-hinges"), supports=three_two_one(MESH, a, b, c)
            ).fold("crease", **FOLDS[how])
        )
        assert held[-1].energy.total == pytest.approx(free[-1].energy.total, rel=1e-9)
        assert held[-1].energy.stretching == pytest.approx(free[-1].energy.stretching, rel=1e-6)
        assert np.abs(held[-1].dihedral_angles - free[-1].dihedral_angles).max() < 1e-7
        assert np.abs(held[-1].reactions).max() < 1e-8  # N; the force to fold is of order 1e-2


def test_partial_supports_and_rigid_body() -> None:
    """A single node or a line that is held, the rest free: the same sheet, moved."""
    free = solve(Model(MESH, SHEET, formulation="bars-and-hinges").fold("crease", to=2.0))
    for supports in (
        [("corner:inner-start", "xyz")],
        [("corner:inner-start", "xyz"), ("corner:inner-end", "y")],
        [("node:3", [[1.0, 2.0, 3.0]])],
    ):
        model = Model(MESH, SHEET, formulation="bars-and-hinges")
        for at, fix in supports:
            model = model.support(at, fix)
        held = solve(model.support("rigid-body").fold("crease", to=2.0))
        assert held[-1].energy.total == pytest.approx(free[-1].energy.total, rel=1e-9)
        assert np.abs(held[-1].reactions).max() < 1e-8
        node = select(MESH, supports[0][0])[0]
        u = held[-1].points[node] - MESH.points[node]
        for direction in directions(supports[0][1]):
            assert abs(u @ direction) < 1e-12


def test_rigid_body_beside_full_supports_does_nothing() -> None:
    model = (
        Model(MESH, SHEET, formulation="bars-and-hinges").support("edge:inner", "xyz").fold("crease", to=2.5)
    )
    plain, both = solve(model), solve(model.support("rigid-body"))
    assert np.array_equal(plain[-1].points, both[-1].points) or np.allclose(
        plain[-1].points, both[-1].points, rtol=0, atol=1e-9
    )
    assert both[-1].energy.total == pytest.approx(plain[-1].energy.total, rel=1e-9)


def test_free_sheet_stays_where_it_is() -> None:
    """The least displacement: no mean motion and no mean rotation is added in a small fold."""
    state = solve(Model(MESH, SHEET, formulation="bars-and-hinges").fold("crease", to=math.pi - 1e-3))[-1]
    Z = np.linalg.qr(rigid_motions(MESH.points))[0]
    u = (state.points - MESH.points).ravel()
    assert np.abs(Z.T @ u).max() < 1e-3 * np.linalg.norm(u)


# --------------------------------------------------------------------------------------- loads on free sheets


@pytest.mark.parametrize(
    "force",
    [Force("corner:inner-start", each=(0.0, 0.0, 1e-3)), Force("edge:inner", total=(1e-6, 0.0, 0.0)),
     Force("all", each=(0.0, 1.0, 0.0))],
)  # fmt: skip
def test_loads_out_of_balance_are_refused(force: Force) -> None:
    with pytest.raises(ModelError, match="not in equilibrium"):
        trace(Model(MESH, SHEET, formulation="bars-and-hinges").step(force))


def test_a_couple_on_a_free_sheet_is_refused() -> None:
    """Forces that sum to nothing, but turn the sheet."""
    a, b = Force("corner:inner-start", each=(0, 0, 1e-3)), Force("corner:inner-end", each=(0, 0, -1e-3))
    with pytest.raises(ModelError, match="not in equilibrium"):
        trace(Model(MESH, SHEET, formulation="bars-and-hinges").step(a, b))


def test_loads_that_the_partial_supports_can_carry_are_taken() -> None:
    """A force against a support is in equilibrium with it; along a free motion it is not."""
    model = (
        Model(MESH, SHEET, formulation="bars-and-hinges")
        .support("corner:inner-start", "xyz")
        .support("rigid-body")
    )
    a = Force("corner:inner-start", each=(0.0, 0.0, 1.0))
    path = solve(model.step(a))
    assert path[-1].reaction("corner:inner-start") == pytest.approx([0, 0, -1.0])
    with pytest.raises(ModelError, match="not in equilibrium"):
        trace(model.step(Force("corner:outer-end", each=(0.0, 0.0, 1e-3))))


def test_balanced_pair_on_a_free_sheet() -> None:
    """A symmetric pull on a free folded sheet: same energy as with a determinate support, reactions none."""
    a, b = MESH.corners["corner:inner-start"], MESH.corners["corner:inner-end"]
    pull = 0.01 * (MESH.points[b] - MESH.points[a]) / np.linalg.norm(MESH.points[b] - MESH.points[a])
    step = (Fold("crease", to=2.0), Force([a], each=tuple(-pull)), Force([b], each=tuple(pull)))
    free = solve(Model(MESH, SHEET, formulation="bars-and-hinges").step(*step))
    held = solve(
        replace(
            Model(MESH, SHEET, formulation="bars-and-hinges"), supports=three_two_one(MESH, a, b, 4)
        ).step(*step)
    )
    assert free[-1].energy.total == pytest.approx(held[-1].energy.total, rel=1e-7)
    assert (
        free[-1].energy.total
        > 1.001
        * solve(Model(MESH, SHEET, formulation="bars-and-hinges").fold("crease", to=2.0))[-1].energy.total
    )


@pytest.mark.xfail(
    strict=True,
    reason="the rigid part of every Newton step is projected out, so a free sheet cannot turn into the direction "
    "in which dead forces are in balance; the step ends as 'stalled: iteration limit' after hundreds of iterations",
)
def test_dead_pull_may_turn_a_free_sheet() -> None:
    """Two opposite dead forces on a triangle: in balance in the flat sheet; in tension there is a stable state."""
    triangle = SheetMesh(np.array([[0, 0], [1, 0], [0, 1]]), np.array([[0, 1, 2]]))
    pull = (Force([0], each=(0.0, -0.1, 0.0)), Force([2], each=(0.0, 0.1, 0.0)))
    path = trace(Model(triangle, SHEET, formulation="bars-and-hinges").step(*pull))
    assert path.outcome == "reached"
    bar = np.diff(path[-1].points[[0, 2]], axis=0)[0]
    assert np.cross(bar, [0.0, 0.1, 0.0]) == pytest.approx([0, 0, 0], abs=1e-9)


def test_loads_that_lose_their_balance_do_not_end_as_reached() -> None:
    """Opposite forces on corners that are not each other's mirror image: folding turns their line."""
    a, b = MESH.corners["corner:inner-start"], MESH.corners["corner:outer-end"]
    pull = 0.1 * (MESH.points[b] - MESH.points[a]) / np.linalg.norm(MESH.points[b] - MESH.points[a])
    strategy = bh.LoadControl(smallest=0.02, newton=bh.Newton(globalised=20))
    path = trace(
        Model(MESH, SHEET, formulation="bars-and-hinges").step(
            Fold("crease", to=2.0), Force([a], each=tuple(-pull)), Force([b], each=tuple(pull))
        ),
        strategy=strategy,
    )
    torque = np.cross(path[-1].points[b] - path[-1].points[a], path.lambdas[-1] * pull)
    assert np.abs(torque).max() < 1e-6  # what was kept is in equilibrium
    assert path.outcome == "mechanism"
    assert path.reason.startswith("the forces turn the free sheet")


# --------------------------------------------------------------------------------------- oblique = rotated


def test_oblique_supports_are_rotated_axis_supports() -> None:
    """Turn the sheet, the supports, the force and the displacement together: everything turns along."""
    Q, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    Q = Q * np.sign(np.linalg.det(Q))

    def turned(vector: Sequence[float] | Array) -> list[float]:
        return [float(x) for x in Q @ np.asarray(vector, dtype=float)]

    axes = np.eye(3)
    rotated = replace(MESH, points=MESH.points @ Q.T)
    plain = (
        Model(MESH, SHEET, formulation="bars-and-hinges")
        .support("corner:inner-start", "xyz")
        .support("corner:outer-start", "yz")
    )
    plain = plain.support("corner:inner-end", "z")
    oblique = Model(rotated, SHEET, formulation="bars-and-hinges").support(
        "corner:inner-start", [turned(v) for v in axes]
    )
    oblique = oblique.support("corner:outer-start", [turned(v) for v in axes[1:]])
    oblique = oblique.support("corner:inner-end", [turned(axes[2])])
    up, force = (0.0, 0.0, 1.0), (1e-3, 0.0, 2e-3)
    one = solve(
        plain.step(
            Fold("crease", to=2.2), Force("crease:crease", each=force), Displace("corner:outer-end", "z", 2.0)
        )
    )
    two = solve(
        oblique.step(
            Fold("crease", to=2.2),
            Force("crease:crease", each=turned(force)),
            Displace("corner:outer-end", turned(up), 2.0),
        )
    )
    assert two[-1].energy.total == pytest.approx(one[-1].energy.total, rel=1e-9)
    assert np.abs(two[-1].points - one[-1].points @ Q.T).max() < 1e-6
    scale = np.abs(one[-1].reactions).max()
    assert scale > 1e-4
    assert np.abs(two[-1].reactions - one[-1].reactions @ Q.T).max() < 1e-6 * scale
