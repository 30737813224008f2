"""Drawings that hold several sheets: which they are, in the order they are read in, and one of them alone. mm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from meshes.errors import PatternError
from meshes.planar import Graph


def in_reading_order(sheets: Sequence[Any]) -> list[Any]:
    """Polygons as one reads: rows from the top, each from the left.

    Args:
        sheets: shapely's polygons; one whose middle lies above the lower edge of the first of a row is in that row.

    Returns:
        the same polygons.
    """
    rows: list[list[Any]] = []
    for sheet in sorted(sheets, key=lambda each: -each.bounds[3]):
        middle = 0.5 * (sheet.bounds[1] + sheet.bounds[3])
        if rows and middle > rows[-1][0].bounds[1]:
            rows[-1].append(sheet)
        else:
            rows.append([sheet])
    return [sheet for row in rows for sheet in sorted(row, key=lambda each: each.bounds[0])]


def sheets_of(graph: Graph) -> list[Any]:
    """What the lines of a graph enclose, each a polygon of shapely, in the order they are read in.

    Args:
        graph: healed, see `meshes.planar.heal`.

    Returns:
        the polygons, without the lines inside them.
    """
    import shapely

    faces = shapely.get_parts(shapely.polygonize_full(shapely.linestrings(graph.points[graph.edges]))[0])
    return in_reading_order(list(shapely.get_parts(shapely.union_all(faces))))


def one_sheet(graph: Graph, number: int, fit: float | None, move: bool) -> Graph:
    """The part of a graph that belongs to one of its sheets.

    Args:
        graph: healed, see `meshes.planar.heal`.
        number: of the sheet, from 1, see `in_reading_order`.
        fit: the longer side that it gets, mm; None to leave its size.
        move: bring its lower left corner to the origin.

    Raises:
        PatternError: there is no such sheet, or no closed outline at all.
    """
    import shapely

    sheets = sheets_of(graph)
    if not 1 <= number <= len(sheets):
        raise PatternError(f"sheet = {number} cannot be; the drawing holds {_counted(len(sheets))}")
    middles = shapely.points(graph.points[graph.edges].mean(axis=1))
    own = np.argmin([shapely.distance(sheet, middles) for sheet in sheets], axis=0) == number - 1
    box = sheets[number - 1].bounds
    larger = 1.0 if fit is None else fit / _longer(box)
    origin = (box[0], box[1]) if move else (0.0, 0.0)
    return replace(
        graph,
        points=(graph.points - origin) * larger,
        origin=origin,
        scale=larger,
        edges=graph.edges[own],
        kinds=tuple(kind for kind, kept in zip(graph.kinds, own, strict=True) if kept),
        lines=tuple(line for line, kept in zip(graph.lines, own, strict=True) if kept),
        gap=graph.gap * larger,
    )


def several(sheets: Sequence[Any]) -> str:
    """What is said of a drawing with several sheets where one was wanted.

    Args:
        sheets: shapely's polygons.
    """
    inside = [sheet.representative_point() for sheet in in_reading_order(sheets)]
    spots = ", ".join(f"({point.x:.6g}, {point.y:.6g})" for point in inside)
    return (
        f"the drawing holds {len(sheets)} separate sheets (at {spots}); choose one: sheet = 1 to {len(sheets)}, "
        "counted in rows from the top left"
    )


def _longer(box: tuple[float, float, float, float]) -> float:
    return max(box[2] - box[0], box[3] - box[1])


def _counted(sheets: int) -> str:
    return "no closed outline" if sheets == 0 else "one sheet" if sheets == 1 else f"the sheets 1 to {sheets}"
