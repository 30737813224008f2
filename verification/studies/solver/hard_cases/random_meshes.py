"""Random meshes, slender and unstructured: the solver must not care, whatever the accuracy of such meshes may be."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from bh import Model, Sheet, trace
from meshes import SheetMesh
from verification.framework.checks import CaseResult, line, plot
from verification.studies.solver.campaign import FINE

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
SEED, MESHES = 14, 16
RADIUS, WIDTH = 100.0, 10.0


def random_mesh(seed: int, slender: float, angle: float = math.pi / 4.0) -> SheetMesh:
    """A creased sector from random points, by Delaunay's rule panel by panel, so that edges follow the crease.

    `slender` is the mean height across over width along of the triangles: Delaunay's rule is applied in a plane where
    the sector is stretched along by it. Nodes on boundaries and crease are irregular too.
    """
    rng = np.random.default_rng(seed)
    rows = 2
    cell = WIDTH / rows
    columns = max(4, min(round(RADIUS * angle / cell * slender), 600))
    stretch = columns * cell / (RADIUS * angle)  # squeezed plane: cells are about square
    rails = [_irregular(rng, columns) for _ in range(3)]
    points: list[Array] = [
        np.column_stack((u, np.full(len(u), RADIUS + WIDTH * k)))
        for k, u in zip((-1, 0, 1), rails, strict=True)
    ]
    first = np.cumsum([0, *(len(u) for u in rails)])
    triangles = []
    total = int(first[-1])
    for panel in range(2):
        inside = np.column_stack(
            (
                _irregular(rng, columns)[1:-1] + rng.uniform(-0.2, 0.2, columns - 1) / columns,
                RADIUS + WIDTH * (panel - 1 + rng.uniform(0.3, 0.7, columns - 1)),
            )
        )
        numbers = np.concatenate((np.arange(first[panel], first[panel + 2]), total + np.arange(len(inside))))
        points.append(inside)
        total += len(inside)
        flat = np.vstack((points[panel], points[panel + 1], inside)) * [RADIUS * angle * stretch, 1.0]
        triangles.append(numbers[_delaunay(flat)])
    u, r = np.vstack(points).T
    xy = np.column_stack((r * np.cos(angle * u), r * np.sin(angle * u)))
    crease = np.arange(first[1], first[2])
    chain = np.column_stack((crease[:-1], crease[1:]))
    found = _counter_clockwise(xy, np.vstack(triangles))
    return SheetMesh(xy, found, edge_sets={"crease:crease": chain}, folds={"crease": "mountain"})


def _irregular(rng: np.random.Generator, count: int) -> Array:
    """(count + 1,) parameters from 0 to 1 with steps that differ by up to a factor of three."""
    steps = rng.uniform(0.5, 1.5, count)
    return np.concatenate(([0.0], np.cumsum(steps)[:-1] / steps.sum(), [1.0]))


def _delaunay(flat: Array) -> Ints:
    """Delaunay triangles without those that rounding leaves on straight edges."""
    found = Delaunay(flat).simplices.astype(np.int64)
    a, b, c = (flat[found[:, i]] for i in range(3))
    doubled = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    kept: Ints = found[doubled > 1e-9 * doubled.max()]
    return kept


def _counter_clockwise(xy: Array, triangles: Ints) -> Ints:
    a, b, c = (xy[triangles[:, i]] for i in range(3))
    turned = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] < 0.0
    return np.where(turned[:, None], triangles[:, ::-1], triangles)


def worst_aspect(mesh: SheetMesh) -> float:
    """Largest ratio of the longest edge of a triangle to the height on it."""
    x = mesh.points[mesh.triangles]
    longest = np.max([np.linalg.norm(x[:, i] - x[:, i - 1], axis=1) for i in range(3)], axis=0)
    return float((0.5 * longest**2 / mesh.areas).max())


def random_meshes(result: CaseResult) -> None:
    """Sixteen of them, held and spring creases, folded to 90 degrees or by as much of a rest angle."""
    rng = np.random.default_rng(SEED)
    aspects, iterations = [], []
    for index in range(MESHES):
        slender = float(10.0 ** rng.uniform(0.0, 1.7))
        mesh = random_mesh(SEED + index, slender)
        fold: dict[str, Any] = (
            {"to": 0.5 * math.pi} if index % 2 == 0 else {"rest": 0.5 * math.pi, "Lstar": 10.0}
        )
        model = Model(mesh, Sheet(E=4000.0, t=0.127), formulation="bars-and-hinges", contact=False).fold(
            "crease", **fold
        )
        path = trace(model, neighbours=False)
        fine = trace(model, strategy=FINE, neighbours=False)
        aspect = worst_aspect(mesh)
        result.check(
            "random mesh: total energy",
            path[-1].energy.total,
            unit="N mm",
            reference=fine[-1].energy.total,
            source="four times finer increments",
            tolerance=1e-6,
            params={
                "index": index,
                "slender": round(slender, 2),
                "worst_aspect": round(aspect, 1),
                "crease": "held" if "to" in fold else "spring",
            },
            path=path,
        )
        aspects.append(aspect)
        iterations.append(float(path.iterations))
    result.check("random mesh: worst triangle, longest edge over height", max(aspects), source="reported")
    result.plots.append(
        plot(
            "hard-random",
            "Random meshes",
            "worst triangle, longest edge over height",
            "iterations from flat to 90 degrees",
            [line("scene", aspects, iterations, "points")],
            "Delaunay meshes of random points, default settings.",
            log="x",
        )
    )
