"""The source's model: pinched segments by bars and hinges, between those that were simulated by interpolation (6.2.4).

The domain is not a rectangle in (k0, length), so splines run over (s, length) with s = k0 over the largest k0 of that
length: first along k0 for every length of the grid, then across by a bicubic tensor spline. docs/inverse_design.md has
the errors between grid points.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.applications.inverse.forward import Forward
from bh.applications.inverse.segments import DesignError, Domain, folded, folded_transforms
from bh.applications.inverse.simulate import SETTING, Landing, Setting, simulate
from bh.applications.inverse.transforms import chain, matrix
from bh.paths.data_sets import loaded as data_set

if TYPE_CHECKING:
    from xarray import Dataset

Array = NDArray[np.float64]
FORMAT = 1  # of the data set; raised when its variables change
SHIPPED = Path(__file__).with_name("segments.nc")
COLUMNS = 81  # of s, as many as the source has curvatures


class Surrogate:
    """Segments of one setting, pinched ones by interpolation, others in closed form.

    Attributes:
        domain: where it may be asked.
        setting: what was simulated.
        has_variants: False, see `Forward`.
    """

    def __init__(
        self, k0: ArrayLike, length: ArrayLike, values: ArrayLike, setting: Setting = SETTING
    ) -> None:
        """`values` (m, 6) are t (mm) and the Tait-Bryan angles (rad, w not wrapped) of segments (m,) of a grid.

        Raises:
            DesignError: the segments are no grid, or leave out parts of the domain.
        """
        from scipy.interpolate import CubicSpline, NdBSpline, RectBivariateSpline

        self.setting, self.domain, self.has_variants = setting, Domain(fold=setting.fold), False
        k0, length, values = (np.asarray(x, dtype=float) for x in (k0, length, values))
        lengths = np.unique(length)
        s = np.linspace(-1.0, 1.0, COLUMNS)
        bound = self.sector_bound(lengths)
        table = np.empty((COLUMNS, len(lengths), 6))
        for j, row in enumerate(lengths):
            here = np.flatnonzero(length == row)
            here = here[np.argsort(k0[here])]
            if (
                len(here) < 4
                or k0[here[-1]] < bound[j] * (1.0 - 1e-9)
                or k0[here[0]] > -bound[j] * (1.0 - 1e-9)
            ):
                raise DesignError(
                    f"the data set has too few segments of length {row:g} mm; make it anew: bh segments"
                )
            table[:, j] = CubicSpline(k0[here], values[here])(s * bound[j])
        if not np.isfinite(table).all():
            raise DesignError(
                "the data set has segments without values; see 'reason' in it, and make it anew"
            )
        knots = RectBivariateSpline(s, lengths, table[..., 0]).get_knots()
        coefficients = np.stack(
            [RectBivariateSpline(s, lengths, table[..., i]).get_coeffs() for i in range(6)], axis=-1
        )
        self._spline = NdBSpline(knots, coefficients.reshape(COLUMNS, len(lengths), 6), 3)

    @classmethod
    def of(cls, data: Dataset) -> Surrogate:
        """From a data set of `bh segments`.

        Raises:
            DesignError: it is of another version, or lacks something.
        """
        if data.attrs.get("format") != FORMAT:
            raise DesignError(
                f"the data set has format {data.attrs.get('format')}, this version reads {FORMAT}; "
                "make it anew: bh segments"
            )
        try:
            setting = Setting(**json.loads(data.attrs["setting"]))
            values = np.column_stack((data["t"].values, data["uvw"].values))
            return cls(data["k0"].values, data["length"].values, values, setting)
        except (KeyError, TypeError, ValueError) as error:
            raise DesignError(f"the data set is incomplete ({error}); make it anew: bh segments") from error

    def sector_bound(self, length: ArrayLike) -> Array:
        """Curvature before folding at which the sector is as large as it may be, 1/mm.

        Returns:
            of the shape of `length`.
        """
        return np.asarray(
            self.domain.sector * math.sin(0.5 * self.setting.fold) / np.asarray(length, dtype=float)
        )

    def pinched(self, k0: ArrayLike, length: ArrayLike, check: bool = True) -> tuple[Array, Array]:
        """(..., 3) translations and (..., 3) Tait-Bryan angles of pinched segments.

        Args:
            k0: (...) curvatures before folding, 1/mm.
            length: (...), mm.
            check: refuse segments outside the domain.

        Returns:
            in mm and rad.

        Raises:
            DesignError: a segment outside the domain (unless `check` is off: then it is taken at its edge).
        """
        k0, length = np.broadcast_arrays(np.asarray(k0, dtype=float), np.asarray(length, dtype=float))
        if check:
            inside = self.domain.holds(k0, length)
            if not inside.all():
                worst = np.flatnonzero(~inside.ravel())[0]
                raise DesignError(
                    f"a pinched segment of k0 = {k0.ravel()[worst]:.4g} /mm and {length.ravel()[worst]:.4g} mm is "
                    f"outside the data set; |k0| <= {self.domain.k0} /mm, "
                    f"{self.domain.length[0]:g} to {self.domain.length[1]:g} mm "
                    "and a folded sector of at most half a turn"
                )
        at = np.clip(length, *self.domain.length)
        s = np.clip(k0 / self.sector_bound(at), -1.0, 1.0)
        found = self._spline(np.stack((s, at), axis=-1))
        return found[..., :3], found[..., 3:]

    def local(
        self, k0: ArrayLike, length: ArrayLike, pinched: ArrayLike, check: bool = True
    ) -> tuple[Array, Array]:
        """(..., 3) translations and (..., 3, 3) rotations of segments.

        Args:
            k0: (...) curvatures before folding, 1/mm.
            length: (...), mm.
            pinched: (...) truth values.
            check: refuse pinched segments outside the domain.

        Returns:
            the translations in mm.

        Raises:
            DesignError: a pinched segment outside the domain (unless `check` is off).
        """
        k0, length, on = np.broadcast_arrays(
            np.asarray(k0, dtype=float), np.asarray(length, dtype=float), np.asarray(pinched, dtype=bool)
        )
        t, uvw = folded(k0, length, self.setting.fold)
        if on.any():
            t[on], uvw[on] = self.pinched(k0[on], length[on], check)
        return t, matrix(uvw)

    def forward(
        self, k0: ArrayLike, length: ArrayLike, pinched: ArrayLike, check: bool = True
    ) -> tuple[Array, Array]:
        """Points and frames of designs of n segments: the forward process (Eq. 6.1 to 6.4).

        Args:
            k0: (..., n) curvatures before folding, 1/mm.
            length: (..., n), mm.
            pinched: (..., n) truth values.
            check: refuse pinched segments outside the domain.

        Returns:
            (..., n + 1, 3) points P_0 to P_n, mm, and (..., n + 1, 3, 3) frames.

        Raises:
            DesignError: a pinched segment outside the domain (unless `check` is off).
        """
        return chain(*self.local(k0, length, pinched, check))

    def unpinched(self, k0: ArrayLike, length: ArrayLike) -> tuple[Array, Array]:
        """Points and frames of designs before they are pinched.

        Args:
            k0: (..., n) curvatures before folding, 1/mm.
            length: (..., n), mm.

        Returns:
            (..., n + 1, 3) points, mm, and (..., n + 1, 3, 3) frames.
        """
        return chain(*folded_transforms(k0, length, self.setting.fold))

    def arc(self, k0: ArrayLike, s: ArrayLike) -> tuple[Array, Array]:
        """Motions along folded arcs, see `Forward.arc`.

        Args:
            k0: (...) curvatures before folding, 1/mm.
            s: (...) arc lengths, mm, of any sign.
        """
        return folded_transforms(k0, s, self.setting.fold)

    def land(self, k0: Sequence[float], length: Sequence[float], pinched: Sequence[bool]) -> Landing:
        """Simulate a whole strip on the source's one mesh, which has no error bar.

        Args:
            k0: (n,) curvatures before folding, 1/mm.
            length: (n,), mm.
            pinched: (n,).

        Raises:
            DesignError: the path ended early.
        """
        strip = simulate(k0, length, pinched, self.setting)
        return Landing(strip, strip.t, 0.0, strip.r, 0.0)

    def closed_by(self, part: float) -> Forward:
        """Not known to this model: only pinches that are closed all the way.

        Args:
            part: of the way.

        Raises:
            DesignError: always.
        """
        raise DesignError(
            f"the source's model knows no pinch closed by {part:g} of its way; use model = 'converged'"
        )

    def varied(self) -> Mapping[str, tuple[Forward, Forward]]:
        """None: this model does not know what strips do that are made a little differently."""
        return {}

    def made(self, off: Mapping[str, Array]) -> Forward:
        """Not known to this model: strips that are made a little differently.

        Args:
            off: how far the fields named are off.

        Raises:
            DesignError: always.
        """
        raise DesignError(
            f"the source's model does not know strips with another {', '.join(off)}; use model = 'converged'"
        )

    def bars(self, k0: ArrayLike, length: ArrayLike, pinched: ArrayLike) -> tuple[Array, Array]:
        """Zero: one mesh has no error bars, see `Forward.bars`.

        Args:
            k0: (..., n) curvatures before folding, 1/mm.
            length: (..., n), mm.
            pinched: (..., n) truth values.
        """
        shape = np.broadcast_shapes(np.shape(k0), np.shape(length), np.shape(pinched))[:-1]
        return np.zeros(shape), np.zeros(shape)

    def about(self) -> Mapping[str, object]:
        """The setting as plain data."""
        return asdict(self.setting)


@cache
def shipped() -> Surrogate:
    """The source's model by the data set that comes with the package.

    Raises:
        DesignError: xarray is not installed.
    """
    return read(SHIPPED)


def read(file: str | Path) -> Surrogate:
    """The surrogate of a data set of `bh segments --model source`.

    Raises:
        DesignError: it cannot be read.
    """
    return Surrogate.of(loaded(file))


def loaded(file: str | Path) -> Dataset:
    """A data set of `bh segments`, of any model.

    Raises:
        DesignError: it cannot be read.
    """
    try:
        import h5netcdf  # noqa: F401
        import xarray  # noqa: F401
    except ImportError as error:
        raise DesignError(
            f"inverse design needs xarray and h5netcdf ({error}); add the extra: "
            "pip install 'curved-crease-workbench[design]'"
        ) from error
    if not Path(file).is_file():
        raise DesignError(f"there is no data set '{file}'; make one: bh segments -o {file}")
    return data_set(Path(file), DesignError)
