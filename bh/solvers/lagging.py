"""Solves of systems that take something from a state before, such as normal forces of friction, until it is settled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from bh.solvers.system import System

Array = NDArray[np.float64]
Guess = Callable[[], tuple[Array, Array]]  # unknowns and element forces
SETTLED = 0.002  # change of what is taken from states before, in parts of it, that is nothing
LAGS = 12  # how often it is taken at most


@runtime_checkable
class Lagging(Protocol):
    """Ability of a system: its energy holds something that is taken from a state before, such as normal forces."""

    @property
    def lags(self) -> bool:
        """Does it, in this model?"""
        ...

    def lag_back(self) -> None:
        """Take it from the state that was accepted last."""
        ...

    def lag(self, q: Array, lam: float, settled: float) -> bool:
        """Take it from a state, unless it changes by less than a part of `settled`; whether it has changed.

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
            settled: largest change, in parts of it.
        """
        ...

    def unsettled(self, history: Array) -> float:
        """By how much it still changed where a state was accepted, in parts of it.

        Args:
            history: of that state, as `history_at` gives it.
        """
        ...


class Solved(Protocol):
    """What came of a solve."""

    @property
    def q(self) -> Array:
        """(n,) unknowns."""
        ...

    @property
    def converged(self) -> bool:
        """Is it an equilibrium?"""
        ...

    def after(self: S, iterations: int) -> S:
        """The same with the iterations of what was solved before."""
        ...

    @property
    def iterations(self) -> int:
        """That it took."""
        ...


S = TypeVar("S", bound=Solved)


def lagged(
    solve: Callable[[System, Array, float, Array | None, Guess | None], S],
    system: System,
    q: Array,
    lam: float,
    forces: Array | None,
    second_guess: Guess | None,
) -> S:
    """A solve with what lags taken from the last accepted state, then from each solution until it is settled.

    Args:
        solve: that is repeated.
        system: any; of one that is not `Lagging` there is one solve.
        q: (n,) guess.
        lam: load parameter of the step, 0 to 1.
        forces: (f,) element forces that go with the guess; None for those of the system there.
        second_guess: makes unknowns and forces of another guess.

    Returns:
        the last solve, with the iterations of all.
    """
    if not (isinstance(system, Lagging) and system.lags):
        return solve(system, q, lam, forces, second_guess)
    system.lag_back()
    found = solve(system, q, lam, forces, second_guess)
    for _ in range(LAGS):
        if not (found.converged and system.lag(found.q, lam, SETTLED)):
            break
        found = solve(system, found.q, lam, None, None).after(found.iterations)
    return found
