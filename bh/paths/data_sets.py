"""What a data set of a stranger may hold: counted in its headers before anything of it is read.

A file of a kilobyte can claim arrays of terabytes, all of one value; texts of all points may be one text of a hundred
megabytes; arrays may lie in other files. None of that is in the data sets of this project.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from bh.errors import InputError
from bh.paths.stored import MEGABYTE, check_file
from meshes.limits import check_limit, limits

if TYPE_CHECKING:
    import h5py
    from xarray import Dataset

# what h5py and xarray raise of files that are damaged, or made to be
UNREADABLE = (
    OSError,
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    RuntimeError,  # RecursionError is one
    ArithmeticError,
    MemoryError,
)
OBJECTS = 10_000  # arrays and groups of a file
WORD = 16  # bytes that stand in an array for a text of any length


def check_data_set(file: Path, error: type[InputError]) -> None:
    """Refuse a data set that would take more memory than its limit, or that names other files.

    Args:
        file: netCDF-4.
        error: the kind of error to raise.

    Raises:
        InputError: of the kind `error`.
        ValueError, OSError: it is no data set, or holds what no data set of this project does.
    """
    import h5py

    check_file(file, error)
    with h5py.File(file, "r") as data:
        arrays = _arrays(data, file.stat().st_size)
        size = sum(map(_bytes, arrays))
        check_limit("stored_megabytes", size / MEGABYTE, f"'{file}', unpacked,", error)
        texts = _texts(arrays, file.stat().st_size)
        check_limit("stored_megabytes", (size + texts) / MEGABYTE, f"'{file}', unpacked,", error)


def loaded(file: Path, error: type[InputError]) -> Dataset:
    """A data set, read whole once it is seen that it can be.

    Args:
        file: netCDF-4.
        error: the kind of error to raise.

    Raises:
        InputError: of the kind `error`; one line.
    """
    import xarray

    try:
        check_data_set(file, error)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what xarray finds odd; it is read all the same, or refused
            with xarray.open_dataset(file, engine="h5netcdf") as data:
                found: Dataset = data.load()
    except error:
        raise
    except UNREADABLE as why:
        said = " ".join(str(why).split())[:300]
        raise error(f"'{file}' is no data set that can be read ({said})") from why
    return found


def _arrays(data: h5py.File, stored: int) -> list[h5py.Dataset]:
    """All arrays of a file; raises `ValueError` where one of them, or a name, leads elsewhere."""
    import h5py

    found: list[h5py.Dataset] = []
    groups, seen = [data], {data.id}
    while groups:
        group = groups.pop()
        _check_attributes(group, stored)
        for name in group:
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise ValueError("it names another place")
            item = group[name]
            if item.id in seen:
                continue
            seen.add(item.id)
            if len(seen) > OBJECTS:
                raise ValueError(f"it holds more than {OBJECTS:,} arrays and groups")
            if isinstance(item, h5py.Group):
                groups.append(item)
            elif isinstance(item, h5py.Dataset):
                if item.external or item.is_virtual:
                    raise ValueError("its arrays lie in other files")
                _check_attributes(item, stored)
                found.append(item)
    return found


def _check_attributes(item: h5py.Group | h5py.Dataset, stored: int) -> None:
    """Attributes are small; every one of a list of texts may be as long as the file."""
    if len(item.attrs) > OBJECTS:
        raise ValueError(f"it holds more than {OBJECTS:,} attributes")
    for name in item.attrs:
        kind = item.attrs.get_id(name)
        count = math.prod(kind.shape)
        texts = count * stored if kind.dtype.kind == "O" else 0
        if kind.get_storage_size() > MEGABYTE or texts > limits().stored_megabytes * MEGABYTE:
            raise ValueError(f"its attribute {name[:40]!r} holds too much")


def _bytes(array: h5py.Dataset) -> int:
    """Of an array in memory; a part that is packed alone may be larger than the array."""
    part = math.prod(array.chunks) if array.chunks else 0
    return int(
        max(math.prod(array.shape or ()), part) * max(array.dtype.itemsize, WORD * (array.dtype.kind == "O"))
    )


def _texts(arrays: list[h5py.Dataset], stored: int) -> int:
    """Bytes of all texts of any length; read by as many at a time as cannot be too much."""
    most = limits().stored_megabytes * MEGABYTE
    step = max(1, most // max(stored, 1))
    total = 0
    for array in arrays:
        if array.dtype.kind != "O" or not array.shape:
            continue
        for block in _blocks(array.shape, step):
            total += sum(len(text) for text in array[block].ravel() if isinstance(text, bytes | str))
            if total > most:
                return total
    return total


def _blocks(shape: tuple[int, ...], most: int) -> Iterator[tuple[slice, ...]]:
    """Slices that cut an array of a shape into blocks of at most so many values."""
    row = max(math.prod(shape[1:]), 1)
    if row <= most:
        for first in range(0, shape[0], most // row):
            yield (slice(first, first + most // row),)
        return
    for index in range(shape[0]):
        for rest in _blocks(shape[1:], most):
            yield (slice(index, index + 1), *rest)
