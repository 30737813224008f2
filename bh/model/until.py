"""What ends a step before its actuations are complete: an observable and the value that it is to have.

Here is only what a user says. The functions that measure a state are in `bh.formulations.observables`, under the same
names.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Final

from bh.errors import ModelError
from bh.runtime.consent import said
from meshes.quantities import Kind, number, take_units

_OF_CREASE: Final = ("fold_angle", "largest_fold", "dihedral", "moment")
_OF_PLACE: Final = tuple(f"{what}_{axis}" for what in ("reaction", "displacement") for axis in "xyz")
OBSERVABLES: Final = ("depth", "energy", "stretching", "bending", "folding", *_OF_CREASE, *_OF_PLACE)
KINDS: Final[dict[str, Kind]] = {
    "depth": "length",
    **dict.fromkeys(("energy", "stretching", "bending", "folding"), "energy"),
    **dict.fromkeys(("fold_angle", "largest_fold", "dihedral"), "angle"),
    "moment": "couple",
    **{f"reaction_{axis}": "force" for axis in "xyz"},
    **{f"displacement_{axis}": "length" for axis in "xyz"},
}
NEEDS: Final = {
    **dict.fromkeys(_OF_CREASE, "the name of a crease"),
    **dict.fromkeys(_OF_PLACE, "a place such as edge:start"),
}


@dataclass(frozen=True)
class Until:
    """Ends a step of a model where an observable has a value; the step has failed if it never has it.

    Attributes:
        observable: a name of `OBSERVABLES`, or "module:function" of a function of a `State` (or that function itself,
            if it can be imported).
        value: wanted, in the observable's unit, or with a unit ("90deg").
        of: the crease or place that it is of, where it needs one.
        tolerance: on the value, in parts of it (in its unit where the value is 0).
    """

    observable: str
    value: float
    of: str | None = None
    tolerance: float = 1e-5

    if TYPE_CHECKING:  # a function is taken too, and kept by its name

        def __init__(
            self,
            observable: str | Callable[..., float],
            value: float | str,
            of: str | None = None,
            tolerance: float = 1e-5,
        ) -> None:
            """See the attributes."""

    @property
    def margin(self) -> float:
        """How far from the value the observable may be, in its unit."""
        return self.tolerance * (abs(self.value) or 1.0)

    def __post_init__(self) -> None:
        """Refuse what cannot be met.

        Raises:
            ModelError: an unknown observable, a missing `of`, or numbers that cannot be; one line.
        """
        if callable(self.observable):
            object.__setattr__(self, "observable", _importable(self.observable))
        if self.observable not in OBSERVABLES and ":" not in self.observable:
            known = ", ".join(OBSERVABLES)
            raise ModelError(
                f"observable '{self.observable}' is not known; use one of {known}, or module:function"
            )
        if ":" in self.observable:
            said(self.observable)
        if isinstance(self.value, str):
            kind = KINDS.get(self.observable)
            if kind is None:
                raise ModelError(
                    f'until {self.observable} = "{self.value}": only numbers are compared with it; give one'
                )
            take_units(self, f"until {self.observable}", value=kind)
        if not math.isfinite(self.value):
            raise ModelError(f"until {self.observable} = {self.value} cannot be; give a finite number")
        if not (math.isfinite(self.tolerance) and self.tolerance > 0.0):
            raise ModelError(f"until: tolerance = {self.tolerance} cannot be; give a positive number")
        if self.of is None and self.observable in NEEDS:
            raise ModelError(f"until {self.observable} needs `of`, {NEEDS[self.observable]}")


def depth(to: float | str, tolerance: float = 1e-5) -> Until:
    """Fold until a corrugation is `to` mm deep, highest mountain to lowest valley point.

    Args:
        to: depth in mm, or with a unit; how it is measured says `bh.formulations.observables.depth_of`.
        tolerance: on it, in parts of it.

    Returns:
        what ends the step.

    Raises:
        ModelError: the depth is no positive number.
    """
    to = number(to, "length")
    if not (math.isfinite(to) and to > 0.0):
        raise ModelError(f"depth = {to} mm cannot be; give a positive length in mm")
    return Until("depth", to, tolerance=tolerance)


def _importable(function: Callable[..., float]) -> str:
    """Name "module:function" of a function, which must be found again in another process."""
    module, name = getattr(function, "__module__", ""), getattr(function, "__qualname__", "")
    if getattr(import_module(module), name, None) is not function:
        raise ModelError(
            f"until takes a function at the top of a module, not {name or function!r}; give it a name"
        )
    return f"{module}:{name}"
