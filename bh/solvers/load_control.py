"""Load control: how far to go in lambda, from which guess, and what to do when an increment fails."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bh.solvers.branching import NO_BRANCH, Branch, onto_stable_branch
from bh.solvers.creeping import CREEPS
from bh.solvers.follower import conservative
from bh.solvers.hindrance import clear_guess, found_apart, slipped, up_to_contact
from bh.solvers.matrices import IndefiniteError
from bh.solvers.modes import GAP, KNOWN_GAP, count_negative, neutral_mode
from bh.solvers.newton import ALONG, INDEFINITE, Newton, Solution
from bh.solvers.outcome import Outcome
from bh.solvers.phase import settle
from bh.solvers.points import (
    CriticalPoint,
    Increment,
    Point,
    extrapolate,
    fold_ahead,
    lambda_after,
    point,
    power_rate,
)
from bh.solvers.snapping import FALLS, fall, lets_go
from bh.solvers.stability import leave_saddle, locate
from bh.solvers.system import System

Array = NDArray[np.float64]
LOOK = 2  # cuts of an increment before a bifurcation is looked for
AtBifurcation = Literal["stable", "primary", "stop"]


@dataclass(frozen=True)
class _Trial:
    """A solve at one lambda: the state, how it was found on the branch (`primary`), and why it cannot be accepted."""

    point: Point
    solution: Solution
    primary: Solution
    objection: str
    note: str
    iterations: int
    branch: Branch = NO_BRANCH

    @property
    def failure(self) -> Outcome:
        """The outcome of a step that ends here."""
        unstable = self.solution.converged and self.solution.stable is False
        return Outcome.BIFURCATION if unstable else Outcome.STALLED


@dataclass(frozen=True)
class LoadControl:
    """Adaptive increments of lambda with extrapolated starts.

    It begins with large increments and cuts early: one that does not contract is given up after a few iterations,
    and one that is accepted has the work of the actuation to show for its energy. The guess is the polynomial through
    the last three states and their element forces.

    Attributes:
        first_rotation, largest_rotation: increments where angles are imposed, rad.
        first, largest: increments of lambda where no angle is.
        cautious_rotation: first increment behind a limit point, rad (`first` where no angle is imposed); a state
            without history may take globalised Newton from half of it down.
        goal, full_goal: iterations up to which increments grow, by a factor of 1.7 at most; where angles are imposed
            they grow by 2. What ends a step by a snap or by buckling is a load or a displacement, seldom an angle.
        smallest: part of the step below which an increment gives up.
        work_mismatch: largest relative difference between the energy gained in an increment and the work of the
            actuation (trapezoidal rule, corrected by the slopes at the ends where that alone would object); a larger
            one means that the state jumped to another branch.
        brisk: cuts of an increment before globalised Newton is tried.
        at_bifurcation: where the branch loses its stability, go on along the stable branch of lowest energy
            ("stable"), stay on the one that is not stable ("primary"), or end with the outcome "bifurcation" ("stop").
        foresee: hand over as soon as the last states point at a limit point in the next increment, instead of
            finding out by cutting it; only of use where something else can pass it (`Automatic`).
        guess: unknowns (n,) near an equilibrium of a system at a lambda, or None: tried where Newton's method finds no
            way from the last states, before the energy is minimised.
        locate: whether critical points that an increment passes are located, by bisection, and recorded; the states
            are the same without.
    """

    first_rotation: float = math.radians(90.0)
    largest_rotation: float = math.radians(90.0)
    first: float = 0.1
    largest: float = 0.34
    cautious_rotation: float = math.radians(15.0)
    goal: int = 5
    full_goal: int = 8
    smallest: float = 1e-5
    work_mismatch: float = 0.2
    newton: Newton = field(default_factory=Newton)
    brisk: int = 2
    at_bifurcation: AtBifurcation = "stable"
    foresee: bool = False
    guess: Callable[[System, float], Array | None] | None = field(default=None, compare=False)
    locate: bool = True

    def limits(self, system: System) -> tuple[float, float]:
        """First and largest increment of lambda for a system."""
        if system.rotation > 0.0:
            return min(1.0, self.first_rotation / system.rotation), min(
                1.0, self.largest_rotation / system.rotation
            )
        return self.first, self.largest

    def cautious(self, system: System) -> float:
        """Increment of lambda where nothing is known of the path's course."""
        first = self.limits(system)[0]
        return min(first, self.cautious_rotation / system.rotation) if system.rotation > 0.0 else first

    def follow(
        self,
        system: System,
        history: Sequence[Point],
        increment: float | None = None,
        origin: Point | None = None,
    ) -> Iterator[Increment]:
        """Go from the last point of `history` to lambda = 1; yields every accepted increment, or one failure last.

        `history` holds one to three accepted points of this step; `increment` is the next one to try, if known.
        """
        points = list(history)
        first, largest = self.limits(system)
        step = first if increment is None else increment
        cuts: list[str] = []
        iterations, looked, apart = 0, False, True  # apart: nothing has been met so far
        held: Array | None = None  # the neutral mode, once the path has one
        while points[-1].lam < 1.0:
            here = points[-1]
            attempt = partial(self._try, system, points, brisk=True, look=False, held=held)
            lam, free, apart, spent = found_apart(
                system, points, lambda_after(here.lam, step), apart, attempt
            )
            lam, meets = (lam, False) if free else up_to_contact(system, points, lam)
            fold = fold_ahead(points, system.primal)
            if self.foresee and fold <= lam and len(cuts) > 2:
                note = f"a limit point is seen at lambda {fold:.6g}; {cuts[-1]}"
                yield Increment(
                    here, Outcome.LIMIT_POINT, iterations, math.nan, step, cuts=tuple(cuts), note=note
                )
                return
            alone = len(points) == 1
            brisk = lam - here.lam > 0.5 * self.cautious(system) if alone else len(cuts) < self.brisk
            brisk = brisk and not meets  # what slips off as it meets is let go downhill at once
            look = self.at_bifurcation == "stable" and len(cuts) >= LOOK and not looked
            if len(cuts) == 1 and held is None:  # a step may begin on a buckled ring
                held = _neutral(system, here, known=False)
            tried = free or self._minding_slips(
                system, here, self._try(system, points, lam, brisk, look, held), len(cuts)
            )
            iterations += spent + tried.iterations
            looked = looked or bool(tried.branch.critical)
            if tried.branch.points:
                yield from tried.branch.increments(tuple(cuts), iterations)
                points, looked = list(tried.branch.points[-3:]), False
                held = _neutral(system, points[-1], known=held is not None)
                step = max(2.0 * self.smallest, points[-1].lam - tried.branch.critical[0].lam)
                cuts, iterations = [], 0
                continue
            imbalance = tried.solution.evaluation.imbalance
            if tried.objection and len(cuts) >= FALLS and self.at_bifurcation == "stable" and lets_go(system):
                tried = _fallen(system, here, lam, tried, self.newton)
                iterations += tried.iterations
            if tried.objection:
                cuts.append(f"lambda {lam:.6g}: {tried.objection}")
                step = 0.5 * (lam - here.lam)
                if step < self.smallest:
                    outcome = Outcome.LIMIT_POINT if fold <= lam else tried.failure
                    yield Increment(
                        here, outcome, iterations, imbalance, step, cuts=tuple(cuts), note=tried.objection
                    )
                    return
                continue
            if held is not None or cuts or tried.solution.globalised:
                held = _neutral(system, tried.point, known=held is not None)
            critical = self._critical(system, here, tried.primary, lam)
            if self.at_bifurcation == "stop" and tried.solution.negative:
                yield _stopped(here, lam, iterations, imbalance, step, tuple(cuts), critical)
                return
            points = [tried.point] if tried.note else [*points[-2:], tried.point]
            imposed = system.rotation > 0.0
            step = min(largest, self._next(lam - here.lam, tried.solution.iterations, bool(cuts), imposed))
            yield Increment(
                tried.point, Outcome.REACHED, iterations, imbalance, step, tuple(cuts), tried.note, bool(tried.note),
                critical, tried.solution.factorised,
            )  # fmt: skip
            cuts, iterations, looked = [], 0, False

    def _try(
        self, system: System, points: Sequence[Point], lam: float, brisk: bool, look: bool, held: Array | None
    ) -> _Trial:
        """One solve at `lam`, from the branch's stable side if it is unstable there, and what is to be said against it.

        A shorter increment is a cheaper remedy than globalised Newton, so that is left out where `brisk`. Where `look`,
        a branch that is lost for an indefinite tangent is looked for behind a bifurcation first. `held` is a neutral
        mode that is left alone.
        """
        here = points[-1]
        newton = replace(
            self.newton, unstable=self.at_bifurcation != "stable", held=held, keep=lam >= 1.0
        )  # where a step ends more is asked of the state
        method = replace(newton, globalised=0, hasty=True) if brisk or look else newton
        tangent = self._tangent_guess(system, points, lam)
        q, forces = clear_guess(system, here, lam, extrapolate(points, lam), tangent)
        found = method.solve(system, q, lam, forces, tangent)
        primary = found = found if held is None else settle(system, found, lam, newton)
        iterations, note, branch = found.iterations, "", NO_BRANCH
        lost = look and not brisk and not found.converged
        if lost and self.guess is not None and (near := self.guess(system, lam)) is not None:
            # no element forces go with it: the strain of interpolated positions is large, and none of the sheet's
            found = newton.solve_full(system, near, lam, np.zeros_like(here.forces))
            primary = found = settle(system, found, lam, newton)
            iterations += found.iterations
        if lost and not found.converged:
            primary = found = downhill(system, q, lam, newton)
            iterations += found.iterations
        # with one state only the increments are still large, and cutting them costs less than looking
        if look and (not found.converged if lost else _lost(found) and len(points) > 1):
            branch = onto_stable_branch(system, here, lam, self.newton)
            iterations += branch.iterations
            if branch.points:
                return _Trial(here, found, primary, "", "", iterations, branch)
        if lost and not found.converged:
            primary = found = replace(newton, full=0, globalised=1).solve(system, found.q, lam)
            iterations += found.iterations
        if not found.converged:  # it may hold anything; nothing is asked of it
            return _Trial(here, found, primary, found.reason, "", iterations, branch)
        there = point(system, found.q, lam, evaluation=found.evaluation, negative=found.negative)
        objection = jump(system, here, there, self.work_mismatch)
        if not objection and not found.stable and self.at_bifurcation == "stable":
            found, note = leave_saddle(system, found, lam, self.newton)
            iterations += found.iterations
            there = point(system, found.q, lam, evaluation=found.evaluation, negative=found.negative)
            # the stable state may be far, but not on the other side of a closed hinge
            objection = system.penetration(here.q, here.lam, there.q, lam) if note else found.reason
        return _Trial(there, found, primary, objection, note, iterations, branch)

    def _minding_slips(self, system: System, here: Point, tried: _Trial, cuts: int) -> _Trial:
        """A trial that objects to a slip of what presses; where increments were cut before, one that tells of it."""
        if tried.objection or tried.note or tried.branch.points:
            return tried
        slip = slipped(system, here, tried.point)
        if not slip:
            return tried
        return replace(tried, objection=slip) if cuts < LOOK else replace(tried, note=slip)

    def _critical(
        self, system: System, here: Point, found: Solution, lam: float
    ) -> tuple[CriticalPoint, ...]:
        """What lies between the last state and the one found at `lam` on its branch, if stability changed."""
        if not (self.locate and found.converged) or found.negative is None:
            return ()
        before = here.negative
        if before is None:  # where a step begins nobody has looked yet
            matrix = system.tangent(here.q, here.lam, here.forces).matrix if found.negative else None
            before = 0 if matrix is None else count_negative(matrix)
        if before == found.negative:
            return ()
        there = point(system, found.q, lam, evaluation=found.evaluation)
        return locate(system, here, there, (before, found.negative), self.newton.tolerance)

    def _next(self, taken: float, iterations: int, was_cut: bool, imposed: bool) -> float:
        """The next increment of lambda after one of size `taken`; one that was cut is not followed by a larger one."""
        goal, most = (self.full_goal, 2.0) if imposed else (self.goal, 1.7)
        growth = min(1.0 if was_cut else most, max(0.5, math.sqrt(goal / max(iterations, 1))))
        # slow but successful increments must not shrink away
        return max(10.0 * self.smallest, growth * taken)

    @staticmethod
    def _tangent_guess(
        system: System, points: Sequence[Point], lam: float
    ) -> Callable[[], tuple[Array, Array]] | None:
        """The first-order prediction from the last point: less accurate, but of the path's own tangent.

        Where the path bends sharply the extrapolated forces can make a tangent indefinite that is not.
        """
        if len(points) < 2:
            return None

        def guess() -> tuple[Array, Array]:
            here = points[-1]
            tangent = system.tangent(here.q, here.lam, here.forces)
            try:
                factor, _ = tangent.matrix.factorise_any()
            except IndefiniteError:
                return here.q, here.forces
            change = -(lam - here.lam) * factor.solve(system.control_rate(here.q, here.lam))
            return here.q + change, tangent.predicted_forces(here.forces, change)

        return guess


def _stopped(
    here: Point,
    lam: float,
    iterations: int,
    imbalance: float,
    step: float,
    cuts: tuple[str, ...],
    critical: tuple[CriticalPoint, ...],
) -> Increment:
    """The end of a step that stops where its branch loses its stability, before `lam`."""
    where = f" at lambda {critical[0].lam:.6g}" if critical else f" before lambda {lam:.6g}"
    note = f"the branch loses its stability{where}"
    return Increment(here, Outcome.BIFURCATION, iterations, imbalance, step, cuts, note, critical=critical)


def jump(system: System, here: Point, there: Point, mismatch: float) -> str:
    """Why two states are not neighbours on one branch, or an empty string.

    Args:
        system: whose states they are.
        here: the first.
        there: the second.
        mismatch: largest relative difference between the energy gained and the work of the actuation.

    Returns:
        one clause, or an empty string.
    """
    turned = system.objection(here.q, here.lam, there.q, there.lam)
    if turned:
        return turned
    if not conservative(system):  # what follows the sheet has no energy to tell a jump by
        return ""
    gained = there.energy - here.energy
    taken = there.lam - here.lam
    size = max(abs(here.power), abs(there.power)) * abs(taken)
    noise = 1e-9 * max(abs(here.energy), abs(there.energy)) + 1e-15 * system.energy_scale
    most = mismatch * size + noise
    work = 0.5 * (here.power + there.power) * taken
    if abs(gained - work) > most:
        # a long increment on a curved path; the slopes at its ends tell that from a jump
        work += taken**2 / 12.0 * (power_rate(system, here) - power_rate(system, there))
        if not abs(gained - work) <= most:  # nor if the slopes are not known
            return f"energy gained ({gained:.3g}) is not the work done ({work:.3g} N mm)"
    return ""


def downhill(system: System, q: Array, lam: float, newton: Newton) -> Solution:
    """By minimising the energy; where that creeps, along the mode that hardly resists, and else on as before.

    Args:
        system: whose equilibrium is sought.
        q: (n,) where to begin.
        lam: load parameter of the step, 0 to 1.
        newton: settings.
    """
    method = replace(newton, full=0, transient=None)
    found = replace(method, impatient=True).solve(system, q, lam)
    creeps = found.reason == CREEPS
    settled = settle(system, replace(found, reason=ALONG) if creeps else found, lam, newton)
    if settled.converged or not creeps:
        return settled
    left = replace(method, globalised=max(1, method.globalised - found.iterations))
    onward = settle(system, left.solve(system, found.q, lam), lam, newton)
    return replace(onward, iterations=settled.iterations + onward.iterations)


def _lost(found: Solution) -> bool:
    """Whether a branch has no stable state where Newton's method went."""
    return found.reason == INDEFINITE or found.stable is False


def _fallen(system: System, here: Point, lam: float, tried: _Trial, newton: Newton) -> _Trial:
    """A trial that has found no state near by, where the sheet is let fall to one; as it was where there is none."""
    found, note = fall(system, here, lam, newton)
    if not note:
        return replace(tried, iterations=found.iterations)
    there = point(system, found.q, lam, evaluation=found.evaluation, negative=found.negative)
    return _Trial(there, found, found, "", note, found.iterations)


def _neutral(system: System, here: Point, known: bool) -> Array | None:
    """(primal,) the neutral mode of a state, None where it has none; one that was `known` before may be less so."""
    matrix = system.tangent(here.q, here.lam, here.forces).matrix
    found = neutral_mode(matrix, system.primal, KNOWN_GAP if known else GAP)
    return None if found is None else found.mode
