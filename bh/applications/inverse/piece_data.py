"""From a data set of simulated pieces to functions of the curvatures: on levels of meshes, and in their limit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.applications.inverse.levels import Limit, Series
from bh.applications.inverse.motions import ACROSS, ALONG, exponential, logarithm, then
from bh.applications.inverse.pieces import LARGEST, LEVELS, Kind, Level, curvatures

if TYPE_CHECKING:
    from xarray import Dataset

Array = NDArray[np.float64]
Motion = tuple[Array, Array]
Arc = Callable[[float, float], Motion]  # of a curvature before folding, 1/mm, and an arc length, mm
OWN = {
    "pinch": np.array(
        [1.0, 0.0, 0.0, 0.0, 1.0, 1.0]
    ),  # what symmetry leaves of a piece that is its own image
    "arc": np.array([1.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
}


@dataclass(frozen=True, eq=False)
class PieceData:
    """Simulated pieces by kind, mesh and curvatures.

    Attributes:
        data: of `bh.sweep.segments.build_pieces`.
        other: pieces to take where `data` has none.
        levels: meshes of each kind, coarse first, and the curvatures that the data have of them.
    """

    data: Dataset
    other: PieceData | None = None
    levels: Mapping[Kind, tuple[Level, ...]] = field(default_factory=lambda: LEVELS)

    @cached_property
    def rows(self) -> dict[tuple[str, int, float, float], tuple[Array, Array, Array]]:
        """Motions and distances by kind, rows of cells and curvatures (1/mm), see `PieceValues`."""
        d = {
            name: self.data[name].values
            for name in ("kind", "rows", "before", "after", "t", "r", "to_middle")
        }
        own = {
            (str(kind), int(rows), float(before), float(after)): (t, r, to)
            for kind, rows, before, after, t, r, to in zip(*d.values(), strict=True)
        }
        return own if self.other is None else {**self.other.rows, **own}

    def _row(self, kind: Kind, level: Level, before: float, after: float) -> tuple[Motion, Motion, Array]:
        """Motions from the free end to the first section and from there to the second, and the distances.

        Raises:
            KeyError: it is not in the data set.
            ValueError: it could not be simulated.
        """
        key = (kind, level.rows, float(np.round(before, 12)), float(np.round(after, 12)))
        t, r, to = self.rows[key]
        if not np.isfinite(t).all():
            raise ValueError(f"the piece {key} was not simulated")
        return (t[0], r[0]), (t[1], r[1]), to

    def series(self, number: int) -> dict[str, Series]:
        """Functions of one level of meshes (from 0), by name: arc (rate), end, pinch, joint."""
        arc = Series.through(self._arcs(number))
        found = {"arc": arc}
        for name, values in (("end", self._ends), ("pinch", self._pinches), ("joint", self._joints)):
            found[name] = Series.through(values(number, going(arc)))
        return found

    @cached_property
    def limits(self) -> dict[str, Limit]:
        """Limits of the same functions; what lies between arcs is read with the limit of the arcs."""
        found = {"arc": self._arc}
        kinds: tuple[tuple[str, Kind, Callable[[int, Arc], Array]], ...] = (
            ("end", "arc", self._ends),
            ("pinch", "pinch", self._pinches),
            ("joint", "joint", self._joints),
        )
        for name, kind, values in kinds:
            count = len(self.levels[kind])
            found[name] = Limit.of([values(i, going(self._arc.value)) for i in range(count)])
        return found

    def pinches(self, count: int) -> Limit:
        """The limit of the pinches' first levels of meshes, with the limit of the arcs.

        Args:
            count: of the levels, 3 or more.
        """
        return Limit.of([self._pinches(i, going(self._arc.value)) for i in range(count)])

    @cached_property
    def _arc(self) -> Limit:
        return Limit.of([self._arcs(i) for i in range(len(self.levels["arc"]))])

    def _halved(self, level: Level, value: Callable[[float], Array]) -> Array:
        """(degree + 1, 6) values at all curvatures from those at the ones from zero."""
        k0 = curvatures(level.degree)
        half = np.array([value(float(k)) for k in k0[level.degree // 2 :]])
        return np.concatenate((half[:0:-1] * ACROSS, half))

    def _arcs(self, number: int) -> Array:
        level = self.levels["arc"][number]

        def rate(k0: float) -> Array:
            _, across, to = self._row("arc", level, k0, k0)
            return np.asarray(OWN["arc"] * logarithm(*across) / (2.0 * to[1]))

        return self._halved(level, rate)

    def _ends(self, number: int, arc: Arc) -> Array:
        level = self.levels["arc"][number]

        def end(k0: float) -> Array:
            first, _, to = self._row("arc", level, k0, k0)
            return logarithm(*then(first, arc(k0, -float(to[0]))))

        return self._halved(level, end)

    def _pinches(self, number: int, arc: Arc) -> Array:
        level = self.levels["pinch"][number]

        def pinch(k0: float) -> Array:
            _, across, to = self._row("pinch", level, k0, k0)
            back = arc(k0, -float(to[1]))
            return np.asarray(OWN["pinch"] * logarithm(*then(then(back, across), back)))

        return self._halved(level, pinch)

    def _joints(self, number: int, arc: Arc) -> Array:
        """(degree + 1, degree + 1, 6) of both curvatures.

        A joint of equal ones is an arc: it is no motion in the limit, and on a mesh as far off as its neighbours.
        """
        level = self.levels["joint"][number]
        k0 = curvatures(level.degree)
        last = len(k0) - 1
        found = np.zeros((len(k0), len(k0), 6))

        def between(kind: Kind, a: float, b: float) -> Array:
            _, across, to = self._row(kind, level, a, b)
            sides = [arc(k, -float(to[1])) for k in (a, b)]
            return logarithm(*then(then(sides[0], across), sides[1]))

        for i, a in enumerate(map(float, k0)):
            if a >= 0.0:
                found[i, i] = OWN["arc"] * between("arc", a, a)
                found[last - i, last - i] = ACROSS * found[i, i]
            for j, b in enumerate(map(float, k0)):
                if i < j and a + b >= -1e-12:
                    value = between("joint", a, b)
                    found[i, j], found[j, i] = value, ALONG * value
                    found[last - i, last - j] = ACROSS * value
                    found[last - j, last - i] = ACROSS * ALONG * value
        return found


def going(rate: Series) -> Arc:
    """Motions along arcs of a rate."""
    return lambda k0, s: exponential(s * rate(np.asarray(k0 / LARGEST)))
