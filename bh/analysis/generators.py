"""Generators of a folded panel, read from the deformed sheet: the direction of least curvature (source 5.2.2).

At places along the middle of a panel the normals and positions of the triangles around are fitted by functions that
are linear in the flat coordinates. They give the second fundamental form II_ab = -N,a . x,b there; its eigenvector
with the smaller eigenvalue is the generator, the other eigenvalue kappa_2. The straight line along it in the flat
sheet meets the crease at u, where its angle gamma from the tangent is to be compared with Eq. A.12. Nothing of the
crease's own curvature, torsion or fold angle goes in. A flat triangle has the normal of its middle, so the fit sees
curvature only over a few triangles: `kappa_1` / `kappa_2` says how far the panel is from a developable surface with
that generator.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.analysis.contact import Panels
from bh.errors import ModelError
from bh.formulations.state import State
from bh.loading.load_step import crease_hinges
from bh.runtime.one_line import OneLine
from meshes import SheetMesh
from meshes.topology import chain_nodes

Array = NDArray[np.float64]
SIDES = ("left", "right")
CELLS = 2.5  # least radius of a fit, in edges of the crease
FEWEST = 8  # triangles in a fit


@dataclass(frozen=True, eq=False, repr=False)
class Generators(OneLine):
    """Generators of one panel at a crease.

    Attributes:
        u: (k,) flat length along the crease where each of them meets it, mm.
        angle: (k,) gamma from the crease's tangent, rad in (0, pi), in the flat sheet.
        places: (k, 2) flat places at which the panel was looked at, mm.
        kappa_1: (k,) the smaller principal curvature there by size, 1/mm; zero on a developable surface.
        kappa_2: (k,) the larger one, 1/mm, positive where the panel is hollow on its upper side.
    """

    u: Array
    angle: Array
    places: Array
    kappa_1: Array
    kappa_2: Array


def panel_generators(
    state: State, crease: str, side: str, distance: float | None = None, radius: float | None = None
) -> Generators:
    """Generators of the panel on one side of a crease, one for each place beside a node of it.

    Places whose generator leaves the panel before it meets the crease are left out.

    Args:
        state: of a path.
        crease: its name.
        side: "left" or "right" of the crease's direction, seen from above.
        distance: of the places from the crease, mm; by default half the mean width of the panel.
        radius: of the fits, mm; by default the distance, but at least 2.5 edges of the crease. At corners a
            fit takes more, until it has eight triangles.

    Raises:
        ModelError: a side that is neither; a sheet that is not flat when stress-free; a panel of too few
            triangles.
    """
    mesh = state.mesh
    if side not in SIDES:
        raise ModelError(f"side '{side}' of crease '{crease}' is not known; use left or right")
    if not mesh.flat:
        raise ModelError("generators are measured in the flat sheet; this one is made curved")
    pairs = mesh.crease_edges(crease)
    inside = _panel(mesh, crease, side)
    line = mesh.points[chain_nodes(pairs), :2]
    steps = np.diff(line, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    u = np.concatenate(([0.0], np.cumsum(lengths)))
    if distance is None:
        distance = 0.5 * float(mesh.areas[inside].sum() / u[-1])
    if radius is None:
        radius = max(distance, CELLS * float(lengths.mean()))
    sign = 1.0 if side == "left" else -1.0
    normal = sign * np.column_stack((-steps[:, 1], steps[:, 0])) / lengths[:, None]
    ends = np.concatenate((normal[:1], normal)) + np.concatenate((normal, normal[-1:]))
    places = line + distance * ends / np.linalg.norm(ends, axis=1, keepdims=True)
    forms = _second_forms(state, inside, places, radius)
    values, vectors = np.linalg.eigh(forms)
    least = np.argmin(np.abs(values), axis=1)
    rows = np.arange(len(values))
    direction = vectors[rows, :, least]
    found = [_foot(line, u, p, d, sign) for p, d in zip(places, direction, strict=True)]
    kept = np.array([f is not None for f in found])
    feet = np.array([f for f in found if f is not None]).reshape(-1, 2)
    return Generators(
        feet[:, 0], feet[:, 1], places[kept], values[rows, least][kept], values[rows, 1 - least][kept]
    )


def _panel(mesh: SheetMesh, crease: str, side: str) -> NDArray[np.int64]:
    """Triangles of the panels on one side of a crease."""
    hinges = crease_hinges(mesh, crease)
    pairs = mesh.crease_edges(crease)
    topology = mesh.topology
    triangles = topology.edge_triangles[topology.hinge_edges[hinges]]
    # the first triangle lies to the left of the hinge's own direction
    along = topology.hinges[hinges, 1] == pairs[:, 0]
    column = np.where(along, 0, 1) if side == "left" else np.where(along, 1, 0)
    panels = Panels.of(mesh).of_triangle
    wanted = np.unique(panels[triangles[np.arange(len(hinges)), column]])
    return np.flatnonzero(np.isin(panels, wanted))


def _second_forms(state: State, inside: NDArray[np.int64], places: Array, radius: float) -> Array:
    """(k, 2, 2) symmetric second fundamental forms at flat places, in flat axes, 1/mm."""
    from scipy.spatial import KDTree

    corners = state.points[state.mesh.triangles[inside]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    samples = np.concatenate((normals, corners.mean(axis=1)), axis=1)
    flat = state.mesh.points[state.mesh.triangles[inside]].mean(axis=1)[:, :2]
    areas = state.mesh.areas[inside]
    if len(flat) <= FEWEST:
        raise ModelError(f"the panel has only {len(flat)} triangles; its generators need a finer mesh")
    tree = KDTree(flat)
    forms = np.empty((len(places), 2, 2))
    reach, _ = tree.query(places, k=FEWEST + 1)
    # at corners a larger circle, so that every fit has enough triangles
    radii = np.maximum(radius, 1.01 * reach[:, -1])
    for i, (place, near) in enumerate(zip(places, tree.query_ball_point(places, radii), strict=True)):
        offset = flat[near] - place
        weight = np.sqrt(areas[near] * (1.0 - (np.linalg.norm(offset, axis=1) / radii[i]) ** 2))
        basis = np.column_stack((np.ones(len(near)), offset)) * weight[:, None]
        fit = np.linalg.lstsq(basis, samples[near] * weight[:, None], rcond=None)[0]
        form = -fit[1:, :3] @ fit[1:, 3:].T
        forms[i] = 0.5 * (form + form.T)
    return forms


def _foot(line: Array, u: Array, place: Array, direction: Array, sign: float) -> tuple[float, float] | None:
    """(u, gamma) where the straight line through a flat place meets the crease nearest to it, or None."""
    across = np.array([-direction[1], direction[0]])
    off = (line - place) @ across
    along = (line - place) @ direction
    crossed = np.flatnonzero((off[:-1] <= 0.0) != (off[1:] <= 0.0))
    if len(crossed) == 0:
        return None
    share = off[crossed] / (off[crossed] - off[crossed + 1])
    reach = along[crossed] + share * (along[crossed + 1] - along[crossed])
    best = int(np.argmin(np.abs(reach)))
    i = crossed[best]
    # the chord's direction holds at its middle
    at = u[i] + share[best] * (u[i + 1] - u[i])
    middle = 0.5 * (u[1:] + u[:-1])
    chord = np.diff(line, axis=0)
    heading = np.interp(at, middle, np.unwrap(np.arctan2(chord[:, 1], chord[:, 0])))
    towards = direction if reach[best] < 0.0 else -direction  # from the crease to the place
    angle = sign * (np.arctan2(towards[1], towards[0]) - heading)
    return float(at), float(np.mod(angle, 2.0 * np.pi))
