"""Laws of a crease that are no straight line: the moment a length against the turn from the rest angle.

All are frozen data; angles are rad, moments a length N mm / mm, energies a length N mm / mm. A law of one's own derives
from `HingeLaw` and gives the three functions of the turn; `ElasticPlastic` also remembers what it has been through.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from meshes.quantities import Typed, take_units

Array = NDArray[np.float64]
YIELDED = 1e-12  # of the yield moment: what lies this far beyond it is rounding


class Response(NamedTuple):
    """What a law answers at turns (k,), a length.

    Attributes:
        energy: (k,) stored and dissipated so far, whose derivative by the turn is the moment, N mm / mm.
        moment: (k,) N mm / mm, positive where it works to close what has turned open.
        stiffness: (k,) derivative of the moment, N mm / (mm rad).
        dissipated: (k,) part of `energy` that does not come back, N mm / mm.
        history: (k, 2) what is remembered where this state is accepted.
    """

    energy: Array
    moment: Array
    stiffness: Array
    dissipated: Array
    history: Array


@dataclass(frozen=True)
class HingeLaw:
    """An elastic law; derive from it and give `energy`, `moment` and `stiffness`, which have to fit each other.

    They get turns phi - rest (k,), rad, positive towards a valley, and the stiffness `k` (N mm / (mm rad)) that the
    crease has by `Lstar` or `stiffness`; where the law tells its own (`own_stiffness`), that.
    """

    @property
    def own_stiffness(self) -> float | None:
        """Stiffness at rest where the law has one of its own, N mm / (mm rad); None where the crease gives it."""
        return None

    @property
    def remembers(self) -> bool:
        """Does the moment depend on more than the turn?"""
        return False

    def energy(self, turn: Array, k: float) -> Array:
        """(k,) energy a length, N mm / mm, zero at rest.

        Args:
            turn: (k,) phi - rest, rad.
            k: stiffness at rest, N mm / (mm rad).
        """
        raise NotImplementedError

    def moment(self, turn: Array, k: float) -> Array:
        """(k,) moment a length, N mm / mm, the derivative of the energy.

        Args:
            turn: (k,) phi - rest, rad.
            k: stiffness at rest, N mm / (mm rad).
        """
        raise NotImplementedError

    def stiffness(self, turn: Array, k: float) -> Array:
        """(k,) derivative of the moment, N mm / (mm rad).

        Args:
            turn: (k,) phi - rest, rad.
            k: stiffness at rest, N mm / (mm rad).
        """
        raise NotImplementedError

    def respond(self, turn: Array, history: Array, k: float) -> Response:
        """Everything at once; an elastic law remembers nothing.

        Args:
            turn: (k,) phi - rest, rad.
            history: (k, 2) as it was accepted last: permanent turn and the sum of its changes, rad.
            k: stiffness at rest, N mm / (mm rad).
        """
        values = self.energy(turn, k), self.moment(turn, k), self.stiffness(turn, k)
        return Response(*values, np.zeros_like(turn), history)


@dataclass(frozen=True)
class MomentTable(HingeLaw):
    """A measured curve, straight between its points, which goes on with its last slopes.

    Attributes:
        turns: rising, rad, 0 among them. Where all are 0 or more, the other sense is the same.
        moments: a length there, N mm / mm, 0 at the turn 0.
    """

    turns: tuple[float, ...]
    moments: tuple[float, ...]

    if TYPE_CHECKING:

        def __init__(self, turns: Sequence[Typed], moments: Sequence[Typed]) -> None:
            """See the attributes."""

    def __post_init__(self) -> None:
        """Refuse what is no function.

        Raises:
            ModelError: one line that names what is wrong.
        """
        take_units(self, "moment table", turns="angle", moments="couple")
        for key in ("turns", "moments"):  # frozen data are compared
            object.__setattr__(self, key, tuple(float(value) for value in getattr(self, key)))
        a, m = self.turns, self.moments
        if len(a) != len(m) or len(a) < 2 or not all(math.isfinite(value) for value in (*a, *m)):
            raise ModelError(
                f"moment table of {len(a)} turns and {len(m)} moments cannot be; give as many of both, two or more"
            )
        if any(behind <= before for before, behind in pairwise(a)):
            raise ModelError("moment table is no function of the turn: give turns that rise, each once")
        if (0.0, 0.0) not in zip(a, m, strict=True):
            raise ModelError(
                "moment table has no turn 0 with moment 0: a crease at rest carries none; add it"
            )

    def _curve(self) -> tuple[Array, Array, Array, Array]:
        """Turns, moments and energies at the points, and the slope of every piece, those beyond the ends included."""
        a, m = np.array(self.turns), np.array(self.moments)
        if a[0] == 0.0:
            a, m = np.concatenate((-a[:0:-1], a)), np.concatenate((-m[:0:-1], m))
        slope = np.diff(m) / np.diff(a)
        work = np.concatenate(([0.0], np.cumsum(0.5 * (m[1:] + m[:-1]) * np.diff(a))))
        work -= work[int(np.flatnonzero(a == 0.0)[0])]
        return a, m, work, np.concatenate((slope[:1], slope, slope[-1:]))

    @property
    def own_stiffness(self) -> float | None:
        """Slope at rest, the steeper one of both sides."""
        a, _, _, slope = self._curve()
        at = int(np.flatnonzero(a == 0.0)[0])
        return float(np.abs(slope[at : at + 2]).max())

    def _piece(self, turn: Array) -> tuple[Array, Array, Array, Array]:
        a, m, work, slope = self._curve()
        piece = np.searchsorted(a, turn, side="right")
        at = np.clip(piece - 1, 0, len(a) - 1)
        return turn - a[at], m[at], work[at], slope[piece]

    def energy(self, turn: Array, k: float) -> Array:  # noqa: ARG002 - the table has its own stiffness
        """(k,) area below the curve.

        Args:
            turn: (k,) phi - rest, rad.
            k: stiffness at rest, N mm / (mm rad).
        """
        past, m, work, slope = self._piece(turn)
        return np.asarray(work + (m + 0.5 * slope * past) * past)

    def moment(self, turn: Array, k: float) -> Array:  # noqa: ARG002
        """(k,) value of the curve.

        Args:
            turn: (k,) phi - rest, rad.
            k: stiffness at rest, N mm / (mm rad).
        """
        past, m, _, slope = self._piece(turn)
        return np.asarray(m + slope * past)

    def stiffness(self, turn: Array, k: float) -> Array:  # noqa: ARG002
        """(k,) slope of the curve, at a point the one of larger turns.

        Args:
            turn: (k,) phi - rest, rad.
            k: stiffness at rest, N mm / (mm rad).
        """
        return self._piece(turn)[3]


@dataclass(frozen=True)
class Bilinear(HingeLaw):
    """Another stiffness beyond a turn, elastic.

    Attributes:
        knee: turn where it changes, in both senses, rad.
        beyond: stiffness a length from there on, N mm / (mm rad); negative softens.
    """

    knee: float
    beyond: float

    if TYPE_CHECKING:

        def __init__(self, knee: Typed, beyond: Typed) -> None:
            """See the attributes."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        take_units(self, "bilinear", knee="angle", beyond="stiffness")
        if not (math.isfinite(self.knee) and self.knee > 0.0 and math.isfinite(self.beyond)):
            raise ModelError(
                f"bilinear: knee = {self.knee}, beyond = {self.beyond} cannot be; give a positive turn and a stiffness"
            )

    def _past(self, turn: Array) -> Array:
        """(k,) turn beyond the knee, with its sign, rad."""
        return np.asarray(np.sign(turn) * np.maximum(np.abs(turn) - self.knee, 0.0))

    def energy(self, turn: Array, k: float) -> Array:
        """(k,) k turn^2 / 2, less what the change of stiffness takes.

        Args:
            turn: (k,) phi - rest, rad.
            k: stiffness at rest, N mm / (mm rad).
        """
        return np.asarray(0.5 * k * turn**2 + 0.5 * (self.beyond - k) * self._past(turn) ** 2)

    def moment(self, turn: Array, k: float) -> Array:
        """(k,) two straight lines.

        Args:
            turn: (k,) phi - rest, rad.
            k: stiffness at rest, N mm / (mm rad).
        """
        return np.asarray(k * turn + (self.beyond - k) * self._past(turn))

    def stiffness(self, turn: Array, k: float) -> Array:
        """(k,) their slopes.

        Args:
            turn: (k,) phi - rest, rad.
            k: stiffness at rest, N mm / (mm rad).
        """
        return np.where(np.abs(turn) > self.knee, self.beyond, k)


@dataclass(frozen=True)
class Softening(HingeLaw):
    """A moment that has a largest value and falls beyond it: k turn / (1 + (turn / peak)^2), smooth and elastic.

    Attributes:
        peak: turn of the largest moment, k peak / 2, rad.
    """

    peak: float

    if TYPE_CHECKING:

        def __init__(self, peak: Typed) -> None:
            """See the attributes."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        take_units(self, "softening", peak="angle")
        if not (math.isfinite(self.peak) and self.peak > 0.0):
            raise ModelError(f"softening: peak = {self.peak} cannot be; give a positive turn")

    def energy(self, turn: Array, k: float) -> Array:
        """(k,) k peak^2 / 2 log(1 + (turn / peak)^2).

        Args:
            turn: (k,) phi - rest, rad.
            k: stiffness at rest, N mm / (mm rad).
        """
        return np.asarray(0.5 * k * self.peak**2 * np.log1p((turn / self.peak) ** 2))

    def moment(self, turn: Array, k: float) -> Array:
        """(k,) k turn / (1 + (turn / peak)^2).

        Args:
            turn: (k,) phi - rest, rad.
            k: stiffness at rest, N mm / (mm rad).
        """
        return np.asarray(k * turn / (1.0 + (turn / self.peak) ** 2))

    def stiffness(self, turn: Array, k: float) -> Array:
        """(k,) k (1 - (turn / peak)^2) / (1 + (turn / peak)^2)^2, negative beyond the peak.

        Args:
            turn: (k,) phi - rest, rad.
            k: stiffness at rest, N mm / (mm rad).
        """
        s = (turn / self.peak) ** 2
        return np.asarray(k * (1.0 - s) / (1.0 + s) ** 2)


@dataclass(frozen=True)
class ElasticPlastic(HingeLaw):
    """A crease that yields and keeps a part of its fold: m = k (turn - p) with a permanent turn p.

    p changes where |m - H p| (kinematic) or |m| - H a (isotropic) reaches the yield moment, a the sum of all changes of
    p. An increment is the implicit Euler step, whose return mapping is exact for these laws as long as the turn does
    not go back within it: from the trial moment the excess f over yield gives dp = f / (k + H), and the slope is
    k H / (k + H) (Simo and Hughes, Computational Inelasticity, box 1.5). It is the least of the incremental energy
    k (turn - p)^2 / 2 + H p^2 / 2 (isotropic: H a^2 / 2) + M_y a, which the solvers see.

    Attributes:
        yield_moment: M_y a length, N mm / mm.
        hardening: H a length, N mm / (mm rad), 0 or more: once it yields the slope is k H / (k + H).
        hardens: "kinematic", so that the other sense yields sooner (Bauschinger), or "isotropic".
    """

    yield_moment: float
    hardening: float = 0.0
    hardens: str = "kinematic"

    if TYPE_CHECKING:

        def __init__(self, yield_moment: Typed, hardening: Typed = 0.0, hardens: str = "kinematic") -> None:
            """See the attributes."""

    def __post_init__(self) -> None:
        """Refuse values that cannot be.

        Raises:
            ModelError: one line that names the value and what to give.
        """
        take_units(self, "elastic-plastic", yield_moment="couple", hardening="stiffness")
        if not (math.isfinite(self.yield_moment) and self.yield_moment > 0.0):
            raise ModelError(
                f"elastic-plastic: yield_moment = {self.yield_moment} cannot be; give a positive one"
            )
        if not (math.isfinite(self.hardening) and self.hardening >= 0.0):
            raise ModelError(f"elastic-plastic: hardening = {self.hardening} cannot be; give 0 or more")
        if self.hardens not in ("kinematic", "isotropic"):
            raise ModelError(
                f"elastic-plastic: hardens = '{self.hardens}' is none; give 'kinematic' or 'isotropic'"
            )

    @property
    def remembers(self) -> bool:
        """It does: the permanent turn."""
        return True

    def respond(self, turn: Array, history: Array, k: float) -> Response:
        """The return mapping from what was accepted last.

        Args:
            turn: (k,) phi - rest, rad.
            history: (k, 2) permanent turn and the sum of its changes, rad.
            k: stiffness at rest, N mm / (mm rad).
        """
        kinematic, H, My = self.hardens == "kinematic", self.hardening, self.yield_moment
        p, a = history.T
        trial = k * (turn - p)
        over = trial - H * p if kinematic else trial
        limit = My if kinematic else My + H * a
        excess = np.abs(over) - limit
        yields = excess > YIELDED * My
        step = np.where(yields, excess / (k + H), 0.0)
        p, a = p + np.sign(over) * step, a + step
        moment = k * (turn - p)
        hardened = 0.5 * H * (p if kinematic else a) ** 2
        lost = My * a + (0.0 if kinematic else hardened)
        energy = 0.5 * k * (turn - p) ** 2 + (hardened if kinematic else 0.0) + lost
        slope = np.where(yields, k * H / (k + H), k)
        return Response(energy, moment, slope, lost, np.column_stack((p, a)))


LAWS: dict[str, type[HingeLaw]] = {
    "table": MomentTable,
    "bilinear": Bilinear,
    "softening": Softening,
    "elastic-plastic": ElasticPlastic,
}
