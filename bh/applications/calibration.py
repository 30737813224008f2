"""Numbers of a model from a test: crease stiffness, moduli, thickness, rest angles by bounded least squares."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.applications.calibrated import Calibration, Part, Start
from bh.applications.readings import Measured, Reading
from bh.errors import InputError, ModelError
from bh.model.model import Model
from bh.model.sheet import Sheet
from bh.model.zones import changed as other_sheet
from bh.paths.path import Path
from bh.solving.neighbour import neighbour
from bh.solving.trace import trace

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

__all__ = ["Calibration", "Measured", "calibrate", "fit"]

Array = NDArray[np.float64]
NUDGE = 1e-3  # of a parameter's range or value: its central difference
SAME = 1e-6  # of the largest datum: predictions by states beside and by a whole path are one
BLIND = 0.5  # relative standard deviation from which on a combination of parameters is not told by the data
RANK = 1e-7  # smallest singular value over the largest, below which nothing at all is told


Bounds = tuple[float, float, float]
Build = Callable[[Mapping[str, float]], Model]
Tell = Callable[[str], None]


def calibrate(
    model: Model | Build,
    data: Reading | Sequence[Reading],
    free: Mapping[str, Bounds],
    starts: int = 1,
    seed: int = 0,
    progress: Tell | None = None,
) -> Calibration:
    """Find parameters of a model by what was measured at the ends of its steps.

    A bounded trust region (SciPy's `least_squares`) moves all parameters at once; derivatives are central differences.
    Solutions begin at the states of those before (`bh.solving.neighbour`), of which a step takes a few iterations; the
    last one is solved from its beginning, and where that is another state everything is.

    Args:
        model: with all its steps; data are of their ends. Or what makes it of the parameters by their names.
        data: what was measured: `Measured`, `Scanned`, or several of them, each with its noise.
        free: by name ("sheet.E", "creases.NAME.Lstar", ...) where to begin, and the least and the largest value.
        starts: how many beginnings are tried: the given one, and others at random between the bounds.
        seed: of those.
        progress: is told a line now and then.

    Raises:
        ModelError: a name that the model has not, bounds that cannot be, more parameters than data, data of steps that
            there are not, or a path that does not reach the end of its steps.
    """
    sets: list[Reading] = [data] if not isinstance(data, Sequence) else list(data)
    names = tuple(free)
    for name in names:
        _checked(name, free[name])
    build = model if not isinstance(model, Model) else partial(_changed, model)
    first = build({name: free[name][0] for name in names})
    for each in sets:
        each.check(first)
    measured = np.concatenate([each.measured() for each in sets])
    if len({each.noise is None for each in sets}) > 1 or (len(sets) > 1 and sets[0].noise is None):
        raise ModelError("several kinds of data are weighed by their noise; give each a sigma")
    sigma = np.concatenate([np.full(len(each.measured()), each.noise or 1.0) for each in sets])
    known = sets[0].noise is not None

    def at(values: Array) -> Model:
        return build(dict(zip(names, values.tolist(), strict=True)))

    def fitted_by(solver: Solver) -> Calibration:
        weights = sigma if known else None
        return fit(solver.predicted, measured, weights, free, solver.beside, starts, seed, progress)

    fitted = fitted_by(Solver(at, sets, whole=False))
    apart = np.abs(Solver(at, sets, whole=True).predicted(fitted.values) - measured - fitted.residuals)
    if not (apart <= (1e-3 * sigma if known else SAME * np.abs(measured).max())).all():
        fitted = fitted_by(Solver(at, sets, whole=True))  # the way led to another branch
    rows = np.cumsum([len(each.measured()) for each in sets])[:-1]
    noise = 1.0 if known else math.sqrt(fitted.misfit / max(len(measured) - len(names), 1))
    parts = tuple(
        Part(each.label, each.unit, values, values + off, noise * (each.noise or 1.0))
        for each, values, off in zip(
            sets, np.split(measured, rows), np.split(fitted.residuals, rows), strict=True
        )
    )
    return replace(fitted, model=at(fitted.values), parts=parts)


class Solver:
    """Predictions of a model, and those beside them that begin at its states."""

    def __init__(self, build: Callable[[Array], Model], data: Sequence[Reading], whole: bool) -> None:
        """Of what makes the model of parameters (n,), and the data; `whole` solves every path from its beginning."""
        self.build, self.data, self.whole = build, data, whole
        self._paths: dict[bytes, Path] = {}
        self._last = b""

    def predicted(self, values: Array) -> Array:
        """(m,) values of the model; inf where a path does not reach the end of its steps.

        Raises:
            ModelError: the first path does not.
        """
        model = self.build(values)
        path = None if self.whole or not self._paths else neighbour(self._paths[self._last], model)
        path = trace(model, estimate=False, warn=False) if path is None else path
        if not self._paths:
            path.require()
        elif not path.reached:
            return np.full(sum(len(each.measured()) for each in self.data), np.inf)
        self._last = values.tobytes()
        self._paths = {**dict(list(self._paths.items())[-2:]), self._last: path}
        return self._read(path)

    def beside(self, values: Array, base: Array) -> Array:
        """The same at values next to others where the model has been solved.

        Args:
            values: (n,) parameters.
            base: (n,) those that have been asked for.

        Returns:
            (m,) values of the model.
        """
        model = self.build(values)
        path = neighbour(self._paths.get(base.tobytes(), self._paths[self._last]), model)
        return self._read(trace(model, estimate=False, warn=False).require() if path is None else path)

    def _read(self, path: Path) -> Array:
        ends = {state.step: state for state in path}
        return np.concatenate([each.predicted(ends) for each in self.data])


def fit(
    predicted: Callable[[Array], Array],
    measured: Array,
    sigma: Array | None,
    free: Mapping[str, Bounds],
    beside: Callable[[Array, Array], Array] | None = None,
    starts: int = 1,
    seed: int = 0,
    progress: Tell | None = None,
) -> Calibration:
    """Parameters of any prediction that fit measured values best, and how well they are known.

    Args:
        predicted: (m,) values for parameters (n,), in the order of `free`; not finite where there are none.
        measured: (m,) values.
        sigma: (m,) standard deviations of their noise; None for one noise of all that is read from the residuals.
        free: by name where to begin, and the least and the largest value.
        beside: predictions for parameters (n,) next to others (n,) that have been asked for, where that is cheaper.
        starts: see `calibrate`, as `seed` and `progress`.
        seed: of the further beginnings.
        progress: is told a line now and then.

    Raises:
        ModelError: more parameters than data, or bounds that cannot be.
    """
    from scipy.stats import t as student

    names = tuple(free)
    begin, low, high = np.array([_checked(name, free[name]) for name in names]).T
    n, m = len(names), len(measured)
    if n > m or (sigma is None and n == m):
        raise ModelError(
            f"{n} parameters cannot be found from {m} values{'' if sigma is not None else ' of unknown noise'}; "
            "measure more, or free fewer"
        )
    if not 1 <= starts <= 1000:
        raise ModelError(f"starts = {starts} cannot be; give 1 to 1000")
    problem = _Problem(predicted, beside, measured, sigma, begin, low, high, progress)
    tried = [problem.solve(each) for each in _beginnings(begin, low, high, starts, seed)]
    done = min((each for each in tried if each.done is not None), key=lambda each: each.misfit).done
    assert done is not None
    noise, scale = problem.noise, problem.scale
    variance = 1.0 if sigma is not None else float(done.fun @ done.fun) / (m - n)
    covariance, unknown = _known(np.asarray(done.jac), np.abs(done.x), variance, names)
    covariance = covariance * scale[:, None] * scale
    errors = np.sqrt(np.diag(covariance))
    reach = errors * float(student.ppf(0.975, m - n)) if sigma is None else 1.959964 * errors
    values = done.x * scale
    intervals = np.column_stack((values - reach, values + reach))
    return Calibration(
        names,
        values,
        errors,
        intervals,
        covariance,
        done.fun * noise,
        unknown,
        problem.calls,
        None,
        misfit=float(done.fun @ done.fun),
        bounded=tuple(name for name, side in zip(names, done.active_mask, strict=True) if side),
        starts=tuple(each.told for each in tried) if starts > 1 else (),
    )


class _Found(NamedTuple):
    """What a beginning led to; `done` is SciPy's result, or None."""

    done: OptimizeResult | None
    misfit: float
    told: Start


@dataclass(eq=False)
class _Problem:
    """Least squares in parameters over their scale."""

    predicted: Callable[[Array], Array]
    beside: Callable[[Array, Array], Array] | None
    measured: Array
    sigma: Array | None
    begin: Array
    low: Array
    high: Array
    progress: Tell | None
    calls: int = 0

    def __post_init__(self) -> None:
        """Scales of parameters and data."""
        self.scale = np.maximum(np.abs(self.begin), 1e-3 * (self.high - self.low))
        self.noise = np.ones(len(self.measured)) if self.sigma is None else self.sigma

    def residual(self, y: Array) -> Array:
        """(m,) residuals over their noise; a value that is not finite is one that is not to be gone to."""
        self.calls += 1
        out = np.asarray((self.predicted(y * self.scale) - self.measured) / self.noise)
        if self.progress is not None:
            self.progress(f"solution {self.calls}: misfit {float(out @ out):.5g}")
        return out

    def jacobian(self, y: Array) -> Array:
        """(m, n) central differences."""
        out = np.empty((len(self.measured), len(y)))
        for k in range(len(y)):
            step = NUDGE * max(abs(float(y[k])), NUDGE)
            up, down = y.copy(), y.copy()
            up[k] = min(y[k] + step, self.high[k] / self.scale[k])
            down[k] = max(y[k] - step, self.low[k] / self.scale[k])
            out[:, k] = (self._near(up, y) - self._near(down, y)) / (self.noise * (up[k] - down[k]))
        return out

    def _near(self, y: Array, base: Array) -> Array:
        self.calls += 1
        return (
            self.predicted(y * self.scale)
            if self.beside is None
            else self.beside(y * self.scale, base * self.scale)
        )

    def solve(self, begin: Array) -> _Found:
        """The minimum next to a beginning (n,); the given one has to be solvable, others may not be."""
        from scipy.optimize import least_squares

        first = begin is self.begin
        try:
            if not (first or np.isfinite(self.predicted(begin)).all()):
                raise ModelError("a path does not reach the end of its steps")
            done = least_squares(
                self.residual,
                begin / self.scale,
                self.jacobian,
                bounds=(self.low / self.scale, self.high / self.scale),
                method="trf",
                xtol=1e-9,
                ftol=1e-10,
            )
        except InputError as error:
            if first:
                raise
            return _Found(
                None, math.inf, Start(tuple(begin.tolist()), tuple(begin.tolist()), math.inf, str(error))
            )
        misfit, values = float(done.fun @ done.fun), done.x * self.scale
        return _Found(done, misfit, Start(tuple(begin.tolist()), tuple(values.tolist()), misfit))


def _beginnings(begin: Array, low: Array, high: Array, count: int, seed: int) -> list[Array]:
    """The given beginning and others between the bounds, by their logarithm where these are far apart."""
    rng = np.random.default_rng(seed)
    wide = (low > 0.0) & (high > 10.0 * np.maximum(low, 1e-300))
    found = [begin]
    for _ in range(count - 1):
        part = rng.uniform(size=len(begin))
        ratio = np.where(wide, high / np.where(wide, low, 1.0), 1.0)
        found.append(np.where(wide, low * ratio**part, low + part * (high - low)))
    return found


def _known(jac: Array, size: Array, variance: float, names: tuple[str, ...]) -> tuple[Array, tuple[str, ...]]:
    """(n, n) covariance and the combinations that are not told, from the Jacobian of weighted residuals.

    Combinations are read in relative changes of the parameters, of `size` (n,).
    """
    size = np.where(size > 0.0, size, 1.0)
    _, s, V = np.linalg.svd(jac * size, full_matrices=False)
    nothing = s <= RANK * max(float(s[0]), 1e-300)
    deviation = np.where(nothing, np.inf, math.sqrt(variance) / np.where(nothing, 1.0, s))
    unknown = [_combination(v, names, d) for v, d in zip(V, deviation, strict=True) if d > BLIND]
    told = (V.T * np.where(nothing, 0.0, deviation) ** 2) @ V
    blind = np.abs(V[nothing]).max(axis=0, initial=0.0) > 1e-6
    told[blind, :] = told[:, blind] = np.inf
    return told * size[:, None] * size, tuple(unknown)


def _combination(v: Array, names: tuple[str, ...], deviation: float) -> str:
    v = v * np.sign(v[np.abs(v).argmax()])
    parts = [f"{name}^{power:.2f}" for name, power in zip(names, v, strict=True) if abs(power) > 0.05]
    amount = "at all" if math.isinf(deviation) else f"(known to {100.0 * deviation:.0f} %)"
    return f"{' '.join(parts)} {amount}"


def _checked(name: str, bounds: Bounds) -> Bounds:
    good = len(bounds) == 3 and all(math.isfinite(value) for value in bounds)
    if not (good and bounds[1] <= bounds[0] <= bounds[2] and bounds[1] < bounds[2]):
        raise ModelError(
            f"free['{name}'] = {bounds} cannot be; give (begin, least, largest) with begin between them"
        )
    return bounds


def _changed(model: Model, values: Mapping[str, float]) -> Model:
    for name, value in values.items():
        model = _replaced(model, name, value)
    return model


def _replaced(model: Model, name: str, value: float) -> Model:
    """The model with one value changed.

    Raises:
        ModelError: it has no such value.
    """
    kind, _, key = name.partition(".")
    if kind == "sheet" and key in {f.name for f in fields(Sheet)} and getattr(model.sheet, key) is not None:
        return replace(model, sheet=other_sheet(model.sheet, **{key: value}))
    crease, _, what = key.rpartition(".")
    if kind == "creases" and crease.endswith(".law") and crease.removesuffix(".law") in model.creases:
        crease = crease.removesuffix(".law")
        law = model.creases[crease].law
        if law is not None and isinstance(getattr(law, what, None), float):
            changed = replace(model.creases[crease], law=replace(law, **{what: value}))
            return replace(model, creases={**model.creases, crease: changed})
    elif kind == "creases" and crease in model.creases and what in {"Lstar", "stiffness", "rest"}:
        spring = model.creases[crease]
        if getattr(spring, what) is not None:
            other = {
                "Lstar": lambda: replace(spring, Lstar=value),
                "stiffness": lambda: replace(spring, stiffness=value),
                "rest": lambda: replace(spring, rest=value),
            }[what]()
            return replace(model, creases={**model.creases, crease: other})
    raise ModelError(
        f"free '{name}' is no value of the model; give sheet.KEY, creases.NAME.KEY or "
        "creases.NAME.law.KEY that it has, such as sheet.E"
    )
