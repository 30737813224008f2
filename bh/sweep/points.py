"""The points of a sweep: every combination of some axes, or the rows of a sampled table."""

from __future__ import annotations

import csv
import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import SupportsIndex

import numpy as np

from bh.errors import InputError

Value = float | int | str | bool
# what the data set has of its own; see `bh.sweep.dataset`
OWN = ("outcome", "reason", "wall_time_s", "attempts", "worker", "point")
MOST = 50_000_000  # points; more would not fit into the journal's index in memory


class SweepError(InputError):
    """A sweep that cannot be run or read as it is described."""


@dataclass(frozen=True)
class Points:
    """Named parameters of every point.

    Attributes:
        names: of the parameters.
        values: of each parameter; of a grid the values of its axis, of a table one value a point.
        grid: every combination (the last axis runs fastest), or row by row.

    Raises:
        SweepError: no parameters, names used twice, values that cannot be, or too many points.
    """

    names: tuple[str, ...]
    values: tuple[tuple[Value, ...], ...]
    grid: bool

    def __post_init__(self) -> None:
        """Check names and values."""
        if not self.names or not all(self.values):
            raise SweepError("a sweep needs at least one parameter with at least one value")
        if len(set(self.names)) != len(self.names):
            raise SweepError(f"parameters {', '.join(self.names)}: each name can be used once")
        for name, values in zip(self.names, self.values, strict=True):
            _check(name, values, self.grid)
        if len(self) > MOST:
            raise SweepError(f"{len(self):,} points are more than {MOST:,}; split the sweep")

    @property
    def shape(self) -> tuple[int, ...]:
        """Of a grid the lengths of its axes, of a table (points,)."""
        return tuple(len(v) for v in self.values) if self.grid else (len(self.values[0]),)

    def __len__(self) -> int:
        """Number of points."""
        return math.prod(self.shape)

    def __getitem__(self, index: int) -> dict[str, Value]:
        """The parameters of a point, from 0 in the order of the data set."""
        where: Iterable[SupportsIndex] = (index,) * len(self.names)
        if self.grid:
            where = np.unravel_index(index, self.shape)
        return {n: v[i] for n, v, i in zip(self.names, self.values, where, strict=True)}


def grid(axes: Mapping[str, Sequence[Value | np.generic]]) -> Points:
    """Every combination of the values of some axes; the last axis runs fastest.

    Args:
        axes: values by the name of the parameter; none twice on an axis.

    Raises:
        SweepError: values that cannot be, see `Points`.
    """
    return Points(tuple(axes), tuple(_plain(values) for values in axes.values()), grid=True)


def table(columns: Mapping[str, Sequence[Value | np.generic]]) -> Points:
    """Sampled points: one column a parameter, all of one length.

    Args:
        columns: values by the name of the parameter.

    Raises:
        SweepError: columns of different length, or values that cannot be.
    """
    values = tuple(_plain(column) for column in columns.values())
    lengths = {name: len(column) for name, column in zip(columns, values, strict=True)}
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{name} {count}" for name, count in lengths.items())
        raise SweepError(f"columns of a table differ in length ({listed})")
    return Points(tuple(columns), values, grid=False)


def read_csv(file: str | Path) -> Points:
    """A table from a CSV file; its first row has the names of the parameters.

    Raises:
        SweepError: it cannot be read, or rows differ in length.
    """
    try:
        with Path(file).open(newline="", encoding="utf-8-sig") as stream:
            rows = [row for row in csv.reader(stream) if row]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        why = getattr(error, "strerror", None) or error
        raise SweepError(f"the table '{file}' cannot be read ({why})") from error
    if len(rows) < 2:
        raise SweepError(f"the table '{file}' has no points; give a row of names and a row a point")
    for number, row in enumerate(rows[1:], 2):
        if len(row) != len(rows[0]):
            raise SweepError(
                f"the table '{file}': row {number} has {len(row)} values for {len(rows[0])} names"
            )
    columns = list(itertools.zip_longest(*([_number(cell) for cell in row] for row in rows[1:])))
    return Points(tuple(name.strip() for name in rows[0]), tuple(columns), grid=False)


def _number(cell: str) -> Value:
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            continue
    return cell.strip()


def _plain(values: Sequence[Value | np.generic]) -> tuple[Value, ...]:
    return tuple(value.item() if isinstance(value, np.generic) else value for value in values)


def _check(name: str, values: tuple[Value, ...], once: bool) -> None:
    if not name.strip() or "/" in name or not name.isprintable() or name in OWN:
        raise SweepError(
            f"parameter {name!r} cannot be called so; give a word without / that is none of {', '.join(OWN)}"
        )
    for value in values:
        if not isinstance(value, bool | int | float | str):
            raise SweepError(f"parameter '{name}': {value!r} is no number, word or truth value")
        if isinstance(value, float) and not math.isfinite(value):
            raise SweepError(f"parameter '{name}': {value} cannot be; give finite numbers")
    if len({isinstance(value, str) for value in values}) > 1:
        raise SweepError(f"parameter '{name}' mixes words and numbers; give one kind")
    if once and len(set(values)) < len(values):
        raise SweepError(f"axis '{name}' has a value twice; give each once")
