"""Meshes whose inner edges are given rulings: between them the sheet is cut into triangles without any node inside.

On such a mesh bars and hinges bend where a developable sheet bends, and do not lock (docs/drawing.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from meshes.curves import Array, Curve, arc_lengths, sample
from meshes.errors import FileFormatError, MeshError
from meshes.mesh import SheetMesh
from meshes.pattern import CreasePattern
from meshes.planar import corners

CLOSE = 0.3  # of the spacing: ends that are nearer than that share a node
LETTERS = {"mountain": "M", "valley": "V", "flat": "U"}


def ruled(pattern: CreasePattern, rulings: Sequence[Array], spacing: float) -> SheetMesh:
    """Mesh a pattern along given rulings.

    The names are those of `meshes.io.read_fold`; `edge:flat` are the rulings. Cuts are open.

    Args:
        pattern: of which edges and creases are cut.
        rulings: straight lines (2, 2) from crease or edge to crease or edge, mm; they must not cross.
        spacing: creases and edges are cut into edges of about that length, mm, and at the ends of the
            rulings.

    Raises:
        MeshError: a spacing that cannot be, or lines that cross.
    """
    from meshes.io.fold import sheet_of_frame
    from meshes.io.fold_frame import Frame

    if not (np.isfinite(spacing) and spacing > 0.0):
        raise MeshError(f"spacing = {spacing} cannot be; use a positive length in mm")
    curves = [("B", curve) for _, curve in pattern.edges]
    curves += [(LETTERS[crease.fold], crease.curve) for crease in pattern.creases]
    curves += [("C", curve) for _, curve in pattern.cuts]
    net = _Net(curves, rulings, spacing)
    edges, letters = net.edges()
    points = np.column_stack((net.points, np.zeros(len(net.points))))
    try:
        mesh = sheet_of_frame(Frame(points, edges, letters, None, []))
    except FileFormatError as error:
        raise MeshError(
            f"the rulings do not make a mesh ({error}); use another spacing, or unstructured where a crease ends inside"
        ) from error
    return replace(mesh, kind="ruled", remarks=pattern.remarks + mesh.remarks)


class _Net:
    """Curves as chains of nodes, cut where rulings end."""

    def __init__(self, curves: Sequence[tuple[str, Curve]], rulings: Sequence[Array], spacing: float) -> None:
        import shapely

        self.letters = [letter for letter, _ in curves]
        self.lines = [shapely.LineString(sample(curve)) for _, curve in curves]
        self.spacing = spacing
        self.found: list[tuple[float, float]] = []
        self.where: dict[tuple[int, int], int] = {}
        size = max(line.length for line in self.lines)
        self.near = 1e-6 * size
        places: list[list[float]] = [self._fixed(line) for line in self.lines]
        ends = [[self._place(point) for point in ruling] for ruling in rulings]
        for pair in ends:
            for number, at in pair:
                places[number].append(at)
        self.chains = [self._nodes(number, at) for number, at in enumerate(places)]
        self.rulings = [tuple(self._node_at(number, at) for number, at in pair) for pair in ends]

    @property
    def points(self) -> Array:
        return np.array(self.found)

    def edges(self) -> tuple[list[tuple[int, int]], list[str]]:
        found: dict[tuple[int, int], str] = {}
        for letter, chain in zip(self.letters, self.chains, strict=True):
            for (_, a), (_, b) in pairwise(chain):
                found.setdefault((min(a, b), max(a, b)), letter)
        for a, b in self.rulings:
            if a != b:
                found.setdefault((min(a, b), max(a, b)), "F")
        return list(found), list(found.values())

    def _fixed(self, line: Any) -> list[float]:
        """Ends and corners of a curve, and where others end on it."""
        import shapely

        points = np.asarray(line.coords)
        along = arc_lengths(points)
        found = [0.0, *along[corners(points)].tolist(), float(line.length)]
        for other in self.lines:
            for end in (other.coords[0], other.coords[-1]):
                point = shapely.Point(end)
                if other is not line and line.distance(point) < self.near:
                    found.append(float(line.project(point)))
        return found

    def _place(self, point: Array) -> tuple[int, float]:
        import shapely

        at = shapely.Point(point)
        number = int(np.argmin([line.distance(at) for line in self.lines]))
        return number, float(self.lines[number].project(at))

    def _nodes(self, number: int, places: list[float]) -> list[tuple[float, int]]:
        """The chain of a curve as (place, node); what is fixed stays, rulings join what is close."""
        line = self.lines[number]
        fixed = sorted(set(self._fixed(line)))
        kept = [at for i, at in enumerate(fixed) if i == 0 or at - fixed[i - 1] > self.near]
        for at in sorted(places):
            if min(abs(at - other) for other in kept) > CLOSE * self.spacing:
                kept.append(at)
        kept.sort()
        cut = [kept[0]]
        for a, b in pairwise(kept):
            cells = max(1, round((b - a) / self.spacing))
            cut += [a + (b - a) * i / cells for i in range(1, cells)] + [b]
        return [(at, self._node(line.interpolate(at))) for at in cut]

    def _node(self, point: Any) -> int:
        key = (round(point.x / (10.0 * self.near)), round(point.y / (10.0 * self.near)))
        for square in ((key[0] + i, key[1] + j) for i in (-1, 0, 1) for j in (-1, 0, 1)):
            if square in self.where:
                return self.where[square]
        self.found.append((float(point.x), float(point.y)))
        self.where[key] = len(self.found) - 1
        return self.where[key]

    def _node_at(self, number: int, at: float) -> int:
        chain = self.chains[number]
        return chain[int(np.argmin([abs(place - at) for place, _ in chain]))][1]
