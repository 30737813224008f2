"""How a sheet without supports is held, and which of its creases are folded."""

from __future__ import annotations

import math

import numpy as np

from bh.loading.load_step import crease_hinges
from bh.model.model import Model, drawn_flat
from meshes import SheetMesh
from meshes.topology import dihedral_angles


def held(model: Model) -> Model:
    """The model held at three nodes of the triangle nearest to the middle of the sheet: six rigid motions, no more.

    Args:
        model: of a sheet without supports.

    Returns:
        the same with three supports.
    """
    mesh = model.mesh
    corners = mesh.points[mesh.triangles]
    middle = mesh.points.mean(axis=0)
    nearest = int(np.argmin(np.linalg.norm(corners.mean(axis=1) - middle, axis=1)))
    a, b, c = mesh.triangles[nearest].tolist()
    along = mesh.points[b] - mesh.points[a]
    along /= np.linalg.norm(along)
    normal = np.cross(along, mesh.points[c] - mesh.points[a])
    normal /= np.linalg.norm(normal)
    across = np.cross(normal, along)
    model = model.support([a], "xyz").support([b], [across.tolist(), normal.tolist()])
    return model.support([c], [normal.tolist()])


def chains(mesh: SheetMesh, names: list[str]) -> list[str]:
    """Creases that cover every creased edge once, those of fewest edges first: FOLD files have several names for one.

    Args:
        mesh: of the sheet.
        names: to choose from.

    Returns:
        some of them, in the same order.
    """
    found: list[str] = []
    seen: set[tuple[int, int]] = set()
    for name in sorted(names, key=lambda each: len(mesh.crease_edges(each))):
        edges = {(min(a, b), max(a, b)) for a, b in np.asarray(mesh.crease_edges(name)).tolist()}
        if not edges & seen:
            found.append(name)
            seen |= edges
    return [name for name in names if name in found]


def handled(mesh: SheetMesh) -> list[str]:
    """Names of the creases that a hand folds: chains that are drawn to be folded, and wide creases by their own names.

    Args:
        mesh: of the sheet.

    Returns:
        chains first.
    """
    drawn = [name for name in mesh.creases if mesh.folds.get(name) != "flat"]
    return [*chains(mesh, drawn), *mesh.wide_creases]


def drawn_folds(mesh: SheetMesh, names: list[str]) -> dict[str, float]:
    """Fold angles that creases have in the mesh as it is drawn, which a FOLD file may give folded.

    Args:
        mesh: of the sheet.
        names: of creases.

    Returns:
        mean angle by name, rad, positive the way that each is drawn; 0 where the mesh is flat.
    """
    if drawn_flat(mesh):
        return dict.fromkeys(names, 0.0)
    angles = math.pi - dihedral_angles(mesh.points, mesh.topology.hinges)
    return {name: mesh.sense(name) * float(angles[crease_hinges(mesh, name)].mean()) for name in names}
