"""Problem C in practice: a crease that ends at a point, found in a library of designs and checked by simulation.

Genetic algorithms draw their designs anew for every target. One library of random designs serves all: its ends are in a
k-d tree, the nearest ones are polished together, and the shortest that ends there is simulated whole. What the
simulation misses is added to the aim and the design polished again, so that the distance that counts is that of the
whole strip, with its error bar where the model has one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from bh.applications.inverse.boxes import depths
from bh.applications.inverse.forward import Forward
from bh.applications.inverse.models import Name, model
from bh.applications.inverse.problems import Design, ReachPoint
from bh.applications.inverse.segments import DesignError
from bh.applications.inverse.self_intersection import Projected, SelfIntersectionRule, Swept
from bh.applications.inverse.sifted import Sifted, Tried
from bh.applications.inverse.simulate import Landing, Simulated
from bh.applications.inverse.tolerances import predicted
from bh.applications.inverse.wants import ReachAll, Wants
from bh.errors import InputError

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Candidate = tuple[ReachAll, Array, Bools]  # with variables (2 n,) and pinches (n,)
SIZES = {1: 4_000, 2: 20_000}  # random designs of so many segments, which fill their few variables as densely
WIDER = (
    20  # candidates that are looked at for each that is polished, where a point is not all that is asked for
)
STEADIED = 24  # of the candidates that move least, which are made to move less
ALIKE = 1e-3  # curvature over its largest, and mm, by which designs differ that are not the same one
BLOCK = 500  # designs whose ends are computed at a time, which stay in the cache: 2.4 times as fast as 50,000
SAME = 0.1  # mm between chain and simulation, below which aiming again changes nothing


@dataclass(frozen=True, eq=False)
class Library:
    """Random designs of n segments and where they end. The seed makes them reproducible.

    Attributes:
        surrogate: the model.
        n: segments.
        size: random designs.
        seed: of them.
        rules: what is forbidden.
    """

    surrogate: Forward
    n: int
    size: int = 50_000
    seed: int = 1
    rules: Sequence[SelfIntersectionRule] = field(default_factory=lambda: (Projected(),))

    @cached_property
    def designs(self) -> tuple[Array, Bools, Array]:
        """(size, 2 n) variables of `ReachPoint`, (size, n) pinches and (size, 3) ends, forbidden ones among them."""
        rng = np.random.default_rng([self.seed, self.n])
        problem = self.problem(np.zeros(3))
        x = problem.lower + (problem.upper - problem.lower) * rng.random((self.size, 2 * self.n))
        on = rng.random((self.size, self.n)) < 0.5
        blocks = [slice(i, i + BLOCK) for i in range(0, self.size, BLOCK)]
        return x, on, np.concatenate([problem.end(x[block], on[block]) for block in blocks])

    @cached_property
    def tree(self) -> cKDTree:
        """Of the ends, to look for near ones."""
        return cKDTree(self.designs[2])

    def problem(self, target: Array) -> ReachPoint:
        """The problem of a target (3,), mm."""
        return ReachPoint(self.surrogate, self.n, self.rules, target)

    def nearest(self, target: Array, count: int) -> tuple[Array, Bools]:
        """Candidates that the rules allow in the order of their distance from a point.

        Args:
            target: (3,), mm.
            count: candidates at most.

        Returns:
            variables (c, 2 n) and pinches (c, n) of the candidates.
        """
        x, on, _ = self.designs
        problem, asked = self.problem(target), count
        while True:  # most designs are allowed, so only those that are near are looked at
            asked = min(2 * asked, len(x))
            near = np.atleast_1d(self.tree.query(target, k=asked)[1])
            near = near[problem.violation(x[near], on[near]) <= 0.0]
            if len(near) >= count or asked == len(x):
                return x[near[:count]], on[near[:count]]


@cache
def library(n: int, seed: int = 1, name: Name = "converged") -> Library:
    """A library of a model with its shipped data set, made once a process.

    Args:
        n: segments.
        seed: of its random designs.
        name: of the model.
    """
    return Library(model(name), n, size_of(n), seed)


def size_of(n: int) -> int:
    """How many random designs of n segments a library has."""
    return SIZES.get(n, Library.size)


@dataclass(frozen=True, eq=False)
class Reached:
    """A design for a target.

    Attributes:
        design: crease and pinches.
        wants: what was asked for.
        end: (3,) where the chain of its segments ends, mm.
        missed: largest distance of the chain of its segments from a point that was asked for, mm.
        turned: angle of its end from the direction that was asked for, rad; 0 where there was none.
        landing: of the whole simulated strip, or None where that was not asked for.
        missed_simulated: as `missed`, of the simulated strip; nan where it was not simulated.
        turned_simulated: as `turned`.
        bar: error bar of `missed_simulated`, mm.
        turn_bar: error bar of `turned_simulated`, rad.
        clear: the strips do not touch themselves in space (`Swept`).
        simulations: how many rounds it took.
    """

    design: Design
    wants: Wants
    end: Array
    missed: float
    turned: float
    landing: Landing | None = None
    missed_simulated: float = math.nan
    turned_simulated: float = math.nan
    bar: float = math.nan
    turn_bar: float = math.nan
    clear: bool = True
    simulations: int = 0

    @property
    def simulated(self) -> Simulated | None:
        """The whole strip on the mesh on which it was simulated."""
        return None if self.landing is None else self.landing.strip

    @property
    def target(self) -> Array:
        """(3,) the point asked for, mm."""
        return self.wants.point

    @property
    def missed_at_most(self) -> float:
        """Distance of the simulated strip with its error bar, mm."""
        return self.missed_simulated + self.bar

    @property
    def turned_at_most(self) -> float:
        """Angle of the simulated strip with its error bar, rad."""
        return self.turned_simulated + self.turn_bar if self.wants.directed else 0.0


@dataclass(frozen=True, eq=False)
class Reach:
    """How a point is reached: segments are added until it is, as in Fig. 6.14.

    Attributes:
        most: segments.
        tolerance: of the end, mm.
        angle: of its direction, rad, where one is asked for.
        candidates: designs polished for each number of segments.
        verify: simulate the strip, and aim again up to `rounds` times where that misses by more than `aim`
            (mm), or with its error bar by more than the tolerance.
        clear: prefer designs whose strips clear themselves in space; of the others only where no candidate
            does.
        prefer: which of the candidates that end near enough is tried first: the "short" one, or the "robust" one,
            whose end moves least with what is not made exactly (`tolerances.predicted`), of as few segments as do and
            of one more.
        seed: of the random designs.
        libraries: of random designs; where there is none of a number of segments, those of the model.
        model: "converged", or "source" for one row of bars and hinges; of no use where libraries are given.
    """

    most: int = 4
    tolerance: float = 1.0
    angle: float = math.radians(1.0)
    candidates: int = 48
    verify: bool = True
    rounds: int = 3
    aim: float = 0.5
    clear: bool = True
    prefer: Literal["short", "robust"] = "short"
    seed: int = 1
    libraries: tuple[Library, ...] = ()
    model: Name = "converged"

    def __call__(self, target: ArrayLike | Wants) -> Reached:
        """The first design that does what is asked for.

        Args:
            target: (3,) point, mm, or all that is asked for.

        Raises:
            DesignError: a target that is no point, or that no crease of `most` segments reaches.
        """
        wants = target if isinstance(target, Wants) else Wants.of(target)
        second: Reached | None = None
        sifted = Sifted()
        for group in self._groups(wants, sifted):
            for problem, x, on in group:
                design = problem.design(x, on)
                clear = not self.clear or not Swept().meets(problem.surrogate, *_arrays(design))
                if not clear and second is not None:
                    continue
                reached = self._verified(problem, x, on, clear)
                if reached is not None and clear:
                    return reached
                second = second or reached
            # a strip that meets itself is the answer only where one segment more does no better
            if second is not None and second.design.n < group[0][0].n:
                return second
        if second is not None:
            return second
        raise DesignError(sifted.told(wants, self.most, self.tolerance, self.angle))

    def _groups(self, wants: Wants, sifted: Sifted) -> Iterator[list[Candidate]]:
        """Candidates of one segment, of two, ..., the preferred first; robust ones with those of a segment more."""
        before: list[Candidate] = []
        for n in range(1, self.most + 1):
            book = self.book(n)
            problem = ReachAll(book.surrogate, n, book.rules, wants.point, wants, np.zeros(1))
            here = [(problem, x, on) for x, on in self._candidates(book, problem, sifted)]
            if self.prefer == "short":
                yield from [here] if here else []
                continue
            both = [*before, *here]
            if both and (before or n == self.most):
                both.sort(key=lambda each: float(self._moves(each[0], each[1][None], each[2][None])[0]))
                yield both
            before = here

    def book(self, n: int) -> Library:
        """The library of designs of n segments."""
        return next((book for book in self.libraries if book.n == n), None) or library(
            n, self.seed, self.model
        )

    def _candidates(self, book: Library, problem: ReachAll, sifted: Sifted) -> list[tuple[Array, Bools]]:
        """Variables (2 n,) and pinches (n,) of polished designs that are near enough, the preferred ones first."""
        wants = problem.wants
        simple = not wants.directed and not wants.stops and not len(wants.keep_out)
        count = self.candidates if simple and self.prefer == "short" else 4 * self.candidates
        x, on = book.nearest(wants.point, count if simple else WIDER * count)
        if not simple:
            first = np.argsort(np.linalg.norm(problem.residuals(x, on), axis=1), kind="stable")[:count]
            x, on = x[first], on[first]
        x = problem.polished(x, on)
        x, on = self._good(problem, x, on, sifted)
        if self.prefer == "robust":
            first = np.argsort(self._moves(problem, x, on), kind="stable")[:STEADIED]
            x, on = x[first], on[first]
            steady = problem.steadied(x, on)
            x, on = self._good(problem, np.concatenate((steady, x)), np.concatenate((on, on)), sifted)
            order = np.argsort(self._moves(problem, x, on), kind="stable")
        else:
            order = np.argsort(problem.split(x)[1].sum(axis=1), kind="stable")
        x, on = x[order], on[order]
        found = []
        for i in range(len(x)):
            if _alike(x[i], on[i], x[:i], on[:i]):
                continue
            if wants.free(problem.design(x[i], on[i]), book.surrogate):
                found.append((x[i], on[i]))
        return found

    def _good(self, problem: ReachAll, x: Array, on: Bools, sifted: Sifted) -> tuple[Array, Bools]:
        """Those of some candidates that obey the rules and are near enough by the chain."""
        if not len(x):
            return x, on
        bare = problem.bare(x, on)
        missed, turned = problem.off(bare)
        legal = problem.violation(x, on) <= 0.0
        inside = depths(problem.surrogate, problem.wants.keep_out, *problem.split(x), on)
        clear = np.asarray((inside <= 0.0).all(axis=1))
        bars = problem.surrogate.bars(*problem.split(x), on)[0]
        ends = problem.wants.point + bare[:, :3]
        sifted.add(Tried(ends, missed, turned, bars, legal, clear), self.tolerance)
        good = legal & (missed <= self.tolerance) & (turned <= self.angle) & (bars <= self.tolerance)
        return x[good], on[good]

    def _moves(self, problem: ReachAll, x: Array, on: Bools) -> Array:
        """(N,) how far ends are off in the mean, mm."""
        if not len(x):
            return np.zeros(0)
        return predicted(problem.surrogate, *problem.split(x), on).size

    def _verified(self, problem: ReachAll, x: Array, on: Bools, clear: bool) -> Reached | None:
        """The simulated design, aimed again at what its simulation missed; None where it does not come near enough."""
        best: Reached | None = None
        for count in range(1, self.rounds + 1):
            design = problem.design(x, on)
            bare = problem.bare(x[None], on[None])[0]
            missed, turned = (float(value) for value in problem.off(bare))
            reached = Reached(design, problem.wants, problem.end(x, on), missed, turned, clear=clear)
            if not self.verify:
                return reached
            try:
                landing, there, bar, turn_bar = problem.landed(design)
            except InputError:  # a flat strip that meets itself cannot be cut: another candidate
                break
            missed, turned = (float(value) for value in problem.off(there))
            reached = replace(
                reached,
                landing=landing,
                missed_simulated=missed,
                turned_simulated=turned,
                bar=bar,
                turn_bar=turn_bar,
                simulations=count,
            )
            if best is None or self._badness(reached) < self._badness(best):
                best = reached
            if best.missed_simulated <= self.aim and self._badness(best) <= 1.0:
                break
            if np.linalg.norm(there - bare) < SAME:  # the chain was right: its nearest design is this one
                break
            problem = problem.shifted(there, x, on)
            x = problem.polished(x[None], on[None])[0]
            if problem.violation(x, on) > 0.0 or not problem.wants.free(
                problem.design(x, on), problem.surrogate
            ):
                break
        return best if best is not None and self._badness(best) <= 1.0 else None

    def _badness(self, reached: Reached) -> float:
        """Distance and angle with their error bars over what is allowed, the larger one."""
        return max(reached.missed_at_most / self.tolerance, reached.turned_at_most / self.angle)


def _arrays(design: Design) -> tuple[Array, Array, Bools]:
    return design.k0, design.length, design.pinched


def _alike(x: Array, on: Bools, others: Array, switches: Bools) -> bool:
    """Whether a candidate (2 n,) is one of others (m, 2 n), but for less than `ALIKE`."""
    same = (np.abs(others - x) < ALIKE).all(axis=1) & (switches == on).all(axis=1)
    return bool(same.any())
