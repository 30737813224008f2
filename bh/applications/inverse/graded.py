"""Pinches of any intensity, from folded (phi_p = pi / 2) to the source's pi / 14: the axis that it leaves open (6.4.3).

The intensity a in [0, 1] is the share of the way that the middle of the pinch closes. What the pinch adds to the folded
segment is interpolated over (s, length, a), with zero at a = 0 and the fine data set at a = 1.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import NdBSpline, make_interp_spline

from bh.applications.inverse.optimisers import polish
from bh.applications.inverse.segments import DesignError, folded
from bh.applications.inverse.surrogate import FORMAT, Surrogate, shipped
from bh.applications.inverse.transforms import chain, matrix

if TYPE_CHECKING:
    from xarray import Dataset

Array = NDArray[np.float64]
SHIPPED = Path(__file__).with_name("intensities.nc")
MIRROR = np.array(
    [1.0, -1.0, 1.0, -1.0, 1.0, -1.0]
)  # of t and (u, v, w) where the curvature changes its sign


class Graded:
    """Segments pinched to any intensity.

    Attributes:
        full: the surrogate of full pinches that it meets at a = 1.
    """

    def __init__(self, full: Surrogate, data: Dataset) -> None:
        """`data` has segments of k0 >= 0 on a grid of s, lengths and intensities between 0 and 1.

        Raises:
            DesignError: it is of another version or setting, or no grid.
        """
        self.full, setting = full, full.setting
        if data.attrs.get("format") != FORMAT or json.loads(data.attrs["setting"]) != dict(full.about()):
            raise DesignError(
                "the intensities are of another version or setting than the data set; make them anew"
            )
        k0, length, pinch = (np.asarray(data[name].values, dtype=float) for name in ("k0", "length", "pinch"))
        s = np.round(k0 / full.sector_bound(length), 6)
        a = np.round((setting.fold - pinch) / (setting.fold - setting.pinch), 6)
        axes = [np.unique(axis) for axis in (s, length, a)]
        if np.prod([len(axis) for axis in axes]) != len(s):
            raise DesignError("the intensities are no grid of curvatures, lengths and angles; make them anew")
        values = np.column_stack((data["t"].values, data["uvw"].values)) - np.concatenate(
            folded(k0, length), axis=-1
        )
        half = np.empty((*(len(axis) for axis in axes), 6))
        half[tuple(np.searchsorted(axis, x) for axis, x in zip(axes, (s, length, a), strict=True))] = values
        table = np.concatenate((half[:0:-1] * MIRROR, half))
        knots_s, lengths = np.concatenate((-axes[0][:0:-1], axes[0])), axes[1]
        grid_s, grid_l = np.meshgrid(knots_s, lengths, indexing="ij")
        k_full = grid_s * full.sector_bound(grid_l)
        ends = np.concatenate(full.pinched(k_full, grid_l, check=False), axis=-1) - np.concatenate(
            folded(k_full, grid_l, setting.fold), axis=-1
        )
        table = np.concatenate((np.zeros_like(table[:, :, :1]), table, ends[:, :, None]), axis=2)
        grids = (knots_s, lengths, np.concatenate(([0.0], axes[2], [1.0])))
        knots = []
        for axis, points in enumerate(grids):
            spline = make_interp_spline(points, table, k=3, axis=axis)
            table = np.moveaxis(spline.c, 0, axis)
            knots.append(spline.t)
        self._spline = NdBSpline(tuple(knots), table, 3)

    def local(self, k0: ArrayLike, length: ArrayLike, intensity: ArrayLike) -> tuple[Array, Array]:
        """(..., 3) translations and (..., 3, 3) rotations of segments pinched to intensities in [0, 1].

        Args:
            k0: (...) curvatures before folding, 1/mm.
            length: (...), mm.
            intensity: (...) in [0, 1].

        Returns:
            broadcast from the arguments.
        """
        k0, length, a = np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in (k0, length, intensity)))
        at = np.clip(length, *self.full.domain.length)
        s, a = np.clip(k0 / self.full.sector_bound(at), -1.0, 1.0), np.clip(a, 0.0, 1.0)
        coarse = self._spline(np.stack((s, at, a), axis=-1))
        coarse_end = self._spline(np.stack((s, at, np.ones_like(a)), axis=-1))
        flat = np.concatenate(folded(k0, length, self.full.setting.fold), axis=-1)
        fine_end = np.concatenate(self.full.pinched(k0, length, check=False), axis=-1) - flat
        found = flat + coarse + a[..., None] * (fine_end - coarse_end)
        return found[..., :3], matrix(found[..., 3:])

    def forward(self, k0: ArrayLike, length: ArrayLike, intensity: ArrayLike) -> tuple[Array, Array]:
        """Points and frames of designs (..., n) whose segments are pinched to some intensities.

        Args:
            k0: (..., n) curvatures before folding, 1/mm.
            length: (..., n), mm.
            intensity: (..., n) in [0, 1].

        Returns:
            (..., n + 1, 3) points, mm, and (..., n + 1, 3, 3) frames.
        """
        return chain(*self.local(k0, length, intensity))


@dataclass(frozen=True, eq=False)
class ReachGraded:
    """Problem C with intensities: variables are s, length and intensity of n segments; one segment has three."""

    graded: Graded
    n: int
    target: Array = field(default_factory=lambda: np.zeros(3))
    switches: int = 0

    @property
    def lower(self) -> Array:
        """(3 n,) least values of the variables."""
        return np.repeat([-1.0, self.graded.full.domain.length[0], 0.0], self.n)

    @property
    def upper(self) -> Array:
        """(3 n,) largest values of the variables."""
        return np.repeat([1.0, self.graded.full.domain.length[1], 1.0], self.n)

    def split(self, x: Array) -> tuple[Array, Array, Array]:
        """(k0, length, intensity) of variables (..., 3 n)."""
        s, length, a = np.split(np.asarray(x), 3, axis=-1)
        return s * self.graded.full.domain.largest_curvature(length), length, a

    def residuals(self, x: Array, on: NDArray[np.bool_]) -> Array:
        """(N, 3) from the target to the ends, mm.

        Args:
            x: (N, m) candidates.
            on: of no use here.
        """
        del on  # nothing is switched here
        found: Array = self.graded.forward(*self.split(x))[0][..., -1, :] - self.target
        return found

    def evaluate(self, x: Array, on: NDArray[np.bool_]) -> tuple[Array, Array]:
        """(N,) distances from the target, mm, and violations, which are zero."""
        return np.linalg.norm(self.residuals(x, on), axis=-1), np.zeros(len(x))

    def best(self, starts: int = 4000, polished: int = 8, seed: int = 1) -> tuple[Array, float]:
        """Variables that come nearest to the target, mm: the nearest of random ones, polished.

        Args:
            starts: random designs.
            polished: how many of the nearest ones are polished.
            seed: the same seed gives the same design.

        Returns:
            the variables (3 n,), and their distance, mm.
        """
        rng = np.random.default_rng([seed, self.n])
        x = self.lower + (self.upper - self.lower) * rng.random((starts, 3 * self.n))
        none: NDArray[np.bool_] = np.zeros(0, dtype=bool)
        order = np.argsort(self.evaluate(x, none)[0])[:polished]
        found = min((polish(self, x[i], none) for i in order), key=lambda each: each.value)
        return found.x, found.value


@cache
def intensities() -> Graded:
    """The graded surrogate of the data sets that come with the package."""
    import xarray

    with xarray.open_dataset(SHIPPED, engine="h5netcdf") as data:
        return Graded(shipped(), data.load())
