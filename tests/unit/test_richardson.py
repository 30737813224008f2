"""Limits of sequences of meshes."""

from __future__ import annotations

import math

import pytest

from bh.analysis.richardson import limit


@pytest.mark.parametrize("rate", [1.0, 2.0, 4.0])
def test_power_law_is_extrapolated_exactly(rate: float) -> None:
    found = limit([3.0 + 0.1 * 2.0 ** (-rate * k) for k in range(4)])
    assert found.value == pytest.approx(3.0, abs=1e-12)
    assert found.rate == pytest.approx(rate)
    assert found.bar == pytest.approx(0.1 * 2.0 ** (-3 * rate))


def test_no_rate_is_made_up() -> None:
    """Values that swing, drift without settling, or are too few keep the last one."""
    for values, bar in (([1.0, 0.9, 0.905], 0.01), ([1.0, 0.9, 0.81], 0.09), ([1.0, 0.9], 0.1)):
        found = limit(values)
        assert found.value == values[-1]
        assert math.isnan(found.rate)
        assert found.bar == pytest.approx(bar)
    assert limit([2.0]).bar == math.inf
