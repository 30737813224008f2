"""Calibration files (TOML): which scene, what was measured, which of its keys are free. See docs/calibrate.md."""

from __future__ import annotations

import copy
import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import BeforeValidator, Field, model_validator

from bh.analysis.clouds import read_cloud
from bh.applications.calibration import Bounds, Build
from bh.applications.readings import KINDS, Measured, Reading, Scanned
from bh.errors import InputError, SceneError
from bh.model.model import Model
from bh.scene.changes import setter
from bh.scene.load import scene_from_tables
from bh.scene.reading import Table, as_table, as_tables, check_keys, inside, one_line, read_table, within
from bh.scene.toml_text import read_toml, toml_bytes
from meshes.quantities import number, of_any_kind

Value = Annotated[float, Field(ge=-1e12, le=1e12), BeforeValidator(of_any_kind)]
SECTIONS = ("scene", "data", "free", "starts", "seed")


class FreeTable(Table):
    """A parameter: where it begins, and between which values it may lie."""

    begin: Value = Field(description="a number, or a text with a unit")
    least: Value = Field(description="the least value, a number or a text with a unit")
    most: Value = Field(description="the largest value, a number or a text with a unit")


class DataTable(Table):
    """One kind of data: readings at the ends of steps, or a scan."""

    observable: str | None = Field(None, description='what was read, such as "reaction_z" or "fold_angle"')
    of: str | None = Field(None, description="the crease or place that it is of")
    values: Annotated[list[float], Field(min_length=1)] | None = Field(None, description="a list of numbers")
    file: str | None = Field(None, description="a CSV file in place of values, from the folder of this file")
    column: str | None = Field(None, description="the name of its column")
    unit: str | None = Field(None, description='the unit of the values, such as "mN" or "deg"')
    steps: Annotated[list[Annotated[int, Field(ge=0)]], Field(min_length=1)] | None = Field(
        None, description="the steps after which it was read, from 0; all of them unless given"
    )
    scan: str | None = Field(None, description="a file of scan points in mm, in place of an observable")
    step: Annotated[int, Field(ge=0)] | None = Field(
        None, description="the step after which it was scanned, from 0"
    )
    sigma: Annotated[float, Field(gt=0.0, le=1e12)] | None = Field(
        None, description="the standard deviation of the noise in the unit of the values, positive"
    )

    @model_validator(mode="after")
    def one_kind(self) -> DataTable:
        """Check that it is either readings or a scan."""
        if (self.observable is None) == (self.scan is None):
            raise ValueError("needs either observable or scan")
        if self.scan is not None and (self.sigma is None or self.step is None):
            raise ValueError("needs sigma (mm) and step with a scan")
        if self.observable is not None and (self.values is None) == (self.file is None):
            raise ValueError("needs either values or file (CSV), the numbers that were read")
        if (self.file is None) != (self.column is None):
            raise ValueError("needs file and column together")
        return self


@dataclass(frozen=True)
class Task:
    """What a calibration file asks for: `bh.calibrate(task.build, task.data, task.free, task.starts, task.seed)`.

    Attributes:
        build: the model of parameters by name.
        data: readings and scans.
        free: where parameters begin, and their bounds.
        starts: how many beginnings are tried.
        seed: of the further ones.
        scene: the file of the scene.
    """

    build: Build
    data: tuple[Reading, ...]
    free: dict[str, Bounds]
    starts: int
    seed: int
    scene: Path


def load_task(file: Path) -> Task:
    """Read a calibration file.

    Args:
        file: TOML.

    Raises:
        SceneError: it cannot be read, or asks for what cannot be; one line that begins with the file's name.
    """
    try:
        return _task(read_toml(toml_bytes(file).decode("utf-8-sig")), file)
    except InputError as error:
        raise SceneError(one_line(f"{file}: {error}")) from error
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise SceneError(
            one_line(f"the calibration file '{file}' cannot be read ({why}); check the name")
        ) from error


def _task(tables: dict[str, object], file: Path) -> Task:
    check_keys("", tables, SECTIONS)
    for key, how in (("scene", 'scene = "NAME.toml"'), ("data", "[[data]]"), ("free", '[free."sheet.E"]')):
        if key not in tables:
            raise SceneError(f"{key} is missing; add {how}")
    if not isinstance(tables["scene"], str):
        raise SceneError('scene is a name of a file; write scene = "NAME.toml", from the folder of this file')
    place = inside(file.parent, tables["scene"], "scene")
    read = [
        read_table(DataTable, item, f"data[{i}]") for i, item in enumerate(as_tables(tables["data"], "data"))
    ]
    bounds = {
        name: read_table(FreeTable, item, f"free.{name}")
        for name, item in as_table(tables["free"], "free").items()
    }
    if not bounds:
        raise SceneError('free names no parameter; add a table [free."sheet.E"] with begin, least and most')
    text = read_toml(_text(place, "the scene"))
    for name in bounds:
        with within(f"free.{name}"):
            setter(copy.deepcopy(text), name)

            _check_units(text, name, as_table(as_table(tables["free"], "free")[name], "free"), place)

    def build(values: Mapping[str, float]) -> Model:
        changed = copy.deepcopy(text)
        for name, value in values.items():
            setter(changed, name)(value)
        scene = scene_from_tables(changed, place.parent, place.name)
        if scene.accuracy is not None:
            raise SceneError(f"{place.name}: a calibration solves one mesh; give a [mesh], and no accuracy")
        return scene.model

    return Task(
        build,
        tuple(_reading(each, file.parent, f"data[{i}]") for i, each in enumerate(read)),
        {name: (each.begin, each.least, each.most) for name, each in bounds.items()},
        _whole(tables, "starts", 1),
        _whole(tables, "seed", 0),
        place,
    )


def _check_units(scene: dict[str, object], name: str, given: dict[str, object], place: Path) -> None:
    """Texts with units are of the kind that the key of the scene has: the scene reads them as its own."""
    for key, value in given.items():
        if isinstance(value, str):
            changed = copy.deepcopy(scene)
            setter(changed, name)(value)
            try:
                scene_from_tables(changed, place.parent, place.name)
            except SceneError as error:  # a bound may lie where no scene is, such as 0
                if f'"{value}" is no ' in str(error):
                    raise SceneError(f'{key} = "{value}" cannot be ({error})') from error


def _whole(tables: Mapping[str, object], key: str, otherwise: int) -> int:
    value = tables.get(key, otherwise)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise SceneError(f"{key} = {value} cannot be; give a whole number")
    return value


def _reading(table: DataTable, folder: Path, at: str) -> Reading:
    with within(at):
        if table.scan is not None:
            assert table.step is not None
            assert table.sigma is not None
            return Scanned(read_cloud(inside(folder, table.scan, "scan")), table.step, table.sigma)
        assert table.observable is not None
        values = table.values
        if table.file is not None:
            assert table.column is not None
            values = _column(inside(folder, table.file, "file"), table.column)
        assert values is not None
        size = 1.0
        if table.unit is not None and table.observable in KINDS:
            size = number(f"1 {table.unit}", KINDS[table.observable])
        steps = None if table.steps is None else tuple(table.steps)
        sigma = None if table.sigma is None else size * table.sigma
        return Measured(table.observable, tuple(size * value for value in values), table.of, steps, sigma)


def _text(file: Path, what: str) -> str:
    try:
        return toml_bytes(file).decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or error
        raise SceneError(f"{what} '{file.name}' cannot be read ({why}); check the name") from error


def _column(file: Path, name: str) -> list[float]:
    """The numbers of a column of a CSV file."""
    rows = list(csv.DictReader(_text(file, "the readings").splitlines()))
    names = [each for each in rows[0] if each is not None] if rows else []  # None: more fields than names
    if name not in names:
        hint = "; separate fields by commas" if any(";" in each or "\t" in each for each in names) else ""
        raise SceneError(
            f"'{file.name}' has no column '{name}'; it has {', '.join(names) or 'no rows'}{hint}"
        )
    found = []
    for line, row in enumerate(rows, 2):
        try:
            found.append(float(row[name]))
        except (TypeError, ValueError):
            raise SceneError(
                f"'{file.name}' line {line}: '{row[name]}' of column '{name}' is no number"
            ) from None
    return found
