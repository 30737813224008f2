"""Where folded and pinched creases end by the formulation that converges: chains of pieces, with error bars.

A strip is: free end, arc of half a segment, pinch, the other half, joint, ..., free end (`pieces`). Frames are those of
cross-sections; within arcs their first two axes lie in the plane of the crease, at free ends they are turned about the
crease by up to 1.4 degrees, since edges bow.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.applications.inverse.levels import Function, Limit, Sampled, Series, lagrange
from bh.applications.inverse.motions import ALONG, exponential, logarithm
from bh.applications.inverse.piece_data import PieceData
from bh.applications.inverse.pieces import LARGEST, LEVELS, PIECES
from bh.applications.inverse.segments import DesignError, Domain
from bh.applications.inverse.simulate import Landing, Setting, simulate
from bh.applications.inverse.transforms import chain
from bh.applications.inverse.variants import STEPS, VariantData, closed, parts, variants

if TYPE_CHECKING:
    from xarray import Dataset

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
ANEW = "make it anew: bh segments"
STRIP = 1  # level on which whole strips are simulated
SHARE = 0.5  # of what a strip does beside the chain of its pieces, on a mesh that is not fine, is doubt


class Converged:
    """Strips of one setting as chains of pieces.

    Attributes:
        domain: of the segments that designs are made of.
        setting: sheet, fold and pinch.
        mesh: of whole strips that are simulated.
        has_variants: pieces that are made differently are known.
    """

    def __init__(
        self,
        series: Mapping[str, Function],
        setting: Setting,
        limits: Mapping[str, Limit] | None = None,
        same: Converged | None = None,
        varied: VariantData | None = None,
        level: int | None = None,
    ) -> None:
        """Take functions "arc" (rate of its motion), "end", "pinch" and "joint" of the curvatures.

        Args:
            series: the functions.
            setting: sheet, fold and pinch.
            limits: what they are limits of, with error bars; None where they are those of one mesh.
            same: the model of one mesh, on which whole strips are simulated.
            varied: pieces of strips that are made differently; None where these are not known.
            level: of meshes that the functions are of, from 0 (`pieces.LEVELS`); None in the limit.
        """
        self.setting, self.domain = setting, Domain(k0=LARGEST, fold=setting.fold)
        self.mesh = LEVELS["pinch"][STRIP]
        self._series, self._limits, self._same = series, limits or {}, same or self
        self._varied, self._level = varied, level
        self.has_variants = varied is not None and varied.setting == setting

    @classmethod
    def of(cls, data: Dataset, other: Dataset | None = None) -> Converged:
        """From a data set of `bh segments`.

        Args:
            data: of the pieces.
            other: of their variants, or None.

        Raises:
            DesignError: it is of another version, or lacks something.
        """
        if data.attrs.get("format") != PIECES:
            raise DesignError(
                f"the data set has format {data.attrs.get('format')}, pieces have {PIECES}; {ANEW}"
            )
        try:
            setting = _setting(data)
            read = PieceData(data)
            values = {name: limit.value for name, limit in read.limits.items()}
            same = cls(read.series(STRIP), setting)
            varied = None if other is None else VariantData(other, read, _setting(other))
            return cls(values, setting, read.limits, same, varied)
        except (KeyError, TypeError, ValueError) as error:
            raise DesignError(f"the data set is incomplete ({error}); {ANEW}") from error

    @property
    def same_mesh(self) -> Converged:
        """The same strips on the mesh on which whole strips are simulated."""
        return self._same

    def sector_bound(self, length: ArrayLike) -> Array:
        """Curvature before folding at which the sector is as large as it may be, 1/mm.

        Returns:
            of the shape of `length` (mm).
        """
        bound = self.domain.sector * math.sin(0.5 * self.setting.fold)
        return np.asarray(bound / np.asarray(length, dtype=float))

    def arc(self, k0: ArrayLike, s: ArrayLike) -> tuple[Array, Array]:
        """Motions along arcs, translations (..., 3) in mm and rotations (..., 3, 3).

        Args:
            k0: (...) curvatures before folding, 1/mm.
            s: (...) arc lengths, mm, of any sign.
        """
        k0, s = np.broadcast_arrays(np.asarray(k0, dtype=float), np.asarray(s, dtype=float))
        rate = self._at("arc", k0)
        turn, size = rate[..., 5] * s, rate[..., 0] * s
        t = np.zeros((*s.shape, 3))
        t[..., 0] = size * np.sinc(turn / np.pi)
        t[..., 1] = 0.5 * size * turn * np.sinc(0.5 * turn / np.pi) ** 2
        r = np.zeros((*s.shape, 3, 3))
        r[..., 0, 0] = r[..., 1, 1] = np.cos(turn)
        r[..., 1, 0] = np.sin(turn)
        r[..., 0, 1], r[..., 2, 2] = -r[..., 1, 0], 1.0
        return t, r

    def curvature(self, k0: ArrayLike) -> Array:
        """Curvature of folded arcs, 1/mm.

        Args:
            k0: (...) before folding, 1/mm.

        Returns:
            of the shape of `k0`.
        """
        return np.asarray(self._at("arc", np.asarray(k0, dtype=float))[..., 5])

    def _at(self, name: str, *k0: Array) -> Array:
        return self._series[name](*(np.clip(k / LARGEST, -1.0, 1.0) for k in k0))

    def motions(self, k0: Array, length: Array, pinched: Bools) -> tuple[Array, Array]:
        """(..., 4 n + 1, 3) and (..., 4 n + 1, 3, 3) motions of the pieces of strips (..., n), in order.

        Args:
            k0: curvatures before folding, 1/mm.
            length: mm.
            pinched: truth values.
        """
        n = k0.shape[-1]
        t = np.zeros((*k0.shape[:-1], 4 * n + 1, 3))
        r = np.zeros((*k0.shape[:-1], 4 * n + 1, 3, 3))
        arcs = self.arc(k0, 0.5 * length)
        jumps = exponential(self._at("joint", k0[..., :-1], k0[..., 1:]))
        pinches = exponential(self._at("pinch", k0) * pinched[..., None])
        for first, moves in ((1, arcs), (2, pinches), (3, arcs), (4, jumps)):
            t[..., first:-1:4, :], r[..., first:-1:4, :, :] = moves
        t[..., 0, :], r[..., 0, :, :] = exponential(self._at("end", k0[..., 0]))
        t[..., -1, :], r[..., -1, :, :] = exponential(ALONG * self._at("end", k0[..., -1]))
        return t, r

    def forward(
        self, k0: ArrayLike, length: ArrayLike, pinched: ArrayLike, check: bool = True
    ) -> tuple[Array, Array]:
        """Points and frames of whole strips: start, joints and end.

        Args:
            k0: (..., n) curvatures before folding, 1/mm.
            length: (..., n), mm.
            pinched: (..., n) truth values.
            check: refuse segments outside the domain; else they are taken at its edge.

        Returns:
            (..., n + 1, 3) points P_0 to P_n, mm, and (..., n + 1, 3, 3) frames.

        Raises:
            DesignError: a segment outside the domain (unless `check` is off).
        """
        k0, length, on = _design(k0, length, pinched)
        if check:
            self._check(k0, length, on)
        from bh.applications.inverse.strip_kernel import joints

        rate, half = self._at("arc", k0), 0.5 * length
        found = joints(
            _flat(np.stack((self._at("end", k0[..., 0]), ALONG * self._at("end", k0[..., -1])), axis=-2)),
            _flat(np.stack((rate[..., 5] * half, rate[..., 0] * half), axis=-1)),
            _flat(self._at("pinch", k0) * on[..., None]),
            _flat(self._at("joint", k0[..., :-1], k0[..., 1:])),
        )
        points, frames = (each.reshape(*k0.shape[:-1], *each.shape[1:]) for each in found)
        return points, frames

    def unpinched(self, k0: ArrayLike, length: ArrayLike) -> tuple[Array, Array]:
        """Points and frames of strips before they are pinched, see `forward`.

        Args:
            k0: (..., n) curvatures before folding, 1/mm.
            length: (..., n), mm.

        Returns:
            (..., n + 1, 3) points, mm, and (..., n + 1, 3, 3) frames.
        """
        return self.forward(k0, length, np.zeros(np.shape(k0), dtype=bool), check=False)

    def _check(self, k0: Array, length: Array, on: Bools) -> None:
        low, high = self.domain.length
        inside = (np.abs(k0) <= LARGEST * (1.0 + 1e-9)) & (~on | self.domain.holds(k0, length))
        if not inside.all():
            worst = np.flatnonzero(~inside.ravel())[0]
            raise DesignError(
                f"a segment of k0 = {k0.ravel()[worst]:.4g} /mm and {length.ravel()[worst]:.4g} mm is outside the "
                f"data set; |k0| <= {LARGEST} /mm, and where it is pinched {low:g} to {high:g} mm and a folded sector "
                "of at most half a turn"
            )

    def bars(self, k0: ArrayLike, length: ArrayLike, pinched: ArrayLike) -> tuple[Array, Array]:
        """Error bars of the ends of strips (...): of the position, mm, and of the orientation, rad.

        Those of all pieces are added up as if all pulled the same way.

        Args:
            k0: (..., n) curvatures before folding, 1/mm.
            length: (..., n), mm.
            pinched: (..., n) truth values.
        """
        k0, length, on = _design(k0, length, pinched)
        points, frames = chain(*self.motions(k0, length, on))
        doubt = self._bars(k0, length, on)
        lever = points[..., -1:, :] - points[..., :-1, :]
        moved = np.cross(np.swapaxes(frames[..., :-1, :, :], -1, -2), lever[..., None, :])
        size = np.linalg.norm(moved, axis=-1)
        position = (doubt[..., :3] + size * doubt[..., 3:]).sum(axis=(-1, -2))
        return position, doubt[..., 3:].sum(axis=(-1, -2))

    def _bars(self, k0: Array, length: Array, on: Bools) -> Array:
        """(..., 4 n + 1, 6) error bars of the vectors of all pieces."""

        def of(name: str, *k: Array) -> Array:
            limit = self._limits.get(name)
            at = [np.clip(each / LARGEST, -1.0, 1.0) for each in k]
            return np.zeros((*k[0].shape, 6)) if limit is None else limit.bar(*at)

        n = k0.shape[-1]
        found = np.zeros((*k0.shape[:-1], 4 * n + 1, 6))
        found[..., 1::4, :][..., :n, :] = 0.5 * length[..., None] * of("arc", k0)
        found[..., 3::4, :][..., :n, :] = found[..., 1::4, :][..., :n, :]
        found[..., 2::4, :][..., :n, :] = of("pinch", k0) * on[..., None]
        if n > 1:
            found[..., 4:-1:4, :] = of("joint", k0[..., :-1], k0[..., 1:])
        found[..., 0, :], found[..., -1, :] = of("end", k0[..., 0]), of("end", k0[..., -1])
        return found

    def land(self, k0: Sequence[float], length: Sequence[float], pinched: Sequence[bool]) -> Landing:
        """Simulate a whole strip, and say where it ends in the limit of fine meshes.

        What the strip does beside the chain of its pieces is read from one mesh, the same for both, and added to
        the limit of the chain. Half of it is doubt, beside the error bars of the pieces.

        Args:
            k0: (n,) curvatures before folding, 1/mm.
            length: (n,), mm.
            pinched: (n,).

        Raises:
            DesignError: the path ended early.
        """
        strip = simulate(k0, length, pinched, replace(self.setting, edge=self.mesh.edge, rows=self.mesh.rows))
        design = np.asarray(k0), np.asarray(length), np.asarray(pinched)
        (same, same_frames), (points, frames) = (
            model.forward(*design, check=False) for model in (self._same, self)
        )
        beside, turned = strip.t - same[-1], same_frames[-1].T @ strip.r
        position, turn = (float(bar) for bar in self.bars(*design))
        return Landing(
            strip,
            points[-1] + beside,
            position + SHARE * float(np.linalg.norm(beside)),
            frames[-1] @ turned,
            turn + SHARE * float(np.linalg.norm(logarithm(np.zeros(3), turned)[3:])),
        )

    def closed_by(self, part: float) -> Converged:
        """The model of the same strips with all pinches closed by a part of the way.

        Args:
            part: from 0 to 1; polynomials through the parts of the data set.

        Raises:
            DesignError: the data set of the variants is of another setting, or part is none.
        """
        if not 0.0 <= part <= 1.0:
            raise DesignError(f"a pinch cannot be closed by {part:g} of its way; give a part from 0 to 1")
        weights = lagrange(parts(), part)[1:]  # nothing happens where no pinch is closed
        known = [*self._variants().closing, self._limits["pinch"]]
        limit, same = (
            sum((s.times(w) for w, s in zip(weights, series, strict=True)), Series(np.zeros((1, 6))))
            for series in ([each.value for each in known], [each.levels[STRIP] for each in known])
        )
        doubts = tuple(d.times(w) for w, each in zip(weights, known, strict=True) for d in each.doubts)
        between = sum(abs(w) * each.between for w, each in zip(weights, known, strict=True))
        setting = closed(self.setting, part)
        return Converged(
            {**self._series, "pinch": limit},
            setting,
            {**self._limits, "pinch": Limit((same,), limit, doubts, np.asarray(between))},
            self._same.pinching(same, setting),
        )

    def pinching(self, pinch: Series, setting: Setting) -> Converged:
        """The same strips with another pinch.

        Args:
            pinch: its motions.
            setting: that it is of.
        """
        return Converged({**self._series, "pinch": pinch}, setting)

    def varied(self) -> Mapping[str, tuple[Converged, Converged]]:
        """Models of strips with one thing a step less and a step more (`variants.STEPS`), by its name.

        Raises:
            DesignError: the data set of the variants is of another setting.
        """
        return self._pairs

    @cached_property
    def _made(self) -> dict[tuple[str, int], Mapping[str, Series]]:
        """The functions of strips with one thing a step less and a step more."""
        data = self._variants()
        return {(name, sign): data.series(name, sign, self._level) for name in STEPS for sign in (-1, 1)}

    @cached_property
    def _pairs(self) -> dict[str, tuple[Converged, Converged]]:
        def one(name: str, sign: int) -> Converged:
            return Converged(self._made[name, sign], variants(self.setting)[name, sign])

        return {name: (one(name, -1), one(name, 1)) for name in STEPS}

    def made(self, off: Mapping[str, Array]) -> Converged:
        """The same strips, each of S samples made a little differently: of its designs (S, n).

        Args:
            off: (S,) how far the fields of the setting named are off, in their units.

        Raises:
            DesignError: the data set of the variants is of another setting.
        """
        slopes = {name: self._slopes[name] for name in off}
        amounts = tuple(off.values())
        series = {
            name: Sampled(base, tuple(slope[name] for slope in slopes.values()), amounts)
            for name, base in self._series.items()
        }
        return Converged(series, self.setting)

    def on_mesh(self, number: int) -> Converged:
        """The same strips on one level of meshes: what whole strips that are simulated on it are compared with.

        Args:
            number: of the level, from 0 (`pieces.LEVELS`).

        Raises:
            DesignError: the data set of the variants is of another setting.
        """
        return Converged(
            self._variants().pieces.series(number), self.setting, varied=self._varied, level=number
        )

    @cached_property
    def _slopes(self) -> dict[str, dict[str, Series]]:
        """What each function changes by with one unit of each thing."""
        found: dict[str, dict[str, Series]] = {}
        for thing, step in STEPS.items():
            down, up = self._made[thing, -1], self._made[thing, 1]
            found[thing] = {
                name: (up[name] + down[name].times(-1.0)).times(0.5 / step) for name in self._series
            }
        return found

    def _variants(self) -> VariantData:
        if self._varied is None or not self.has_variants:
            raise DesignError(f"there are no variants of this data set's setting; {ANEW}")
        return self._varied

    def about(self) -> Mapping[str, object]:
        """The setting as plain data."""
        return asdict(self.setting)


def _setting(data: Dataset) -> Setting:
    return Setting(**json.loads(data.attrs["setting"]))


def _flat(of_strips: Array) -> Array:
    """(s, n, m) from (..., n, m)."""
    shape = of_strips.shape  # -1 would not do: one segment has no joints
    return of_strips.reshape(math.prod(shape[:-2]), *shape[-2:])


def _design(k0: ArrayLike, length: ArrayLike, pinched: ArrayLike) -> tuple[Array, Array, Bools]:
    k, size, on = np.broadcast_arrays(
        np.asarray(k0, dtype=float), np.asarray(length, dtype=float), np.asarray(pinched, dtype=bool)
    )
    return k, size, on
