"""Figures that documentation prints, and the records that they are of.

A figure of a record is a link to it whose title says which:

    [0.88 mm](../verification/records/problem_c.json "largest distance by the surrogate")
    [0.030 %](../verification/records/honesty.json "relative error | scene=1 | read params.estimate | times 100")

The title is a quantity and then, between bars, parameters of the record (`key=value`), what is read from it (`read
error`; the value unless said), a factor (`times 100`), what is added behind it (`plus 1`), and of several records
`largest`, `least`, `median` or `number`. A point of a plot of the record is one more record: its quantity is the plot's
id, its parameters are `series` (as in the legend) and `point` (from 1), its value is y, and `read x` is x:

    [0.54 %](../verification/records/speed_error.json "speed-error-a-energy-time | series=shell, mirrored | point=3")

In a table a bar ends the cell, in titles too: there it is written with a backslash before it.
The figure has to be the record's, rounded to the digits that are printed.
"""

from __future__ import annotations

import json
import re
import statistics
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from meshes.errors import InputError

LINK = re.compile(r'\[([^\]]+)\]\(([^)\s]*verification/records/[\w.-]+\.json)\s+"([^"]+)"\)')
NUMBER = re.compile(r"[-+\u2212]?(?:\d{1,3}(?:,\d{3})+|\d+)(?:\.\d+)?(?:e[-+]?\d+)?")
OF_SEVERAL: dict[str, Callable[[Sequence[float]], float]] = {
    "largest": max,
    "least": min,
    "median": statistics.median,
    "number": len,
}


@dataclass(frozen=True)
class Printed:
    """A figure on a page: the words of its link, the file that it leads to, and what its title says."""

    page: Path
    line: int
    words: str
    link: str
    title: str

    @property
    def file(self) -> Path:
        """Of the records, from the page."""
        return (self.page.parent / self.link).resolve()

    def wrong(self) -> str:
        """Why the figure is not the record's, in a line; empty where it is."""
        place = f"{self.page.name}:{self.line}: [{self.words}]"
        try:
            value = self.value()
        except InputError as error:
            return f"{place}: {error}"
        found = NUMBER.search(self.words)
        if found is None:
            return f"{place} has no number"
        text = found[0].replace("\u2212", "-").replace(",", "")
        if abs(float(text) - value) <= 0.5000001 * _last_digit(text):
            return ""
        return f"{place}: the record says {value:.6g}; print that, or run the case again"

    def value(self) -> float:
        """What the record says.

        Raises:
            InputError: there is no such record, several of them, or nothing that can be read from it.
        """
        try:
            records = _records(self.file, self.title.partition(" | ")[0])
        except (OSError, ValueError, KeyError) as error:
            raise InputError(f"there are no records in '{self.link}'") from error
        _, *parts = (part.strip() for part in self.title.split(" | "))
        read, factor, more, several = "value", 1.0, 0.0, ""
        for part in parts:
            word, _, rest = part.partition(" ")
            if part in OF_SEVERAL:
                several = part
            elif word == "read":
                read = rest
            elif word == "times":
                factor = float(rest)
            elif word == "plus":
                more = float(rest)
            elif "=" not in part:
                raise InputError(f"'{part}' says neither a parameter nor what to read")
        wanted = dict(part.split("=", 1) for part in parts if "=" in part)
        mine = [record for record in records if _has(record["params"], wanted)]
        values = [_read(record, read) for record in mine]
        if not values or (len(values) > 1 and not several):
            raise InputError(f"{len(values) or 'no'} records of '{self.title}' in '{self.link}'")
        return factor * (OF_SEVERAL[several](values) if several else values[0]) + more


def printed(page: Path) -> Iterator[Printed]:
    """The figures of a page that lead to records, from above."""
    text = page.read_text(encoding="utf-8")
    for found in LINK.finditer(text):
        words, link, title = found.groups()
        yield Printed(page, text.count("\n", 0, found.start()) + 1, words, link, title.replace("\\|", "|"))


@cache
def _records(file: Path, quantity: str) -> list[dict[str, Any]]:
    """Records of a quantity, or the points of the plot that has it as its id."""
    data = json.loads(file.read_text(encoding="utf-8"))
    points = [
        {"quantity": quantity, "params": {"series": series["label"], "point": k + 1}, "value": y, "x": x}
        for case in data.get("cases", [])
        for plot in case["plots"]
        if plot["id"] == quantity
        for series in plot["series"]
        for k, (x, y) in enumerate(zip(series["x"], series["y"], strict=True))
    ]
    return points or [record for record in data["checks"] if record["quantity"] == quantity]


def _has(params: dict[str, Any], wanted: dict[str, str]) -> bool:
    return all(key in params and _same(params[key], value) for key, value in wanted.items())


def _same(value: Any, text: str) -> bool:
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            return float(text) == float(value)
        except ValueError:
            return False
    return str(value) == text


def _read(record: dict[str, Any], name: str) -> float:
    found: Any = record
    for part in name.split(".", 1):
        found = found.get(part) if isinstance(found, dict) else None
    if isinstance(found, bool) or not isinstance(found, int | float):
        raise InputError(f"'{name}' of '{record['quantity']}' is no number")
    return float(found)


def _last_digit(text: str) -> float:
    """What one step of the last printed digit is worth."""
    mantissa, _, power = text.partition("e")
    decimals = len(mantissa.partition(".")[2])
    return float(10.0 ** (int(power or 0) - decimals))
