"""Case `published`: results of others on creased sheets, by the consistent formulation and by the shell.

One module each. References are derived in `verification.theory`, tolerances were set before the first run of each study.
"""

from __future__ import annotations

from collections.abc import Callable

from verification.framework.checks import CaseResult, Context
from verification.studies.solver.published.angle_section import angle_section
from verification.studies.solver.published.clamped_fold import clamped_fold
from verification.studies.solver.published.cones import cones
from verification.studies.solver.published.ring import ring
from verification.studies.solver.published.sine import sine
from verification.studies.solver.published.turned_clamps import turned_clamps
from verification.studies.solver.published.vee import folded_strip

STUDIES: dict[str, Callable[[CaseResult, Context], None]] = {
    "a folded strip pulled open": folded_strip,
    "a folded strip between turned clamps": clamped_fold,
    "an angle section compressed along its crease": angle_section,
    "a buckled strip snapped by turning its clamps": turned_clamps,
    "sine creases": sine,
    "a closed ring": ring,
    "creased cones": cones,
}


def run(context: Context) -> CaseResult:
    """Every study, one after another."""
    result = CaseResult(
        name="published",
        title="Results of others on creased sheets",
        question="Do the converging models give the closed forms that others found for creased sheets?",
        source="closed forms of others, derived again; each record names its own",
    )
    for name, study in STUDIES.items():
        context.tell(f"published: {name}")
        study(result, context)
    return result
