"""What a calibration finds: values with intervals, what the data do not tell, where each beginning led."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.model.model import Model

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Part:
    """One kind of data beside the fit.

    Attributes:
        label, unit: what it is.
        measured, predicted: (k,) values.
        sigma: standard deviation of the noise, given or read from all residuals.
    """

    label: str
    unit: str
    measured: Array
    predicted: Array
    sigma: float


@dataclass(frozen=True)
class Start:
    """Where one of several beginnings led.

    Attributes:
        begin, values: parameters at its beginning and its end.
        misfit: sum of the squares of residuals over their noise.
        why: why it led nowhere, or an empty string.
    """

    begin: tuple[float, ...]
    values: tuple[float, ...]
    misfit: float
    why: str = ""


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
        misfit: sum of the squares of residuals over their noise; about m - n where noise and model are right.
        bounded: names of parameters that ended at a bound.
        starts: where all beginnings led, in order.
        parts: the data, kind by kind.
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
    misfit: float = math.nan
    bounded: tuple[str, ...] = ()
    starts: tuple[Start, ...] = ()
    parts: tuple[Part, ...] = ()

    def __str__(self) -> str:
        """A line a parameter, and what is not told."""
        lines = [
            f"{name} = {value:.5g} +- {error:.2g} (95 %: {low:.5g} to {high:.5g})"
            + (", at its bound" if name in self.bounded else "")
            for name, value, error, (low, high) in zip(
                self.names, self.values, self.errors, self.intervals, strict=True
            )
        ]
        lines += [f"not told by the data: {combination}" for combination in self.unknown]
        return "\n".join((*lines, *(f"fits as well: {other}" for other in self.others)))

    @property
    def others(self) -> tuple[str, ...]:
        """Ends of other beginnings that fit as well (misfit less than 4 more) outside the intervals, in words."""
        found = []
        for start in self.starts:
            outside = any(
                not low <= value <= high
                for value, (low, high) in zip(start.values, self.intervals, strict=True)
            )
            if not start.why and outside and start.misfit < self.misfit + 4.0:
                each = zip(self.names, start.values, strict=True)
                found.append(", ".join(f"{name} = {value:.5g}" for name, value in each))
        return tuple(dict.fromkeys(found))

    def as_dict(self) -> dict[str, object]:
        """All of it as plain data for JSON; what is not known is None.

        Returns:
            by key.
        """
        return {
            "parameters": {
                name: {"value": value, "error": _number(error), "interval": [_number(x) for x in interval]}
                for name, value, error, interval in zip(
                    self.names, self.values.tolist(), self.errors, self.intervals, strict=True
                )
            },
            "covariance": [[_number(x) for x in row] for row in self.covariance],
            "unknown": list(self.unknown),
            "bounded": list(self.bounded),
            "misfit": _number(self.misfit),
            "others": list(self.others),
            "starts": [vars(start) | {"misfit": _number(start.misfit)} for start in self.starts],
            "data": [
                {
                    "label": part.label,
                    "unit": part.unit,
                    "sigma": _number(part.sigma),
                    "measured": part.measured.tolist(),
                    "predicted": part.predicted.tolist(),
                }
                for part in self.parts
            ],
            "solved": self.solved,
        }


def _number(value: float) -> float | None:
    """A number that JSON can hold; there is none for inf and nan."""
    return float(value) if math.isfinite(value) else None
