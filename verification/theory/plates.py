"""Deflections of thin square plates and of Cook's panel; lengths in units of the side, loads of 1.

Square plates: Timoshenko and Woinowsky-Krieger (1959), tables 8 and 35 and articles 30 and 44, with the digits that
their series give; the deflection times D / (q a^4) (uniform load) does not depend on Poisson's ratio.
"""

from __future__ import annotations

import math

CLAMPED_UNIFORM = 0.00126532  # table 35 has 0.00126
COOK = 23.965  # tip deflection of Cook's panel (1974), E = 1, nu = 1/3, as refined solutions give it


def simply_supported_uniform(terms: int = 60) -> float:
    """Navier's series for the centre: 16 / pi^6 sum sin sin / (m n (m^2 + n^2)^2), m and n odd; table 8 has 0.00406."""
    total = 0.0
    for m in range(1, 2 * terms, 2):
        for n in range(1, 2 * terms, 2):
            total += (
                math.sin(0.5 * m * math.pi) * math.sin(0.5 * n * math.pi) / (m * n * (m * m + n * n) ** 2)
            )
    return 16.0 / math.pi**6 * total
