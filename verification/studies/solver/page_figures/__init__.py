"""Case `page_figures`: figures that pages of the documentation print and that no other case makes.

Nothing is judged here: the pages say what each figure is for, and their links lead to the record of this case.
"""

from __future__ import annotations

from collections.abc import Callable

from verification.framework.checks import CaseResult, Context
from verification.studies.solver.page_figures.calibration import calibration
from verification.studies.solver.page_figures.contact import touches
from verification.studies.solver.page_figures.drawing import drawings
from verification.studies.solver.page_figures.materials import grains, stresses, wide_creases
from verification.studies.solver.page_figures.pinching import pinches
from verification.studies.solver.page_figures.strips import couples, membranes, pressures, responses, sectors

STUDIES: dict[str, Callable[[CaseResult, bool], None]] = {
    "strips bent in their plane": membranes,
    "meshes of App. B (a)": sectors,
    "grain": grains,
    "stresses of a bent strip": stresses,
    "wide creases": wide_creases,
    "stiffness, buckling and response": responses,
    "pressure at a free edge": pressures,
    "couples": couples,
    "moulds and a crushed corrugation": touches,
    "calibration": calibration,
    "pinches": pinches,
    "drawings": drawings,
}


def run(context: Context) -> CaseResult:
    """Every study, one after another."""
    result = CaseResult(
        name="page_figures",
        title="Figures of the pages",
        question="What do the examples and the small comparisons of the documentation come to?",
        source="the shell, closed forms or finer meshes; each record names its own",
    )
    for name, study in STUDIES.items():
        context.tell(f"page_figures: {name}")
        study(result, context.quick)
    result.notes.append(
        "Each figure is printed on a page of the documentation, which says what it is for. None has a tolerance: what "
        "must not change has a test or a case of its own."
    )
    return result
