"""Pictures of `two_models`: the source's figures by its own model beside those by the one that converges."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from bh.applications.inverse.simulate import Simulated
from bh.applications.inverse.transforms import angles
from verification.studies.ch6.two_models_maps import Maps
from verification.studies.ch6.two_models_targets import CONVERGING, LEVELS, SOURCE, Aimed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
TITLES = {SOURCE: "source's model", CONVERGING: "model that converges", "shell": "shell"}
STYLES = {SOURCE: "C1-", CONVERGING: "C0-", "shell": "k:"}
VALUES = ("t_x, mm", "t_y, mm", "t_z, mm", "u, degrees", "v, degrees", "w, degrees")
DPI = 90


@dataclass(frozen=True, eq=False)
class Shown:
    """What is drawn.

    Attributes:
        maps: single segments, by formulation.
        strips: examples of them by formulation.
        limits: (3,) ends of them in the limit of fine meshes, mm.
        named: of the examples: curvature before folding, 1/mm, and length, mm.
        ends: of one crease pinched in all ways, by its segments and by formulation, (2^n, 3), mm.
        points: that single segments are to reach, mm.
        minima: (m, 2) curvature and length where the distance is least, by formulation, for each point.
        aimed: targets.
    """

    maps: Mapping[str, Maps]
    strips: Mapping[str, Sequence[Simulated]]
    limits: Sequence[Array]
    named: Sequence[tuple[float, float]]
    ends: Mapping[int, Mapping[str, Array]]
    points: Sequence[tuple[float, float, float]]
    minima: Mapping[str, Sequence[Array]]
    aimed: Sequence[Aimed]


CAPTIONS = {
    "shapes": "Fig. 6.8 (b), 6.9 (b): three pinched segments from above and from the side. The converging "
    "formulation and the shell have 4 rows a panel here; crosses are the limit of fine meshes, which designs use.",
    "pinched": "Fig. 6.8 (a), 6.9 (a): ends and angles of pinched segments by both models, and what changes.",
    "folded": "Fig. 6.5 (a), 6.6 (a): the same of folded segments. The source has a closed form; a sheet folds a "
    "little less than that, and its free ends bow.",
    "tips": "Fig. 6.11: what the pinch of one segment moves its end by, in x, y, z and in all.",
    "combinations": "Fig. 6.12: ends of one crease of two, three and four segments, pinched in all ways, from above "
    "and from the side.",
    "objective": "Fig. 6.13: distance of the end of one pinched segment from three points, and its minima (crosses). "
    "The source prints no points; these are ours.",
    "targets": "Fig. 6.18: above, what designs by the source's model miss by where the model converges; below, the "
    "fewest segments that reach a target without a pinch there (0: it needs one).",
}


def draw(folder: Path, shown: Shown) -> list[dict[str, str]]:
    """Write all pictures into a folder; what the report needs to know of each."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = {
        "shapes": _shapes(shown),
        "pinched": _surfaces(shown, pinched=True),
        "folded": _surfaces(shown, pinched=False),
        "tips": _tips(shown),
        "combinations": _combinations(shown),
        "objective": _objective(shown),
        "targets": _targets(shown),
    }
    found = []
    for name, figure in drawn.items():
        file = f"two_models_{name}.png"
        figure.savefig(folder / file, dpi=DPI)
        caption = CAPTIONS[name]
        found.append({"file": file, "alt": caption.split(":", 1)[1].strip(), "caption": caption})
    return found


def _figure(width: float, height: float, layout: Literal["constrained", "tight"] = "tight") -> Figure:
    from matplotlib.figure import Figure

    return Figure(
        figsize=(width, height), layout=layout
    )  # "tight" is faster, but knows no colour bar of a whole row


def _shapes(shown: Shown) -> Figure:
    """Creases of the examples, x over y above and x over z below."""
    figure = _figure(13.0, 6.5)
    axes = figure.subplots(2, len(shown.named))
    for i, (k0, length) in enumerate(shown.named):
        for name, strips in shown.strips.items():
            crease = strips[i].crease()
            for row, other in enumerate((1, 2)):
                axes[row, i].plot(
                    crease[:, 0], crease[:, other], STYLES[name], label=TITLES[name], linewidth=1.8
                )
        for row, other in enumerate((1, 2)):
            axes[row, i].plot(
                shown.limits[i][0], shown.limits[i][other], "C0x", label="its limit of fine meshes"
            )
        axes[0, i].set(title=f"k0 = {k0:g} /mm, {length:g} mm", ylabel="y, mm", aspect="equal")
        axes[0, i].set_aspect("equal", adjustable="datalim")
        axes[1, i].set(xlabel="x, mm", ylabel="z, mm")
    axes[0, 0].legend(fontsize="small")
    return figure


def _values(maps: Maps, *, pinched: bool) -> Array:
    """(6, a, b) ends, mm, and angles, degrees; w without jumps of a whole turn."""
    points = maps.pinched if pinched else maps.folded
    frames = maps.pinched_frames if pinched else maps.folded_frames
    uvw = np.full((*maps.k0.shape, 3), np.nan)
    uvw[maps.inside] = np.degrees(angles(frames[maps.inside]))
    near = np.degrees(maps.k0 * maps.length * np.sqrt(2.0))  # of the folded arc
    uvw[..., 2] = near + np.mod(uvw[..., 2] - near + 180.0, 360.0) - 180.0
    return np.moveaxis(np.concatenate((points, uvw), axis=-1), -1, 0)


def _surfaces(shown: Shown, *, pinched: bool) -> Figure:
    """Six values over curvature and length: by the source's model, by the other one, and their difference."""
    source, ours = (_values(shown.maps[name], pinched=pinched) for name in (SOURCE, CONVERGING))
    figure = _figure(13.0, 16.0)
    axes = figure.subplots(6, 3, sharex=True, sharey=True)
    maps = shown.maps[SOURCE]
    columns = (
        (TITLES[SOURCE], source),
        (TITLES[CONVERGING], ours),
        ("the second less the first", ours - source),
    )
    for i, label in enumerate(VALUES):
        top = max(float(np.nanmax(np.abs(values[i]))) for _, values in columns[:2])
        for j, (title, values) in enumerate(columns):
            bound = max(top if j < 2 else float(np.nanmax(np.abs(values[i]))), 1e-9)
            _contours(figure, axes[i, j], maps, values[i], np.linspace(-bound, bound, 21), "RdBu_r")
            axes[i, j].set_title(f"{label}: {title}", fontsize="small")
        axes[i, 0].set_ylabel("length, mm")
    for ax in axes[-1]:
        ax.set_xlabel("k0, 1/mm")
    return figure


def _contours(figure: Figure, ax: Axes, maps: Maps, values: Array, levels: Array, colours: str) -> None:
    drawn = ax.contourf(maps.k0, maps.length, values, levels, cmap=colours)
    figure.colorbar(drawn, ax=ax, shrink=0.9)


def _tips(shown: Shown) -> Figure:
    """Movements of the end by the pinch: three components and their length, a row for each model."""
    figure = _figure(15.0, 6.0)
    axes = figure.subplots(2, 4, sharex=True, sharey=True)
    moves = {name: shown.maps[name].pinched - shown.maps[name].folded for name in (SOURCE, CONVERGING)}
    for j in range(4):
        values = {n: m[..., j] if j < 3 else np.linalg.norm(m, axis=-1) for n, m in moves.items()}
        top = max(float(np.nanmax(np.abs(v))) for v in values.values())
        levels = np.linspace(-top if j < 3 else 0.0, top, 21)
        for i, (name, value) in enumerate(values.items()):
            _contours(figure, axes[i, j], shown.maps[name], value, levels, "RdBu_r" if j < 3 else "viridis")
            axes[i, j].set_title(f"{('x', 'y', 'z', 'all')[j]}, mm: {TITLES[name]}", fontsize="small")
            axes[i, j].set(xlabel="k0, 1/mm", ylabel="length, mm")
    return figure


def _combinations(shown: Shown) -> Figure:
    """Ends of one crease pinched in all ways."""
    figure = _figure(13.0, 6.5)
    axes = figure.subplots(2, len(shown.ends))
    for i, (n, ends) in enumerate(shown.ends.items()):
        for name, mark in ((SOURCE, "C1o"), (CONVERGING, "C0x")):
            for row, other in enumerate((1, 2)):
                axes[row, i].plot(
                    ends[name][:, 0], ends[name][:, other], mark, label=TITLES[name], fillstyle="none"
                )
        axes[0, i].set(title=f"{n} segments", ylabel="y, mm")
        axes[0, i].set_aspect("equal", adjustable="datalim")
        axes[1, i].set(xlabel="x, mm", ylabel="z, mm")
    axes[0, 0].legend(fontsize="small")
    return figure


def _objective(shown: Shown) -> Figure:
    """Distances of the end of one pinched segment from the points, a row for each model."""
    figure = _figure(13.0, 6.5)
    axes = figure.subplots(2, len(shown.points), sharex=True, sharey=True)
    for i, name in enumerate((SOURCE, CONVERGING)):
        maps = shown.maps[name]
        for j, point in enumerate(shown.points):
            far = np.linalg.norm(maps.pinched - np.array(point), axis=-1)
            _contours(figure, axes[i, j], maps, far, np.linspace(0.0, float(np.nanmax(far)), 26), "viridis")
            found = shown.minima[name][j]
            axes[i, j].plot(found[:, 0], found[:, 1], "rx", clip_on=False)
            axes[i, j].set_title(f"{point}: {TITLES[name]}", fontsize="small")
            axes[i, j].set(xlabel="k0, 1/mm", ylabel="length, mm")
    return figure


def _targets(shown: Shown) -> Figure:
    """Misses of the source's designs, and segments that are enough without a pinch, one map for each z."""
    figure = _figure(15.0, 5.0, "constrained")
    axes = figure.subplots(2, len(LEVELS), sharex=True, sharey=True)
    x = sorted({a.target[0] for a in shown.aimed})
    y = sorted({a.target[1] for a in shown.aimed})
    bare = [a.bare[CONVERGING] for a in shown.aimed]
    numbers = (
        [a.lands for a in shown.aimed],
        [0.0 if design is None else float(design.n) for design in bare],
    )
    labels = ("missed, mm", "segments without a pinch")
    for row, (values, label) in enumerate(zip(numbers, labels, strict=True)):
        at = {a.target: value for a, value in zip(shown.aimed, values, strict=True)}
        top = float(np.nanmax(values)) if row == 0 else 4.0
        for ax, z in zip(axes[row], LEVELS, strict=True):
            grid = np.array([[at[i, j, z] for i in x] for j in y])
            drawn = ax.imshow(
                grid, origin="lower", vmin=0.0, vmax=max(top, 1e-9), cmap="viridis", aspect="auto"
            )
            ax.set_xticks(range(len(x)), [f"{v:g}" for v in x], fontsize="small")
            ax.set_yticks(range(len(y)), [f"{v:g}" for v in y], fontsize="small")
            ax.set_title(f"z = {z:g} mm", fontsize="small")
        figure.colorbar(drawn, ax=axes[row], label=label, shrink=0.9)
    return figure
