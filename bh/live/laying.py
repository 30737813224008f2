"""The load step, system and march of a way: from the state that it begins at, or at one that was kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bh.formulations.protocols import SheetSystem
from bh.formulations.registry import formulation
from bh.formulations.state import State
from bh.live.controls import Controls, Way
from bh.live.march import March
from bh.loading.builder import LoadStepBuilder
from bh.loading.load_step import LoadStep, StepEnd
from bh.model.actuations import Force
from bh.model.model import Model, drawn_flat
from bh.model.step import Step
from bh.solvers.load_control import LoadControl
from bh.solvers.points import point

Array = NDArray[np.float64]
BALANCED = 1e-8  # of forces over the typical one of an element; a state with more is not gone back to


@dataclass(eq=False)
class Under:
    """The way in hand: its load step and system, and the march along it.

    Attributes:
        way: through controls.
        load: its load step.
        system: of the load step.
        march: along it.
        whole: it leads to its end and no further, since what it begins with is not what its controls say: forces that
            fade out, or creases as they were drawn, edge for edge.
    """

    way: Way
    load: LoadStep
    system: SheetSystem
    march: March
    whole: bool

    @property
    def fading(self) -> bool:
        """Whether it lets forces fade out that are still there."""
        return bool(self.load.force.start.any()) and self.march.here.lam != 1.0

    def lam_of(self, wanted: Controls) -> float | None:
        """Lambda at which it is in equilibrium with controls; None where these are not on it."""
        if self.whole:
            return 1.0 if self.way.end == wanted else None
        return self.way.find(wanted)


class Laying:
    """Makes the ways of a sheet one after another; each begins where the one before has come to."""

    def __init__(self, model: Model, settings: LoadControl, settles: bool) -> None:
        """Begin with the sheet as it is drawn.

        Args:
            model: without steps.
            settings: of the march.
            settles: see `March`.

        Raises:
            ModelError: its creases cannot be.
        """
        self.model = model
        self.formulation = formulation(model.formulation)
        self._uneven = not drawn_flat(model.mesh)  # creases are as they were drawn, edge for edge
        self._settings, self._settles = settings, settles
        self._builder = LoadStepBuilder(model)

    def stop(self, under: Under, state: State) -> None:
        """The next way begins at a state on the way in hand.

        Args:
            under: the way in hand.
            state: its newest.
        """
        end = StepEnd(under.march.here.lam, state.points, state.dihedral_angles)
        self._uneven = self._uneven and end.lam != 1.0
        self._builder.end_early(under.load, end)

    def keep(self, forces: Mapping[int, list[float]]) -> None:
        """Let dead forces, N, act at nodes from now on."""
        items = tuple(Force([node], each=(x, y, z)) for node, (x, y, z) in forces.items())
        self._builder.build(Step(items))

    def begin(
        self,
        start: Controls,
        wanted: Controls,
        state: State | None = None,
        gone: tuple[int, ...] = (),
        unseen: bool = False,
    ) -> Under:
        """The march along the way through what is wanted.

        Args:
            start: what the sheet is in equilibrium with.
            wanted: of the same creases and nodes.
            state: that it begins at; None for the sheet as it is drawn.
            gone: nodes whose forces fade out.
            unseen: whether the stability of the state was not looked at.
        """
        way = Way(start, wanted) if gone or self._uneven else Way.toward(start, wanted)
        step = self._step(way, gone)
        load = self._builder.build(step)
        # shells look up the step that they are in: the first, or the one behind that of the state
        walked = replace(self.model, steps=(step,) if state is None else (step, step))
        system = self.formulation.system(walked, load, state)
        march = March(system, [point(system, system.start(), 0.0)], 0.0, self._settings, self._settles)
        march.unseen = unseen
        under = Under(way, load, system, march, bool(load.force.start.any()) or self._uneven)
        march.target = under.lam_of(wanted) or 0.0
        return under

    def back(self, way: Way, q: Array, negative: int | None) -> Under | None:
        """At the end of a way from flat, in a state that was kept.

        Args:
            way: from flat to what was asked for then.
            q: (n,) unknowns of the state.
            negative: how many of its modes are; 0 where it is stable.

        Returns:
            the march that stands there; None where these are no unknowns of an equilibrium, and nothing has changed.
        """
        builder, step = LoadStepBuilder(self.model), self._step(way, ())
        load = builder.build(step)
        system = self.formulation.system(replace(self.model, steps=(step,)), load, None)
        if q.shape != (system.size,):
            return None
        evaluation = system.evaluate(q, 1.0)
        if not evaluation.imbalance <= BALANCED:
            return None
        here = point(system, q, 1.0, evaluation=evaluation, negative=negative)
        self._builder, self._uneven = builder, False
        return Under(way, load, system, March(system, [here], 1.0, self._settings, self._settles), True)

    def _step(self, way: Way, gone: tuple[int, ...]) -> Step:
        items = way.actuations(self.model, gone)
        return Step(items or (Force([0], each=(0.0, 0.0, 0.0)),))
