"""Materials of the sheet: what a stretch and what a curvature of it cost."""

from bh.materials.linear import Constant, LinearElastic
from bh.materials.protocols import Law, Material

__all__ = ["Constant", "Law", "LinearElastic", "Material"]
