"""Self-contact: configurations that are known to meet themselves, ones that only touch or come near, and reports."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import bh
import meshes
from bh import Model, Sheet, State, trace
from bh.analysis.contact import Panels, candidates, first_contact, self_contact
from bh.analysis.projection import outline, seen_once
from bh.analysis.triangles import intersecting
from bh.commands.cli import main
from bh.scene.load import load_scene

Array = NDArray[np.float64]
EXAMPLES = sorted((Path(__file__).resolve().parents[2] / "examples").glob("*.toml"))
SHEET = Sheet(E=4000.0, t=0.1)


def meet(points: object, one: tuple[int, ...], two: tuple[int, ...]) -> bool:
    """Whether two triangles intersect; alike in either order and however their corners are turned."""
    x = np.array(points, dtype=float)
    size = float(np.linalg.norm(np.ptp(x, axis=0)))
    found = set()
    for turn in range(3):
        for a, b in ((one, np.roll(two, turn)), (np.roll(one, turn), two[::-1])):
            for pair in ([0, 1], [1, 0]):
                triangles = np.array([a, b], dtype=np.int64)
                found.add(bool(intersecting(x, triangles, np.array([pair]), 1e-9 * size)[0]))
    assert len(found) == 1
    return found.pop()


def at(mesh: meshes.SheetMesh, points: Array, lam: float = 1.0) -> State:
    """A state with nothing in it but positions."""
    none = np.zeros(len(mesh.topology.hinges))
    energy = bh.Energy(0.0, 0.0, 0.0)
    return State(mesh, 0, lam, points, energy, none, {}, np.zeros_like(points), none)


def bent(mesh: meshes.SheetMesh, curve: Callable[[Array], Array]) -> State:
    """A strip along x bent to a curve (k, 2) of its arc length in the plane x, z."""
    x = mesh.points.copy()
    x[:, [0, 2]] = curve(mesh.points[:, 0])
    return at(mesh, x)


def rotation(seed: int) -> Array:
    Q, R = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return np.asarray(Q * np.sign(np.linalg.det(Q)))


# --------------------------------------------------------------------------------------- two triangles

CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))
BASE = [[0, 0, 0], [4, 0, 0], [0, 4, 0]]


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        ([[1, 1, -1], [1, 1, 1], [2, 1, 1]], True),  # pierced from above to below
        ([[1, 1, 0.01], [1, 1, 1], [2, 1, 1]], False),  # above
        ([[5, 5, -1], [5, 5, 1], [6, 5, 1]], False),  # beside, through the plane
        ([[-1, 1, -1], [9, 1, -1], [1, 1, 9]], True),  # the other way: through the larger one
        ([[1, 1, 0], [1, 1, 1], [2, 1, 1]], False),  # a corner on the face: touching
        ([[0, 0, 0], [0, 0, 1], [-1, 0, 1]], False),  # corner on corner
        ([[1, 1, 0], [2, 1, 0], [1, 1, 1]], True),  # an edge in the face
        ([[0, 0, 0], [4, 0, 0], [0, 0, 4]], False),  # edge on edge: the banks of a slit
        ([[1, 0, 0], [9, 0, 0], [0, 0, 4]], False),  # the same, shifted
        ([[1, 1, 0], [2, 1, 0], [1, 2, 0]], True),  # in its plane, inside
        ([[3, 3, 0], [5, 1, 0], [1, 5, 0]], False),  # in its plane, beside
        ([[2, 2, 0], [4, 4, 0], [0, 9, 0]], False),  # in its plane, a corner on an edge
        ([[0, 0, 0], [4, 0, 0], [4, -4, 0]], False),  # in its plane, edge on edge
        ([[0, 0, 0], [4, 0, 0], [0, 4, 0]], True),  # on top of it
        ([[0, 0, 1e-12], [4, 0, 0], [0, 4, -1e-12]], True),  # on top of it but for rounding
        ([[0, 0, 1e-5], [4, 0, 1e-5], [0, 4, 1e-5]], False),  # a little above
        ([[0, 0, 1e-5], [4, 0, -1e-5], [0, 4, 1e-5]], True),  # nearly in its plane, and through it
    ],
)
def test_two_triangles(other: list[list[float]], expected: bool) -> None:
    for seed in (None, 1, 2):
        x = np.array(BASE + other, dtype=float)
        if seed is not None:
            x = x @ rotation(seed).T
        assert meet(x, (0, 1, 2), (3, 4, 5)) is expected


@pytest.mark.parametrize(
    ("far", "expected"),
    [
        ([[-2, 1, 0], [-2, -1, 0]], False),  # a bow tie in the plane
        ([[1, 1, 0], [9, 2, 0]], True),  # in the plane, overlapping
        ([[-1, 4, 0], [-4, 3, 0]], False),  # the next but one of a fan
        ([[0, 4, 0], [-4, 3, 0]], False),  # edge on edge
        ([[1, 1, 1], [2, 2, -1]], True),  # through the face
        ([[-1, -1, 1], [-2, -2, -1]], False),  # through the plane, behind the node
        ([[1, 1, 0], [1, 1, 1]], True),  # its edge in the face
        ([[1, 1, 1], [2, 1, 1]], False),  # above
    ],
)
def test_a_shared_node(far: list[list[float]], expected: bool) -> None:
    for seed in (None, 1, 2):
        x = np.array(BASE + far, dtype=float) + np.array([7.0, -3.0, 2.0])
        if seed is not None:
            x = x @ rotation(seed).T
        assert meet(x, (0, 1, 2), (0, 3, 4)) is expected


@pytest.mark.parametrize(("angle", "expected"), [(0.0, True), (1e-4, False), (1.0, False), (math.pi, False)])
def test_a_shared_edge(angle: float, expected: bool) -> None:
    """A hinge meets itself only when it is closed."""
    wing = [1.0, math.cos(angle), math.sin(angle)]
    x = np.array([[0, 0, 0], [2, 0, 0], [1, 1, 0], wing])
    for seed in (None, 3, 4):
        y = x if seed is None else x @ rotation(seed).T
        assert meet(y, (0, 1, 2), (1, 0, 3)) is expected


def crossing_by_orientation(A: Array, B: Array) -> bool:
    """Whether an edge of one triangle pierces the other, by signs of volumes (generic positions only)."""

    def volume(a: Array, b: Array, c: Array, d: Array) -> float:
        return float(np.linalg.det(np.array([b - a, c - a, d - a])))

    for one, two in ((A, B), (B, A)):
        for i in range(3):
            p, q = one[i], one[(i + 1) % 3]
            if volume(two[0], two[1], two[2], p) * volume(two[0], two[1], two[2], q) < 0.0:
                signs = {volume(p, q, two[k], two[(k + 1) % 3]) > 0.0 for k in range(3)}
                if len(signs) == 1:
                    return True
    return False


def test_random_triangles_against_volumes() -> None:
    """Another algorithm, without planes and intervals, on the same thousand pairs."""
    rng = np.random.default_rng(8)
    x = rng.normal(size=(1000, 6, 3))
    triangles = np.arange(6000).reshape(-1, 3)
    pairs = np.arange(2000).reshape(-1, 2)
    found = intersecting(x.reshape(-1, 3), triangles, pairs, 1e-12)
    expected = np.array([crossing_by_orientation(one[:3], one[3:]) for one in x])
    assert 100 < expected.sum() < 900
    assert np.array_equal(found, expected)


def test_random_neighbours_against_volumes() -> None:
    """Pairs with one node in common: they intersect if the far edge of either pierces the other."""
    rng = np.random.default_rng(9)
    x = rng.normal(size=(1000, 5, 3))
    base = 5 * np.arange(1000)[:, None]
    triangles = (base + np.array([0, 1, 2, 3, 0, 4])).reshape(-1, 3)
    found = intersecting(x.reshape(-1, 3), triangles, np.arange(2000).reshape(-1, 2), 1e-12)

    def pierced(edge: Array, triangle: Array) -> bool:
        far = np.concatenate((edge, [edge.mean(axis=0) + 1e3 * np.cross(edge[1] - edge[0], [0.3, 0.5, 0.8])]))
        return crossing_by_orientation(far, triangle) and _segment_hits(edge, triangle)

    expected = np.array([pierced(y[1:3], y[[3, 0, 4]]) or pierced(y[3:5], y[[0, 1, 2]]) for y in x])
    assert 50 < expected.sum() < 950
    assert np.array_equal(found, expected)


def _segment_hits(edge: Array, triangle: Array) -> bool:
    """Solve for the point that the segment and the triangle have in common."""
    a, b, c = triangle
    p, q = edge
    share, v, w = np.linalg.solve(np.column_stack((p - q, b - a, c - a)), p - a)
    return bool(0.0 < share < 1.0 and v > 0.0 and w > 0.0 and v + w < 1.0)


# --------------------------------------------------------------------------------------- sheets


def strip(along: int = 40, rows: int = 2) -> meshes.SheetMesh:
    return meshes.structured(meshes.strip(40.0, 6.0), along=along, rows=rows)


def loop(s: Array) -> Array:
    """A ribbon that crosses itself once: straight ends and a turn of 3/2 pi between them."""
    turn = 1.5 * math.pi
    t = np.clip((s - 12.0) / 16.0, 0.0, 1.0)
    r = 16.0 / turn
    straight = np.minimum(s, 12.0)[:, None] * [1.0, 0.0]
    arc = r * np.column_stack((np.sin(turn * t), 1.0 - np.cos(turn * t)))
    end = np.maximum(s - 28.0, 0.0)[:, None] * [math.cos(turn), math.sin(turn)]
    return np.asarray(straight + arc + end)


def roll(pitch: float, turns: float = 2.5) -> Callable[[Array], Array]:
    """A spiral whose radius changes by `pitch` a turn: positive for a roll, zero for layers on top of each other."""

    def curve(s: Array) -> Array:
        angle = 2.0 * math.pi * turns * s / 40.0
        r = 3.0 + pitch * angle / (2.0 * math.pi)
        return np.column_stack((r * np.cos(angle), r * np.sin(angle)))

    return curve


def test_ribbon_through_itself() -> None:
    state = bent(strip(), loop)
    pairs = self_contact(state)
    assert len(pairs) > 0
    assert (pairs[:, 0] < pairs[:, 1]).all()
    # the two straight ends cross where s = 12 - r and 28 + r, and nowhere else
    s = state.mesh.points[state.mesh.triangles].mean(axis=1)[:, 0][pairs]
    r = 16.0 / (1.5 * math.pi)
    assert np.abs(s - [12.0 - r, 28.0 + r]).max() < 2.0


@pytest.mark.parametrize(("pitch", "expected"), [(0.5, False), (-0.5, False), (0.0, True)])
def test_rolled_up(pitch: float, expected: bool) -> None:
    """Layers that keep apart, and layers in the same place."""
    along = 50  # twenty segments a turn, so that layers with no pitch coincide
    assert bool(len(self_contact(bent(strip(along), roll(pitch))))) is expected


def test_rolled_onto_itself_with_another_division() -> None:
    """Twenty-one and a half segments a turn: the layers cut through each other."""
    assert len(self_contact(bent(strip(54), roll(0.0)))) > 10


def test_closed_tube_touches_only() -> None:
    """The start edge on the end edge, in the same place but with nodes of its own."""
    assert len(self_contact(bent(strip(), roll(0.0, 1.0)))) == 0
    assert len(self_contact(bent(strip(), roll(0.0, 1.02)))) > 0


def test_staircase() -> None:
    """Two turns of a ramp, all facing up: seen twice from above, but free; pressed flat it lies on itself."""
    mesh = strip(60)
    s, width = mesh.points[:, 0], mesh.points[:, 1]
    angle, radius = 4.0 * math.pi * s / 40.0, 5.0 + width
    flat = np.column_stack((-radius * np.cos(angle), radius * np.sin(angle), 0.0 * s))
    ramp = flat + np.column_stack((0.0 * s, 0.0 * s, 0.3 * angle))
    loops = outline(mesh.triangles)
    for x in (flat, ramp):
        assert not seen_once(x, mesh.triangles, loops)
    assert len(self_contact(at(mesh, ramp))) == 0
    assert len(self_contact(at(mesh, flat))) > 10


def test_two_discs_joined_crosswise() -> None:
    """A large square and a small one on it, cut from p over q to r and each bank joined to the other square's.

    All faces up, two boundaries that are shell and hole of a valid polygon, and yet the hole is covered twice.
    """
    nodes = np.array([[-1, 0], [1, 0], [0, 0], [0, 0]] + [[a * x, a * y] for a in (4, 2) for x, y in CORNERS])
    p, r, above, below = range(4)
    triangles = []
    for corners, q_above, q_below in (((4, 5, 6, 7), above, below), ((8, 9, 10, 11), below, above)):
        sw, se, ne, nw = corners
        triangles += [[p, q_above, nw], [q_above, ne, nw], [q_above, r, ne], [r, se, ne]]
        triangles += [[q_below, p, sw], [q_below, sw, se], [r, q_below, se], [p, nw, sw]]
    x = np.column_stack((nodes, np.zeros(len(nodes)))).astype(float)
    edges = [tuple(sorted((t[k], t[k - 1]))) for t in triangles for k in range(3)]
    assert sorted({e for e in edges if edges.count(e) == 1}) == [  # a manifold with these two boundaries
        (4, 5),
        (4, 7),
        (5, 6),
        (6, 7),
        (8, 9),
        (8, 11),
        (9, 10),
        (10, 11),
    ]
    assert max(edges.count(e) for e in edges) == 2
    assert not seen_once(x, np.array(triangles), outline(np.array(triangles)))
    large = np.array(triangles[:8])
    large[large == below] = above
    assert seen_once(x, large, outline(large))  # one square alone


@pytest.mark.parametrize("angle", [0.0, 1e-3, 0.5])
def test_folded_shut(angle: float) -> None:
    """Panels on each other meet over their whole area; a thousandth of a radian apart they do not."""
    mesh = meshes.structured(meshes.strip(20.0, 10.0, [5.0]), along=6, rows=2)
    x = mesh.points.copy()
    y = x[:, 1] - 5.0
    outer = y > 1e-9
    x[outer, 1], x[outer, 2] = 5.0 - y[outer] * math.cos(angle), -y[outer] * math.sin(angle)
    pairs = self_contact(at(mesh, x))
    if angle > 0.0:
        assert len(pairs) == 0
    else:
        assert set(np.unique(pairs)) == set(range(len(mesh.triangles)))
        assert (Panels.of(mesh).of_triangle[pairs] == [0, 1]).all()


def test_flat_sheets_do_not_meet_themselves() -> None:
    """All neighbours lie in one plane; also without the proof by projection."""
    for pattern in (
        meshes.annulus_sector(40.0, 8.0, 5.0),
        meshes.full_annulus(40.0, 8.0),
        meshes.strip(30.0, 10.0, [4.0]),
    ):
        mesh = meshes.structured(pattern, along=40, rows=2)
        assert seen_once(mesh.points, mesh.triangles, outline(mesh.triangles))
        assert not intersecting(
            mesh.points, mesh.triangles, candidates(mesh.points, mesh.triangles), 1e-8
        ).any()


@settings(deadline=None, max_examples=40, derandomize=True)
@given(st.integers(0, 10_000), st.floats(0.1, 1.2))
def test_rigid_motion_and_numbering_change_nothing(seed: int, bend: float) -> None:
    """Zigzags of random panels: the same pairs when moved, scaled, mirrored and renumbered; the proof never errs."""
    rng = np.random.default_rng(seed)
    mesh = strip(12, 1)
    segments = np.cumsum(rng.uniform(-bend, bend, 12) * math.pi)
    corners = np.concatenate(
        (np.zeros((1, 2)), np.cumsum(np.column_stack((np.cos(segments), np.sin(segments))), axis=0))
    )
    x = mesh.points.copy()
    s = np.clip(mesh.points[:, 0] / 40.0 * 12.0, 0.0, 12.0)
    x[:, 0], x[:, 2] = (40.0 / 12.0 * np.interp(s, np.arange(13), corners[:, c]) for c in (0, 1))
    x += 1e-3 * rng.normal(size=x.shape)
    pairs = self_contact(at(mesh, x))
    if seen_once(x, mesh.triangles, outline(mesh.triangles)):
        found = candidates(x, mesh.triangles)
        assert not intersecting(x, mesh.triangles, found, 1e-7).any()
    for y in (x @ rotation(seed).T + rng.normal(size=3), 1e-3 * x, x * [1.0, 1.0, -1.0]):
        assert np.array_equal(self_contact(at(mesh, y)), pairs)
    order = rng.permutation(len(mesh.triangles))
    other = meshes.SheetMesh(mesh.points, mesh.triangles[order])
    renumbered = np.argsort(order)[pairs]
    again = self_contact(at(other, x))
    assert {tuple(sorted(p)) for p in renumbered.tolist()} == {tuple(p) for p in again.tolist()}


def test_zigzags_are_of_both_kinds() -> None:
    """The property above is asked of sheets that meet themselves and of sheets that do not."""
    kinds = set()
    for bend in (0.2, 1.1):
        rng = np.random.default_rng(1)
        angles = np.cumsum(rng.uniform(-bend, bend, 12) * math.pi)
        mesh = strip(12, 1)
        corners = np.concatenate(
            ([[0, 0]], np.cumsum(np.column_stack((np.cos(angles), np.sin(angles))), axis=0))
        )
        x = mesh.points.copy()
        x[:, 0], x[:, 2] = (np.interp(x[:, 0] * 0.3, np.arange(13), corners[:, c]) for c in (0, 1))
        kinds.add(bool(len(self_contact(at(mesh, x)))))
    assert kinds == {True, False}


def test_boxes_are_all_found() -> None:
    x = np.random.default_rng(3).normal(size=(90, 3))
    triangles = np.arange(90).reshape(-1, 3)
    low, high = x[triangles].min(axis=1), x[triangles].max(axis=1)
    expected = [
        [i, j]
        for i in range(30)
        for j in range(i + 1, 30)
        if (low[i] <= high[j]).all() and (low[j] <= high[i]).all()
    ]
    assert 0 < len(expected) < 435
    assert sorted(candidates(x, triangles).tolist()) == expected


# --------------------------------------------------------------------------------------- solved paths


@cache
def example(file: Path) -> bh.Path:
    path = trace(load_scene(file).model)
    assert path.outcome == "reached"
    return path


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_no_false_alarm_in_examples(file: Path) -> None:
    """Neither with the proof by projection nor without it."""
    path = example(file)
    assert first_contact(path) is None
    for state in path:
        found = candidates(state.points, state.mesh.triangles)
        assert len(found) > len(state.mesh.topology.hinges) // 2
        assert not intersecting(state.points, state.mesh.triangles, found, 1e-7).any()


def test_no_false_alarm_in_deep_folds() -> None:
    mesh = meshes.structured(meshes.annulus_sector(200.0, 5.0, 0.5), aspect_ratio=6)
    path = trace(
        Model(mesh, Sheet(E=4000.0, t=0.5), formulation="bars-and-hinges", contact=False).fold(
            "crease", to=math.radians(1.0)
        )
    )
    assert path.outcome == "reached"
    assert not seen_once(path[-1].points, mesh.triangles, outline(mesh.triangles))
    assert first_contact(path) is None


def test_folded_sector_rolls_onto_itself() -> None:
    """A plane crease curls up by 1 / sin(phi / 2) when folded: its ends meet when it has turned by 2 pi, not before."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 4.6), aspect_ratio=6)
    model = (
        Model(mesh, SHEET, formulation="bars-and-hinges", contact=False)
        .support("crease:crease", "z")
        .support("rigid-body")
    )
    path = trace(
        model.fold("crease", to=math.pi / 2), strategy=bh.LoadControl(largest_rotation=math.radians(5.0))
    )
    assert path.outcome == "reached"
    turned = []
    for state in path:
        e = np.diff(state.crease_points("crease"), axis=0)
        e /= np.linalg.norm(e, axis=1)[:, None]
        angles = np.arccos(np.clip((e[1:] * e[:-1]).sum(axis=1), -1.0, 1.0))
        turned.append(angles.sum() * len(e) / len(angles))
    contact = first_contact(path)
    assert contact is not None
    assert turned[contact.state - 1] < 2.0 * math.pi < turned[contact.state]
    # what meets is the two ends
    corners = mesh.points[mesh.triangles].mean(axis=1)[contact.triangles]
    angle = np.mod(np.arctan2(corners[..., 1], corners[..., 0]), 2.0 * math.pi)
    assert (angle.min(axis=1) < 0.4).all()
    assert (angle.max(axis=1) > 4.2).all()


def roll_of_panels(to: float) -> Model:
    """Four mountain creases; at fold angles beyond 2 pi / 5 the last panel runs into the first."""
    mesh = meshes.structured(meshes.strip(12.0, 50.0, [10.0, 20.0, 30.0, 40.0]), along=3)
    return Model(mesh, SHEET, formulation="bars-and-hinges", contact=False).fold("all", by=to)


def test_corrugation_folded_past_contact() -> None:
    path = trace(roll_of_panels(1.5))
    assert path.outcome == "reached"
    contact = first_contact(path)
    assert contact is not None
    limit = 2.0 * math.pi / 5.0  # a closed pentagon
    assert path[contact.state].fold_angle("crease-1").mean() > limit - 1e-6
    assert path[contact.state - 1].fold_angle("crease-1").mean() <= limit + 1e-6
    assert (contact.step, contact.lam) == (0, path.records[contact.state].lam)
    assert ("panel 0 (at crease-1)", "panel 4 (at crease-4)") in contact.panels
    assert np.array_equal(contact.triangles, self_contact(path[contact.state]))
    text = str(contact)
    assert "\n" not in text
    assert text.startswith(f"state {contact.state} (step 0, lambda ")
    assert "panel 0 (at crease-1) and panel 4 (at crease-4)" in text
    assert first_contact(trace(roll_of_panels(1.2))) is None
    assert bh.contact.first_contact is first_contact


def test_panels() -> None:
    mesh = meshes.structured(meshes.annulus_sector((40.0, 50.0, 60.0), 8.0, 0.6), along=4)
    panels = Panels.of(mesh)
    assert len(panels.of_triangle) == len(mesh.triangles)
    assert panels.of_triangle[0] == 0
    assert sorted(panels.creases) == [
        ("crease-1",),
        ("crease-1", "crease-2"),
        ("crease-2", "crease-3"),
        ("crease-3",),
    ]
    middle = panels.creases.index(("crease-2", "crease-3"))
    assert panels.name(middle) == f"panel {middle} (between crease-2 and crease-3)"
    radius = np.hypot(*mesh.points[mesh.triangles].mean(axis=1)[:, :2].T)
    inside = panels.of_triangle == middle
    assert ((radius[inside] > 50.0 - 1.0) & (radius[inside] < 60.0 + 1.0)).all()
    assert inside.sum() * 4 == pytest.approx(len(mesh.triangles), rel=0.1)
    plain = Panels.of(meshes.structured(meshes.strip(10.0, 4.0), along=4))
    assert plain.creases == ((),)
    assert plain.name(0) == "panel 0"


def test_panels_of_imported_patterns_have_the_names_of_chains() -> None:
    """A FOLD file names all mountains and every chain of them; the chain is the one to be told."""
    model = load_scene(next(file for file in EXAMPLES if file.stem == "miura")).model
    panels = Panels.of(model.mesh)
    assert len(panels.creases) == len(model.mesh.triangles) // 2  # quadrilaterals
    named = {name for creases in panels.creases for name in creases}
    assert named <= set(model.mesh.creases) - {"mountain", "valley"}


def test_a_sheet_in_two_pieces() -> None:
    """Nothing is proven of pieces by their boundaries; they are looked at."""
    one = [[0, 0, 0], [4, 0, 0], [0, 4, 0]]
    two = [[1, 1, -1], [3, 1, 1], [1, 3, 1]]
    mesh = meshes.SheetMesh(
        np.array([*one, [9, 0, 0], [13, 0, 0], [9, 4, 0]]), np.array([[0, 1, 2], [3, 4, 5]])
    )
    assert not seen_once(mesh.points, mesh.triangles, outline(mesh.triangles))
    assert self_contact(at(mesh, np.array(one + two, dtype=float))).tolist() == [[0, 1]]
    assert len(self_contact(at(mesh, mesh.points))) == 0


SCENE = """
[pattern]
kind = "strip"
length = 12.0
width = 50.0
creases = [10.0, 20.0, 30.0, 40.0]
[sheet]
E = 4000.0
t = 0.1
[mesh]
along = 3
[[steps]]
fold = { crease = "all", by = %s }
"""


def test_run_reports_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for angle, name in (("1.5", "past"), ("1.2", "before")):
        Path(f"{name}.toml").write_text("contact = false\n" + SCENE % angle)
        assert main(["run", f"{name}.toml"]) == 0
    said = capsys.readouterr().out
    assert said.count("self-contact: none") == 1
    assert "self-contact (reported, not prevented), first in state " in said
    before, past = (
        json.loads(Path(f"{name}-out/result.json").read_text())["self_contact"] for name in ("before", "past")
    )
    assert before == {"found": False, "states": len(bh.Path.load("before-out/path.bh"))}
    contact = first_contact(bh.Path.load("past-out/path.bh"))
    assert contact is not None
    assert past["found"] is True
    assert "reported, not prevented" in past["about"]
    assert (past["state"], past["step"], past["lambda"]) == (contact.state, contact.step, contact.lam)
    assert past["panels"] == [list(pair) for pair in contact.panels]
    assert past["triangle_pairs"] == len(contact.triangles)
    assert past["triangles"] == contact.triangles[:100].tolist()
