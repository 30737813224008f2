"""Case `fig5_10` (source 5.4.2): does the stiffness of the sheet matter to a pinch of three creases?"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from bh import Sheet
from verification.framework.checks import CaseResult, Context
from verification.studies.ch5.pinching import (
    NEARLY,
    SHEET,
    WAYS,
    Pinched,
    Stiffness,
    Way,
    angle_plots,
    pinched,
    reached,
)

STIFFNESS = (250.0, 500.0, 1000.0, 1500.0, 2000.0, 3000.0, 4000.0)  # E t^3, N mm
CURVATURES = (0.0, 0.005, 0.01)  # 1/mm
SOURCE = "source 5.4.2, Fig. 5.10"
PRINTED = (9.80, 9.93)  # %, bending and twist
# of the pinch, which the source does not print: its length (mm), and cells along the creases
ZONES, ALONG = (4.0, 6.0, 10.0, 20.0, 30.0), (50, 100)
LEAST = 0.3  # degrees: changes of a twist that is next to nothing say nothing
Found = dict[tuple[str, tuple[int, int], float, float], Pinched]


def run(context: Context) -> CaseResult:
    """The thickness goes with the stiffness; both formulations, two meshes."""
    result = CaseResult(
        name="fig5_10",
        title="Pinched sheets of different stiffness",
        question="How do bending and twisting of a pinched sheet with three creases depend on its stiffness?",
        source=SOURCE,
    )
    found: Found = {}
    for way in WAYS:
        for mesh in way.taken(context.quick):
            context.tell(f"fig5_10: {way.name}, {mesh[0]} x {mesh[1]}")
            for s in STIFFNESS:
                for k in CURVATURES:
                    found[way.name, mesh, s, k] = pinched(
                        way, mesh, k, 3, stiffness=Stiffness(_sheet(s)), left=NEARLY
                    )
    reached(result, list(found.values()))
    for way in WAYS:
        for mesh in way.taken(context.quick):
            _claims(result, way, mesh, found)
    if not context.quick:
        context.tell("fig5_10: what is not printed")
        _unprinted(result)
    _plots(result, found)
    _notes(result)
    return result


def _unprinted(result: CaseResult) -> None:
    """Lengths and meshes of the pinch within wide ranges: what the change of both angles can be.

    Thickness, L* and the angle that is left are printed, and kept.
    """
    for way in WAYS:
        changes: list[tuple[float, float]] = []
        for zone in ZONES:
            for along in ALONG:
                soft, hard = (
                    pinched(
                        replace(way, zone=zone),
                        (along, 1),
                        0.01,
                        3,
                        stiffness=Stiffness(_sheet(s)),
                        left=NEARLY,
                    )
                    for s in (500.0, 1000.0)
                )
                if soft.reached and hard.reached and abs(hard.twist) > LEAST:
                    bend, twist = soft.bend / hard.bend - 1.0, soft.twist / hard.twist - 1.0
                    changes.append((100.0 * bend, 100.0 * twist))
        params = {"way": way.name, "kappa_0_per_mm": 0.01, "pinches": len(changes)}
        if not changes:
            continue
        nearest = min(changes, key=lambda pair: math.hypot(pair[0] - PRINTED[0], pair[1] - PRINTED[1]))
        for k, name in enumerate(("bending", "twist")):
            values = [pair[k] for pair in changes]
            quantity = f"change of the {name} angle from E t^3 = 1000 to 500 N mm, of all pinches"
            for words, value in (("least", min(values)), ("largest", max(values)), ("nearest", nearest[k])):
                result.check(
                    f"{quantity}: {words}",
                    value,
                    unit="%",
                    source=f"measured; {PRINTED[k]} % is printed",
                    params=params,
                )


def _sheet(stiffness: float) -> Sheet:
    """The sheet with E t^3 = `stiffness`, N mm, by its thickness."""
    return Sheet(E=SHEET.E, t=(stiffness / SHEET.E) ** (1.0 / 3.0))


def _claims(result: CaseResult, way: Way, mesh: tuple[int, int], found: Found) -> None:
    params: dict[str, Any] = {"way": way.name, "along": mesh[0], "rows": mesh[1], "kappa_0_per_mm": 0.01}
    for name, read, printed in (("bending", "bend", PRINTED[0]), ("twist", "twist", PRINTED[1])):
        values = {s: float(getattr(found[way.name, mesh, s, 0.01], read)) for s in STIFFNESS}
        soft = found[way.name, mesh, 500.0, 0.01]
        result.check(
            f"change of the {name} angle from E t^3 = 1000 to 500 N mm",
            100.0 * (values[500.0] / values[1000.0] - 1.0),
            unit="%",
            reference=printed,
            params=params,
            path=soft.path,
        )
        result.check(
            f"change of the {name} angle, E t^3 = 250 over 4000 N mm",
            values[250.0] / values[4000.0],
            source=SOURCE + ": a small effect",
            params=params,
            path=soft.path,
        )
        rising = sorted(values.values(), reverse=True) == list(values.values())
        result.check(f"softer sheets change their {name} angle more", rising, reference=1.0, params=params)


def _plots(result: CaseResult, found: Found) -> None:
    curves = {
        f"{way.name}, kappa_0 = {k:g} /mm": [found[way.name, way.meshes[0], s, k] for s in STIFFNESS]
        for way in WAYS
        for k in CURVATURES
    }
    x = ("E t^3, N mm", STIFFNESS)
    angle_plots(result, "fig5-10", " against stiffness", x, curves, "Three creases, w = 5 mm (Fig. 5.10).")


def _notes(result: CaseResult) -> None:
    def gains(kind: str) -> str:
        return ", ".join(
            f"{c.value:+.1f} % ({c.params['way']}, {c.params['along']} x {c.params['rows']})"
            for c in result.checks
            if c.quantity == f"change of the {kind} angle from E t^3 = 1000 to 500 N mm"
        )

    result.notes.append(
        "From E t^3 = 1000 to 500 N mm at 0.01 /mm the source bends 9.80 % and twists 9.93 % more. Bend: "
        f"{gains('bending')}. Twist: {gains('twist')}. The crease goes with the sheet (L* = 2 mm), so only the "
        "share of stretching can matter, which goes with the square of the thickness."
    )
