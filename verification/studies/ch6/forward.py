"""Case `forward` (source 6.2): rotations, folded and pinched segments, the data set and the interpolation in it."""

from __future__ import annotations

import json
import math
import time
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from bh.applications.inverse.segments import folded, grid
from bh.applications.inverse.simulate import SegmentTask, simulate
from bh.applications.inverse.surrogate import SHIPPED, Surrogate, shipped
from bh.applications.inverse.transforms import angles, matrix
from bh.sweep import load
from verification.framework.checks import CaseResult, Context

Array = NDArray[np.float64]
SOURCE = "source 6.2"
NAMES = ("t_x, mm", "t_y, mm", "t_z, mm", "u, degrees", "v, degrees", "w, degrees")
FIGURES = {
    "fig6_5": ("Translation of folded segments", slice(0, 3)),
    "fig6_6": ("Rotation of folded segments", slice(3, 6)),
    "fig6_8": ("Translation of pinched segments", slice(0, 3)),
    "fig6_9": ("Rotation of pinched segments", slice(3, 6)),
    "fig6_11": ("What the pinch adds to the folded segment", slice(0, 6)),
}


def run(context: Context) -> CaseResult:
    """The data set's own checks, segments simulated anew on and off its grid, whole strips, and figures."""
    result = CaseResult(
        name="forward",
        title="Forward process: where a folded and pinched crease ends",
        question="How exactly does a chain of segments tell where the whole strip ends?",
        source=SOURCE,
    )
    data = load(SHIPPED)
    _rotations(result)
    _data(result, data)
    context.tell("forward: segments off the grid")
    _interpolation(result, 8 if context.quick else 200)
    context.tell("forward: whole strips")
    _strips(result, 3 if context.quick else 30)
    _speed(result)
    _claims(result, data)
    _figures(result, context)
    result.notes.append(
        "The source prints neither the length of the pinched zone nor how the angle goes back. Here it is 40 mm with a "
        "raised cosine: with that a segment at the bound of the sector (half a turn) just does not meet itself when it "
        "is pinched, which is how the source chose that bound; with 60 mm it does, with 20 mm it stays far from it. "
        "The length was chosen after seeing results of seven lengths on five segments, because it fits three "
        "statements of the source; so agreement with these three is partly by construction, not an independent "
        "confirmation. "
        "See docs/inverse_design.md on what of this belongs to bars and hinges."
    )
    return result


def _rotations(result: CaseResult) -> None:
    r = Rotation.random(2000, random_state=1)
    off = np.abs(angles(r.as_matrix()) - r.as_euler("xyz")).max()
    result.check("Eq. 6.14 to 6.16 against scipy's Rotation", off, unit="rad", reference=0.0, tolerance=1e-11)
    uvw = np.array([[u, v, 0.0] for u in (-2.0, 0.3, 1.0) for v in (-0.5 * math.pi, 0.5 * math.pi)])
    back = np.abs(matrix(angles(matrix(uvw))) - matrix(uvw)).max()
    result.check("the same where the tangent is vertical (gimbal lock)", back, reference=0.0, tolerance=1e-14)


def _data(result: CaseResult, data: Any) -> None:
    k0, length = grid()
    values = np.column_stack((data["t"].values, data["uvw"].values))
    rows = {
        (round(k * 1e4), round(s)): v
        for k, s, v in zip(data["k0"].values, data["length"].values, values, strict=True)
    }
    wanted = [(round(k * 1e4), round(s)) for k, s in zip(k0, length, strict=True)]
    result.check(
        "segments of the grid in the data set",
        sum(key in rows for key in wanted),
        reference=2487.0,
        source="source 6.2.4: 4,131 less those beyond half a turn",
        tolerance=0.0,
    )
    mirror = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    worst = max(np.abs(rows[k, s] - mirror * rows[-k, s]).max() for k, s in wanted)
    result.check(
        "symmetry in k0", worst, unit="mm, rad", reference=0.0, source="mirror images", tolerance=1e-6
    )
    ends = np.abs(data["end_dihedral"].values - 0.5 * math.pi).max()
    result.check(
        "dihedral angle of the ends off 90 degrees",
        math.degrees(ends),
        unit="deg",
        reference=0.0,
        tolerance=1.0,
    )
    jump = 0.0
    for k, s in wanted:  # an outlier is off the cubic through its neighbours
        near = [rows.get((k, s + 4 * i)) for i in (-2, -1, 1, 2)]
        a, b, c, d = near
        if a is not None and b is not None and c is not None and d is not None:
            jump = max(jump, float(np.abs(rows[k, s] - (-a + 4.0 * b + 4.0 * c - d) / 6.0)[:3].max()))
    result.check(
        "largest distance from the cubic through four neighbours of one k0",
        jump,
        unit="mm",
        reference=0.0,
        source="no outliers",
        tolerance=0.05,
    )


def _interpolation(result: CaseResult, count: int) -> None:
    rng = np.random.default_rng(7)
    surrogate, task = shipped(), SegmentTask()
    off: list[float] = []
    turned: list[float] = []
    began = time.perf_counter()
    for _ in range(count):
        length = float(rng.uniform(100.0, 300.0))
        k0 = float(rng.uniform(-1.0, 1.0) * surrogate.domain.largest_curvature(length))
        found = task({"k0": k0, "length": length})
        t, uvw = surrogate.pinched(k0, length)
        off.append(float(np.linalg.norm(t - found["t"])))
        turned.append(
            math.degrees(
                np.linalg.norm(Rotation.from_matrix(matrix(uvw).T @ matrix(found["uvw"])).as_rotvec())
            )
        )
    seconds = (time.perf_counter() - began) / count
    check = partial(result.check, params={"segments": count})
    for name, values, unit in (("position", off, "mm"), ("orientation", turned, "deg")):
        check(
            f"interpolated {name} off the grid, 95th percentile",
            np.percentile(values, 95),
            unit=unit,
            reference=0.0,
            source="simulation of the segment",
            tolerance=0.3,
        )
        check(f"interpolated {name} off the grid, largest", max(values), unit=unit)
    check("one simulated segment", seconds, unit="s", source="source: 4,131 in a couple of hours")


def _strips(result: CaseResult, count: int) -> None:
    """Whole strips of two and three segments against the chain, where they can be cut from one sheet."""
    rng = np.random.default_rng(11)
    surrogate = shipped()
    for pinched in (False, True):
        off: list[float] = []
        while len(off) < count:
            n = int(rng.integers(2, 4))
            length = rng.uniform(100.0, 200.0, n)
            k0 = rng.uniform(-0.6, 0.6, n) * surrogate.domain.largest_curvature(length)
            on = np.full(n, pinched)
            strip = simulate(k0.tolist(), length.tolist(), on.tolist())
            off.append(float(np.linalg.norm(strip.t - surrogate.forward(k0, length, on)[0][-1])))
        result.check(
            "end of whole strips against the chain of segments, largest",
            max(off),
            unit="mm",
            reference=0.0,
            source="simulation of the strip",
            tolerance=1.0,
            params={"pinched": pinched, "strips": count},
        )
        result.check(
            "the same, median", np.median(off), unit="mm", params={"pinched": pinched, "strips": count}
        )


def _speed(result: CaseResult) -> None:
    rng = np.random.default_rng(3)
    surrogate = shipped()
    length = rng.uniform(100.0, 300.0, (100_000, 4))
    k0 = rng.uniform(-1.0, 1.0, length.shape) * surrogate.domain.largest_curvature(length)
    on = rng.random(length.shape) < 0.5
    seconds = []
    for _ in range(3):
        began = time.perf_counter()
        surrogate.forward(k0, length, on)
        seconds.append(time.perf_counter() - began)
    result.check(
        "forward process of 100,000 designs of 4 segments", min(seconds), unit="s", source="aim: 1 s"
    )


def _claims(result: CaseResult, data: Any) -> None:
    """What the source says of Fig. 6.8, 6.9, 6.11 and 6.18 in words."""
    k0, length, t = data["k0"].values, data["length"].values, data["t"].values
    inside = shipped().domain.holds(k0, length)
    short = inside & (length <= 150.0)
    result.check(
        "pinched segments up to 150 mm that go down, share",
        (t[short, 2] < 0.0).mean(),
        source="source 6.4.3: most shorter creases",
    )
    result.check(
        "some pinched segments go up",
        (t[inside, 2] > 0.0).any(),
        reference=1.0,
        source="source 6.4.3",
        tolerance=0.0,
    )
    straight = inside & (k0 == 0.0)
    twist = float(np.abs(data["uvw"].values[straight][:, 0]).max())
    result.check(
        "twist of straight pinched creases",
        twist,
        unit="rad",
        reference=0.0,
        source="source 6.4.3",
        tolerance=1e-9,
    )
    down = float(-t[straight & (length == 100.0), 2][0])
    result.check(
        "a straight pinched crease of 100 mm goes down by",
        down,
        unit="mm",
        source="source 6.4.3: not significant",
    )
    before, _ = folded(k0[inside], length[inside])
    moved = np.linalg.norm(t[inside] - before, axis=1)
    top = int(np.argmax(moved))
    result.check(
        "largest movement of the tip of one segment",
        moved[top],
        unit="mm",
        source="Fig. 6.11",
        params={"k0": float(k0[inside][top]), "length": float(length[inside][top])},
    )


def table(surrogate: Surrogate, pinched: bool | None) -> tuple[Array, Array, Array]:
    """(k0, length, (6, a, b) values) on a fine grid, nan outside the domain; the difference of both for None."""
    k0, length = np.meshgrid(np.linspace(-0.02, 0.02, 161), np.linspace(100.0, 300.0, 101), indexing="ij")
    inside = surrogate.domain.holds(k0, length)
    flat = np.concatenate(folded(k0, length), axis=-1)
    values = (
        np.concatenate(surrogate.pinched(k0, length, check=False), axis=-1) if pinched is not False else flat
    )
    values = values - flat if pinched is None else values.copy()
    values[..., 3:] = np.degrees(values[..., 3:])
    values[~inside] = np.nan
    return k0, length, np.moveaxis(values, -1, 0)


def _figures(result: CaseResult, context: Context) -> None:
    from matplotlib.figure import Figure

    context.folder.mkdir(parents=True, exist_ok=True)
    setting = json.loads(load(SHIPPED).attrs["setting"])
    for name, (title, part) in FIGURES.items():
        kind = {"fig6_5": False, "fig6_6": False, "fig6_11": None}.get(name, True)
        k0, length, values = table(shipped(), kind)
        shown = range(*part.indices(6))
        rows = len(shown) // 3
        figure = Figure(figsize=(12.0, 3.6 * rows), layout="constrained")
        for ax, i in zip(figure.subplots(rows, 3, sharex=True, sharey=True).ravel(), shown, strict=True):
            top = max(float(np.nanmax(np.abs(values[i]))), 1e-9)
            drawn = ax.contourf(k0, length, values[i], np.linspace(-top, top, 21), cmap="RdBu_r")
            figure.colorbar(drawn, ax=ax, shrink=0.9)
            ax.set(title=NAMES[i], xlabel="k0, 1/mm", ylabel="length, mm")
        figure.savefig(context.folder / f"{name}.png", dpi=100)
        zone = "" if kind is False else f" Pinched zone {setting['zone']:g} mm."
        result.pictures.append(
            {
                "file": f"{name}.png",
                "alt": title,
                "caption": f"{title} (Fig. {name[3:].replace('_', '.')}).{zone}",
            }
        )
