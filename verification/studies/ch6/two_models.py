"""Case `two_models` (source 6.2 to 6.4): what Fig. 6.5 to 6.18 show by the source's model and by the converging one.

Both are asked the same: where folded and pinched segments end, how far pinches move tips, what one crease reaches by
pinching here or there, how many minima the distance from a point has, and which of the source's targets need a pinch.
Every claim of the source is a question to both, with 1 for yes. `problem_a` and `problem_b` have Fig. 6.15 and 6.17.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation

from bh.applications.inverse.forward import Forward
from bh.applications.inverse.graded import intensities
from bh.applications.inverse.models import model
from bh.applications.inverse.self_intersection import Swept
from bh.applications.inverse.simulate import Setting, Simulated, simulate
from verification.framework.checks import CaseResult, Context
from verification.studies.ch6.two_models_maps import Maps, segments
from verification.studies.ch6.two_models_pictures import Shown, draw
from verification.studies.ch6.two_models_targets import CONVERGING, JUDGE, SOURCE, answer, off_plane, targets

Array = NDArray[np.float64]
SEGMENTS = ((-0.01, 200.0), (0.0, 280.0), (0.015, 120.0))  # k0, 1/mm, and length, mm (Fig. 6.8 b)
ONE = 1.0  # mm, and degrees: what a design, and a chain against a whole strip, may be off (6.3.3)
CREASES = {n: (0.008, -0.004, 0.008, -0.004)[:n] for n in (2, 3, 4)}  # 1/mm; Fig. 6.12 prints none
SIZE = 120.0  # mm, of their segments
POINTS = ((80.0, 60.0, -5.0), (60.0, 100.0, -5.0), (-40.0, 80.0, 5.0))  # mm; Fig. 6.13 prints none
PARTS = (0.25, 0.5, 0.75, 1.0)  # of the way of a pinch
PLANE = 0.006  # of the length: how far a folded crease leaves its plane (6.2.3, after Badger et al.)
ALIKE = 0.02  # of the largest movement
FAR = 2  # cells of a grid of 81 x 51 that a minimum is the least among
DIFFERENT = 1.0  # mm


def run(context: Context) -> CaseResult:
    """All questions to both models, and their pictures."""
    result = CaseResult(
        name="two_models",
        title="Chapter 6 by the source's model and by the one that converges",
        question="Which shapes, reaches and claims of Chapter 6 stand when the model of the strip converges?",
        source="source 6.2 to 6.4",
    )
    models: dict[str, Forward] = {SOURCE: model("source"), CONVERGING: model()}
    maps = {name: segments(each) for name, each in models.items()}
    _folded(result, maps)
    _pinched(result, maps)
    _tips(result, maps)
    context.tell("two_models: three segments by both and by the shell")
    strips = _strips(result, models)
    limits = [models[CONVERGING].forward([k0], [length], [True])[0][-1] for k0, length in SEGMENTS]
    ends = _combinations(result, models)
    minima = _minima(result, models)
    _pinching(result, models)
    context.tell("two_models: targets")
    aimed = targets(result, models, context.quick)
    context.folder.mkdir(parents=True, exist_ok=True)
    result.pictures += draw(
        context.folder, Shown(maps, strips, limits, SEGMENTS, ends, POINTS, minima, aimed)
    )
    result.notes += NOTES
    return result


def _each(result: CaseResult, what: str, values: dict[str, float], unit: str, place: str) -> None:
    """A figure by both models; the source prints none."""
    for name, value in values.items():
        result.check(what, value, unit=unit, source=f"source {place}", params={"formulation": name})


def turned(first: Array, second: Array) -> Array:
    """(k,) angles between frames (k, 3, 3), degrees."""
    both = np.swapaxes(first, -1, -2) @ second
    found: Array = np.degrees(np.linalg.norm(Rotation.from_matrix(both).as_rotvec(), axis=-1))
    return found


def _folded(result: CaseResult, maps: dict[str, Maps]) -> None:
    """Fig. 6.5 and 6.6: closed form against segments that bend and bow."""
    ours, theirs = maps[CONVERGING], maps[SOURCE]
    at = ours.inside
    apart = np.linalg.norm(ours.folded - theirs.folded, axis=-1)[at]
    turn = turned(ours.folded_frames[at], theirs.folded_frames[at])
    params = {"formulation": CONVERGING}
    for what, values, unit in (("ends", apart, "mm"), ("frames", turn, "deg")):
        result.check(
            f"folded segments, {what} off the closed form, median",
            np.median(values),
            unit=unit,
            params=params,
        )
        result.check(
            f"folded segments, {what} off the closed form, largest", values.max(), unit=unit, params=params
        )
    high = np.abs(ours.folded[at][:, 2]) / ours.length[at]
    result.check("folded segments, z of the end over the length, largest", high.max(), params=params)


def _pinched(result: CaseResult, maps: dict[str, Maps]) -> None:
    """Fig. 6.8 and 6.9, and what the source says of them."""
    ours, theirs = maps[CONVERGING], maps[SOURCE]
    at = ours.inside
    apart = np.linalg.norm(ours.pinched - theirs.pinched, axis=-1)[at]
    turn = turned(ours.pinched_frames[at], theirs.pinched_frames[at])
    for what, values, unit in (("ends", apart, "mm"), ("frames", turn, "deg")):
        for name, value in (("median", np.median(values)), ("largest", values.max())):
            says = f"pinched segments, {what} of both models apart, {name}"
            result.check(says, value, unit=unit, source="source Fig. 6.8, 6.9")
    z = {name: m.pinched[..., 2] for name, m in maps.items()}
    _each(
        result, "lowest end of a pinched segment", {n: np.nanmin(v) for n, v in z.items()}, "mm", "Fig. 6.8"
    )
    _each(
        result, "highest end of a pinched segment", {n: np.nanmax(v) for n, v in z.items()}, "mm", "Fig. 6.8"
    )
    short = at & (ours.length <= 150.0)
    down = {name: float((v[short] < 0.0).mean()) for name, v in z.items()}
    _each(result, "segments up to 150 mm that a pinch sends down, share", down, "", "6.4.3")
    answer(result, "pinches send most shorter creases down", "6.4.3", {n: v > 0.5 for n, v in down.items()})
    back = {n: bool(((v > 1.0) & (maps[n].pinched[..., 0] < 0.0)).any()) for n, v in z.items()}
    answer(result, "a pinched segment reaches more than 1 mm up where x < 0", "6.4.3", back)
    low = {
        n: bool(((v < -5.0) & (maps[n].pinched[..., 0] > 0.0)).any() and np.nanmax(v) < 5.0)
        for n, v in z.items()
    }
    answer(
        result,
        "single pinched segments reach z = -5 mm where x > 0, and nowhere z = 5 mm",
        "6.4.3, Fig. 6.18",
        low,
    )
    straight = at & (np.abs(ours.k0) < 1e-9)
    twist = {n: float(np.abs(_about_x(m.pinched_frames[straight])).max()) for n, m in maps.items()}
    _each(result, "twist of straight pinched segments", twist, "deg", "6.4.3")
    slope = {n: float((-v[straight] / ours.length[straight]).max()) for n, v in z.items()}
    _each(
        result, "straight pinched segments go down by, over their length", slope, "", "6.4.3: not significant"
    )
    deep = {n: np.unravel_index(np.nanargmin(v), v.shape) for n, v in z.items()}
    half = {n: bool(_sector(maps[n])[i] < 0.95 * math.pi) for n, i in deep.items()}
    answer(result, "the deepest end is of a segment that turns less than half a turn", "6.4.2", half)


def _about_x(frames: Array) -> Array:
    """(k,) rotations about x of frames (k, 3, 3) (Eq. 6.15), degrees."""
    return np.degrees(np.arctan2(frames[:, 2, 1], frames[:, 2, 2]))


def _sector(maps: Maps) -> Array:
    return np.abs(maps.k0) * maps.length / math.sin(0.25 * math.pi)


def _tips(result: CaseResult, maps: dict[str, Maps]) -> None:
    """Fig. 6.11: how far the pinch of one segment moves its end."""
    tops = {name: float(np.nanmax(m.moved)) for name, m in maps.items()}
    _each(result, "largest movement of the tip of one segment", tops, "mm", "Fig. 6.11, 6.17")
    moderate: dict[str, bool] = {}
    span: dict[str, float] = {}
    for name, m in maps.items():
        i = np.unravel_index(np.nanargmax(m.moved), m.moved.shape)
        where = {"formulation": name, "k0": round(float(abs(m.k0[i])), 5), "length": float(m.length[i])}
        turn = float(_sector(m)[i] / math.pi)
        result.check("sector of the segment whose tip moves furthest, over half a turn", turn, params=where)
        near = np.nan_to_num(m.moved) >= (1.0 - ALIKE) * tops[name]
        middling = (np.abs(m.k0) > 0.005) & (np.abs(m.k0) < 0.015) & (m.length > 150.0) & (m.length < 290.0)
        moderate[name] = bool((near & middling).any())
        span[name] = float(np.ptp(m.length[near]))
    _each(result, "lengths of segments whose tips move as far within 2 %, range", span, "mm", "Fig. 6.11")
    answer(
        result,
        "the tip of a moderately curved, long but not longest segment moves as far as any, within 2 %",
        "6.4.2",
        moderate,
    )
    answer(
        result,
        "segments that move furthest lie along a contour",
        "6.3.2, Fig. 6.11",
        {n: s >= 20.0 for n, s in span.items()},
    )


def _strips(result: CaseResult, models: dict[str, Forward]) -> dict[str, list[Simulated]]:
    """Fig. 6.8 (b): three segments simulated by both, and by the shell, which neither was made with."""
    finest = replace(Setting(), edge=JUDGE[0], rows=JUDGE[1])
    settings = {SOURCE: Setting(), CONVERGING: replace(finest, formulation="consistent")}
    settings["shell"] = replace(finest, formulation="shell")
    strips = {
        name: [simulate([k], [s], [True], each) for k, s in SEGMENTS] for name, each in settings.items()
    }
    for i, (k0, length) in enumerate(SEGMENTS):
        shell = strips["shell"][i]
        for name, forward in models.items():
            points, frames = forward.forward([k0], [length], [True])
            where = {"k0": k0, "length": length, "formulation": name}
            own = strips[SOURCE][i] if name == SOURCE else shell
            whom = "simulation of the segment" if name == SOURCE else "the shell"
            off, turn = float(np.linalg.norm(points[-1] - own.t)), float(turned(frames[-1:], own.r[None])[0])
            for what, value, unit in (("end", off, "mm"), ("frame", turn, "deg")):
                result.check(
                    f"{what} of a segment of Fig. 6.8 off what it is to repeat",
                    value,
                    unit=unit,
                    reference=0.0,
                    source=whom,
                    tolerance=ONE,
                    params=where,
                )
            if name == SOURCE:
                missed = float(np.linalg.norm(points[-1] - shell.t))
                result.check("end of a segment of Fig. 6.8 off the shell", missed, unit="mm", params=where)
    dihedral = {
        name: max(float(np.abs(np.degrees(s.ends) - 90.0).max()) for s in strips[name]) for name in models
    }
    _each(result, "dihedral angle at the ends of these segments off 90 degrees", dihedral, "deg", "6.2.4")
    flat = [simulate([k], [s], [False], settings[CONVERGING]) for k, s in SEGMENTS]
    off = max(off_plane(strip.crease()) / s for strip, (_, s) in zip(flat, SEGMENTS, strict=True))
    params = {"formulation": CONVERGING}
    result.check(
        "folded creases off their own plane, over the length", off, source="source 6.2.3", params=params
    )
    says = "folded creases stay within 0.6 % of their length of a plane"
    result.check(says, off <= PLANE, reference=1.0, source="source 6.2.3", params=params)
    return strips


def _combinations(result: CaseResult, models: dict[str, Forward]) -> dict[int, dict[str, Array]]:
    """Fig. 6.12: ends of creases whose segments are pinched or not in all ways."""
    found: dict[int, dict[str, Array]] = {}
    for n, k0 in CREASES.items():
        on = np.array(list(product((False, True), repeat=n)))
        size = np.full(n, SIZE)
        found[n] = {name: each.forward(k0, size, on)[0][..., -1, :] for name, each in models.items()}
        for name, ends in found[n].items():
            params = {"formulation": name, "n": n, "k0": list(k0)}
            wide = max(float(np.linalg.norm(ends - end, axis=1).max()) for end in ends)
            for what, value in (("farthest apart", wide), ("range of z", float(np.ptp(ends[:, 2])))):
                says = f"ends of one crease pinched in all ways, {what}"
                result.check(says, value, unit="mm", source="source Fig. 6.12", params=params)
        apart = np.linalg.norm(found[n][SOURCE] - found[n][CONVERGING], axis=1)
        says = "ends of one crease pinched in all ways, both models apart, largest"
        result.check(says, apart.max(), unit="mm", source="source Fig. 6.12", params={"n": n})
    apart_all = {
        name: all(_least_apart(ends[name]) > DIFFERENT for ends in found.values()) for name in models
    }
    answer(result, "every way to pinch one crease has an end of its own", "6.3.2, Fig. 6.12", apart_all)
    for pinches in product((False, True), repeat=2):
        two = CREASES[2], [SIZE, SIZE], pinches
        landing = models[CONVERGING].land(*two)
        end = models[CONVERGING].forward(*two)[0][-1]
        result.check(
            "chain of two segments of Fig. 6.12 off its whole strip",
            np.linalg.norm(landing.end - end),
            unit="mm",
            reference=0.0,
            source="simulation of the strip",
            tolerance=ONE,
            params={"formulation": CONVERGING, "pinched": list(pinches)},
        )
    return found


def _least_apart(points: Array) -> float:
    """Least distance between two of points (k, 3), mm."""
    return float(pdist(points).min())


def _minima(result: CaseResult, models: dict[str, Forward]) -> dict[str, list[Array]]:
    """Fig. 6.13: minima of the distance of one pinched segment's end from a point, (m, 2) curvature and length.

    On a grid of lengths and curvatures over the largest of that length, so that the sides of the domain are those of
    the grid.
    """
    share, length = np.meshgrid(np.linspace(-1.0, 1.0, 81), np.linspace(100.0, 300.0, 51), indexing="ij")
    found: dict[str, list[Array]] = {name: [] for name in models}
    for name, each in models.items():
        k0 = share * each.domain.largest_curvature(length)
        ends = each.forward(
            k0[..., None], length[..., None], np.ones((*k0.shape, 1), dtype=bool), check=False
        )[0]
        for point in POINTS:
            far = np.linalg.norm(ends[..., -1, :] - np.array(point), axis=-1)
            least = far == minimum_filter(far, 2 * FAR + 1, mode="nearest")
            found[name].append(np.column_stack((k0[least], length[least])))
            params = {"formulation": name, "target": list(point)}
            says = "minima of the distance of a segment's end from a point"
            result.check(says, least.sum(), source="source Fig. 6.13", params=params)
            result.check(
                "least of these distances", far.min(), unit="mm", source="source Fig. 6.13", params=params
            )
    several = {name: sum(len(each) > 1 for each in minima) >= 2 for name, minima in found.items()}
    answer(result, "many points have several minima of the distance", "6.3.2, Fig. 6.13", several)
    return found


def _pinching(result: CaseResult, models: dict[str, Forward]) -> None:
    """What the source says of pinches themselves: half a turn is safe, and more of a pinch does more."""
    lengths = np.linspace(100.0, 300.0, 9)
    swept = Swept()
    safe: dict[str, bool] = {}
    for name, each in models.items():
        bound = np.asarray(each.domain.largest_curvature(lengths))
        met = [
            swept.meets(each, np.array([k]), np.array([s]), np.array([True]))
            for k, s in zip(bound, lengths, strict=True)
        ]
        safe[name] = not any(met)
    answer(result, "pinched segments up to half a turn do not meet themselves", "6.2.4", safe)
    grows: dict[str, bool] = {SOURCE: True, CONVERGING: True}
    for k0, length in SEGMENTS:
        folded = {name: each.unpinched([k0], [length])[0][-1] for name, each in models.items()}
        way = {
            SOURCE: [intensities().forward([k0], [length], [a])[0][-1] for a in PARTS],
            CONVERGING: [
                models[CONVERGING].closed_by(a).forward([k0], [length], [True])[0][-1] for a in PARTS
            ],
        }
        for name, ends in way.items():
            moves = np.linalg.norm(np.array(ends) - folded[name], axis=1)
            steps = np.diff(np.concatenate(([0.0], moves)))
            grows[name] &= bool((steps > 0.0).all())
    answer(result, "the tip moves further the more a segment is pinched", "6.4.3", grows)


NOTES = [
    "The source prints figures without numbers, so nearly all of its claims are words. Each is put as a question to "
    "both models here, 1 for yes. The source's model is one row of bars and hinges with the zone of the pinch that "
    "docs/inverse_design.md gives reasons for; the converging one is the limit of fine meshes of the consistent "
    "formulation. Where they differ the shell, which neither was made with, is with the latter.",
    "Ends are told in the frame of the cross-section at the start, as in Eq. 6.9 to 6.13. By the closed form a folded "
    "crease lies in a plane of that frame. A sheet has free ends that bow, by up to 1.4 degrees about the crease, and "
    "turns a little where the curvature jumps: so creases of several segments reach points off the plane without any "
    "pinch, and most targets that the source pinches for do not need one. A pinch makes the crease shorter.",
    "Designs are chains of pieces here (`Reach(verify=False)`), for 90 of the 330 targets of Fig. 6.18 with y >= 0. "
    "Whole strips for all of them are in `problem_c` (source's model) and `landing` (converging).",
    "The patterns of Fig. 6.12 and the points of Fig. 6.13 are not printed; those here are ours.",
]
