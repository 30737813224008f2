"""What the mesh of a model does to the answer of bars and hinges.

They depend on the pattern of the mesh (docs/formulation.md has the measurements): cells that are too long or too short,
right triangles whose diagonals all go one way, triangles that do not follow the rulings, and loads that twist or bend
the sheet in its plane.
"""

from __future__ import annotations

import numpy as np

from bh.formulations.remarks import Remark, folds, loaded, one_row
from bh.model.model import Model
from bh.model.pinch import Pinch

BEST = (5.0, 12.0)  # aspect ratios of cells


def remarks(model: Model) -> tuple[Remark, ...]:
    """What to know of a model that bars and hinges solve; empty where there is nothing to say.

    Returns:
        one remark each.
    """
    looks = (_aspect_ratio, _diagonals, _rows, _rulings, _twisted, _pinched)
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


def _twisted(model: Model) -> Remark | None:
    if not loaded(model):
        return None
    alpha = model.mesh.aspect_ratio
    how = (
        "" if np.isnan(alpha) else f" ({(alpha + 1.0 / alpha) ** 2:.3g} times for flat strips of these cells)"
    )
    return Remark(
        "loads",
        f"bars and hinges are too stiff in torsion{how} and in bending within the plane (2.95 times with one row); "
        'where a load twists or pulls the sheet use formulation = "consistent"',
    )


def _pinched(model: Model) -> Remark | None:
    if not any(isinstance(item, Pinch) for step in model.steps for item in step.actuations):
        return None
    return Remark(
        "pinch",
        "a pinch twists the panels beside it, in which bars and hinges are far too stiff (80 times the energy of the "
        'shell, docs/pinching.md): use formulation = "consistent" if its numbers matter',
    )
