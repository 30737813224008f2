"""What acts on the shell from outside with a stiffness of its own: bars, pressure that follows it, ground springs.

A pressure p pushes node i with the integral of p phi_i N, N = x_,1 x x_,2 of the reference triangle. Its energy is
minus the integral of p u . int_0^1 N(X + s u) ds, the work on the straight way from the flat sheet, which is the
potential where there is one. Without one, at free edges, the tangent has the skew part p / 2 int [x_,s] phi_i phi_j ds
of the rim (Schweizerhof and Ramm 1984; `bh.solvers.follower` tells what is done with it). Quadratures are exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine, RefTri

from bh.errors import ModelError
from bh.loading.load_step import LoadStep
from bh.model.actuations import Indenter, Tether
from bh.model.constraints import Constraints
from bh.model.ramp import Ramp
from bh.model.springs import GroundSpring, ground_stiffness
from bh.solvers.factor import Matrix
from bh.solvers.follower import FollowerMatrix
from fem.bars import BarsOnShell
from fem.components import Components
from fem.shell import ShellElements
from fem.spaces import SLOPES, barycentric, gradients, shapes
from meshes.topology import Ints

Array = NDArray[np.float64]
NOTHING = 1e-9  # part of the largest possible entry of a skew tangent


@dataclass(frozen=True, eq=False)
class ShellOutside:
    """Bars, pressure and springs of one step; positions x are (n, 3) of all nodes, mm.

    Attributes:
        elements: of the sheet.
        pressure: (t,) on the triangles, N / mm^2; None where there is none.
        ground: (n, 3) stiffness of springs at all nodes, N / mm.
        tether: (n, 3) stiffness of springs that are at rest where the step begins, N / mm; None without.
        begin: (n, 3) positions there, mm.
        bars: rigid bars that press; None without.
    """

    elements: ShellElements
    pressure: Ramp | None
    ground: Array
    tether: Array | None = None
    begin: Array | None = None
    bars: BarsOnShell | None = None

    @cached_property
    def _stiff(self) -> Array:
        """(n, 3) of all springs, N / mm."""
        return self.ground if self.tether is None else self.ground + self.tether

    def _held(self, x: Array) -> Array:
        """(n, 3) forces that all springs take at positions x (n, 3), N."""
        out = self.ground * (x - self.elements.mesh.nodes)
        if self.tether is None or self.begin is None:
            return out
        return np.asarray(out + self.tether * (x - self.begin))

    def energy(self, x: Array, lam: float) -> float:
        """Energy of all, N mm.

        Args:
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        out = self.spring_energy(x)
        if self.bars is not None:
            out += self.bars.energy(x, lam)
        if self.tether is not None and self.begin is not None:
            out += 0.5 * float(np.vdot(self.tether, (x - self.begin) ** 2))
        return out if self.pressure is None else out - float(self.pressure.at(lam) @ self._swept(x))

    def spring_energy(self, x: Array) -> float:
        """Energy of the springs to the ground, N mm, at positions x (n, 3)."""
        return 0.5 * float(np.vdot(self.ground, (x - self.elements.mesh.nodes) ** 2))

    def gradient(self, x: Array, lam: float) -> Array:
        """(n, 3) forces against all, N: of springs less those of bars and pressure.

        Args:
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        out = self._held(x)
        if self.bars is not None:
            out = out + self.bars.gradient(x, lam)
        return out if self.pressure is None else out - self._pushes(*self._tangents(x), self.pressure.at(lam))

    def push_rate(self, x: Array, lam: float) -> Array:
        """(n, 3) rate of the forces of bars and pressure with lambda at fixed positions, N.

        Args:
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        out = np.zeros_like(x)
        if self.bars is not None:
            out -= self.bars.times(x, out, lam, 1.0)
        if self.pressure is not None:
            out += self._pushes(*self._tangents(x), self.pressure.rate)
        return out

    def power(self, x: Array, lam: float) -> float:
        """Rate of the energy with lambda at fixed positions, N mm.

        Args:
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        total = 0.0 if self.bars is None else self.bars.power(x, lam)
        return total if self.pressure is None else total - float(self.pressure.rate @ self._swept(x))

    def second(self, x: Array, lam: float) -> float:
        """Second derivative of the energy by lambda at fixed positions, N mm.

        Args:
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        return 0.0 if self.bars is None else self.bars.second(x, lam)

    def bar_forces(self, x: Array, lam: float) -> dict[str, Array]:
        """(3,) force of every bar on the sheet, N, by its name.

        Args:
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        return {} if self.bars is None else self.bars.forces(x, lam)

    def times(self, x: Array, v: Array, lam: float) -> Array:
        """(n, 3) rate of the gradient for velocities v (n, 3).

        Args:
            x: (n, 3) positions, mm.
            v: (n, 3) velocities.
            lam: load parameter of the step, 0 to 1.
        """
        out = self._stiff * v
        if self.bars is not None:
            out += self.bars.times(x, v, lam)
        if self.pressure is None:
            return out
        (a, b), (da, db), p = self._tangents(x), self._tangents(v), self.pressure.at(lam)
        return out - self._pushes(da, b, p) - self._pushes(a, db, p)

    def add(self, K: Array, x: Array, lam: float) -> None:
        """Adds the symmetric part of the tangent to element matrices K (t, w, w).

        Args:
            K: positions first.
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        nodes = self.elements.mesh.triangles
        owner, place = self._owners
        for axis in range(3):
            K[owner, 3 * place + axis, 3 * place + axis] += self._stiff[:, axis]
        if self.bars is not None:
            self.bars.add(K, x, lam)
        if self.pressure is None:
            return
        phi, slope, weight = self._rule
        a, b = self._tangents(x)
        cross_a, cross_b = _cross(a), _cross(b)
        # - p int phi_i ([a] phi_j,2 - [b] phi_j,1)
        half = np.einsum("q,qi,qj,tqcd->ticjd", weight, phi, slope[:, :, 1], cross_a, optimize=True)
        half -= np.einsum("q,qi,qj,tqcd->ticjd", weight, phi, slope[:, :, 0], cross_b, optimize=True)
        width = 3 * nodes.shape[1]
        block = -self.pressure.at(lam)[:, None, None] * half.reshape(len(nodes), width, width)
        K[:, :width, :width] += 0.5 * (block + block.transpose(0, 2, 1))

    def skew(self, components: Components, x: Array, lam: float) -> sp.csr_matrix | None:
        """The skew part of the tangent by the unknowns; None where it is nothing.

        Args:
            components: of the step.
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        if self.pressure is None:
            return None
        nodes, jump = self._rim
        phi, slope, weight = self._line
        along = np.einsum("qi,kic->kqc", slope, x[nodes])
        p = 0.5 * jump.at(lam)
        blocks = np.einsum("k,q,qi,qj,kqcd->kijcd", p, weight, phi, phi, _cross(along), optimize=True)
        axes = self._axes(components)
        count, size = nodes.shape[1], len(components.free)
        rows, columns, values = [], [], []
        number = components.number[: components.first_alpha].reshape(-1, 3)
        for i in range(count):
            for j in range(count):
                turned = np.einsum("kab,kbc,kdc->kad", axes[nodes[:, i]], blocks[:, i, j], axes[nodes[:, j]])
                rows.append(np.repeat(number[nodes[:, i]], 3, axis=1).ravel())
                columns.append(np.tile(number[nodes[:, j]], (1, 3)).ravel())
                values.append(turned.ravel())
        row, column, value = (np.concatenate(part) for part in (rows, columns, values))
        free = (row >= 0) & (column >= 0)
        found = sp.csr_matrix((value[free], (row[free], column[free])), shape=(size, size))
        largest = float(np.abs(found.data).max()) if found.nnz else 0.0
        return found if largest > NOTHING * float(np.abs(blocks).max(initial=0.0)) else None

    def followed(self, matrix: Matrix, components: Components, x: Array, lam: float) -> Matrix:
        """A tangent with the skew part beside it, where there is some.

        Args:
            matrix: the symmetric part.
            components: of the step.
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        skew = self.skew(components, x, lam)
        return matrix if skew is None else FollowerMatrix(matrix, skew)

    def conservative(self, components: Components) -> bool:
        """Has the pressure a potential? Asked at a shape as general as the supports allow."""
        if self.pressure is None:
            return True
        size = self.elements.mesh.sheet.size
        q = (
            components.begin[components.free]
            + np.random.default_rng(7).uniform(-0.1, 0.1, len(components.free)) * size
        )
        shape = self.elements.mesh.nodes + components.moves(components.whole(q, 0.37))
        return all(self.skew(components, shape, lam) is None for lam in (0.0, 0.37, 1.0))

    def largest(self, x: Array, lam: float) -> float:
        """Largest force of one node at positions x (n, 3), N, for the size of forces that balance.

        Args:
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        found = float(np.abs(self._held(x)).max())
        if self.pressure is None:
            return found
        return max(found, float(np.abs(self._pushes(*self._tangents(x), self.pressure.at(lam))).max()))

    # ------------------------------------------------------------------------------- integrals

    @cached_property
    def _rule(self) -> tuple[Array, Array, Array]:
        """Shapes (q, n), their slopes (q, n, 2) and weights (q,) inside."""
        points, weights = get_quadrature(RefTri, 4)
        if self.elements.mesh.degree == 2:
            return shapes(points.T), gradients(points.T), weights
        return barycentric(points.T), np.repeat(SLOPES[None], len(weights), axis=0), weights

    @cached_property
    def _line(self) -> tuple[Array, Array, Array]:
        """Shapes (q, k) of the ends and the middle of an edge, their slopes (q, k) and weights (q,)."""
        points, weights = get_quadrature(RefLine, 5)
        s = points[0]
        if self.elements.mesh.degree == 1:
            return np.column_stack((1.0 - s, s)), np.tile([-1.0, 1.0], (len(s), 1)), weights
        shape = np.column_stack(((1.0 - s) * (1.0 - 2.0 * s), s * (2.0 * s - 1.0), 4.0 * s * (1.0 - s)))
        return shape, np.column_stack((4.0 * s - 3.0, 4.0 * s - 1.0, 4.0 - 8.0 * s)), weights

    def _tangents(self, x: Array) -> tuple[Array, Array]:
        """(t, q, 3) derivatives of nodal vectors x (n, 3) along both directions of the reference triangle."""
        found = np.einsum("qid,tic->dtqc", self._rule[1], x[self.elements.mesh.triangles])
        return found[0], found[1]

    def _pushes(self, a: Array, b: Array, p: Array) -> Array:
        """(n, 3) integrals of p phi_i a x b."""
        nodes = self.elements.mesh.triangles
        phi, _, weight = self._rule
        each = np.einsum("t,q,qi,tqc->tic", p, weight, phi, np.cross(a, b), optimize=True).reshape(-1, 3)
        count = len(self.elements.mesh.nodes)
        return np.column_stack([np.bincount(nodes.ravel(), part, minlength=count) for part in each.T])

    def _swept(self, x: Array) -> Array:
        """(t,) volumes that triangles sweep on the straight way from the flat sheet, mm^3."""
        home = self.elements.mesh.nodes
        phi, _, weight = self._rule
        u = x - home
        (A, B), (a, b) = self._tangents(home), self._tangents(u)
        mean = np.cross(A, B) + 0.5 * (np.cross(A, b) + np.cross(a, B)) + np.cross(a, b) / 3.0
        moved = np.einsum("qi,tic->tqc", phi, u[self.elements.mesh.triangles])
        return np.asarray(np.einsum("q,tqc,tqc->t", weight, moved, mean))

    @cached_property
    def _owners(self) -> tuple[Ints, Ints]:
        """(n,) a triangle of every node, and which of its nodes it is."""
        nodes = self.elements.mesh.triangles
        owner, place = np.zeros((2, len(self.elements.mesh.nodes)), dtype=np.int64)
        for k in range(nodes.shape[1]):
            owner[nodes[:, k]], place[nodes[:, k]] = np.arange(len(nodes)), k
        return owner, place

    @cached_property
    def _rim(self) -> tuple[Ints, Ramp]:
        """Nodes (k, 2 or 3) of edges where the pressure changes, counter-clockwise, and by how much it does."""
        assert self.pressure is not None
        mesh = self.elements.mesh
        topology = mesh.sheet.topology
        beside = topology.edge_triangles
        corners, low = mesh.sheet.triangles[beside[:, 0]], topology.edges[:, 0]
        at = (corners == low[:, None]).argmax(axis=1)
        onward = np.take_along_axis(corners, ((at + 1) % 3)[:, None], axis=1)[:, 0] == topology.edges[:, 1]
        ends = np.where(onward[:, None], topology.edges, topology.edges[:, ::-1])
        if mesh.degree == 2:
            ends = np.column_stack((ends, len(mesh.sheet.points) + np.arange(len(ends))))
        jumps = [
            p[beside[:, 0]] - np.where(beside[:, 1] >= 0, p[beside[:, 1]], 0.0)
            for p in (self.pressure.start, self.pressure.end)
        ]
        used = (jumps[0] != 0.0) | (jumps[1] != 0.0)
        return ends[used], Ramp(jumps[0][used], jumps[1][used])

    @staticmethod
    def _axes(components: Components) -> Array:
        """(n, 3, 3) rows are the axes of the unknowns of every node."""
        c = components.constraints
        axes = np.broadcast_to(np.eye(3), (len(c.frame_of), 3, 3)).copy()
        turned = c.frame_of >= 0
        axes[turned] = c.frames[c.frame_of[turned]]
        return axes


def shell_outside(
    elements: ShellElements, load_step: LoadStep, ground: Array | None, constraints: Constraints, begin: Array
) -> ShellOutside | None:
    """What acts from outside in a step; None where nothing does.

    Args:
        elements: of the sheet.
        load_step: of the step.
        ground: (n, 3) stiffness of springs at all nodes, N / mm; None without.
        constraints: of the step.
        begin: (n, 3) positions of all nodes where the step begins, mm.

    Raises:
        ModelError: a pressure on a sheet that nothing holds, or bodies that the shell does not know.
    """
    tethers = [
        GroundSpring(item.at, total=item.total) for item in load_step.bodies if isinstance(item, Tether)
    ]
    bars = tuple(item for item in load_step.bodies if isinstance(item, Indenter))
    if len(tethers) + len(bars) < len(load_step.bodies):
        raise ModelError(
            "the shell knows no moulds and pulls; take formulation consistent or bars-and-hinges"
        )
    if constraints.rigid_body and load_step.pressure is not None:
        raise ModelError("a pressure pushes a sheet that nothing holds as a whole; add supports or springs")
    if load_step.pressure is None and ground is None and not load_step.bodies:
        return None
    mesh = elements.mesh
    ground = np.zeros_like(mesh.nodes) if ground is None else ground
    tether = ground_stiffness(tethers, mesh.linear) if tethers else None
    pressing = BarsOnShell(mesh, bars) if bars else None
    return ShellOutside(elements, load_step.pressure, ground, tether, begin, pressing)


def _cross(v: Array) -> Array:
    """(..., 3, 3) matrices [v] with [v] w = v x w, of vectors (..., 3)."""
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    return np.asarray(out - np.swapaxes(out, -1, -2))
