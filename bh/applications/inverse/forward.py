"""What a model of folded and pinched strips offers to those who design with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.applications.inverse.segments import Domain
from bh.applications.inverse.simulate import Landing, Setting

Array = NDArray[np.float64]


class Forward(Protocol):
    """What designs are computed with: where strips of folded and pinched segments end.

    Attributes:
        domain: of the segments that designs are made of.
        setting: sheet, fold and pinch.
        has_variants: it knows strips that are made a little differently (`varied`), and other pinches (`closed_by`).
    """

    domain: Domain
    setting: Setting
    has_variants: bool

    def forward(
        self, k0: ArrayLike, length: ArrayLike, pinched: ArrayLike, check: bool = True
    ) -> tuple[Array, Array]:
        """Points (..., n + 1, 3), mm, and frames (..., n + 1, 3, 3) of designs (..., n).

        Args:
            k0: (..., n) curvatures before folding, 1/mm.
            length: (..., n), mm.
            pinched: (..., n) truth values.
            check: refuse segments outside the domain.
        """
        ...

    def unpinched(self, k0: ArrayLike, length: ArrayLike) -> tuple[Array, Array]:
        """The same before the pinch.

        Args:
            k0: (..., n) curvatures before folding, 1/mm.
            length: (..., n), mm.

        Returns:
            (..., n + 1, 3) points, mm, and (..., n + 1, 3, 3) frames.
        """
        ...

    def arc(self, k0: ArrayLike, s: ArrayLike) -> tuple[Array, Array]:
        """Motions along folded arcs: translations (..., 3), mm, and rotations (..., 3, 3).

        Args:
            k0: (...) curvatures before folding, 1/mm.
            s: (...) arc lengths, mm, of any sign.
        """
        ...

    def land(self, k0: Sequence[float], length: Sequence[float], pinched: Sequence[bool]) -> Landing:
        """Simulate a whole strip.

        Args:
            k0: (n,) curvatures before folding, 1/mm.
            length: (n,), mm.
            pinched: (n,).
        """
        ...

    def bars(self, k0: ArrayLike, length: ArrayLike, pinched: ArrayLike) -> tuple[Array, Array]:
        """Error bars (...) of the ends: of the position, mm, and of the orientation, rad.

        Args:
            k0: (..., n) curvatures before folding, 1/mm.
            length: (..., n), mm.
            pinched: (..., n) truth values.
        """
        ...

    def closed_by(self, part: float) -> Forward:
        """The model of the same strips with all pinches closed by a part of the way.

        Args:
            part: from 0 to 1.
        """
        ...

    def varied(self) -> Mapping[str, tuple[Forward, Forward]]:
        """Models of strips with one thing a step less and a step more (`variants.STEPS`).

        Returns:
            both models, by the name of what differs.
        """
        ...

    def made(self, off: Mapping[str, Array]) -> Forward:
        """The model of strips of which each of S samples is made a little differently; for designs (S, n).

        Args:
            off: (S,) how far the fields of the setting named are off (`variants.STEPS`), in their units.
        """
        ...

    def about(self) -> Mapping[str, object]:
        """The setting as plain data."""
        ...
