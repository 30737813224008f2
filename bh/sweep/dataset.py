"""A sweep as a labelled data set (xarray) in one standard format: netCDF-4, written and read through h5netcdf."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.paths.data_sets import loaded
from bh.sweep.points import Points, SweepError
from bh.sweep.task import Finished
from meshes.io.export import replacing

if TYPE_CHECKING:
    from xarray import Dataset

ABOUT_RUN = ("wall_time_s", "attempts", "worker")  # differ from run to run; all else is equal to the last bit
OPEN = "open"  # outcome of a point that is not finished


@dataclass(frozen=True)
class Label:
    """What a variable or parameter is: its unit, a line of text, and names of an array's own dimensions."""

    unit: str = ""
    about: str = ""
    dims: tuple[str, ...] = ()


def dataset(
    points: Points, found: Iterable[Finished], labels: Mapping[str, Label], attributes: Mapping[str, object]
) -> Dataset:
    """The labelled data set of a sweep.

    A grid has its axes as dimensions, a table the dimension "point" with the parameters as coordinates. Numbers of
    points that were not reached are nan, words are empty; `outcome` and `reason` tell why. Arrays of different
    lengths are filled up with nan.

    Args:
        points: of the sweep.
        found: finished points, in any order.
        labels: of parameters and values, by name.
        attributes: of the data set; what is no number or word is written as JSON.

    Raises:
        SweepError: xarray is not installed, or a value has arrays of different ranks at different points.
    """
    xr = _xarray()
    rows = list(found)
    dims = points.names if points.grid else ("point",)
    coords = {
        name: (name if points.grid else "point", np.asarray(values), _attributes(labels.get(name)))
        for name, values in zip(points.names, points.values, strict=True)
    }
    variables: dict[str, tuple[object, ...]] = {}
    names = dict.fromkeys(
        name for row in rows for name in row.values
    )  # in the order in which they were measured
    for name in names:
        label = labels.get(name, Label())
        data = _stack(name, rows, len(points))
        own = label.dims or tuple(f"{name}_{i}" for i in range(data.ndim - 1))
        shape = (*points.shape, *data.shape[1:])
        variables[name] = ((*dims, *own[: data.ndim - 1]), data.reshape(shape), _attributes(label))
    for name, empty in (
        ("outcome", OPEN),
        ("reason", ""),
        ("wall_time_s", np.nan),
        ("attempts", 0),
        ("worker", ""),
    ):
        kind = object if isinstance(empty, str) else type(empty)
        column = np.full(len(points), empty, dtype=kind)
        for row in rows:
            column[row.number] = getattr(row, name)
        variables[name] = (dims, (column.astype(str) if kind is object else column).reshape(points.shape))
    text = {k: v if isinstance(v, str | int | float) else json.dumps(v) for k, v in attributes.items()}
    made: Dataset = xr.Dataset(variables, coords, text)
    return made


def save(data: Dataset, file: Path) -> None:
    """Write a data set; it appears whole or not at all.

    Args:
        data: that is written.
        file: its place.

    Raises:
        SweepError: the place cannot be written to.
    """
    lossless = {
        name: {"zlib": True, "complevel": 4}
        for name, variable in data.data_vars.items()
        if variable.dtype.kind in "fiu" and variable.size > 1000
    }
    try:
        with replacing(file) as draft:
            data.to_netcdf(draft, engine="h5netcdf", encoding=lossless)
    except OSError as error:
        raise SweepError(f"cannot write '{file}' ({error}); choose another output with -o") from error


def load(file: str | Path) -> Dataset:
    """Read a data set whole.

    Raises:
        SweepError: there is none, or it is not netCDF-4.
    """
    _xarray()
    if not Path(file).is_file():
        raise SweepError(f"there is no data set '{file}'; check the name")
    return loaded(Path(file), SweepError)


def _stack(name: str, rows: list[Finished], count: int) -> NDArray[np.float64] | NDArray[np.str_]:
    """(count, ...) values of all points."""
    given = {row.number: row.values[name] for row in rows if name in row.values}
    first = next(iter(given.values()))
    if isinstance(first, str):
        words = np.full(count, "", dtype=object)
        for index, value in given.items():
            words[index] = str(value)
        return words.astype(str)
    arrays = {index: np.asarray(value, dtype=float) for index, value in given.items()}
    ranks = {array.ndim for array in arrays.values()}
    if len(ranks) > 1:
        raise SweepError(
            f"measured '{name}' has {sorted(ranks)} dimensions at different points; give one number of them"
        )
    shapes = np.array([array.shape for array in arrays.values()], dtype=int)
    data: NDArray[np.float64] = np.full((count, *shapes.max(axis=0).tolist()), np.nan)
    for index, array in arrays.items():
        inside: tuple[int | slice, ...] = (index, *(slice(n) for n in array.shape))
        data[inside] = array
    return data


def _attributes(label: Label | None) -> dict[str, str]:
    if label is None:
        return {}
    return {k: v for k, v in (("units", label.unit), ("long_name", label.about)) if v}


def _xarray() -> ModuleType:
    try:
        import h5netcdf  # noqa: F401
        import xarray
    except ImportError as error:
        raise SweepError(
            f"a sweep needs xarray and h5netcdf ({error}); add the extra: pip install 'curved-crease-workbench[sweep]'"
        ) from error
    return xarray
