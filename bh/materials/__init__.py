"""Materials of the sheet: a table of real ones, and what a stretch and what a curvature of them cost."""

from bh.materials.linear import Anisotropic, Constant, LinearElastic
from bh.materials.protocols import Directed, Law, Material
from bh.materials.table import MATERIALS, Stock, material, sheet

__all__ = [
    "MATERIALS",
    "Anisotropic",
    "Constant",
    "Directed",
    "Law",
    "LinearElastic",
    "Material",
    "Stock",
    "material",
    "sheet",
]
