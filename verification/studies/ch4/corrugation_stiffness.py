"""Case `corrugation_stiffness` (source 4.5): bending stiffness of the five corrugations with error bars, and the shell.

Both formulations fold the sheet 6 mm deep on several meshes each and bear the same smooth loads (`spread_bending`). A
stiffness is the limit of its meshes with a bar; the two agree if they differ by no more than both bars added.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from bh.analysis.richardson import UNCLEAN, Limit, judged
from bh.solvers.outcome import Outcome
from meshes.errors import MeshError
from verification.framework.checks import CaseResult, Context, Cost, line, plot
from verification.studies.ch4.corrugations import ORDER, RATIOS, in_order
from verification.studies.ch4.spread_bending import Stiff, stiff

CASE = "corrugation_stiffness"
SOURCE = "source 4.5.2, Fig. 4.8 and 4.9"
SHELL = "shell (fem), limit of its own meshes"
ALL = ((24, 2), (36, 3), (48, 4), (72, 6))  # columns and rows
JUDGE = ALL[:3]  # of the shell, whose nodes are four times as many
FORMULATIONS = {"consistent": ALL, "shell": JUDGE}
BOTH_BARS = 1.0  # of both error bars added: how far the two may differ


@dataclass(frozen=True)
class Found:
    """A stiffness about x and y with its bar, N/mm, and the finest mesh that could be folded (None: none or one)."""

    about: dict[str, Limit]
    finest: Stiff | None


def run(context: Context) -> CaseResult:
    """Five patterns about x and y by both formulations; one pattern in quick mode."""
    result = CaseResult(
        CASE,
        "Bending stiffness of the five corrugations, with error bars",
        "How stiff are the corrugations about x and about y, does the shell say the same, and are the ratios those "
        "that were measured?",
        SOURCE,
    )
    kinds = ("elliptical-edge",) if context.quick else ORDER
    found: dict[tuple[str, str], Found] = {}
    for kind in kinds:
        for formulation, levels in FORMULATIONS.items():
            context.tell(f"{CASE}: {kind}, {formulation}")
            found[kind, formulation] = _found(result, kind, formulation, levels[: 3 if context.quick else 4])
        _agreement(result, kind, found[kind, "consistent"], found[kind, "shell"])
    _ratios(result, kinds, found)
    result.notes += NOTES
    return result


def _found(result: CaseResult, kind: str, formulation: str, levels: tuple[tuple[int, int], ...]) -> Found:
    """Values of all meshes, which are reported one by one, and their limits."""
    good: list[tuple[int, Stiff]] = []
    for along, rows in levels:
        params: dict[str, str | int] = {
            "kind": kind,
            "formulation": formulation,
            "along": along,
            "rows": rows,
        }
        try:
            one = stiff(kind, formulation, along, rows)
        except MeshError:  # curved edges of slivers in its corners cross
            result.check("the mesh is fine enough for curved edges", 0.0, params=params)
            continue
        result.check("folded 6 mm deep and stable", one.reached, params=params)
        if not one.reached:
            continue
        good.append((along, one))
        for name, value in one.about.items():
            where = {**params, "about": name}
            result.check("stiffness on one mesh", value, unit="N/mm", params=where, path=Cost.of(one.path))
    about = {name: _limit([(along, one.about[name]) for along, one in good]) for name in ("x", "y")}
    return Found(about, good[-1][1] if len(good) > 1 else None)


def _limit(values: list[tuple[int, float]]) -> Limit:
    """Of three meshes or more; of two the last value and what first order would leave, of fewer nothing is known."""
    if len(values) > 2:
        return judged([value for _, value in values], [1.0 / along for along, _ in values]).limit
    if len(values) == 2:
        (_, first), (_, last) = values
        return Limit(last, math.nan, UNCLEAN * abs(last - first))
    return Limit(values[0][1] if values else math.nan, math.nan, math.inf)


def _agreement(result: CaseResult, kind: str, ours: Found, shell: Found) -> None:
    for name in ("x", "y"):
        mine, theirs = ours.about[name], shell.about[name]
        for formulation, found, limit in (("consistent", ours, mine), ("shell", shell, theirs)):
            params = {"kind": kind, "about": name, "formulation": formulation}
            took = _cost(found)
            reference = theirs.value if found is ours and shell.finest else None
            result.check(
                "stiffness",
                limit.value,
                unit="N/mm",
                reference=reference,
                source=SHELL,
                params=params,
                path=took,
            )
            result.check("error bar of the stiffness", limit.bar, unit="N/mm", params=params, path=took)
        result.check(
            "difference between both, over both error bars added",
            abs(mine.value - theirs.value) / (mine.bar + theirs.bar),
            reference=0.0,
            source=SHELL,
            tolerance=BOTH_BARS,
            params={"kind": kind, "about": name, "formulation": "consistent"},
            path=_cost(shell if shell.finest is None else ours),
        )


def _cost(found: Found) -> Cost:
    """Of the finest mesh; what fewer than two meshes could do did not reach its target: it has no bar."""
    return Cost(outcome=Outcome.TARGET_MISSED) if found.finest is None else Cost.of(found.finest.path)


def _ratios(result: CaseResult, kinds: tuple[str, ...], found: dict[tuple[str, str], Found]) -> None:
    ratios: dict[str, dict[str, float]] = {formulation: {} for formulation in FORMULATIONS}
    for (kind, formulation), one in found.items():
        x, y = one.about["x"], one.about["y"]
        ratio = x.value / y.value
        ratios[formulation][kind] = ratio
        params = {"kind": kind, "formulation": formulation}
        took = _cost(one)
        result.check("k_x / k_y under spread loads", ratio, reference=RATIOS[kind], params=params, path=took)
        bar = ratio * (x.bar / x.value + y.bar / y.value)
        result.check("error bar of k_x / k_y", bar, params=params, path=took)
    ours = ratios["consistent"]
    if len(kinds) < len(ORDER):
        return
    params = {"formulation": "consistent"}
    lowest = all(ours["straight"] < ours[kind] for kind in ORDER[1:])
    result.check("straight is the least isotropic under spread loads", lowest, reference=1.0, params=params)
    order = float(in_order(ours))
    result.check(
        "pairs of ten in the order of the measured ratios, spread loads", order, reference=10.0, params=params
    )
    places = [float(k) for k in range(len(ORDER))]
    named = {"consistent": ours, "shell": ratios["shell"], "measured": RATIOS}
    lines = [
        line(
            label, places, [values[kind] for kind in ORDER], "reference" if label == "measured" else "points"
        )
        for label, values in named.items()
    ]
    result.plots.append(
        plot(
            "ratios",
            "k_x / k_y",
            ", ".join(f"{k}: {kind}" for k, kind in enumerate(ORDER)),
            "k_x / k_y",
            lines,
            "Ratios of bending stiffness under spread loads beside the measured ones (4.5.2).",
        )
    )


NOTES = [
    "A free sheet is folded by one rest angle of all creases (L* = 25 mm) until it is 6 mm deep. Its tangent there is "
    "asked for the stiffness against a load across the middle that two supports 50 mm apart carry, each spread over a "
    "strip 20 mm wide and fading as cos^2 (10 mm in the mean). Supports keep the mean height and tilt of their strip, "
    "the load may tilt. Nothing is rigid and no load sits on a point, so that both formulations can bear it and meshes "
    "converge; it is not the test of the source, whose bar and supports touch mountains and valleys only.",
    "Limits and bars of three meshes or more are those of `bh.analysis.richardson.judged`; of two the finer value, and "
    "three times the change. Where the shell could be folded on one mesh only, its figure has no bar and nothing is "
    "said to agree.",
    "The creases of the elliptical-point pattern touch in its corners. Curves closer than 0.04 of a cell are one "
    "there, with straight edges, for the shell as well.",
]
