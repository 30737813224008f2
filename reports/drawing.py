"""A plot drawn as the inside of an `<svg>`: two axes with round numbers, curves with dashes and markers.

Written out here, since a plotting library takes a tenth of a second a plot, and a report has more than two hundred.
All is in CSS pixels of the plot's box; colours are CSS variables of the page, which sets its own font.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise

WIDTH, HEIGHT = 420, 300  # of a plot, where it is not scaled
LABEL, TICK, EDGE = 12.0, 11.0, 4.0  # font of labels and of numbers, and the least room at an edge
ROOM = 0.05  # of the range of values, beside them
SINGLE = 0.005  # of a value that is the only one: what is shown on either side of it
MOST_TICKS = 7
ROUND_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
WIDE, MANY_DECADES = 6.0, 8.0  # of a logarithmic axis: its range from which its numbers are powers; decades
PLAIN = (1e-4, 1e7)  # numbers that are written without a power of ten
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_NARROW = dict.fromkeys("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", 0.42) | dict.fromkeys(".,·", 0.4)  # widths in em; digits have 0.64
_SUBSCRIPT = re.compile(r"(?<![\w&])([A-Za-z\u03b1-\u03c9])_([A-Za-z0-9]{1,3})(?!\w)")
_STAR = [
    (
        math.sin(k * math.pi / 5) * (1.0 if k % 2 == 0 else 0.4),
        -math.cos(k * math.pi / 5) * (1.0 if k % 2 == 0 else 0.4),
    )
    for k in range(10)
]
_CORNERS: dict[str, list[tuple[float, float]]] = {  # of a marker, in halves of its size
    "s": [(-1, -1), (1, -1), (1, 1), (-1, 1)],
    "^": [(0, -1), (1, 1), (-1, 1)],
    "D": [(0, -1.4), (1.4, 0), (0, 1.4), (-1.4, 0)],
    "v": [(0, 1), (1, -1), (-1, -1)],
    "P": [(-0.33, -1), (0.33, -1), (0.33, -0.33), (1, -0.33), (1, 0.33), (0.33, 0.33), (0.33, 1), (-0.33, 1),
          (-0.33, 0.33), (-1, 0.33), (-1, -0.33), (-0.33, -0.33)],
    "X": [(-0.5, -1), (0, -0.5), (0.5, -1), (1, -0.5), (0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5), (-0.5, 1), (-1, 0.5),
          (-0.5, 0), (-1, -0.5)],
    "*": _STAR,
}  # fmt: skip


@dataclass(frozen=True)
class Curve:
    """Points in the order in which they are joined; values that are not finite leave a gap.

    Attributes:
        x, y: values.
        colour: a CSS colour.
        width: of the line, 0 for points alone.
        dashes: of the line, in widths of it, as in SVG; "none" for a whole line.
        marker: a letter of `_CORNERS`, "o" for discs, "" for none.
        size: of a marker.
        marked: first point that is marked, and from which to which next; None for all.
    """

    x: Sequence[float]
    y: Sequence[float]
    colour: str
    width: float
    dashes: str = "none"
    marker: str = ""
    size: float = 0.0
    marked: tuple[int, int] | None = None


@dataclass(frozen=True)
class Scale:
    """An axis: its title, the values at its ends, and its numbers.

    Attributes:
        title: as it is shown.
        log: equal lengths are equal ratios.
        low, high: values at the ends.
        ticks: values with a number each.
        numbers: those, as they are shown.
        between: small ticks without one.
    """

    title: str
    log: bool
    low: float
    high: float
    ticks: list[float]
    numbers: list[str]
    between: list[float]

    def part(self, value: float) -> float:
        """Where a value lies, 0 at the low end and 1 at the high one; nan for what has no place."""
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low) if value > 0.0 else math.nan
        return (value - self.low) / (self.high - self.low)


def scale(
    title: str, log: bool, values: Sequence[float], least: float, power: Callable[[float], str]
) -> Scale:
    """The axis of some values.

    Args:
        title: as it is shown.
        log: whether it is logarithmic; `values` are then positive.
        values: finite ones.
        least: range that it has at least, as a part of the largest value; less is rounding.
        power: how a number of a logarithmic axis is written.
    """
    low, high = (min(values), max(values)) if values else ((1.0, 10.0) if log else (0.0, 1.0))
    size = max(abs(low), abs(high))
    if high - low <= least * size:
        half = max(least, SINGLE) * size or 1.0
        low, high = 0.5 * (low + high) - half, 0.5 * (low + high) + half
    elif log:
        wide, room = high > WIDE * low, (high / low) ** ROOM
        low, high = low / room, high * room
        if wide:
            ticks = _powers(low, high)
            return Scale(title, True, low, high, ticks, [power(at) for at in ticks], _between(low, high))
    else:
        low, high = low - ROOM * (high - low), high + ROOM * (high - low)
    ticks = _steps(low, high)
    return Scale(title, log, low, high, ticks, _written(ticks), [])


def _steps(low: float, high: float) -> list[float]:
    """Multiples of a round number between both."""
    least = (high - low) / MOST_TICKS
    tens = 10.0 ** math.floor(math.log10(least))
    step = next(tens * part for part in ROUND_STEPS if tens * part >= least * (1.0 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [number * step for number in range(first, last + 1)]


def _written(ticks: Sequence[float]) -> list[str]:
    """The ticks with as many digits as tell them apart, a true minus, and one power of ten where they need one."""
    most = max(map(abs, ticks), default=0.0)
    power = math.floor(math.log10(most)) if most and not PLAIN[0] <= most < PLAIN[1] else 0
    parts = [at / 10.0**power for at in ticks]
    step = min((b - a for a, b in pairwise(parts)), default=max(map(abs, parts), default=0.0) or 1.0)
    digits = next(
        n for n in range(17) if n == 16 or all(abs(at - round(at, n)) < 1e-6 * step for at in parts)
    )
    times = f"·10{str(power).translate(RAISED)}" if power else ""
    return [
        "0" if power and at == 0.0 else f"{at + 0.0:.{digits}f}".replace("-", "\N{MINUS SIGN}") + times
        for at in (round(at, digits) for at in parts)
    ]


def _powers(low: float, high: float) -> list[float]:
    """Powers of ten between both, with 2 and 5 times of each where they are few and not each where they are many."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    parts = (1.0, 2.0, 5.0) if high < 250.0 * low else (1.0,)
    every = max(1, math.ceil((last - first) / MANY_DECADES))
    found = [part * 10.0**n for n in range(first, last + 1) if n % every == 0 for part in parts]
    return [at for at in found if low * (1.0 - 1e-9) <= at <= high * (1.0 + 1e-9)]


def _between(low: float, high: float) -> list[float]:
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    if last - first > MANY_DECADES:
        return []
    found = [part * 10.0**n for n in range(first, last + 1) for part in range(2, 10)]
    return [at for at in found if low <= at <= high]


def drawn(x: Scale, y: Scale, curves: Sequence[Curve], name: str) -> str:
    """Axes and curves.

    Args:
        x: the horizontal axis.
        y: the vertical one.
        curves: the later ones lie above.
        name: id of the frame beyond which nothing of a curve is shown.
    """
    title = 1.2 * LABEL + EDGE
    left = EDGE + title + max((_width(number) for number in y.numbers), default=0.0) + 6.5
    right = WIDTH - max(EDGE, 0.5 * _width(x.numbers[-1]) if x.numbers else 0.0)
    bottom, top = HEIGHT - (EDGE + title + 1.2 * TICK + 6.5), EDGE + 0.6 * TICK

    def across(value: float) -> float:
        return left + (right - left) * x.part(value)

    def up(value: float) -> float:
        return bottom - (bottom - top) * y.part(value)

    at_x, at_y = [across(v) for v in x.ticks], [up(v) for v in y.ticks]
    rule = "".join(f"M{_n(a)} {_n(bottom)}V{_n(top)}" for a in at_x)
    rule += "".join(f"M{_n(left)} {_n(a)}H{_n(right)}" for a in at_y)
    ticks = f"M{_n(left)} {_n(top)}V{_n(bottom)}H{_n(right)}"
    ticks += "".join(f"M{_n(a)} {_n(bottom)}v3" for a in at_x) + "".join(
        f"M{_n(left)} {_n(a)}h-3" for a in at_y
    )
    ticks += "".join(f"M{_n(across(v))} {_n(bottom)}v2" for v in x.between)
    ticks += "".join(f"M{_n(left)} {_n(up(v))}h-2" for v in y.between)
    frame = f'x="{_n(left)}" y="{_n(top)}" width="{_n(right - left)}" height="{_n(bottom - top)}"'
    under = _n(bottom + 6.5 + 0.85 * TICK)
    middle = _n(0.5 * (top + bottom))
    return (
        f'<clipPath id="{name}"><rect {frame}/></clipPath>'
        f'<path d="{rule}" fill="none" stroke="var(--rule)" stroke-width=".7"/>'
        f'<path d="{ticks}" fill="none" stroke="var(--soft)" stroke-width=".8"/>'
        f'<g clip-path="url(#{name})">{"".join(_curve(c, across, up) for c in curves)}</g>'
        f'<g fill="var(--ink)" font-family="var(--sans)" font-size="{TICK:g}">'
        f'<g text-anchor="middle">{"".join(_text(n, a, under) for n, a in zip(x.numbers, at_x, strict=True))}</g>'
        '<g text-anchor="end">'
        + "".join(_text(n, left - 6.5, _n(a + 0.36 * TICK)) for n, a in zip(y.numbers, at_y, strict=True))
        + f'</g><g text-anchor="middle" font-size="{LABEL:g}">'
        f"{_text(x.title, 0.5 * (left + right), _n(HEIGHT - EDGE - 0.25 * LABEL))}"
        f'<text transform="translate({_n(EDGE + LABEL)} {middle}) rotate(-90)">{_lowered(y.title)}</text></g></g>'
    )


def _curve(curve: Curve, across: Callable[[float], float], up: Callable[[float], float]) -> str:
    places = [(across(a), up(b)) for a, b in zip(curve.x, curve.y, strict=True)]
    text = ""
    if curve.width:
        line, pen = "", "M"
        for a, b in places:
            seen = math.isfinite(a) and math.isfinite(b)
            line += f"{pen}{_n(a)} {_n(b)}" if seen else ""
            pen = "L" if seen else "M"
        gaps = curve.dashes != "none"
        widths = [_n(float(part) * curve.width) for part in curve.dashes.split(",")] if gaps else []
        dashes = f' stroke-dasharray="{" ".join(widths)}"' if gaps else ""
        text = (
            f'<path d="{line}" fill="none" stroke="{curve.colour}" stroke-width="{_n(curve.width)}"{dashes}/>'
        )
    if curve.marker:
        first, every = curve.marked or (0, 1)
        marks = "".join(
            mark(curve.marker, a, b, 0.5 * curve.size)
            for a, b in places[first::every]
            if math.isfinite(a) and math.isfinite(b)
        )
        text += f'<path d="{marks}" fill="{curve.colour}"/>'
    return text


def mark(marker: str, a: float, b: float, r: float) -> str:
    """What the path of a marker is drawn by.

    Args:
        marker: a letter, as of `Curve`.
        a: where its middle is across, pixels.
        b: the same down.
        r: half of its size, pixels.

    Returns:
        the `d` of a `<path>`.
    """
    if marker == "o":
        return (
            f"M{_n(a - r)} {_n(b)}a{_n(r)} {_n(r)} 0 1 0 {_n(2 * r)} 0a{_n(r)} {_n(r)} 0 1 0 {_n(-2 * r)} 0z"
        )
    return "M" + "L".join(f"{_n(a + r * dx)} {_n(b + r * dy)}" for dx, dy in _CORNERS[marker]) + "z"


def _n(value: float) -> str:
    """A length to a hundredth of a pixel."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _width(number: str) -> float:
    return TICK * sum(_NARROW.get(letter, 0.64) for letter in number)


def _text(text: str, x: float, y: str) -> str:
    return f'<text x="{_n(x)}" y="{y}">{_lowered(text)}</text>'


def _lowered(text: str) -> str:
    """Text as SVG, with subscripts."""
    low = r'\1<tspan dy=".3em" font-size="75%">\2</tspan><tspan dy="-.225em">&#8203;</tspan>'
    return _SUBSCRIPT.sub(low, escape(text))
