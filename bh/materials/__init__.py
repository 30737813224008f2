"""Materials of the sheet: what a stretch and what a curvature of it cost."""

from bh.materials.linear import Anisotropic, Constant, LinearElastic
from bh.materials.protocols import Directed, Law, Material

__all__ = ["Anisotropic", "Constant", "Directed", "Law", "LinearElastic", "Material"]
