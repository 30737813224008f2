"""Case `designs`: designs and segments, one by one: figures of docs/inverse_design.md that no other case has.

Six targets by the model that converges and by the source's, each judged by the shell; points that come with a
direction; designs that move less; single pinched segments by three models; and the data set of pieces itself.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bh.applications.inverse.converged import Converged
from bh.applications.inverse.judge import judge
from bh.applications.inverse.models import SHIPPED, model
from bh.applications.inverse.piece_data import PieceData
from bh.applications.inverse.problems import Design
from bh.applications.inverse.reach import Reach
from bh.applications.inverse.segments import DesignError
from bh.applications.inverse.simulate import SETTING, simulate
from bh.applications.inverse.tolerances import predicted, region
from bh.applications.inverse.wants import Wants
from bh.solvers.outcome import Outcome
from bh.sweep import load
from verification.framework.checks import CaseResult, Context
from verification.studies.ch6.landing import SHELL, WITHIN, off

Array = NDArray[np.float64]
Target = tuple[float, float, float]
SIX: tuple[Target, ...] = (
    (-80.0, 100.0, -5.0),
    (-60.0, 120.0, -4.0),
    (50.0, 150.0, 0.0),
    (0.0, 120.0, -8.0),
    (100.0, 60.0, -3.0),
    (-30.0, 80.0, -6.0),
)
COARSE, FINE = (2.5, 2), (1.25, 4)  # of the shell: mm along the crease, rows a panel
DIRECTED: tuple[tuple[Target, Target, Target | None], ...] = (  # point, mm, tangent, and up
    ((50.0, 150.0, 0.0), (0.0, 1.0, 0.0), None),
    ((100.0, 100.0, 0.0), (-1.0, 0.0, 0.0), None),
    ((0.0, 200.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    ((80.0, 150.0, -5.0), (0.0, 1.0, 0.0), (0.1, 0.0, 1.0)),
)
REFUSED: tuple[Target, Target] = ((-80.0, 100.0, -5.0), (-1.0, 0.0, 0.1))
STEADY = 4  # of the six targets
PINCHED = ((0.0, 100.0), (0.003, 300.0), (0.01, 100.0), (0.01, 200.0))  # k0, 1/mm, and length, mm
ROWS = (1, 2, 4)  # of the consistent formulation
JUDGED = (0.0104, 0.02)  # 1/mm, of pinched segments
LENGTH = 100.0  # mm, of them
STRIP = Design(np.array([0.006, -0.007]), np.array([130.0, 120.0]), np.array([True, True]))
TWO_PINCHES = (0.0, 120.0, -8.0)  # the target whose design is simulated on a finer mesh
BEYOND = 5.0  # mm, over which what a pinch does is seen to die out
DYING, DYING_LENGTH = (0.0, 0.005, 0.015), 160.0  # 1/mm, and mm, of strips that this is seen in
DEGREE = 1.0  # the tolerance of directions
NEAREST = re.compile(r"the nearest ends ([\d.]+) mm away, ([\d.]+) degrees off")


def converged() -> Converged:
    """The model that converges."""
    found = model()
    assert isinstance(found, Converged)
    return found


def run(context: Context) -> CaseResult:
    """The designs, then segments and pieces."""
    result = CaseResult(
        name="designs",
        title="Designs and segments, one by one",
        question="Where do the designs and segments end that docs/inverse_design.md names?",
        source="measured",
    )
    found = {}
    for target in SIX[-1:] if context.quick else SIX:
        context.tell(f"designs: target {target}")
        found[target] = _aimed(result, target)
    context.tell("designs: directions")
    for each in DIRECTED[:1] if context.quick else DIRECTED:
        _directed(result, *each)
    _pieces(result)
    _pinch_angle(result)
    if context.quick:
        return result
    _refused(result)
    for target in SIX[:STEADY]:
        context.tell(f"designs: a robust design for {target}")
        _robust(result, target, found[target])
    context.tell("designs: segments")
    _one_mesh(result, found[TWO_PINCHES])
    _segments(result)
    _by_rows(result)
    _dies_out(result)
    return result


def _aimed(result: CaseResult, target: Target) -> Design:
    """A target by both models, its strips by the shell; returns the design by the model that converges."""
    at = np.array(target)
    found = Reach()(target)
    design = found.design
    params = {"target": list(target), "formulation": "consistent"}
    check = partial(result.check, unit="mm", params=params)
    result.check("segments of the design", design.n, params=params)
    result.check("pinches of the design", int(design.pinched.sum()), params=params)
    check("length of the design", design.total)
    check("whole strip off its target", found.missed_simulated, reference=0.0, tolerance=WITHIN)
    check("error bar of that distance", found.bar)
    verdict = judge(*design.lists(), converged().setting, (COARSE, FINE))
    for strip, (_, rows) in zip(verdict.strips, (COARSE, FINE), strict=True):
        result.check(
            "strip by the shell off its target",
            np.linalg.norm(strip.t - at),
            unit="mm",
            reference=0.0,
            source=SHELL,
            tolerance=WITHIN if rows == FINE[1] else None,
            params={**params, "rows": rows},
            path=strip.path,
        )
    theirs = Reach(model="source")(target)
    setting = replace(converged().setting, edge=COARSE[0], rows=COARSE[1], formulation="shell")
    result.check(
        "strip by the shell off its target",
        np.linalg.norm(simulate(*theirs.design.lists(), setting).t - at),
        unit="mm",
        reference=0.0,
        source=SHELL,
        params={"target": list(target), "formulation": "bars-and-hinges", "rows": COARSE[1]},
    )
    result.check(
        "whole strip off its target",
        theirs.missed_simulated,
        unit="mm",
        reference=0.0,
        tolerance=WITHIN,
        params={"target": list(target), "formulation": "bars-and-hinges"},
    )
    return design


def _directed(result: CaseResult, point: Target, tangent: Target, up: Target | None) -> None:
    """A point and the direction, or the whole frame, in which the crease ends there."""
    found = Reach()(Wants.of(point, tangent, up))
    params = {"target": list(point), "tangent": list(tangent)}
    check = partial(result.check, params={**params, "formulation": "consistent"})
    check("directed: segments of the design", found.design.n)
    check(
        "directed: whole strip off its target",
        found.missed_simulated,
        unit="mm",
        reference=0.0,
        tolerance=WITHIN,
    )
    check("directed: error bar of that distance", found.bar, unit="mm")
    check(
        "directed: end of the whole strip off its direction",
        math.degrees(found.turned_simulated),
        unit="deg",
        reference=0.0,
        tolerance=DEGREE,
    )
    check("directed: error bar of that angle", math.degrees(found.turn_bar), unit="deg")


def _refused(result: CaseResult) -> None:
    """The target that no crease of four segments meets with its direction, and the nearest that was found."""
    point, tangent = REFUSED
    params: dict[str, Any] = {"target": list(point), "tangent": list(tangent), "formulation": "consistent"}
    said = ""
    try:
        Reach()(Wants.of(point, tangent))
    except DesignError as error:
        said = str(error)
    result.check("directed: refused", bool(said), reference=1.0, tolerance=0.0, params=params)
    nearest = NEAREST.search(said)
    if nearest is not None:
        result.notes.append(f"Refused: {said}.")
        for what, value, unit in (("distance", nearest[1], "mm"), ("angle", nearest[2], "deg")):
            says = f"directed: nearest design of a refused target, {what}"
            result.check(says, float(value), unit=unit, params=params)


def _robust(result: CaseResult, target: Target, short: Design) -> None:
    """How far ends move that are made with the default spreads, of the short design and of the robust one."""
    robust = Reach(prefer="robust")(target)
    for prefer, design in (("short", short), ("robust", robust.design)):
        params = {"target": list(target), "prefer": prefer}
        moves = predicted(converged(), design.k0, design.length, design.pinched).size
        result.check("root mean square movement of the end", moves, unit="mm", params=params)
        result.check("segments of the short or robust design", design.n, params=params)
        result.check("length of the short or robust design", design.total, unit="mm", params=params)
    params = {"target": list(target), "prefer": "robust"}
    result.check(
        "robust design: whole strip off its target, error bar included",
        robust.missed_at_most,
        unit="mm",
        reference=0.0,
        tolerance=WITHIN,
        params=params,
    )
    axes = region(converged(), robust.design).axes
    for name, axis in zip(("longest", "middle", "shortest"), axes, strict=True):
        result.check(f"robust design: {name} semi-axis of the ellipsoid", axis, unit="mm", params=params)


def _pinch_angle(result: CaseResult) -> None:
    """What 0.02 rad of the pinch move a strip of two pinches by, on each mesh of the variants and in the limit."""
    exact = converged()
    for rows, each in ((2, exact.on_mesh(0)), (4, exact.on_mesh(1)), (8, exact.on_mesh(2)), (0, exact)):
        moved = predicted(each, STRIP.k0, STRIP.length, STRIP.pinched).moves["pinch"]
        params = {"rows": rows if rows else "limit"}
        result.check(
            "movement of an end by 0.02 rad of the pinch", np.linalg.norm(moved), unit="mm", params=params
        )


def _one_mesh(result: CaseResult, design: Design) -> None:
    """How far from its limit a strip of two pinches is with 8 rows."""
    lists = design.lists()
    limit = converged().land(*lists)
    strip = simulate(*lists, replace(converged().setting, edge=0.625, rows=8))
    result.check(
        "strip of two pinches with 8 rows off its limit",
        np.linalg.norm(strip.t - limit.end),
        unit="mm",
        params={"pinches": int(design.pinched.sum()), "rows": 8},
        path=strip.path,
    )
    result.check("error bar of that limit", limit.bar, unit="mm")


def _segments(result: CaseResult) -> None:
    """Single pinched segments against the refined shell."""
    for k0 in JUDGED:
        apart, turned, bar, turn_bar = off(k0, LENGTH, True)
        params = {"k0": k0, "length": LENGTH, "formulation": "consistent"}
        for what, value, unit, its_bar in (("end", apart, "mm", bar), ("frame", turned, "deg", turn_bar)):
            result.check(
                f"{what} of a pinched segment off the shell",
                value,
                unit=unit,
                reference=0.0,
                source=SHELL,
                tolerance=2.0 * its_bar,
                params=params,
            )
            result.check(f"error bar of the {what} of a pinched segment", its_bar, unit=unit, params=params)


def _by_rows(result: CaseResult) -> None:
    """Where pinched segments end by one row of bars and hinges, and by the consistent formulation on finer meshes."""
    for k0, length in PINCHED:
        for formulation, rows in (("bars-and-hinges", 1), *(("consistent", rows) for rows in ROWS)):
            edge = SETTING.edge if formulation == "bars-and-hinges" else SETTING.width / rows
            strip = simulate(
                [k0], [length], [True], replace(SETTING, formulation=formulation, rows=rows, edge=edge)
            )
            params = {"k0": k0, "length": length, "formulation": formulation, "rows": rows}
            check = partial(result.check, params=params, path=strip.path)
            check("z of the end of a pinched segment", strip.t[2], unit="mm")
            turn = math.degrees(math.atan2(strip.r[1, 0], strip.r[0, 0]))
            # they turn to the left, by up to three quarters of a turn
            check(
                "turn in the plane of the end of a pinched segment", (turn + 90.0) % 360.0 - 90.0, unit="deg"
            )


def _dies_out(result: CaseResult) -> None:
    """What a pinch does to the turning of the crease 5 mm beyond its zone, over the same 10 mm beyond it."""
    setting = replace(converged().setting, edge=0.625, rows=8)
    for k0 in DYING:
        with_pinch, without = (
            _turning(simulate([k0], [DYING_LENGTH], [on], setting).crease()) for on in (True, False)
        )
        apart = np.abs(with_pinch - without)
        near, far = (
            apart[(len(apart) - 1) // 2 + round((0.5 * setting.zone + beyond) / setting.edge)]
            for beyond in (BEYOND, 2.0 * BEYOND)
        )
        result.check(
            "what a pinch does to the turning of the crease, 5 mm beyond its zone over 10 mm beyond it",
            near / far,
            params={"k0": k0, "rows": 8},
        )


def _turning(points: Array) -> Array:
    """(k - 2,) angles between neighbouring edges of a crease (k, 3), rad."""
    edges = np.diff(points, axis=0)
    edges /= np.linalg.norm(edges, axis=1)[:, None]
    return np.asarray(2.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(np.diff(edges, axis=0), axis=1), 0, 1)))


def _pieces(result: CaseResult) -> None:
    """The shipped data set: what it has, what it took, and how its levels of meshes converge."""
    data = load(SHIPPED)
    good = (data["outcome"].values == Outcome.REACHED) & (data["stable"].values == 1.0)
    good &= data["critical_points"].values == 0
    count = len(good)
    result.check("pieces that were simulated", count)
    result.check(
        "pieces that are stable, without critical points", good.sum(), reference=float(count), tolerance=0.0
    )
    for kind in ("arc", "pinch", "joint"):
        mine = data["kind"].values == kind
        result.check("points of pieces, simulated", mine.sum(), params={"kind": kind})
        seconds = float(data["wall_time_s"].values[mine].sum())
        result.check("time of the points of pieces", seconds, unit="s", params={"kind": kind})
    limits = PieceData(data).limits
    x = np.linspace(-1.0, 1.0, 401)
    pinch, end = limits["pinch"], limits["end"].value(x)
    values = [level(x) for level in pinch.levels]
    steps = [float(np.linalg.norm(b - a, axis=1).max()) for a, b in pairwise(values)]
    for i, (before, after) in enumerate(pairwise(steps)):
        result.check(
            "difference of two levels of the pinch over that of the next two",
            before / after,
            params={"coarser": i},
        )
    missed = float(np.degrees(pinch.between[3:]).max())
    result.check("part of the error bar of a pinch for what polynomials miss", missed, unit="deg")
    bow = float(np.degrees(np.abs(end[:, 3])).max())
    result.check("rotation of a free end about the crease, largest", bow, unit="deg")
