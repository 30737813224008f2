"""Segments and whole designs by bars and hinges: fold, pinch, and read the frames (source 6.2.4)."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from bh.applications.inverse.segments import DesignError
from bh.applications.inverse.transforms import angles, frame, relative
from bh.formulations.state import State
from bh.model.model import Model
from bh.model.pinch import Pinch
from bh.model.sheet import Sheet
from bh.model.step import Actuation
from bh.paths.path import Path
from bh.solving.trace import trace
from meshes import PatternError, SheetMesh, parallel_creases, structured

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Setting:
    """How a strip is made and pinched. The defaults are the source's (6.2.4) where it prints them.

    Attributes:
        E: MPa.
        t: thickness, mm.
        Lstar: length scale of the spring crease, mm.
        width: of either panel, mm.
        edge: of the mesh along the crease, mm: with one row of cells the aspect ratio is width / edge = 5.
        fold: rest dihedral angle phi_R, rad.
        pinch: dihedral angle phi_p in the middle of a pinched segment, rad.
        zone: length of the pinched zone, mm, over which the angle goes to phi_p and back by a raised cosine.
            The source prints none.
        kind: of the mesh (`meshes.structured`).
        rows: of cells in either panel.
        formulation: of the model.
    """

    E: float = 4000.0
    t: float = 0.1
    Lstar: float = 0.5
    width: float = 5.0
    edge: float = 1.0
    fold: float = 0.5 * math.pi
    pinch: float = math.pi / 14.0
    zone: float = 40.0
    kind: str = "staggered"
    rows: int = 1
    formulation: str = "bars-and-hinges"

    @property
    def identity(self) -> str:
        """SHA-256 of everything above."""
        return hashlib.sha256(json.dumps(asdict(self), sort_keys=True).encode()).hexdigest()


SETTING = Setting()


def model(
    k0: Sequence[float], lengths: Sequence[float], pinched: Sequence[bool], setting: Setting = SETTING
) -> Model:
    """A strip along a crease of segments, to be folded in its first step and pinched in its second.

    Args:
        k0: curvature before folding of every segment, 1/mm.
        lengths: of every segment, mm.
        pinched: f_i of every segment.
        setting: sheet, fold and pinch.

    Raises:
        DesignError: lists of different lengths, a pinched segment that is shorter than the zone of its pinch, or a
            flat strip that overlaps itself, so that it cannot be cut from one sheet.
    """
    if not len(k0) == len(lengths) == len(pinched) or not len(k0):
        raise DesignError(
            f"{len(k0)} curvatures, {len(lengths)} lengths and {len(pinched)} pinches; give one of each"
        )
    short = min((size for size, on in zip(lengths, pinched, strict=True) if on), default=math.inf)
    if short < setting.zone:
        raise DesignError(
            f"the zone of a pinch, {setting.zone:g} mm, is longer than its segment of {short:g} mm; "
            f"make the zone {short:g} mm or less, or the segment longer"
        )
    whole = float(sum(lengths))
    try:
        pattern = parallel_creases(list(k0), list(lengths), setting.width)
    except PatternError as error:
        turn = math.degrees(sum(abs(k * size) for k, size in zip(k0, lengths, strict=True)))
        raise DesignError(
            f"the flat strip meets itself, so it cannot be cut from one sheet: its crease turns by {turn:.0f} degrees "
            f"in all; make it less curved, or shorter ({error})"
        ) from error
    along = max(2, round(whole / setting.edge))
    mesh = structured(pattern, along=along, rows=setting.rows, kind=setting.kind)  # type: ignore[arg-type]
    strip = Model(mesh, Sheet(E=setting.E, t=setting.t), formulation=setting.formulation, contact=False)
    strip = strip.fold("crease", rest=setting.fold, Lstar=setting.Lstar)
    middles = np.cumsum(lengths) - 0.5 * np.asarray(lengths)
    pinches: list[Actuation] = [
        Pinch(
            "crease",
            at=float(middle / whole),
            to=_middle(setting, middle, whole / along),
            length=setting.zone,
        )
        for middle, on in zip(middles, pinched, strict=True)
        if on
    ]
    return strip.step(*pinches) if pinches else strip


def _middle(setting: Setting, at: float, edge: float) -> float:
    """Angle of the edge that a pinch at the arc length `at` closes most, rad, on a mesh with edges of some length, mm.

    `Pinch` scales its profile so that this edge has just the angle asked for. Here the profile itself is to be the same
    wherever the middle lies between nodes, so that a design does not depend on that: the edge that closes most has
    `setting.pinch` where the middle is a node, as in the data set, and up to 0.6 degrees less else.
    """
    phase = at / edge - math.floor(at / edge)
    edges = (np.array([-1.0, 0.0, 1.0]) - phase)[:, None] * edge + np.array([0.0, edge])
    width, slope = setting.zone, math.pi / setting.zone
    mean = 0.5 + (np.sin(2.0 * slope * edges[:, 1]) - np.sin(2.0 * slope * edges[:, 0])) / (
        4.0 * slope * edge
    )
    node = 0.5 + math.sin(2.0 * slope * edge) / (4.0 * slope * edge)
    assert edge < width
    return setting.fold - (setting.fold - setting.pinch) * float(mean.max()) / node


def frames(state: State) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """(point, frame) of the cross-sections at the start and the end of the crease (Eq. 6.9 to 6.13)."""
    found = [
        (state.points[c], frame(state.points[c], state.points[left], state.points[right]))
        for c, left, right in (_section(state.mesh, end) for end in (0, -1))
    ]
    return found[0], found[1]


def _section(mesh: SheetMesh, end: int) -> tuple[int, int, int]:
    """Nodes of a cross-section at an end of the strip: crease, left edge, right edge."""
    crease, left, right = (
        int(mesh.nodes(place)[end]) for place in ("crease:crease", "edge:outer", "edge:inner")
    )
    return crease, left, right


@dataclass(frozen=True, eq=False)
class Simulated:
    """A strip that was folded and pinched.

    Attributes:
        path: all states.
        t: (3,) end of the crease in the frame at its start, mm.
        r: (3, 3) frame of the end in that of the start.
        ends: (2,) dihedral angles of the first and the last edge of the crease, rad.
    """

    path: Path
    t: Array
    r: Array
    ends: Array

    def crease(self) -> Array:
        """(k, 3) nodes of the crease in the frame at its start, mm."""
        points = self.path[-1].points
        (origin, start), _ = frames(self.path[-1])
        nodes = self.path.model.mesh.nodes("crease:crease")
        moved: Array = (points[nodes] - origin) @ start
        return moved


def simulate(
    k0: Sequence[float], lengths: Sequence[float], pinched: Sequence[bool], setting: Setting = SETTING
) -> Simulated:
    """Fold and pinch a strip; see `model`.

    Args:
        k0: curvature before folding of every segment, 1/mm.
        lengths: of every segment, mm.
        pinched: f_i of every segment.
        setting: sheet, fold and pinch.

    Raises:
        DesignError: the path ended early.
    """
    path = trace(model(k0, lengths, pinched, setting), warn=False)
    if not path.reached:
        raise DesignError(f"the strip cannot be folded and pinched: {path.outcome} ({path.reason})")
    start, end = frames(path[-1])
    t, r = relative(start, end)
    return Simulated(path, t, r, path[-1].dihedral("crease")[[0, -1]])


@dataclass(frozen=True, eq=False)
class Landing:
    """Where a whole strip ends by simulation.

    Attributes:
        strip: that was simulated, on one mesh.
        end: (3,) of the crease in the frame at its start, mm; of `strip`, or in the limit of fine meshes.
        bar: error bar of `end`, mm; 0 where there is none.
        frame: (3, 3) of the end in that of the start, as `end`.
        turn: error bar of `frame`, rad.
    """

    strip: Simulated
    end: Array
    bar: float
    frame: Array
    turn: float


class SegmentValues(TypedDict):
    """What is measured of a segment.

    Attributes:
        t: (3,) end of the crease in the frame at its start, mm.
        uvw: (3,) Tait-Bryan angles of the frame there, rad.
        end_dihedral: (2,) dihedral angles of the first and the last edge of the crease, rad.
        energy: elastic, N mm.
        stable: 1 if the state is stable, else 0.
        critical_points: on the way.
        iterations: of the solver.
    """

    t: Array
    uvw: Array
    end_dihedral: Array
    energy: float
    stable: float
    critical_points: int
    iterations: int


@dataclass(frozen=True)
class SegmentTask:
    """One pinched segment: the task of the sweep that makes the data set (`bh.sweep.run`).

    Parameters of a point are `k0` (1/mm) and `length` (mm), and `pinch` (rad) where the intensity is an axis.
    """

    setting: Setting = SETTING

    @property
    def identity(self) -> str:
        """What the task is, for the identity of a sweep."""
        return f"pinched segment {self.setting.identity}"

    def __call__(self, point: Mapping[str, float | int | str | bool]) -> SegmentValues:
        """Simulate a segment and measure its end.

        Raises:
            DesignError: the path ended early.
        """
        from dataclasses import replace

        k0, length = float(point["k0"]), float(point["length"])
        setting = replace(self.setting, pinch=float(point["pinch"])) if "pinch" in point else self.setting
        found = simulate([k0], [length], [True], setting)
        uvw = angles(found.r)
        # w goes on beyond half a turn: it stays within half a turn of that of the segment that is not pinched
        flat = k0 * length / math.sin(0.5 * setting.fold)
        uvw[2] = flat + math.remainder(uvw[2] - flat, 2.0 * math.pi)
        return {
            "t": found.t,
            "uvw": uvw,
            "end_dihedral": found.ends,
            "energy": found.path[-1].energy.total,
            "stable": float(found.path.stable is True),
            "critical_points": len(found.path.critical_points),
            "iterations": found.path.iterations,
        }
