"""What the driver needs to know of a mechanical system; it knows nothing of mechanics.

All actuation enters through one scalar lambda, which runs from 0 to 1 in a step.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from bh.solvers.factor import IndefiniteError, Matrix
from bh.solvers.outcome import Outcome

Array = NDArray[np.float64]


class Evaluation(NamedTuple):
    """A system at (q, lambda).

    Attributes:
        energy: potential whose stationary points are sought, N mm (with multipliers: the Lagrangian).
        residual: (n,) its gradient.
        imbalance: scale-free size of the residual: largest component beyond rounding, over the typical element
            force; constraint violations in rad or relative units. Zero for perfect equilibrium.
        forces: element forces at q (one array, in the system's own order); see `System.tangent` and `Tangent`.
        penalty: what missed constraints add to the energy where steps are compared (line search), N mm.
    """

    energy: float
    residual: Array
    imbalance: float
    forces: Array
    penalty: float = 0.0

    @property
    def merit(self) -> float:
        """What a globalised step must lower: the energy, with constraints the augmented Lagrangian; N mm."""
        return self.energy + self.penalty


def unchanged(forces: Array, _dq: Array) -> Array:
    """The prediction of a system whose element forces are left alone: with it the iteration is plain Newton's.

    Args:
        forces: element forces, in the system's own order.
        _dq: (n,) increment of the unknowns, which is not looked at.

    Returns:
        `forces` itself.
    """
    return forces


@dataclass(frozen=True, eq=False)
class Tangent:
    """The tangent of a system at one (q, lambda), and what it says of the element forces beside that state.

    It belongs to the state that it was made at, whatever its system is asked afterwards.

    Attributes:
        matrix: symmetric, (n, n): the derivative of the residual by the unknowns.
        predicted_forces: element forces after an increment, from those at q, `Evaluation.forces`, and the increment
            dq (n,): `tangent.predicted_forces(now.forces, dq)`, linear in dq.
    """

    matrix: Matrix
    predicted_forces: Callable[[Array, Array], Array] = unchanged


class System(Protocol):
    """What the driver asks of a mechanical system; it knows nothing else of it.

    q are its n = `size` unknowns and lambda, from 0 to 1 in a step, is what drives it. The first `primal` unknowns
    minimise the energy, the rest are multipliers of constraints. Each method answers for the state that it is given:
    no order of calls is needed.
    """

    @property
    def size(self) -> int:
        """Number n of unknowns."""
        ...

    @property
    def primal(self) -> int:
        """Number of unknowns that minimise the energy; they come first."""
        ...

    @property
    def energy_scale(self) -> float:
        """Stiffness times one radian squared over all hinges, N mm; 1e-15 of it is rounding."""
        ...

    @property
    def rotation(self) -> float:
        """Largest change of an imposed or rest angle while lambda runs from 0 to 1, rad; 0 where none changes."""
        ...

    def evaluate(self, q: Array, lam: float) -> Evaluation:
        """Energy, its gradient and the element forces at unknowns q (n,).

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        ...

    def tangent(self, q: Array, lam: float, forces: Array) -> Tangent:
        """The tangent at q (n,), with the element forces `forces` in its geometric part.

        With `forces` of `evaluate(q, lam)` its matrix is the Hessian; with those that the tangent before had predicted
        it is that of Newton's method with independent forces (Magisano, Leonetti and Garcea 2017).

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
            forces: (f,) element forces of the geometric part.
        """
        ...

    def control_rate(self, q: Array, lam: float) -> Array:
        """(n,) d residual / d lambda at fixed q.

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        ...

    def power(self, q: Array, lam: float) -> float:
        """Rate of work of the actuation, d energy / d lambda at fixed q, N mm.

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        ...

    def control_stiffness(self, q: Array, lam: float) -> float:
        """Second derivative of the energy by lambda at fixed q, N mm.

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        ...

    def objection(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        """Why an increment from one state to the next is not to be trusted, or an empty string.

        Args:
            q: (n,) unknowns of the state before.
            lam: its load parameter.
            q_new: (n,) unknowns of the state after.
            lam_new: its load parameter.
        """
        ...

    def penetration(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        """What passed through itself between two states, which no increment may, or an empty string.

        Args:
            q: (n,) unknowns of the state before.
            lam: its load parameter.
            q_new: (n,) unknowns of the state after.
            lam_new: its load parameter.
        """
        ...

    def obstacle(self, q: Array, lam: float) -> tuple[Outcome, str] | None:
        """Outcome and reason where the state itself tells why a path ends (contact, ...), else None.

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.

        Returns:
            the outcome and one line, or None.
        """
        ...

    def describe(self, q: Array, lam: float, motion: Array) -> str:
        """A motion (n,) of the unknowns in words, such as "crease 'a' turns freely".

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
            motion: (n,) of any length.
        """
        ...


@runtime_checkable
class Rounded(Protocol):
    """Ability of a system: it knows what rounding of its unknowns does."""

    def rounding(self, q: Array, lam: float) -> float:
        """Largest residual that rounding makes at a state, over the typical force there; 0 where there is none.

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        ...

    def noise(self, q: Array, lam: float) -> float:
        """Energy that rounding of the positions alone makes of a state, N mm.

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        ...


@runtime_checkable
class Limited(Protocol):
    """Ability of a system: something can stand in the way of a step, which then has to be shorter."""

    def free_part(self, q: Array, dq: Array, lam: float, since: float | None = None) -> float:
        """How much of the step dq (n,) from q nothing stands in, 0 to 1.

        Args:
            q: (n,) unknowns, with nothing in their way.
            dq: (n,) step.
            lam: load parameter of the step, 0 to 1.
            since: that of q, where what stands in the way moves with lambda meanwhile.
        """
        ...


@runtime_checkable
class Hindered(Limited, Protocol):
    """Ability of a system: what can stand in the way can be left out, and the way be looked at afterwards."""

    @property
    def hindered(self) -> bool:
        """Does anything stand in the way, ever?"""
        ...

    @property
    def looking(self) -> float:
        """What looks at what stands in the way have taken so far, s of one core of 2.5 GHz, counted by their work."""
        ...

    def unhindered(self) -> AbstractContextManager[None]:
        """While it lasts nothing stands in the way."""
        ...

    def clear_ways(self, places: Sequence[tuple[Array, float]]) -> float:
        """How many of the straight ways from place to place are clear, and a part of the one that is not.

        If it is all of them, the last place is one that the path has come to.

        Args:
            places: unknowns (n,) and load parameter of each; the first is an accepted state.
        """
        ...

    def room(self, q: Array, lam: float) -> float:
        """What the pair that presses hardest has left of the reach of its barrier, 0 to 1.

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        ...

    def harden(self, factor: float) -> None:
        """Let everything press by a number of times what the model asks for, until told otherwise.

        Args:
            factor: 1 for the model's own.
        """
        ...

    def reshaped(self, one: tuple[Array, float], other: tuple[Array, float]) -> float:
        """By how much two shapes differ, rigid motions aside: the norm over all nodes, mm.

        Args:
            one: unknowns (n,) and load parameter.
            other: the same of the other shape.
        """
        ...


@contextmanager
def remembering(system: System, history: Array | None) -> Iterator[None]:
    """The system as it was with a `history`; a run that is under way finds it afterwards as it has left it.

    Args:
        system: any; only those that are `Remembering` change.
        history: what it remembered; None for nothing.
    """
    if history is None or not isinstance(system, Remembering):
        yield
        return
    kept = system.history
    system.remember(history)
    try:
        yield
    finally:
        system.remember(kept)


def limited(system: System, q: Array, dq: Array, lam: float) -> Array:
    """The step dq (n,) from q, or as much of it as leaves a tenth of the way to what stands in it.

    Args:
        system: any; only those that are `Limited` shorten steps.
        q: (n,) unknowns.
        dq: (n,) step.
        lam: load parameter of the step, 0 to 1.
    """
    part = clear_part(system, q, dq, lam)
    return dq if part >= 1.0 else 0.9 * part * dq


def clear_part(system: System, q: Array, dq: Array, lam: float, since: float | None = None) -> float:
    """How much of the step dq (n,) from q nothing stands in, 0 to 1.

    Args:
        system: any; nothing stands in the way of those that are not `Limited`.
        q: (n,) unknowns.
        dq: (n,) step.
        lam: load parameter of the step, 0 to 1.
        since: that of q, where it is another one.
    """
    # asked in every iteration: looking for the method takes 0.1 microseconds, `isinstance` of a protocol 20
    free_part: Callable[[Array, Array, float, float | None], float] | None
    free_part = getattr(system, "free_part", None)
    return 1.0 if free_part is None else free_part(q, dq, lam, since)


def meeting(system: System, q: Array, dq: Array, lam: float, since: float) -> float:
    """How much of the step dq (n,) from q leads to where something new begins to press, 0 to 1; 1 where nothing does.

    Args:
        system: any; only those that are `Limited` can meet something.
        q: (n,) unknowns.
        dq: (n,) step.
        lam: load parameter of the step, 0 to 1.
        since: that of q.
    """
    approach: Callable[[Array, Array, float, float], float] | None = getattr(system, "approach", None)
    return 1.0 if approach is None else approach(q, dq, lam, since)


def pressing(system: System, q: Array, lam: float) -> bool:
    """Does anything press at q (n,) that can stand in the way of a step?

    Args:
        system: any; nothing presses in those that are not `Limited`.
        q: (n,) unknowns.
        lam: load parameter of the step, 0 to 1.
    """
    touches: Callable[[Array, float], bool] | None = getattr(system, "pressing", None)
    return touches is not None and touches(q, lam)


def hessian(system: System, q: Array, lam: float) -> Matrix:
    """Second derivative of the energy: the tangent with the element forces of the state itself.

    Args:
        system: that is asked.
        q: (n,) unknowns.
        lam: load parameter of the step, 0 to 1.
    """
    return system.tangent(q, lam, system.evaluate(q, lam).forces).matrix


def grows_ahead(system: System, q: Array, lam: float, measure: Callable[[Array, float], float]) -> bool:
    """Does `measure`, zero in equilibrium, grow to first order along the path's own tangent from an accepted state?

    Args:
        system: of the step.
        q: (n,) unknowns of the state, in equilibrium at `lam`.
        lam: of the state.
        measure: a number of (q, lambda), in parts of its typical size.

    Returns:
        True if it grows by more than a millionth a unit of lambda; False also where the tangent is indefinite.
    """
    try:
        factor = hessian(system, q, lam).factorise(1e-9)
    except IndefiniteError:
        return False
    ahead = 1e-3 * max(lam, 0.01)
    moved = q - ahead * factor.solve(system.control_rate(q, lam))
    return measure(moved, lam + ahead) - measure(q, lam) > 1e-6 * ahead


@runtime_checkable
class Remembering(Protocol):
    """Ability of a system: what it answers may depend on states that were accepted before.

    Between two accepted states it answers as an elastic one whose energy includes what is dissipated on the way from
    the last of them. Who accepts a state says so: `system.remember(system.history_at(q, lam))`.
    """

    @property
    def remembers(self) -> bool:
        """Does it, in this model?"""
        ...

    @property
    def history(self) -> Array:
        """What was accepted last, in the system's own order."""
        ...

    def history_at(self, q: Array, lam: float) -> Array:
        """What is to be remembered where a state is accepted.

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.

        Returns:
            an array of the shape of `history`.
        """
        ...

    def remember(self, history: Array) -> None:
        """Go on from there.

        Args:
            history: as `history_at` gives it.
        """
        ...

    def takes(self, history: Array) -> bool:
        """Can an array from a file be a history of this system?

        Args:
            history: that is asked about.
        """
        ...
