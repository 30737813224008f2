"""Sweep files (TOML): which scene, which keys take which values, what is measured. See docs/scaling.md."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from bh.errors import InputError
from bh.scene.reading import Table, as_table, check_keys, inside, one_line, read_table
from bh.scene.toml_text import read_toml, toml_bytes
from bh.sweep import SceneTask, scene
from bh.sweep.dataset import Label
from bh.sweep.measures import Measure
from bh.sweep.points import Points, SweepError, Value, grid, read_csv
from meshes.quantities import of_any_kind

Ends = Annotated[float, Field(ge=-1e9, le=1e9), BeforeValidator(of_any_kind)]
SECTIONS = ("scene", "axes", "table", "measure")
KEY = 'a key of the scene, such as "pattern.radius" or "steps[0].fold.to", or a list of keys'


class AxisTable(Table):
    """Values of one parameter: listed, or `count` of them from `start` to `stop`."""

    key: str | list[str] = Field(description=KEY)
    values: list[float | int | str | bool] | None = Field(None, min_length=1, description="a list of values")
    start: Ends | None = Field(None, description="the first value")
    stop: Ends | None = Field(None, description="the last value")
    count: Annotated[int, Field(ge=2, le=10_000_000)] | None = Field(
        None, description="a whole number from 2"
    )
    spacing: Literal["linear", "log"] = Field("linear", description='"linear" or "log"')
    unit: str = Field("", description="a word for the data set")

    @model_validator(mode="after")
    def one_way(self) -> AxisTable:
        """Check that the values are given in one of the two ways."""
        ends = [v is not None for v in (self.start, self.stop, self.count)]
        if (self.values is not None) == any(ends) or (any(ends) and not all(ends)):
            raise ValueError("needs either values, or start, stop and count")
        if self.spacing == "log" and min(self.start or 0.0, self.stop or 0.0) <= 0.0:
            raise ValueError('needs positive start and stop for spacing = "log"')
        return self

    def expanded(self) -> list[Value]:
        """The values.

        Returns:
            the values in order.
        """
        if self.values is not None:
            return list(self.values)
        assert self.start is not None
        assert self.stop is not None
        assert self.count is not None
        space = np.geomspace if self.spacing == "log" else np.linspace
        return [float(v) for v in space(self.start, self.stop, self.count)]


class SampleTable(Table):
    """Sampled points: a CSV file, and the keys of the scene that its columns stand for."""

    file: str = Field(description="the name of a CSV file, from the folder of the sweep file")
    keys: dict[str, str | list[str]] = Field(description="for every column " + KEY)


class ValueTable(Table):
    """One number of a path: `bh.sweep.measures.Measure`."""

    observable: str = Field(description="what is read, such as displacement_z, reaction_x or stiffness_z")
    of: str | None = Field(None, description="the crease or place that it is read from")
    step: Annotated[int, Field(ge=0)] | None = Field(
        None, description="the step after which it is read, from 0; the last one if not given"
    )
    since: Annotated[int, Field(ge=0)] | None = Field(
        None, description="the step from whose end on it is counted, from 0"
    )
    hold: list[str] = Field([], description="a list of places that are fixed while a stiffness is probed")


class MeasureTable(Table):
    """What is measured beside energies and angles."""

    places: list[str] = Field([], description="a list of places whose node positions are measured")
    shape: bool = Field(False, description="true or false: positions of all nodes")
    values: dict[str, ValueTable] = Field({}, description="tables [measure.values.NAME]")


@dataclass(frozen=True)
class Sweep:
    """What a sweep file asks for: `bh.sweep.run(sweep.task, sweep.points, "out.nc", labels=sweep.labels)`.

    Attributes:
        task: of a point.
        points: of the sweep.
        labels: of its parameters.
        name: of the file, without its suffix.
    """

    task: SceneTask
    points: Points
    labels: dict[str, Label]
    name: str


def load_sweep(file: str | Path) -> Sweep:
    """Read a sweep file.

    Raises:
        SweepError: it cannot be read, or asks for what cannot be; one line that begins with the file's name.
    """
    file = Path(file)
    try:
        return _sweep(read_toml(toml_bytes(file).decode("utf-8-sig")), file)
    except InputError as error:
        raise SweepError(one_line(f"{file}: {error}")) from error
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise SweepError(
            one_line(f"the sweep file '{file}' cannot be read ({why}); check the name")
        ) from error


def _sweep(data: dict[str, object], file: Path) -> Sweep:
    check_keys("", data, SECTIONS)
    file_of_scene = data.get("scene")
    if not isinstance(file_of_scene, str):
        raise SweepError('scene is missing; add scene = "NAME.toml", from the folder of this file')
    if ("axes" in data) == ("table" in data):
        raise SweepError("give either [axes.NAME] tables (every combination) or a [table] (sampled points)")
    measure = read_table(MeasureTable, data.get("measure", {}), "measure")
    labels: dict[str, Label] = {}
    keys: dict[str, str | list[str]]
    if "axes" in data:
        axes = {
            name: read_table(AxisTable, item, f"axes.{name}")
            for name, item in as_table(data["axes"], "axes").items()
        }
        points = grid({name: axis.expanded() for name, axis in axes.items()})
        keys = {name: axis.key for name, axis in axes.items()}
        labels = {n: Label(a.unit, ", ".join(_listed(a.key))) for n, a in axes.items()}
    else:
        sample = read_table(SampleTable, data["table"], "table")
        points, keys = read_csv(inside(file.parent, sample.file, "table.file")), dict(sample.keys)
        missing = [name for name in points.names if name not in keys]
        if missing or len(keys) > len(points.names):
            wrong = missing or [name for name in keys if name not in points.names]
            raise SweepError(
                f"table.keys and the columns of '{sample.file}' do not fit: look at {', '.join(wrong)}"
            )
    values = tuple(
        Measure(name, value.observable, value.of, value.step, value.since, tuple(value.hold))
        for name, value in measure.values.items()
    )
    place = inside(file.parent, file_of_scene, "scene")
    task = replace(scene(place, keys, measure.places, measure.shape, values), asked_by=str(file))
    return Sweep(task, points, labels, file.stem)


def _listed(key: str | list[str]) -> list[str]:
    return [key] if isinstance(key, str) else key
