"""Numbers of a model from a test: crease stiffness, moduli, thickness, rest angles by bounded least squares."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.observables import OBSERVABLES
from bh.model.model import Model
from bh.model.sheet import Sheet
from bh.model.zones import changed as other_sheet
from bh.solving.trace import trace

Array = NDArray[np.float64]
NUDGE = 1e-3  # of a parameter's range or value: its central difference
BLIND = 0.5  # relative standard deviation from which on a combination of parameters is not told by the data
RANK = 1e-7  # smallest singular value over the largest, below which nothing at all is told


@dataclass(frozen=True)
class Measured:
    """What was measured at the ends of steps.

    Attributes:
        observable: what, as for `Until`: "reaction_z", "displacement_z", "fold_angle", "moment", ...
        values: one a step, in the observable's own unit.
        of: the crease or place that it is of.
        steps: from 0, at the ends of which it was measured; None for all steps in order.
        sigma: standard deviation of the noise, in the unit of the values; None where it is not known: it is read
            from the residuals then.
    """

    observable: str
    values: Sequence[float]
    of: str | None = None
    steps: Sequence[int] | None = None
    sigma: float | None = None

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        if self.observable not in OBSERVABLES:
            raise ModelError(
                f"observable '{self.observable}' is not known; use one of {', '.join(sorted(OBSERVABLES))}"
            )
        if len(self.values) == 0 or not np.isfinite(np.asarray(self.values, dtype=float)).all():
            raise ModelError(f"measured {self.observable} needs finite numbers, one a step")
        if self.sigma is not None and not 0.0 < self.sigma < math.inf:
            raise ModelError(f"sigma = {self.sigma} cannot be; give a positive standard deviation, or None")


@dataclass(frozen=True, eq=False)
class Calibration:
    """Parameters that fit the data best.

    Attributes:
        names: of the n parameters.
        values: (n,) of them.
        errors: (n,) standard deviations; inf where the data tell nothing.
        intervals: (n, 2) confidence of 95 %.
        covariance: (n, n); of what the data tell nothing about its entries are inf.
        residuals: (m,) predicted less measured, in the units of the data.
        unknown: combinations of parameters that the data do not tell, in words; empty where all are told.
        solved: how often the model was solved.
        model: with the values.
    """

    names: tuple[str, ...]
    values: Array
    errors: Array
    intervals: Array
    covariance: Array
    residuals: Array
    unknown: tuple[str, ...]
    solved: int
    model: Model | None

    def __str__(self) -> str:
        """A line a parameter, and what is not told."""
        lines = [
            f"{name} = {value:.5g} +- {error:.2g} (95 %: {low:.5g} to {high:.5g})"
            for name, value, error, (low, high) in zip(
                self.names, self.values, self.errors, self.intervals, strict=True
            )
        ]
        return "\n".join((*lines, *(f"not told by the data: {combination}" for combination in self.unknown)))


Bounds = tuple[float, float, float]


def calibrate(model: Model, data: Measured | Sequence[Measured], free: Mapping[str, Bounds]) -> Calibration:
    """Find parameters of a model by what was measured at the ends of its steps.

    A bounded trust region (SciPy's `least_squares`) moves all parameters at once; derivatives are central differences
    of whole paths, so it costs 2 n + 1 solutions an iteration.

    Args:
        model: with all its steps; data are of their ends.
        data: what was measured.
        free: by name ("sheet.E", "creases.NAME.Lstar", ...) where to begin, and the least and the largest value.

    Raises:
        ModelError: a name that the model has not, bounds that cannot be, more parameters than data, data of steps that
            there are not, or a path that does not reach the end of its steps.
    """
    sets = [data] if isinstance(data, Measured) else list(data)
    names = tuple(free)
    for name in names:
        _replaced(model, name, _checked(name, free[name])[0])
    wanted = [_steps(model, each) for each in sets]
    measured = np.concatenate([np.asarray(each.values, dtype=float) for each in sets])
    if len({each.sigma is None for each in sets}) > 1 or (len(sets) > 1 and sets[0].sigma is None):
        raise ModelError("several kinds of data are weighed by their noise; give each a sigma")
    sigma = np.concatenate([np.full(len(each.values), each.sigma or 1.0) for each in sets])

    def at(values: Array) -> Model:
        changed = model
        for name, value in zip(names, values.tolist(), strict=True):
            changed = _replaced(changed, name, value)
        return changed

    def predicted(values: Array) -> Array:
        path = trace(at(values), estimate=False, warn=False).require()
        ends = {state.step: state for state in path}
        return np.array(
            [
                OBSERVABLES[each.observable](ends[step], each.of)
                for each, steps in zip(sets, wanted, strict=True)
                for step in steps
            ]
        )

    known = sets[0].sigma is not None
    found = fit(predicted, measured, sigma if known else None, free)
    return replace(found, model=at(found.values))


def fit(
    predicted: Callable[[Array], Array], measured: Array, sigma: Array | None, free: Mapping[str, Bounds]
) -> Calibration:
    """Parameters of any prediction that fit measured values best, and how well they are known.

    Args:
        predicted: (m,) values for parameters (n,), in the order of `free`.
        measured: (m,) values.
        sigma: (m,) standard deviations of their noise; None for one noise of all that is read from the residuals.
        free: by name where to begin, and the least and the largest value.

    Raises:
        ModelError: more parameters than data, or bounds that cannot be.
    """
    from scipy.optimize import least_squares
    from scipy.stats import t as student

    names = tuple(free)
    begin, low, high = np.array([_checked(name, free[name]) for name in names]).T
    n, m = len(names), len(measured)
    if n > m or (sigma is None and n == m):
        raise ModelError(
            f"{n} parameters cannot be found from {m} values{'' if sigma is not None else ' of unknown noise'}; "
            "measure more, or free fewer"
        )
    scale = np.maximum(np.abs(begin), 1e-3 * (high - low))
    noise = np.ones(m) if sigma is None else sigma
    calls = 0

    def residual(y: Array) -> Array:
        nonlocal calls
        calls += 1
        return np.asarray((predicted(y * scale) - measured) / noise)

    def jacobian(y: Array) -> Array:
        out = np.empty((m, n))
        for k in range(n):
            step = NUDGE * max(abs(float(y[k])), NUDGE)
            up, down = y.copy(), y.copy()
            up[k], down[k] = min(y[k] + step, high[k] / scale[k]), max(y[k] - step, low[k] / scale[k])
            out[:, k] = (residual(up) - residual(down)) / (up[k] - down[k])
        return out

    done = least_squares(
        residual,
        begin / scale,
        jacobian,
        bounds=(low / scale, high / scale),
        method="trf",
        xtol=1e-9,
        ftol=1e-10,
    )
    variance = 1.0 if sigma is not None else float(done.fun @ done.fun) / (m - n)
    covariance, unknown = _known(np.asarray(done.jac), np.abs(done.x), variance, names)
    covariance = covariance * scale[:, None] * scale
    errors = np.sqrt(np.diag(covariance))
    reach = errors * float(student.ppf(0.975, m - n)) if sigma is None else 1.959964 * errors
    values = done.x * scale
    intervals = np.column_stack((values - reach, values + reach))
    return Calibration(names, values, errors, intervals, covariance, done.fun * noise, unknown, calls, None)


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


def _steps(model: Model, data: Measured) -> tuple[int, ...]:
    steps = tuple(range(len(model.steps))) if data.steps is None else tuple(data.steps)
    if len(steps) != len(data.values):
        raise ModelError(
            f"{len(data.values)} values of {data.observable} are no match for {len(steps)} steps; give one a step"
        )
    if any(not 0 <= step < len(model.steps) for step in steps):
        raise ModelError(f"data of step {max(steps)}: the model has steps 0 to {len(model.steps) - 1}")
    return steps


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
