"""What a crease is made of: a spring a length, as a plain frozen value."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bh.errors import ModelError
from bh.model.hinge_laws import HingeLaw
from bh.model.sheet import Sheet
from meshes.quantities import take_units


@dataclass(frozen=True)
class CreaseLaw:
    """A spring crease: moment a length = stiffness (phi - rest), N mm / mm.

    A `rest` angle that is not flat comes in during the first step, since the sheet begins flat. With a `law` the moment
    is no straight line: see `bh.model.hinge_laws`; the stiffness is that at rest, and a law that has one of its own (a
    table) takes no other.
    """

    Lstar: float | None = None
    stiffness: float | None = None
    rest: float = math.pi
    law: HingeLaw | None = None

    if TYPE_CHECKING:  # texts with units are taken, too, and kept as numbers

        def __init__(
            self,
            Lstar: float | str | None = None,
            stiffness: float | str | None = None,
            rest: float | str = math.pi,
            law: HingeLaw | None = None,
        ) -> None:
            """See the class."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        take_units(self, "crease", Lstar="length", stiffness="stiffness", rest="angle")
        if self.law is not None and not isinstance(self.law, HingeLaw):
            raise ModelError(f"crease law {self.law!r} is none; give one such as bh.ElasticPlastic(...)")
        if self.law is not None and self.law.own_stiffness is not None:
            if self.Lstar is not None or self.stiffness is not None:
                raise ModelError(
                    "a crease by a table of moments has its own stiffness; leave out Lstar and stiffness"
                )
            return
        if (self.Lstar is None) == (self.stiffness is None):
            raise ModelError("a crease needs either Lstar (mm) or stiffness (N mm / (mm rad))")
        value = self.Lstar if self.Lstar is not None else self.stiffness
        assert value is not None
        low_ok = value >= 0.0 if self.Lstar is None and self.law is None else value > 0.0
        if not (math.isfinite(value) and low_ok):
            raise ModelError(
                f"crease stiffness {value} cannot be; give a positive Lstar, or a stiffness of 0 or more "
                "(positive with a law)"
            )

    def per_length(self, sheet: Sheet) -> float:
        """Stiffness a length of crease at rest (Eq. 3.12 with nu = 0), N mm / (mm rad)."""
        if self.law is not None and self.law.own_stiffness is not None:
            return self.law.own_stiffness
        if self.stiffness is not None:
            return self.stiffness
        assert self.Lstar is not None
        return sheet.bending_stiffness(nu=0.0) / self.Lstar
