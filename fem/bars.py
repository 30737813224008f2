"""Rigid bars and cylinders that press on the shell: the potential of `bh.Indenter` at points of its own edges.

With g the distance of a point of the sheet from the rounded rectangle that is the section of a bar (mm, negative
inside), d its gap and k its stiffness (N/mm for every mm of edge of the mesh), the potential a length is

    k (d - g)^3 / (6 d)                   for 0 < g < d
    k (d^2 / 6 - d g / 2 + g^2 / 2)       for g <= 0

What is pressed is the curve of every edge, quadratic where positions are, at evenly spread points. Nothing of it is
shared with the formulations that the shell judges but what a bar is said to be.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bh.model.actuations import Indenter
from meshes.curved import ElementMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
POINTS = {1: 4, 2: 8}  # on an edge, for either degree of positions


@dataclass(frozen=True, eq=False)
class Pressed:
    """Points that one bar presses on.

    Attributes:
        edge: (k,) their edges.
        phi: (k, n) shapes of the nodes of these edges.
        energy: (k,) N mm.
        force: (k, 3) its gradient by the positions of the points, N.
        stiffness: (k, 3, 3) its second derivative, N / mm.
    """

    edge: Ints
    phi: Array
    energy: Array
    force: Array
    stiffness: Array


@dataclass(frozen=True, eq=False)
class BarsOnShell:
    """The bars of one step on a mesh; positions x are (n, 3) of all nodes, mm.

    Attributes:
        mesh: of the shell.
        bars: in the order of the step.
    """

    mesh: ElementMesh
    bars: tuple[Indenter, ...]

    def energy(self, x: Array, lam: float) -> float:
        """Energy of their surfaces, N mm.

        Args:
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        return float(sum(each.energy.sum() for each in self._pressed(x, lam)))

    def gradient(self, x: Array, lam: float) -> Array:
        """(n, 3) its gradient, N: minus what the bars do to the nodes.

        Args:
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        out = np.zeros_like(x)
        for each in self._pressed(x, lam):
            self._spread(each, each.force, out)
        return out

    def forces(self, x: Array, lam: float) -> dict[str, Array]:
        """(3,) force of every bar on the sheet, N, by its name.

        Args:
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        found = zip(self.bars, self._pressed(x, lam), strict=True)
        return {bar.name: 0.0 - each.force.sum(axis=0) for bar, each in found}

    def times(self, x: Array, v: Array, lam: float, moving: float = 0.0) -> Array:
        """(n, 3) rate of the gradient for velocities v (n, 3) of the nodes.

        Args:
            x: (n, 3) positions, mm.
            v: (n, 3) velocities.
            lam: load parameter of the step, 0 to 1.
            moving: rate of lambda, with which the bars move.
        """
        out = np.zeros_like(x)
        for bar, each in zip(self.bars, self._pressed(x, lam), strict=True):
            speed = np.einsum("kn,knc->kc", each.phi, v[self._edges[each.edge]])
            speed = speed - moving * np.asarray(bar.by)
            self._spread(each, np.einsum("kab,kb->ka", each.stiffness, speed), out)
        return out

    def power(self, x: Array, lam: float) -> float:
        """Rate of the energy with lambda at fixed positions, N mm: the work of the bars on the sheet.

        Args:
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        found = zip(self.bars, self._pressed(x, lam), strict=True)
        return float(sum(-each.force.sum(axis=0) @ np.asarray(bar.by) for bar, each in found))

    def second(self, x: Array, lam: float) -> float:
        """Second derivative of the energy by lambda at fixed positions, N mm.

        Args:
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        found = zip(self.bars, self._pressed(x, lam), strict=True)
        return float(
            sum(np.asarray(bar.by) @ each.stiffness.sum(axis=0) @ np.asarray(bar.by) for bar, each in found)
        )

    def add(self, K: Array, x: Array, lam: float) -> None:
        """Adds the second derivative to element matrices K (t, w, w), positions first.

        Args:
            K: added to, N / mm.
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        owner, place = self._owners
        for each in self._pressed(x, lam):
            element, at = owner[each.edge], place[each.edge]
            axes = np.arange(3)
            for i in range(at.shape[1]):
                for j in range(at.shape[1]):
                    rows = (3 * at[:, i, None] + axes)[:, :, None]
                    columns = (3 * at[:, j, None] + axes)[:, None, :]
                    block = (each.phi[:, i] * each.phi[:, j])[:, None, None] * each.stiffness
                    np.add.at(K, (element[:, None, None], rows, columns), block)

    # ------------------------------------------------------------------------------- points

    def _pressed(self, x: Array, lam: float) -> list[Pressed]:
        phi = self._shapes[0]
        points = np.einsum("pn,enc->epc", phi, x[self._edges])
        found = []
        for bar in self.bars:
            away = points - (np.asarray(bar.at) + lam * np.asarray(bar.by))
            g, normal, curved = distance(bar, away.reshape(-1, 3))
            near = np.flatnonzero(g < bar.gap)
            edge, point = np.divmod(near, len(phi))
            value, slope, bend = law(g[near], bar.stiffness, bar.gap)
            n, share = normal[near], self._shapes[1][edge, point]
            second = bend[:, None, None] * n[:, :, None] * n[:, None, :]
            second += slope[:, None, None] * curved[near]
            found.append(
                Pressed(
                    edge,
                    phi[point],
                    share * value,
                    (share * slope)[:, None] * n,
                    share[:, None, None] * second,
                )
            )
        return found

    def _spread(self, pressed: Pressed, forces: Array, out: Array) -> None:
        """Adds forces (k, 3) at points to those of the nodes, out (n, 3)."""
        np.add.at(out, self._edges[pressed.edge], pressed.phi[:, :, None] * forces[:, None])

    @cached_property
    def _edges(self) -> Ints:
        """(e, 2 or 3) nodes of every edge: its ends and its middle."""
        topology = self.mesh.sheet.topology
        if self.mesh.degree == 1:
            return topology.edges
        middle = len(self.mesh.sheet.points) + np.arange(len(topology.edges))
        return np.column_stack((topology.edges, middle))

    @cached_property
    def _shapes(self) -> tuple[Array, Array]:
        """Shapes (p, n) of the nodes of an edge at its points, and the lengths (e, p) that these stand for, mm."""
        count = POINTS[self.mesh.degree]
        s = (np.arange(count) + 0.5) / count
        if self.mesh.degree == 1:
            phi, slope = np.column_stack((1.0 - s, s)), np.tile([-1.0, 1.0], (count, 1))
        else:
            phi = np.column_stack(((1.0 - s) * (1.0 - 2.0 * s), s * (2.0 * s - 1.0), 4.0 * s * (1.0 - s)))
            slope = np.column_stack((4.0 * s - 3.0, 4.0 * s - 1.0, 4.0 - 8.0 * s))
        along = np.einsum("pn,enc->epc", slope, self.mesh.nodes[self._edges])
        return phi, np.linalg.norm(along, axis=2) / count

    @cached_property
    def _owners(self) -> tuple[Ints, Ints]:
        """(e,) a triangle of every edge, and which of its nodes those of the edge are, (e, 2 or 3)."""
        owner = self.mesh.sheet.topology.edge_triangles[:, 0]
        same = self.mesh.triangles[owner][:, None, :] == self._edges[:, :, None]
        return owner, np.argmax(same, axis=2)


def distance(bar: Indenter, away: Array) -> tuple[Array, Array, Array]:
    """How far points are from the surface of a bar.

    Args:
        bar: its section is a rectangle with rounded edges.
        away: (k, 3) of the points from its centre, mm.

    Returns:
        (k,) distances, mm, negative inside; (k, 3) their gradients; (k, 3, 3) their second derivatives, 1 / mm.
    """
    axes = np.array((bar.across, bar.up))
    flat = away @ axes.T
    sign, beyond = np.copysign(1.0, flat), np.abs(flat) - np.asarray(bar.half)
    # a cylinder is round right above and below its axis, too
    round_ = ((beyond > 0.0) | (np.asarray(bar.half) == 0.0)).all(axis=1) & (beyond > 0.0).any(axis=1)
    length = np.where(round_, np.hypot(*beyond.T), 1.0)
    wide = beyond[:, 0] > beyond[:, 1]
    side = np.column_stack((wide, ~wide)).astype(float)
    normal = np.where(round_[:, None], beyond / length[:, None], side) * sign
    g = np.where(round_, length, beyond.max(axis=1)) - bar.radius
    along = np.column_stack((-normal[:, 1], normal[:, 0])) @ axes
    curved = np.where(round_, 1.0 / length, 0.0)[:, None, None] * along[:, :, None] * along[:, None, :]
    return g, normal @ axes, curved


def law(g: Array, k: float, d: float) -> tuple[Array, Array, Array]:
    """Energy a length of the surface of a bar, and its derivatives by the distance.

    Args:
        g: (k,) distances less than d, mm.
        k: stiffness, N/mm a mm.
        d: gap, mm.

    Returns:
        (k,) energy, N mm / mm, its first derivative, N / mm, negative, and its second, N / mm^2.
    """
    left, outside = d - g, g > 0.0
    return (
        np.where(outside, k * left**3 / (6.0 * d), k * (d * d / 6.0 - 0.5 * d * g + 0.5 * g * g)),
        np.where(outside, -k * left * left / (2.0 * d), -k * (0.5 * d - g)),
        np.where(outside, k * left / d, k),
    )
