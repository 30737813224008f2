"""What the cases of chapter 4 share: the five corrugations folded to 6 mm, and what the source says of them."""

from __future__ import annotations

import math
from functools import lru_cache

from bh.applications.corrugation.folding import Folded, fold
from meshes.corrugations import KINDS

DEPTH = 6.0  # mm
# k_x / k_y, measured (4.5.2)
RATIOS = {
    "straight": 0.0374,
    "parabolic-point": 0.561,
    "parabolic-edge": 0.934,
    "elliptical-point": 0.580,
    "elliptical-edge": 0.705,
}
ORDER = ("straight", "parabolic-point", "elliptical-point", "elliptical-edge", "parabolic-edge")
POINT, EDGE = ("parabolic-point", "elliptical-point"), ("parabolic-edge", "elliptical-edge")
AZIMUTHS = {"x": 0.0, "xy": 0.25 * math.pi, "y": 0.5 * math.pi}
assert set(ORDER) == set(KINDS)


@lru_cache(maxsize=32)
def folded(kind: str, formulation: str, along: int, rows: int, lstar: float = 25.0) -> Folded:
    """One of the five, folded 6 mm deep and laid down."""
    return fold(kind, DEPTH, along=along, rows=rows, formulation=formulation, Lstar=lstar)


def in_order(ratios: dict[str, float]) -> int:
    """Pairs of patterns, of ten, whose ratios are in the order that the source measured."""
    return sum(ratios[a] < ratios[b] for i, a in enumerate(ORDER) for b in ORDER[i + 1 :])
