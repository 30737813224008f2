"""What a scene is before it is solved: in words, and the flat pattern drawn with its creases and supports."""

from __future__ import annotations

import os
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bh.errors import InputError
from bh.formulations.registry import remarks
from bh.model.refinement import Goal
from bh.model.sheet import Sheet
from bh.model.supports import Support, select
from bh.model.zones import triangles_in
from bh.scene.load import Scene
from meshes import SheetMesh
from meshes.curves import Array, sample
from meshes.io.export import replacing
from meshes.io.flat_lines import flat_lines
from meshes.io.writing import LOOKS
from meshes.mesh import count
from meshes.wide import STRIP, WIDE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = 12  # creases or places in a list


def _grain(sheet: Sheet) -> str:
    if sheet.plies is not None:
        return f", {len(sheet.plies)} plies"
    if sheet.grain is None:
        return ""
    return f", grain at {degrees(sheet.grain):.4g} degrees (E {sheet.E:.4g} along, {sheet.E2:.4g} MPa across)"


def _zones(scene: Scene) -> list[str]:
    model = scene.model
    of = model.sections.of
    areas = (
        np.zeros(0) if of is None else np.bincount(of, model.mesh.areas, minlength=len(model.zones) + 1)[1:]
    )
    return [
        f"zone {zone.where}: {area:.6g} mm^2, E = {zone.sheet.E:g} MPa, t = {zone.sheet.t:g} mm{_grain(zone.sheet)}"
        for zone, area in zip(model.zones, areas, strict=False)
    ]


def report(scene: Scene) -> list[str]:
    """The scene in lines: sheet, mesh, creases, places, supports, steps, and what to know of them.

    Returns:
        the lines in order.
    """
    model, mesh = scene.model, scene.model.mesh
    size = np.ptp(mesh.points, axis=0)
    lines = [
        f"sheet: {size[0]:.5g} x {size[1]:.5g} mm, {mesh.areas.sum():.6g} mm^2, t = {model.sheet.t:g} mm"
        f"{_grain(model.sheet)}",
        *_zones(scene),
        f"mesh: {mesh!r}; {model.formulation}" if scene.accuracy is None else _chosen(scene.accuracy),
    ]
    for name in mesh.drawn_creases[:SHOWN]:
        if name in mesh.wide_creases:
            lines.append(_wide(mesh, name))
            continue
        pairs = mesh.crease_edges(name)
        length = float(np.linalg.norm(mesh.points[pairs[:, 0]] - mesh.points[pairs[:, 1]], axis=1).sum())
        angles = mesh.fold_angles.get(name)
        drawn = (
            ""
            if angles is None or np.isnan(angles).any()
            else f", drawn to {degrees(abs(angles).mean()):.0f} degrees"
        )
        lines.append(
            f"crease {name}: {mesh.folds.get(name, 'not drawn')}, {length:.5g} mm, {count(len(pairs), 'edge')}{drawn}"
        )
    if len(mesh.drawn_creases) > SHOWN:
        lines.append(f"and {len(mesh.drawn_creases) - SHOWN} more creases")
    places = [name for name in (*mesh.corners, *mesh.edge_sets) if not name.startswith("crease:")]
    more = f" and {len(places) - SHOWN} more" if len(places) > SHOWN else ""
    lines.append(f"places: {', '.join(places[:SHOWN]) or 'none'}{more}")
    for support in model.supports:
        if isinstance(support, Support):
            what = f"fix {support.fix}" if support.fix is not None else "clamped"
            lines.append(f"support at {support.at}: {what}, {count(len(select(mesh, support.at)), 'node')}")
    for spring in model.springs:
        nodes = count(len(select(mesh, spring.at)), "node")
        lines.append(f"springs to the ground at {spring.at}: {nodes}")
    if not (model.supports or model.springs):
        lines.append("supports: none; rigid motions are taken out, nothing is held")
    for i, step in enumerate(model.steps):
        items = [_words(item) for item in (*step.actuations, *step.support, step.until) if item]
        goes = [f"release {item if isinstance(item, str) else 'nodes'}" for item in step.release]
        lines.append(f"step {i + 1}: " + ", ".join([*goes, *items]))
    # a mesh that is yet to be chosen is here to show the places, and nothing can be said of it
    shown = [r for r in remarks(model) if scene.accuracy is None or r.code == "drawing"]
    return lines + [f"remark ({remark.code}): {remark}" for remark in shown]


def _chosen(goal: Goal) -> str:
    what = goal.of if goal.at is None else f"{goal.of} at {goal.at}"
    how_well = f"{100 * goal.within:g} % by its own estimate"
    return f"mesh and formulation: chosen by the run, until the {what} is right to {how_well}"


def _words(item: object) -> str:
    """An actuation with what it was given."""
    given = {key: value for key, value in vars(item).items() if value is not None}
    place = given.pop("crease", None) or given.pop("at", "")
    rest = ", ".join(f"{key} = {value}" for key, value in given.items())
    return f"{type(item).__name__.lower()} {place}" + (f" ({rest})" if rest else "")


def draw(scene: Scene, file: str | os.PathLike[str]) -> Path:
    """Draw the flat pattern to a .png, .svg or .pdf file: creases by their fold, supports as marks, named places.

    A sheet that is not flat is drawn as seen from +z.

    Args:
        scene: with its pattern.
        file: of the picture.

    Returns:
        The absolute path of the file.

    Raises:
        InputError: another suffix, or a place that cannot be written to.
    """
    target = Path(file)
    suffix = target.suffix.lower()
    if suffix not in (".png", ".svg", ".pdf"):
        raise InputError(f"picture '{target}' is no .png, .svg or .pdf file; name it so")
    figure = _figure(scene)
    with replacing(target) as temporary:
        figure.savefig(temporary, format=suffix[1:], dpi=150)
    return target.resolve()


def _figure(scene: Scene) -> Figure:
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

    mesh = scene.model.mesh
    size = np.ptp(mesh.points[:, :2], axis=0)
    wide = float(np.clip(size[0] / max(size[1], 1e-12), 0.4, 2.5))
    figure = Figure(figsize=(min(10.0, 7.0 * wide) + 0.8, min(7.0, 10.0 / wide) + 1.3), layout="constrained")
    axes = figure.subplots()
    seen = mesh.points[:, :2]
    axes.add_collection(
        LineCollection(list(seen[mesh.topology.edges]), colors="0.85", linewidths=0.5, zorder=1)
    )
    names = set()
    for layer, points in _outlines(mesh):
        colour, dashes, _ = LOOKS["flat" if layer == WIDE else layer]
        style: str | tuple[float, tuple[float, ...]] = (
            (0.0, tuple(1.2 * x for x in dashes)) if dashes else "-"
        )
        label = layer if layer not in names else None
        names.add(layer)
        axes.plot(*points.T, color=colour, linestyle=style, linewidth=1.6, label=label, zorder=3)
    _mark_supports(axes, scene)
    axes.set_aspect("equal")
    axes.autoscale()
    axes.margins(0.06)
    axes.set(xlabel="x, mm", ylabel="y, mm")
    nodes, triangles = count(len(mesh.points), "node"), count(len(mesh.triangles), "triangle")
    axes.set_title(f"{scene.name}\n{nodes}, {triangles}, {mesh.kind}", fontsize=9)
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    return figure


def _wide(mesh: SheetMesh, name: str) -> str:
    """A line on a wide crease: how long and wide its strip is."""
    lengths = [
        float(np.linalg.norm(np.diff(mesh.points[mesh.crease_edges(line)], axis=1), axis=2).sum())
        for line, crease in mesh.side_of.items()
        if crease == name
    ]
    length = sum(lengths) / len(lengths)
    area = float(mesh.areas[triangles_in(mesh, f"{STRIP}{name}", f"crease {name}")].sum())
    return f"crease {name}: a strip, {length:.5g} mm long and {area / length:.4g} mm wide"


def _outlines(mesh: SheetMesh) -> list[tuple[str, Array]]:
    """Layers, or `WIDE`, and points (k, 2) of boundary and creases, seen from +z."""
    sides = mesh.side_of
    if mesh.flat:
        lines = [line for line in flat_lines(mesh) if line.layer != "facet"]
        return [(WIDE if line.name in sides else line.layer, sample(line.curve)) for line in lines]
    found = [("boundary", mesh.points[pair][:, :2]) for pair in mesh.topology.boundary]
    for name in mesh.creases:
        layer = WIDE if name in sides else mesh.folds.get(name, "flat")
        found += [(layer, mesh.points[pair][:, :2]) for pair in mesh.crease_edges(name)]
    return found


def _mark_supports(axes: Axes, scene: Scene) -> None:
    mesh = scene.model.mesh
    for support, mark in zip(scene.model.supports, "^so*DvP" * len(scene.model.supports), strict=False):
        if isinstance(support, Support):
            at = mesh.points[select(mesh, support.at), :2]
            what = f"{support.at if isinstance(support.at, str) else 'nodes'}: {support.fix or 'clamped'}"
            axes.plot(*at.T, mark, color="#009e73", markersize=4.5, linestyle="none", label=what, zorder=4)
