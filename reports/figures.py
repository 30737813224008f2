"""Plots of a report as inline SVG, their data as CSV, and pictures as data links.

Colours in the SVG are CSS variables of the page (`--ink`, `--soft`, `--rule`, `--s1` ... `--s8`), so that one plot
serves light, dark and paper. The series take Okabe and Ito's colours, and markers and dashes of their own.
"""

from __future__ import annotations

import base64
import csv
import io
import math
import re
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from meshes.errors import InputError
from reports import drawing
from reports.drawing import HEIGHT, WIDTH

MOST_MARKERS = 40  # points of a curve that are all marked
WIDEST = 1600  # of a picture, pixels
FLAT, SAME = 0.005, 1e-12  # of the largest value: rounding is not to look like a trend
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
REFERENCE_DASHES = ("4,3", "1.2,1.8", "8,2.5", "8,2,1.2,2")
DASHES = ("none", "5,1.6", "1.4,1.4", "6,1.6,1.4,1.6", "9,2.5", "3,1.4", "8,1.6,1.4,1.6,1.4,1.6", "2.5,3")


class ReportError(InputError):
    """Stored results that cannot be reported, or a report that cannot be written."""


class Axis(BaseModel):
    """An axis: its label with the unit, and whether it is logarithmic."""

    model_config = ConfigDict(strict=True)

    label: str
    log: bool = False


class Series(BaseModel):
    """A curve: `x` and `y` of equal length, null where there is no value."""

    model_config = ConfigDict(strict=True)

    label: str
    x: list[float | None]
    y: list[float | None]
    style: Literal["line", "points", "reference"] = "line"


class Plot(BaseModel):
    """A plot as data."""

    model_config = ConfigDict(strict=True)

    id: str
    title: str
    kind: Literal["line"] = "line"
    x: Axis
    y: Axis
    series: list[Series]
    caption: str = ""

    def dressed(self) -> list[tuple[int, str, str, Series]]:
        """The series with the number of each one's colour (-1 for references, which are grey), dashes and marker.

        No two are alike: where the colours begin anew, dashes and markers are others.
        """
        found, counts = [], {True: 0, False: 0}
        for series in self.series:
            grey = series.style == "reference"
            dashes = REFERENCE_DASHES if grey else DASHES
            turn, number = divmod(counts[grey], len(dashes))
            counts[grey] += 1
            other = (number + 3 * turn) % len(dashes)
            found.append((-1 if grey else number, dashes[other], MARKERS[other], series))
        return found


def svg(plot: Plot, prefix: str) -> str:
    """The plot as an `<svg>` element to put into a page; every id in it begins with `prefix`.

    Raises:
        ReportError: a series has not as many x as y.
    """
    prefix = re.sub(r"[^\w-]", "-", prefix)  # what a file of results calls a plot is part of it
    dressed = plot.dressed()
    for *_, series in dressed:
        if len(series.x) != len(series.y):
            raise ReportError(
                f"plot '{plot.id}', series '{series.label}': {len(series.x)} x for {len(series.y)} y; give pairs"
            )
    body = drawing.drawn(_scale(plot, "x", SAME), _scale(plot, "y", FLAT), _curves(plot), f"{prefix}c")
    named = ", ".join(series.label for series in plot.series)
    what = typeset(f"{plot.y.label} against {plot.x.label}" + (f": {named}" if named else ""))
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" stroke-linejoin="round" role="img" '
        f'aria-labelledby="{prefix}t {prefix}d"><title id="{prefix}t">{escape(typeset(plot.title))}</title>'
        f'<desc id="{prefix}d">{escape(what)}</desc>{body}</svg>'
    )


def with_prefix(drawn: str, prefix: str) -> str:
    """An `<svg>` of `svg` with `prefix` before every id in it, to stand on a page that shows the plot already."""
    drawn = re.sub(r'( id="|url\(#|href="#)', rf"\1{prefix}", drawn)
    return re.sub(r'(aria-labelledby=")(\S+) (\S+)"', rf'\1{prefix}\2 {prefix}\3"', drawn)


def legend(plot: Plot) -> list[tuple[str, str]]:
    """For every series a small `<svg>` swatch and its label, both HTML."""
    found = []
    for number, dash, marker, series in plot.dressed():
        colour = "var(--soft)" if number < 0 else f"var(--s{number + 1})"
        stroke = (
            f'<path d="M1 7H29" fill="none" stroke="{colour}" stroke-width="2" stroke-dasharray="{dash}"/>'
        )
        mark = "" if number < 0 else f'<path d="{drawing.mark(marker, 15.0, 7.0, 3.2)}" fill="{colour}"/>'
        parts = {"line": stroke + mark, "points": mark, "reference": stroke}[series.style]
        swatch = f'<svg viewBox="0 0 30 14" width="30" height="14" aria-hidden="true">{parts}</svg>'
        found.append((swatch, markup(series.label)))
    return found


def csv_link(rows: Iterable[Sequence[Any]]) -> str:
    """A data link to `rows` as a CSV file."""
    sink = io.StringIO()
    csv.writer(sink, lineterminator="\n").writerows(rows)
    return "data:text/csv;charset=utf-8;base64," + base64.b64encode(sink.getvalue().encode()).decode()


def plot_rows(plot: Plot) -> list[tuple[Any, ...]]:
    """The data behind a plot, one row a point under a row of titles."""
    rows: list[tuple[Any, ...]] = [("series", plot.x.label, plot.y.label)]
    for series in plot.series:
        rows += [(series.label, x, y) for x, y in zip(series.x, series.y, strict=True)]
    return rows


def picture_link(file: Path) -> tuple[str, int, int]:
    """A data link to a picture as WebP, its width and its height, pixels.

    Raises:
        ReportError: there is no such file, or it is not a picture.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(file) as image:
            shown = image.convert("RGB")
    except FileNotFoundError as error:
        raise ReportError(f"picture '{file}' is missing; run `bh verify` again") from error
    except (UnidentifiedImageError, OSError, ValueError) as error:
        raise ReportError(f"picture '{file}' cannot be read; run `bh verify` again") from error
    if shown.width > WIDEST:
        shown = shown.resize((WIDEST, round(shown.height * WIDEST / shown.width)), Image.Resampling.LANCZOS)
    sink = io.BytesIO()
    shown.save(sink, "WEBP", quality=90, method=2)  # a third of the time of method 6 for 4 % more bytes
    return ("data:image/webp;base64," + base64.b64encode(sink.getvalue()).decode(), shown.width, shown.height)


# --- drawing --------------------------------------------------------------------------------------------------


def _curves(plot: Plot) -> list[drawing.Curve]:
    """The series, references beneath the others, of which the first are the widest: each shows beneath the next."""
    dressed = plot.dressed()
    last = max((number for number, *_ in dressed), default=0)
    found = []
    for number, dash, marker, series in sorted(dressed, key=lambda item: item[0] >= 0):
        x, y = _values(series.x, plot.x.log), _values(series.y, plot.y.log)
        if number < 0:
            found.append(drawing.Curve(x, y, "var(--soft)", 1.3, dash))
            continue
        extra = (last - number) / max(last, 1)
        colour = f"var(--s{number + 1})"
        if series.style == "points":
            found.append(drawing.Curve(x, y, colour, 0.0, marker=marker, size=5.0 + 2.0 * extra))
            continue
        # a long curve has a few markers, on other places than its neighbours have theirs
        every = None if len(x) <= MOST_MARKERS else (number * len(x) // 64, max(len(x) // 8, 1))
        size = 4.2 + 2.0 * extra
        found.append(drawing.Curve(x, y, colour, 1.5 + 1.5 * extra, dash, marker, size, every))
    return found


def _values(values: Sequence[float | None], log: bool) -> list[float]:
    """Values to draw, nan where there is nothing to draw."""
    return [math.nan if v is None or (log and v <= 0.0) else float(v) for v in values]


def _scale(plot: Plot, along: Literal["x", "y"], least: float) -> drawing.Scale:
    axis = plot.x if along == "x" else plot.y
    values = [v for s in plot.series for v in _values(getattr(s, along), axis.log) if math.isfinite(v)]
    return drawing.scale(typeset(axis.label), axis.log, values, least, _power)


def _power(value: float) -> str:
    if 0.999e-3 <= value < 1.001e4:
        return f"{value:g}"
    exponent = math.floor(math.log10(value) + 1e-9)
    mantissa = round(value / 10.0**exponent)
    tens = "10" + superscript(exponent)
    return tens if mantissa == 1 else f"{mantissa}·{tens}"


# --- SVG of a page --------------------------------------------------------------------------------------------

_GREEK = {
    "alpha": "\N{GREEK SMALL LETTER ALPHA}",
    "theta": "θ",
    "kappa": "κ",
    "lambda": "λ",
    "nu": "\N{GREEK SMALL LETTER NU}",
    "phi": "φ",
    "psi": "ψ",
    "pi": "π",
    "beta": "β",
    "gamma": "\N{GREEK SMALL LETTER GAMMA}",
    "delta": "δ",
    "eta": "η",
    "mu": "μ",
    "rho": "\N{GREEK SMALL LETTER RHO}",
    "sigma": "\N{GREEK SMALL LETTER SIGMA}",
    "tau": "τ",
    "omega": "ω",
}
_POWER = re.compile(r"(?<![\w.])(-?\d+(?:\.\d+)?)[eE]([+-]?\d+)(?![\w]|\.\d)")
_THOUSANDS = re.compile(r"(?<![\d.,])\d{1,3}(?:,\d{3})+(?![\d,]\d)")
_NEGATIVE = re.compile(r"(?<![\w.)\]%°^])-(?=\d)")
_SUBSCRIPT = re.compile(r"(?<![\w&])([A-Za-z\u03b1-\u03c9])_([A-Za-z0-9]{1,3})(?!\w)")


def typeset(text: str) -> str:
    """Plain text as a printer would set it: Greek letters for their names, numbers as in tables, no bad breaks."""
    text = _POWER.sub(lambda found: scientific(found[1], int(found[2])), text)
    text = _THOUSANDS.sub(lambda found: found[0].replace(",", "\u2009"), text)
    text = _NEGATIVE.sub("\N{MINUS SIGN}", text)
    text = re.sub(rf"(?<![A-Za-z])({'|'.join(_GREEK)})(?![A-Za-z])", lambda found: _GREEK[found[0]], text)
    text = re.sub(r"\^(-?\d+)(?!\d|\.\d)", lambda found: superscript(int(found[1])), text)
    return re.sub(r"(?<=\d) (?=%)| (?== )|(?<= =) ", "\u00a0", text)


def markup(text: str) -> str:
    """`typeset` text as HTML, with subscripts."""
    return _SUBSCRIPT.sub(r"\1<sub>\2</sub>", escape(typeset(text), quote=False))


def superscript(number: int) -> str:
    """A whole number as superscript characters."""
    return str(number).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def scientific(mantissa: str, power: int) -> str:
    """A number times a power of ten."""
    return f"{mantissa}\u2009\N{MULTIPLICATION SIGN}\u200910{superscript(power)}"
