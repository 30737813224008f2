"""What is to be known of a model before anything is solved: remarks, never errors, and what most of them look at.

Each formulation says its own (`Formulation.remarks`); `bh.formulations.registry.remarks` collects them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bh.model.actuations import Displace, Force, Indenter
from bh.model.model import Model


@dataclass(frozen=True)
class Remark:
    """One line of `text` for people, and its `code` for programs.

    Codes are "unlikely" (a number that cannot be meant),
    "crease", "creases", "ring", "aspect-ratio", "diagonals", "rows", "rulings", "loads", "pinch" and
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


SOFT, STIFF = 50.0, 1.2e6  # MPa: below any paper, card or film; diamond
THIN, THICK = 1e-3, 0.2  # mm; of the length of which the square is the sheet's area
FAR = 3.0  # times the size of the sheet


def unlikely(model: Model) -> tuple[Remark, ...]:
    """Numbers that are likely to stand in another unit than is meant.

    Args:
        model: of any formulation.

    Returns:
        a remark each, with the way to write the unit.
    """
    E, t = model.sheet.E, model.sheet.t
    found = []
    if E < SOFT:
        found.append(
            f"E = {E:g} MPa is as soft as rubber, where paper and card have 2000 to 6000 MPa; if GPa are meant "
            f'write E = "{E:g}GPa"'
        )
    if E > STIFF:
        found.append(f'E = {E:g} MPa is stiffer than diamond; if Pa are meant write E = "{E:g}Pa"')
    width = math.sqrt(float(model.mesh.areas.sum()))
    if t > THICK * width:
        found.append(
            f"t = {t:g} mm is no thin sheet any more where the sheet is some {width:.3g} mm wide; thickness is in mm, "
            'or has a unit: t = "0.2mm"'
        )
    if t < THIN:
        found.append(
            f't = {t:g} mm is thinner than any sheet; thickness is in mm: if metres are meant write t = "{t:g}m"'
        )
    for number, step in enumerate(model.steps):
        for item in step.actuations:
            way = (item.by or item.further or 0.0) if isinstance(item, Displace) else 0.0
            if abs(way) > FAR * model.mesh.size:
                times = abs(way) / model.mesh.size
                found.append(
                    f"step {number + 1}: a displacement of {way:g} mm is {times:.3g} times the size of the sheet; "
                    "it is in mm, or has a unit"
                )
            if isinstance(item, Indenter) and max(abs(item.azimuth), abs(item.tilt)) > 2.0 * math.pi:
                found.append(
                    f"step {number + 1}: indenter '{item.name}' is turned by more than 2 pi; angles are radians, "
                    'or have a unit: "60deg"'
                )
    return tuple(Remark("unlikely", text) for text in found)
