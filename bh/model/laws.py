"""What a hinge of the mesh can be in a step."""

SHEET, SPRING, HELD = 0, 1, 2  # uncreased, elastic crease, angle imposed exactly
