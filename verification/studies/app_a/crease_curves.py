"""Curves and panels of folded creases (case `appendix_a`): how fast differences converge, and where generators lie."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bh import Path
from bh.analysis.creases import along, curve_of, panel_generators
from bh.analysis.isometric import generator_angles
from verification.framework.checks import CaseResult

Array = NDArray[np.float64]
Curve = Callable[[Array], tuple[Array, Array, Array]]  # of the length, mm: points, curvature, torsion, 1/mm
COUNTS = (40, 80, 160)  # steps along 80 mm
ORDER, OFF = 4.0, 0.075  # of the differences, and what a rate may be off it, relative
COARSE = "coarse against fine"


def circle(u: Array) -> tuple[Array, Array, Array]:
    """Radius 50 mm."""
    return (
        np.column_stack((50.0 * np.cos(u / 50.0), 50.0 * np.sin(u / 50.0), 0.0 * u)),
        0.0 * u + 0.02,
        0.0 * u,
    )


def helix(u: Array) -> tuple[Array, Array, Array]:
    """Radius 16 mm, rising by 12 mm a radian."""
    points = np.column_stack((16.0 * np.cos(u / 20.0), 16.0 * np.sin(u / 20.0), 0.6 * u))
    return points, 0.0 * u + 0.04, 0.0 * u + 0.03


def parabola(u: Array) -> tuple[Array, Array, Array]:
    """Height 0.02 x^2, by a parameter of which it is no polynomial, as differences of one are exact."""
    x = 20.0 * np.sinh(u / 40.0)
    points = np.column_stack((x, 0.0 * u, 0.02 * x**2))
    return points, 0.04 / (1.0 + (0.04 * x) ** 2) ** 1.5, 0.0 * u


CURVES: dict[str, Curve] = {"circle": circle, "helix": helix, "parabola": parabola}


def even(count: int) -> Array:
    """(count + 1,) parameters at equal steps."""
    return np.linspace(-40.0, 40.0, count + 1)


def halved(count: int) -> Array:
    """(count + 2,) parameters with half a step at both ends, as beside a staggered crease."""
    return 80.0 * np.concatenate(([0.0], (np.arange(count) + 0.5) / count, [1.0])) - 40.0


def rates(result: CaseResult) -> None:
    """Errors of curvature and torsion fall with the fourth power of the step, ends included; ends are the worst."""
    for name, curve in CURVES.items():
        for nodes, at in (("even", even), ("half steps at the ends", halved)):
            errors = np.array([_errors(curve, at(count)) for count in COUNTS])
            fall = np.log2(errors[:-1, :2] / np.where(errors[1:, :2] > 0.0, errors[1:, :2], math.nan))
            for i, what in enumerate(("curvature", "torsion") if name == "helix" else ("curvature",)):
                for j, count in enumerate(COUNTS[:-1]):
                    result.check(
                        f"rate at which the error of the {what} of a curve falls",
                        fall[j, i],
                        reference=ORDER,
                        source=COARSE,
                        tolerance=OFF,
                        params={"curve": name, "nodes": nodes, "steps": count},
                    )
        worse = _errors(curve, even(COUNTS[1]))
        for i, what in enumerate(("curvature", "torsion") if name == "helix" else ("curvature",)):
            says = f"error of the {what} of a curve at its ends over that in between"
            result.check(says, worse[i] / worse[2 + i], source=COARSE, params={"curve": name})


def _errors(curve: Curve, u: Array) -> tuple[float, float, float, float]:
    """Largest errors of curvature and torsion, everywhere and where differences are not one-sided, 1/mm."""
    points, kappa, tau = curve(u)
    found = curve_of(points, u)
    inner = ~found.one_sided
    bend, twist = np.abs(found.curvature - kappa), np.abs(found.torsion - tau)
    return float(bend.max()), float(twist.max()), float(bend[inner].max()), float(twist[inner].max())


def panels(result: CaseResult, path: Path, params: dict[str, Any]) -> None:
    """An angle that changes by 0.2 rad: generators of the panels against A.12, curvature against 5.3."""
    state = path[-1]
    profile = along(state, "crease")
    inner = (profile.u > 0.25 * profile.u[-1]) & (profile.u < 0.75 * profile.u[-1])
    printed = generator_angles(
        profile.signed_curvature, -profile.torsion, profile.dihedral, profile.fold_rate
    )
    theory = profile.signed_curvature / profile.isometric_curvature
    tilt = max(
        float(np.degrees(np.abs(angle - 0.5 * math.pi)[inner]).max()) for angle in profile.generator_angles
    )
    bent = 0.0
    off: dict[str, float] = {"as derived": 0.0, "as printed": 0.0}
    for side, ours, theirs in zip(("left", "right"), profile.generator_angles, printed, strict=True):
        found = panel_generators(state, "crease", side)
        estimate = np.interp(profile.u, found.u, found.angle)
        bent = max(
            bent, float(np.abs(np.interp(profile.u, found.u, found.kappa_1 / found.kappa_2))[inner].max())
        )
        for name, angle in (("as derived", ours), ("as printed", theirs)):
            off[name] = max(off[name], float(np.degrees(np.abs(estimate - angle)[inner]).max()))
    judged = (
        params["formulation"] == "consistent"
    )  # slanted hinges of one row exaggerate the twist of a panel
    for quantity, value, unit, tolerance, source in (
        (
            "varying fold: kappa over that of Eq. 5.3, less one",
            float(np.abs(theory - 1.0)[inner].max()),
            "",
            0.01,
            "5.3",
        ),
        (
            "varying fold: generators of the panels, off A.12 as derived",
            off["as derived"],
            "degrees",
            0.5 if judged else None,
            "A.12",
        ),
        (
            "varying fold: generators of the panels, off A.12 as printed",
            off["as printed"],
            "degrees",
            None,
            "A.12",
        ),
    ):
        result.check(
            quantity,
            value,
            unit=unit,
            reference=0.0,
            source=f"source Eq. {source}",
            tolerance=tolerance,
            params=params,
            path=path,
        )
    says = "varying fold: generators of A.12 off a right angle, largest"
    result.check(says, tilt, unit="degrees", source="source Eq. A.12", params=params)
    says = "varying fold: kappa_1 over kappa_2 of the panels, largest"
    result.check(says, bent, source="zero on a developable surface", params=params)
