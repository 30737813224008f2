"""What a hinge of the mesh can be in a step; kept in integer arrays, one entry a hinge."""

from typing import Final

SHEET: Final = 0  # uncreased
SPRING: Final = 1  # elastic crease
PRESCRIBED: Final = 2  # angle imposed exactly
