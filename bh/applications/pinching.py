"""Sheets that bend and twist when they are pinched (source Ch. 5): patterns, what a pinch does to them, and design.

A sheet with parallel creases is folded to 90 degrees, every crease the way that it is drawn, then all creases are
pinched in the middle to 10 degrees from closed. What bends and twists is its mid-plane (`bh.analysis.midplane`).
Angles in rad, lengths in mm.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

import meshes
from bh.analysis.midplane import MidPlane, midplane
from bh.errors import InputError, ModelError
from bh.formulations.state import State
from bh.model.model import Model
from bh.model.sheet import Sheet
from bh.paths.path import Path
from bh.runtime.one_line import OneLine
from bh.solving.trace import trace
from meshes import CreasePattern

Array = NDArray[np.float64]
MAP = "pinching_map.json"
ROUNDS = 4  # corrections of a design by simulation
CLOSE = math.radians(0.1)  # rad, where they stop


PLATE = Sheet(E=4000.0, t=0.5)  # of source 5.3.2


class DesignError(InputError):
    """A bend and twist that no pattern of the map has."""


@dataclass(frozen=True)
class Pinching:
    """How sheets are made, folded and pinched.

    Attributes:
        sheet: material and thickness.
        Lstar: of all creases, mm.
        fold: fold angle before the pinch, rad.
        left: dihedral angle that is left until closed in the pinch, rad.
        zone: length of the pinched zone, mm.
        profile: see `bh.Pinch`.
        cell: length of a cell along the first crease, mm.
        rows: of cells a panel.
        formulation: bars and hinges are far too stiff in torsion for a pinch (docs/pinching.md).
    """

    sheet: Sheet = PLATE
    Lstar: float = 2.0
    fold: float = 0.5 * math.pi
    left: float = math.pi / 18.0
    zone: float = 20.0
    profile: str = "cosine"
    cell: float = 1.0
    rows: int = 2
    formulation: str = "consistent"

    def model(self, pattern: CreasePattern) -> Model:
        """The sheet with two steps: all creases folded, all creases pinched."""
        along = 2 * max(1, round(0.5 * pattern.creases[0].curve.length / self.cell))  # a node in the middle
        mesh = meshes.structured(pattern, along=along, rows=self.rows)
        model = Model(mesh, self.sheet, formulation=self.formulation, contact=False).fold(
            "all", by=self.fold, Lstar=self.Lstar
        )
        return model.pinch("all", by=math.pi - self.left, length=self.zone, profile=self.profile)


@dataclass(frozen=True, eq=False)
class Response:
    """A sheet that was folded in its first step and pinched in its last one."""

    path: Path

    @cached_property
    def folded(self) -> State:
        """The state before the pinch."""
        return self.path[max(i for i, record in enumerate(self.path.records) if record.step == 0)]

    @cached_property
    def planes(self) -> tuple[MidPlane, MidPlane]:
        """Mid-planes before and after the pinch."""
        return midplane(self.folded), midplane(self.path[-1])

    @cached_property
    def bend(self) -> float:
        """beta_f - beta, rad: positive where the pinch bends the sheet more."""
        before, after = (plane.bending() for plane in self.planes)
        return before - after

    @cached_property
    def twist(self) -> float:
        """theta_f - theta at the right end, rad: positive where its outer (left) side goes down."""
        before, after = (float(plane.twist()) for plane in self.planes)
        return before - after


def respond(pattern: CreasePattern, how: Pinching | None = None) -> Response:
    """Fold and pinch a pattern.

    Args:
        pattern: with edges "start", "end", "inner" and "outer".
        how: it is made, folded and pinched; None for the defaults.

    Raises:
        ModelError: the sheet did not get there; the message says how far.
    """
    path = trace((how or Pinching()).model(pattern), warn=False)
    if not path.reached:
        raise ModelError(
            f"the sheet could not be folded and pinched: {path.outcome} ({path.steps[-1].reason})"
        )
    return Response(path)


# ------------------------------------------------------------------------------- the four patterns of 5.5.3


def twists(length: float = 100.0, spacing: float = 5.0, curvature: float = 0.01) -> CreasePattern:
    """Twist without bend (Fig. 5.12 a): two creases, straight in the middle half and curved towards the ends.

    Args:
        length: of the first crease, mm.
        spacing: between creases and to the edges, mm.
        curvature: kappa_0 towards the ends, 1/mm.
    """
    pieces = (0.25 * length, 0.5 * length, 0.25 * length)
    return meshes.parallel_creases((curvature, 0.0, curvature), pieces, spacing, 2)


def bends(length: float = 100.0, spacing: float = 5.0, curvature: float = 0.01) -> CreasePattern:
    """Bend without twist (Fig. 5.12 b): seven concentric arcs.

    Args:
        length: of the first crease, mm.
        spacing: between creases and to the edges, mm.
        curvature: kappa_0 of the first crease, 1/mm.
    """
    return meshes.parallel_creases(curvature, length, spacing, 7)


def stays(length: float = 100.0, spacing: float = 5.0) -> CreasePattern:
    """Neither (Fig. 5.12 c): five straight creases.

    Args:
        length: of the creases, mm.
        spacing: between creases and to the edges, mm.
    """
    return meshes.parallel_creases(0.0, length, spacing, 5)


def bends_and_twists(length: float = 100.0, spacing: float = 5.0, curvature: float = 0.01) -> CreasePattern:
    """Both (Fig. 5.12 d): one arc.

    Args:
        length: of the crease, mm.
        spacing: to the edges, mm.
        curvature: kappa_0, 1/mm.
    """
    return meshes.parallel_creases(curvature, length, spacing, 1)


PATTERNS: dict[str, Callable[..., CreasePattern]] = {
    "twist": twists,
    "bend": bends,
    "neither": stays,
    "both": bends_and_twists,
}


# ------------------------------------------------------------------------------- measured map and design


@dataclass(frozen=True, eq=False, repr=False)
class ResponseMap(OneLine):
    """Measured bend and twist of sheets with parallel creases.

    Attributes:
        creases: (n,) numbers of creases.
        spacings: (s,), mm.
        curvatures: (k,) kappa_0 of the first crease, 1/mm.
        bend: (n, s, k), rad.
        twist: (n, s, k), rad.
        length: of the first crease, mm.
    """

    creases: Array
    spacings: Array
    curvatures: Array
    bend: Array
    twist: Array
    length: float

    def at(self, creases: int, spacing: float, curvature: float) -> tuple[float, float]:
        """Bend and twist by cubic splines over the curvature, straight lines over the spacing.

        Args:
            creases: one of those of the map.
            spacing: mm.
            curvature: kappa_0 of the first crease, 1/mm.

        Returns:
            Bend and twist, rad.
        """
        from scipy.interpolate import CubicSpline

        n = int(np.flatnonzero(self.creases == creases)[0])
        found = []
        for table in (self.bend, self.twist):
            along = CubicSpline(self.curvatures, table[n], axis=1)(curvature)
            found.append(float(np.interp(spacing, self.spacings, along)))
        return found[0], found[1]


def measure(
    how: Pinching | None = None,
    creases: tuple[int, ...] = (1, 2, 3, 4, 5, 6, 7),
    spacings: tuple[float, ...] = (3.0, 5.0, 7.0),
    curvatures: tuple[float, ...] = (0.0, 0.0025, 0.005, 0.0075, 0.01, 0.0125, 0.015),
    length: float = 100.0,
) -> ResponseMap:
    """Measure a map by simulations: some hundred, a minute or two.

    Args:
        how: sheets are made, folded and pinched.
        creases: numbers of creases.
        spacings: mm.
        curvatures: kappa_0 of the first crease, 1/mm.
        length: of the first crease, mm.

    Raises:
        ModelError: a sheet did not get there.
    """
    shape = (len(creases), len(spacings), len(curvatures))
    bend, twist = np.empty(shape), np.empty(shape)
    for i, n in enumerate(creases):
        for j, w in enumerate(spacings):
            for k, kappa in enumerate(curvatures):
                found = respond(meshes.parallel_creases(kappa, length, w, n), how)
                bend[i, j, k], twist[i, j, k] = found.bend, found.twist
    return ResponseMap(np.array(creases), np.array(spacings), np.array(curvatures), bend, twist, length)


def store(measured: ResponseMap) -> str:
    """A map as JSON."""
    data = {key: np.asarray(getattr(measured, key)).tolist() for key in measured.__dataclass_fields__}
    return json.dumps(data)


@cache
def shipped() -> ResponseMap:
    """The map that comes with the package: `measure()` with its defaults."""
    data = json.loads(files("bh.applications").joinpath(MAP).read_text(encoding="utf-8"))
    length = float(data.pop("length"))
    return ResponseMap(**{key: np.asarray(values) for key, values in data.items()}, length=length)


@dataclass(frozen=True, eq=False)
class Design:
    """A pattern for a bend and a twist, with the simulation that verifies it.

    Attributes:
        creases: how many.
        curvature: kappa_0 of the first one, 1/mm.
        spacing: between them, mm.
        length: of the first one, mm.
        first: how it is drawn.
        expected: (bend, twist) that the map promised, rad.
        response: the simulation; `response.bend` and `response.twist` are what the pattern does.
        error: largest difference to what was asked for, rad.
    """

    pattern: CreasePattern
    creases: int
    curvature: float
    spacing: float
    length: float
    first: str
    expected: tuple[float, float]
    response: Response
    error: float


def design(
    bend: float, twist: float, how: Pinching | None = None, tolerance: float = math.radians(0.5)
) -> Design:
    """A pattern that bends and twists by given angles (rad) when it is pinched.

    The map proposes number, curvature and spacing; a simulation tells what they do, and what is missed is asked of the
    map in addition, up to four times. A valley first turns the twist round.

    Args:
        bend: wanted, rad.
        twist: wanted, rad.
        how: sheets are made, folded and pinched.
        tolerance: of both, rad.

    Raises:
        DesignError: no pattern of the map comes within `tolerance` (rad) of it; the message names the nearest
            one.
    """
    if not (math.isfinite(bend) and math.isfinite(twist)):
        raise DesignError(f"bend {bend} and twist {twist} must be numbers in rad")
    table = shipped()
    asked, best = np.array([bend, twist]), None
    for n, sign in _order(table, asked):
        aim = asked.copy()
        for _ in range(ROUNDS):
            curvature, spacing, expected = _nearest(table, n, sign, aim)
            if float(np.abs(np.array(expected) - aim).max()) > 2.0 * tolerance:
                break
            found = _simulate(table, n, sign, curvature, spacing, expected, asked, how)
            if best is None or found.error < best.error:
                best = found
            if best.error <= CLOSE:
                return best
            aim = aim + asked - np.array([found.response.bend, found.response.twist])
        if best is not None and best.error <= tolerance:
            return best
    if best is not None and best.error <= tolerance:
        return best
    near = min(
        (_nearest(table, n, sign, asked)[2] for n, sign in _order(table, asked)),
        key=lambda e: float(np.abs(np.array(e) - asked).max()),
    )
    raise DesignError(
        f"no pattern of the map bends by {math.degrees(bend):.3g} and twists by {math.degrees(twist):.3g} degrees; the "
        f"nearest does {math.degrees(near[0]):.3g} and {math.degrees(near[1]):.3g}"
    )


def _order(table: ResponseMap, asked: Array) -> list[tuple[int, int]]:
    """Numbers of creases and senses of the twist, nearest promise first; among equals few creases win."""
    pairs = [(int(n), sign) for n in table.creases for sign in (1, -1)]

    def missed(pair: tuple[int, int]) -> float:
        expected = _nearest(table, *pair, asked)[2]
        return round(float(np.abs(np.array(expected) - asked).max()) / CLOSE) + 0.01 * pair[0]

    return sorted(pairs, key=missed)[:4]


def _nearest(table: ResponseMap, n: int, sign: int, aim: Array) -> tuple[float, float, tuple[float, float]]:
    """Curvature and spacing whose mapped bend and twist come nearest to `aim`, and these."""
    from scipy.interpolate import CubicSpline

    i = int(np.flatnonzero(table.creases == n)[0])
    kappa = np.linspace(table.curvatures[0], table.curvatures[-1], 301)
    spacing = np.linspace(table.spacings[0], table.spacings[-1], 81)
    grids = []
    for values in (table.bend[i], sign * table.twist[i]):
        along = CubicSpline(table.curvatures, values, axis=1)(kappa)
        grids.append(np.stack([np.interp(spacing, table.spacings, column) for column in along.T], axis=1))
    distance = np.maximum(np.abs(grids[0] - aim[0]), np.abs(grids[1] - aim[1]))
    row, column = np.unravel_index(int(np.argmin(distance)), distance.shape)
    return (
        float(kappa[column]),
        float(spacing[row]),
        (float(grids[0][row, column]), float(grids[1][row, column])),
    )


def _simulate(
    table: ResponseMap,
    n: int,
    sign: int,
    curvature: float,
    spacing: float,
    expected: tuple[float, float],
    asked: Array,
    how: Pinching | None,
) -> Design:
    names = ("mountain", "valley")
    folds = [names[(i + (sign < 0)) % 2] for i in range(n)]
    pattern = meshes.parallel_creases(curvature, table.length, spacing, n, folds)  # type: ignore[arg-type]
    response = respond(pattern, how)
    error = float(np.abs(np.array([response.bend, response.twist]) - asked).max())
    return Design(pattern, n, curvature, spacing, table.length, folds[0], expected, response, error)
