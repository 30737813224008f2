"""Case `fig3_6` (source 3.4.2, Fig. 3.6 f): folded annulus sectors against cones, and what their free ends do.

The sectors of the case `cone`, here of the source's 0.274 mm paper (3.4.3; it prints no thickness for this study) and
by both formulations. A cone has the same energy in every millimetre of crease; a sheet cannot hold the moment of a
cone at its free straight edges, so it is flatter there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bh import Path, Sheet, State, trace
from meshes.cells import Kind
from verification.framework.checks import CaseResult, Context, line, plot
from verification.studies.ch3 import cone

Array = NDArray[np.float64]
SHEET = Sheet(E=4000.0, t=0.274)  # nu = 0, as bars and hinges take it
BIN = 2.5  # mm of crease to a value of the energy density
BARS, CONSISTENT = "bars-and-hinges", "consistent"
SOURCE = "source 3.4.2, Fig. 3.6 (f)"
CONVERGED = "consistent formulation, finest mesh"


@dataclass(frozen=True)
class Mesh:
    """A mesh of a sector and the formulation on it."""

    formulation: str
    kind: Kind
    alpha: float
    rows: int = 1

    @property
    def cell(self) -> float:
        """Length of a cell along the crease, mm."""
        return cone.WIDTH / self.rows / self.alpha

    def params(self, angle: float) -> dict[str, object]:
        """Parameters of a record, with the sector angle."""
        return {
            "angle_deg": round(math.degrees(angle), 6),
            "alpha": self.alpha,
            "rows": self.rows,
            "mesh": self.kind,
            "formulation": self.formulation,
            "t_mm": SHEET.t,
        }


@dataclass(frozen=True)
class Folded:
    """A folded sector: `ratio` is its energy over that of the cones; `density` the same bin by bin along the crease."""

    path: Path
    ratio: float
    density: Array | None


FINEST = Mesh(CONSISTENT, "staggered", 1.0, 8)
Found = dict[Mesh, Folded]


def density_along(state: State, angle: float) -> Array:
    """(bins,) energy of the sheet at equal parts of the crease, over that of a cone there."""
    mesh = state.mesh
    centre = mesh.points[mesh.triangles].mean(axis=1)
    azimuth = np.arctan2(centre[:, 1], centre[:, 0]) % (2.0 * math.pi)
    count = round(cone.RADIUS * angle / BIN)
    bins = np.clip((azimuth / angle * count).astype(int), 0, count - 1)
    density = state.energy_density["stretching"] + state.energy_density["bending"]
    kappa = 1.0 / (math.tan(0.5 * cone.DIHEDRAL) * np.hypot(centre[:, 0], centre[:, 1]))
    exact = 0.5 * SHEET.bending_stiffness(nu=0.0) * kappa**2
    found: Array = np.bincount(bins, mesh.areas * density, count) / np.bincount(
        bins, mesh.areas * exact, count
    )
    return found


def lost_length(density: Array) -> float:
    """Length of cone that is missing at each end, mm, against the density in the middle."""
    return float(0.5 * BIN * (1.0 - density / np.median(density)).sum())


def reach_of_end(density: Array) -> float:
    """Distance from the end from where on the density is within 5 % of that in the middle, mm (mean of both ends)."""
    off = np.abs(density / np.median(density) - 1.0) > 0.05
    half = len(off) // 2
    # flags from an end inwards; the last one that is set ends the affected part
    ends = [np.flatnonzero(side) for side in (off[:half], off[::-1][:half])]
    return BIN * float(np.mean([side[-1] + 1 if len(side) else 0 for side in ends]))


def fold(angle: float, mesh: Mesh) -> Folded:
    """Fold a sector to a right angle."""
    model = cone.cone_model(angle, mesh.alpha, mesh.kind, mesh.rows, mesh.formulation, SHEET)
    path = trace(model, neighbours=False)
    state = path[-1]
    ratio = state.energy.total / cone.energy(angle, SHEET) if path.reached else math.nan
    return Folded(path, ratio, density_along(state, angle) if mesh.cell <= 0.5 * BIN else None)


def meshes_of(quick: bool) -> list[Mesh]:
    """All meshes of a sector, the finest one last."""
    alphas = cone.QUICK_ALPHAS if quick else cone.ALPHAS
    out = [Mesh(BARS, "alternating", alpha) for alpha in alphas]
    out += [Mesh(BARS, "staggered", alpha) for alpha in alphas]
    out += [Mesh(CONSISTENT, "alternating", alpha) for alpha in alphas]
    out += [Mesh(CONSISTENT, "alternating", alpha, 4) for alpha in ((2.0,) if quick else (2.0, 4.0, 8.0))]
    return [*out, FINEST]


def run(context: Context) -> CaseResult:
    """Energies over aspect ratio and energy density along the crease, four sectors, both formulations."""
    result = CaseResult(
        name="fig3_6",
        title="Folded annulus sectors, cones and free ends",
        question="Which energy do the sectors converge to, and how much of it do their free ends lack?",
        source=SOURCE,
    )
    sectors: dict[float, Found] = {}
    for angle in cone.ANGLES[:: 3 if context.quick else 1]:
        context.tell(f"fig3_6: sector {math.degrees(angle):.0f} degrees")
        found = {mesh: fold(angle, mesh) for mesh in meshes_of(context.quick)}
        sectors[angle] = found
        _energies(result, angle, found)
        _claims(result, angle, found)
        _plots(result, angle, found)
    _ends(result, sectors)
    _notes(result, sectors)
    return result


def _energies(result: CaseResult, angle: float, found: Found) -> None:
    """Every mesh against the cone, as the source does, and against the converged sheet."""
    exact = found[FINEST].ratio
    for mesh, item in found.items():
        params = mesh.params(angle)
        # the source's word on its own meshes: judged at the first aspect ratio beyond the one it names
        printed = 0.10 if (mesh.formulation, mesh.kind, mesh.alpha) == (BARS, "alternating", 8.0) else None
        result.check(
            "energy over that of the cones",
            item.ratio,
            unit="U / U_Th",
            reference=1.0,
            source=SOURCE + ": within 10 % above alpha = 7",
            tolerance=printed,
            params=params,
            path=item.path,
        )
        if mesh != FINEST:
            judged = 0.01 if mesh.rows > 1 else None
            result.check(
                "energy over that of the cones, converged",
                item.ratio,
                unit="U / U_Th",
                reference=exact,
                source=CONVERGED,
                tolerance=judged,
                params=params,
                path=item.path,
            )


def _claims(result: CaseResult, angle: float, found: Found) -> None:
    """Too stiff where coarse; from which aspect ratio within 10 %; below the cone at last."""
    for kind in ("alternating", "staggered"):
        curve = [
            (m.alpha, item.ratio) for m, item in found.items() if (m.formulation, m.kind) == (BARS, kind)
        ]
        params: dict[str, object] = {
            "angle_deg": round(math.degrees(angle), 6),
            "mesh": kind,
            "formulation": BARS,
            "t_mm": SHEET.t,
        }
        check = partial(result.check, params=params)
        check("the coarsest mesh stores more than the cone", curve[0][1] > 1.0, reference=1.0, tolerance=0.0)
        near = _first(curve, lambda ratio: abs(ratio - 1.0) <= 0.1)
        below = _first(curve, lambda ratio: ratio < 1.0)
        check(
            "aspect ratio from which the energy is within 10 % of the cone",
            near,
            unit="alpha",
            source=SOURCE + ": above 7",
        )
        check(
            "aspect ratio from which the energy is below that of the cone (0: none to 20)",
            below,
            unit="alpha",
            source=SOURCE + ": at sufficiently high ones",
        )
    result.check(
        "the converged sheet stores less than the cone",
        found[FINEST].ratio < 1.0,
        reference=1.0,
        source=SOURCE + ": by end effects",
        tolerance=0.0,
        params=FINEST.params(angle),
        path=found[FINEST].path,
    )


def _first(curve: Sequence[tuple[float, float]], holds: Callable[[float], bool]) -> float:
    """Least aspect ratio from which on every ratio of the curve is as asked; 0 if the last one is not."""
    first = 0.0
    for alpha, ratio in reversed(curve):
        if not holds(ratio):
            break
        first = alpha
    return first


def _ends(result: CaseResult, sectors: dict[float, Found]) -> None:
    """The free ends of every mesh that is fine enough along the crease."""
    widest = sectors[max(sectors)][FINEST].density
    assert widest is not None
    for angle, found in sectors.items():
        exact = found[FINEST].density
        assert exact is not None
        for mesh, item in found.items():
            if item.density is None:
                continue
            params, last = mesh.params(angle), mesh == FINEST
            reference = None if last else lost_length(exact)
            check = partial(result.check, params=params, path=item.path)
            check(
                "length of cone that each free end lacks",
                lost_length(item.density),
                unit="mm",
                reference=reference,
                source=CONVERGED,
            )
            check(
                "reach of a free end",
                reach_of_end(item.density),
                unit="mm",
                reference=None if last else reach_of_end(exact),
                source=CONVERGED,
            )
            check(
                "energy density in the middle over that of the cone",
                np.median(item.density),
                reference=1.0,
                source="Eq. 3.13: uniform along the crease",
                tolerance=0.02 if last else None,
            )
        if angle != max(sectors):
            result.check(
                "length of cone that each free end lacks, whatever the sector",
                lost_length(exact),
                unit="mm",
                reference=lost_length(widest),
                source="that of the longest sector",
                tolerance=0.1,
                params=FINEST.params(angle),
                path=found[FINEST].path,
            )


def _plots(result: CaseResult, angle: float, found: Found) -> None:
    degrees = round(math.degrees(angle))
    series = []
    for formulation, kind, rows, label in (
        (BARS, "alternating", 1, "bars and hinges, alternating"),
        (BARS, "staggered", 1, "bars and hinges, staggered"),
        (CONSISTENT, "alternating", 1, "consistent, 1 row"),
        (CONSISTENT, "alternating", 4, "consistent, 4 rows"),
    ):
        same = [
            (m.alpha, i.ratio)
            for m, i in found.items()
            if (m.formulation, m.kind, m.rows) == (formulation, kind, rows)
        ]
        series.append(line(label, [alpha for alpha, _ in same], [ratio for _, ratio in same]))
    span = [2.0, 20.0]
    series.append(line("cone", span, [1.0, 1.0], "reference"))
    series.append(line("converged", span, [found[FINEST].ratio] * 2, "reference"))
    result.plots.append(
        plot(
            f"fig3-6-energy-{degrees}",
            f"Sector of {degrees} degrees: energy",
            "aspect ratio alpha",
            "U / U_Th",
            series,
            "Folded to 90 degrees with the crease in its plane, 0.274 mm paper (Fig. 3.6 f).",
        )
    )
    series = []
    for mesh, item in found.items():
        if item.density is not None and (mesh.rows > 1 or mesh.formulation == BARS):
            where = (np.arange(len(item.density)) + 0.5) * BIN
            name = f"{mesh.formulation}, {mesh.kind}, alpha = {mesh.alpha:g}, rows = {mesh.rows}"
            series.append(line(name, where.tolist(), item.density.tolist()))
    series.append(line("cone", [0.0, cone.RADIUS * angle], [1.0, 1.0], "reference"))
    result.plots.append(
        plot(
            f"fig3-6-ends-{degrees}",
            f"Sector of {degrees} degrees: energy along the crease",
            "distance along the crease, mm",
            "energy density over that of the cone",
            series,
            f"Energy of the sheet in every {BIN:g} mm of crease. Free ends at both sides.",
        )
    )


def _notes(result: CaseResult, sectors: dict[float, Found]) -> None:
    at = Mesh(BARS, "alternating", 8.0)
    bars = [100.0 * (found[at].ratio - 1.0) for found in sectors.values()]
    thin = [
        100.0
        * (trace(cone.cone_model(angle, 8.0, "alternating"))[-1].energy.total / cone.energy(angle) - 1.0)
        for angle in sectors
    ]
    exact = [100.0 * (found[FINEST].ratio - 1.0) for found in sectors.values()]
    result.notes.append(
        f"The source's meshes at alpha = 8 lie {min(bars):.0f} to {max(bars):.0f} % over the cone with its 0.274 mm "
        "paper, within its 10 %. How soon they get there depends on the thickness, which the source does not print for "
        f"this study: {min(thin):.0f} to {max(thin):.0f} % with {cone.SHEET.t} mm (case cone), because stretching has "
        "to undo what planar cells lock. "
        f"The converged sheet stores {-max(exact):.0f} to {-min(exact):.0f} % less than the cone."
    )
    lost = {
        mesh: [lost_length(d) for found in sectors.values() if (d := found[mesh].density) is not None]
        for mesh in (Mesh(BARS, "staggered", 8.0), Mesh(BARS, "staggered", 12.0), FINEST)
    }
    means = [float(np.mean(values)) for values in lost.values()]
    reach = [reach_of_end(d) for found in sectors.values() if (d := found[FINEST].density) is not None]
    result.notes.append(
        f"Each free end lacks the energy of {means[2]:.1f} mm of cone, in every sector alike, over a reach of "
        f"{min(reach):.0f} to {max(reach):.0f} mm. One row of bars and hinges lacks {means[0]:.2f} mm at alpha = 8 and "
        f"{means[1]:.2f} mm at 12 (staggered), nearly all of it in the last {BIN:g} mm: that is an "
        "effect of the cells, and goes to nothing with finer ones. The source reads the dip below the cone as some of "
        "the end effect; most of the end effect needs rows."
    )
