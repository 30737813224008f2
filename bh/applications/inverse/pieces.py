"""The pieces that strips are made of, simulated by the formulation that converges.

What a pinch, a free end or a jump of the curvature does to a folded strip has died out a few widths away: measured, by
a factor of three to ten each 5 mm. In between the crease is a plane arc. So a strip is a chain of four kinds of pieces,
each of one or two curvatures only, whatever the lengths of its segments:

- "arc": how an arc of some curvature before folding goes on, and what lies between its free end and the arc;
- "pinch": what a pinch adds between the arcs on its two sides, as if it were a point in its middle;
- "joint": the same where two curvatures meet.

Each is simulated in a short strip on several levels of mesh, coarse first, every one half as wide as the one before
(rows twice as many). Fine levels have fewer curvatures: what a level adds is smooth (`converged`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal, TypedDict, get_args

import numpy as np
from numpy.typing import NDArray

from bh.applications.inverse.segments import DesignError
from bh.applications.inverse.simulate import Setting, simulate
from bh.applications.inverse.transforms import frame, relative
from bh.formulations.state import State

Array = NDArray[np.float64]
Kind = Literal["arc", "pinch", "joint"]
PIECES = 3  # format of the data set; raised when its variables or points change
FREE = 30.0  # mm from a free end or a joint to the section where an arc is taken to be one
CLEAR = 30.0  # mm from the end of a pinched zone to it
END = 10.0  # mm from there to the free end
LARGEST = 0.02  # 1/mm, curvature before folding up to which pieces are known
VARIED = ("Lstar", "t", "zone", "pinch", "fold")  # of `Setting`, that strips may be made off
CONVERGING = Setting(edge=2.5, rows=2, formulation="consistent")


@dataclass(frozen=True)
class Level:
    """A mesh, and the degree of the polynomials in the curvature that its values are taken for."""

    edge: float
    rows: int
    degree: int


LEVELS: dict[Kind, tuple[Level, ...]] = {
    "arc": (Level(2.5, 2, 16), Level(1.25, 4, 16), Level(0.625, 8, 8)),
    "pinch": (
        Level(2.5, 2, 64),
        Level(1.25, 4, 64),
        Level(0.625, 8, 32),
        Level(0.3125, 16, 32),
        Level(0.15625, 32, 8),
    ),
    "joint": (Level(2.5, 2, 8), Level(1.25, 4, 8), Level(0.625, 8, 4)),
}


def curvatures(degree: int) -> Array:
    """(degree + 1,) Chebyshev points of the curvatures before folding, 1/mm, increasing; even degrees nest by halves.

    Args:
        degree: even, so that 0 is among them.
    """
    found: Array = LARGEST * np.sin(0.5 * np.pi * np.arange(-degree, degree + 1, 2) / degree)
    return found


def simulated(kind: Kind, level: Level) -> Iterator[tuple[float, float]]:
    """Pairs of curvatures (before, after) that are simulated, 1/mm; their images by symmetry are left out.

    Args:
        kind: of the piece.
        level: of the mesh.
    """
    k0 = [float(np.round(k, 12)) for k in curvatures(level.degree)]
    if kind != "joint":
        yield from ((k, k) for k in k0 if k >= 0.0)
        return
    for i, before in enumerate(k0):  # exchanged, and with both signs turned, a joint is an image of itself
        for after in k0[i + 1 :]:
            if before + after >= -1e-12:
                yield before, after


def table() -> dict[str, list[float | int | str]]:
    """Columns of all points: kind, before, after (1/mm), edge (mm) and rows, coarse and cheap ones first."""
    rows = [
        (kind, before, after, level.edge, level.rows)
        for kind in get_args(Kind)
        for level in LEVELS[kind]
        for before, after in simulated(kind, level)
    ]
    rows.sort(key=lambda row: row[4])
    names = ("kind", "before", "after", "edge", "rows")
    return {name: list(column) for name, column in zip(names, zip(*rows, strict=True), strict=True)}


def column(name: str) -> str:
    """Name of a point's column for a field of its setting: "made_t", since "t" is what is measured.

    Args:
        name: one of `VARIED`.
    """
    return f"made_{name}"


class PieceValues(TypedDict):
    """What is measured of a piece.

    Attributes:
        t: (2, 3) from the free end to the first section, and from there to the second one, in their frames, mm.
        r: (2, 3, 3) the same, rotations.
        to_middle: (2,) arc lengths from the free end to the first section, and from there to the middle, mm; the
            second section is as far behind it.
        energy: elastic, N mm.
        stable: 1 if the state is stable, else 0.
        critical_points: on the way.
    """

    t: Array
    r: Array
    to_middle: Array
    energy: float
    stable: float
    critical_points: int


@dataclass(frozen=True)
class PieceTask:
    """One piece: the task of the sweep that makes the data set (`bh.sweep.run`).

    A point may have fields of the setting that differ, see `column`.
    """

    setting: Setting = CONVERGING

    @property
    def identity(self) -> str:
        """What the task is, for the identity of a sweep."""
        return f"piece of a strip {self.setting.identity}"

    def __call__(self, point: Mapping[str, float | int | str | bool]) -> PieceValues:
        """Simulate a piece and measure it.

        Raises:
            DesignError: the path ended early, or there is no such piece.
        """
        kind, before, after = str(point["kind"]), float(point["before"]), float(point["after"])
        setting = replace(self.setting, edge=float(point["edge"]), rows=int(point["rows"]))
        for name in VARIED:
            if column(name) in point:
                setting = replace(setting, **{name: float(point[column(name)])})  # type: ignore[arg-type]
        if kind == "pinch":
            whole, start = setting.zone + 2.0 * (CLEAR + END), END
            found = simulate([before], [whole], [True], setting)
        elif kind in ("arc", "joint"):
            whole, start = 4.0 * FREE, FREE
            found = simulate([before, after], [0.5 * whole] * 2, [False, False], setting)
        else:
            raise DesignError(f"there is no piece '{kind}'; use one of {', '.join(get_args(Kind))}")
        points, frames = sections(found.path[-1])
        cells = len(points) - 1
        a = round(start / whole * cells)
        steps = ((0, a), (a, cells - a))
        moves = [relative((points[i], frames[i]), (points[j], frames[j])) for i, j in steps]
        return {
            "t": np.array([t for t, _ in moves]),
            "r": np.array([r for _, r in moves]),
            "to_middle": np.array([whole * a / cells, whole * (0.5 - a / cells)]),
            "energy": found.path[-1].energy.total,
            "stable": float(found.path.stable is True),
            "critical_points": len(found.path.critical_points),
        }


def sections(state: State) -> tuple[Array, Array]:
    """(m, 3) nodes of the crease, mm, and (m, 3, 3) frames of the sections there (Eq. 6.10 to 6.13)."""
    places = ("crease:crease", "edge:outer", "edge:inner")
    points, left, right = (state.points[state.mesh.nodes(place)] for place in places)
    return points, frame(points, left, right)
