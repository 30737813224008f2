"""Structured meshes of panels that taper to points: creases end on the inner edge, alone or together in its corners.

Node lines follow the rails. All nodes have their x from one set of columns, graded so that cells keep their shape
towards the corners as far as `FINEST` allows. A panel is the region between two chains of nodes with common ends:
below, the rail under it and what of the straight edge lies beside that; above, its own rail. A row of cells that gets
too low for its width ends earlier; the row below takes its place. So do curves that come too close (an ellipse and its
affine image touch in the corner): they are one from there on, and a crease ends where it joins another. Chains are
joined by the triangles of the best angles.

Angles below 10 degrees remain where the pattern itself has them, between curves that meet in a point, and a few where
rows end.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from meshes.curves import Array, Curve, Polyline
from meshes.errors import MeshError
from meshes.pattern import CreasePattern
from meshes.topology import Ints

FINEST = 0.5  # of the widest cell's width
LOWEST = 0.45  # height of a row over the width of its cells, below which it ends
THINNEST = 0.04  # the same of a whole panel, below which the curves on its sides are taken as one
CLOSEST = 0.45  # of the width of a cell, from a column to the end of a rail
ON = 1e-9  # of the sheet's width: nodes farther from a rail do not lie on it
Chain = list[int]


def tapers(pattern: CreasePattern) -> bool:
    """True if the last rail begins and ends on the first one, so that panels come to points."""
    if len(pattern.rails) < 2 or pattern.closed:
        return False
    ends = np.array([0.0, 1.0])
    a, b = pattern.rails[0].point(ends), pattern.rails[-1].point(ends)
    return bool(np.linalg.norm(a - b, axis=1).max() <= 1e-9 * max(pattern.rails[0].length, 1e-300))


def tapered_mesh(
    pattern: CreasePattern, along: int, rows: int, *, staggered: bool
) -> tuple[Array, Ints, list[Chain]]:
    """Nodes and triangles of panels that come to points.

    Args:
        pattern: one that `tapers`.
        along: columns of cells over the whole width.
        rows: of cells in every panel where it is high enough.
        staggered: neighbouring lines are shifted by half a cell; otherwise nodes of all lines lie on common
            columns.

    Returns:
        Points (n, 2) in mm, triangles (t, 3), and the chain of nodes of every rail.

    Raises:
        MeshError: rails that end inside one another or turn back, or that are too close for their chords.
    """
    rails = [_Graph(rail) for rail in pattern.rails]
    ends = [rail.reach for rail in rails]
    if any(b < a for a, b in pairwise(ends[1:])):
        raise MeshError("rails that end inside one another cannot be meshed in rows; use a gmsh mesh")
    whole, half = _columns(rails, along)
    nodes = _Nodes()
    chains = [_bottom(nodes, rails, whole)]
    triangles: list[tuple[int, int, int]] = []
    line = 0
    for lower, upper in pairwise(rails):
        chain = _around(nodes, chains, upper)
        for row in range(1, rows + 1):
            line += 1
            shifted = staggered and line % 2 == 1
            columns = half if shifted else whole
            least = THINNEST if row == rows else LOWEST * rows
            following = _line(nodes, chain, lower, upper, columns, whole, row / rows, least)
            triangles += _join(nodes.array, chain, following)
            chain = following
        chains.append(chain)
    return nodes.array, np.array(triangles, dtype=np.int64), chains


def followed(rail: Curve, nodes: Array) -> Curve:
    """The curve that a line of edges lies on: the rail, but for where it is one with another rail.

    Where two rails are closer than cells can tell (`THINNEST`), nodes lie on one of them or between them. From such a
    node to its neighbours the curve is straight, so that every node is on its curve and middles of edges are, too.

    Args:
        rail: that the nodes were laid along.
        nodes: (k, 2) of the line in order, mm.

    Returns:
        the rail itself where all nodes lie on it.
    """
    graph = _Graph(rail)
    on = np.abs(nodes[:, 1] - graph(nodes[:, 0])) <= ON * graph.reach
    if on.all():
        return rail
    pieces = [nodes[:1]]
    for i in range(len(nodes) - 1):
        if on[i] and on[i + 1]:
            x = graph.points[:, 0]
            pieces.append(graph.points[(x > nodes[i, 0]) & (x < nodes[i + 1, 0])])
        pieces.append(nodes[i + 1 : i + 2])
    return Polyline(np.concatenate(pieces))


class _Graph:
    """A rail as y(x), zero beyond its ends at -reach and reach (or wherever it begins and ends)."""

    def __init__(self, rail: Curve) -> None:
        vertices = getattr(rail, "vertices", None)
        self.points: Array = rail.point(np.array([0.0, 1.0])) if vertices is None else np.asarray(vertices)
        if not (np.diff(self.points[:, 0]) > 0.0).all():
            raise MeshError("rails that taper must run from left to right; redraw them or use a gmsh mesh")
        self.left, self.right = float(self.points[0, 0]), float(self.points[-1, 0])
        self.reach = self.right - self.left

    def __call__(self, x: Array) -> Array:
        return np.interp(x, self.points[:, 0], self.points[:, 1], left=0.0, right=0.0)


class _Nodes:
    """Points as they are made, one for each place."""

    def __init__(self) -> None:
        self._index: dict[tuple[float, float], int] = {}

    def at(self, x: Array, y: Array) -> Chain:
        return [
            self._index.setdefault((float(a), float(b)), len(self._index)) for a, b in zip(x, y, strict=True)
        ]

    @property
    def array(self) -> Array:
        return np.array(list(self._index)).reshape(-1, 2)


def _columns(rails: list[_Graph], along: int) -> tuple[Array, Array]:
    """The x of the columns, and of those between them, from one end of the first rail to the other."""
    first, last = rails[0], rails[-1]
    turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 4001)
    x = 0.5 * (first.left + first.right) + 0.5 * first.reach * np.sin(turn)
    middle = 0.5 * (x[1:] + x[:-1])
    step = np.diff(x)
    # mean length along the curves and mean height across the panels of a column
    curves = rails[1:]
    there = np.array([(middle > rail.left) & (middle < rail.right) for rail in curves])
    rise = np.array([np.diff(rail(x)) for rail in curves])
    arc = np.where(there, np.hypot(step, rise), 0.0).sum(axis=0) / np.maximum(there.sum(axis=0), 1)
    height = last(middle) / np.maximum(there.sum(axis=0), 1) * step / arc
    width = np.maximum(height, FINEST * height.max())
    place = np.concatenate(([0.0], np.cumsum(arc / width)))
    place = (
        0.5 * (place + place[-1] - place[::-1]) / place[-1]
    )  # symmetric to rounding, and so are the columns

    def at(u: Array) -> Array:
        found = np.interp(u, place, x)
        return 0.5 * (found - found[::-1]) + 0.5 * (first.left + first.right)

    whole = at(np.arange(along + 1) / along)
    whole[[0, -1]] = first.left, first.right
    # beside a corner all lines have the same column: curves that touch there would cross between others
    half = at(
        np.unique(np.concatenate(([0.0, 1.0], np.arange(1, along - 1) + 0.5, [along - 1.0, along]))) / along
    )
    half[[0, -1]] = first.left, first.right
    return whole, half


def _thinned(columns: Array, fixed: Array, whole: Array) -> Array:
    """Columns and fixed places in order; columns too close to a fixed place are left out."""
    near = CLOSEST * np.interp(columns, whole[1:-1], np.minimum(np.diff(whole)[1:], np.diff(whole)[:-1]))
    apart = np.abs(columns[:, None] - fixed[None, :]).min(axis=1)
    return np.sort(np.concatenate((columns[apart > near], fixed)))


def _bottom(nodes: _Nodes, rails: list[_Graph], whole: Array) -> Chain:
    fixed = np.unique([end for rail in rails for end in (rail.left, rail.right)])
    # columns crowd where the curves are steep, the straight edge does not
    least, middle = CLOSEST * np.diff(whole).max(), 0.5 * (whole[0] + whole[-1])
    kept = [float(whole[0])]
    for place in whole[: len(whole) // 2].tolist():
        if place - kept[-1] >= least and middle - place >= 0.5 * least:
            kept.append(place)
    if len(whole) % 2:
        kept.append(middle)
    x = np.unique([*kept, *(2.0 * middle - place for place in kept)])
    apart = np.abs(x[:, None] - fixed).min(axis=1)
    x = np.union1d(x[apart >= 0.5 * least], fixed)
    return nodes.at(x, np.zeros_like(x))


def _around(nodes: _Nodes, chains: list[Chain], upper: _Graph) -> Chain:
    """The chain under a panel: the rail below it, and the straight edge from its ends to those of the rail above."""
    below, bottom = chains[-1], chains[0]
    x = nodes.array[bottom, 0]
    first, last = (int(np.abs(x - end).argmin()) for end in (upper.left, upper.right))
    if len(chains) == 1:
        return bottom[first : last + 1]
    return bottom[first : bottom.index(below[0])] + below + bottom[bottom.index(below[-1]) + 1 : last + 1]


def _line(
    nodes: _Nodes,
    chain: Chain,
    lower: _Graph,
    upper: _Graph,
    columns: Array,
    whole: Array,
    part: float,
    least: float,
) -> Chain:
    """The line in `part` of the height of a panel, which leaves `chain`, the one below it, where it is high enough.

    `least` is the smallest height of the panel there, across the rails, over the width of a cell along them.
    """
    inside = (columns > upper.left) & (columns < upper.right)
    x = _thinned(columns[inside], np.array([upper.left, upper.right]), whole)[1:-1]
    low, high = lower(x), upper(x)
    size = np.interp(x, whole, np.gradient(whole))
    near = np.array([x - 0.5 * size, x + 0.5 * size])
    middle = 0.5 * (lower(near) + upper(near))
    stretch = np.hypot(size, middle[1] - middle[0]) / size  # of lengths along the rails against x
    kept = (high - low) / stretch > least * size * stretch
    if part == 1.0:  # on the straight edge no curve runs beside it
        kept |= (x <= lower.left) | (x >= lower.right) | (low <= 0.0)
    if kept.sum() < 2:
        return chain
    first, last = int(np.argmax(kept)), len(kept) - int(np.argmax(kept[::-1]))
    if part == 1.0 and nodes.array[chain[1], 1] == 0.0:
        first = 0  # some of the straight edge is left beside the rail below: nothing to join
    if part == 1.0 and nodes.array[chain[-2], 1] == 0.0:
        last = len(kept)
    x = x[first:last]
    inner = nodes.at(x, (1.0 - part) * low[first:last] + part * high[first:last])
    below = nodes.array[chain, 0]
    if part == 1.0:  # from its own ends, or where it begins to be apart from the rail below
        a = 0 if first == 0 else int(np.searchsorted(below, x[0], side="left")) - 1
        b = len(below) - 1 if last == len(kept) else int(np.searchsorted(below, x[-1], side="right"))
    else:
        a = max(int(np.searchsorted(below, x[0], side="right")) - 1, 0)
        b = min(int(np.searchsorted(below, x[-1], side="left")), len(below) - 1)
    return chain[: a + 1] + inner + chain[b:]


def _join(points: Array, below: Chain, above: Chain) -> list[tuple[int, int, int]]:
    """Triangles between two chains with common ends: of all that join them those of the least squared cotangents.

    Dynamic programming over the rungs (i, j) from below[i] to above[j].
    """
    head = 0
    while head + 1 < min(len(below), len(above)) and below[head + 1] == above[head + 1]:
        head += 1
    tail = 0
    while tail + 1 < min(len(below), len(above)) - head and below[-tail - 2] == above[-tail - 2]:
        tail += 1
    a = below[head : len(below) - tail]
    b = above[head : len(above) - tail]
    if len(a) < 2 or len(b) < 2 or a == b:
        return []
    n, m = len(a), len(b)
    p, q = points[a], points[b]
    low = _badness(
        p[:-1, None], p[1:, None], q[None, :]
    )  # (n - 1, m): edge i of the chain below, node j above
    high = _badness(p[:, None], q[None, 1:], q[None, :-1])  # (n, m - 1)
    low[0, 0] = low[-1, -1] = high[0, 0] = high[-1, -1] = 0.0  # at common ends there is no triangle
    best = np.full((n, m), np.inf)
    best[0, 0] = 0.0
    for i in range(n):
        for j in range(m):
            if i:
                best[i, j] = min(best[i, j], best[i - 1, j] + low[i - 1, j])
            if j:
                best[i, j] = min(best[i, j], best[i, j - 1] + high[i, j - 1])
    if not np.isfinite(best[-1, -1]):
        raise MeshError("two rails are too close for their chords; use more cells along")
    found = []
    i, j = n - 1, m - 1
    while i or j:
        if i and best[i, j] == best[i - 1, j] + low[i - 1, j]:
            found.append((a[i - 1], a[i], b[j]))
            i -= 1
        else:
            found.append((a[i], b[j], b[j - 1]))
            j -= 1
    return [corners for corners in found if len(set(corners)) == 3]


def _badness(a: Array, b: Array, c: Array) -> Array:
    """Sum of squared cotangents of triangles, infinite for those that run clockwise or have no area."""
    u, v, w = b - a, c - b, a - c
    area = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    sides = [np.sum(e * e, axis=-1) for e in np.broadcast_arrays(u, v, w)]
    with np.errstate(divide="ignore", invalid="ignore"):
        total = sum(((sides[k] + sides[k - 1] - sides[k - 2]) / (2.0 * area)) ** 2 for k in range(3))
    return np.where(area > 0.0, total, np.inf)


def smallest_angles(points: Array, triangles: Ints) -> Array:
    """(t,) smallest angle of every triangle (t, 3), rad; points (n, 2 or 3) in any unit.

    Args:
        points: (n, 2) or (n, 3), in any unit.
        triangles: (t, 3) node indices.
    """
    corner = points[triangles]
    angles = []
    for k in range(3):
        u, v = corner[:, (k + 1) % 3] - corner[:, k], corner[:, (k + 2) % 3] - corner[:, k]
        cosine = np.sum(u * v, axis=1) / (np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1))
        angles.append(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return np.asarray(np.min(angles, axis=0))
