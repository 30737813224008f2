"""Whether the state that is shown is where a run from flat ends: branches can meet without a snap that is told."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.live import Frame, Session
from bh.runtime.progress import Silent
from bh.solvers.automatic import Automatic
from bh.solvers.load_control import LoadControl
from bh.solvers.newton import Newton, Solution
from bh.solvers.system import System
from bh.solving.trace import trace

Array = NDArray[np.float64]

SAME = 1e-5  # of the sheet's size: what a state may be off on the same branch


@dataclass(frozen=True, eq=False)
class FromFlat:
    """Where a run from flat ends.

    Attributes:
        here: in the state that is shown.
        said: one line for the person.
    """

    here: bool
    said: str

    def message(self) -> dict[str, object]:
        """What a window is told.

        Returns:
            as JSON.
        """
        return {"kind": "branch", "here": self.here, "said": self.said}


def from_flat(session: Session, frame: Frame, going: Callable[[], bool]) -> FromFlat | None:
    """Fold the sheet anew from flat and pull on it in a second step, as its scene does, and `bh run` with it.

    Another way of solving would not do: a run follows a branch round its limit points and changes to a stable one
    where branches meet, so it may end elsewhere than what came from flat by larger increments.

    Args:
        session: the handling of the sheet; it is not changed.
        frame: its state at rest.
        going: asked at every iteration; False ends it.

    Returns:
        where that ends; None where it was ended.
    """
    if session.straight:
        return FromFlat(True, "ends here: it came this way")
    model = session.scene()
    if not model.steps:
        return FromFlat(True, "ends here: nothing acts")
    try:
        path = trace(model, strategy=_run(going), progress=_Heed(going), warn=False, neighbours=False)
    except _EndedError:
        return None
    if not path.reached:
        return FromFlat(False, f"does not get here: it ends early, {path.outcome}")
    there = path[-1]
    off = float(np.linalg.norm(there.points - frame.points, axis=1).max())
    if off <= SAME * float(np.ptp(session.mesh.points, axis=0).max()):
        return FromFlat(True, "ends here")
    ends = f"{there.energy.total:.4g} N mm there, {frame.state.energy.total:.4g} here, {off:.3g} mm apart"
    return FromFlat(False, f"ends on another branch: {ends}")


def check(session: Session, frame: Frame, going: Callable[[], bool]) -> str:
    """The same controls by a run from flat, on this mesh and on a coarser one.

    Args:
        session: the handling of the sheet; it is not changed.
        frame: its state at rest.
        going: asked at every iteration; False ends it.

    Returns:
        how far off the state is, in one line for the person.
    """
    model = session.scene()
    if not model.steps:
        return "there is nothing to check yet"
    try:
        path = trace(model, strategy=_run(going), progress=_Heed(going), estimate=True, warn=False)
    except _EndedError:
        return "the check was ended by what was asked next"
    off = float(np.abs(path[-1].points - frame.points).max())
    error = path.accuracy
    estimate = (
        f"its energy is off by about {100.0 * error.estimate:.2g} % on this mesh"
        if error is not None and error.estimate is not None
        else f"its error on this mesh is not known: {path.estimate_reason}"
    )
    return f"a run from flat ends as {path.outcome}, at most {off:.2g} mm from here; {estimate}"


def _run(going: Callable[[], bool]) -> Automatic:
    """The strategy of a run that nothing else was said of, which can be ended."""
    return Automatic(load=LoadControl(newton=_Heeding(going=going)))


class _EndedError(Exception):
    """Somebody asked for something else."""


@dataclass(frozen=True)
class _Heed(Silent):
    """Ends a run between two increments."""

    going: Callable[[], bool]

    def update(self, step: int, steps: int, lam: float, iterations: int, energy: float) -> None:
        """See `ProgressMeter`."""
        super().update(step, steps, lam, iterations, energy)
        if not self.going():
            raise _EndedError


@dataclass(frozen=True)
class _Heeding(Newton):
    """Newton's method as a run has it, which can be ended between two iterations."""

    going: Callable[[], bool] = lambda: True

    def full_steps(
        self, system: System, q: Array, lam: float, forces: Array | None = None
    ) -> Generator[Array, None, Solution]:
        """See `Newton`."""
        return self._heeded(super().full_steps(system, q, lam, forces))

    def globalised_steps(self, system: System, q: Array, lam: float) -> Generator[Array, None, Solution]:
        """See `Newton`."""
        return self._heeded(super().globalised_steps(system, q, lam))

    def _heeded(self, steps: Generator[Array, None, Solution]) -> Generator[Array, None, Solution]:
        while True:
            if not self.going():
                raise _EndedError
            try:
                q = next(steps)
            except StopIteration as end:
                found: Solution = end.value
                return found
            yield q
