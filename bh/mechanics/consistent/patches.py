"""Constant matrices of triangles and of patches of them, with the rotations inside a patch eliminated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.mechanics.consistent.kernels import NONE, OWN, TURN
from bh.mechanics.consistent.setup import join_pairs
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
JOINED = 1  # rounds of joining patches by twos: pairs of triangles (docs/decisions.md has the measurement)


def triangle_frames(points: Array, triangles: Ints) -> tuple[Array, Array]:
    """(t, 3, 2) edge vectors in each triangle's own plane, edge k from corner k + 1 to k + 2, and areas (t,).

    Args:
        points: (n, 3) stress-free positions, mm.
        triangles: (t, 3) node indices.
    """
    corner = points[triangles]
    edge = np.roll(corner, 1, axis=1) - np.roll(corner, -1, axis=1)
    normal = np.cross(edge[:, 0], edge[:, 1])
    doubled = np.linalg.norm(normal, axis=1)
    e1 = edge[:, 0] / np.linalg.norm(edge[:, 0], axis=1)[:, None]
    e2 = np.cross(normal / doubled[:, None], e1)
    return np.stack((np.einsum("tki,ti->tk", edge, e1), np.einsum("tki,ti->tk", edge, e2)), axis=2), (
        0.5 * doubled
    )


def frame_angles(points: Array, triangles: Ints) -> Array:
    """(t,) angles from the drawing's x axis to the first axis of `triangle_frames`, in a sheet flat in z = const, rad.

    Args:
        points: (n, 3) stress-free positions, mm.
        triangles: (t, 3) node indices.
    """
    along = points[triangles[:, 2]] - points[triangles[:, 1]]
    return np.arctan2(along[:, 1], along[:, 0])


def curvature_maps(edges: Array, areas: Array) -> Array:
    """(t, 3, 3) curvature (xx, yy, 2 xy) of triangles from the angles at their edges, 1 / mm.

    kappa = (1/A) sum_k L_k theta_k mu_k (x) mu_k with the outward normals mu_k of the stress-free edges (t, 3, 2).

    Args:
        edges: (t, 3, 2) from `triangle_frames`, mm.
        areas: (t,) mm^2.
    """
    x, y = edges[..., 0], edges[..., 1]
    weight = 1.0 / (np.linalg.norm(edges, axis=2) * areas[:, None])  # L mu = (y, -x)
    return np.stack((weight * y * y, weight * x * x, -2.0 * weight * x * y), axis=1)


def turned_strains(values: Array, angle: Array, shear: float) -> Array:
    """(k, 3) components in axes at angles (k,) to their own.

    Args:
        values: (k, 3) components xx, yy and the third.
        angle: (k,) from their x axes to the new ones, rad.
        shear: xy over the third component: 0.5 of strains, 1 of forces.
    """
    c, s = np.cos(angle), np.sin(angle)
    xx, yy, xy = values[:, 0], values[:, 1], shear * values[:, 2]
    mixed = c * s * (yy - xx) + (c * c - s * s) * xy
    return np.column_stack(
        (
            c * c * xx + s * s * yy + 2.0 * c * s * xy,
            s * s * xx + c * c * yy - 2.0 * c * s * xy,
            mixed / shear,
        )
    )


def bending_matrices(maps: Array, areas: Array, moduli: Array) -> Array:
    """(t, 3, 3) B of 1/2 theta.B.theta = 1/2 A kappa.C.kappa, N mm, with moduli C of curvatures, N mm.

    Args:
        maps: (t, 3, 3) from `curvature_maps`, 1 / mm.
        areas: (t,) mm^2.
        moduli: (3, 3), or (t, 3, 3) in the frame of each triangle, N mm.
    """
    B = np.swapaxes(maps, 1, 2) @ (areas[:, None, None] * moduli) @ maps
    return np.asarray(0.5 * (B + np.swapaxes(B, 1, 2)))


@dataclass(frozen=True, eq=False)
class Patches:
    """Triangles joined into c patches of at most s, and the angles (c, a) that they measure.

    Half edge 3 m + k is edge k of the patch's triangle m.

    Attributes:
        members: (c, s) triangles, then -1.
        kind: (c, a), see `bh.mechanics.consistent.kernels`.
        hinge: (c, a) row of `mesh.topology.hinges` of each angle, -1 at a clamp and where there is none.
        half_edge: (c, a) flat index 3 triangle + k of the edge (of one of its sides if it lies inside the patch).
        inner: (c, a) True if it lies inside.
        B: (c, a, a) energy of bending 1/2 theta.B.theta, N mm.
        shares: (c, 3 s, a) angles on the half edges from theta, at the rotations of least energy.
    """

    members: Ints
    kind: Ints
    hinge: Ints
    half_edge: Ints
    inner: Bools
    B: Array
    shares: Array


def patches(
    mesh: SheetMesh,
    B: Array,
    spring: Bools,
    clamped: Bools,
    rank: Array,
    joined: int = JOINED,
    group: Array | None = None,
    condense: bool = True,
) -> Patches:
    """Patches of a mesh.

    Args:
        mesh: the stress-free sheet.
        B: (t, 3, 3) bending matrices of the triangles.
        spring: (m,) hinges that are spring creases: they have two rotations and lie in no patch.
        clamped: (e,) edges that keep their slope.
        rank: (t,) place of every triangle along the sheet. Neighbours of one place are joined, and of two patches the
            later one measures the turn of the hinge between them, so that the band stays narrow.
        joined: rounds of joining by twos.
        group: (t,) only triangles of one group are joined, by default all.
        condense: False keeps all rotations, of free edges too: no triangles are joined.
    """
    topology = mesh.topology
    sides = topology.edge_triangles[topology.hinge_edges]
    apart = np.abs(rank[sides[:, 0]] - rank[sides[:, 1]])
    order = np.argsort(apart, kind="stable")
    order = order[~spring[order]]
    if group is not None:
        order = order[group[sides[order, 0]] == group[sides[order, 1]]]
    patch_of, count = np.arange(len(B)), len(B)
    for _ in range(joined if condense else 0):
        patch_of, count = join_pairs(sides, order, patch_of, count)
    by_patch = np.argsort(patch_of, kind="stable")
    member = np.arange(len(B)) - np.searchsorted(patch_of[by_patch], patch_of[by_patch])
    members = np.full((count, int(member.max()) + 1), -1, dtype=np.int64)
    members[patch_of[by_patch], member] = by_patch

    # of every half edge (c, 3 s): its hinge, and what it does
    half = np.where(members[:, :, None] >= 0, 3 * members[:, :, None] + np.arange(3), -1).reshape(count, -1)
    edge = topology.triangle_edges.ravel()[half]
    hinge = np.where(half >= 0, topology.edge_hinges[edge], -1)
    first = topology.edge_triangles[edge, 0] == half // 3
    one, two = sides[hinge, 0], sides[hinge, 1]
    inner = (hinge >= 0) & (patch_of[one] == patch_of[two]) & ~spring[hinge]
    later = (rank[two] > rank[one]) | ((rank[two] == rank[one]) & (two > one))
    turns = (hinge >= 0) & ~inner & ~spring[hinge] & (later != first)
    clamp = (half >= 0) & (hinge < 0) & clamped[edge]
    # an inner hinge is measured where its second triangle is; its first side has the rotation that is eliminated
    free = (half >= 0) & (hinge < 0) & (not condense)
    measured = ((hinge >= 0) & ~(inner & first)) | clamp | free
    kind = np.where(turns | clamp | (inner & ~first), TURN, np.where(measured, OWN, NONE))

    column = np.cumsum(measured, axis=1) - 1
    angles = int(measured.sum(axis=1).max())
    S = np.zeros((*half.shape, angles))
    c, h = np.nonzero(measured)
    S[c, h, column[c, h]] = 1.0
    reduced, shares = _eliminate(_block_diagonal(B, members), S, half, ~measured, np.where(inner, hinge, -1))

    def packed(values: Ints | Bools, fill: int) -> Ints:
        out = np.full((count, angles), fill, dtype=np.int64)
        out[c, column[c, h]] = values[c, h]
        return out

    return Patches(
        members=members, kind=packed(kind, NONE), hinge=packed(hinge, -1), half_edge=packed(half, -1),
        inner=packed(inner, 0).astype(bool), B=reduced, shares=shares,
    )  # fmt: skip


def _block_diagonal(B: Array, members: Ints) -> Array:
    """(c, 3 s, 3 s) with the matrices of the members, and ones on the diagonal where there is none."""
    count, most = members.shape
    out = np.zeros((count, most, 3, most, 3))
    for m in range(most):
        there = (members[:, m] >= 0)[:, None, None]
        out[:, m, :, m, :] = np.where(there, B[members[:, m]], np.eye(3) * np.abs(B).mean())
    return out.reshape(count, 3 * most, 3 * most)


def _eliminate(B: Array, S: Array, half: Ints, gone: Bools, inner_hinge: Ints) -> tuple[Array, Array]:
    """(reduced B, shares): the angles on the half edges are S theta + R beta, with the beta of least energy.

    beta are the rotations of free edges and of inner hinges, one for each half edge that is `gone`; that of an inner
    hinge counts on its two sides (c, 3 s) with opposite signs.
    """
    R = gone[:, None, :] * np.eye(half.shape[1])
    partner = (inner_hinge[:, :, None] == inner_hinge[:, None, :]) & (inner_hinge >= 0)[:, :, None]
    R -= partner & ~gone[:, :, None] & gone[:, None, :]
    BR = B @ R
    inside = np.swapaxes(R, 1, 2) @ BR
    scale = np.abs(B).max(axis=(1, 2))[:, None, None]
    inside += np.where(gone[:, None, :], 0.0, scale) * np.eye(half.shape[1])
    shares = S - R @ np.linalg.solve(inside, np.swapaxes(BR, 1, 2) @ S)
    reduced = np.swapaxes(shares, 1, 2) @ B @ shares
    return 0.5 * (reduced + np.swapaxes(reduced, 1, 2)), shares
