"""What measures the stretching of a sheet: bars, and cells of three or five of them that have one Green strain each.

A bar of the square l^2 measures gamma = (l^2 - L^2) / 2 = d.E d (mm^2) with its stress-free vector d. The bars of a
triangle give its constant Green strain E exactly. A cell is a part of the sheet in which the strain is taken to be
uniform:

- a triangle, by its three bars;
- an edge between two triangles, by five bars: the strain is the mean of theirs by area, both in one frame, the
  neighbour unfolded about the edge (Liu, Nguyen-Thoi and Lam 2009). It stands for a third of either triangle.

The energy of a cell is its area times the law of its strain; where the moduli C are constant it is 1/2 gamma.K.gamma
with K = area S^T C S of the map S from the bars to the strain. mm, N.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bh.mechanics.consistent import membrane_kernels as kernels
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of one kind: c cells of p nodes with k bars.

    Attributes:
        source: (c,) rows of the mesh's triangles (three bars) or hinges (five bars).
        nodes: (c, p) their nodes.
        bars: (c, k) rows of `Membrane.bars`: of a triangle opposite its corners, of a hinge with the nodes
            (wing, edge, edge, wing) = 0..3 those between 1-2, 1-0, 2-0, 1-3, 2-3.
        owned: (c, k) bars whose force this cell takes to the tangent.
        strain: (c, 3, k) map S from gamma (mm^2) to the strain (xx, yy, 2 xy).
        area: (c,) of the stress-free sheet, mm^2.
        share: (c,) part of it that lies in the first triangle of an edge; ones for triangles.
    """

    source: Ints
    nodes: Ints
    bars: Ints
    owned: Bools
    strain: Array
    area: Array
    share: Array

    def angle(self, points: Array) -> Array:
        """(c,) from the drawing's x axis to the cells', along their bar 0, in a sheet flat in z = const, rad.

        Args:
            points: (n, 3) of the stress-free sheet, mm.
        """
        along = points[self.nodes[:, 2]] - points[self.nodes[:, 1]]
        return np.arctan2(along[:, 1], along[:, 0])

    def stiffness(self, moduli: Array) -> Array:
        """(c, k, k) of 1/2 gamma.K.gamma for moduli (3, 3) or (c, 3, 3), N / mm^3."""
        K = np.swapaxes(self.strain, 1, 2) @ (self.area[:, None, None] * moduli) @ self.strain
        return np.asarray(0.5 * (K + np.swapaxes(K, 1, 2)))

    def strains(self, gamma: Array) -> Array:
        """(c, 3) strains of the cells for gamma of all bars."""
        return np.asarray(np.einsum("cik,ck->ci", self.strain, gamma[self.bars]))


@dataclass(frozen=True, eq=False)
class Membrane:
    """What measures the stretching.

    Attributes:
        bars: (b, 2) nodes; rest_square (b,) squares of their stress-free lengths, mm^2.
        triangles, edges: cells with three and with five bars.
    """

    bars: Ints
    rest_square: Array
    triangles: Cells
    edges: Cells

    @property
    def cells(self) -> tuple[Cells, Cells]:
        """Both kinds."""
        return self.triangles, self.edges

    def weighted(self, triangle: Array, hinge: Array) -> Membrane:
        """The part of the cells (0: none) that is left of every triangle (t,) and hinge (m,) of the mesh.

        Args:
            triangle: (t,) part of every triangle, 0 to 1.
            hinge: (m,) part of every hinge, 0 to 1.
        """
        some = [
            _select(cells, weight[cells.source])
            for cells, weight in zip(self.cells, (triangle, hinge), strict=True)
        ]
        used = np.zeros(len(self.bars), dtype=bool)
        for cells in some:
            used[cells.bars] = True
        number = np.cumsum(used) - 1
        three, five = (replace(cells, bars=number[cells.bars]) for cells in some)
        return _owned(Membrane(self.bars[used], self.rest_square[used], three, five))


Measure = Callable[[SheetMesh, Bools], Membrane]


def constant_strain(mesh: SheetMesh, crease: Bools) -> Membrane:
    """Every triangle is a cell (constant-strain triangles: Turner et al. 1956).

    Args:
        mesh: of the sheet.
        crease: (m,) hinges at which the strain may jump; here they make no difference.
    """
    return _membrane(mesh, np.ones(len(mesh.triangles)), np.zeros(len(crease), dtype=bool))


def smoothed_strain(mesh: SheetMesh, crease: Bools) -> Membrane:
    """Every hinge that is not `crease` (m,) is a cell with a third of both triangles.

    What is left of a triangle, a third for each of its edges on a crease or the boundary, keeps the triangle's own
    strain.

    Args:
        mesh: of the sheet.
        crease: (m,) hinges at which the strain may jump.
    """
    topology = mesh.topology
    smooth = np.zeros(len(topology.edges), dtype=bool)
    smooth[topology.hinge_edges[~crease]] = True
    return _membrane(mesh, (~smooth)[topology.triangle_edges].sum(axis=1) / 3.0, ~crease)


def _membrane(mesh: SheetMesh, part: Array, smooth: Bools) -> Membrane:
    """Membrane of triangles that keep a `part` (t,) of their area, and of the `smooth` hinges (m,)."""
    topology = mesh.topology
    ends = mesh.points[topology.edges]
    rest_square = ((ends[:, 1] - ends[:, 0]) ** 2).sum(axis=1)
    kept, hinge = np.flatnonzero(part > 0.0), np.flatnonzero(smooth)
    return _owned(
        Membrane(
            topology.edges, rest_square, _triangle_cells(mesh, kept, part[kept]), _edge_cells(mesh, hinge)
        )
    )


def _triangle_cells(mesh: SheetMesh, rows: Ints, part: Array) -> Cells:
    strain, areas = kernels.triangle_strains(mesh.points, mesh.triangles[rows])
    bars = mesh.topology.triangle_edges[rows]
    return Cells(
        source=rows,
        nodes=np.ascontiguousarray(mesh.triangles[rows]),
        bars=np.ascontiguousarray(bars),
        owned=np.zeros(bars.shape, dtype=bool),
        strain=strain,
        area=part * areas,
        share=np.ones(len(rows)),
    )


def _edge_cells(mesh: SheetMesh, rows: Ints) -> Cells:
    topology = mesh.topology
    nodes = topology.hinges[rows]
    # of the first triangle, which runs along the edge, the edge from the head to the wing comes next; of the other
    # one, which runs against it, that from the tail
    sides = topology.edge_triangles[topology.hinge_edges[rows]]
    around = topology.triangle_edges[sides]
    own = (around == topology.hinge_edges[rows][:, None, None]).argmax(axis=2)
    after, before = (np.take_along_axis(around, (own[..., None] + k) % 3, 2)[..., 0] for k in (1, 2))
    bars = np.column_stack((topology.hinge_edges[rows], before[:, 0], after[:, 0], after[:, 1], before[:, 1]))
    strain, areas = kernels.edge_strains(mesh.points, nodes)
    whole = areas.sum(axis=1)
    return Cells(
        source=rows,
        nodes=np.ascontiguousarray(nodes),
        bars=bars,
        owned=np.zeros(bars.shape, dtype=bool),
        strain=strain,
        area=whole / 3.0,
        share=areas[:, 0] / whole,
    )


def _select(cells: Cells, weight: Array) -> Cells:
    keep = weight > 0.0
    return Cells(
        source=cells.source[keep],
        nodes=cells.nodes[keep],
        bars=cells.bars[keep],
        owned=cells.owned[keep],
        strain=cells.strain[keep],
        area=(weight * cells.area)[keep],
        share=cells.share[keep],
    )


def _owned(membrane: Membrane) -> Membrane:
    """Every bar is owned by one cell."""
    three, five = membrane.cells
    flat = np.concatenate((three.bars.ravel(), five.bars.ravel()))
    last = np.full(len(membrane.bars), -1, dtype=np.int64)
    last[flat] = np.arange(len(flat))
    owned = last[flat] == np.arange(len(flat))
    split = three.bars.size
    return replace(
        membrane,
        triangles=replace(three, owned=owned[:split].reshape(three.bars.shape)),
        edges=replace(five, owned=owned[split:].reshape(five.bars.shape)),
    )
