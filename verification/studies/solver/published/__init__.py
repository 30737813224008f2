"""Case `published`: results of others on creased sheets, by the consistent formulation and by the shell.

One module each. References are derived in `verification.theory`, tolerances were set before the first run of
each study; where a set-up was changed after first results, a note of the case says so. A quick run leaves out
what needs the finest meshes.
"""

from __future__ import annotations

from collections.abc import Callable

from verification.framework.checks import CaseResult, Context
from verification.studies.solver.published.angle_section import compressed_section
from verification.studies.solver.published.clamped_fold import folded_between_clamps
from verification.studies.solver.published.ring import closed_ring
from verification.studies.solver.published.sine import sine_creases
from verification.studies.solver.published.turned_clamps import snapping_strip
from verification.studies.solver.published.vee import folded_strip

STUDIES: dict[str, Callable[[CaseResult, Context], None]] = {
    "a folded strip pulled open": folded_strip,
    "a folded strip between turned clamps": folded_between_clamps,
    "an angle section compressed along its crease": compressed_section,
    "a buckled strip snapped by turning its clamps": snapping_strip,
    "sine creases": sine_creases,
    "a closed ring": closed_ring,
}
FULL_ONLY = {"a closed ring"}  # its limit takes narrow rings, whose meshes are fine


def run(context: Context) -> CaseResult:
    """Every study, one after another."""
    result = CaseResult(
        name="published",
        title="Results of others on creased sheets",
        question="Do the converging models give the closed forms that others found for creased sheets?",
        source="closed forms of others, derived again; each record names its own",
    )
    for name, study in STUDIES.items():
        if context.quick and name in FULL_ONLY:
            continue
        context.tell(f"published: {name}")
        study(result, context)
    return result
