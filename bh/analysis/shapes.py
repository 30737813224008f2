"""How far apart two shapes of one flat sheet are, on whatever meshes they were solved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.analysis.alignment import aligned
from bh.errors import ModelError
from bh.formulations.state import State
from bh.runtime.one_line import OneLine
from meshes import SheetMesh

Array = NDArray[np.float64]
INWARD = 1e-6  # how far a node is moved into its own triangle, so that it lies on one side of a cut
OFF = 0.05  # of the extent: sheets whose areas or boxes differ by more are not the same sheet
CHUNK = 4_000_000  # barycentric coordinates at once


@dataclass(frozen=True, repr=False)
class Distance(OneLine):
    """Between two shapes.

    Attributes:
        largest: of a node of the coarser mesh from the same point of the other sheet, mm.
        rms: root mean square over these nodes, mm.
        at: (2,) place of the largest on the flat sheet, mm.
        distances: (k,) of all these nodes, mm, in the order of `mesh`.
        mesh: the coarser of the two.
    """

    largest: float
    rms: float
    at: Array
    distances: Array
    mesh: SheetMesh


def shape_distance(one: State, two: State, *, in_place: bool = False) -> Distance:
    """Compare two shapes point by point of the flat sheet.

    Args:
        one: a state.
        two: another of the same flat sheet, of any mesh or formulation.
        in_place: compare where they are; else one is moved rigidly onto the other by least squares.

    Raises:
        ModelError: they are not of the same flat sheet.
    """
    coarse, fine = (one, two) if len(one.mesh.points) <= len(two.mesh.points) else (two, one)
    _check(coarse.mesh, fine.mesh)
    if np.array_equal(coarse.mesh.points, fine.mesh.points):
        points = fine.points
    else:
        points = at_nodes_of(coarse.mesh, fine)
    moved = points if in_place else aligned(points, coarse.points)[0]
    distances = np.linalg.norm(moved - coarse.points, axis=1)
    worst = int(np.argmax(distances))
    return Distance(
        float(distances[worst]),
        float(np.sqrt(np.mean(distances**2))),
        coarse.mesh.points[worst, :2].copy(),
        distances,
        coarse.mesh,
    )


def _check(a: SheetMesh, b: SheetMesh) -> None:
    extent = float(np.ptp(a.points, axis=0).max())
    boxes = max(np.abs(f(a.points, axis=0) - f(b.points, axis=0)).max() for f in (np.min, np.max))
    areas = abs(a.areas.sum() / b.areas.sum() - 1.0)
    if boxes > OFF * extent or areas > OFF:
        raise ModelError("these are not shapes of the same flat sheet; compare states of one pattern")


def at_nodes_of(mesh: SheetMesh, state: State) -> Array:
    """(n, 3) where the nodes of another mesh of the same flat sheet are in a state, mm.

    Args:
        mesh: of n nodes.
        state: on any mesh of that sheet; linear in its triangles, also a little beyond them at curved edges.
    """
    first = np.zeros(
        len(mesh.points), dtype=np.int64
    )  # a triangle of every node: it says on which side of a cut
    for corner in range(3):
        first[mesh.triangles[:, corner]] = np.arange(len(mesh.triangles))
    middles = mesh.points[mesh.triangles[first]].mean(axis=1)
    flat = mesh.points + INWARD * (middles - mesh.points)
    corners = state.mesh.points[state.mesh.triangles][:, :, :2]
    step = max(1, CHUNK // len(corners))
    out = np.empty((len(flat), 3))
    for begin in range(0, len(flat), step):
        part = slice(begin, begin + step)
        weights = _barycentric(flat[part, :2], corners)
        best = np.argmax(weights.min(axis=2), axis=1)
        w = weights[np.arange(len(best)), best]
        out[part] = np.einsum("kc,kcx->kx", w, state.points[state.mesh.triangles[best]])
    return out


def _barycentric(points: Array, corners: Array) -> Array:
    """(k, t, 3) barycentric coordinates of points (k, 2) in triangles (t, 3, 2)."""
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    twice = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    p = points[:, None] - a
    v = (p[:, :, 0] * ac[:, 1] - p[:, :, 1] * ac[:, 0]) / twice
    w = (ab[:, 0] * p[:, :, 1] - ab[:, 1] * p[:, :, 0]) / twice
    return np.stack((1.0 - v - w, v, w), axis=2)
