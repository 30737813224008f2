"""Three-point bending of a folded corrugation between rigid bars, and its stiffness (source 4.5)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from bh.applications.corrugation.folded import moved_to
from bh.errors import ModelError
from bh.formulations.observables import crease_nodes, depth_of
from bh.model.actuations import Displace, Indenter, Tether
from bh.paths.path import Path
from bh.runtime.one_line import OneLine
from bh.solvers.load_control import LoadControl
from bh.solvers.outcome import Outcome
from bh.solving.trace import trace

if TYPE_CHECKING:
    from bh.applications.corrugation.folded import Folded

Array = NDArray[np.float64]
ROUND = 0.5  # mm, radius of the edges of bar and supports
SUPPORT = 200.0  # mm, width of a support: the sheet never hangs over its far edge
TRIGGER = 0.1  # N, from which displacement counts (4.5.1)
WINDOW = (0.2, 0.7)  # of the first peak of the load: the second stage
DROP = 0.15  # of the load, behind a peak
REACH = 0.75  # of the depth: further down mountains flatten
CRADLE = 1e-3  # N/mm on the whole sheet along every axis: keeps it in place where nothing touches it


@dataclass(frozen=True)
class Rig:
    """The test stand of the source: two flat supports, a flat bar, polyester on tape.

    Attributes:
        span: between the inner edges of the supports, mm.
        bar: its width, mm.
        travel: of the bar, mm.
        tape: 0 is a sheet that lies free, without friction. Else valley creases over the supports are first
            pulled down onto them and stay there, held along x and y by this stiffness, N/mm in all
            (double-sided tape, 4.5.1).
        pulled: tape holds valleys down; else it holds them sideways only, and the sheet may lift off.
        gap: of the contact, mm (`bh.model.actuations.Indenter`).
        stiffness: of the contact (`bh.model.actuations.Indenter`).
        level: the bar stays level; else it lies on two mountains where the test begins, and keeps that slope.
        grip: mountain creases under the bar are held along x and y where the bar meets them, by this stiffness, N/mm in
            all: a bar that they stick to. 0 is a bar without friction; what friction does lies in between.
        largest: displacement between two states, mm.
        offset: of the sheet's middle from the bar, along the span, mm.
    """

    span: float = 50.0
    bar: float = 10.0
    travel: float = 10.0
    tape: float = 0.0
    gap: float = 0.05
    stiffness: float = 50.0
    level: bool = False
    largest: float = 0.5
    offset: float = 0.0
    grip: float = 0.0
    pulled: bool = True

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name in ("span", "bar", "travel", "gap", "stiffness", "largest"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ModelError(f"{name} = {value} of a bending test cannot be; give a positive number")
        if self.bar >= self.span:
            raise ModelError(f"a bar of {self.bar:g} mm does not fit between supports {self.span:g} mm apart")
        if not (math.isfinite(self.tape) and self.tape >= 0.0):
            raise ModelError(f"tape = {self.tape} cannot be; give a stiffness in N/mm, or 0")
        if not (math.isfinite(self.grip) and self.grip >= 0.0):
            raise ModelError(f"grip = {self.grip} cannot be; give a stiffness in N/mm, or 0")


@dataclass(frozen=True, eq=False, repr=False)
class BendingTest(OneLine):
    """A load-displacement curve.

    Attributes:
        azimuth: of the bar from the x axis, rad.
        displacement: (k,) of the bar from the trigger load on, mm.
        load: (k,) on it, N.
        stiffness: slope of the regression over the second stage, N/mm.
        r2: its coefficient of determination.
        window: displacements where that begins and ends, mm.
        peak: first peak of the load, N.
        outcome: `Outcome.REACHED` if the bar went all the way; else why not, and the curve ends there.
    """

    azimuth: float
    displacement: Array
    load: Array
    stiffness: float
    r2: float
    window: tuple[float, float]
    peak: float
    outcome: str
    reason: str
    path: Path = field(repr=False)

    @property
    def converged(self) -> bool:
        """All states converged, to the end or at least beyond the stage that the stiffness is of."""
        return self.outcome == Outcome.REACHED or bool(self.displacement[-1] > self.window[1])


def three_point(folded: Folded, azimuth: float, rig: Rig | None = None) -> BendingTest:
    """Press a bar on the middle of a corrugation that lies on two supports, without friction.

    The sheet is laid on the supports as a load in the middle would hold it, touching them at three points; supports and
    bar are smooth barriers on all edges of the mesh. The bar's axis has the given azimuth: 0 is bending about x.

    Args:
        folded: the corrugation.
        azimuth: of the bar from the x axis, rad.
        rig: supports and bar; None for those of the source.

    Returns:
        The curve; its outcome says if it goes all the way.

    Raises:
        ModelError: the corrugation does not reach the supports, falls off them, or cannot be taped down.
    """
    rig = rig or Rig()
    along = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    across = np.array([-along[1], along[0], 0.0])
    points = settle(folded, along, across, rig.span, rig.offset)
    half = 0.5 * rig.span + 0.5 * SUPPORT
    depth = 5.0 + rig.gap

    def bar(name: str, s: float, z: float, width: float, fall: float = 0.0, tilt: float = 0.0) -> Indenter:
        return Indenter(
            name, place(s, z), azimuth, width, 10.0, ROUND, (0.0, 0.0, -fall), tilt, rig.stiffness, rig.gap
        )

    def place(s: float, z: float) -> tuple[float, float, float]:
        x, y, z = (s * across + [0.0, 0.0, z]).tolist()
        return x, y, z

    items: list[Indenter | Tether] = [
        bar("left", -half, -depth, SUPPORT),
        bar("right", half, -depth, SUPPORT),
        Tether("all", (CRADLE, CRADLE, CRADLE)),
    ]
    start = moved_to(folded.path, points)
    if rig.tape > 0.0:
        valleys = crease_nodes(folded.mesh, "valley")
        taped = valleys[np.abs(points[valleys] @ across) >= 0.5 * rig.span].tolist()
        if not taped:
            raise ModelError("no valley crease lies over the supports, where tape could hold it")
        items.append(Tether(taped, (rig.tape, rig.tape, 0.0)))
    if rig.tape > 0.0 and rig.pulled:
        # flat sheets lie in z = 0, as the supports do
        down = start.model.step(*items, Displace(taped, "z", 0.0))
        pulled = LoadControl(work_mismatch=math.inf)
        start = trace(down, after=start, strategy=pulled, warn=False, neighbours=False)
        if not start.reached:
            raise ModelError(f"the corrugation cannot be taped down ({start.outcome}: {start.reason})")
        points = start[-1].points
    slope, height = lid(folded, points, along, across, 0.5 * rig.bar)
    if rig.level:
        slope, height = 0.0, float(_under(folded, points, across, 0.5 * rig.bar)[:, 2].max())
    if rig.grip > 0.0:
        mountains = crease_nodes(folded.mesh, "mountain")
        held = mountains[np.abs(points[mountains] @ across) <= 0.5 * rig.bar].tolist()
        if held:
            items.append(Tether(held, (rig.grip, rig.grip, 0.0)))
    items.append(bar("bar", 0.0, height + depth, rig.bar, rig.travel, math.atan(slope)))
    # as on a test stand: where the sheet snaps it goes to the next stable state, and the bar goes on
    first, largest = min(0.1, 0.2 * rig.largest) / rig.travel, rig.largest / rig.travel
    snapping = LoadControl(first=first, largest=largest, work_mismatch=math.inf, smallest=1e-4, locate=False)
    # other stable states beside the last one are of no use: the curve is of those that a test stand passes
    path = trace(start.model.step(*items), after=start, strategy=snapping, warn=False, neighbours=False)
    return _evaluate(path, azimuth, rig)


def _evaluate(path: Path, azimuth: float, rig: Rig) -> BendingTest:
    step = len(path.model.steps) - 1
    states = [i for i, record in enumerate(path.records) if record.step == step]
    moved_by = np.array([0.0, *(rig.travel * path.records[i].lam for i in states)])
    load = np.array([0.0, *(-float(path[i].contact_forces["bar"][2]) for i in states)])
    touched = int(np.argmax(load >= TRIGGER)) if (load >= TRIGGER).any() else len(load) - 1
    if touched > 0:  # where the load passes the trigger
        part = (TRIGGER - load[touched - 1]) / max(load[touched] - load[touched - 1], 1e-300)
        zero = moved_by[touched - 1] + min(part, 1.0) * (moved_by[touched] - moved_by[touched - 1])
    else:
        zero = 0.0
    x, y = moved_by[touched:] - zero, load[touched:]
    if len(x) == 0 or x[0] > 0.0:
        x, y = np.concatenate(([0.0], x)), np.concatenate(([min(TRIGGER, load.max())], y))
    slope, r2, window, peak = second_stage(x, y, REACH * depth_of(path[0 if step == 0 else states[0] - 1])[0])
    return BendingTest(azimuth, x, y, slope, r2, window, peak, path.outcome, path.reason, path)


def second_stage(
    x: Array, y: Array, reach: float = math.inf
) -> tuple[float, float, tuple[float, float], float]:
    """Slope (N/mm) and R^2 of a line through the second stage of a curve, its ends (mm) and the first peak (N).

    The stage goes from 20 to 70 % of the first peak of the load, behind which the load drops by 15 %, or of the largest
    load before the displacement `reach` (mm) if there is none (peaks below half of that do not count): the bar has
    found its mountains and no crease has flattened yet. The line is fitted to 101 points evenly spaced along the curve,
    as a test stand samples it.

    Args:
        x: (k,) displacements, mm.
        y: (k,) loads, N.
        reach: displacement up to which the largest load is looked for, mm.
    """
    if x[-1] > reach:
        x, y = np.append(x[x < reach], reach), np.append(y[x < reach], np.interp(reach, x, y))
    highest = np.maximum.accumulate(y)
    # a smaller peak is the sheet that settles on its supports
    fallen = np.flatnonzero((y < (1.0 - DROP) * highest) & (highest >= 0.5 * y.max()))
    top = int(np.argmax(y[: fallen[0] + 1] if len(fallen) else y))
    peak = float(y[top])
    if top < 2 or peak <= 0.0:
        return math.nan, math.nan, (math.nan, math.nan), peak
    rising = np.maximum.accumulate(y[: top + 1])
    ends = [float(np.interp(part * peak, rising, x[: top + 1])) for part in WINDOW]
    if not ends[1] > ends[0]:
        return math.nan, math.nan, (ends[0], ends[1]), peak
    at = np.linspace(ends[0], ends[1], 101)
    load = np.interp(at, x[: top + 1], y[: top + 1])
    slope, offset = np.polyfit(at, load, 1)
    left = float(np.sum((load - slope * at - offset) ** 2))
    spread = float(np.sum((load - load.mean()) ** 2))
    return float(slope), 1.0 - left / max(spread, 1e-300), (ends[0], ends[1]), peak


def settle(folded: Folded, along: Array, across: Array, span: float, offset: float = 0.0) -> Array:
    """(n, 3) nodes of the rigid sheet as it lies on two supports (z = 0) under a load over the origin.

    Of all positions in which nothing over the supports is below them that of the lowest origin: a linear program for
    the two slopes and the height, repeated after each finite turn.

    Args:
        folded: the corrugation.
        along: (3,) unit vector along the bar.
        across: (3,) unit vector along the span.
        span: between the supports, mm.
        offset: of the sheet's middle from the bar, along the span, mm.

    Raises:
        ModelError: the sheet does not reach the supports, or falls off them.
    """
    points = folded.points - 0.5 * (folded.points.max(axis=0) + folded.points.min(axis=0)) * [1.0, 1.0, 0.0]
    edges = folded.mesh.topology.edges
    for _ in range(12):
        a, b = _about(points, along, across)
        points = points - a * along - (b - offset) * across
        over = _over(points, edges, across, 0.5 * span)
        if len(over) == 0 or not ((over @ across).min() < 0.0 < (over @ across).max()):
            raise ModelError(f"the corrugation does not reach both supports {span:g} mm apart")
        rows = -np.column_stack((over @ along, over @ across, np.ones(len(over))))
        found = linprog([0.0, 0.0, 1.0], rows, over[:, 2], bounds=[(-0.5, 0.5)] * 2 + [(None, None)])
        if not found.success or np.abs(found.x[:2]).max() > 0.499:
            raise ModelError(
                "the corrugation falls off its supports; its middle is not between what lies on them"
            )
        slope = found.x[0] * along + found.x[1] * across
        up = np.array([-slope[0], -slope[1], 1.0]) / math.sqrt(1.0 + float(slope @ slope))
        points = points @ _turn(up).T
        points[:, 2] -= _over(points, edges, across, 0.5 * span)[:, 2].min()
        if np.linalg.norm(slope) < 1e-9:
            break
    return np.asarray(points)


def _about(points: Array, along: Array, across: Array) -> tuple[float, float]:
    """Middle of the extent in both directions, mm."""
    a, b = points @ along, points @ across
    return 0.5 * float(a.min() + a.max()), 0.5 * float(b.min() + b.max())


def _over(points: Array, edges: NDArray[np.int64], across: Array, half: float) -> Array:
    """(k, 3) nodes over the supports, and where edges pass above the supports' inner edges."""
    s = points @ across
    found = [points[np.abs(s) >= half]]
    for end in (-half, half):
        p, q = points[edges[:, 0]], points[edges[:, 1]]
        sp, sq = s[edges[:, 0]] - end, s[edges[:, 1]] - end
        cut = sp * sq < 0.0
        part = (sp[cut] / (sp[cut] - sq[cut]))[:, None]
        found.append((1.0 - part) * p[cut] + part * q[cut])
    return np.vstack(found)


def _turn(up: Array) -> Array:
    """The least rotation (3, 3) that raises a level sheet to a plane with the normal `up` (3,), z upwards."""
    axis = np.cross(up, [0.0, 0.0, 1.0])
    sine, cosine = float(np.linalg.norm(axis)), float(up[2])
    if sine < 1e-300:
        return np.eye(3)
    k = axis / sine
    K = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
    return np.asarray(np.eye(3) - sine * K + (1.0 - cosine) * K @ K)


def lid(folded: Folded, points: Array, along: Array, across: Array, half: float) -> tuple[float, float]:
    """Slope of the bar's axis and its height over the origin, as it lies on the sheet, free to turn.

    Args:
        folded: the corrugation.
        points: (n, 3) nodes as they lie, mm.
        along: (3,) unit vector along the bar.
        across: (3,) unit vector along the span.
        half: half the width of the bar, mm.

    Returns:
        the slope and the height, mm.
    """
    under = _under(folded, points, across, half)
    w = under @ along
    if not w.min() < 0.0 < w.max():
        return 0.0, float(under[:, 2].max())
    rows = -np.column_stack((w, np.ones(len(w))))
    found = linprog([0.0, 1.0], rows, -under[:, 2], bounds=[(-1.0, 1.0), (None, None)])
    return float(found.x[0]), float(found.x[1])


def _under(folded: Folded, points: Array, across: Array, half: float) -> Array:
    """(k, 3) nodes under the bar, and where edges pass below its edges or its middle."""
    edges = folded.mesh.topology.edges
    s = points @ across
    cut = [points[np.abs(s) <= half]]
    for end in (-half, 0.0, half):
        p, q = points[edges[:, 0]], points[edges[:, 1]]
        sp, sq = s[edges[:, 0]] - end, s[edges[:, 1]] - end
        here = sp * sq < 0.0
        part = (sp[here] / (sp[here] - sq[here]))[:, None]
        cut.append((1.0 - part) * p[here] + part * q[here])
    found = np.vstack(cut)
    if len(found) == 0:
        raise ModelError("the bar does not lie on the corrugation; its middle is not under it")
    return found


def all_directions(folded: Folded, rig: Rig | None = None) -> dict[str, BendingTest]:
    """The three tests of the source: bending about x, xy and y.

    Args:
        folded: the corrugation.
        rig: supports and bar; None for those of the source.

    Returns:
        The tests by direction.

    Raises:
        ModelError: see `three_point`.
    """
    return {name: three_point(folded, azimuth, rig) for name, azimuth in DIRECTIONS.items()}


DIRECTIONS: dict[str, float] = {"x": 0.0, "xy": 0.25 * math.pi, "y": 0.5 * math.pi}
