"""What must not matter: where the sheet lies, its unit of length, and how its nodes and triangles are numbered."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

import meshes
from bh import Model, Sheet, trace
from meshes import SheetMesh
from verification.framework.checks import CaseResult

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
E, T, LSTAR = 4000.0, 0.127, 25.0
SAME = 1e-8


@dataclass(frozen=True, eq=False)
class View:
    """The same sheet as somebody else would describe it.

    A point x (mm) of the sheet becomes `scale` (turn x + shift); node i becomes node `new`[i]. Forces keep their unit,
    so that energies scale with `scale` and E with its inverse square.
    """

    name: str
    turn: Array
    shift: Array
    scale: float = 1.0
    seed: int | None = None

    def mesh(self, mesh: SheetMesh) -> tuple[SheetMesh, Ints]:
        """The mesh seen so, and the new number of every node."""
        points = self.scale * (mesh.points @ self.turn.T + self.shift)
        assert mesh.spans is not None
        seen = replace(mesh, points=points, spans=self.scale * mesh.spans)
        return (seen, np.arange(len(points))) if self.seed is None else renumbered(seen, self.seed)

    def back(self, points: Array, new: Ints) -> Array:
        """Positions in the first numbering, place and unit."""
        return np.asarray((points[new] / self.scale - self.shift) @ self.turn)


def renumbered(mesh: SheetMesh, seed: int) -> tuple[SheetMesh, Ints]:
    """Nodes and triangles in random order, triangles begun at another corner; the new number of every node."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(mesh.points))
    new = np.empty_like(order)
    new[order] = np.arange(len(order))
    triangles = new[mesh.triangles][rng.permutation(len(mesh.triangles))]
    begin = rng.integers(3, size=len(triangles))[:, None]
    triangles = np.take_along_axis(triangles, (np.arange(3) + begin) % 3, axis=1)
    bare = SheetMesh(mesh.points[order], triangles)
    assert mesh.spans is not None
    rows = mesh.topology.find_edges(order[bare.topology.edges])
    sets = {name: new[pairs] for name, pairs in mesh.edge_sets.items()}
    corners = {name: int(new[node]) for name, node in mesh.corners.items()}
    return replace(bare, edge_sets=sets, corners=corners, folds=mesh.folds, spans=mesh.spans[rows]), new


def views() -> Iterator[View]:
    """Turned and moved, in metres, renumbered, and all at once."""
    rng = np.random.default_rng(13)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    shift = 300.0 * rng.normal(size=3)
    here, nowhere = np.eye(3), np.zeros(3)
    yield View("rotated and translated", turn, shift)
    yield View("in metres", here, nowhere, scale=1e-3)
    yield View("renumbered", here, nowhere, seed=1)
    yield View("all of these", turn, shift, scale=1e-3, seed=2)


PLAIN = View("as drawn", np.eye(3), np.zeros(3))


def model(mesh: SheetMesh, view: View, how: str) -> tuple[Model, Ints]:
    """A supported sector that is folded exactly ("held") or by springs ("spring"), then loaded across the fold."""
    seen, new = view.mesh(mesh)
    x, y, z = view.turn.T.tolist()
    sheet = Model(
        seen, Sheet(E=E / view.scale**2, t=T * view.scale), formulation="bars-and-hinges", contact=False
    )
    sheet = sheet.support("corner:inner-start", [x, y, z]).support("corner:outer-start", [y, z])
    sheet = sheet.support("corner:inner-end", [z])
    fold: dict[str, Any] = {"to": 1.5} if how == "held" else {"rest": 1.2, "Lstar": LSTAR * view.scale}
    force = (view.turn @ np.array([2e-3, -1e-3, 3e-3])).tolist()
    return sheet.fold("crease", **fold).force("corner:outer-end", each=force), new


def same_answer(result: CaseResult) -> None:
    """Energies relative to their total, positions relative to the size of the sheet."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, math.pi / 4), along=24)
    for how in ("held", "spring"):
        first = trace(model(mesh, PLAIN, how)[0])
        base = first[-1]
        for view in views():
            seen, new = model(mesh, view, how)
            path = trace(seen)
            other = path[-1]
            total = base.energy.total
            apart = [other.energy.as_dict()[k] / view.scale - v for k, v in base.energy.as_dict().items()]
            params = {"seen": view.name, "crease": how}
            check = partial(result.check, params=params, path=path)
            check(
                "same answer: largest difference of an energy over the total",
                float(np.abs(apart).max()) / total,
                reference=0.0,
                source="invariance",
                tolerance=SAME,
            )
            moved = np.abs(view.back(other.points, new) - base.points).max() / mesh.size
            check(
                "same answer: largest distance of a node over the size",
                moved,
                reference=0.0,
                source="invariance",
                tolerance=SAME,
            )
            check(
                "same answer: iterations more than as drawn",
                path.iterations - first.iterations,
                source="reported",
            )
