"""The bistable Miura fold and the eggbox under bending of Liu and Paulino (2017), from the data of their program.

Geometry, stiffness, supports and loads are those of its scripts Miura_Bistable and Eggbox_Bending (one diagonal a
panel, the shorter one). Their bars are Ogden's and their hinges stiffen near closure, which `bh` has not; the referee
`verification.studies.solver.dense_origami` follows the same data with the laws of `bh` and with the published ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh import Force, Model, Path, trace
from meshes import SheetMesh
from verification.framework.checks import CaseResult, line, plot
from verification.studies.solver.dense_origami import DenseOrigami, Law
from verification.studies.solver.hard_cases.common import Found, check, located

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Assemblage:
    """A grid of quadrilateral panels as plain arrays, lengths without a unit as published.

    Attributes:
        points: (n, 3); panels: (p, 4); held: (n, 3) True where supported; load: (n, 3) at load factor 1.
        fold, bend: stiffness of hinges between and inside panels, a length; EA of all bars.
        linear: angles between which the published hinges are linear, rad.
    """

    points: Array
    panels: Ints
    held: NDArray[np.bool_]
    load: Array
    fold: float
    bend: float
    EA: float
    linear: tuple[float, float]

    @property
    def mesh(self) -> SheetMesh:
        """Every panel cut along its shorter diagonal; on a tie along the one from its first corner."""
        a, b, c, d = (self.panels[:, i] for i in range(4))
        first = np.linalg.norm(self.points[a] - self.points[c], axis=1)
        second = np.linalg.norm(self.points[b] - self.points[d], axis=1)
        cut = (first > second)[:, None]
        one = np.where(cut, np.column_stack((a, b, d)), np.column_stack((a, b, c)))
        two = np.where(cut, np.column_stack((b, c, d)), np.column_stack((a, c, d)))
        return SheetMesh(self.points, np.stack((one, two), axis=1).reshape(-1, 3))

    def _hinges(self) -> tuple[Ints, Array, Ints]:
        """(m, 4) hinges (edge, edge, wing, wing), their stiffness a length, and all edges."""
        topology = self.mesh.topology
        inside = topology.edge_triangles[topology.hinge_edges] // 2
        stiffness = np.where(inside[:, 0] == inside[:, 1], self.bend, self.fold)
        return topology.hinges[:, [1, 2, 0, 3]], stiffness, topology.edges

    def referee(self, law: Law) -> DenseOrigami:
        hinges, stiffness, edges = self._hinges()
        return DenseOrigami(
            self.points, edges, self.EA, hinges, stiffness, self.held, self.load, law, self.linear
        )

    def model(self, factor: float) -> Model:
        """The same for `bh`, loaded up to `factor`; hinges rest in the given shape, bars are 1/2 EA / L (l - L)^2."""
        hinges, stiffness, edges = self._hinges()
        x = self.points
        lengths = np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1)
        widths = np.linalg.norm(x[hinges[:, 1]] - x[hinges[:, 0]], axis=1)
        nodes = np.flatnonzero(self.held.any(axis=1))
        supports = np.column_stack((nodes, self.held[nodes].astype(int)))
        model = Model.from_arrays(
            x, self.mesh.triangles, edges, self.EA / lengths, hinges, stiffness * widths, [], [], supports
        )
        loaded = np.flatnonzero(np.abs(self.load).any(axis=1)).tolist()
        return model.step(*(Force([node], each=(factor * self.load[node]).tolist()) for node in loaded))


def _panels(columns: int, rows: int) -> Ints:
    """Panels of a grid of nodes that are numbered column by column, rows + 1 in each."""
    corner = np.array([i * (rows + 1) + j for j in range(rows) for i in range(columns)])
    up = rows + 1
    return np.column_stack((corner, corner + up, corner + up + 1, corner + 1))


def miura_bistable() -> Assemblage:
    """A 5 x 5 Miura fold (panel angle 60 degrees, edges 2, fold 30 degrees) pressed down at its middle node."""
    cells, theta, edge, gamma = 5, math.radians(60.0), 2.0, math.radians(30.0)
    root = math.sqrt(1.0 + (math.cos(gamma) * math.tan(theta)) ** 2)
    height, step_x = edge * math.sin(theta) * math.sin(gamma), edge * math.cos(gamma) * math.tan(theta) / root
    step_y, shift = edge * math.sqrt(1.0 - (math.sin(gamma) * math.sin(theta)) ** 2), edge / root
    n = 2 * cells
    i, j = np.repeat(np.arange(n + 1), n + 1), np.tile(np.arange(n + 1), n + 1)
    points = np.column_stack((step_x * i, step_y * j + shift * (i % 2), height * (j % 2)))
    held = np.zeros(points.shape, dtype=bool)
    left = np.arange(2, n + 1, 2)
    right = left + (n + 1) * n
    held[0] = True
    held[left, 0] = held[left, 2] = True
    held[(n + 1) * n, 1:] = True
    held[right, 2] = True
    load = np.zeros(points.shape)
    load[60, 2] = -1.0
    return Assemblage(
        points, _panels(n, n), held, load, 0.1, 1.0, 1e3, (math.radians(45.0), math.radians(315.0))
    )


def eggbox_bending() -> Assemblage:
    """A 5 x 5 eggbox (panel angle 60 degrees, edges 2, 45 degrees) bent by forces at the middle of two of its sides."""
    cells, theta, edge, gamma = 5, math.radians(60.0), 2.0, math.radians(45.0)
    cosine = math.cos(theta) / math.cos(gamma)
    one, two = edge * math.cos(gamma), edge * cosine
    n = 2 * cells
    i, j = np.repeat(np.arange(n + 1), n + 1), np.tile(np.arange(n + 1), n + 1)
    points = np.column_stack(
        (edge * math.sqrt(1.0 - cosine**2) * i, edge * math.sin(gamma) * j, one * (j % 2) + two * (i % 2))
    )
    held = np.zeros(points.shape, dtype=bool)
    for node, axes in ((26, [0, 1, 2]), (28, [0, 2]), (92, [1, 2]), (94, [2])):
        held[node, axes] = True
    load = np.zeros(points.shape)
    load[[5, 115], 2] = -1.0
    return Assemblage(
        points, _panels(n, n), held, load, 0.1, 2.0, 1e3, (math.radians(22.5), math.radians(337.5))
    )


def extremes(load: Array, fall: Array) -> list[tuple[float, float]]:
    """(load, fall) at the limit points of a curve, each from parabolas through three states over chord length."""
    found = []
    for i in np.flatnonzero(np.diff(np.sign(np.diff(load)))) + 1:
        three = slice(i - 1, i + 2)
        steps = np.hypot(np.diff(load[three]), np.diff(fall[three]))
        s = np.array([-steps[0], 0.0, steps[1]])
        rise, way = np.polyfit(s, load[three], 2), np.polyfit(s, fall[three], 2)
        top = -0.5 * rise[1] / rise[0]
        found.append((float(np.polyval(rise, top)), float(np.polyval(way, top))))
    return found


def _published(given: Assemblage, node: int, first: float, upto: float) -> tuple[Array, Array]:
    """Load factors and falls of a node along the path with the published laws, until the load exceeds `upto`."""
    states = [(0.0, 0.0)]
    for lam, u in given.referee("published").follow(first, 200):
        states.append((lam, -float(u[node, 2])))
        if lam > upto:
            break
    return np.array(states).T[0], np.array(states).T[1]


def _refereed(given: Assemblage, path: Path, factor: float, name: str) -> Found:
    """Equilibrium, number of negative eigenvalues and limit points of `bh`, told by the referee."""
    referee, free = given.referee("quadratic"), ~given.held

    def lowest(points: Array) -> float:
        K = referee.stiffness(points - given.points)[np.ix_(free.ravel(), free.ravel())]
        return float(np.linalg.eigvalsh(K)[0])

    worst, wrong = 0.0, 0
    for record, state in zip(path.records[1:], path[1:], strict=True):
        unbalanced = factor * record.lam * given.load - referee.forces(state.points - given.points)
        worst = max(worst, float(np.abs(unbalanced[free]).max()))
        wrong += (lowest(state.points) > 0.0) is not record.stable
    source = "independent dense implementation (Liu and Paulino 2017), laws of bh"
    yield check(
        f"{name}: largest residual of the referee over the load", worst / factor, "", 0.0, source, 1e-6, path
    )
    yield check(
        f"{name}: states whose stability the referee tells otherwise",
        float(wrong),
        "",
        0.0,
        source,
        0.0,
        path,
    )
    begin = lowest(given.points)
    for number, (_, points) in enumerate(located(path, "limit"), 1):
        yield check(f"{name}: lowest eigenvalue at a limit point, over that of the start", lowest(points) / begin, "",
                    0.0, source, 1e-3, path, number=number)  # fmt: skip


def assemblages(result: CaseResult) -> Found:
    """The bistable Miura fold through both its limit points, and the eggbox, whose load only rises."""
    published = (
        "data of Liu and Paulino 2017 (Miura_Bistable), their Ogden bars and hinges, by an independent dense "
        "implementation; bh has 1/2 k (l - L)^2 bars, and no hinge leaves the linear range"
    )
    factor, node = 2.7, 60
    miura = miura_bistable()
    path = trace(miura.model(factor))
    yield from _refereed(miura, path, factor, "bistable Miura")
    load = factor * path.lambdas
    fall = np.array([miura.points[node, 2] - state.points[node, 2] for state in path])
    their_load, their_fall = _published(miura, node, 0.1, factor)
    ours = [(factor * lam, float(miura.points[node, 2] - x[node, 2])) for lam, x in located(path, "limit")]
    theirs = extremes(their_load, their_fall)
    yield check(
        "bistable Miura: limit points", float(len(ours)), "", float(len(theirs)), published, 0.0, path
    )
    for which, (mine, other) in enumerate(zip(ours, theirs, strict=False), 1):
        yield check("bistable Miura: load factor at a limit point", mine[0], "", other[0], published, 0.01, path,
                    number=which)  # fmt: skip
        yield check("bistable Miura: fall of the node at a limit point", mine[1], "mm", other[1], published, 0.02, path,
                    number=which)  # fmt: skip
    result.plots.append(
        plot("hard-miura", "Bistable Miura fold", "fall of the middle node, mm", "load factor",
             [line("bh.trace", fall.tolist(), load.tolist(), "points"),
              line("published laws", their_fall.tolist(), their_load.tolist(), "reference")],
             "5 x 5 cells pressed at the middle node: snap-through and snap-back (Liu and Paulino 2017).")
    )  # fmt: skip
    eggbox, factor, node = eggbox_bending(), 2.6, 5
    path = trace(eggbox.model(factor))
    yield from _refereed(eggbox, path, factor, "eggbox")
    their_load, their_fall = _published(eggbox, node, 0.25, factor)
    source = published.replace("Miura_Bistable", "Eggbox_Bending")
    yield check("eggbox: limit points", float(len(located(path, "limit"))), "",
                float(len(extremes(their_load, their_fall))), source, 0.0, path)  # fmt: skip
    fall_at_end = float(eggbox.points[node, 2] - path[-1].points[node, 2])
    yield check("eggbox: fall of the loaded node", fall_at_end, "mm", float(np.interp(factor, their_load, their_fall)),
                source, 0.01, path, factor=factor)  # fmt: skip
