"""Laws of strain and curvature of every place of a sheet: one for all, or those of its zones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.materials import Constant, Directed, Law, Material
from bh.materials.protocols import in_axes
from bh.mechanics.consistent.membrane import Cells
from bh.model.laminate import matrices
from bh.model.sheet import Sheet
from bh.model.zones import Sections
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SheetLaws:
    """Laws in the axes of the drawing; turned into those of cells and triangles when they are asked for.

    Attributes:
        stretching: of the strain, one for each sheet of `Sections`.
        bending: of the curvature, likewise.
        of: (t,) which of them a triangle has; None for one alone.
        coupling: (s, 3, 3) B of the sheets, N; None where nothing couples.
        beside: (m,) the first triangle of every hinge; a cell of an edge has the same zone on both sides.
    """

    stretching: tuple[Law, ...]
    bending: tuple[Law, ...]
    of: Ints | None
    beside: Ints
    coupling: Array | None = None

    def of_cells(self, cells: Cells, points: Array) -> Law:
        """Law of the strain in the axes of every cell.

        Args:
            cells: of one kind.
            points: (n, 3) of the stress-free sheet, mm.
        """
        if self.of is None:
            return in_axes(self.stretching[0], cells.angle(points))
        triangle = cells.source if cells.bars.shape[1] == 3 else self.beside[cells.source]
        return _placed(self.stretching, self.of[triangle], cells.angle(points))

    def of_triangles(self, rows: Ints, angle: Array) -> Law:
        """Law of the curvature in the axes of triangles.

        Args:
            rows: (k,) triangles.
            angle: (k,) of their x axes to the drawing's, rad.
        """
        if self.of is None:
            return in_axes(self.bending[0], angle)
        return _placed(self.bending, self.of[rows], angle)


def sheet_laws(material: Material, sections: Sections, mesh: SheetMesh) -> SheetLaws:
    """The laws that a material has for the sheets of a model.

    Args:
        material: of the formulation.
        sections: what every triangle is made of.
        mesh: of the sheet.

    Raises:
        ModelError: it knows no direction and a sheet has one, or has no constant moduli and there are zones.
    """
    laws = [laws_of(material, sheet) for sheet in sections.sheets]
    if sections.of is not None and not all(isinstance(law, Constant) for pair in laws for law in pair):
        raise ModelError(
            f"zones are those of linear materials; the moduli of {type(material).__name__} change, so leave out zones"
        )
    topology = mesh.topology
    beside = topology.edge_triangles[topology.hinge_edges, 0]
    coupling = _coupling(sections, all(isinstance(law, Constant) for pair in laws for law in pair))
    return SheetLaws(tuple(s for s, _ in laws), tuple(b for _, b in laws), sections.of, beside, coupling)


def laws_of(material: Material, sheet: Sheet) -> tuple[Law, Law]:
    """Laws of strain and curvature; a material that knows no directions would take a grain for nothing.

    Args:
        material: of the formulation.
        sheet: of which they are.

    Returns:
        both laws, in the axes of the drawing.

    Raises:
        ModelError: the sheet has a direction and the material knows none.
    """
    laws = material.stretching(sheet), material.bending(sheet)
    if sheet.directed and not all(isinstance(law, Directed) for law in laws):
        raise ModelError(
            f"the material {type(material).__name__} is alike in all directions; take a sheet without grain, E2 and G12"
        )
    return laws


def _coupling(sections: Sections, constant: bool) -> Array | None:
    """(s, 3, 3) B of the sheets, N, or None."""
    found = [None if sheet.plies is None else matrices(sheet.plies)[1] for sheet in sections.sheets]
    if all(B is None for B in found):
        return None
    if not constant:
        raise ModelError("laminates that couple are those of linear materials; the moduli of this one change")
    return np.array([np.zeros((3, 3)) if B is None else B for B in found])


def _placed(laws: tuple[Law, ...], of: Ints, angle: Array) -> Constant:
    out = np.empty((len(of), 3, 3))
    for number, law in enumerate(laws):
        here = of == number
        turned = in_axes(law, angle[here])
        assert isinstance(turned, Constant)
        out[here] = turned.matrix
    return Constant(out)
