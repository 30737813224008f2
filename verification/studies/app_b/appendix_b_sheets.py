"""Case `appendix_b_sheets` (source App. B): the folded sheets of (a) and (d) by three formulations, to be turned."""

from __future__ import annotations

import math

from bh import Model
from meshes.cells import Kind
from verification.framework.checks import CaseResult, Context
from verification.framework.folded_frames import by_every_formulation, store
from verification.studies.app_b.shell_folding import sheet_model

CASE = "appendix_b_sheets"
ANGLE = math.pi / 2
TOLERANCE = {False: 0.03, True: 0.06}  # of the shell's energy, the second of quick runs
HOW = {"a": "edges held in height", "d": "four corners held in height"}


def run(context: Context) -> CaseResult:
    """Fold (a) and (d) in equal steps by every formulation; energies at every step against the shell's."""
    result = CaseResult(
        name=CASE,
        title="The sheet of App. B as it folds",
        question="Do the three formulations take the same way from flat to a right angle?",
        source="source App. B, Fig. B.4 (a) and (d); the shell on the same sheet is the reference",
    )
    along = 16 if context.quick else 32
    for actuation, how in HOW.items():
        params = {"actuation": actuation, "along": along}

        def model(formulation: str, rows: int, kind: Kind, actuation: str = actuation) -> Model:
            return sheet_model(actuation, along, rows, formulation=formulation, kind=kind)

        paths = by_every_formulation(
            result, context, f"({actuation})", model, _fold, params, TOLERANCE[context.quick]
        )
        store(
            result,
            context,
            f"{CASE}_{actuation}",
            paths,
            f"App. B ({actuation}), {how}",
            f"App. B ({actuation}), folded by 90 degrees, {how}.",
            f"The creased annulus sector of App. B ({actuation}), folded by 90 degrees",
        )
    result.notes.append(
        "Drag to turn, scroll to come nearer; all models turn together and share one scale of colours, which ends at "
        "the 99th percentile of the last frame. Bars and hinges take Poisson's ratio as 0, the others as 0.38."
    )
    return result


def _fold(model: Model, fraction: float) -> Model:
    return model.fold("crease", to=math.pi - fraction * ANGLE)
