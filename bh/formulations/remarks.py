"""What the mesh of a model does to the answer, before anything is solved: remarks, never errors.

Bars and hinges depend on the pattern of their mesh (docs/formulation.md has the measurements): cells that are too long
or too short, right triangles whose diagonals all go one way, triangles that do not follow the rulings, and loads that
twist or bend the sheet in its plane are told. The shell has no such trouble.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bh.model.actuations import Displace, Force, Pinch

if TYPE_CHECKING:
    from bh.model.model import Model

BEST = (5.0, 12.0)  # aspect ratios of cells


@dataclass(frozen=True)
class Remark:
    """One line of `text` for people, and its `code` for programs.

    Codes are "aspect-ratio", "diagonals", "rows", "rulings", "loads", "pinch" and "drawing" (what was read into a
    drawing).
    """

    code: str
    text: str

    def __str__(self) -> str:
        return self.text


def remarks(model: Model) -> tuple[Remark, ...]:
    """What to know about the mesh of a model with its formulation; empty where there is nothing to say."""
    if model.formulation == "bars-and-hinges":
        found = [_aspect_ratio(model), _diagonals(model), _rows(model), _rulings(model), _twisted(model)]
        found.append(_pinched(model))
    elif model.formulation == "consistent":
        found = [_stretched(model)]
    else:
        found = []
    drawn = [Remark("drawing", text) for text in model.mesh.remarks]
    return (*drawn, *(remark for remark in found if remark is not None))


def _aspect_ratio(model: Model) -> Remark | None:
    alpha, kind = model.mesh.aspect_ratio, model.mesh.kind
    if not _folds(model) or np.isnan(alpha) or BEST[0] <= alpha <= BEST[1]:
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
    if not _folds(model) or model.mesh.kind not in ("one-way", "mirrored"):
        return None
    return Remark(
        "diagonals",
        f"{model.mesh.kind} diagonals let only half of the hinges turn: with one row of cells bending energies "
        'are up to 1.9 times too large at every density; use kind = "staggered"',
    )


def _rows(model: Model) -> Remark | None:
    mesh = model.mesh
    if (
        not _folds(model)
        or mesh.kind not in ("alternating", "one-way", "mirrored")
        or np.isnan(mesh.aspect_ratio)
    ):
        return None
    if _one_row(model):
        return None
    return Remark(
        "rows",
        "more rows of right triangles at one aspect ratio do not converge; judge by the aspect ratio, not by "
        'the number of nodes, or use formulation = "consistent"',
    )


def _rulings(model: Model) -> Remark | None:
    if not _folds(model) or model.mesh.kind != "gmsh":
        return None
    return Remark(
        "rulings",
        'bars and hinges bend along the edges of the mesh only, and those of kind = "gmsh" follow no rulings: '
        'curved panels come out too stiff; use formulation = "consistent", or draw the rulings and use kind = "drawn"',
    )


def _twisted(model: Model) -> Remark | None:
    if not _loaded(model):
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
    if not any(isinstance(item, Pinch) for step in model.steps for item in step):
        return None
    return Remark(
        "pinch",
        "a pinch twists the panels beside it, in which bars and hinges are far too stiff (80 times the energy of the "
        'shell, docs/pinching.md): use formulation = "consistent" if its numbers matter',
    )


def _stretched(model: Model) -> Remark | None:
    if not _loaded(model) or np.isnan(model.mesh.aspect_ratio) or not _one_row(model):
        return None
    return Remark(
        "loads",
        "triangles of one strain are too stiff in bending within the plane (4.4, 1.9, 1.2, 1.05 times with 1, 2, "
        "4, 8 rows): where a load pulls the folded sheet use rows",
    )


def _one_row(model: Model) -> bool:
    """True if every node lies on an edge or a crease."""
    mesh = model.mesh
    rim = np.zeros(len(mesh.points), dtype=bool)
    rim[mesh.topology.boundary] = True
    for crease in mesh.creases:
        rim[mesh.crease_edges(crease)] = True
    return bool(rim.all())


def _folds(model: Model) -> bool:
    return bool(model.mesh.creases)


def _loaded(model: Model) -> bool:
    return any(isinstance(item, Force | Displace) for step in model.steps for item in step)
