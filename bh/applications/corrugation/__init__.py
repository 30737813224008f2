"""Corrugations (source Ch. 4): fold one to a depth, lay it down, and say how stiff it is in bending in any direction.

    folded = bh.corrugation.fold("parabolic-edge", depth=6.0)
    bh.corrugation.top_down(folded, azimuth=0.0)                     # mm^4, Eq. 4.6
    test = bh.corrugation.three_point(folded, azimuth=0.0)           # of the bar, from the x axis
    test.stiffness, test.r2                                          # N/mm

Bending "about x" has the bar along x (azimuth 0), "about y" along y (pi/2). mm, N, rad throughout.
"""

from __future__ import annotations

from bh.applications.corrugation.bending import (
    DIRECTIONS,
    BendingTest,
    Rig,
    all_directions,
    three_point,
)
from bh.applications.corrugation.folded import Folded
from bh.applications.corrugation.folding import POLYESTER, fold, laid
from bh.applications.corrugation.sections import bottom_up, section_moments, top_down
from bh.applications.corrugation.tangent import Directional, tangent_bending

__all__ = [
    "DIRECTIONS", "POLYESTER", "BendingTest", "Directional", "Folded", "Rig", "all_directions", "bottom_up", "fold",
    "laid", "section_moments", "tangent_bending", "three_point", "top_down",
]  # fmt: skip
