"""Laminates whose stretching and bending are coupled: - e.B.k an area, beside the energies of both.

A triangle's area is shared by the cells of the membrane that it lies in, each with one strain e, and it has one
curvature k. With w the part of a triangle in a cell,

    U = - sum over cells c and their triangles T of w_cT (e_c - e0_c) . B . k_T = gamma . C theta + M0 . theta

with gamma of the bars, theta of the edges of triangles less those at rest, and constant C (b, 3 t) and M0. Strains are
those of the membrane itself, so that with A and D the energy of every place is 1/2 e.A.e - e.B.k + 1/2 k.D.k, which is
positive: no pattern of strains that the membrane does not see can be bent for nothing.

Only the six nodes of a triangle and its neighbours are coupled, and the rotations of its three edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from bh.mechanics.consistent.growth import Growth
from bh.mechanics.consistent.kernels import TURN
from bh.mechanics.consistent.patches import Patches, turned_strains
from bh.mechanics.consistent.stretching import Stretching
from bh.mechanics.shared.assembly import add_blocks
from bh.mechanics.shared.kinematics import dihedral_gradients
from bh.mechanics.shared.sparsity import Slots
from bh.model.ramp import Ramp
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
# bars of a triangle and its neighbours by their ends among its corners 0-2 and the wings 3-5 across its edges 0-2
ENDS = np.array([[1, 2], [2, 0], [0, 1], [1, 3], [2, 3], [2, 4], [0, 4], [0, 5], [1, 5]])


@dataclass(frozen=True, eq=False)
class Coupling:
    """Of one step; t triangles, each a patch of its own with three angles.

    Attributes:
        nodes: (t, 6) corners and wings, -1 where there is none.
        local: (t, 9, 3) C of the bars `ENDS` and the angles of a triangle, N.
        matrix: (b, 3 t) the same for the whole, N; moments (t, 3) M0, N mm.
    """

    nodes: Ints
    local: Array
    matrix: sp.csr_array
    moments: Ramp

    def forces(self, gamma: Array, theta: Array, lam: float) -> tuple[float, Array, Array]:
        """Energy (N mm), bar forces (b,) (N / mm) and moments (t, 3) (N mm).

        Args:
            gamma: (b,) of the bars, mm^2.
            theta: (t, 3) angles less those at rest, rad.
            lam: load parameter of the step, 0 to 1.

        Returns:
            three of them.
        """
        N = np.asarray(self.matrix @ theta.ravel())
        constant = self.moments.at(lam)
        M = np.asarray(self.matrix.T @ gamma).reshape(theta.shape) + constant
        return float(gamma @ N + np.vdot(constant, theta)), N, M

    def rates(self, gamma: Array, theta: Array, controlled: bool) -> tuple[Array, Array]:
        """Rates of the bar forces (b,) and of the moments (t, 3).

        Args:
            gamma: (b,) rates.
            theta: (t, 3) rates.
            controlled: lambda grows at the rate 1.

        Returns:
            both.
        """
        M = np.asarray(self.matrix.T @ gamma).reshape(theta.shape)
        return np.asarray(self.matrix @ theta.ravel()), M + float(controlled) * self.moments.rate

    def tangent(  # noqa: PLR0913
        self,
        x: Array,
        patches: Patches,
        quad: Ints,
        ghost: Array,
        rotation: Ints,
        frame_of: Ints,
        frames: Array,
        slots: Slots,
        data: Array,
    ) -> None:
        """Add what couples bars and angles to `data`.

        Args:
            x: (nodes, 3) positions, mm.
            patches: single triangles.
            quad: (t, 3, 4) nodes of the angles, see `bh.mechanics.consistent.kernels`.
            ghost: (t, 3, 3) beside the last of them at clamps, mm.
            rotation: (t, 3) of the edges.
            frame_of: (nodes,) row of `frames` of each node, -1 where axes are global.
            frames: (k, 3, 3) axes of oblique supports.
            slots: of the triangles.
            data: values of the matrix; added to.
        """
        t = len(self.nodes)
        place = x[self.nodes]
        along = place[:, ENDS[:, 1]] - place[:, ENDS[:, 0]]
        stretch, turn = np.zeros((t, 9, 7, 3)), np.zeros((t, 3, 7, 3))
        bar = np.arange(9)
        stretch[:, bar, ENDS[:, 0]] -= along
        stretch[:, bar, ENDS[:, 1]] += along
        row, k = np.nonzero(patches.kind == TURN)
        nodes = quad[row, k]
        corners = x[nodes]
        corners[:, 3] += ghost[row, k]
        rows = np.arange(4 * len(nodes)).reshape(-1, 4)
        slope = dihedral_gradients(np.ascontiguousarray(corners.reshape(-1, 3)), rows).reshape(-1, 4, 3)
        at = (self.nodes[row][:, None, :] == nodes[:, :, None]).argmax(axis=2)
        for p in range(4):
            np.add.at(turn, (row, k, at[:, p]), slope[:, p])
        has = rotation >= 0
        c, a = np.nonzero(has)
        turn[c, a, 6, a] = np.where(patches.kind[c, a] == TURN, -1.0, 1.0)
        G, W = stretch.reshape(t, 9, 21), turn.reshape(t, 3, 21)
        H = np.swapaxes(G, 1, 2) @ self.local @ W
        H += np.swapaxes(H, 1, 2)
        seven = np.hstack((self.nodes, np.full((t, 1), -1)))
        add_blocks(seven, np.ascontiguousarray(H), frame_of, frames, slots, data)


def sheet_coupling(
    mesh: SheetMesh, B: Array, stretching: Stretching, maps: Array, angle: Array, growth: Growth | None
) -> Coupling:
    """The coupling of a sheet of laminates.

    Args:
        mesh: of the sheet, flat.
        B: (t, 3, 3) of every triangle in the axes of the drawing, N.
        stretching: of the sheet.
        maps: (t, 3, 3) curvatures of triangles from the angles at their edges, in their own frames, 1 / mm.
        angle: (t,) of these frames to the drawing, rad.
        growth: strains at rest, where there are some.
    """
    count, bars = len(maps), len(stretching.membrane.bars)
    curvature = _operator(-angle) @ maps  # in the drawing
    topology = mesh.topology
    beside = topology.edge_triangles[topology.hinge_edges]
    near, nodes = _near(mesh)
    local, moments = np.zeros((count, 9, 3)), np.zeros((2, count, 3))
    rows, columns, values = [], [], []
    for number, cells in enumerate(stretching.membrane.cells):
        strain = _operator(-cells.angle(mesh.points)) @ cells.strain
        sides = cells.source[:, None] if number == 0 else beside[cells.source]
        for triangle, share in zip(sides.T, (cells.share, 1.0 - cells.share), strict=False):
            part = (share * cells.area)[:, None, None]
            work = part * (B[triangle] @ curvature[triangle])  # of a strain in the drawing
            C = -np.swapaxes(strain, 1, 2) @ work
            at = (near[triangle][:, None, :] == cells.bars[:, :, None]).argmax(axis=2)
            np.add.at(local, (triangle[:, None], at), C)
            shape = C.shape
            rows.append(np.broadcast_to(cells.bars[:, :, None], shape).ravel())
            columns.append(np.broadcast_to((3 * triangle[:, None] + np.arange(3))[:, None], shape).ravel())
            values.append(C.ravel())
            if growth is not None:
                ends = (growth.strain[number].start, growth.strain[number].end)
                for k, e0 in enumerate(ends):
                    wanted = turned_strains(e0, -cells.angle(mesh.points), 0.5)
                    np.add.at(moments[k], triangle, np.einsum("ci,cia->ca", wanted, work))
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    matrix = sp.csr_array(sp.coo_array(entries, shape=(bars, 3 * count)))
    return Coupling(nodes, local, matrix, Ramp(moments[0], moments[1]))


def _near(mesh: SheetMesh) -> tuple[Ints, Ints]:
    """(t, 9) bars of a triangle and its neighbours in the order of `ENDS`, and (t, 6) nodes, -1 where there is none."""
    topology = mesh.topology
    edges = topology.triangle_edges
    own = np.arange(len(edges))
    bars = np.full((len(edges), 9), -1, dtype=np.int64)
    bars[:, :3] = edges
    nodes = np.full((len(edges), 6), -1, dtype=np.int64)
    nodes[:, :3] = mesh.triangles
    for k in range(3):
        sides = topology.edge_triangles[edges[:, k]]
        other = np.where(sides[:, 0] == own, sides[:, 1], sides[:, 0])
        there = np.flatnonzero(other >= 0)
        across = other[there]
        at = (edges[across] == edges[there, k][:, None]).argmax(axis=1)
        nodes[there, 3 + k] = mesh.triangles[across, at]
        for j in range(2):
            corner = mesh.triangles[there, (k + 1 + j) % 3]
            # the neighbour's bar from this corner to its wing lies opposite its other corner on the edge
            far = mesh.triangles[there, (k + 2 - j) % 3]
            opposite = (mesh.triangles[across] == far[:, None]).argmax(axis=1)
            bar = edges[across, opposite]
            wing = nodes[there, 3 + k]
            ends = {(1, 0): 3, (2, 0): 4, (2, 1): 5, (0, 1): 6, (0, 2): 7, (1, 2): 8}
            bars[there, ends[(k + 1 + j) % 3, k]] = bar
            assert (
                np.sort(topology.edges[bar], axis=1) == np.sort(np.column_stack((corner, wing)), axis=1)
            ).all()
    return bars, nodes


def _operator(angle: Array) -> Array:
    """(k, 3, 3) that make strains (xx, yy, 2 xy) in axes at angles (k,) to their own."""
    unit = np.eye(3)
    columns = [turned_strains(np.broadcast_to(unit[i], (len(angle), 3)), angle, 0.5) for i in range(3)]
    return np.stack(columns, axis=2)
