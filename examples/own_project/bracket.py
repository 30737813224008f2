"""A bracket of card: a sector of an annulus, folded along its crease to 70 degrees. mm, MPa, rad."""

import math

import bh
import meshes

PATTERN = meshes.annulus_sector(radius=80.0, width=12.0, angle=0.6)
CARD = bh.Sheet(E=3000.0, nu=0.3, t=0.25)


def bracket(rows: int, formulation: str = "consistent") -> bh.Model:
    """The folded bracket on `rows` rows of cells in each panel."""
    mesh = meshes.structured(PATTERN, along=4 * rows, rows=rows)
    return bh.Model(mesh, CARD, formulation=formulation).fold("crease", by=math.radians(70.0))
