"""What acts on a sheet from outside with a stiffness of its own: bodies, pressure that follows it, ground springs.

Pressure p on a triangle with corners a, b, c pushes each of them with p N / 6, N = (b - a) x (c - a). Its energy is
minus p times the volume that the straight way of every point from the stress-free sheet sweeps,

    V = 1/6 (u_a + u_b + u_c) . int_0^1 N(X + s u) ds,

the integral of the force along that way, so that it is the potential wherever there is one, whatever the origin.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bh.loading.load_step import LoadStep
from bh.mechanics.shared.assembly import add_blocks
from bh.mechanics.shared.displacements import Displacements
from bh.mechanics.shared.rigid_contact import RigidContact
from bh.mechanics.shared.sparsity import Slots
from bh.model.ramp import Ramp
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
NEXT, AFTER = [1, 2, 0], [2, 0, 1]
SHARES = (
    np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
)  # of the ends of an edge: integrals of products of linear shapes
NOTHING = 1e-9  # part of the largest possible entry of a skew tangent


class Outside:
    """Bodies, pressure and springs of one step on a mesh. Positions x are (n, 3), mm, as the elements see them."""

    def __init__(
        self, mesh: SheetMesh, load_step: LoadStep, start: Array, displacements: Displacements
    ) -> None:
        """What acts from outside.

        Args:
            mesh: the stress-free sheet.
            load_step: of the step.
            start: (n, 3) positions that the step begins with, mm.
            displacements: of the nodes.

        Raises:
            ModelError: a body that the mesh cannot take.
        """
        self.bodies = RigidContact(mesh, load_step.bodies, start) if load_step.bodies else None
        self.triangles, self.displacements = mesh.triangles, displacements
        self.pressure = load_step.pressure
        self.ground = np.zeros_like(mesh.points) if load_step.ground is None else load_step.ground
        self._mesh = mesh
        self._held = sprung_corners(mesh.triangles, self.ground)

    # ------------------------------------------------------------------------------- energy and its derivatives

    def forces(self, x: Array, lam: float, f: Array) -> float:
        """Adds the gradient to f (n, 3), N, and returns the energy, N mm.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
            f: (nodes, 3) N; the gradient is added.
        """
        energy = 0.0 if self.bodies is None else self.bodies.forces(x, lam, f)
        if self.pressure is not None:
            p = self.pressure.at(lam)
            f -= self._pushes(normals(x[self.triangles]), p)
            energy -= float(p @ swept(self.displacements.home[self.triangles], x[self.triangles]))
        f += self.ground * (x - self.displacements.home)
        return energy + self.spring_energy(x)

    def _pushes(self, normal: Array, p: Array) -> Array:
        """(n, 3) of pressures p (t,) on triangles with doubled normals (t, 3), N."""
        each = np.repeat(p[:, None] * normal / 6.0, 3, axis=0)
        rows, count = self.triangles.ravel(), len(self.displacements.home)
        return np.column_stack([np.bincount(rows, part, minlength=count) for part in each.T])

    def spring_energy(self, x: Array) -> float:
        """Energy of the springs to the ground, N mm.

        Args:
            x: (nodes, 3) positions, mm.
        """
        return 0.5 * float(np.vdot(self.ground, (x - self.displacements.home) ** 2))

    def contact_forces(self, x: Array, lam: float) -> dict[str, Array]:
        """(3,) force of every indenter on the sheet, N.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        return {} if self.bodies is None else self.bodies.contact_forces(x, lam)

    def scale(self, load: Array, x: Array, lam: float) -> Array:
        """Dead loads (n, 3) with those of pressure and springs below them, for the size of forces that balance.

        Args:
            load: (nodes, 3) dead forces, N.
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        parts = [load, self.ground * (x - self.displacements.home)]
        if self.pressure is not None:
            parts.append(self._pushes(normals(x[self.triangles]), self.pressure.at(lam)))
        return np.vstack(parts)

    def tangent(self, x: Array, lam: float, frame_of: Ints, frames: Array, slots: Slots, data: Array) -> None:
        """Adds the symmetric part of the tangent; `slots` are those of the triangles.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
            frame_of: (nodes,) row of `frames` of each node, -1 where axes are global.
            frames: (k, 3, 3) axes of oblique supports.
            slots: of the triangles.
            data: values of the matrix, N / mm; added to.
        """
        if self.bodies is not None:
            self.bodies.tangent(x, lam, frame_of, frames, slots, data)
        blocks = self._held.copy()
        if self.pressure is not None:
            blocks += pressure_blocks(x[self.triangles], self.pressure.at(lam))
        add_blocks(self.triangles, blocks, frame_of, frames, slots, data)

    def skew(self, x: Array, lam: float, size: int) -> sp.csr_matrix | None:
        """The skew part of the tangent of all unknowns, (size, size); None where it is nothing.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
            size: number of unknowns, displacements first.
        """
        if self.pressure is None:
            return None
        ends, p = self._rim
        jump = p.at(lam)
        blocks = 0.5 * jump[:, None, None] * cross_matrix(x[ends[:, 1]] - x[ends[:, 0]])
        rows, columns, values = [], [], []
        axes = self._axes
        for i in range(2):
            for j in range(2):
                local = np.einsum(
                    "kab,kbc,kdc->kad", axes[ends[:, i]], SHARES[i, j] * blocks, axes[ends[:, j]]
                )
                row, column = self.displacements.number[ends[:, i]], self.displacements.number[ends[:, j]]
                rows.append(np.repeat(row, 3, axis=1).ravel())
                columns.append(np.tile(column, (1, 3)).ravel())
                values.append(local.ravel())
        row, column, value = (np.concatenate(parts) for parts in (rows, columns, values))
        free = (row >= 0) & (column >= 0)
        found = sp.csr_matrix((value[free], (row[free], column[free])), shape=(size, size))
        return found if self._matters(found, blocks) else None

    @staticmethod
    def _matters(found: sp.csr_matrix, blocks: Array) -> bool:
        largest = float(np.abs(found.data).max()) if found.nnz else 0.0
        return largest > NOTHING * float(np.abs(blocks).max(initial=0.0))

    @cached_property
    def conservative(self) -> bool:
        """Has all of it a potential? Asked at a shape as general as the supports allow."""
        if self.pressure is None:
            return True
        shape = self.displacements
        moved = np.random.default_rng(7).uniform(-0.1, 0.1, len(shape.free)) * self._mesh.size
        return all(
            self.skew(shape.near(moved, lam), lam, len(shape.free)) is None for lam in (0.0, 0.37, 1.0)
        )

    @cached_property
    def _rim(self) -> tuple[Ints, Ramp]:
        """Edges where the pressure is not the same on both sides, counter-clockwise, and by how much it is more."""
        assert self.pressure is not None
        topology = self._mesh.topology
        left = topology.edge_triangles[:, 0]
        corners, low = self.triangles[left], topology.edges[:, 0]
        at = (corners == low[:, None]).argmax(axis=1)
        onward = np.take_along_axis(corners, ((at + 1) % 3)[:, None], axis=1)[:, 0] == topology.edges[:, 1]
        ends = np.where(onward[:, None], topology.edges, topology.edges[:, ::-1])
        jumps = [rim_jump(p, topology.edge_triangles) for p in (self.pressure.start, self.pressure.end)]
        used = (jumps[0] != 0.0) | (jumps[1] != 0.0)
        return ends[used], Ramp(jumps[0][used], jumps[1][used])

    @cached_property
    def _axes(self) -> Array:
        """(n, 3, 3) rows are the axes of the unknowns of every node."""
        c = self.displacements.constraints
        axes = np.broadcast_to(np.eye(3), (len(c.frame_of), 3, 3)).copy()
        turned = c.frame_of >= 0
        axes[turned] = c.frames[c.frame_of[turned]]
        return axes

    # ------------------------------------------------------------------------------- what the driver changes

    def force_rates(self, x: Array, v: Array, lam: float, moving: float, out: Array) -> None:
        """Adds the rate of the gradient for velocities v (n, 3), lambda growing at the rate `moving`.

        Args:
            x: (nodes, 3) positions, mm.
            v: (nodes, 3) velocities.
            lam: load parameter of the step, 0 to 1.
            moving: rate of lambda.
            out: (nodes, 3); the rate is added.
        """
        if self.bodies is not None:
            self.bodies.force_rates(x, v, lam, moving, out)
        out += self.ground * v
        if self.pressure is not None:
            corner, speed = x[self.triangles], v[self.triangles]
            out -= self._pushes(normals(corner), moving * self.pressure.rate)
            out -= self._pushes(normal_rates(corner, speed), self.pressure.at(lam))

    def power(self, x: Array, lam: float) -> float:
        """Rate of energy with lambda at fixed x, N mm.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        total = 0.0 if self.bodies is None else self.bodies.power(x, lam)
        if self.pressure is not None:
            volume = swept(self.displacements.home[self.triangles], x[self.triangles])
            total -= float(self.pressure.rate @ volume)
        return total

    def control_stiffness(self, x: Array, v: Array, lam: float) -> float:
        """Second derivative of the energy by lambda at fixed x, and once by lambda and along v (n, 3), N mm.

        Args:
            x: (nodes, 3) positions, mm.
            v: (nodes, 3) rates of prescribed positions.
            lam: load parameter of the step, 0 to 1.
        """
        mixed = np.zeros_like(x)
        self.force_rates(x, np.zeros_like(x), lam, 1.0, mixed)
        alone = 0.0 if self.bodies is None else self.bodies.control_stiffness(x, lam)
        return alone + float(np.vdot(mixed, v))


def rim_jump(p: Array, edge_triangles: Ints) -> Array:
    """(e,) pressure of the first triangle of every edge less that of the second, N / mm^2.

    Args:
        p: (t,) pressures.
        edge_triangles: (e, 2) triangles of every edge, -1 for none.
    """
    other = np.where(edge_triangles[:, 1] >= 0, p[edge_triangles[:, 1]], 0.0)
    return np.asarray(p[edge_triangles[:, 0]] - other)


def normals(corner: Array) -> Array:
    """(t, 3) normals of triangles (t, 3, 3), as long as twice their areas."""
    return np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])


def normal_rates(corner: Array, speed: Array) -> Array:
    """(t, 3) rates of `normals` for velocities of the corners.

    Args:
        corner: (t, 3, 3) mm.
        speed: (t, 3, 3).
    """
    first, second = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    return np.cross(speed[:, 1] - speed[:, 0], second) + np.cross(first, speed[:, 2] - speed[:, 0])


def swept(home: Array, corner: Array) -> Array:
    """(t,) volumes that triangles sweep on the straight way from `home` (t, 3, 3) to `corner` (t, 3, 3), mm^3.

    Args:
        home: (t, 3, 3) where the way begins, mm.
        corner: (t, 3, 3) where it ends, mm.
    """
    u = corner - home
    mean = normals(home) + 0.5 * normal_rates(home, u) + normals(u) / 3.0
    return np.asarray(np.einsum("tc,tc->t", u.sum(axis=1), mean) / 6.0)


def cross_matrix(v: Array) -> Array:
    """(k, 3, 3) matrices [v] with [v] w = v x w, of vectors (k, 3)."""
    out = np.zeros((len(v), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    return np.asarray(out - out.transpose(0, 2, 1))


def pressure_blocks(corner: Array, p: Array) -> Array:
    """(t, 9, 9) symmetric parts of the tangents of pressure: -p / 12 [e_j - e_i] with e_i the edge opposite i, N / mm.

    Args:
        corner: (t, 3, 3) mm.
        p: (t,) N / mm^2.
    """
    edge = corner[:, AFTER] - corner[:, NEXT]
    out = np.zeros((len(corner), 9, 9))
    for i in range(3):
        for j in range(3):
            if i != j:
                part = -p[:, None, None] / 12.0 * cross_matrix(edge[:, j] - edge[:, i])
                out[:, 3 * i : 3 * i + 3, 3 * j : 3 * j + 3] = part
    return out


def sprung_corners(triangles: Ints, stiffness: Array) -> Array:
    """(t, 9, 9) stiffness of springs (n, 3) at the corner of one triangle of every node, N / mm.

    Args:
        triangles: (t, 3) nodes.
        stiffness: (n, 3) along x, y and z.
    """
    out = np.zeros((len(triangles), 9, 9))
    owner, place = np.zeros(len(stiffness), dtype=np.int64), np.zeros(len(stiffness), dtype=np.int64)
    for k in range(3):
        owner[triangles[:, k]], place[triangles[:, k]] = np.arange(len(triangles)), k
    for axis in range(3):
        out[owner, 3 * place + axis, 3 * place + axis] = stiffness[:, axis]
    return out
