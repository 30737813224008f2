"""What the mesh of a model does to the answer of bars and hinges.

They depend on the pattern of the mesh (docs/formulation.md has the measurements): cells that are too long or too short,
right triangles whose diagonals all go one way, triangles that do not follow the rulings, and loads that twist or bend
the sheet in its plane.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bh.formulations.remarks import Remark, folds, loaded, one_row
from bh.model.actuations import Fold
from bh.model.model import Model
from bh.model.pinch import Pinch
from meshes import SheetMesh

BEST = (5.0, 12.0)  # aspect ratios of cells
STRAIGHT = 1e-3  # rad

# Energy of one row of cells over the truth, least and most. "one": a crease of a narrow sector, (a), (d) and free on
# the finest meshes of `bh verify speed_error`; "lifted": of the sector lifted there; the others: `bh verify one_row`
MEASURED: dict[str, dict[str, tuple[float, float]]] = {
    "one": {
        "staggered": (0.994, 1.06),
        "alternating": (1.2, 1.49),
        "one-way": (1.07, 2.08),
        "mirrored": (1.01, 2.05),
    },
    "lifted": {
        "staggered": (40.0, 40.0),
        "alternating": (22.0, 22.0),
        "one-way": (33.0, 33.0),
        "mirrored": (35.0, 35.0),
    },
    "several": {
        "staggered": (1.06, 1.22),
        "alternating": (1.47, 1.85),
        "one-way": (1.08, 1.25),
        "mirrored": (1.08, 1.26),
    },
    "wide": {
        "staggered": (61.0, 61.0),
        "alternating": (116.0, 116.0),
        "one-way": (59.0, 59.0),
        "mirrored": (58.0, 58.0),
    },
    "ring": {
        "staggered": (4.3, 4.3),
        "alternating": (3.9, 3.9),
        "one-way": (5.5, 5.5),
        "mirrored": (5.4, 5.4),
    },
}


def remarks(model: Model) -> tuple[Remark, ...]:
    """What to know of a model that bars and hinges solve; empty where there is nothing to say.

    Returns:
        one remark each.
    """
    looks = (_error, _aspect_ratio, _diagonals, _rows, _rulings, _twisted, _pinched, _tied)
    return tuple(remark for look in looks if (remark := look(model)) is not None)


def _aspect_ratio(model: Model) -> Remark | None:
    alpha, kind = model.mesh.aspect_ratio, model.mesh.kind
    if not folds(model) or np.isnan(alpha) or BEST[0] <= alpha <= BEST[1]:
        return None
    if alpha < BEST[0]:
        cost = "28 % too stiff at 4, more below" if kind == "alternating" else "measured down to 4 only"
        return Remark(
            "aspect-ratio",
            f"cells have the aspect ratio {alpha:.3g}, best is 5 to 12 ({cost}): use more cells along",
        )
    return Remark(
        "aspect-ratio",
        f"cells have the aspect ratio {alpha:.3g}, best is 5 to 12: use fewer cells along, or more rows",
    )


def _diagonals(model: Model) -> Remark | None:
    if not folds(model) or model.mesh.kind not in ("one-way", "mirrored"):
        return None
    return Remark(
        "diagonals",
        f"{model.mesh.kind} diagonals let only half of the hinges turn: with one row of cells bending energies "
        'are up to 1.9 times too large at every density; use kind = "staggered"',
    )


def _rows(model: Model) -> Remark | None:
    mesh = model.mesh
    if (
        not folds(model)
        or mesh.kind not in ("alternating", "one-way", "mirrored")
        or np.isnan(mesh.aspect_ratio)
    ):
        return None
    if one_row(model):
        return None
    return Remark(
        "rows",
        "more rows of right triangles at one aspect ratio do not converge; judge by the aspect ratio, not by "
        'the number of nodes, or use formulation = "consistent"',
    )


def _rulings(model: Model) -> Remark | None:
    if not folds(model) or model.mesh.kind != "gmsh":
        return None
    return Remark(
        "rulings",
        'bars and hinges bend along the edges of the mesh only, and those of kind = "gmsh" follow no rulings: '
        'curved panels come out too stiff; use formulation = "consistent", or draw the rulings and use kind = "drawn"',
    )


def _error(model: Model) -> Remark | None:
    """What energies are off by on this kind of mesh, by the creases that the sheet has."""
    mesh = model.mesh
    if not folds(model):
        return None
    if mesh.kind not in MEASURED["one"]:
        return Remark(
            "creases" if len(mesh.creases) > 1 else "crease",
            f"what bars and hinges are off by on a mesh of this kind ({mesh.kind}) was not measured; on meshes of "
            "the library it was up to 116 times the energy, and nothing in a result tells; "
            'formulation = "consistent" converges',
        )
    if any(_closed(mesh, name) for name in mesh.creases):
        code, what = "ring", f"of a ring {_times('ring', mesh)} (more with shorter cells)"
    elif len(mesh.creases) > 1:
        code, what = "creases", f"of sheets with several creases {_times('several', mesh)}"
    else:
        code = "crease"
        what = (
            f"of narrow sectors {_times('one', mesh)}, of a parabola with wide panels {_times('wide', mesh)}"
        )
    return Remark(
        code,
        f"with one row of {mesh.kind} bars and hinges the energy {what} was measured, and nothing in a result tells "
        'which; formulation = "consistent" converges',
    )


def _times(group: str, mesh: SheetMesh) -> str:
    low, high = MEASURED[group][mesh.kind]
    return f"{low:.3g} times" if low == high else f"{low:.3g} to {high:.3g} times"


def _closed(mesh: SheetMesh, name: str) -> bool:
    """True if every node of a crease has two of its edges."""
    return bool((np.unique(mesh.crease_edges(name), return_counts=True)[1] == 2).all())


def _twisted(model: Model) -> Remark | None:
    if not loaded(model):
        return None
    alpha, kind = model.mesh.aspect_ratio, model.mesh.kind
    how = (
        "" if np.isnan(alpha) else f" ({(alpha + 1.0 / alpha) ** 2:.3g} times for flat strips of these cells)"
    )
    lifted = ""
    if kind in MEASURED["lifted"]:
        lifted = f"; a folded sector that is lifted at its end had {_times('lifted', model.mesh)} its energy"
    return Remark(
        "loads",
        f"bars and hinges are too stiff in torsion{how} and in bending within the plane (2.95 times with one row)"
        f'{lifted}; where a load twists or pulls the sheet use formulation = "consistent"',
    )


def _pinched(model: Model) -> Remark | None:
    if not any(isinstance(item, Pinch) for step in model.steps for item in step.actuations):
        return None
    return Remark(
        "pinch",
        "a pinch twists the panels beside it, in which bars and hinges are far too stiff (80 times the energy of the "
        'shell, docs/pinching.md): use formulation = "consistent" if its numbers matter',
    )


def _tied(model: Model) -> Remark | None:
    """Creases whose angles are imposed at nodes that tie the angles of both crease edges to each other."""
    mesh = model.mesh
    imposed = [
        item
        for step in model.steps
        for item in step.actuations
        if isinstance(item, Fold) and item.rest is None and item.Lstar is None and item.stiffness is None
    ]
    names = [
        n
        for n in mesh.creases
        if any(item.crease in (n, "all") for item in imposed) and n not in model.creases
    ]
    nodes = [node for name in names for node in tied_nodes(mesh, name)]
    if not nodes:
        return None
    count = len(set(nodes))
    return Remark(
        "four-edges",
        f"{count} node{'' if count == 1 else 's'} of creases with imposed angles (first node {nodes[0]}) have two "
        "edges beside the crease's own, not mirror-symmetric to it: without stretching such a node folds its crease "
        "edges by different angles, so that imposed ones lock the sheet (200 times the energy was measured, or the "
        'path stalls); give the crease a spring (Lstar), take staggered cells, or formulation = "consistent"',
    )


def tied_nodes(mesh: SheetMesh, crease: str) -> list[int]:
    """Nodes inside the sheet where four folds meet, two of them a crease that turns, with no mirror across it.

    Four rigid panels that meet at a node have one motion, which has one angle for each of its four edges: both crease
    edges can have the same angle only if the node is its own mirror image across the line of the others.

    Args:
        mesh: flat.
        crease: its name.

    Returns:
        node indices, in order.
    """
    edges = mesh.topology.edges
    degree = np.bincount(edges.ravel(), minlength=len(mesh.points))
    degree[mesh.topology.boundary.ravel()] = 0
    pairs = mesh.crease_edges(crease)
    ends = np.bincount(pairs.ravel(), minlength=len(mesh.points))
    found = []
    for node in np.flatnonzero((degree == 4) & (ends == 2)).tolist():
        around = edges[(edges == node).any(axis=1)].sum(axis=1) - node
        own = pairs[(pairs == node).any(axis=1)].sum(axis=1) - node
        one, other = (_unit(mesh.points[each] - mesh.points[node]) for each in own)
        if np.linalg.norm(one + other) < STRAIGHT:
            continue
        beside = [_unit(mesh.points[each] - mesh.points[node]) for each in np.setdiff1d(around, own)]
        if any(abs(float(one @ edge) - float(other @ edge)) > STRAIGHT for edge in beside):
            found.append(node)
    return found


def _unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(vector / np.linalg.norm(vector))
