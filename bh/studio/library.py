"""Patterns that a window can begin with."""

from __future__ import annotations

from collections.abc import Mapping

LIBRARY: Mapping[str, str] = {
    "arc": 'kind = "annulus_sector"\nradius = 100.0\nwidth = 25.0\nangle = 1.5708',
    "pleats": 'kind = "annulus_sector"\nradius = [60.0, 75.0, 90.0]\nwidth = 15.0\nangle = 1.2\n'
    'fold = ["mountain", "valley", "mountain"]',
    "strip": 'kind = "strip"\nlength = 120.0\nwidth = 60.0\ncreases = [20.0, 40.0]\nfold = ["mountain", "valley"]',
}
