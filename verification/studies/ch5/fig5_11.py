"""Case `fig5_11` (source 5.4.2): is the bend of a pinched sheet with three creases proportional to their spacing?"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from verification.framework.checks import CaseResult, Context
from verification.studies.ch5.pinching import (
    AS_SOURCE,
    CONVERGED,
    LENGTH,
    NEARLY,
    WAYS,
    Pinched,
    Way,
    add,
    angle_plots,
    pinched,
    proportion,
    reached,
)

SPACINGS = (2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0)  # mm
CURVATURES = (0.0, 0.005, 0.01)  # 1/mm
SOURCE = "source 5.4.2, Fig. 5.11"
# the source does not say whether its cells grew with the spacing; here they stay 1 mm long, so that alpha = spacing
SAME_CELLS = replace(AS_SOURCE, name="as the source, cells of 1 mm", meshes=((100, 1),))
Found = dict[tuple[str, int, float, float], Pinched]


def run(context: Context) -> CaseResult:
    """All spacings at the aspect ratio of the spacing of 5 mm; both formulations, two meshes."""
    result = CaseResult(
        name="fig5_11",
        title="Pinched sheets of different crease spacing",
        question="How do bending and twisting of a pinched sheet with three creases depend on their spacing?",
        source=SOURCE,
    )
    found: Found = {}
    levels = (0,) if context.quick else (0, 1)
    for way in WAYS:
        for level in levels:
            context.tell(f"fig5_11: {way.name}, mesh {level + 1}")
            for w in SPACINGS:
                for k in CURVATURES:
                    found[way.name, level, w, k] = pinched(way, _mesh(way, level, w), k, 3, w, left=NEARLY)
    for w in SPACINGS:
        for k in CURVATURES:
            found[SAME_CELLS.name, 0, w, k] = pinched(SAME_CELLS, (100, 1), k, 3, w, left=NEARLY)
    reached(result, list(found.values()))
    _claims(result, SAME_CELLS, 0, found)
    for way in WAYS:
        for level in levels:
            _claims(result, way, level, found)
    _plots(result, found)
    _notes(result)
    return result


def _mesh(way: Way, level: int, spacing: float) -> tuple[int, int]:
    """Cells along and rows with the aspect ratio that the way has at 5 mm; even, so that a node lies in the middle."""
    along, rows = way.meshes[level]
    alpha = along / rows * 5.0 / LENGTH
    return 2 * round(0.5 * alpha * LENGTH * rows / spacing), rows


def _claims(result: CaseResult, way: Way, level: int, found: Found) -> None:
    for k in CURVATURES:
        at = {w: found[way.name, level, w, k] for w in SPACINGS}
        params: dict[str, Any] = {"way": way.name, "rows": way.meshes[level][1], "kappa_0_per_mm": k}
        for w, p in at.items():
            fine = found.get((way.name, 1, w, k)) if level == 0 else None
            for name, read in (("bending", "bend"), ("twist", "twist")):
                add(result, p, f"change of the {name} angle", float(getattr(p, read)), "deg",
                    None if fine is None else float(getattr(fine, read)), "the finer mesh of this formulation",
                    spacing_mm=w, **params)  # fmt: skip
        if k == 0.0:
            continue
        bend = proportion(SPACINGS, [at[w].bend for w in SPACINGS])
        add(result, None, "bend against spacing, R^2 of proportionality", bend.r2, "", 1.0, SOURCE + ": proportional",
            0.05 if way is SAME_CELLS else None, **params)  # fmt: skip
        add(result, None, "bend over spacing", bend.slope, "deg/mm", None, SOURCE, **params)
        rising = [at[w].bend for w in SPACINGS]
        judged = 0.0 if way is not CONVERGED and level == 0 else None
        add(result, None, "bend grows with spacing", float(rising == sorted(rising)), "", 1.0, SOURCE, judged,
            **params)  # fmt: skip
        twist = [abs(at[w].twist) for w in SPACINGS]
        add(result, None, "twist at 8 mm over that at 2 mm", twist[-1] / twist[0], "", None,
            SOURCE + ": grows less than in proportion (4)", **params)  # fmt: skip


def _plots(result: CaseResult, found: Found) -> None:
    curves = {
        f"{way.name}, kappa_0 = {k:g} /mm": [found[way.name, 0, w, k] for w in SPACINGS]
        for way in (*WAYS, SAME_CELLS)
        for k in CURVATURES[::2]
    }
    x = ("spacing, mm", SPACINGS)
    angle_plots(result, "fig5-11", " against spacing", x, curves, "Three creases, t = 0.5 mm (Fig. 5.11).")


def _notes(result: CaseResult) -> None:
    def of(quantity: str) -> str:
        return "; ".join(
            f"{c.params['way']}, {c.params['rows']} rows, {c.params['kappa_0_per_mm']} /mm: {c.value:.3g}"
            for c in result.checks
            if c.quantity == quantity
        )

    result.notes.append(
        f"R^2 of bend = constant times spacing: {of('bend against spacing, R^2 of proportionality')}."
    )
    result.notes.append(
        "Proportional it is only where the cells stay 1 mm long while the panels grow wider: then the aspect "
        "ratio is the spacing, the excess of torsion (alpha + 1/alpha)^2 grows tenfold from 2 to 8 mm, and the "
        "pinch reaches so much farther. At one aspect ratio the bend of bars and hinges is a straight line that "
        "does not begin at nothing. The converged sheet bends less where the spacing is larger: the zone is short "
        "against the panels, which then stretch rather than follow."
    )
