"""Fold a corrugation to a depth and lay it down (source Ch. 4). mm, N, rad throughout."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bh.applications.corrugation.folded import Folded, moved_to
from bh.errors import ModelError
from bh.formulations.observables import depth_of
from bh.model.model import Model
from bh.model.sheet import Sheet
from bh.model.until import depth
from bh.paths.path import Path
from bh.solvers.walk import Strategy
from bh.solving.trace import trace
from meshes import CreasePattern, SheetMesh, corrugation, structured

Array = NDArray[np.float64]
# film of the tests (4.5.1); modulus and Poisson's ratio as the source takes them for polyester film in App. B, from
# Lechenault et al. (2014)
POLYESTER = Sheet(E=4000.0, nu=0.38, t=0.381)
LSTAR = 25.0  # mm, as in Ch. 3
SHARPEST = 2.6  # rad, rest angle at which folding gives up


def fold(
    pattern: str | CreasePattern | SheetMesh,
    depth_mm: float = 6.0,
    *,
    sheet: Sheet = POLYESTER,
    Lstar: float = LSTAR,
    along: int = 36,
    rows: int = 2,
    formulation: str = "consistent",
    strategy: Strategy | None = None,
) -> Folded:
    """Fold all creases as drawn, by one rest angle that grows until the corrugation is `depth_mm` deep.

    Args:
        pattern: the name of one of the five patterns of the source, a pattern, or a mesh of one.
        depth_mm: of the folded corrugation, mm.
        sheet: material and thickness.
        Lstar: length scale of the creases, mm (Eq. 3.12).
        along: cells along the creases (`meshes.structured`), unless a mesh is given.
        rows: of cells in a panel, unless a mesh is given.
        formulation: of the model.
        strategy: of `bh.trace`.

    Raises:
        ModelError: it cannot be folded so deep; the message says why.
    """
    mesh = pattern
    if isinstance(mesh, str):
        mesh = corrugation(mesh)
    if isinstance(mesh, CreasePattern):
        mesh = structured(mesh, along=along, rows=rows)
    model = Model(mesh, sheet, formulation=formulation, contact=False).support("rigid-body")
    path = trace(
        model.fold("all", by=SHARPEST, Lstar=Lstar, until=depth(depth_mm)), strategy=strategy, warn=False
    )
    if not path.reached:
        raise ModelError(
            f"the corrugation cannot be folded {depth_mm:g} mm deep ({path.outcome}: {path.reason})"
        )
    return laid(path)


def laid(path: Path) -> Folded:
    """The last state of the path of a free corrugation, moved rigidly so that it lies as `Folded` says.

    Raises:
        ModelError: supports hold the sheet, so that it cannot be moved.
    """
    state = path[-1]
    if not path.solved()[0].constraints.rigid_body:
        raise ModelError("only a free sheet can be laid down; fold it with the rigid-body support alone")
    deep, up = depth_of(state)
    points = state.points
    across = np.array([1.0, 0.0, 0.0]) - up[0] * up
    across /= np.linalg.norm(across)
    turned = points @ np.vstack((across, np.cross(up, across), up)).T
    low = min(
        turned[state.mesh.nodes(f"crease:{name}"), 2].min()
        for name in state.mesh.creases
        if state.mesh.folds[name] == "valley"
    )
    middle = 0.5 * (turned.min(axis=0) + turned.max(axis=0))
    return Folded(moved_to(path, turned - [middle[0], middle[1], low]), deep)
