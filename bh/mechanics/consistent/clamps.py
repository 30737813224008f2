"""Slopes of the sheet at edges of its boundary: read from a state, held as they lie, and let go of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.state import State
from bh.loading.load_step import LoadStep
from bh.mechanics.consistent.kernels import TURN
from bh.mechanics.consistent.patches import Patches
from bh.model.ramp import Ramp
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Clamps:
    """What edges of the boundary are asked for in a step.

    Attributes:
        edges: (e,) True where the slope is held, or was until the step began.
        outward: (e, 3) where the sheet goes on beyond an edge that is held as it lies, mm, as long as the edge; nan
            for all others.
        couple: (e,) what a clamp that is let go of carried, N mm: it goes to zero during the step.
        loaded: (e,) True where a couple acts, and `load` (e,) that couple from the start to the end of the step, N mm.
    """

    edges: NDArray[np.bool_]
    outward: Array
    couple: Array
    loaded: NDArray[np.bool_]
    load: Ramp


def clamps(mesh: SheetMesh, load_step: LoadStep, start: State | None) -> Clamps:
    """The clamps of a step that begins at a state.

    A couple works on the turn of the sheet at its edge, measured from where the sheet went on when the step began: a
    clamp at that place that turns freely, with a couple on it.

    Args:
        mesh: the stress-free sheet.
        load_step: has the clamped edges.
        start: a state of the consistent formulation; None for the stress-free sheet.

    Raises:
        ModelError: a couple acts on an edge that is clamped.
    """
    topology, held = mesh.topology, load_step.constraints
    edges = np.zeros(len(topology.edges), dtype=bool)
    rows = topology.find_edges(held.clamped)
    edges[rows] = True
    lying = np.zeros_like(edges)
    lying[rows] = held.as_it_lies
    couple = np.zeros(len(edges))
    load, loaded = _loaded(mesh, load_step)
    if (loaded & edges).any():
        raise ModelError(
            "an edge moment acts on an edge that is clamped, where nothing turns; remove one of them"
        )
    outward = np.full((len(edges), 3), np.nan)
    if start is None or start.edge_slopes is None or start.clamp_couples is None:
        return Clamps(edges | loaded, outward, couple, loaded, load)
    if load_step.releases:
        couple = np.where(edges | loaded, 0.0, start.clamp_couples)
    lying |= (couple != 0.0) | loaded
    outward[lying] = _directions(mesh, start, np.flatnonzero(lying))
    return Clamps(edges | lying, outward, couple, loaded, load)


def _loaded(mesh: SheetMesh, load_step: LoadStep) -> tuple[Ramp, NDArray[np.bool_]]:
    """(e,) couples on edges, N mm, and where there are some."""
    ends = mesh.points[mesh.topology.edges]
    if load_step.edge_couple is None:
        none = np.zeros(len(ends))
        return Ramp(none, none), np.zeros(len(ends), dtype=bool)
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    start, end = load_step.edge_couple.start * length, load_step.edge_couple.end * length
    return Ramp(start, end), (start != 0.0) | (end != 0.0)


def _directions(mesh: SheetMesh, start: State, edges: Ints) -> Array:
    """(k, 3) where the sheet goes on beyond edges of the boundary in a state, mm, as long as the edge."""
    topology = mesh.topology
    triangle = topology.edge_triangles[edges, 0]
    side = (topology.triangle_edges[triangle] == edges[:, None]).argmax(axis=1)
    corners = mesh.triangles[triangle[:, None], (side[:, None] + np.arange(3)) % 3]
    x = start.points[corners]  # the corner, then its opposite edge counter-clockwise
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    edge = x[:, 2] - x[:, 1]
    assert start.edge_slopes is not None
    slope = start.edge_slopes[edges][:, None]
    length = np.linalg.norm(edge, axis=1)[:, None]
    return np.asarray(np.cos(slope) * np.cross(edge, normal) + np.sin(slope) * length * normal)


def read_slopes(
    mesh: SheetMesh, joined: Patches, theta: Array, moments: Array, at_rest: Array | None = None
) -> tuple[Array, Array]:
    """(e,) slopes at the boundary, rad, nan inside; and (e,) couples of clamps there, N mm, zero elsewhere.

    A slope is the angle from the triangle at the edge up to the sheet's tangent plane there.

    Args:
        mesh: the stress-free sheet.
        joined: patches.
        theta: (c, a) their angles, rad.
        moments: (c, a) N mm.
        at_rest: (t, 3) angles at the edges of triangles that are at rest curved, rad.
    """
    topology = mesh.topology
    of_half = topology.triangle_edges.ravel()
    slopes, couples = np.full(len(topology.edges), np.nan), np.zeros(len(topology.edges))
    members = joined.members
    half = np.where(members[:, :, None] >= 0, 3 * members[:, :, None] + np.arange(3), -1).reshape(
        len(members), -1
    )
    edge = of_half[half]
    rim = (half >= 0) & (topology.edge_hinges[edge] < 0)
    slopes[edge[rim]] = np.einsum("cha,ca->ch", joined.shares, theta)[rim]
    if at_rest is not None:
        slopes[edge[rim]] += at_rest.ravel()[half[rim]]
    clamp = (joined.kind == TURN) & (joined.hinge < 0)
    couples[of_half[joined.half_edge[clamp]]] = moments[clamp]
    return slopes, couples
