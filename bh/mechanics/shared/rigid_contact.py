"""Rigid indenters that a sheet touches, and springs to where its nodes were or are pulled. Compiled.

An indenter is a rounded rectangle along an axis. With g the distance of a point of the sheet from its surface (mm,
negative inside), d its `gap` and k its stiffness (N/mm for every mm of edge of the mesh), the potential a length is

    k (d - g)^3 / (6 d)               for 0 < g < d
    k (d^2 / 6 - d g / 2 + g^2 / 2)   for g <= 0

and nothing beyond: a smooth barrier with two continuous derivatives, whose force grows to k d / 2 where the surfaces
meet. Only pressing is possible. Points are spread evenly over all edges of the mesh, so that the edge of an indenter
may lie anywhere between nodes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.mechanics.shared.assembly import add_lower, rotate
from bh.mechanics.shared.kinematics import INNER_OPTIONS, OPTIONS
from bh.mechanics.shared.sparsity import Slots
from bh.model.actuations import Indenter, Pull, Tether
from bh.model.step import Body
from bh.model.supports import select
from meshes import SheetMesh
from meshes.topology import Ints

if TYPE_CHECKING:
    from bh.mechanics.contact.friction import Rubbing

Array = NDArray[np.float64]
POINTS = 4  # on every edge
INDENTED = 20  # kind of a contact with an indenter, and the number of the point on its edge


class RigidContact:
    """The indenters and tethers of one step on a mesh; positions x are (n, 3), mm."""

    def __init__(self, mesh: SheetMesh, items: tuple[Body, ...], start: Array) -> None:
        """Points of the sheet that can touch, and the springs of tethers and pulls.

        Args:
            mesh: the stress-free sheet.
            items: indenters, tethers and pulls of the step.
            start: (n, 3) positions that tethers hold to, mm.

        Raises:
            ModelError: a node is pulled that the mesh does not have, or to two points.
        """
        self.triangles = mesh.triangles
        self.indenters = tuple(item for item in items if isinstance(item, Indenter))
        topology = mesh.topology
        lengths = np.linalg.norm(np.diff(mesh.points[topology.edges], axis=1)[:, 0], axis=1)
        owner = topology.edge_triangles[:, 0]
        corners = mesh.triangles[owner]
        part = (np.arange(POINTS) + 0.5) / POINTS
        ends = [(corners == topology.edges[:, [k]]).astype(float) for k in range(2)]
        weights = (1.0 - part)[:, None, None] * ends[0] + part[:, None, None] * ends[1]
        self.owner: Ints = np.tile(owner, POINTS)
        self.weights: Array = np.ascontiguousarray(weights.reshape(-1, 3))
        self.share: Array = np.tile(lengths / POINTS, POINTS)
        self.spring = np.zeros_like(mesh.points)
        for item in items:
            if isinstance(item, Tether):
                nodes = select(mesh, item.at)
                self.spring[nodes] += np.asarray(item.total, dtype=float) / len(nodes)
        self.anchor, self.pulled = _anchors(items, start, self.spring)
        # a triangle for every node, and which of its corners the node is
        self.home = np.zeros((len(start), 2), dtype=np.int64)
        for corner in range(3):
            self.home[mesh.triangles[:, corner], 0] = np.arange(len(mesh.triangles))
            self.home[mesh.triangles[:, corner], 1] = corner
        self._shape = np.array([[b.half[0], b.half[1], b.radius, b.stiffness, b.gap] for b in self.indenters])
        self._shape = self._shape.reshape(-1, 5)
        self._axes = np.array([(b.across, b.up) for b in self.indenters]).reshape(-1, 2, 3)
        self._from = np.array([b.at for b in self.indenters], dtype=float).reshape(-1, 3)
        self.velocity: Array = np.array([b.by for b in self.indenters], dtype=float).reshape(-1, 3)

    def centres(self, lam: float) -> Array:
        """(indenters, 3) where the centres of their sections are, mm.

        Args:
            lam: load parameter of the step, 0 to 1.
        """
        return self._from + lam * self.velocity

    def _pressed(self, x: Array, lam: float) -> tuple[Array, Ints, Ints, Array, Array, Array, Array, Array]:
        """What every kernel takes first: the sheet, its points, and where the indenters are."""
        return (
            x,
            self.triangles,
            self.owner,
            self.weights,
            self.share,
            self.centres(lam),
            self._axes,
            self._shape,
        )

    def rubbing(self, x: Array, lam: float, mu: float, first: int) -> Rubbing:
        """Points that indenters press on, to rub against their centres; nothing is stuck.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
            mu: coefficient of friction of indenters that have none of their own.
            first: number of the centre of the first indenter among the places of `Friction`.
        """
        from bh.mechanics.contact.friction import Rubbing

        shape = (len(self.owner), len(self.indenters))
        push, normal = np.zeros(shape), np.zeros((*shape, 3))
        _pushes(
            *self._pressed(x, lam),
            push,
            normal,
        )
        point, body = np.nonzero(push)
        corners, weights = self.triangles[self.owner[point]], self.weights[point]
        ends = np.argsort(weights == 0.0, axis=1, kind="stable")[:, :2]
        keys = np.full((len(point), 5), -1, dtype=np.int64)
        keys[:, 0] = INDENTED + point // (len(self.owner) // POINTS)
        keys[:, 1:3] = np.take_along_axis(corners, ends, axis=1)
        keys[:, 3] = first + body
        parts = np.zeros((len(point), 4))
        parts[:, :2], parts[:, 2] = np.take_along_axis(weights, ends, axis=1), -1.0
        own = np.array([mu if each.friction is None else each.friction for each in self.indenters])
        force = own[body] * push[point, body]
        return Rubbing(keys, parts, normal[point, body], force, np.zeros((len(point), 3)))

    def forces(self, x: Array, lam: float, f: Array) -> float:
        """Adds the gradient to f (n, 3), N, and returns the energy, N mm.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
            f: (nodes, 3) N; the gradient is added.
        """
        moved = x - self.anchor - lam * self.pulled
        f += self.spring * moved
        total = np.zeros((len(self.indenters), 3))
        energy = _forces(
            *self._pressed(x, lam),
            f,
            total,
        )
        return float(energy + 0.5 * np.vdot(self.spring, moved**2))

    def contact_forces(self, x: Array, lam: float) -> dict[str, Array]:
        """(3,) force of every indenter on the sheet, N.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        total = np.zeros((len(self.indenters), 3))
        _forces(
            *self._pressed(x, lam),
            np.zeros_like(x),
            total,
        )
        return {indenter.name: -force for indenter, force in zip(self.indenters, total, strict=True)}

    def tangent(self, x: Array, lam: float, frame_of: Ints, frames: Array, slots: Slots, data: Array) -> None:
        """Adds the Hessian; `slots` are those of the triangles.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
            frame_of: (nodes,) row of `frames` of each node, -1 where axes are global.
            frames: (k, 3, 3) axes of oblique supports.
            slots: of the triangles.
            data: values of the matrix, N / mm; added to.
        """
        _tangent(
            *self._pressed(x, lam),
            self.home,
            self.spring,
            frame_of,
            frames,
            slots,
            data,
        )

    def force_rates(self, x: Array, v: Array, lam: float, moving: float, out: Array) -> None:
        """Adds the rate of the gradient for velocities v (n, 3), indenters moving at `moving` times their speed.

        Args:
            x: (nodes, 3) positions, mm.
            v: (nodes, 3) velocities.
            lam: load parameter of the step, 0 to 1.
            moving: rate of lambda.
            out: (nodes, 3); the rate is added.
        """
        out += self.spring * (v - moving * self.pulled)
        _force_rates(
            x,
            v,
            self.triangles,
            self.owner,
            self.weights,
            self.share,
            self.centres(lam),
            moving * self.velocity,
            self._axes,
            self._shape,
            out,
        )

    def power(self, x: Array, lam: float) -> float:
        """Rate of energy with lambda at fixed x, N mm: work of what moves (indenters, pulls) on the sheet.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        pulls = -float(np.vdot(self.spring * (x - self.anchor - lam * self.pulled), self.pulled))
        return pulls + float(
            sum(
                force @ indenter.by
                for force, indenter in zip(self.contact_forces(x, lam).values(), self.indenters, strict=True)
            )
        )

    def control_stiffness(self, x: Array, lam: float) -> float:
        """Second derivative of the energy by lambda at fixed x, N mm.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        ahead = 1e-6
        return (self.power(x, lam + ahead) - self.power(x, lam - ahead)) / (2.0 * ahead)


def _anchors(items: tuple[Body, ...], start: Array, spring: Array) -> tuple[Array, Array]:
    """Where springs hold the nodes when the step begins, and how far that moves in it, both (n, 3), mm.

    The stiffness of pulls, N/mm, is added to `spring` (n, 3), which has that of the tethers.
    """
    anchor, pulled = start.copy(), np.zeros_like(start)
    for item in items:
        if not isinstance(item, Pull):
            continue
        if not 0 <= item.node < len(start):
            raise ModelError(f"node {item.node} is pulled, but the mesh has {len(start)} nodes")
        if spring[item.node].any():
            raise ModelError(f"node {item.node} is pulled and held by a spring already; do one of them")
        if item.start is not None:
            anchor[item.node] = item.start
        spring[item.node] = item.stiffness
        pulled[item.node] = np.asarray(item.to) - anchor[item.node]
    return anchor, pulled


@njit(inline="always", **INNER_OPTIONS)
def _measure(p, centre, axes, shape, n, H):  # type: ignore[no-untyped-def]
    """Distance g of a point from the surface of an indenter, its gradient n (3,) and Hessian H (3, 3)."""
    s = z = 0.0
    for c in range(3):
        s += (p[c] - centre[c]) * axes[0, c]
        z += (p[c] - centre[c]) * axes[1, c]
    qs, qz = abs(s) - shape[0], abs(z) - shape[1]
    for c in range(3):
        n[c] = 0.0
        for e in range(3):
            H[c, e] = 0.0
    sign_s, sign_z = math.copysign(1.0, s), math.copysign(1.0, z)
    # a cylinder is round right above and below its axis, too
    if (qs > 0.0 or (shape[0] == 0.0 and qz > 0.0)) and (qz > 0.0 or (shape[1] == 0.0 and qs > 0.0)):
        length = math.hypot(qs, qz)
        g = length - shape[2]
        if g >= shape[4]:
            return g
        a, b = sign_s * qs / length, sign_z * qz / length
        for c in range(3):
            n[c] = a * axes[0, c] + b * axes[1, c]
        # (1 - n n) / length in the plane of the section: t t / length with t across the normal
        for c in range(3):
            tc = -b * axes[0, c] + a * axes[1, c]
            for e in range(3):
                te = -b * axes[0, e] + a * axes[1, e]
                H[c, e] = tc * te / length
        return g
    if qs > qz:
        for c in range(3):
            n[c] = sign_s * axes[0, c]
        return qs - shape[2]
    for c in range(3):
        n[c] = sign_z * axes[1, c]
    return qz - shape[2]


@njit(inline="always", **INNER_OPTIONS)
def _law(g, k, d):  # type: ignore[no-untyped-def]
    """Energy a length and its derivatives by g."""
    if g > 0.0:
        left = d - g
        return k * left**3 / (6.0 * d), -k * left * left / (2.0 * d), k * left / d
    return k * (d * d / 6.0 - 0.5 * d * g + 0.5 * g * g), -k * (0.5 * d - g), k


@njit(inline="always", **INNER_OPTIONS)
def _place(x, corners, weights, p):  # type: ignore[no-untyped-def]
    for c in range(3):
        p[c] = 0.0
        for i in range(3):
            p[c] += weights[i] * x[corners[i], c]


@njit(**OPTIONS)
def _forces(x, triangles, owner, weights, share, centres, axes, shape, f, total):  # type: ignore[no-untyped-def]
    p, n, H = np.empty(3), np.empty(3), np.empty((3, 3))
    energy = 0.0
    for k in range(len(owner)):
        corners = triangles[owner[k]]
        _place(x, corners, weights[k], p)
        for b in range(len(centres)):
            g = _measure(p, centres[b], axes[b], shape[b], n, H)
            if g >= shape[b, 4]:
                continue
            value, slope, _ = _law(g, shape[b, 3], shape[b, 4])
            energy += share[k] * value
            for c in range(3):
                force = share[k] * slope * n[c]
                total[b, c] += force
                for i in range(3):
                    f[corners[i], c] += weights[k, i] * force
    return energy


@njit(**OPTIONS)
def _pushes(x, triangles, owner, weights, share, centres, axes, shape, push, normal):  # type: ignore[no-untyped-def]
    p, n, H = np.empty(3), np.empty(3), np.empty((3, 3))
    for k in range(len(owner)):
        _place(x, triangles[owner[k]], weights[k], p)
        for b in range(len(centres)):
            g = _measure(p, centres[b], axes[b], shape[b], n, H)
            if g < shape[b, 4]:
                push[k, b] = -share[k] * _law(g, shape[b, 3], shape[b, 4])[1]
                normal[k, b] = n


@njit(**OPTIONS)
def _tangent(  # type: ignore[no-untyped-def]
    x, triangles, owner, weights, share, centres, axes, shape, home, spring, frame_of, frames, slots, data
):
    p, n, H = np.empty(3), np.empty(3), np.empty((3, 3))
    K = np.zeros((9, 9))
    for k in range(len(owner)):
        corners = triangles[owner[k]]
        _place(x, corners, weights[k], p)
        for b in range(len(centres)):
            g = _measure(p, centres[b], axes[b], shape[b], n, H)
            if g >= shape[b, 4]:
                continue
            _, slope, second = _law(g, shape[b, 3], shape[b, 4])
            for i in range(3):
                for j in range(3):
                    w = share[k] * weights[k, i] * weights[k, j]
                    for c in range(3):
                        for e in range(3):
                            K[3 * i + c, 3 * j + e] = w * (second * n[c] * n[e] + slope * H[c, e])
            if len(frames) > 0:
                rotate(K, corners, frame_of, frames)
            add_lower(K, np.int64(9), slots[owner[k]], data)
    for v in range(len(home)):
        if spring[v, 0] + spring[v, 1] + spring[v, 2] > 0.0:
            K[:] = 0.0
            for c in range(3):
                K[3 * home[v, 1] + c, 3 * home[v, 1] + c] = spring[v, c]
            if len(frames) > 0:
                rotate(K, triangles[home[v, 0]], frame_of, frames)
            add_lower(K, np.int64(9), slots[home[v, 0]], data)


@njit(**OPTIONS)
def _force_rates(x, v, triangles, owner, weights, share, centres, velocity, axes, shape, out):  # type: ignore[no-untyped-def]
    p, u, n, H = np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    for k in range(len(owner)):
        corners = triangles[owner[k]]
        _place(x, corners, weights[k], p)
        for b in range(len(centres)):
            g = _measure(p, centres[b], axes[b], shape[b], n, H)
            if g >= shape[b, 4]:
                continue
            _place(v, corners, weights[k], u)
            _, slope, second = _law(g, shape[b, 3], shape[b, 4])
            closing = 0.0
            for c in range(3):
                closing += n[c] * (u[c] - velocity[b, c])
            for c in range(3):
                rate = second * closing * n[c]
                for e in range(3):
                    rate += slope * H[c, e] * (u[e] - velocity[b, e])
                for i in range(3):
                    out[corners[i], c] += share[k] * weights[k, i] * rate
