"""Cuts that open: slits, kirigami and pop-ups. Nodes along a cut are doubled, so that its two lips move apart.

Nothing keeps the lips of a cut from passing through each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from meshes.curves import Array, sample
from meshes.errors import MeshError
from meshes.fans import Opened, take_apart
from meshes.mesh import Origin, SheetMesh, count
from meshes.pattern import CreasePattern, with_groups
from meshes.topology import Ints, Topology

CUTS = "edge:cuts"  # all cuts of a sheet
BULGE = 0.02  # an arc may be longer than its chord by so much of it


def open_cuts(mesh: SheetMesh, sets: Sequence[str]) -> SheetMesh:
    """The mesh with cuts along some of its edge sets.

    The sets then name both lips: along the left side as they run, then along the right. Every other place keeps its
    name; nodes are numbered as before, copies come last.

    Args:
        mesh: as it is before it is cut; edges on its rim are open already.
        sets: names of the edge sets, such as "edge:cut-1".

    Raises:
        MeshError: there is no such edge set.
    """
    for name in sets:
        if name not in mesh.edge_sets:
            names = ", ".join(mesh.edge_sets) or "none"
            raise MeshError(f"the mesh has no edge set '{name}' to cut along; its edge sets: {names}")
    if not sets:
        return mesh
    opened = take_apart(mesh.points, mesh.triangles, np.vstack([mesh.edge_sets[name] for name in sets]))
    found = {name: opened.pairs(pairs) for name, pairs in mesh.edge_sets.items()}
    kept = {name: angles[opened.left(mesh.crease_edges(name))] for name, angles in mesh.fold_angles.items()}
    here = {name for name, pairs in found.items() if len(pairs)}
    corners = {name: opened.number[node] for name, node in mesh.corners.items()}
    origin = mesh.origin
    if origin is not None:
        origin = Origin.of(origin.pattern, origin.cells, opened.points, opened.triangles)
    return replace(
        mesh,
        points=opened.points,
        triangles=opened.triangles,
        edge_sets={name: pairs for name, pairs in found.items() if name in here},
        corners={name: node for name, node in corners.items() if node >= 0},
        folds={name: fold for name, fold in mesh.folds.items() if f"crease:{name}" in here},
        fold_angles={name: angles for name, angles in kept.items() if f"crease:{name}" in here},
        curves={name: curve for name, curve in mesh.curves.items() if name in here},
        spans=None if mesh.spans is None else mesh.spans[opened.edges_before(mesh.topology)],
        remarks=mesh.remarks + _fallen(opened),
        origin=origin,
    )


def cut_along(mesh: SheetMesh, pattern: CreasePattern) -> SheetMesh:
    """A mesh of a pattern with the cuts of that pattern open, where these run along its edges.

    Args:
        mesh: flat, of the pattern without its cuts.
        pattern: with cuts.

    Raises:
        MeshError: a cut does not run along edges, or is a single edge inside the sheet.
    """
    if not pattern.cuts:
        return mesh
    xy, topology = mesh.points[:, :2], mesh.topology
    sets = {
        f"edge:{name}": along_edges(xy, topology, sample(curve), f"cut '{name}'")
        for name, curve in pattern.cuts
    }
    curves = dict(mesh.curves) | {f"edge:{name}": curve for name, curve in pattern.cuts}
    named = replace(mesh, edge_sets=with_groups(pattern, dict(mesh.edge_sets) | sets), curves=curves)
    return open_cuts(named, list(sets))


def _fallen(opened: Opened) -> tuple[str, ...]:
    """One line on pieces that fell out of closed cuts, or nothing."""
    if not opened.fallen:
        return ()
    what = count(len(opened.fallen), "piece")
    return (f"{what} within closed cuts ({sum(opened.fallen):.4g} mm^2) fell out, leaving holes",)


def along_edges(points: Array, topology: Topology, line: Array, what: str) -> Ints:
    """The edges of a mesh along a line.

    Args:
        points: (n, 2) nodes, mm.
        topology: of the mesh.
        line: (k, 2) points of the line, mm.
        what: the line in words, for messages.

    Returns:
        (m, 2) node pairs, in the order and direction of the line.

    Raises:
        MeshError: the line does not run along edges from end to end.
    """
    import shapely

    curve = shapely.LineString(line)
    near = 1e-5 * max(float(np.ptp(points, axis=0).max()), curve.length)
    on = shapely.dwithin(shapely.points(points), curve, near)
    ends = topology.edges[on[topology.edges].all(axis=1)]
    start, stop = (shapely.line_locate_point(curve, shapely.points(points[ends[:, k]])) for k in range(2))
    turned = start > stop
    if curve.is_ring:  # the edge over the seam goes on from the end to the beginning
        turned ^= np.abs(stop - start) > 0.5 * curve.length
        stop = np.where((start > stop) & ~turned, stop + curve.length, stop)
        start = np.where(
            (start < stop) & turned & (stop - start > 0.5 * curve.length), start + curve.length, start
        )
    ends = np.where(turned[:, None], ends[:, ::-1], ends)
    low, high = np.minimum(start, stop), np.maximum(start, stop)
    # chords across a bend have both ends on the line, too
    chord = np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1)
    order = np.argsort(low)[(np.abs(high - low - chord) <= BULGE * chord)[np.argsort(low)]]
    low, high = low[order], high[order]
    whole = len(order) > 0 and abs(high[-1] - low[0] - curve.length) <= 4.0 * near
    if not whole or (np.abs(low[1:] - high[:-1]) > 4.0 * near).any():
        raise MeshError(
            f"{what} does not run along the edges of this mesh; mesh it by gmsh, or with other cells"
        )
    return np.asarray(ends[order])
