"""How the end of a design moves with what cannot be made exactly: an ellipsoid for given spreads.

Sheet, fold and pinch are varied one at a time in the whole strip, simulated on one mesh: one standard deviation up and
one down. Errors of the cut crease, curvature and length of every segment, are derivatives of the model. Every energy of
a strip is proportional to E and nothing pulls at it, so its end does not depend on E.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.applications.inverse.forward import Forward
from bh.applications.inverse.pieces import VARIED
from bh.applications.inverse.problems import Design
from bh.applications.inverse.simulate import Setting, simulate
from bh.applications.inverse.variants import STEPS

Array = NDArray[np.float64]
SAMPLES = 4000  # strips of a region, whose share inside is then known to 0.3 %
THIN = 1e-6  # mm, the least standard deviation: strips without a pinch keep to a plane
STEP = 1e-4  # of a standard deviation, for derivatives of the model


@dataclass(frozen=True)
class Spreads:
    """Standard deviations of what is made, independent of each other; 0 for what is exact.

    Attributes:
        Lstar: length scale of the crease, mm.
        t: thickness, mm.
        zone: length of the pinched zone, mm.
        pinch: its dihedral angle, rad.
        fold: rest dihedral angle, rad.
        k0: curvature of the cut crease of each segment, 1/mm.
        length: of each segment, mm.
    """

    Lstar: float = 0.05
    t: float = 0.002
    zone: float = 1.0
    pinch: float = 0.02
    fold: float = 0.02
    k0: float = 1e-5
    length: float = 0.1


@dataclass(frozen=True, eq=False)
class Tolerance:
    """Where the end of a design lies when it is made with some spreads, to first order.

    Attributes:
        moves: (3,) movement of the end by one standard deviation of each thing, mm, by its name.
        bent: (3,) of the same things, what two steps of opposite signs leave together, half, mm: how far the end is
            from the straight line of `moves` one standard deviation away; of `VARIED` only.
    """

    moves: Mapping[str, Array]
    bent: Mapping[str, Array]

    @property
    def covariance(self) -> Array:
        """(3, 3) of the end, mm^2."""
        columns = np.array(list(self.moves.values()))
        return np.asarray(columns.T @ columns)

    def axes(self, probability: float = 0.95) -> tuple[Array, Array]:
        """Semi-axes of the ellipsoid that holds the end with some probability.

        Args:
            probability: between 0 and 1.

        Returns:
            (3,) lengths, mm, the longest first, and (3, 3) directions in columns.
        """
        from scipy.special import gammaincinv  # scipy.stats has the same, and takes half a second to import

        square, directions = np.linalg.eigh(self.covariance)
        quantile = 2.0 * gammaincinv(1.5, probability)  # of chi-squared with three degrees of freedom
        size = np.sqrt(np.maximum(square, 0.0) * quantile)
        return size[::-1], directions[:, ::-1]


@dataclass(frozen=True, eq=False)
class Predicted:
    """Movements of the ends of many designs by one standard deviation of each thing, by chains of pieces.

    Attributes:
        moves: (..., 3) by name, mm.
    """

    moves: Mapping[str, Array]

    @property
    def size(self) -> Array:
        """(...) root of the mean square of the distance from where the end should be, mm."""
        return np.asarray(np.sqrt(sum((move**2).sum(axis=-1) for move in self.moves.values())))

    def one(self) -> Tolerance:
        """Of one design, whose moves are (3,)."""
        return Tolerance(self.moves, {})


def predicted(
    model: Forward, k0: ArrayLike, length: ArrayLike, pinched: ArrayLike, spreads: Spreads | None = None
) -> Predicted:
    """How ends of designs (..., n) move, without a simulation: differences of chains that are made differently.

    Args:
        model: that the designs are made with.
        k0: (..., n) curvatures before folding, 1/mm.
        length: (..., n), mm.
        pinched: (..., n) truth values.
        spreads: standard deviations; None for the default ones.

    Raises:
        DesignError: the model knows no variants of its strips.
    """
    spreads = spreads or Spreads()
    k, size, on = (
        np.asarray(k0, dtype=float),
        np.asarray(length, dtype=float),
        np.asarray(pinched, dtype=bool),
    )
    moves: dict[str, Array] = {}
    for name, (low, high) in model.varied().items():
        up, down = (each.forward(k, size, on, check=False)[0][..., -1, :] for each in (high, low))
        moves[name] = (up - down) * (0.5 * getattr(spreads, name) / STEPS[name])
    for i in range(k.shape[-1]):
        for name, spread in (("k0", spreads.k0), ("length", spreads.length)):
            shift = STEP * spread * (np.arange(k.shape[-1]) == i)
            ends = []
            for sign in (1.0, -1.0):
                bent, longer = (sign * shift, 0.0) if name == "k0" else (0.0, sign * shift)
                ends.append(model.forward(k + bent, size + longer, on, check=False)[0][..., -1, :])
            moves[f"{name} of segment {i + 1}"] = (ends[0] - ends[1]) * (0.5 / STEP)
    return Predicted(moves)


@dataclass(frozen=True, eq=False)
class Region:
    """An ellipsoid that holds the ends of a part of the strips that are made with some spreads.

    Movements of some millimetres turn a strip about its pinches, so ends lie on bent sheets: the ellipsoid of first
    order (`Tolerance.axes`) loses up to a sixth of them through its flat sides. This one is that of sampled strips.

    Attributes:
        middle: (3,) of the ellipsoid, beside the end of the strip that is made exactly, mm.
        axes: (3,) semi-axes, mm, the longest first.
        directions: (3, 3) of the axes, in columns.
        quantile: semi-axes over the standard deviations along them.
    """

    middle: Array
    axes: Array
    directions: Array
    quantile: float = 1.0

    def holds(self, apart: Array) -> NDArray[np.bool_]:
        """(N,) whether ends are inside.

        Args:
            apart: (N, 3) of strips from the end of the one that is made exactly, mm.
        """
        found: NDArray[np.bool_] = self._far(apart) <= 1.0
        return found

    def _far(self, apart: Array) -> Array:
        return np.asarray(np.linalg.norm((apart - self.middle) @ self.directions / self.axes, axis=-1))

    @classmethod
    def of(cls, apart: Array, probability: float = 0.95) -> Region:
        """The ellipsoid of the mean and covariance of ends that holds a part of them.

        Args:
            apart: (N, 3) ends beside that of the strip that is made exactly, mm.
            probability: the part, between 0 and 1.
        """
        middle = apart.mean(axis=0)
        square, directions = np.linalg.eigh(np.cov(apart.T))
        size = np.maximum(np.sqrt(np.maximum(square, 0.0)), THIN)[::-1]
        one = cls(middle, size, directions[:, ::-1])
        quantile = float(np.quantile(one._far(apart), probability))
        return cls(middle, quantile * size, one.directions, quantile)


def region(
    model: Forward,
    design: Design,
    spreads: Spreads | None = None,
    probability: float = 0.95,
    count: int = SAMPLES,
    seed: int = 1,
) -> Region:
    """Where strips of a design end that are made with normal errors, by chains of pieces: no strip is simulated.

    Args:
        model: that the design was made with.
        design: crease and pinches.
        spreads: standard deviations; None for the default ones.
        probability: part of the strips that the ellipsoid holds.
        count: of sampled strips.
        seed: the same seed gives the same strips.

    Raises:
        DesignError: the model knows no variants of its strips.
    """
    spreads = spreads or Spreads()
    rng = np.random.default_rng(seed)
    off = {name: getattr(spreads, name) * rng.normal(size=count) for name in STEPS}
    k0 = design.k0 + spreads.k0 * rng.normal(size=(count, design.n))
    length = design.length + spreads.length * rng.normal(size=(count, design.n))
    on = np.tile(design.pinched, (count, 1))
    ends = model.made(off).forward(k0, length, on, check=False)[0][:, -1]
    exact = model.forward(design.k0, design.length, design.pinched, check=False)[0][-1]
    return Region.of(ends - exact, probability)


def tolerance(
    model: Forward,
    design: Design,
    spreads: Spreads | None = None,
    edge: float = 1.25,
    rows: int = 4,
) -> Tolerance:
    """How the end of a design moves; simulates its strip up to eleven times.

    Args:
        model: that the design was made with.
        design: crease and pinches.
        spreads: standard deviations; None for the default ones.
        edge: of the mesh of whole strips, mm along the crease.
        rows: of its cells a panel.

    Raises:
        DesignError: a path ended early.
    """
    spreads = spreads or Spreads()
    setting = replace(model.setting, edge=edge, rows=rows)
    varied = [name for name in VARIED if getattr(spreads, name) > 0.0 and matters(name, design)]
    base = _end(design, setting) if varied else np.zeros(3)
    moves, bent = {}, {}
    for name in varied:
        value, step = getattr(setting, name), getattr(spreads, name)
        up, down = (_end(design, replace(setting, **{name: value + sign * step})) for sign in (1.0, -1.0))
        moves[name] = 0.5 * (up - down)
        bent[name] = 0.5 * (up + down) - base
    return Tolerance({**moves, **_cut(model, design, spreads)}, bent)


def matters(name: str, design: Design) -> bool:
    """Whether a field of `Setting` changes a design: zone and angle of a pinch do only where there is one.

    Args:
        name: of the field.
        design: crease and pinches.
    """
    return name not in ("zone", "pinch") or bool(design.pinched.any())


def _end(design: Design, setting: Setting) -> Array:
    return simulate(*design.lists(), setting).t


def _cut(model: Forward, design: Design, spreads: Spreads) -> dict[str, Array]:
    """Movements by errors of the curvature and the length of every segment, mm."""
    found = {}
    for name in ("k0", "length"):
        spread = getattr(spreads, name)
        if spread <= 0.0:
            continue
        shift = STEP * spread * np.eye(design.n)
        k0, length = (
            getattr(design, each) + (shift if each == name else 0.0 * shift) for each in ("k0", "length")
        )
        back = [getattr(design, each) - (shift if each == name else 0.0 * shift) for each in ("k0", "length")]
        on = np.tile(design.pinched, (design.n, 1))
        up, down = (model.forward(k, size, on, check=False)[0][:, -1] for k, size in ((k0, length), back))
        found.update({f"{name} of segment {i + 1}": row for i, row in enumerate(0.5 * (up - down) / STEP)})
    return found


def sampled(
    model: Forward,
    design: Design,
    count: int,
    spreads: Spreads | None = None,
    edge: float = 1.25,
    rows: int = 4,
    seed: int = 1,
) -> Array:
    """(count, 3) ends of strips that are made with normal errors, each one simulated whole, mm.

    Args:
        model: that the design was made with.
        design: crease and pinches.
        count: of strips.
        spreads: standard deviations; None for the default ones.
        edge: of the mesh, mm along the crease.
        rows: of its cells a panel.
        seed: the same seed gives the same strips.

    Raises:
        DesignError: a path ended early.
    """
    spreads = spreads or Spreads()
    setting = replace(model.setting, edge=edge, rows=rows)
    rng = np.random.default_rng(seed)
    return np.array([_end(*made(design, setting, spreads, rng)) for _ in range(count)])


def made(
    design: Design, setting: Setting, spreads: Spreads, rng: np.random.Generator
) -> tuple[Design, Setting]:
    """A design and a setting with normal errors.

    Args:
        design: crease and pinches.
        setting: sheet, fold and pinch.
        spreads: standard deviations.
        rng: draws the errors.

    Returns:
        the design and the setting that one would get.
    """
    off = {name: getattr(setting, name) + getattr(spreads, name) * rng.normal() for name in VARIED}
    cut = replace(
        design,
        k0=design.k0 + spreads.k0 * rng.normal(size=design.n),
        length=design.length + spreads.length * rng.normal(size=design.n),
    )
    return cut, replace(setting, **off)
