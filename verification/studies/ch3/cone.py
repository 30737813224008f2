"""Case `cone` (source 3.4.2, Fig. 3.6): an annulus sector folded along its planar crease against a pair of cones."""

from __future__ import annotations

import math
from typing import get_args

import numpy as np
from numpy.typing import NDArray

import meshes
from bh import Model, Path, Sheet, trace
from meshes.cells import Kind
from verification.framework import setups
from verification.framework.checks import CaseResult, Context, line, plot
from verification.theory import cone

RADIUS, WIDTH = 100.0, 10.0  # mm
SHEET = Sheet(E=4000.0, t=0.127)
DIHEDRAL = 0.5 * math.pi
ANGLES = (math.pi / 4, math.pi / 2, 3 * math.pi / 4, math.pi)
ALPHAS = (2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0, 16.0, 20.0)
QUICK_ALPHAS = (2.0, 4.0, 8.0, 12.0)
SOURCE = "Eq. 3.13 integrated: U = 1/2 D theta_a ln(r_o/r_i) cot^2(phi/2)"


def cone_model(
    angle: float,
    alpha: float,
    kind: Kind,
    rows: int = 1,
    formulation: str = "bars-and-hinges",
    sheet: Sheet = SHEET,
) -> Model:
    """The sector with its crease kept in its plane, else free, folded exactly to a right angle."""
    pattern = meshes.annulus_sector(RADIUS, WIDTH, angle)
    mesh = meshes.structured(pattern, aspect_ratio=alpha, rows=rows, kind=kind)
    model = Model(mesh, sheet, formulation=formulation, contact=False)
    model = model.support("crease:crease", "z").support("rigid-body")
    return model.fold("crease", to=DIHEDRAL)


def energy(angle: float, sheet: Sheet = SHEET) -> float:
    """Bending energy of the two cones, N mm."""
    D = sheet.bending_stiffness(nu=0.0)
    return cone.bending_energy(D, angle, RADIUS - WIDTH, RADIUS + WIDTH, DIHEDRAL)


def circle_radius(points: NDArray[np.float64]) -> float:
    """Radius of the circle that fits planar points (k, 3) best (algebraic least squares), mm."""
    centred = points - points.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    x, y = centred @ axes[0], centred @ axes[1]
    A = np.column_stack((2 * x, 2 * y, np.ones_like(x)))
    a, b, c = np.linalg.lstsq(A, x**2 + y**2, rcond=None)[0]
    return float(math.sqrt(c + a * a + b * b))


def run(context: Context) -> CaseResult:
    """Energy ratio and crease radius over aspect ratio, sector angle and mesh pattern."""
    result = CaseResult(
        name="cone",
        title="A folded annulus sector against a cone",
        question="How near is the folded energy to the cone, by aspect ratio, sector angle and mesh pattern?",
        source="source 3.4.2, Fig. 3.6 (f); " + SOURCE,
    )
    alphas = QUICK_ALPHAS if context.quick else ALPHAS
    for angle in ANGLES:
        degrees = math.degrees(angle)
        series = []
        for kind in get_args(Kind):
            context.tell(f"cone: sector {degrees:.0f} degrees, {kind}")
            ratios = []
            for alpha in alphas:
                path = trace(cone_model(angle, alpha, kind))
                ratio = _record(result, path, angle, alpha, kind)
                ratios.append(ratio)
            series.append(line(kind, list(alphas), ratios))
        series.append(line("cone", list(alphas), [1.0] * len(alphas), "reference"))
        result.plots.append(
            plot(
                f"cone-{degrees:.0f}",
                f"Sector of {degrees:.0f} degrees",
                "aspect ratio alpha",
                "U_BH / U_Th",
                series,
                "Energy of the sheet folded to 90 degrees over the energy of the cones.",
            )
        )
    setups.draw(
        result,
        context,
        cone_model(math.pi / 2, 8.0, "staggered"),
        "a sector of 90 degrees at alpha = 8; its crease is kept in its plane",
    )
    _notes(result)
    return result


def _record(result: CaseResult, path: Path, angle: float, alpha: float, kind: str) -> float:
    state = path[-1]
    ratio = state.energy.total / energy(angle)
    params = {
        "angle_deg": round(math.degrees(angle), 6),
        "alpha": alpha,
        "mesh": kind,
        "formulation": "bars-and-hinges",
    }
    # judged where the measured behaviour is that of the cone: staggered rows from alpha 4; the free ends store less
    # than the cone, the more so the shorter the sector
    judged = 0.03 if kind == "staggered" and 4.0 <= alpha <= 12.0 else None
    result.check(
        "energy ratio",
        ratio,
        unit="U_BH / U_Th",
        reference=1.0,
        source=SOURCE,
        tolerance=judged,
        params=params,
        path=path,
    )
    radius = circle_radius(state.crease_points("crease"))
    exact = cone.crease_radius(RADIUS, DIHEDRAL)
    judged = 0.01 if kind == "staggered" and alpha >= 4.0 else None
    result.check(
        "crease radius",
        radius,
        unit="mm",
        reference=exact,
        source="r_f sin(phi/2), Fuchs and Tabachnikov 1999",
        tolerance=judged,
        params=params,
        path=path,
    )
    return ratio if path.reached else float("nan")


def _notes(result: CaseResult) -> None:
    def ratio(kind: str, alpha: float, degrees: float) -> float:
        return next(
            c.value
            for c in result.checks
            if c.quantity == "energy ratio"
            and (c.params["mesh"], c.params["alpha"], c.params["angle_deg"]) == (kind, alpha, degrees)
        )

    values = [ratio("alternating", 8.0, round(math.degrees(a), 6)) for a in ANGLES]
    result.notes.append(
        "The source finds its (alternating) meshes within 10 % of the cone above alpha = 7. With the angle imposed "
        f"exactly they are {100 * (min(values) - 1):.0f} to {100 * (max(values) - 1):.0f} % above at 8 here. "
        "Staggered rows stay within 3 % from alpha 4 to 12. One-way diagonals stay at 1.9 to 2 times the cone at "
        "every density where the angle is imposed, because the boundary polylines keep every cell flat; mirrored ones "
        "begin there and relax towards the cone, the sooner the shorter the sector."
    )
    result.notes.append(
        "The source does not print its four sector angles nor the size of the sheet; these are 45, 90, 135 and 180 "
        "degrees of the sheet of App. B (radius 100, width 10 each side, t = 0.127 mm), nu = 0."
    )
