"""The task of sweeping a scene: set keys of its tables, solve it, measure the last state."""

from __future__ import annotations

import copy
import hashlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

from bh.errors import InputError, SceneError
from bh.model.supports import select
from bh.paths.path import Path as Trace
from bh.scene.changes import setter
from bh.scene.load import Scene, scene_from_tables
from bh.scene.reading import one_line
from bh.scene.toml_text import read_toml
from bh.solvers.arc_length import ArcLength
from bh.solvers.automatic import Automatic
from bh.solvers.load_control import LoadControl
from bh.solvers.outcome import Outcome
from bh.solvers.walk import Strategy
from bh.solving.trace import trace
from bh.sweep.dataset import Label
from bh.sweep.measures import Measure
from bh.sweep.points import OWN, SweepError, Value
from bh.sweep.task import Measured

MEASURED = re.compile(
    r"(energy|dihedral|points)_.*|stable|critical_points|iterations|unknowns|points|flat_points|node|node_.*|xyz?"
)
RETRIED = (Outcome.LIMIT_POINT, Outcome.STALLED)  # outcomes that finer increments may mend
FINER = Automatic(
    LoadControl(first_rotation=0.1, largest_rotation=0.2, first=0.02, largest=0.05),
    ArcLength(most=1000),
    patience=2e-4,
)
ENERGIES = ("stretching", "bending", "folding", "total")


@dataclass(frozen=True)
class SceneTask:
    """Solve a scene with some of its keys set, and measure its last state.

    Attributes:
        text: of the scene file.
        keys: for every parameter the keys of the scene that take its value, such as "steps[0].fold.to".
        folder: where files that it names are looked for.
        places: whose node positions are measured, such as "corner:inner-end".
        shape: also measure the positions of all nodes.
        warm: points that come together are a line along one axis and may begin at each other's states:
            `bh.sweep.warm`.
        labels: of the parameters, in front of those that the task knows.
        values: numbers to read beside energies and angles.
        name: of the scene's file, for messages.
        asked_by: the sweep file, for messages; empty where there is none.

    Raises:
        SweepError: the scene has no such key.
    """

    text: str
    keys: Mapping[str, tuple[str, ...]]
    folder: Path = Path()
    places: tuple[str, ...] = ()
    shape: bool = False
    warm: bool = False
    labels: Mapping[str, Label] = field(default_factory=dict)
    values: tuple[Measure, ...] = ()
    name: str = "scene"
    asked_by: str = ""

    def __post_init__(self) -> None:
        """See that the scene has the keys."""
        tables = read_toml(self.text)
        for value in self.values:
            if MEASURED.fullmatch(value.name) or value.name in (*self.keys, *OWN, "retried"):
                raise SweepError(
                    f"measure.values.{value.name} is the name of something else; give it another"
                )
        for name, keys in self.keys.items():
            if MEASURED.fullmatch(name):
                raise SweepError(
                    f"parameter '{name}' is called as something that is measured; give it another name"
                )
            for key in keys:
                _setter(tables, key, name)

    @property
    def identity(self) -> str:
        """Of scene, keys and measures; SHA-256."""
        data = {
            "text": self.text,
            "keys": dict(self.keys),
            "places": self.places,
            "shape": self.shape,
            "warm": self.warm,
        }
        if self.values:
            data["values"] = [asdict(value) for value in self.values]
        return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()

    def scene(self, parameters: Mapping[str, Value]) -> Scene:
        """The scene of a point.

        Raises:
            SceneError: it cannot be.
        """
        tables = copy.deepcopy(read_toml(self.text))
        for name, value in parameters.items():
            for key in self.keys[name]:
                _setter(tables, key, name)(value)
        return scene_from_tables(tables, self.folder, self.name)

    def __call__(self, parameters: Mapping[str, Value]) -> Measured:
        """Solve the scene of a point and measure its last state."""
        scene = self.scene(parameters)
        path = _solved(scene, scene.strategy)
        if path.reached:
            return Measured(self.measure(path))
        why = f"{path.outcome} at {_where(path)}"
        if path.outcome not in RETRIED or scene.strategy is not None:
            return Measured({}, path.outcome, f"{_where(path)}: {path.reason}")
        finer = _solved(scene, FINER)
        if finer.reached:
            return Measured(self.measure(finer) | {"retried": 1}, reason=f"by finer increments, after {why}")
        tried = f"{_where(finer)}: {finer.reason} (by finer increments; before {why})"
        return Measured({}, finer.outcome, tried)

    def line(self, points: Sequence[Mapping[str, Value]]) -> list[Measured] | None:
        """All points of a line by warm starts, or None where one of them cannot be or is not reached.

        Returns:
            one for each point, in order, or None.
        """
        if not self.warm:
            return None
        from bh.sweep.warm import line

        try:
            scenes = [self.scene(parameters) for parameters in points]
            if any(scene.accuracy is not None for scene in scenes):  # meshes are chosen point by point
                return None
            paths = line([scene.model for scene in scenes])
        except InputError:
            return None
        reached = all(path.reached for path in paths)
        return [Measured(self.measure(path)) for path in paths] if reached else None

    def measure(self, path: Trace) -> dict[str, object]:
        """Energies in N mm, dihedral angles of the creases in rad, positions in mm, and what it took.

        Returns:
            values by name.
        """
        state, mesh = path[-1], path.model.mesh
        energy = state.energy.as_dict()
        found: dict[str, object] = {f"energy_{kind}": energy[kind] for kind in ENERGIES}
        for crease in mesh.drawn_creases:
            angles = state.dihedral(crease)
            if len(angles):
                found |= {
                    f"dihedral_{crease}": float(angles.mean()),
                    f"dihedral_{crease}_min": float(angles.min()),
                    f"dihedral_{crease}_max": float(angles.max()),
                }
        for place in self.places:
            found[f"points_{word(place)}"] = state.points[select(mesh, place)]
        found |= {value.name: value.read(path) for value in self.values}
        if self.shape:
            found |= {"points": state.points, "flat_points": mesh.points}
        found |= {
            "stable": {True: 1, False: 0, None: -1}[path.stable],
            "critical_points": len(path.critical_points),
            "iterations": path.iterations,
            "unknowns": path.unknowns,
            "retried": 0,
        }
        return found

    def labelled(self) -> dict[str, Label]:
        """Units and texts of what is measured, where they are known beforehand.

        Returns:
            labels by name.
        """
        known = {f"energy_{kind}": Label("N mm", f"{kind} energy") for kind in ENERGIES}
        for place in self.places:
            known[f"points_{word(place)}"] = Label(
                "mm", f"positions of {place}", (f"node_{word(place)}", "xyz")
            )
        known["points"] = Label("mm", "positions of all nodes", ("node", "xyz"))
        known["flat_points"] = Label("mm", "positions in the flat sheet", ("node", "xy"))
        known |= {value.name: Label(value.unit, _described(value)) for value in self.values}
        known["retried"] = Label("", "1 reached by finer increments only")
        known["stable"] = Label("", "1 stable, 0 not stable, -1 not known")
        for name, keys in self.keys.items():
            known[name] = Label("", ", ".join(keys))
        return known | dict(self.labels)

    def check(self, tried: list[Mapping[str, Value]]) -> None:
        """See that at least one of some points makes a scene that has the places.

        Raises:
            SceneError, ModelError: none does; the first one's error.
            SweepError: the same of a sweep file, whose name it begins with.
        """
        errors = []
        for parameters in tried:
            try:
                model = self.scene(parameters).model
                for place in self.places:
                    select(model.mesh, place)
                for value in self.values:
                    value.check(model)
                return
            except InputError as error:
                errors.append(error)
        if self.asked_by:
            raise SweepError(one_line(f"{self.asked_by}: {errors[0]}")) from errors[0]
        raise errors[0]


def _setter(tables: dict[str, object], key: str, name: str) -> Callable[[Value], None]:
    """What sets a key of some tables for a parameter."""
    try:
        return setter(tables, key)
    except SceneError as error:
        raise SweepError(f"parameter '{name}': {error}") from error


def _solved(scene: Scene, strategy: Strategy | None) -> Trace:
    return trace(
        scene.model,
        accuracy=scene.accuracy,
        strategy=strategy,
        neighbours=scene.neighbours,
        warn=False,
    )


def _where(path: Trace) -> str:
    return f"step {len(path.steps)}, lambda {path.records[-1].lam:.6g}"


def _described(value: Measure) -> str:
    """A measure in words: "displacement_z of corner:inner-end, after step 1, since step 0"."""
    of = f" of {value.of}" if value.of else ""
    step = "" if value.step is None else f", after step {value.step}"
    return f"{value.observable}{of}{step}" + ("" if value.since is None else f", since step {value.since}")


def word(place: str) -> str:
    """A place as part of a name: "corner_inner_end"."""
    return re.sub(r"\W+", "_", place)
