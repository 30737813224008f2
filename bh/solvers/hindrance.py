"""What load control does about things that can stand in its way: increments tried without them, up to them, past them.

All of it is for systems that are `Hindered` (panels that stop each other, in `bh.mechanics`); others are left alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from bh.solvers.lagging import Lagging
from bh.solvers.matrices import IndefiniteError
from bh.solvers.points import Point, extrapolate, ways
from bh.solvers.system import Hindered, System, clear_part, meeting, pressing

Array = NDArray[np.float64]
SMALLEST = 1e-5  # part of a step that an increment up to a contact may be
APPROACHES = 2  # states that are looked for on a way before what stands in it is reckoned with
WAYS = 4  # straight ones that an increment is looked at in
SHORT_OF = 0.98  # of the way to what stands there
LEAST_CLEAR = 0.2  # of an increment, for a shorter one to be worth it
SLIPPED = 1.0  # of the way of the faster end: a straight way with one corner misses by less


class Tried(Protocol):
    """A solve at one lambda, and what is to be said against it."""

    @property
    def point(self) -> Point:
        """The state."""
        ...

    @property
    def objection(self) -> str:
        """Why it cannot be accepted, or an empty string."""
        ...

    @property
    def note(self) -> str:
        """What is to be said of it, or an empty string."""
        ...

    @property
    def iterations(self) -> int:
        """That it took."""
        ...


T = TypeVar("T", bound=Tried)


def found_apart(
    system: System, points: Sequence[Point], lam: float, apart: bool, attempt: Callable[[float], T]
) -> tuple[float, T | None, bool, int]:
    """A state that is found as if nothing could stand in the way, if the way to it is clear.

    The way is along the polynomial through the last states and the new one. Where it is not clear, a state just
    before what stands there is looked for in the same manner.

    Args:
        system: of the step.
        points: last ones of the path, in order.
        lam: where the increment leads to.
        apart: has nothing been met so far? Else nothing is tried.
        attempt: solves at a lambda.

    Returns:
        lambda of the state or of the increment to try, the state or None, whether nothing has been met so far,
        and the iterations that led to nothing.
    """
    here, spent, asked = points[-1], 0, lam
    if not (apart and isinstance(system, Hindered) and system.hindered):
        return lam, None, False, 0
    if pressing(system, here.q, here.lam):
        return lam, None, False, 0
    for _ in range(APPROACHES):
        with system.unhindered():
            tried = attempt(lam)
        spent += tried.iterations
        if tried.objection or tried.note:
            return lam, None, True, spent
        clear = system.clear_ways(ways(points, tried.point, WAYS)) / WAYS
        if clear >= 1.0:
            return lam, tried, True, spent - tried.iterations
        if clear < LEAST_CLEAR:  # it may be nothing at all
            return asked, None, False, spent
        lam = here.lam + SHORT_OF * clear * (lam - here.lam)
    return lam, None, False, spent


def up_to_contact(system: System, points: Sequence[Point], lam: float) -> tuple[float, bool]:
    """`lam`, or where before it the extrapolated path meets something; and whether anything presses there or here.

    Args:
        system: of the step.
        points: last ones of the path, in order.
        lam: where the increment leads to.

    Returns:
        lambda to try, and whether something presses at its ends.
    """
    here = points[-1]
    meets = pressing(system, here.q, here.lam)
    for _ in range(2):
        q, _ = extrapolate(points, lam)
        part = meeting(system, here.q, q - here.q, lam, here.lam)
        if part >= 1.0 or part * (lam - here.lam) < SMALLEST:
            break
        lam, meets = here.lam + part * (lam - here.lam), True
    return lam, meets


def clear_guess(
    system: System,
    here: Point,
    lam: float,
    guess: tuple[Array, Array],
    other: Callable[[], tuple[Array, Array]] | None,
) -> tuple[Array, Array]:
    """A guess and its element forces, another one if something stands in its way, or as much of it as is clear.

    Args:
        system: of the step.
        here: the last point of the path.
        lam: where the increment leads to.
        guess: unknowns (n,) and element forces (f,).
        other: makes another guess; None without.

    Returns:
        unknowns (n,) and element forces (f,) to which nothing stands in the way.
    """
    part = clear_part(system, here.q, guess[0] - here.q, lam, here.lam)
    if part >= 1.0:
        return guess
    if other is not None:
        tangent = other()
        along = clear_part(system, here.q, tangent[0] - here.q, lam, here.lam)
        if along > part:
            part, guess = along, tangent
    part = 1.0 if part >= 1.0 else 0.9 * part
    return here.q + part * (guess[0] - here.q), here.forces + part * (guess[1] - here.forces)


def slipped(system: System, here: Point, there: Point) -> str:
    """Whether two states that press are on two branches, by the ways that they would take themselves; else empty.

    Energies do not tell: what slips along something without friction may gain what the actuation gives to the last
    per mille. The shapes half way, by the tangent of the path at either end, differ by less than the faster of the two
    moves in the increment, also where the way between has a corner because something begins to press.

    Args:
        system: of the step.
        here: the last point of the path.
        there: the next one.
    """
    if not (isinstance(system, Hindered) and system.hindered):
        return ""
    if isinstance(system, Lagging) and system.lags:  # what slides does not go back the way it came
        return ""
    if not (pressing(system, here.q, here.lam) or pressing(system, there.q, there.lam)):
        return ""
    taken = there.lam - here.lam
    try:
        ahead, behind = (taken * path_rate(system, at) for at in (here, there))
    except IndefiniteError:
        return ""
    middle = 0.5 * (here.lam + there.lam)
    missed = system.reshaped((here.q + 0.5 * ahead, middle), (there.q - 0.5 * behind, middle))
    moved = max(
        system.reshaped((here.q, here.lam), (here.q + ahead, there.lam)),
        system.reshaped((there.q - behind, here.lam), (there.q, there.lam)),
    )
    if missed <= SLIPPED * moved:
        return ""
    far = missed / max(moved, 1e-300)
    return f"panels slip in a jump before lambda {there.lam:.6g}, {far:.3g} times as far as they move"


def path_rate(system: System, at: Point) -> Array:
    """(n,) rate of the unknowns with lambda along the path's own tangent.

    Args:
        system: of the step.
        at: a point of the path.

    Raises:
        IndefiniteError: the state is critical.
    """
    factor, _ = system.tangent(at.q, at.lam, at.forces).matrix.factorise_any()
    return -factor.solve(system.control_rate(at.q, at.lam))
