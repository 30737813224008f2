"""Case `one_row`: what one row of cells is off by, in sheets of several creases, wide panels and rings.

Energies of bars and hinges, as the source meshes its sheets, and of the consistent formulation on the same cells, over
those of the consistent formulation on four to eight rows. `bh.remarks` tells the figures of bars and hinges.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import meshes
from bh import Model, Sheet, trace
from bh.mechanics.bars_and_hinges.remarks import MEASURED
from meshes import CreasePattern
from verification.framework.checks import CaseResult, Context

KINDS = ("staggered", "alternating", "one-way", "mirrored")
ALPHA = 8.0  # aspect ratio of the cells, as the source advises
SPREAD = 0.03  # of what is told, which is rounded
SHEET = Sheet(E=4000.0, t=0.2)


@dataclass(frozen=True)
class Scene:
    """A sheet to fold.

    Attributes:
        name: for the record.
        group: what `bh.remarks` counts it as, a key of `MEASURED`.
        pattern: of the creases.
        fold: what is done to it.
        refined: cells along the creases, and rows, of the mesh that is the truth.
        along: cells along the creases of one row, or None for `ALPHA`.
    """

    name: str
    group: str
    pattern: CreasePattern
    fold: Callable[[Model], Model]
    refined: tuple[int, int]
    along: int | None = None

    def energy(self, formulation: str, along: int | None, rows: int, kind: str) -> float | None:
        """N mm in the sheet; None where the fold is not reached."""
        size = {"aspect_ratio": ALPHA} if along is None else {"along": along}
        mesh = meshes.structured(self.pattern, rows=rows, kind=kind, **size)  # type: ignore[arg-type]
        path = trace(self.fold(Model(mesh, SHEET, formulation=formulation, contact=False)))
        energy = path[-1].energy
        return energy.stretching + energy.bending if path.reached else None


def _springs(model: Model) -> Model:
    return model.fold("all", by=0.8, Lstar=25.0)


def scenes() -> tuple[Scene, ...]:
    """Several creases side by side, a sheet with one parabola, a ring."""
    folds = ["mountain", "valley", "mountain"]
    narrow = meshes.annulus_sector([100.0, 110.0, 120.0], 10.0, 0.8, folds)  # type: ignore[arg-type]
    wide = meshes.annulus_sector([100.0, 130.0, 160.0], 30.0, 0.8, folds)  # type: ignore[arg-type]
    waves = meshes.sine_tessellation(creases=3, amplitude=6.0, waves=1.5)
    parabola = meshes.parabolic_canopy(creases=1, sag=30.0)
    ring = meshes.full_annulus(100.0, 10.0)
    return (
        Scene("three narrow arcs", "several", narrow, _springs, (64, 8)),
        Scene("three wide arcs", "several", wide, _springs, (32, 8)),
        Scene("three waves", "several", waves, _springs, (48, 8)),
        Scene("one parabola, wide panels", "wide", parabola, lambda m: m.fold("all", by=0.8), (48, 8)),
        Scene(
            "ring, folded by 30 degrees", "ring", ring, lambda m: m.fold("crease", by=0.5236), (128, 4), 90
        ),
    )


def run(context: Context) -> CaseResult:
    """All mesh patterns with bars and hinges, staggered cells with the consistent formulation."""
    result = CaseResult(
        name="one_row",
        title="One row of cells",
        question="What is one row of cells off by where there are several creases, wide panels or rings?",
        source="consistent formulation, refined",
    )
    for scene in scenes()[1:4] if context.quick else scenes():
        context.tell(f"one_row: {scene.name}")
        truth = scene.energy("consistent", *scene.refined, "staggered")
        for formulation, kind in (
            *(("bars-and-hinges", kind) for kind in KINDS),
            ("consistent", "staggered"),
        ):
            found = scene.energy(formulation, scene.along, 1, kind)
            params = {"scene": scene.name, "formulation": formulation, "mesh": kind}
            if truth is None or found is None:
                result.notes.append(f"{scene.name}, {formulation}, {kind}: the fold was not reached.")
                continue
            ratio = found / truth
            result.check("energy of one row over that of the refined sheet", ratio, params=params)
            if formulation == "bars-and-hinges":
                low, high = MEASURED[scene.group][kind]
                result.check(
                    "it is within what bh.remarks tells",
                    (1.0 - SPREAD) * low <= ratio <= (1.0 + SPREAD) * high,
                    reference=1.0,
                    source="bh.remarks",
                    tolerance=0.0,
                    params=params,
                )
    return result
