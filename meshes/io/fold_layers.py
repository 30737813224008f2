"""Layers of a folded form, moved apart in the order that a FOLD file gives for its faces (`faceOrders`).

An order (f, g, s) says that face f lies on the side of g that its corners run round counter-clockwise (s = 1), or on
the other one (-1). Wherever a node of one face lies over a triangle of the other, or two edges cross, as seen along the
normal of g, the layers are asked to be a distance apart; parts that share a node are left to the crease. The smallest
moves of the nodes that do it, and differences of moves along edges, are a linear programme (the sum of all): panels
stay flat but next to creases.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshes.errors import FileFormatError
from meshes.io.fold_faces import triangulate
from meshes.io.fold_frame import Frame, show, side
from meshes.io.fold_nested import drawn_apart

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Order = tuple[int, int, int]
Triangle = Sequence[int]
Place = dict[int, float]  # a point of the sheet: its nodes and their weights
Ask = tuple[Place, Place, int, int]  # the upper and the lower point, and the faces that they lie in

ON = 1e-9  # weights and parts of an edge from which a point lies on a corner or a side
LEFT = 1e-6  # of the distance: what may be wanting
FEW = 0.1  # a move costs so much of a difference of moves
ROUNDS = 3  # in which layers that have become steep are moved farther apart
STEEPEST = 0.5  # cosine of the slope that is reckoned with
DEAR = 1e3  # what is wanting costs so much more than a move


def orders_of(frame: dict[str, Any], faces: int) -> list[Order]:
    """The orders of a frame that say something.

    Args:
        frame: a JSON object with all it inherits.
        faces: their number.

    Returns:
        two faces and 1 or -1 each.

    Raises:
        FileFormatError: there are none, or one cannot be; one line that names it.
    """
    rows = frame.get("faceOrders")
    if not isinstance(rows, list) or not rows:
        raise FileFormatError(
            "the frame has no faceOrders to untangle its layers by; give them, or no untangle"
        )
    found = []
    for number, row in enumerate(rows):
        whole = isinstance(row, list) and len(row) == 3 and all(type(each) is int for each in row)
        if not whole or not (0 <= row[0] < faces and 0 <= row[1] < faces and row[2] in (-1, 0, 1)):
            raise FileFormatError(
                f"faceOrders[{number}] is {show(row)}; give two faces below {faces} and 1, -1 or 0"
            )
        if row[2] != 0 and row[0] != row[1]:
            found.append((row[0], row[1], row[2]))
    return found


def untangled(frame: Frame, orders: Sequence[Order], distance: float) -> Frame:
    """A frame whose points are moved until layers are a distance apart.

    Args:
        frame: with faces.
        orders: of the faces.
        distance: mm.

    Returns:
        the frame with triangles for faces; sides that are new are F edges.

    Raises:
        FileFormatError: a face cannot be read, or layers that far apart do not fit; one line that names the faces.
    """
    apart = drawn_apart(frame.points, [face[0] for face in frame.faces], orders, distance)
    _check_room(frame, apart, distance)
    frame = replace(frame, points=apart)
    triangles = _triangles(frame)
    asks = [ask for order in orders for ask in _asked(frame.points, triangles, order)]
    sides = sorted({side(t[k], t[k - 1]) for each in triangles for t in each for k in range(3)})
    points, wanted = frame.points, np.full(len(asks), distance)
    for _ in range(ROUNDS):
        points = _moved(frame.points, np.array(sides), asks, _normals(frame, triangles), wanted)
        # layers that have become steep are nearer to each other than points above one another
        wanted = np.maximum(wanted, distance / _steepness(points, asks, _normals(frame, triangles)))
    # as triangles, since a corner that has moved may change which diagonal is the shorter one
    faces = [[list(triangle)] for each in triangles for triangle in each]
    own = {
        side(a, b) for face in frame.faces for ring in face for a, b in itertools.pairwise([*ring, ring[0]])
    }
    new = sorted(
        {side(t[k], t[k - 1]) for [t] in faces for k in range(3)} - own - {side(*e) for e in frame.edges}
    )
    return replace(
        frame,
        points=points,
        faces=faces,
        edges=[*frame.edges, *new],
        letters=[*frame.letters, *["F"] * len(new)],
        angles=None if frame.angles is None else [*frame.angles, *[0.0] * len(new)],
    )


def _check_room(frame: Frame, apart: Array, distance: float) -> None:
    """Raises `FileFormatError` where a face is smaller than creases inside one another have to be drawn apart."""
    for number, face in enumerate(frame.faces):
        ring = list(face[0])
        k = np.arange(len(ring)) - 1
        before, after = (points[ring] for points in (frame.points, apart))
        turns = [np.cross(x - x[k], np.roll(x, -1, axis=0) - x) for x in (before, after)]
        if (np.einsum("kc,kc->k", *turns) < 0.0).any():
            raise FileFormatError(
                f"layers {distance:.4g} mm apart do not fit: creases inside one another, drawn apart by so much, turn "
                f"face {number} inside out; give a thinner sheet, or wider faces beside its creases"
            )


def _triangles(frame: Frame) -> list[list[list[int]]]:
    """Of every face."""
    found = []
    for number, face in enumerate(frame.faces):
        try:
            found.append(triangulate(frame.points, face, False))
        except FileFormatError as error:
            raise FileFormatError(f"face {number} {error}") from error
    return found


def _normals(frame: Frame, triangles: Sequence[Sequence[Triangle]]) -> Array:
    """(faces, 3) unit normals."""
    first = frame.points[np.array([each[0] for each in triangles])]
    normals = np.cross(first[:, 1] - first[:, 0], first[:, 2] - first[:, 0])
    return np.asarray(normals / np.linalg.norm(normals, axis=1)[:, None])


def _asked(points: Array, triangles: Sequence[Sequence[Triangle]], order: Order) -> Iterator[Ask]:
    """Where two faces lie over each other, seen along the second one's normal: an upper and a lower point each."""
    upper, lower, sign = order
    a, b, c = points[list(triangles[lower][0])]
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)
    across = np.linalg.svd(normal[None, :])[2][1:]
    flat = points @ across.T
    for one, two in itertools.product(triangles[upper], triangles[lower]):
        for over, under in _over(flat, one, two):
            yield (over, under, upper, lower) if sign > 0 else (under, over, upper, lower)


def _over(flat: Array, one: Triangle, two: Triangle) -> Iterator[tuple[Place, Place]]:
    """Points of two triangles in one place of the plane (n, 2): corners on the other one, and edges that cross."""
    for node in one:
        if node not in two and (place := _within(flat, node, two)):
            yield {node: 1.0}, place
    for node in two:
        if node not in one and (place := _within(flat, node, one)):
            yield place, {node: 1.0}
    for k, m in itertools.product(range(3), range(3)):
        a, b, c, d = one[k], one[k - 1], two[m], two[m - 1]
        if {a, b} & {c, d}:
            continue
        u, v, w = flat[b] - flat[a], flat[d] - flat[c], flat[c] - flat[a]
        turn = u[0] * v[1] - u[1] * v[0]
        if abs(turn) <= ON * float(np.linalg.norm(u) * np.linalg.norm(v)):
            continue
        s, t = (w[0] * v[1] - w[1] * v[0]) / turn, (w[0] * u[1] - w[1] * u[0]) / turn
        if ON < s < 1.0 - ON and ON < t < 1.0 - ON:
            yield {a: 1.0 - s, b: s}, {c: 1.0 - t, d: t}


def _within(flat: Array, node: int, triangle: Triangle) -> Place:
    """A node as a place of a triangle that it lies in or on, else an empty one."""
    a, b, c = flat[list(triangle)]
    try:
        s, t = np.linalg.solve(np.column_stack((b - a, c - a)), flat[node] - a).tolist()
    except np.linalg.LinAlgError:
        return {}
    weights = (1.0 - s - t, s, t)
    return dict(zip(triangle, weights, strict=True)) if min(weights) >= -ON else {}


def _steepness(points: Array, asks: Sequence[Ask], normals: Array) -> Array:
    """(asks,) distance of layers a unit apart along the normals (faces, 3) that they had when they lay flat."""
    found = np.ones(len(asks))
    for row, (over, under, _, lower) in enumerate(asks):
        one, two = points[list(over)], points[list(under)]
        if len(one) == len(two):  # edges that cross
            normal = np.cross(one[1] - one[0], two[1] - two[0])
        else:
            a, b, c = one if len(one) == 3 else two
            normal = np.cross(b - a, c - a)
        size = float(np.linalg.norm(normal))
        found[row] = abs(float(normal @ normals[lower])) / size if size > 0.0 else 1.0
    return np.maximum(found, STEEPEST)


def _moved(points: Array, sides: Ints, asks: Sequence[Ask], normals: Array, wanted: Array) -> Array:
    """Points after the least moves that leave so much room (asks,), mm, along the normals (faces, 3) of lower faces."""
    import scipy.sparse as sp
    from scipy.optimize import linprog

    if not asks:
        return points
    rows, columns, values, short = [], [], [], np.empty(len(asks))
    for row, (over, under, _, lower) in enumerate(asks):
        weights = dict(over)
        for node, weight in under.items():
            weights[node] = weights.get(node, 0.0) - weight
        sign = normals[lower]
        apart = sum(weight * float(points[node] @ sign) for node, weight in weights.items())
        short[row] = wanted[row] - apart
        for node, weight in weights.items():
            rows += [row] * 3
            columns += [3 * node, 3 * node + 1, 3 * node + 2]
            values += (weight * sign).tolist()
    size = points.size
    A = sp.coo_array((values, (rows, columns)), shape=(len(asks), size)).tocsr()
    ends = sp.coo_array(
        (np.tile([1.0, -1.0], len(sides)), (np.repeat(np.arange(len(sides)), 2), sides.ravel())),
        shape=(len(sides), len(points)),
    )
    B = sp.kron(ends, sp.eye_array(3)).tocsr()  # differences of moves along the sides
    free, rough = sp.eye_array(len(asks)), sp.eye_array(3 * len(sides))
    whole = sp.block_array([[-A, A, -free, None], [B, -B, None, -rough], [-B, B, None, -rough]]).tocsr()
    cost = np.concatenate((np.full(2 * size, FEW), np.full(len(asks), DEAR), np.ones(3 * len(sides))))
    bounds = np.concatenate((-short, np.zeros(6 * len(sides))))
    found = linprog(cost, A_ub=whole, b_ub=bounds, method="highs")
    if found.x is None:
        raise FileFormatError(f"the layers cannot be untangled ({found.message})")
    wanting = found.x[2 * size : 2 * size + len(asks)]
    worst = int(np.argmax(wanting))
    if wanting[worst] > LEFT * wanted[worst]:
        _, _, f, g = asks[worst]
        raise FileFormatError(
            f"layers {wanted[worst]:.4g} mm apart do not fit between faces {f} and {g}: faceOrders ask for more "
            "than the creases between them leave; draw nested creases apart, or give a thinner sheet or another order"
        )
    return np.asarray(points + (found.x[:size] - found.x[size : 2 * size]).reshape(-1, 3))
