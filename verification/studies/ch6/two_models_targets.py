"""Fig. 6.14 and 6.18 by both models of `two_models`: targets, their designs, and which of them need a pinch."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from bh.applications.inverse.forward import Forward
from bh.applications.inverse.models import Name
from bh.applications.inverse.problems import Design
from bh.applications.inverse.reach import Reach, library
from bh.applications.inverse.segments import DesignError
from bh.applications.inverse.self_intersection import Swept
from bh.applications.inverse.simulate import simulate
from bh.applications.inverse.wants import ReachAll, Wants
from verification.framework.checks import CaseResult

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Target = tuple[float, float, float]
SOURCE, CONVERGING = "bars-and-hinges", "consistent"  # what records call the two
NAMES: dict[str, Name] = {SOURCE: "source", CONVERGING: "converged"}
LEVELS = (-10.0, -5.0, 0.0, 5.0, 10.0)  # mm, z of the targets
NEAR = 8  # designs without a pinch that are polished for a target
MOST = 4  # segments
WITHIN = 1.0  # mm
SIMULATED = 3  # of the strips without a pinch
JUDGE = (1.25, 4)  # of the shell: mm along the crease, rows a panel
SAID = "source 6.4.3, Fig. 6.18"


@dataclass(frozen=True, eq=False)
class Aimed:
    """A target and its designs by the formulation of either model.

    Attributes:
        target: (3,), mm.
        design: the one that `Reach` finds by the chain; None where there is none.
        bare: the one of fewest segments without any pinch; None where no crease of up to four segments is.
        lands: where the design by the source's model ends by the one that converges, mm away from the target.
    """

    target: Target
    design: dict[str, Design | None]
    bare: dict[str, Design | None]
    lands: float

    @property
    def off_plane(self) -> bool:
        """Whether z is not 0."""
        return self.target[2] != 0.0

    def pinched(self, name: str) -> bool:
        """Whether the design is pinched somewhere; that of the formulation named."""
        design = self.design[name]
        return design is not None and bool(design.pinched.any())


def answer(result: CaseResult, says: str, place: str, answers: Mapping[str, bool]) -> None:
    """A claim of the source as a question to models: 1 for yes."""
    for name, yes in answers.items():
        params = {"formulation": name}
        result.check(says, yes, reference=1.0, source=f"source {place}", params=params)


def targets(result: CaseResult, models: Mapping[str, Forward], quick: bool) -> list[Aimed]:
    """Records of some of the source's targets with y >= 0, and their designs."""
    sides = (-60.0, 60.0) if quick else (-100.0, -60.0, -20.0, 20.0, 60.0, 100.0)
    across = (60.0,) if quick else (0.0, 60.0, 100.0)
    aimed = [_aim(models, (x, y, z)) for z in LEVELS for x in sides for y in across]
    _misses(result, aimed)
    for name in models:
        _counts(result, aimed, name)
    off, flat = _split(aimed)
    says = "no target off the plane is reached without a pinch"
    answer(result, says, "6.4.3", {n: all(each.bare[n] is None for each in off) for n in models})
    says = "targets in the plane are reached without a pinch"
    answer(result, says, "6.4.3", {n: all(each.bare[n] is not None for each in flat) for n in models})
    says = "creases to targets off the plane on the x axis are longer than to others, in the median"
    answer(result, says, "6.4.3", {n: _longest_on_axis(off, n) for n in models})
    _without(result, models[CONVERGING], off)
    return aimed


def _split(aimed: Sequence[Aimed]) -> tuple[list[Aimed], list[Aimed]]:
    return [a for a in aimed if a.off_plane], [a for a in aimed if not a.off_plane]


def _misses(result: CaseResult, aimed: Sequence[Aimed]) -> None:
    """What designs by the source's model miss by where the model converges."""
    lost = np.array([a.lands for a in aimed if a.pinched(SOURCE)])
    says = "pinched designs by the source's model, miss by the one that converges"
    for what, value in (("least", lost.min()), ("median", np.median(lost)), ("largest", lost.max())):
        result.check(f"{says}, {what}", value, unit="mm", source=SAID, params={"designs": len(lost)})
    bare = np.array([a.lands for a in aimed if not a.pinched(SOURCE)])
    if len(bare):
        says = "designs without a pinch by the source's model, miss by the one that converges, largest"
        result.check(says, bare.max(), unit="mm", source=SAID, params={"designs": len(bare)})


def _counts(result: CaseResult, aimed: Sequence[Aimed], name: str) -> None:
    """How many targets have a design, need a pinch, and are reached by one segment."""
    params: dict[str, Any] = {"targets": len(aimed), "formulation": name}
    off, flat = _split(aimed)
    have = sum(a.design[name] is not None for a in aimed)
    says = "targets that have a design by the chain of the model itself"
    result.check(says, have, reference=float(len(aimed)), source=SAID, tolerance=0.0, params=params)
    pinched = np.mean([a.pinched(name) for a in off])
    result.check("targets off the plane whose design is pinched, share", pinched, source=SAID, params=params)
    says = "targets off the plane for which no crease without a pinch was found, share"
    result.check(says, np.mean([a.bare[name] is None for a in off]), source=SAID, params=params)
    plain = np.mean([not a.pinched(name) for a in flat])
    result.check("targets in the plane whose design has no pinch, share", plain, source=SAID, params=params)
    for z in LEVELS:
        here = [a.design[name] for a in aimed if a.target[2] == z]
        one = sum(design is not None and design.n == 1 for design in here)
        result.check("targets that one segment reaches", one, source=SAID, params={**params, "z": z})


def _longest_on_axis(aimed: Sequence[Aimed], name: str) -> bool:
    """Whether creases to the x axis are longer than those beside it."""
    totals = [(a.target[1] == 0.0, a.design[name]) for a in aimed]
    on, beside = ([d.total for at, d in totals if d is not None and at == axis] for axis in (True, False))
    return bool(on) and bool(beside) and float(np.median(on)) > float(np.median(beside))


def _without(result: CaseResult, forward: Forward, off: Sequence[Aimed]) -> None:
    """Creases without a pinch to targets off the plane: do they leave their own plane, do whole strips end there?"""
    found = [(a, a.bare[CONVERGING]) for a in off]
    there = [(a, design) for a, design in found if design is not None]
    if not there:
        return
    params = {"formulation": CONVERGING, "designs": len(there)}
    creases = [Swept().crease(forward, d.k0, d.length, d.pinched)[0] for _, d in there]
    says = "creases without a pinch to targets off the plane, off their own plane, largest"
    result.check(says, max(off_plane(c) for c in creases), unit="mm", params=params)
    shortest, design = min(there, key=lambda pair: pair[1].total)
    judge = replace(forward.setting, edge=JUDGE[0], rows=JUDGE[1], formulation="shell")
    result.check(
        "strip without a pinch by the shell, off its target off the plane",
        np.linalg.norm(simulate(*design.lists(), judge).t - np.array(shortest.target)),
        unit="mm",
        reference=0.0,
        source="the shell",
        tolerance=WITHIN,
        params={"formulation": "shell", "target": list(shortest.target), "total": round(design.total)},
    )
    for each, design in there[:: max(1, len(there) // SIMULATED)][:SIMULATED]:
        landing = forward.land(*design.lists())
        result.check(
            "whole strip without a pinch off its target off the plane, error bar included",
            float(np.linalg.norm(landing.end - np.array(each.target))) + landing.bar,
            unit="mm",
            reference=0.0,
            source="simulation of the strip",
            tolerance=WITHIN,
            params={"formulation": CONVERGING, "target": list(each.target), "segments": design.n},
        )


def off_plane(points: Array) -> float:
    """Largest distance of points (k, 3) from the plane next to all of them, mm."""
    middle = points - points.mean(axis=0)
    normal = np.linalg.svd(middle, full_matrices=False)[2][-1]
    return float(np.abs(middle @ normal).max())


def _aim(models: Mapping[str, Forward], target: Target) -> Aimed:
    """Designs for a target by both models."""
    design: dict[str, Design | None] = {}
    for name in models:
        try:
            design[name] = Reach(model=NAMES[name], verify=False)(target).design
        except DesignError:
            design[name] = None
    source, lands = design[SOURCE], math.nan
    if source is not None:
        end = models[CONVERGING].forward(source.k0, source.length, source.pinched, check=False)[0][-1]
        lands = float(np.linalg.norm(end - np.array(target)))
    return Aimed(target, design, {name: without(name, target) for name in models}, lands)


@cache
def _unpinched(n: int, name: Name) -> tuple[Array, cKDTree, float]:
    """Random designs of n segments that are not pinched.

    Returns:
        variables (N, 2 n), the tree of their ends, and how far the farthest end is off the plane, mm.
    """
    book = library(n, 1, name)
    x = book.designs[0]
    k0, length = book.problem(np.zeros(3)).split(x)
    ends = book.surrogate.unpinched(k0, length)[0][..., -1, :]
    return x, cKDTree(ends), float(np.abs(ends[:, 2]).max())


def without(name: str, target: Target) -> Design | None:
    """The design of fewest segments, and the shortest of those, that ends at a target without any pinch.

    Args:
        name: of the formulation.
        target: (3,), mm.
    """
    point = np.array(target)
    for n in range(1, MOST + 1):
        x, tree, high = _unpinched(n, NAMES[name])
        if abs(target[2]) > high + WITHIN:
            continue
        near = x[np.atleast_1d(tree.query(point, k=NEAR)[1])]
        off: Bools = np.zeros((NEAR, n), dtype=bool)
        book = library(n, 1, NAMES[name])
        problem = ReachAll(book.surrogate, n, book.rules, point, Wants.of(point), np.zeros(1))
        found = problem.polished(near, off)
        missed = np.linalg.norm(problem.bare(found, off), axis=1)
        good = np.flatnonzero((missed <= WITHIN) & (problem.violation(found, off) <= 0.0))
        if len(good):
            best = good[np.argmin(problem.split(found[good])[1].sum(axis=1))]
            return problem.design(found[best], off[best])
    return None
