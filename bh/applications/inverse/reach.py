"""Problem C in practice: a crease that ends at a point, found in a library of designs and checked by simulation.

Genetic algorithms draw their designs anew for every target. One library of random designs serves all: its ends are in a
k-d tree, the nearest ones are polished together, and the shortest that ends there is simulated whole. What the simulation
misses is added to the aim and the design polished again, so that the distance that counts is that of the whole strip,
with its error bar where the model has one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from bh.applications.inverse.descent import descend
from bh.applications.inverse.forward import Forward
from bh.applications.inverse.models import Name, model
from bh.applications.inverse.problems import Design, ReachPoint
from bh.applications.inverse.segments import DesignError
from bh.applications.inverse.self_intersection import Projected, SelfIntersectionRule, Swept
from bh.applications.inverse.simulate import Landing, Simulated
from bh.errors import InputError

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
SIZES = {1: 4_000, 2: 20_000}  # random designs of so many segments, which fill their few variables as densely
ALIKE = 1e-3  # curvature over its largest, and mm, by which designs differ that are not the same one
SAME = 0.1  # mm between chain and simulation, below which aiming again changes nothing


@dataclass(frozen=True, eq=False)
class Library:
    """Random designs of n segments that their rules allow, and where they end. The seed makes them reproducible.

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
        """(N, 2 n) variables of `ReachPoint`, (N, n) pinches and (N, 3) ends."""
        rng = np.random.default_rng([self.seed, self.n])
        problem = self.problem(np.zeros(3))
        x = problem.lower + (problem.upper - problem.lower) * rng.random((self.size, 2 * self.n))
        on = rng.random((self.size, self.n)) < 0.5
        fine = problem.violation(x, on) <= 0.0
        x, on = x[fine], on[fine]
        return x, on, problem.end(x, on)

    @cached_property
    def tree(self) -> cKDTree:
        """Of the ends, to look for near ones."""
        return cKDTree(self.designs[2])

    def problem(self, target: Array) -> ReachPoint:
        """The problem of a target (3,), mm."""
        return ReachPoint(self.surrogate, self.n, self.rules, target)

    def nearest(self, target: Array, count: int) -> tuple[Array, Bools]:
        """Candidates in the order of their distance from a point.

        Args:
            target: (3,), mm.
            count: candidates at most.

        Returns:
            variables (c, 2 n) and pinches (c, n) of the candidates.
        """
        x, on, _ = self.designs
        near = np.atleast_1d(self.tree.query(target, k=min(count, len(x)))[1])
        return x[near], on[near]


@cache
def library(n: int, seed: int = 1, name: Name = "converged") -> Library:
    """A library of a model with its shipped data set, made once a process.

    Args:
        n: segments.
        seed: of its random designs.
        name: of the model.
    """
    return Library(model(name), n, SIZES.get(n, 50_000), seed)


@dataclass(frozen=True, eq=False)
class Reached:
    """A design for a target.

    Attributes:
        target: (3,) the point asked for, mm.
        end: (3,) where the chain of its segments ends, mm.
        landing: of the whole simulated strip, or None where that was not asked for.
        clear: the strips do not touch themselves in space (`Swept`).
        simulations: how many it took.
    """

    design: Design
    target: Array
    end: Array
    landing: Landing | None
    clear: bool
    simulations: int

    @property
    def simulated(self) -> Simulated | None:
        """The whole strip on the mesh on which it was simulated."""
        return None if self.landing is None else self.landing.strip

    @property
    def missed(self) -> float:
        """Distance of the chain's end from the target, mm."""
        return float(np.linalg.norm(self.end - self.target))

    @property
    def missed_simulated(self) -> float:
        """Distance of the simulated strip's end from the target, mm; nan where it was not simulated."""
        return math.nan if self.landing is None else float(np.linalg.norm(self.landing.end - self.target))

    @property
    def missed_at_most(self) -> float:
        """The same with its error bar, mm."""
        return math.nan if self.landing is None else self.missed_simulated + self.landing.bar


@dataclass(frozen=True, eq=False)
class Reach:
    """How a point is reached: segments are added until it is, as in Fig. 6.14.

    Attributes:
        most: segments.
        tolerance: of the end, mm.
        candidates: designs polished for each number of segments; the shortest crease of those that end near enough
            is tried first.
        verify: simulate the strip, and aim again up to `rounds` times where that misses by more than `aim`
            (mm), or with its error bar by more than the tolerance.
        clear: prefer designs whose strips clear themselves in space; of the others only where no candidate
            does.
        model: "converged", or "source" for one row of bars and hinges; of no use where libraries are given.
    """

    most: int = 4
    tolerance: float = 1.0
    candidates: int = 48
    verify: bool = True
    rounds: int = 3
    aim: float = 0.5
    clear: bool = True
    seed: int = 1
    libraries: tuple[Library, ...] = ()
    model: Name = "converged"

    def __call__(self, target: ArrayLike) -> Reached:
        """The first design that ends within the tolerance.

        Raises:
            DesignError: a target that is no point, or that no crease of `most` segments reaches.
        """
        point = np.asarray(target, dtype=float)
        if point.shape != (3,) or not np.isfinite(point).all():
            raise DesignError(f"the target {target!r} is no point; give three coordinates in mm")
        second: Reached | None = None
        nearest = math.inf
        for n in range(1, self.most + 1):
            book = self.book(n)
            x, on, near = self._candidates(book, point)
            nearest = min(nearest, near)
            for candidate in zip(x, on, strict=True):
                design = book.problem(point).design(*candidate)
                clear = not self.clear or not Swept().meets(book.surrogate, *_arrays(design))
                if not clear and second is not None:
                    continue
                reached = self._verified(book, point, candidate, clear)
                if reached is not None and clear:
                    return reached
                second = second or reached
            # a strip that meets itself is the answer only where one segment more does no better
            if second is not None and second.design.n < n:
                return second
        if second is not None:
            return second
        x, y, z = point
        raise DesignError(
            f"no crease of up to {self.most} segments was found that ends within {self.tolerance:g} mm of "
            f"({x:g}, {y:g}, {z:g}); the nearest ends {nearest:.3g} mm away"
        )

    def book(self, n: int) -> Library:
        """The library of designs of n segments."""
        return next((book for book in self.libraries if book.n == n), None) or library(
            n, self.seed, self.model
        )

    def _candidates(self, book: Library, point: Array) -> tuple[Array, Bools, float]:
        """Variables (c, 2 n) and pinches (c, n) of polished designs that are near enough, and the nearest distance, mm."""
        problem = book.problem(point)
        x, on = book.nearest(point, self.candidates)
        x = descend(problem, x, on)
        missed, broken = problem.evaluate(x, on)
        missed = np.where(broken <= 0.0, missed, math.inf)
        bars = book.surrogate.bars(*problem.split(x), on)[0]
        good = np.flatnonzero((missed <= self.tolerance) & (bars <= self.tolerance))
        good = good[np.argsort(problem.split(x[good])[1].sum(axis=1), kind="stable")]
        x, on = x[good], on[good]
        once = np.array([not _alike(x[i], on[i], x[:i], on[:i]) for i in range(len(x))], dtype=bool)
        return x[once], on[once], float(missed.min())

    def _verified(
        self, book: Library, point: Array, candidate: tuple[Array, Bools], clear: bool
    ) -> Reached | None:
        """The simulated design, aimed again at what its simulation missed; None where it does not come near enough."""
        problem = book.problem(point)
        x, on = candidate
        best: Reached | None = None
        for count in range(1, self.rounds + 1):
            design = problem.design(x, on)
            end = problem.end(x, on)
            if not self.verify:
                return Reached(design, point, end, None, clear, 0)
            try:
                landing = book.surrogate.land(*design.lists())
            except InputError:  # a flat strip that meets itself cannot be cut: another candidate
                break
            reached = Reached(design, point, end, landing, clear, count)
            if best is None or reached.missed_at_most < best.missed_at_most:
                best = reached
            if best.missed_simulated <= self.aim and best.missed_at_most <= self.tolerance:
                break
            if (
                np.linalg.norm(landing.end - end) < SAME
            ):  # the chain was right: its nearest design is this one
                break
            problem = replace(problem, target=problem.target + point - landing.end)
            x = descend(problem, x[None], on[None])[0]
            if problem.violation(x, on) > 0.0:
                break
        return best if best is not None and best.missed_at_most <= self.tolerance else None


def _arrays(design: Design) -> tuple[Array, Array, Bools]:
    return design.k0, design.length, design.pinched


def _alike(x: Array, on: Bools, others: Array, switches: Bools) -> bool:
    """Whether a candidate (2 n,) is one of others (m, 2 n), but for less than `ALIKE`."""
    same = (np.abs(others - x) < ALIKE).all(axis=1) & (switches == on).all(axis=1)
    return bool(same.any())
