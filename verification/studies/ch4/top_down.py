"""Cases `top_down` and `bottom_up` (source 4.4): second moments of area of the five folded corrugations."""

from __future__ import annotations

import math

import numpy as np

from bh.applications.corrugation.folding import POLYESTER, Folded
from bh.applications.corrugation.sections import BottomUp, bottom_up, section_moments, top_down
from verification.framework.checks import CaseResult, Check, Context, line, plot
from verification.studies.ch4.corrugations import AZIMUTHS, EDGE, ORDER, POINT, RATIOS, folded, in_order

MESHES = (("bars-and-hinges", 36, 1), ("consistent", 40, 2))
SPAN = 50.0  # mm, between the supports


def run(context: Context) -> CaseResult:
    """Sections in all directions."""
    source = "source 4.4.1, Fig. 4.4"
    result = CaseResult(
        "top_down", "Second moments of folded corrugations, from sections",
        "How does the mean second moment of the sections depend on direction and pattern?", source,
    )  # fmt: skip
    count = 40 if context.quick else 100
    for formulation, along, rows in MESHES[: 1 if context.quick else 2]:
        params: dict[str, object] = {"formulation": formulation, "along": along, "rows": rows}
        ratios: dict[str, float] = {}
        for kind in ORDER:
            context.tell(f"top_down: {kind}, {formulation}")
            sheet = folded(kind, formulation, along, rows)
            values = {name: top_down(sheet, azimuth, count) for name, azimuth in AZIMUTHS.items()}
            ratios[kind] = values["x"] / values["y"]
            for name, value in values.items():
                exact, tolerance = _exact(kind, name)
                _add(result, f"mean second moment about {name}", value, "mm^4", exact, source, tolerance,
                     {**params, "kind": kind})  # fmt: skip
            _add(result, "I_x / I_y beside the measured k_x / k_y", ratios[kind], "", RATIOS[kind],
                 "source 4.5.2 (stiffness, measured)", None, {**params, "kind": kind})  # fmt: skip
        _order(result, ratios, params, source)
        if formulation == "bars-and-hinges":
            _polar(result, count)
    result.notes.append(
        "The planes are vertical, the depth is laid level (docs/corrugations.md). The ratios order the patterns as the "
        "tests do where both sides of a pair differ by more than the two point patterns."
    )
    return result


def run_bottom_up(context: Context) -> CaseResult:
    """Unit sections at every mountain bar between the supports."""
    source = "source 4.4.2, Fig. 4.5, Eq. 4.17-4.20"
    result = CaseResult(
        "bottom_up", "Second moments of folded corrugations, from their mountain creases",
        "What do the unit sections at the mountain creases add up to, and do they order the patterns alike?", source,
    )  # fmt: skip
    for formulation, along, rows in MESHES[: 1 if context.quick else 2]:
        params: dict[str, object] = {"formulation": formulation, "along": along, "rows": rows}
        ratios: dict[str, float] = {}
        for kind in ORDER:
            context.tell(f"bottom_up: {kind}, {formulation}")
            sheet = folded(kind, formulation, along, rows)
            whole = bottom_up(sheet)
            values = {name: between(sheet, azimuth).about(azimuth) for name, azimuth in AZIMUTHS.items()}
            ratios[kind] = values["x"] / values["y"]
            exact = _unit() if kind == "straight" else None
            for name, value in values.items():
                wanted = None if exact is None else exact * abs(math.sin(AZIMUTHS[name]))
                _add(result, f"I_loc about {name}, between the supports", value, "mm^4", wanted, source,
                     None if wanted is None else 1e-3, {**params, "kind": kind})  # fmt: skip
            _add(
                result,
                "I_loc,x of the whole sheet",
                whole.x,
                "mm^4",
                None,
                source,
                None,
                {**params, "kind": kind},
            )
            _add(
                result,
                "I_loc,y of the whole sheet",
                whole.y,
                "mm^4",
                None,
                source,
                None,
                {**params, "kind": kind},
            )
            _add(result, "bars without a valley on both sides", float(whole.skipped), "", None, source, None,
                 {**params, "kind": kind})  # fmt: skip
        _order(result, ratios, params, source)
    result.notes.append(
        "Bars of mountain creases whose two nodes lie over the supports of the tests (more than 25 mm from the middle) "
        "are left out, for each direction of bending; edges of the sheet count as valleys where they come first."
    )
    return result


def between(sheet: Folded, azimuth: float) -> BottomUp:
    """Unit sections of the part between the supports."""
    s = sheet.points @ np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    return bottom_up(sheet, np.abs(s - 0.5 * (s.min() + s.max())) > 0.5 * SPAN)


def _add(
    result: CaseResult, quantity: str, value: float, unit: str, reference: float | None, source: str,
    tolerance: float | None, params: dict[str, object],
) -> None:  # fmt: skip
    result.checks.append(Check(result.name, quantity, params, value, unit, reference, source, tolerance))


def _exact(kind: str, name: str) -> tuple[float | None, float | None]:
    """What the straight one must have: bare sheet about x, five slanted rectangles about y."""
    t = POLYESTER.t
    if kind != "straight" or name == "xy":
        return None, None
    if name == "x":
        return 100.0 * t**3 / 12.0, 1e-5
    return 5.0 * 20.0 * t / 12.0 * (36.0 + t**2 * (1.0 - 0.3**2)), 1e-3


def _unit() -> float:
    """Unit section of the straight one: two rectangles 20 mm long and 6 mm deep, mm^4."""
    t = POLYESTER.t
    return 2.0 * 20.0 * t / 12.0 * (36.0 + t**2 * (1.0 - 0.3**2))


def _order(result: CaseResult, ratios: dict[str, float], params: dict[str, object], source: str) -> None:
    _add(result, "pairs of ten in the order of the measured ratios", float(in_order(ratios)), "", 10.0,
         "source 4.5.2", None, params)  # fmt: skip
    lowest = all(ratios["straight"] < ratios[kind] for kind in ORDER[1:])
    _add(result, "straight has the lowest ratio", float(lowest), "", 1.0, source, 0.0, params)
    edges = min(ratios[kind] for kind in EDGE) > max(ratios[kind] for kind in POINT)
    _add(
        result,
        "edge patterns have higher ratios than point patterns",
        float(edges),
        "",
        1.0,
        source,
        None,
        params,
    )


def _polar(result: CaseResult, count: int) -> None:
    """Fig. 4.4 (d): I cos, I sin over all directions."""
    azimuths = np.linspace(0.0, 2.0 * math.pi, 49)
    series = []
    for kind in ORDER:
        sheet = folded(kind, "bars-and-hinges", 36, 1)
        half = [section_moments(sheet, float(a), max(count // 2, 20)).mean() for a in azimuths[:25]]
        radius = np.array([*half, *half[1:]])
        series.append(line(kind, (radius * np.cos(azimuths)).tolist(), (radius * np.sin(azimuths)).tolist()))
    result.plots.append(
        plot("polar", "Mean second moment by direction", "I cos(azimuth) (mm^4)", "I sin(azimuth) (mm^4)", series,
             "Distance from the origin: mean second moment for bending about that axis (Fig. 4.4 d).")
    )  # fmt: skip
