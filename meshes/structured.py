"""Ruling-aligned meshes of patterns that have rails.

Between two neighbouring rails lie `rows` rows of cells; node lines across the sheet are rulings. How the cells are cut
into triangles decides the accuracy of bars and hinges (docs/decisions.md):

- "staggered": neighbouring node lines are shifted by half a cell, triangles are isosceles;
- "alternating": right triangles, the diagonal turns from cell to cell and is mirrored across every node line;
- "one-way": right triangles, all diagonals alike;
- "mirrored": right triangles, diagonals alike in a panel and mirrored from panel to panel.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import get_args

import numpy as np

from meshes.cells import Kind, RuledCells
from meshes.curves import Array, Curve
from meshes.cuts import cut_along
from meshes.errors import MeshError
from meshes.limits import check_limit
from meshes.mesh import Origin, SheetMesh
from meshes.pattern import CreasePattern, drawn_angles, with_groups
from meshes.tapered import followed, tapered_mesh, tapers
from meshes.topology import Ints, build


def structured(
    pattern: CreasePattern,
    *,
    aspect_ratio: float | None = None,
    along: int | None = None,
    rows: int = 1,
    kind: Kind = "staggered",
) -> SheetMesh:
    """Mesh a pattern with rails.

    Args:
        pattern: with rails, see `CreasePattern.rails`.
        aspect_ratio: alpha = H / W, cell height across over width along the crease; decides `along`.
        along: number of cells along the crease (instead of `aspect_ratio`).
        rows: rows of cells between neighbouring rails.
        kind: how cells are cut, see the module.

    Returns:
        The mesh, with every node line along a rail or between two of them.

    Raises:
        MeshError: no rails, both or none of `aspect_ratio` and `along`, counts below one.
    """
    if not isinstance(pattern, CreasePattern):
        raise MeshError(
            f"a {type(pattern).__name__} cannot be meshed; give a pattern, such as meshes.strip(100, 10)"
        )
    if not pattern.rails:
        raise MeshError("this pattern has no rails to rule between; use an unstructured mesh")
    if kind not in get_args(Kind):
        raise MeshError(f"mesh kind '{kind}' is not known; use one of {', '.join(get_args(Kind))}")
    for name, given in (("rows", rows), ("along", along)):
        if isinstance(given, str):
            raise MeshError(f"{name} = {given!r} cannot be; use a whole number from 1")
    if not 1 <= rows <= 1e5 or int(rows) != rows:
        raise MeshError(f"rows = {rows} cannot be; use a whole number from 1")
    widths, heights = pattern.panel_sizes
    least = 3 if pattern.closed else 1
    if (aspect_ratio is None) == (along is None):
        raise MeshError("give either aspect_ratio or along (the number of cells along the crease)")
    if aspect_ratio is not None:
        if not math.isfinite(aspect_ratio) or aspect_ratio <= 0.0:
            raise MeshError(f"aspect_ratio = {aspect_ratio} cannot be; use a positive number, best 5 to 12")
        along = max(least, round(min(aspect_ratio / float(np.mean(heights / rows / widths)), 1e9)))
    assert along is not None
    check_limit("triangles", 2.0 * along * rows * (len(pattern.rails) - 1), "this mesh", MeshError)
    if along < least or int(along) != along:
        raise MeshError(f"along = {along} cells cannot be; use a whole number from {least}")

    if tapers(pattern):
        return _tapered(pattern, int(along), int(rows), kind, float(np.mean(heights / rows / widths)) * along)
    lines, panels = _node_lines(pattern, int(along), int(rows), staggered=kind == "staggered")
    points = np.vstack([line for line, _ in lines])
    triangles, first = _triangles(lines, panels, int(along), kind, pattern.closed)
    spans = _spans(points, triangles, lines, pattern.closed)
    alpha = float(np.mean((heights / rows) / (widths / along)))
    edge_sets, corners = _named_sets(pattern, lines, first, rows)
    curves: dict[str, Curve] = {f"edge:{name}": curve for name, curve in pattern.edges}
    curves.update({f"crease:{crease.name}": crease.curve for crease in pattern.creases})
    mesh = SheetMesh(
        points=points,
        triangles=triangles,
        edge_sets=with_groups(pattern, edge_sets),
        corners=corners,
        folds=pattern.folds,
        fold_angles=drawn_angles(pattern, edge_sets),
        curves=curves,
        spans=spans,
        kind=kind,
        aspect_ratio=alpha,
        remarks=pattern.remarks,
        origin=Origin.of(pattern, RuledCells(kind, int(along), int(rows)), points, triangles),
    )
    return cut_along(mesh, pattern)


def _tapered(pattern: CreasePattern, along: int, rows: int, kind: Kind, alpha: float) -> SheetMesh:
    """A mesh of panels that taper to points; see `meshes.tapered`."""
    if kind not in ("staggered", "alternating"):
        raise MeshError(f"panels that taper to points have no '{kind}' mesh; use staggered or alternating")
    if along < 4:
        raise MeshError(f"along = {along} columns cannot follow curves to their ends; use at least 4")
    points, triangles, chains = tapered_mesh(pattern, along, rows, staggered=kind == "staggered")
    names = ["edge:inner", *(f"crease:{crease.name}" for crease in pattern.creases), "edge:outer"]
    pairs = [list(pairwise(chain)) for chain in chains]
    sets = {names[0]: np.array(pairs[0]), names[-1]: np.array(pairs[-1])}
    for k in range(1, len(chains) - 1):  # a crease ends where it runs into another line
        own = [pair for pair in pairs[k] if pair not in pairs[k - 1] and pair not in pairs[k + 1]]
        if not own:
            raise MeshError(
                f"{names[k]} is closer to its neighbours than cells are long; use more than {along} along"
            )
        sets[names[k]] = np.array(own)
    curves: dict[str, Curve] = {f"edge:{name}": curve for name, curve in pattern.edges}
    curves.update({f"crease:{crease.name}": crease.curve for crease in pattern.creases})
    for name, edges in sets.items():
        curves[name] = followed(curves[name], points[[edges[0, 0], *edges[:, 1]]])
    start, end = chains[-1][0], chains[-1][-1]
    mesh = SheetMesh(
        points=points,
        triangles=triangles,
        edge_sets=sets,
        corners={"corner:inner-start": start, "corner:inner-end": end},
        folds=pattern.folds,
        curves=curves,
        kind=kind,
        aspect_ratio=alpha,
        origin=Origin.of(pattern, RuledCells(kind, along, rows), points, triangles),
    )
    return cut_along(mesh, pattern)


Lines = list[tuple[Array, Array]]  # of each node line: points (k, 2) and parameters (k,)


def _node_lines(pattern: CreasePattern, along: int, rows: int, *, staggered: bool) -> tuple[Lines, list[int]]:
    """Node lines from the inner to the outer edge, and the panel that each row of cells belongs to."""
    lines: Lines = []
    panels: list[int] = []
    rails = pattern.rails
    whole = np.arange(along + 1) / along
    half = np.concatenate(([0.0], (np.arange(along) + 0.5) / along, [1.0]))
    if pattern.closed:
        whole, half = whole[:-1], half[1:-1]
    count = (len(rails) - 1) * rows
    # the middle line of the sheet (the crease of a single-crease sheet) gets the whole cells
    middle = (count // 2) % 2
    for index in range(count + 1):
        panel, row = min(index // rows, len(rails) - 2), index % rows
        u = half if staggered and index % 2 != middle else whole
        across = row / rows if index < count else 1.0
        lines.append(((1.0 - across) * rails[panel].point(u) + across * rails[panel + 1].point(u), u))
        if index < count:
            panels.append(index // rows)
    return lines, panels


def _triangles(
    lines: Lines, panels: list[int], along: int, kind: Kind, closed: bool
) -> tuple[Ints, list[int]]:
    """Triangles between the node lines, and the first node of each line."""
    first: list[int] = np.concatenate(([0], np.cumsum([len(u) for _, u in lines]))).astype(int).tolist()
    triangles: list[tuple[int, int, int]] = []
    for row, panel in enumerate(panels):
        (_, below), (_, above) = lines[row], lines[row + 1]

        def node(line: int, i: int) -> int:
            return first[line] + i % len(lines[line][1])

        if kind == "staggered":
            triangles += _zip(below, above, row, node, closed)
            continue
        for i in range(along):
            a, b = node(row, i), node(row, i + 1)
            c, d = node(row + 1, i + 1), node(row + 1, i)
            turned = {"alternating": (i + row) % 2, "one-way": 0, "mirrored": panel % 2}[kind]
            triangles += [(a, b, d), (b, c, d)] if turned else [(a, b, c), (a, c, d)]
    array = np.asarray(triangles, dtype=np.int64)
    points = np.vstack([line for line, _ in lines])
    p, q, r = (points[array[:, k]] for k in range(3))
    turn = (q - p)[:, 0] * (r - p)[:, 1] - (q - p)[:, 1] * (r - p)[:, 0]
    if (turn <= 0.0).any() and (turn >= 0.0).any():
        raise MeshError(
            f"cells are so long that chords of neighbouring curves cross; use more than {along} along"
        )
    # arcs that run counter-clockwise have their inner rail on the left: all triangles then come out turned
    array[turn < 0.0] = array[turn < 0.0][:, ::-1]
    return array, first[:-1]


def _zip(
    below: Array, above: Array, row: int, node: Callable[[int, int], int], closed: bool
) -> list[tuple[int, int, int]]:
    """Join two node lines whose parameters interleave, always advancing the line that lags behind."""
    n, m = len(below), len(above)
    low = np.append(below, below[0] + 1.0) if closed else below
    high = np.append(above, above[0] + 1.0) if closed else above
    cells_low, cells_high = len(low) - 1, len(high) - 1
    triangles = []
    i = j = 0
    while i < cells_low or j < cells_high:
        # advance the side whose next edge has the smaller midpoint; ties cannot occur for shifted lines
        advance_low = j == cells_high or (i < cells_low and low[i] + low[i + 1] < high[j] + high[j + 1])
        if advance_low:
            triangles.append((node(row, i), node(row, (i + 1) % n if closed else i + 1), node(row + 1, j)))
            i += 1
        else:
            triangles.append(
                (node(row, i), node(row + 1, (j + 1) % m if closed else j + 1), node(row + 1, j))
            )
            j += 1
    return triangles


def _spans(points: Array, triangles: Ints, lines: Lines, closed: bool) -> Array:
    """(e, 2) extents of every edge along and across the rails, mm."""
    edges = build(triangles, len(points)).edges
    line_of = np.repeat(np.arange(len(lines)), [len(u) for _, u in lines])
    u = np.concatenate([u for _, u in lines])
    du = np.abs(u[edges[:, 0]] - u[edges[:, 1]])
    if closed:
        du = np.minimum(du, 1.0 - du)
    length = np.array([_polyline_length(line, closed) for line, _ in lines])[line_of]
    along = du * 0.5 * (length[edges[:, 0]] + length[edges[:, 1]])
    chord = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    same = line_of[edges[:, 0]] == line_of[edges[:, 1]]
    across = np.sqrt(np.maximum(chord**2 - along**2, 0.0))
    return np.column_stack((np.where(same, chord, along), np.where(same, 0.0, across)))


def _polyline_length(line: Array, closed: bool) -> float:
    path = np.vstack((line, line[:1])) if closed else line
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def _named_sets(
    pattern: CreasePattern, lines: Lines, first: list[int], rows: int
) -> tuple[dict[str, Ints], dict[str, int]]:
    def chain(line: int) -> Ints:
        ids = first[line] + np.arange(len(lines[line][1]))
        if pattern.closed:
            ids = np.append(ids, ids[0])
        return np.column_stack((ids[:-1], ids[1:]))

    last = len(lines) - 1
    sets = {"edge:inner": chain(0), "edge:outer": chain(last)}
    corners: dict[str, int] = {}
    if not pattern.closed:
        start = np.array(first)
        end = start + np.array([len(u) for _, u in lines]) - 1
        sets["edge:start"] = np.column_stack((start[:-1], start[1:]))
        sets["edge:end"] = np.column_stack((end[:-1], end[1:]))
        corners = {
            "corner:inner-start": int(start[0]),
            "corner:outer-start": int(start[-1]),
            "corner:inner-end": int(end[0]),
            "corner:outer-end": int(end[-1]),
        }
    for index, crease in enumerate(pattern.creases):
        sets[f"crease:{crease.name}"] = chain((index + 1) * rows)
    return sets, corners
