"""How a design is searched: genetic algorithm (pymoo), differential evolution (SciPy), polish by gradients. All seeded.

A problem has continuous variables in a box and switches (pinched or not); an optimiser is an object with `minimise`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from bh.applications.inverse.segments import DesignError

if TYPE_CHECKING:
    from pymoo.core.duplicate import DuplicateElimination
    from pymoo.core.individual import Individual

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
FORBIDDEN = 1e6  # added to the value of a design that breaks a rule, where an optimiser takes no constraints


class Problem(Protocol):
    """What is minimised: candidates are m continuous variables in a box and b switches."""

    @property
    def lower(self) -> Array:
        """(m,) least values of the variables."""

    @property
    def upper(self) -> Array:
        """(m,) largest values of the variables."""

    @property
    def switches(self) -> int:
        """Number of switches, b."""

    def evaluate(self, x: Array, on: Bools) -> tuple[Array, Array]:
        """Values (N,) and violations (N,), 0 where allowed, of candidates x (N, m) and on (N, b).

        Args:
            x: (N, m) candidates.
            on: (N, b) what is switched on.

        Returns:
            values (N,), and violations (N,), not negative.
        """


@dataclass(frozen=True, eq=False)
class Found:
    """The best candidate of a search.

    Attributes:
        x: (m,) variables.
        on: (b,) switches.
        value: what was minimised.
        allowed: whether it breaks no rule.
        evaluations: candidates evaluated.
    """

    x: Array
    on: Bools
    value: float
    allowed: bool
    evaluations: int

    def better(self, other: Found | None) -> bool:
        """Allowed before forbidden, then the smaller value."""
        return other is None or (not self.allowed, self.value) < (not other.allowed, other.value)


class Optimiser(Protocol):
    """A way to search for the best candidate."""

    def minimise(
        self,
        problem: Problem,
        seed: int = 1,
        start: Sequence[tuple[Array, Bools]] = (),
        enough: float = -np.inf,
    ) -> Found:
        """Search from some candidates (or none), until a value of `enough` is met.

        Args:
            problem: what is minimised.
            seed: the same seed gives the same candidate.
            start: initial guesses, variables (m,) and switches (b,) each.
            enough: value at which the search ends.
        """
        ...


def best(problem: Problem, x: Array, on: Bools) -> Found:
    """The best of some candidates.

    Args:
        problem: what is minimised.
        x: (N, m) variables.
        on: (N, b) switches.
    """
    value, violation = problem.evaluate(x, on)
    i = int(np.lexsort((value, violation))[0])
    return Found(x[i], on[i], float(value[i]), bool(violation[i] <= 0.0), len(x))


@dataclass(frozen=True)
class Genetic:
    """pymoo's genetic algorithm for mixed variables; the source used MATLAB's `ga` with 100 generations (6.3.3).

    Attributes:
        population: candidates a generation.
        generations: at most.
        patience: generations without progress after which the search ends.
    """

    population: int = 100
    generations: int = 100
    patience: int = 25

    def minimise(
        self,
        problem: Problem,
        seed: int = 1,
        start: Sequence[tuple[Array, Bools]] = (),
        enough: float = -np.inf,
    ) -> Found:
        """See `Optimiser.minimise`.

        Raises:
            DesignError: pymoo is not installed.
        """
        ea = _pymoo()
        m, b = len(problem.lower), problem.switches
        names = [f"x{i:03d}" for i in range(m)], [f"on{i:03d}" for i in range(b)]

        def arrays(rows: Sequence[Mapping[str, float]]) -> tuple[Array, Bools]:
            x = np.array([[row[n] for n in names[0]] for row in rows], dtype=float).reshape(len(rows), m)
            on = np.array([[row[n] for n in names[1]] for row in rows], dtype=bool).reshape(len(rows), b)
            return x, on

        class Wrapped(ea.Problem):  # type: ignore[misc, name-defined]
            def __init__(self) -> None:
                bounds = zip(problem.lower, problem.upper, strict=True)
                real = {n: ea.Real(bounds=(lo, hi)) for n, (lo, hi) in zip(names[0], bounds, strict=True)}
                super().__init__(vars=real | {n: ea.Binary() for n in names[1]}, n_obj=1, n_ieq_constr=1)

            def _evaluate(
                self, rows: Sequence[Mapping[str, float]], out: dict[str, Array], *_: object, **__: object
            ) -> None:
                value, violation = problem.evaluate(*arrays(rows))
                out["F"], out["G"] = value[:, None], violation[:, None]

        alike = _alike(ea)
        mating = ea.MixedVariableMating(eliminate_duplicates=alike)
        algorithm = ea.MixedVariableGA(pop_size=self.population, mating=mating, eliminate_duplicates=alike)
        algorithm.setup(Wrapped(), termination=("n_gen", self.generations), seed=seed, verbose=False)
        top: Found | None = None
        count, since = 0, 0
        for x, on in start:
            found = best(problem, x[None], on[None])
            top = found if found.better(top) else top
        while algorithm.has_next() and since < self.patience:
            algorithm.next()
            count = algorithm.evaluator.n_eval
            now = algorithm.opt[0]
            x, on = arrays([now.X])
            found = Found(x[0], on[0], float(now.F[0]), bool(now.CV[0] <= 0.0), count)
            better = top is None or not top.allowed or found.value < top.value - 1e-3 * abs(top.value)
            since = 0 if found.better(top) and better else since + 1
            top = found if found.better(top) else top
            if top is not None and top.allowed and top.value <= enough:
                break
        assert top is not None
        return Found(top.x, top.on, top.value, top.allowed, count)


@dataclass(frozen=True)
class Evolution:
    """SciPy's differential evolution; switches are integer variables, rules a penalty.

    Attributes:
        population: candidates for each variable.
        generations: at most.
    """

    population: int = 15
    generations: int = 200

    def minimise(
        self,
        problem: Problem,
        seed: int = 1,
        start: Sequence[tuple[Array, Bools]] = (),
        enough: float = -np.inf,
    ) -> Found:
        """See `Optimiser.minimise`."""
        from scipy.optimize import differential_evolution

        m, b = len(problem.lower), problem.switches
        count = 0

        def cost(columns: Array) -> Array:
            nonlocal count
            rows = np.atleast_2d(columns.T)
            count += len(rows)
            value, violation = problem.evaluate(rows[:, :m], rows[:, m:] > 0.5)
            return value + FORBIDDEN * violation

        bounds = [*zip(problem.lower, problem.upper, strict=True), *([(0.0, 1.0)] * b)]
        found = differential_evolution(
            cost,
            bounds,
            popsize=self.population,
            maxiter=self.generations,
            rng=seed,
            vectorized=True,
            updating="deferred",
            polish=False,
            integrality=[False] * m + [True] * b,
            x0=np.concatenate([start[0][0], start[0][1].astype(float)]) if start else None,
            callback=lambda intermediate_result: bool(intermediate_result.fun <= enough),
        )
        top = best(problem, found.x[None, :m], found.x[None, m:] > 0.5)
        return Found(top.x, top.on, top.value, top.allowed, count)


@dataclass(frozen=True)
class Polished:
    """Another optimiser's answer, then steepest ways down inside the box with its switches kept.

    Least squares (trust region) where the problem has `residuals(x, on)`, else L-BFGS-B on the value; differences are
    taken in one batch.

    Attributes:
        first: the other optimiser.
    """

    first: Optimiser = field(default_factory=Genetic)

    def minimise(
        self,
        problem: Problem,
        seed: int = 1,
        start: Sequence[tuple[Array, Bools]] = (),
        enough: float = -np.inf,
    ) -> Found:
        """See `Optimiser.minimise`."""
        found = self.first.minimise(problem, seed, start, enough)
        better = polish(problem, found.x, found.on)
        more = found.evaluations + better.evaluations
        top = better if better.better(found) else found
        return Found(top.x, top.on, top.value, top.allowed, more)


def polish(problem: Problem, x: Array, on: Bools) -> Found:
    """The local minimum next to a candidate with the same switches; the candidate itself where rules forbid that.

    Args:
        problem: what is minimised.
        x: (m,) variables of the candidate.
        on: (b,) its switches.
    """
    from scipy.optimize import least_squares, minimize

    lower, upper = problem.lower, problem.upper
    width = np.maximum(upper - lower, 1e-300)
    z0 = np.clip((x - lower) / width, 1e-9, 1.0 - 1e-9)
    residuals = getattr(problem, "residuals", None)
    step = 1e-7 if residuals is not None else 1e-6

    def around(z: Array) -> tuple[Array, Bools, Array]:
        """A point and its neighbours inside the box, and their signed distances."""
        inward = np.where(z > 0.5, -step, step)
        trial = lower + width * np.vstack((z, z + np.diag(inward)))
        return trial, np.tile(on, (len(trial), 1)), inward

    if residuals is not None:

        def jacobian(z: Array) -> Array:
            trial, switches, inward = around(z)
            found = residuals(trial, switches)
            return np.asarray(((found[1:] - found[0]) / inward[:, None]).T)

        done = least_squares(
            lambda z: residuals((lower + width * z)[None], on[None])[0],
            z0,
            jacobian,
            bounds=(0.0, 1.0),
            xtol=1e-10,
            ftol=1e-10,
            gtol=1e-10,
            max_nfev=60,
        )
    else:

        def value(z: Array) -> tuple[float, Array]:
            trial, switches, inward = around(z)
            found = problem.evaluate(trial, switches)[0]
            return float(found[0]), (found[1:] - found[0]) / inward

        done = minimize(
            value, z0, jac=True, bounds=[(0.0, 1.0)] * len(x), method="L-BFGS-B", options={"maxiter": 400}
        )
    moved = np.vstack((x, lower + width * np.clip(done.x, 0.0, 1.0)))
    found = best(problem, moved, np.tile(on, (2, 1)))
    return Found(found.x, found.on, found.value, found.allowed, int(done.nfev) + 2)


def _pymoo() -> SimpleNamespace:
    """The parts of pymoo that are used, in one name space."""
    try:
        from pymoo.config import Config
        from pymoo.core.duplicate import DuplicateElimination
        from pymoo.core.mixed import MixedVariableGA, MixedVariableMating
        from pymoo.core.problem import Problem as Base
        from pymoo.core.variable import Binary, Real
    except ImportError as error:
        raise DesignError(
            f"the genetic algorithm needs pymoo ({error}); add the extra: pip install 'curved-crease-workbench[design]'"
        ) from error
    Config.warnings["not_compiled"] = False
    return SimpleNamespace(
        Problem=Base,
        Real=Real,
        Binary=Binary,
        MixedVariableGA=MixedVariableGA,
        MixedVariableMating=MixedVariableMating,
        DuplicateElimination=DuplicateElimination,
    )


def _alike(ea: SimpleNamespace) -> DuplicateElimination:
    """What pymoo leaves out of a generation: candidates that are equal to a later one of it, or to one of another.

    pymoo compares all pairs, variable by variable, which takes more time than all the rest; a set finds the same ones.
    """

    def mark(
        _: object, these: Iterable[Individual], others: Iterable[Individual] | None, marked: Bools
    ) -> Bools:
        keys = [tuple(sorted(each.X.items())) for each in these]
        if others is not None:
            known = {tuple(sorted(each.X.items())) for each in others}
            marked[[key in known for key in keys]] = True
            return marked
        last = {key: place for place, key in enumerate(keys)}
        marked[[last[key] > place for place, key in enumerate(keys)]] = True
        return marked

    found: DuplicateElimination = type("Alike", (ea.DuplicateElimination,), {"_do": mark})()
    return found
