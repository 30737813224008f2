"""What a sweep reads from a path beside energies and angles: any observable, at a step, as a change, or a stiffness."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from bh.analysis.stiffness_probe import Probe
from bh.formulations.observables import OBSERVABLES, measure
from bh.model.model import Model
from bh.model.plugins import consent
from bh.model.supports import AXES, select
from bh.model.until import Until
from bh.paths.path import Path
from bh.scene.reading import nearest
from bh.sweep.points import SweepError

STIFFNESS = tuple(f"stiffness_{axis}" for axis in AXES)
CREASES = (
    "fold_angle",
    "largest_fold",
    "dihedral",
    "moment",
)  # of a crease; reactions, displacements of a place
ANGLES = CREASES[:3]
FREE = ("depth", "energy", "stretching", "bending", "folding")  # of the whole sheet


@dataclass(frozen=True)
class Measure:
    """One number of a path.

    Attributes:
        name: in the data set.
        observable: one that a step can end by (docs/scenes.md), "stiffness_x", "_y" or "_z" of a place (N/mm, against
            a force along the axis, free to move across), or "module:function" of a state.
        of: the crease or place that it is read from.
        step: after which it is read, from 0; None for the last one.
        since: the step from whose end it is counted as a change; None for the value itself.
        hold: places that are fixed while a stiffness is probed, besides the supports.
    """

    name: str
    observable: str
    of: str | None = None
    step: int | None = None
    since: int | None = None
    hold: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what no scene has.

        Raises:
            SweepError: an observable that is not known, or lacks its crease or place.
        """
        known = (*OBSERVABLES, *STIFFNESS)
        where = f"measure.values.{self.name}"
        if not re.fullmatch("[A-Za-z][A-Za-z0-9_]*", self.name):
            raise SweepError(f"{where}: a name has letters, digits and _ only")
        if ":" in self.observable:
            consent(self.observable)
        elif self.observable not in known:
            raise SweepError(
                f"{where}.observable = '{self.observable}' is not known{nearest(self.observable, known)}; use one of "
                f"{', '.join(known)}"
            )
        elif self.observable not in FREE and self.of is None:
            what = "crease" if self.observable in CREASES else "place"
            raise SweepError(f"{where}.of is missing; name the {what} that {self.observable} is of")
        if self.hold and self.observable not in STIFFNESS:
            raise SweepError(f"{where}.hold goes with a stiffness; remove it")

    @property
    def unit(self) -> str:
        """Of the number, or ""."""
        units = {"reaction": "N", "displacement": "mm", "stiffness": "N/mm"}
        if self.observable in FREE:
            return "mm" if self.observable == "depth" else "N mm"
        if self.observable in CREASES:
            return "rad" if self.observable in ANGLES else "N mm / mm"
        return units.get(self.observable.split("_")[0], "")

    def check(self, model: Model) -> None:
        """See that a model has the steps, and the crease or place.

        Raises:
            SweepError: it has not.
            InputError: no such crease or place; one line.
        """
        for key, step in (("step", self.step), ("since", self.since)):
            if step is not None and step >= len(model.steps):
                raise SweepError(
                    f"measure.values.{self.name}.{key} = {step} is no step; the scene has the steps 0 to "
                    f"{len(model.steps) - 1}"
                )
        last = len(model.steps) - 1 if self.step is None else self.step
        if self.since is not None and self.since >= last:
            raise SweepError(
                f"measure.values.{self.name}.since = {self.since} does not lie before step {last}"
            )
        if self.observable in CREASES:
            if self.observable not in ANGLES or self.of not in model.mesh.wide_creases:
                model.mesh.crease_edges(str(self.of))
        elif self.of is not None:
            select(model.mesh, self.of)

    def read(self, path: Path) -> float:
        """The number, of a path that was reached to its end; nan where it is infinite (a place that is held).

        Args:
            path: of the model.
        """
        value = self._at(path, self.step)
        if self.since is not None:
            value -= self._at(path, self.since)
        return value if math.isfinite(value) else math.nan

    def _at(self, path: Path, step: int | None) -> float:
        index = len(path) - 1
        if step is not None:
            index = max(k for k, record in enumerate(path.records) if record.step == step)
        if self.observable in STIFFNESS:
            probe = Probe(path, index, list(self.hold))
            return float(probe.at(str(self.of)).loaded(AXES[self.observable[-1]]))
        return measure(Until(self.observable, 0.0, self.of), path[index])
