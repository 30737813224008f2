"""What is to be known of a model before anything is solved: remarks, never errors, and what most of them look at.

Each formulation says its own (`Formulation.remarks`); `bh.formulations.registry.remarks` collects them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bh.model.actuations import Displace, Force
from bh.model.model import Model


@dataclass(frozen=True)
class Remark:
    """One line of `text` for people, and its `code` for programs.

    Codes are "crease", "creases", "ring", "aspect-ratio", "diagonals", "rows", "rulings", "loads", "pinch" and
    "drawing" (what was read into a drawing); a formulation may have others.
    """

    code: str
    text: str

    def __str__(self) -> str:
        """The text alone."""
        return self.text


def one_row(model: Model) -> bool:
    """True if every node of the mesh lies on an edge of the sheet or on a crease."""
    mesh = model.mesh
    rim = np.zeros(len(mesh.points), dtype=bool)
    rim[mesh.topology.boundary] = True
    for crease in mesh.creases:
        rim[mesh.crease_edges(crease)] = True
    return bool(rim.all())


def folds(model: Model) -> bool:
    """True if the sheet has creases."""
    return bool(model.mesh.creases)


def loaded(model: Model) -> bool:
    """True if a step has forces or prescribed displacements."""
    return any(isinstance(item, Force | Displace) for step in model.steps for item in step.actuations)
