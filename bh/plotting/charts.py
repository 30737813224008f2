"""Charts of paths and patterns in one line each, as matplotlib figures: `figure.savefig("file.svg")` keeps one.

Colours are told apart with any colour vision, and dashes or markers tell them apart in grey.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.model.supports import AXES, Support
from bh.plotting.offscreen import PlotError
from bh.solvers.outcome import Critical
from meshes.mesh import count
from meshes.wide import WIDE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from bh.formulations.state import State
    from bh.model.model import Model
    from bh.paths.path import Path
    from meshes.mesh import SheetMesh

Array = NDArray[np.float64]
Dashes = str | tuple[float, tuple[float, ...]]  # a line style of matplotlib

INK = "#1b1b1f"
# Okabe and Ito's colours, told apart with any colour vision; dashes tell the lines apart in grey
CURVES: dict[str, tuple[str, Dashes]] = {
    "total": (INK, "-"),
    "bending": ("#0072b2", "-"),
    "stretching": ("#d55e00", (0, (5, 1.5))),
    "folding": ("#009e73", (0, (1.2, 1.2))),
}
FOLDS: dict[str, tuple[str, Dashes]] = {
    "mountain": ("#d55e00", "-"),
    "valley": ("#0072b2", (0, (5, 2))),
    "flat": ("#8a8a8a", (0, (1.2, 1.2))),
}
STABLE, UNSTABLE = "#0072b2", "#d55e00"
CRITICAL = {Critical.LIMIT: "^", Critical.BIFURCATION: "D"}
FEW_NODES = 12  # whose marks do not hide what they stand on
MOST_ANGLES = 7  # states of a path that are drawn along a crease


def curves(path: Path) -> Figure:
    """Energy by kind, N mm, against step + lambda, as a matplotlib figure; kinds that stay zero are left out.

    Args:
        path: solved, as far as it goes.

    Raises:
        PlotError: the path has no states.
    """
    from bh.plotting.notebook import Chart

    if len(path) == 0:
        raise PlotError("the path has no states to plot; trace the model first")
    at = path.lambdas
    energies = [state.energy.as_dict() for state in path]
    series = {kind: np.array([energy[kind] for energy in energies]) for kind in CURVES}
    shown = {kind: values for kind, values in series.items() if np.any(values != 0.0)}
    if len(shown) <= 2:  # the only kind there is says all that the total would
        shown.pop("total", None)
    figure = Chart(figsize=(7.2, 4.4), dpi=100, layout="constrained")
    axes = figure.subplots()
    for boundary in range(1, int(np.ceil(at[-1] - 1e-12))):
        axes.axvline(boundary, color="0.85", linewidth=1.0, zorder=0)
    for kind, values in shown.items():
        colour, dashes = CURVES[kind]
        axes.plot(at, values, color=colour, linestyle=dashes, marker="o", markersize=3.0, label=kind)
    axes.set(xlabel="step + λ", ylabel="energy, N mm", xlim=(at[0], max(at[-1], at[0] + 1e-3)))
    axes.spines[["top", "right"]].set_visible(False)
    axes.margins(y=0.06)
    if shown:
        axes.set_ylim(bottom=min(0.0, *(float(values.min()) for values in shown.values())))
        axes.legend(frameon=False, loc="upper left")
    return figure


def fold_angles(path: Path, crease: str, count: int = MOST_ANGLES) -> Figure:
    """Fold angle along a crease, degrees, against arc length of the flat crease, mm, in some states of a path.

    Args:
        path: solved, as far as it goes.
        crease: its name.
        count: how many states, evenly taken, the last one among them.

    Raises:
        PlotError: the path has no states.
        MeshError: there is no such crease.
    """
    _states(path)
    nodes = path.model.mesh.points[path.model.mesh.crease_edges(crease)]
    length = np.linalg.norm(nodes[:, 1] - nodes[:, 0], axis=1)
    middle = np.cumsum(length) - 0.5 * length
    chosen = np.unique(np.linspace(0, len(path) - 1, min(max(count, 1), len(path))).round().astype(int))
    if count == 1:
        chosen = np.array([len(path) - 1])
    figure, axes = _axes_of("arc length along the crease, mm", "fold angle, degrees")
    from matplotlib import colormaps

    for place, index in enumerate(chosen.tolist()):
        # from dark to light, but not to the yellow that paper swallows
        colour = colormaps["viridis"](0.85 * place / max(len(chosen) - 1, 1))
        state = path[index]
        label = f"step {state.step + 1}, λ = {state.lam:.3g}"
        axes.plot(middle, np.degrees(state.fold_angle(crease)), color=colour, linewidth=1.8, label=label)
    axes.set_xlim(0.0, float(length.sum()))
    axes.legend(frameon=False, fontsize="small", loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def response(
    path: Path,
    at: str | None = None,
    along: str | Sequence[float] = "z",
    *,
    force: str | Callable[[State], float] = "reaction",
) -> Figure:
    """The path as force against displacement, or as step + lambda against displacement, with its stability.

    Stable states are joined by full lines and filled dots, unstable ones by dashes and rings; limit points are
    triangles and bifurcations diamonds at the last state before them. A jump to another branch is not joined.

    Args:
        path: solved, as far as it goes.
        at: the place whose mean displacement is the abscissa, and whose reaction the ordinate; None for the
            energy against step + lambda.
        along: the direction of both, "x", "y", "z" or three numbers.
        force: "reaction" (N, of the supports at the place on the sheet), "lambda" for step + lambda, or a
            function of a state.

    Raises:
        PlotError: the path has no states, or `along` or `force` is not known.
        MeshError: there is no such place.
    """
    _states(path)
    x, y, labels = _response(path, at, along, force)
    figure, axes = _axes_of(*labels)
    stable = np.array([record.stable is not False for record in path.records])
    jumped = np.array([record.jumped for record in path.records])
    for index in range(1, len(x)):
        if jumped[index]:
            continue
        whole = stable[index - 1] and stable[index]
        colour, dashes = (STABLE, "-") if whole else (UNSTABLE, (0, (4, 2)))
        ends = slice(index - 1, index + 1)
        axes.plot(x[ends], y[ends], zorder=1, linewidth=1.6, color=colour, linestyle=dashes)
    dots = partial(axes.plot, linestyle="none", markersize=4.5, zorder=2)
    if stable.any():
        dots(x[stable], y[stable], "o", color=STABLE, label="stable")
    if not stable.all():
        dots(x[~stable], y[~stable], "o", color=UNSTABLE, markerfacecolor="white", label="not stable")
    for kind, marker in CRITICAL.items():
        before = [
            index - 1
            for index, record in enumerate(path.records)
            if index > 0 and any(kind in point.kind for point in record.critical)
        ]
        if before:
            dots(x[before], y[before], marker, color=INK, label=f"{kind} point", markersize=8.0)
    axes.legend(frameon=False, fontsize="small", loc="best")
    return figure


def _response(
    path: Path, at: str | None, along: str | Sequence[float], force: str | Callable[[State], float]
) -> tuple[Array, Array, tuple[str, str]]:
    """Abscissa, ordinate and their labels."""
    if isinstance(force, str) and force not in ("reaction", "lambda"):
        raise PlotError(f"force '{force}' is not known; use reaction, lambda, or a function of a state")
    if at is None:
        energy = np.array([state.energy.total for state in path])
        return path.lambdas, energy, ("step + λ", "energy, N mm")
    direction = _direction(along)
    moved = np.array([(state.displacement(at) @ direction).mean() for state in path])
    word = along if isinstance(along, str) else "(" + ", ".join(f"{part:.3g}" for part in direction) + ")"
    label = f"displacement of {at} along {word}, mm"
    if callable(force):
        return moved, np.array([force(state) for state in path]), (label, getattr(force, "__name__", "force"))
    if force == "lambda":
        return moved, path.lambdas, (label, "step + λ")
    return (
        moved,
        np.array([state.reaction(at) @ direction for state in path]),
        (label, f"force along {word}, N"),
    )


def _direction(along: str | Sequence[float]) -> Array:
    if isinstance(along, str) and along not in AXES:
        raise PlotError(f"direction '{along}' is not known; use x, y, z or three numbers")
    found = np.asarray(AXES[along] if isinstance(along, str) else along, dtype=float)
    size = float(np.linalg.norm(found)) if found.shape == (3,) else math.nan
    if not (np.isfinite(size) and size > 0.0):
        raise PlotError(f"direction {along} cannot be; give three numbers that are not all zero")
    unit: Array = found / size
    return unit


def pattern(model: Model) -> Figure:
    """The flat pattern: outline, mesh, mountain (full), valley (dashed) and flat (dotted) creases, supports.

    A wide crease is its two lines, dotted. A support is marked by the letters that it fixes, once a place; a triangle
    stands on its nodes, a square where the slope is held too.

    Args:
        model: of which mesh and supports are drawn.
    """
    mesh = model.mesh
    figure, axes = _axes_of("x, mm", "y, mm")
    axes.set_aspect("equal")
    axes.triplot(mesh.points[:, 0], mesh.points[:, 1], mesh.triangles, color="0.86", linewidth=0.5, zorder=0)
    _edges(axes, mesh, mesh.topology.boundary, INK, "-", 1.6)
    seen: set[str] = set()
    for crease in mesh.creases:
        fold = WIDE if crease in mesh.side_of else f"{mesh.folds.get(crease, 'flat')} crease"
        colour, dashes = FOLDS.get(fold.split()[0], FOLDS["flat"])
        _edges(
            axes,
            mesh,
            mesh.crease_edges(crease),
            colour,
            dashes,
            2.0,
            None if fold in seen else fold,
        )
        seen.add(fold)
    for number, support in enumerate(s for s in model.supports if isinstance(s, Support)):
        nodes = mesh.nodes(support.at) if isinstance(support.at, str) else np.asarray(support.at)
        fixed = support.fix if isinstance(support.fix, str) else "oblique"
        place = support.at if isinstance(support.at, str) else count(len(nodes), "node")
        x, y = mesh.points[nodes, 0], mesh.points[nodes, 1]
        marker = "s" if support.clamp else ("^", "v", "<", ">")[number % 4]
        label = f"{place}: {fixed}" + (" and slope" if support.clamp else "")
        size = 6.0 if len(nodes) <= FEW_NODES else 3.0
        axes.plot(x, y, marker, color="#009e73", markersize=size, linestyle="none", label=label, zorder=3)
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        axes.legend(
            handles, labels, frameon=False, fontsize="small", loc="upper left", bbox_to_anchor=(1.0, 1.0)
        )
    return figure


def _edges(
    axes: Axes,
    mesh: SheetMesh,
    pairs: NDArray[np.int64],
    colour: str,
    dashes: Dashes,
    width: float,
    label: str | None = None,
) -> None:
    """Edges as one line with gaps, so that dashes run on from edge to edge where they follow each other."""
    runs: list[list[int]] = []
    for one, two in pairs.tolist():
        if runs and runs[-1][-1] == one:
            runs[-1].append(two)
        else:
            runs.append([one, two])
    for number, run in enumerate(runs):
        x, y = mesh.points[run, 0], mesh.points[run, 1]
        axes.plot(
            x,
            y,
            color=colour,
            linestyle=dashes,
            linewidth=width,
            zorder=2,
            label=label if number == 0 else None,
        )


def _states(path: Path) -> None:
    if len(path) == 0:
        raise PlotError("the path has no states to plot; trace the model first")


def _axes_of(x: str, y: str) -> tuple[Figure, Axes]:
    from bh.plotting.notebook import Chart

    figure = Chart(figsize=(7.2, 4.4), dpi=100, layout="constrained")
    axes = figure.subplots()
    axes.set(xlabel=x, ylabel=y)
    axes.spines[["top", "right"]].set_visible(False)
    return figure, axes
