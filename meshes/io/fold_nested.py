"""Creases of a folded form that lie on each other, one inside the other, drawn apart in their plane.

A sheet that is folded twice across has creases between the panels of another crease: all of them lie on one line, where
the outer panels leave no room for what lies between them. What is nested in a crease is moved into its panels, by
several layers' distance for every crease round it, so that the outer panels have a wedge to stand in. Where creases of
a line begin in one corner, such as that of four panels of a map, they are turned about it, the outer ones outwards by
as much: angles round the corner still sum to a full turn and creases stay straight, so that the sheet can lie flat.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshes.io.fold_frame import Side, side

Array = NDArray[np.float64]
Order = tuple[int, int, int]
WEDGE = 6.0  # distances of layers that a crease is moved inwards by, for each that is round it: panels rise by 1 in 6
ON = 1e-6  # of an edge; a point so near lies on it
SAME = 1.0 - 1e-6  # cosine between directions that are one


@dataclass(frozen=True, eq=False)
class _Shut:
    """An edge whose two faces are folded onto each other, and the direction into both."""

    ends: Side
    faces: tuple[int, int]
    inwards: Array


def drawn_apart(
    points: Array, rings: Sequence[Sequence[int]], orders: Sequence[Order], distance: float
) -> Array:
    """Points of a folded form with its nested creases moved into the panels of those round them.

    Args:
        points: (n, 3) mm.
        rings: the corners of every face, in order.
        orders: (f, g, s): face f lies on the side of g that its normal points to (s = 1), or on the other (-1).
        distance: between layers, mm.

    Returns:
        (n, 3) mm; the points themselves where nothing is nested.
    """
    normals = np.array([_normal(points[list(ring)]) for ring in rings])
    towards: dict[Side, Array] = {}  # from the second face to the first
    for f, g, s in orders:
        towards[f, g], towards[g, f] = s * normals[g], -s * normals[g]
    shut = _shut(points, rings)
    nested = _nested(points, rings, towards, shut)
    moved = points.copy()
    for line in _lines(
        points, [edge for edge in shut if any(edge is one for each in nested.values() for one in each)]
    ):
        for node, part in _moves(
            points, [edge for edge in shut if _on_line(points, edge, line)], nested
        ).items():
            moved[node] += WEDGE * distance * part * line.inwards
    return moved


def _lines(points: Array, edges: Sequence[_Shut]) -> list[_Shut]:
    """One edge of every line that some lie on, with one direction inwards."""
    found: list[_Shut] = []
    for edge in edges:
        if not any(_on_line(points, edge, line) for line in found):
            found.append(edge)
    return found


def _on_line(points: Array, edge: _Shut, line: _Shut) -> bool:
    """Whether an edge lies on the line of another one, and its faces on the same side."""
    if float(edge.inwards @ line.inwards) <= SAME:
        return False
    first, last = points[list(line.ends)]
    along = (last - first) / float(np.linalg.norm(last - first))
    off = points[list(edge.ends)] - first
    off = off - (off @ along)[:, None] * along
    return bool(np.abs(off).max() <= ON * float(np.linalg.norm(last - first)))


def _moves(points: Array, edges: Sequence[_Shut], nested: dict[int, list[_Shut]]) -> dict[int, float]:
    """How far nodes of the shut edges on one line go inwards, in parts of what one crease asks for."""
    first, last = points[list(edges[0].ends)]
    along = (last - first) / float(np.linalg.norm(last - first))
    inwards = edges[0].inwards
    inside = [node for node, within in nested.items() if any(edge is one for edge in edges for one in within)]
    ends = [node for edge in edges for node in edge.ends]
    depth = {node: _depth(node, inwards, nested, 0) for node in (*ends, *inside)}
    at = {node: float((points[node] - first) @ along) for node in depth}
    corners = {
        here for e in edges for here, there in (e.ends, e.ends[::-1]) if depth[here] == 0 and depth[there] > 0
    }
    if not corners:
        return {node: float(deep) for node, deep in depth.items() if deep}
    found = {}
    for node in set(depth) - corners:
        corner = min(corners, key=lambda each: abs(at[each] - at[node]))
        far = at[node] - at[corner]
        others = {
            n
            for e in edges
            for n in e.ends
            if corner in e.ends and n != corner and (at[n] - at[corner]) * far > 0
        }
        if others:
            mean = sum(depth[n] for n in others) / len(others)
            found[node] = (depth[node] - mean) * abs(far) / min(abs(at[n] - at[corner]) for n in others)
    return found


def _normal(corners: Array) -> Array:
    """Unit normal of a ring of corners (k, 3) by its area (Newell)."""
    normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    size = float(np.linalg.norm(normal))
    return np.asarray(normal / size if size > 0.0 else normal)


def _shut(points: Array, rings: Sequence[Sequence[int]]) -> list[_Shut]:
    """Edges between two faces that lie on one side of them."""
    at: dict[Side, list[int]] = {}
    for number, ring in enumerate(rings):
        for k, node in enumerate(ring):
            at.setdefault(side(node, ring[k - 1]), []).append(number)
    found = []
    for ends, faces in at.items():
        if len(faces) == 2:
            one, two = (_inwards(points, ends, rings[face]) for face in faces)
            if float(one @ two) > SAME:
                found.append(_Shut(ends, (faces[0], faces[1]), one))
    return found


def _inwards(points: Array, ends: Side, ring: Sequence[int]) -> Array:
    """Unit direction from an edge of a face into it, square to the edge."""
    first, last = points[list(ends)]
    along = (last - first) / max(float(np.linalg.norm(last - first)), 1e-300)
    into = points[list(ring)].mean(axis=0) - first
    into = into - float(into @ along) * along
    return np.asarray(into / max(float(np.linalg.norm(into)), 1e-300))


def _nested(
    points: Array, rings: Sequence[Sequence[int]], towards: dict[Side, Array], shut: Sequence[_Shut]
) -> dict[int, list[_Shut]]:
    """Nodes that lie on shut edges, of faces between the two of the edge, and these edges."""
    faces_of: dict[int, list[int]] = {}
    for number, ring in enumerate(rings):
        for node in ring:
            faces_of.setdefault(node, []).append(number)
    found: dict[int, list[_Shut]] = {}
    for edge in shut:
        f, g = edge.faces
        own = {*rings[f], *rings[g]}
        for node in _nodes_on(points, edge.ends):
            if node in own or node not in faces_of:
                continue
            between = (
                float(towards[h, f] @ towards[h, g]) < 0.0
                for h in faces_of[node]
                if (h, f) in towards and (h, g) in towards
            )
            if any(between):
                found.setdefault(node, []).append(edge)
    return found


def _nodes_on(points: Array, ends: Side) -> list[int]:
    """All points on an edge, its ends among them."""
    first, last = points[list(ends)]
    along = last - first
    size = float(along @ along)
    if size == 0.0:
        return []
    part = np.clip((points - first) @ along / size, 0.0, 1.0)
    off = np.linalg.norm(points - first - part[:, None] * along, axis=1)
    return [int(node) for node in np.flatnonzero(off <= ON * np.sqrt(size))]


def _depth(node: int, inwards: Array, nested: dict[int, list[_Shut]], passed: int) -> int:
    """How many shut edges a node lies in, one inside the other, that are moved along a direction."""
    within = [each for each in nested.get(node, []) if float(each.inwards @ inwards) > SAME]
    if not within or passed > len(nested):  # orders that run in a ring have no end
        return 0
    return 1 + max(_depth(end, inwards, nested, passed + 1) for each in within for end in each.ends)
