"""Rulings of a solved state: straight lines of the flat sheet along which it does not bend."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, diags_array

from bh.errors import ModelError
from bh.formulations.state import State

Array = NDArray[np.float64]
SMOOTH = 3  # rounds of averaging over neighbours
BENT = 0.1  # of the curvature that one triangle in ten exceeds: flatter ones have no direction
PARALLEL = 0.94  # cosine to the directions that a ruling passes
APART = 0.45  # of the spacing, least distance of two rulings


def curvature(state: State) -> Array:
    """(t, 2, 2) curvature of each triangle in the flat sheet's axes, 1 / mm, averaged within its panel.

    A hinge of length L and angle theta bends its surroundings by L theta mu (x) mu, mu its normal in the sheet; half of
    it belongs to either triangle. Creases do not count.

    Raises:
        ModelError: the stress-free sheet is not flat.
    """
    mesh, topology = state.mesh, state.mesh.topology
    if not mesh.flat:
        raise ModelError("rulings are looked for in a flat sheet; this one is not flat")
    theta = np.zeros(len(topology.edges))
    theta[topology.hinge_edges] = np.pi - state.dihedral_angles
    joined = topology.edge_triangles[:, 1] >= 0
    for crease in mesh.creases:
        joined[topology.find_edges(mesh.crease_edges(crease))] = False
    theta[~joined] = 0.0
    along = mesh.points[topology.edges[:, 1], :2] - mesh.points[topology.edges[:, 0], :2]
    length = np.linalg.norm(along, axis=1)
    across = np.column_stack((-along[:, 1], along[:, 0])) / length[:, None]
    share = 0.5 * (theta * length)[:, None, None] * across[:, :, None] * across[:, None, :]
    bent = share[topology.triangle_edges].sum(axis=1)
    one, two = topology.edge_triangles[joined].T
    count = len(mesh.triangles)
    near = coo_array((np.ones(len(one)), (one, two)), shape=(count, count))
    near = (near + near.T + diags_array(np.ones(count))).tocsr()
    area = mesh.areas
    for _ in range(SMOOTH):
        bent, area = (near @ bent.reshape(count, 4)).reshape(count, 2, 2), near @ area
    return np.asarray(bent / area[:, None, None])


def rulings(state: State, spacing: float) -> list[Array]:
    """Rulings (2, 2) of a state, mm in the flat sheet, from crease or edge to crease or edge, about `spacing` apart.

    From the triangle that bends most on, a ruling goes through its centroid in the direction of least curvature, if the
    sheet bends about that direction all along it, and it keeps away from those that are there.

    Raises:
        ModelError: the stress-free sheet is not flat, or a spacing that cannot be.
    """
    import shapely

    if not (np.isfinite(spacing) and spacing > 0.0):
        raise ModelError(f"spacing = {spacing} cannot be; give a positive length in mm")
    mesh = state.mesh
    bent = curvature(state)
    values, vectors = np.linalg.eigh(bent)
    least = np.abs(values).argmin(axis=1)
    direction = np.take_along_axis(vectors, least[:, None, None], axis=2)[:, :, 0]
    strength = np.abs(values).max(axis=1)
    centres = mesh.points[mesh.triangles][:, :, :2].mean(axis=1)
    walls = [mesh.topology.boundary, *(mesh.crease_edges(crease) for crease in mesh.creases)]
    lines = shapely.linestrings(mesh.points[np.unique(np.sort(np.vstack(walls), axis=1), axis=0)][:, :, :2])
    wall = shapely.union_all(lines)
    panels = shapely.get_parts(shapely.polygonize(shapely.get_parts(shapely.line_merge(wall))))
    floor = BENT * float(np.quantile(strength, 0.9))
    home = _homes(panels, centres)
    kept: dict[int, list[object]] = {}
    found: list[Array] = []
    for t in np.argsort(-strength).tolist():
        if strength[t] <= floor or home[t] < 0:
            continue
        reach = mesh.size * direction[t]
        line = shapely.LineString([centres[t] - reach, centres[t] + reach])
        # within the panel, and not across a crease that ends in it
        parts = shapely.get_parts(shapely.difference(shapely.intersection(panels[home[t]], line), wall))
        line = parts[int(np.argmin(shapely.distance(parts, shapely.Point(centres[t]))))]
        others = kept.setdefault(home[t], [])
        if line.length < spacing or any(shapely.distance(line, other) < APART * spacing for other in others):
            continue
        passed = np.flatnonzero(home == home[t])
        passed = passed[shapely.dwithin(shapely.points(centres[passed]), line, 0.5 * spacing)]
        weight = strength[passed]
        if (weight * np.abs(direction[passed] @ direction[t])).sum() < PARALLEL * weight.sum():
            continue
        others.append(line)
        found.append(np.asarray(line.coords)[[0, -1]])
    return found


def _homes(panels: NDArray[np.object_], centres: Array) -> NDArray[np.int64]:
    """The panel that each centre lies in, -1 for none."""
    import shapely

    home = np.full(len(centres), -1, dtype=np.int64)
    at, panel = shapely.STRtree(panels).query(shapely.points(centres), predicate="within")
    home[at] = panel
    return home
