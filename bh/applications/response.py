"""Force against displacement of a place on a solved sheet: peaks, stability and stiffness, without the steps before."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.actuations import Displace
from bh.model.model import Model, Place
from bh.paths.path import Path
from bh.runtime.progress import ProgressMeter, meter
from bh.solvers.automatic import Automatic
from bh.solvers.load_control import LoadControl
from bh.solvers.matrices import IndefiniteError
from bh.solvers.outcome import Critical, Outcome
from bh.solvers.system import hessian
from bh.solving.trace import trace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bh.formulations.protocols import SheetSystem
    from bh.model.refinement import Goal

Array = NDArray[np.float64]
POINTS = 20


@dataclass(frozen=True)
class ResponsePoint:
    """One state of the curve.

    Attributes:
        displacement: of the place along the direction from where the curve begins, mm.
        force: on the sheet that moves it, N, along the direction.
        stiffness: slope of the curve there, N/mm, from the tangent; nan where it is singular.
        stable: while the displacement is imposed; None where that was not looked at.
        stable_under_force: while a dead force pulls in its place: stable, and of a rising curve.
        energy: elastic energy of the sheet, N mm.
    """

    displacement: float
    force: float
    stiffness: float
    stable: bool | None
    stable_under_force: bool | None
    energy: float


@dataclass(frozen=True)
class Peak:
    """Where the force is largest or smallest between two states, by the cubic through their forces and stiffnesses.

    Attributes:
        kind: "maximum" or "minimum".
        displacement: mm.
        force: N.
        within: N, by how much the tangents of the two states, which meet at a kink, say otherwise; 0 at a bifurcation
            that was found. More points make it smaller.
    """

    kind: str
    displacement: float
    force: float
    within: float


@dataclass(frozen=True)
class Response:
    """A curve of force against displacement.

    Attributes:
        at: the place.
        direction: (3,) unit vector of displacement and force.
        points: in order along the path, the first where the curve begins.
        peaks: in that order.
        outcome: of the path; "reached" where the whole displacement was.
        reason: why it was not, or an empty string.
        critical: limit and bifurcation points that were passed, as "bifurcation point at 1.23 mm".
        path: solved, steps before the curve included.
    """

    at: str
    direction: tuple[float, float, float]
    points: tuple[ResponsePoint, ...]
    peaks: tuple[Peak, ...]
    outcome: Outcome
    reason: str
    critical: tuple[str, ...]
    path: Path

    @property
    def reached(self) -> bool:
        """Was the whole displacement?"""
        return self.outcome is Outcome.REACHED

    def as_dict(self) -> dict[str, object]:
        """Plain data for JSON: mm, N, N/mm, N mm; what is not there is None.

        Returns:
            plain data.
        """
        return {
            "at": self.at,
            "direction": list(self.direction),
            "outcome": str(self.outcome),
            "reason": self.reason,
            "points": [{key: _plain(value) for key, value in asdict(point).items()} for point in self.points],
            "peaks": [asdict(peak) for peak in self.peaks],
            "critical_points": list(self.critical),
            "formulation": self.path.model.formulation,
        }


def response(
    model: Model,
    at: str,
    direction: Sequence[float],
    to: float,
    *,
    hold: Place | Sequence[Place] = (),
    points: int = POINTS,
    accuracy: Goal | None = None,
    progress: bool | ProgressMeter = False,
) -> Response:
    """Solve a model, then move a place of it on and read the force.

    Args:
        model: with the steps that bring the sheet to where the curve begins.
        at: the place that is moved; all its nodes move alike along the direction, and are free across it.
        direction: (3,) of any length.
        to: displacement at the end of the curve from where it begins, mm; negative for the other way.
        hold: places that are clamped as they lie while the curve is followed.
        points: states at least, if the path is without turning points.
        accuracy: where the model has no mesh of its own: the mesh is then the one that is chosen for its steps.
        progress: as for `bh.trace`.

    Returns:
        the curve; its `outcome` is not "reached" where it ends early.

    Raises:
        ModelError: the steps of the model are not reached, or the place cannot be moved; one line.
    """
    if not (math.isfinite(to) and to != 0.0):
        raise ModelError(f"a response to {to:g} mm cannot be; give a displacement other than zero")
    if points < 2:
        raise ModelError(f"a response of {points} points cannot be; give 2 or more")
    way = np.asarray(direction, dtype=float)
    if way.shape != (3,) or not np.isfinite(way).all() or not way.any():
        raise ModelError(f"direction {direction} cannot be; give three numbers that are not all zero")
    x, y, z = (way / np.linalg.norm(way)).tolist()
    report = meter(progress)
    before = trace(model, accuracy=accuracy, progress=report, warn=False)
    if not before.reached:
        raise ModelError(f"the curve cannot begin: {before.early_end}")
    longer = before.model.step(Displace(at, (x, y, z), further=to), hold=hold)
    fine = Automatic(load=LoadControl(first=1.0 / points, largest=1.0 / points))
    path = trace(longer, after=before, strategy=fine, progress=report, warn=False)
    found, kinks = _points(path, len(longer.steps) - 1, to)
    critical = tuple(
        f"{point.kind} point at {point.lam * to:.5g} mm"
        for step, point in path.critical_points
        if step == len(longer.steps) - 1
    )
    peaks = _peaks(found, kinks)
    return Response(at, (x, y, z), found, peaks, path.outcome, path.reason, critical, path)


def _points(
    path: Path, step: int, to: float
) -> tuple[tuple[ResponsePoint, ...], dict[int, tuple[float, float]]]:
    """The curve; and displacement and force of the bifurcation in front of a point, by the point's number."""
    records = [(i, record) for i, record in enumerate(path.records) if record.step == step]
    if not records:  # not even the step could be begun
        return (), {}
    system = path.system(step)
    begins = [(records[0][0] - 1, system.start(), 0.0)] + [(i, record.q, record.lam) for i, record in records]
    found = []
    for index, q, lam in begins:
        state = path[index]
        stiffness = _stiffness(system, q, lam) / to**2
        stable = state.stable
        rising = None if math.isnan(stiffness) else stiffness > 0.0
        under_force = None if stable is None or rising is None else stable and rising
        force = system.power(q, lam) / to
        found.append(ResponsePoint(lam * to + 0.0, force, stiffness, stable, under_force, state.energy.total))
    kinks = {
        number: (passed.lam * to, system.power(passed.q, passed.lam) / to)
        for number, (_, record) in enumerate(records, start=1)
        for passed in record.critical
        if passed.kind is Critical.BIFURCATION
    }
    return tuple(found), kinks


def _stiffness(system: SheetSystem, q: Array, lam: float) -> float:
    """Second derivative of the energy along the path by lambda, N mm; nan where the tangent is singular."""
    tangent = hessian(system, q, lam)
    rate = system.control_rate(q, lam)
    try:
        follows = tangent.factorise_any()[0].solve(rate)
    except IndefiniteError:
        return math.nan
    return float(system.control_stiffness(q, lam) - rate @ follows)


def _peaks(points: Sequence[ResponsePoint], kinks: Mapping[int, tuple[float, float]]) -> tuple[Peak, ...]:
    """Where the stiffness changes its sign while the displacement goes on.

    That is at the bifurcation where one was passed, else the extreme of the cubic through two neighbours.
    """
    found = []
    for number, (one, two) in enumerate(pairwise(points), start=1):
        length = two.displacement - one.displacement
        if not one.stiffness * two.stiffness < 0.0 or length == 0.0:
            continue
        kind = "maximum" if one.stiffness * length > 0.0 else "minimum"
        if number in kinks:
            found.append(Peak(kind, *kinks[number], 0.0))
            continue
        # the slope of the cubic is a parabola in s from 0 to 1, with one change of sign
        rise = (two.force - one.force) / length
        a = 3.0 * (one.stiffness + two.stiffness - 2.0 * rise)
        b = 2.0 * (3.0 * rise - 2.0 * one.stiffness - two.stiffness)
        roots = np.roots([a, b, one.stiffness])
        inside = [float(s.real) for s in roots if abs(s.imag) < 1e-12 and 0.0 <= s.real <= 1.0]
        if not inside:
            continue
        s = inside[0]
        force = one.force + length * (one.stiffness * s + b * s**2 / 2.0 + a * s**3 / 3.0)
        meet = (two.force - one.force - two.stiffness * length) / (one.stiffness - two.stiffness)
        within = abs(one.force + one.stiffness * meet - force)
        found.append(Peak(kind, one.displacement + s * length, force, within))
    return tuple(found)


def _plain(value: object) -> object:
    """Plain data: what is no number becomes None."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def lines(found: Response) -> list[str]:
    """The curve as a table, its peaks and what happened on the way, for a terminal.

    Args:
        found: the curve.

    Returns:
        the lines in order.
    """
    heads = ("u / mm", "force / N", "stiffness / N/mm", "energy / N mm", "stable", "under force")
    words = {True: "yes", False: "no", None: ""}
    rows = [
        (
            *(f"{value:.5g}" for value in (p.displacement, p.force, p.stiffness, p.energy)),
            words[p.stable],
            words[p.stable_under_force],
        )
        for p in found.points
    ]
    widths = [max(len(row[k]) for row in (heads, *rows)) for k in range(len(heads))]
    table = [
        "  ".join(word.rjust(width) for word, width in zip(row, widths, strict=True))
        for row in (heads, *rows)
    ]
    peaks = [
        f"{peak.kind} of {peak.force:.5g} N{_bounds(peak)} at {peak.displacement:.5g} mm"
        for peak in found.peaks
    ]
    return [*table, *(peaks or ["no peak"]), *found.critical]


def _bounds(peak: Peak) -> str:
    """How well a peak is known, where the points leave that open to a digit that is printed."""
    known = peak.within <= 1e-6 * abs(peak.force)
    return "" if known else f" (within {peak.within:.2g} N; more points make it smaller)"


def picture(found: Response) -> Figure:
    """Force against displacement: stable states joined by full lines, others by dashes, peaks as triangles.

    Args:
        found: the curve.

    Raises:
        ModelError: it has no states.
    """
    from matplotlib.figure import Figure

    if not found.points:
        raise ModelError("the curve has no states to draw")
    figure = Figure(figsize=(6.0, 4.0), dpi=110, layout="constrained")
    axes = figure.subplots()
    for one, two in pairwise(found.points):
        whole = one.stable is not False and two.stable is not False
        axes.plot(
            [one.displacement, two.displacement],
            [one.force, two.force],
            color="#0072b2" if whole else "#d55e00",
            linestyle="-" if whole else "--",
        )
    for stable, marker, face in ((True, "o", "#0072b2"), (False, "o", "white")):
        shown = [p for p in found.points if (p.stable is not False) is stable]
        if shown:
            label = "stable" if stable else "not stable"
            x, y = [p.displacement for p in shown], [p.force for p in shown]
            axes.plot(
                x,
                y,
                marker,
                markersize=4.0,
                color="#0072b2" if stable else "#d55e00",
                markerfacecolor=face,
                label=label,
            )
    if found.peaks:
        x, y = [p.displacement for p in found.peaks], [p.force for p in found.peaks]
        axes.plot(x, y, "^", color="black", markersize=7.0, label="peak")
    axes.set_xlabel(f"displacement of {found.at}, mm")
    axes.set_ylabel("force, N")
    axes.legend(frameon=False, fontsize="small")
    return figure
