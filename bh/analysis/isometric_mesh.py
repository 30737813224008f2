"""Ruled panels as meshes, and the folded places of any points of the flat sheet."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.analysis.differences import InterpolatingSpline
from bh.analysis.ruled import Panel, feet
from bh.errors import ModelError
from meshes import SheetMesh

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

Array = NDArray[np.float64]
CHUNK = 2_000_000  # pairs of points and generators that are looked at at once


def ruled_mesh(
    panels: tuple[Panel, Panel], lengths: tuple[Array, Array], along: int, rows: int
) -> tuple[SheetMesh, Array]:
    """Mesh of two panels with nodes on generators: the flat sheet, and the (n, 3) folded places of its nodes.

    Edge sets are those of `grid_mesh`; "edge:left" and "edge:right" are the far ends of the generators.

    Args:
        panels: left and right.
        lengths: (k,) each, how far the generators go, mm.
        along: cells along the crease.
        rows: of cells on either side.
    """
    u = panels[0].u
    at = np.linspace(u[0], u[-1], along + 1)
    flat, folded = [], []
    for panel, v, order in (
        (panels[1], lengths[1], range(rows, 0, -1)),
        (panels[0], lengths[0], range(rows + 1)),
    ):
        columns = np.column_stack((panel.flat_crease, panel.flat_generator, panel.crease, panel.generator))
        made = InterpolatingSpline(5).through(u, columns)(at)
        distance = np.interp(at, u, v)
        for row in order:
            share = (distance * row / rows)[:, None]
            flat.append(made[:, :2] + share * made[:, 2:4])
            folded.append(made[:, 4:7] + share * made[:, 7:10])
    return grid_mesh(np.array(flat), rows, "ruled"), np.vstack(folded)


def strip_mesh(panel: Panel, widths: tuple[float, float], along: int, rows: int) -> SheetMesh:
    """Flat mesh between lines beside the crease, in columns across it.

    Args:
        panel: on either side of the crease.
        widths: distances of the lines (left, right) from the crease, mm.
        along: cells along the crease.
        rows: of cells on either side.
    """
    u = panel.u
    made = InterpolatingSpline(7).through(u, panel.flat_crease)
    at = np.linspace(u[0], u[-1], along + 1)
    tangent = made(at, 1)
    normal = np.column_stack((-tangent[:, 1], tangent[:, 0])) / np.linalg.norm(tangent, axis=1, keepdims=True)
    left, right = widths
    across = np.concatenate((-right * np.arange(rows, 0, -1), left * np.arange(rows + 1))) / rows
    return grid_mesh(made(at) + across[:, None, None] * normal, rows, "strip")


def grid_mesh(lines: Array, rows: int, kind: str) -> SheetMesh:
    """Triangles between node lines (2 rows + 1, along + 1, 2) from the right to the left, diagonals alternating.

    Edge sets are "crease:crease" (the line in the middle), "edge:left", "edge:right", "edge:start" and "edge:end".

    Args:
        lines: (2 rows + 1, along + 1, 2) nodes, mm.
        rows: of cells on either side of the middle line.
        kind: of the mesh, see `SheetMesh.kind`.
    """
    count, columns = lines.shape[:2]
    number = np.arange(count * columns).reshape(count, columns)
    low, high = number[:-1], number[1:]
    a, b, c, d = (part.ravel() for part in (low[:, :-1], low[:, 1:], high[:, 1:], high[:, :-1]))
    turned = ((np.arange(count - 1)[:, None] + np.arange(columns - 1)) % 2).ravel()[:, None] == 1
    first = np.where(turned, np.column_stack((a, b, d)), np.column_stack((a, b, c)))
    second = np.where(turned, np.column_stack((b, c, d)), np.column_stack((a, c, d)))

    def chain(ids: NDArray[np.int64]) -> NDArray[np.int64]:
        return np.column_stack((ids[:-1], ids[1:]))

    sets = {
        "crease:crease": chain(number[rows]),
        "edge:right": chain(number[0]),
        "edge:left": chain(number[-1]),
        "edge:start": chain(number[:, 0]),
        "edge:end": chain(number[:, -1]),
    }
    return SheetMesh(lines.reshape(-1, 2), np.concatenate((first, second)), sets, kind=kind)


@dataclass(frozen=True, eq=False)
class Placed:
    """The map from the flat sheet to the folded one: each point moves with the generator that it lies on.

    What lies before the first or behind the last generator goes on in the plane that touches the panel there: still
    isometric, and without energy.
    """

    panels: tuple[Panel, Panel]

    def __call__(self, points: Array) -> Array:
        """(n, 3) folded places of flat points (n, 2) or (n, 3) with z = 0, mm.

        Raises:
            ModelError: a point lies beyond a regression curve.
        """
        points = np.asarray(points, dtype=float)
        if points.ndim != 2 or points.shape[1] not in (2, 3) or not np.isfinite(points).all():
            raise ModelError("points of the flat sheet must be a finite array (n, 2) in mm")
        flat = points[:, :2]
        crease = self.panels[0]
        foot, normal = feet(flat, crease.flat_crease, crease.u)
        side = np.einsum("nc,nc->n", flat - foot, normal)
        out = np.empty((len(flat), 3))
        for panel, mine in zip(self.panels, (side >= 0.0, side < 0.0), strict=True):
            if mine.any():
                out[mine] = self._on(panel, flat[mine])
        return out

    def _on(self, panel: Panel, points: Array) -> Array:
        count = max(1, CHUNK // len(panel.u))
        return np.concatenate(
            [self._chunk(panel, points[i : i + count]) for i in range(0, len(points), count)]
        )

    def _chunk(self, panel: Panel, points: Array) -> Array:
        """Find the generator of every point: where the cross product with it changes its sign, first on the grid."""
        offset = points[:, None, :] - panel.flat_crease
        g = panel.flat_generator
        # positive for points ahead of the generator; it falls along u up to the regression curve
        ahead = panel.sign * (g[:, 1] * offset[..., 0] - g[:, 0] * offset[..., 1])
        reach = np.einsum("nkc,kc->nk", offset, g)
        # a point of the crease lies between two generators that begin on it, on either side of their beginnings
        spacing = float(np.linalg.norm(np.diff(panel.flat_crease, axis=0), axis=1).max())
        crosses = (ahead[:, :-1] >= 0.0) & (ahead[:, 1:] < 0.0) & (reach[:, :-1] > -spacing)
        rows = np.arange(len(points))
        column = np.argmin(np.where(crosses, np.abs(reach[:, :-1]), np.inf), axis=1)
        found = crosses[rows, column]
        out = np.empty((len(points), 3))
        if found.any():
            out[found] = self._refined(panel, points[found], column[found])
        limit = panel.regression
        before = ~found & (ahead[:, 0] < 0.0) & (reach[:, 0] < limit[0])
        beyond = ~found & (ahead[:, -1] >= 0.0) & (reach[:, -1] < limit[-1])
        # a sheet that turns by more than half a turn has points behind both ends: the nearer one counts
        nearer = (offset[:, 0] ** 2).sum(axis=1) < (offset[:, -1] ** 2).sum(axis=1)
        before, beyond = before & (nearer | ~beyond), beyond & (~nearer | ~before)
        for end, which in ((0, before), (-1, beyond)):
            out[which] = _plane(panel, end, points[which])
        lost = ~(found | before | beyond)
        if lost.any():
            x, y = points[int(np.argmax(lost))]
            raise ModelError(
                f"the point ({x:.4g}, {y:.4g}) lies beyond the regression curve of the {panel.side} panel; take a "
                f"narrower sheet, at most {panel.largest_width:.4g} mm"
            )
        return out

    def _refined(self, panel: Panel, points: Array, column: NDArray[np.int64]) -> Array:
        made = self._splines[panel.side]
        low, high = panel.u[column], panel.u[column + 1]
        u = 0.5 * (low + high)
        for _ in range(30):
            value, rate = made(u), made(u, 1)
            offset, g = points - value[:, :2], value[:, 2:4]
            f = _cross(offset, g)
            slope = _cross(-rate[:, :2], g) + _cross(offset, rate[:, 2:4])
            step = np.where(slope != 0.0, f / np.where(slope != 0.0, slope, 1.0), 0.0)
            u = np.clip(u - step, low, high)
            if np.abs(step).max() <= 1e-14 * (panel.u[-1] - panel.u[0]):
                break
        value = made(u)
        g = value[:, 2:4] / np.linalg.norm(value[:, 2:4], axis=1, keepdims=True)
        v = np.einsum("nc,nc->n", points - value[:, :2], g)
        return np.asarray(value[:, 4:7] + v[:, None] * value[:, 7:10])

    @cached_property
    def _splines(self) -> dict[str, BSpline]:
        spline = InterpolatingSpline(7)
        return {
            panel.side: spline.through(
                panel.u,
                np.column_stack((panel.flat_crease, panel.flat_generator, panel.crease, panel.generator)),
            )
            for panel in self.panels
        }


def _plane(panel: Panel, end: int, points: Array) -> Array:
    """Points in the plane that touches the panel along its first or last generator."""
    g2, g3 = panel.flat_generator[end], panel.generator[end]
    across3 = panel.sign * np.cross(g3, panel.normal[end])
    offset = points - panel.flat_crease[end]
    ahead = panel.sign * (g2[1] * offset[:, 0] - g2[0] * offset[:, 1])
    return np.asarray(panel.crease[end] + (offset @ g2)[:, None] * g3 + ahead[:, None] * across3)


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
