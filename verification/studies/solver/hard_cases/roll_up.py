"""A strip rolled to a full circle by end moments, against the elastica.

A model knows couples on creases only, so each end has a crease to a handle that cannot turn: a fixed panel at one
end, and at the other a carriage that slides along x. The couple on such a crease does work on the turn of the end and
on nothing else: it is a dead end moment. Both ends stay on the x axis, each turns by pi, and they meet when the circle
is closed.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

import meshes
from bh import Model, Path, trace
from bh.mechanics.bars_and_hinges.stiffness import bending_hinge_stiffness, sheet_bars
from meshes import SheetMesh
from verification.framework.checks import CaseResult, line, plot
from verification.studies.ch3.cone import circle_radius
from verification.studies.solver.hard_cases.common import Found, check
from verification.theory import rolled

Array = NDArray[np.float64]
LENGTH, BREADTH, THICKNESS, MODULUS = 100.0, 10.0, 0.2, 4000.0
EI = MODULUS * BREADTH * THICKNESS**3 / 12.0
CLOSING = 2.0 * math.pi * EI / LENGTH  # end moment that closes the circle, N mm


def strip_elements(mesh: SheetMesh) -> tuple[Array, Array]:
    """Stiffness of the bars of all edges (N/mm) and of all hinges (N mm / rad) of the strip."""
    topology = mesh.topology
    ends = mesh.points[topology.edges]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    sides = topology.edge_triangles
    areas = mesh.areas[sides[:, 0]] + np.where(sides[:, 1] >= 0, mesh.areas[sides[:, 1]], 0.0)
    bars = sheet_bars(MODULUS, THICKNESS, lengths, areas, mesh.spans)
    at = topology.hinge_edges
    return bars, bending_hinge_stiffness(MODULUS, THICKNESS, lengths[at], areas[at])


def roll_model(along: int, moment: float = CLOSING) -> Model:
    """Strip with its two handles and end moments of `moment` (N mm) that bend it downwards."""
    mesh = meshes.structured(meshes.strip(LENGTH, BREADTH), along=along)
    bars, hinges = strip_elements(mesh)
    n = len(mesh.points)
    a, b = (mesh.corners[f"corner:{side}-start"] for side in ("inner", "outer"))
    c, d = (mesh.corners[f"corner:{side}-end"] for side in ("inner", "outer"))
    fixed, wing, carriage = n, n + 1, n + 2
    size = 0.1 * LENGTH
    more = [[0.0, 0.0, size], [LENGTH, 0.0, size], [LENGTH + size, 0.0, 0.0]]
    points = np.vstack((mesh.points, more))
    triangles = np.vstack((mesh.triangles, [[a, b, fixed], [d, c, wing], [wing, c, carriage]]))
    rigid = float(bars.max())
    edges = np.vstack(
        (mesh.topology.edges, [[a, fixed], [b, fixed], [c, wing], [d, wing], [c, carriage], [wing, carriage]])
    )
    stiffness = np.concatenate((bars, [0.0, 0.0, rigid, 0.0, rigid, rigid]))
    bending = np.vstack((mesh.topology.edges[mesh.topology.hinge_edges], [[c, wing]]))
    supports = [[i, 0, 1, 0] for i in range(n + 3)]  # bending in the plane of x and z
    for node, axes in ((a, (1, 3)), (b, (1, 3)), (fixed, (1, 3)), (c, (3,)), (d, (3,)), (carriage, (3,))):
        for axis in axes:
            supports[node][axis] = 1
    model = Model.from_arrays(
        points,
        triangles,
        edges,
        stiffness,
        bending,
        np.append(hinges, 0.0),
        [[a, b], [c, d]],
        [0.0, 0.0],
        supports,
    )
    return model.moment("fold", moment / BREADTH)


def ends(path: Path) -> Array:
    """(states,) distance of the moving end from the other along x, mm."""
    end = np.argmax(path.model.mesh.points[:-3, 0])
    return np.array([state.points[end, 0] for state in path])


def roll_up(result: CaseResult) -> Found:
    """From flat to the closed circle, every state against its arc."""
    series = []
    errors = []
    source = "Euler's elastica: an arc of curvature M / (E I)"
    for along in (16, 32, 64, 128):
        path = trace(roll_model(along))
        strip = path[-1].points[:-3]
        judged = along == 128
        exact = [rolled.chord(LENGTH, rolled.curvature(EI, lam * CLOSING)) for lam in path.lambdas]
        found = ends(path)
        errors.append(float(np.abs(found - exact).max() / LENGTH))
        yield check("roll-up: largest distance of the end from the elastica, over the length", errors[-1], "", 0.0,
                    source, 0.01 if judged else None, path, along=along)  # fmt: skip
        middle = strip[np.abs(path.model.mesh.points[:-3, 1]) < 1e-9]
        yield check("roll-up: radius of the closed circle", circle_radius(middle), "mm", LENGTH / (2.0 * math.pi),
                    source, 0.01 if judged else None, path, along=along)  # fmt: skip
        turn = path[-1].fold_angle("fold") - path[0].fold_angle("fold")
        yield check("roll-up: turn of both ends", float(turn.sum()), "rad", 2.0 * math.pi, source,
                    0.01 if judged else None, path, along=along)  # fmt: skip
        yield check("roll-up: stretching over bending energy", path[-1].energy.stretching / path[-1].energy.bending, "",
                    0.0, "inextensible", 1e-3 if judged else None, path, along=along)  # fmt: skip
        series.append(
            line(
                f"{along} cells", (2.0 * math.pi * path.lambdas).tolist(), (found / LENGTH).tolist(), "points"
            )
        )
    yield check("roll-up: order of that distance in the size of the cells", math.log2(errors[-2] / errors[-1]), "", 2.0,
                source, 0.2)  # fmt: skip
    turns = np.linspace(0.0, 2.0 * math.pi, 100)
    series.append(
        line("elastica", turns.tolist(), [rolled.chord(1.0, t) for t in turns.tolist()], "reference")
    )
    result.plots.append(
        plot("hard-roll-up", "Strip rolled up by end moments", "M L / (E I)", "distance of the ends over the length",
             series, "The ends meet at 2 pi, where the strip is a closed circle.")
    )  # fmt: skip
