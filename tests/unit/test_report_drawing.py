"""Plots of the report: round numbers on their axes, and curves that lie where their values are."""

from __future__ import annotations

import math
import re

import pytest

from reports.drawing import Curve, Scale, drawn, scale
from reports.figures import Plot, legend


def axis(*values: float, log: bool = False) -> Scale:
    return scale("x", log, values, 0.0, lambda value: f"{value:g}")


@pytest.mark.parametrize(
    ("values", "log", "numbers"),
    [
        ((0.0, 30.0), False, ["0", "5", "10", "15", "20", "25", "30"]),
        ((-1.0, 1.0), False, ["−1.0", "−0.5", "0.0", "0.5", "1.0"]),  # noqa: RUF001
        ((0.0505, 0.0535), False, ["0.0505", "0.0510", "0.0515", "0.0520", "0.0525", "0.0530", "0.0535"]),
        ((0.0, 3e-7), False, ["0", *(f"{0.5 * k:.1f}·10⁻⁷" for k in range(1, 7))]),
        ((1e-5, 3e-5), False, ["1.0·10⁻⁵", "1.5·10⁻⁵", "2.0·10⁻⁵", "2.5·10⁻⁵", "3.0·10⁻⁵"]),
        ((-3e8, 4e8), False, ["−2·10⁸", "0", "2·10⁸", "4·10⁸"]),  # noqa: RUF001
        ((1.0, 1.0), False, ["0.996", "0.998", "1.000", "1.002", "1.004"]),
        ((5.0, 5.0), True, ["4.98", "4.99", "5.00", "5.01", "5.02"]),
        ((0.0, 0.0), False, ["−1.0", "−0.5", "0.0", "0.5", "1.0"]),  # noqa: RUF001
        ((1.0, 100.0), True, ["1", "2", "5", "10", "20", "50", "100"]),
        ((1e-6, 1e6), True, ["1e-06", "0.0001", "0.01", "1", "100", "10000", "1e+06"]),
        ((20.0, 30.0), True, ["20", "22", "24", "26", "28", "30"]),
    ],
)
def test_numbers_are_round_and_few(values: tuple[float, float], log: bool, numbers: list[str]) -> None:
    assert axis(*values, log=log).numbers == numbers


@pytest.mark.parametrize("log", [False, True])
def test_values_lie_inside_with_room_beside_them(log: bool) -> None:
    made = axis(3.0, 7.0, 11.0, log=log)
    assert made.part(made.low) == 0.0
    assert made.part(made.high) == pytest.approx(1.0)
    assert made.part(3.0) == pytest.approx(0.05 / 1.1)
    assert made.part(11.0) == pytest.approx(1.05 / 1.1)
    assert math.isnan(axis(1.0, 10.0, log=True).part(0.0))


def test_rounding_looks_like_no_trend() -> None:
    flat = scale("y", False, [1.0, 1.0 + 1e-13], 0.005, str)
    assert (flat.low, flat.high) == pytest.approx((0.995, 1.005))


def test_a_curve_goes_through_its_points_and_leaves_gaps() -> None:
    x, y = axis(0.0, 4.0), axis(0.0, 1.0)
    values = [0.0, 1.0, 0.5, math.nan, 1.0]
    curve = Curve([0.0, 1.0, 2.0, 3.0, 4.0], values, "red", 1.0, "4,2", "s", 2.0)
    text = drawn(x, y, [curve], "frame")
    frame = re.search(r'<rect x="([\d.]+)" y="([\d.]+)" width="([\d.]+)" height="([\d.]+)"/>', text)
    line = re.search(
        r'<path d="([^"]*)" fill="none" stroke="red" stroke-width="1" stroke-dasharray="4 2"/>', text
    )
    marks = re.search(r'<path d="([^"]*)" fill="red"/>', text)
    assert frame
    assert line
    assert marks
    left, top, width, height = (float(word) for word in frame.groups())
    assert re.findall("[ML]", line[1]) == ["M", "L", "L", "M"]  # a gap where there is no value
    points = [tuple(map(float, word.split())) for word in re.split("[ML]", line[1])[1:]]
    known = [(a, b) for a, b in zip(curve.x, values, strict=True) if math.isfinite(b)]
    for (a, b), (at_x, at_y) in zip(known, points, strict=True):
        assert at_x == pytest.approx(left + width * x.part(a), abs=0.02)
        assert at_y == pytest.approx(top + height * (1.0 - y.part(b)), abs=0.02)
    assert marks[1].count("z") == len(known)


def test_long_curves_have_few_markers() -> None:
    at = [float(k) for k in range(100)]
    text = drawn(
        axis(0.0, 99.0), axis(0.0, 99.0), [Curve(at, at, "red", 1.0, "none", "o", 4.0, (3, 12))], "f"
    )
    assert text.count("a2 2 0 1 0 4 0") == 9


def test_no_two_curves_of_a_plot_look_alike() -> None:
    """Ten kinds of sheets are more than there are colours."""
    series = [{"label": str(k), "x": [1.0, 2.0], "y": [1.0 + k, 2.0 + k]} for k in range(16)]
    axes = {"x": {"label": "x"}, "y": {"label": "y"}}
    swatches = [
        swatch
        for swatch, _ in legend(Plot.model_validate({"id": "p", "title": "t", "series": series, **axes}))
    ]
    assert len(set(swatches)) == 16
