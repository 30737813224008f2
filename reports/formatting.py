"""Figures and dates in words, as a printer would set them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from datetime import datetime, timedelta
from typing import Any

from reports.figures import markup, scientific
from reports.records import Check


def number(value: float | None, digits: int = 5, full: bool = False) -> str:
    """A number with so many significant digits; without trailing zeros where it is exact, unless in `full`."""
    if value is None:
        return "\N{EN DASH}"
    if not math.isfinite(value):
        return "not a number" if math.isnan(value) else ("∞" if value > 0 else "\N{MINUS SIGN}∞")
    if value == 0.0:
        return "0"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    short = not full and float(f"{mantissa}e{exponent}") == value
    power = int(exponent)
    if -4 <= power < 6:
        text = f"{value:,.{max(digits - 1 - power, 0)}f}".replace(",", "\u2009")
    else:
        text = mantissa
    if short and "." in text:
        text = text.rstrip("0").rstrip(".")
    text = text.replace("-", "\N{MINUS SIGN}")
    return text if -4 <= power < 6 else scientific(text, power)


def share(value: float | None, check: Check) -> str:
    """An error or tolerance: in percent where it is relative and not tiny, else as a number with the unit."""
    if value is None or not math.isfinite(value):
        return number(value)
    if not check.reference:
        return f"{number(value, 2)}\u00a0{check.unit}".strip()
    return f"{number(100.0 * value, 2)}\u00a0%" if abs(value) >= 1e-5 else number(value, 2)


def seconds(value: float | None) -> str:
    """A time in the unit that suits it."""
    if value is None or not math.isfinite(value):
        return number(value)
    if value < 1.0:
        return f"{number(1e3 * value, 2)}\u00a0ms"
    if value < 90.0:
        return f"{number(value, 2 if value < 10.0 else 3)}\u00a0s"
    return f"{int(value // 60)}\u00a0min\u00a0{int(value % 60)}\u00a0s"


def params(given: dict[str, Any]) -> str:
    """Parameters as small key=value pairs, each kept on one line."""
    return " ".join(
        f'<span class="kv"><i>{markup(str(key))}</i>=\u2060{markup(_plain(value))}</span>'
        for key, value in given.items()
    )


def words(name: str) -> str:
    """A quantity in words: names of variables lose their underscores, indices such as those of k_x keep theirs."""
    return re.sub(r"(?<=[a-z]{2})_(?=[a-z]{2})", " ", name)


def _plain(value: Any) -> str:
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "none"}[value]
    if isinstance(value, int):
        return str(value)  # a count or a seed, which is typed again as it stands
    if isinstance(value, float):
        return number(float(value))
    if isinstance(value, Iterable) and not isinstance(value, str | dict):
        return "(" + ", ".join(_plain(part) for part in value) + ")"
    return str(value)


def date(text: str) -> str:
    """An ISO date as a reader writes it; other text as it is."""
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        return text
    zone = {None: "", timedelta(0): " UTC"}.get(moment.utcoffset(), f" {moment:%z}")
    return f"{moment.day} {moment:%B %Y, %H:%M}{zone}"
