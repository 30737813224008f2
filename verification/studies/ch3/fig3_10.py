"""Case `fig3_10` (source 3.5.2, Fig. 3.10): a folded annulus sector, held at one end, lifted far at the other.

The source prints neither the sheet nor the displacement. Here it is the sheet of App. B, folded by a spring crease of
L* = 25 mm with a rest angle of 90 degrees. Then the nodes of one straight edge stay where they are and the tip of the
crease goes up by 30 mm, along the normal of the plane of the folded crease; it is free across.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import meshes
from bh import Displace, Model, Path, Sheet, State, trace
from meshes.cells import Kind
from verification.framework.checks import CaseResult, Context, line, plot

SHEET = Sheet(E=4000.0, t=0.127)  # nu = 0, as bars and hinges take it
LSTAR, REST, LIFT = 25.0, 0.5 * math.pi, 30.0  # mm, rad, mm
ALPHAS = (1.0, 2.0, 4.0, 6.0, 8.0)  # the five curves of Fig. 3.10 (d)
ROWS = (1, 2, 4, 8)
FINEST = (1.0, 16)  # aspect ratio and rows a side
SPREAD = 0.03
SOURCE = "source 3.5.2, Fig. 3.10"
BARS, CONSISTENT = "bars-and-hinges", "consistent"


@dataclass(frozen=True)
class Lift:
    """The lifted sheet.

    Attributes:
        path: folding and lifting.
        rise: (k,) displacement of the tip, mm; `force`: (k,) on the tip in that direction, N.
        folded, lifted: states before and after.
    """

    path: Path
    rise: NDArray[np.float64]
    force: NDArray[np.float64]
    folded: State
    lifted: State


def folded_sheet(alpha: float, rows: int, kind: Kind, formulation: str) -> Model:
    """The free sheet with a step that folds it."""
    pattern = meshes.annulus_sector(100.0, 10.0, math.pi / 4)
    mesh = meshes.structured(pattern, aspect_ratio=alpha, rows=rows, kind=kind)
    return Model(mesh, SHEET, formulation=formulation, contact=False).fold("crease", rest=REST, Lstar=LSTAR)


def upward(state: State) -> NDArray[np.float64]:
    """(3,) unit normal of the plane that fits the folded crease best, to the side of +z."""
    points = state.crease_points("crease")
    normal: NDArray[np.float64] = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][-1]
    return normal if normal[2] > 0.0 else -normal


def lift(alpha: float, rows: int, kind: Kind, formulation: str, by: float = LIFT) -> Lift:
    """Fold the free sheet, hold one end where it is and lift the tip of the crease by `by` mm."""
    model = folded_sheet(alpha, rows, kind, formulation)
    start = trace(model)[-1]
    up, moved = upward(start), start.displacement()
    held = [
        Displace([node], axis, float(moved[node, i]))
        for node in model.mesh.nodes("edge:start").tolist()
        for i, axis in enumerate("xyz")
    ]
    tip = int(model.mesh.nodes("crease:crease")[-1])
    path = trace(model.step(*held, Displace([tip], tuple(up.tolist()), float(moved[tip] @ up) + by)))
    states = [state for state in path if state.step == 1]
    rise = np.array([(state.points - start.points)[tip] @ up for state in states])
    force = np.array([state.reactions[tip] @ up for state in states])
    return Lift(path, np.append(0.0, rise), np.append(0.0, force), start, path[-1])


def run(context: Context) -> CaseResult:
    """Force and energies over aspect ratio by bars and hinges; over rows too by the consistent formulation."""
    result = CaseResult(
        name="fig3_10",
        title="A folded annulus sector lifted at its tip",
        question="Which force and which energies does the large upward displacement take, by mesh and formulation?",
        source=SOURCE,
    )
    alphas = ALPHAS[:3] if context.quick else ALPHAS
    bars: dict[str, list[Lift]] = {}
    for kind in ("alternating", "staggered"):
        context.tell(f"fig3_10: bars and hinges, {kind}")
        bars[kind] = [lift(alpha, 1, kind, BARS) for alpha in alphas]
    fine = ALPHAS[:2] if context.quick else ALPHAS
    found: dict[tuple[float, int], Lift] = {}
    for rows in ROWS:
        for alpha in fine:
            context.tell(f"fig3_10: consistent, alpha {alpha:g}, {rows} rows")
            found[alpha, rows] = lift(alpha, rows, "alternating", CONSISTENT)
    finest = (fine[-1], ROWS[-1]) if context.quick else FINEST
    if finest not in found:
        context.tell(f"fig3_10: consistent, alpha {finest[0]:g}, {finest[1]} rows")
        found[finest] = lift(*finest, "alternating", CONSISTENT)
    converged = found[finest]
    for kind, lifts in bars.items():
        for alpha, item in zip(alphas, lifts, strict=True):
            _record(result, item, converged, alpha, 1, kind, BARS)
        _softest(result, alphas, lifts, kind)
    for (alpha, rows), item in found.items():
        _record(result, item, converged, alpha, rows, "alternating", CONSISTENT)
    for rows in ROWS:
        _spread(result, {alpha: found[alpha, rows] for alpha in fine}, rows)
    _other_mesh(result, context, converged)
    _claims_on_energy(result, alphas, bars["alternating"], found, finest)
    _plots(result, alphas, bars["alternating"], found, finest)
    _notes(result, alphas, bars["alternating"], found, finest)
    return result


def _record(
    result: CaseResult, item: Lift, converged: Lift, alpha: float, rows: int, kind: str, formulation: str
) -> None:
    """Force and energies of one mesh against the finest one; judged where the mesh should have converged."""
    params = {"alpha": alpha, "rows": rows, "mesh": kind, "formulation": formulation, "lift_mm": LIFT}
    judged = formulation == CONSISTENT and rows == ROWS[-1] and item is not converged
    result.check(
        "force at the tip",
        item.force[-1],
        unit="N",
        reference=float(converged.force[-1]),
        source="consistent formulation, finest mesh",
        tolerance=SPREAD if judged else None,
        params=params,
        path=item.path,
    )
    for name, value in item.lifted.energy.as_dict().items():
        result.check(
            f"{name} energy",
            value,
            unit="N mm",
            reference=converged.lifted.energy.as_dict()[name],
            source="consistent formulation, finest mesh",
            tolerance=SPREAD if judged and name == "total" else None,
            params=params,
            path=item.path,
        )


def _softest(result: CaseResult, alphas: tuple[float, ...], lifts: list[Lift], kind: str) -> None:
    forces = [float(item.force[-1]) for item in lifts]
    params = {"mesh": kind, "rows": 1, "formulation": BARS}
    result.check(
        "aspect ratio of the softest mesh",
        alphas[int(np.argmin(forces))],
        unit="alpha",
        reference=1.0,
        source=SOURCE + " (d): the coarse mesh is the softest",
        tolerance=0.0,
        params=params,
    )
    rising = bool((np.diff(forces) > 0.0).all())
    result.check(
        "the force grows with every finer mesh",
        rising,
        reference=1.0,
        source=SOURCE + " (d)",
        tolerance=0.0,
        params=params,
    )


def _spread(result: CaseResult, items: dict[float, Lift], rows: int) -> None:
    """Largest difference between aspect ratios at one number of rows, over their mean."""
    for quantity, values in (
        ("force at the tip", [item.force[-1] for item in items.values()]),
        ("total energy", [item.lifted.energy.total for item in items.values()]),
    ):
        result.check(
            f"spread of the {quantity} over alpha",
            np.ptp(values) / np.mean(values),
            reference=0.0,
            source="asked: within 3 % of each other with rows",
            tolerance=SPREAD if rows == ROWS[-1] else None,
            params={"rows": rows, "mesh": "alternating", "formulation": CONSISTENT, "alphas": list(items)},
        )


def _other_mesh(result: CaseResult, context: Context, converged: Lift) -> None:
    """Another mesh pattern comes to the same force."""
    rows = 4 if context.quick else ROWS[-1]
    for alpha in ALPHAS[: 1 if context.quick else 2]:
        context.tell(f"fig3_10: consistent, alpha {alpha:g}, staggered")
        item = lift(alpha, rows, "staggered", CONSISTENT)
        _record(result, item, converged, alpha, rows, "staggered", CONSISTENT)


def _claims_on_energy(
    result: CaseResult,
    alphas: tuple[float, ...],
    bars: list[Lift],
    found: dict[tuple[float, int], Lift],
    finest: tuple[float, int],
) -> None:
    """What the source says of Fig. 3.10 (e, f) without numbers, measured: reported, not judged."""
    coarse, fine = bars[0].lifted.energy, bars[-1].lifted.energy
    pair = {"mesh": "alternating", "formulation": BARS, "alphas": [alphas[0], alphas[-1]]}
    claims = (
        (
            "total energy, fine over coarse",
            fine.total / coarse.total,
            "the coarse mesh has substantially less",
            pair,
        ),
        ("folding energy, fine over coarse", fine.folding / coarse.folding, "about the same magnitude", pair),
        (
            "bending energy, fine over coarse",
            fine.bending / coarse.bending,
            "overestimated by the fine mesh",
            pair,
        ),
        (
            "stretching energy, fine over coarse",
            fine.stretching / coarse.stretching,
            "overestimated by the fine mesh",
            pair,
        ),
    )
    for quantity, value, claim, params in claims:
        result.check(quantity, value, source=f"{SOURCE} (e, f): {claim}", params=params)
    shares = [(alphas[0], 1, BARS, coarse), (alphas[-1], 1, BARS, fine)]
    shares.append((*finest, CONSISTENT, found[finest].lifted.energy))
    for alpha, rows, formulation, energy in shares:
        result.check(
            "share of stretching in the energy",
            energy.stretching / energy.total,
            source=SOURCE + " (e, f): a high proportion",
            params={"alpha": alpha, "rows": rows, "mesh": "alternating", "formulation": formulation},
        )


def _plots(
    result: CaseResult,
    alphas: tuple[float, ...],
    bars: list[Lift],
    found: dict[tuple[float, int], Lift],
    finest: tuple[float, int],
) -> None:
    converged = found[finest]
    reference = line(
        f"consistent, {finest[1]} rows", converged.rise.tolist(), converged.force.tolist(), "reference"
    )
    curves = [
        line(f"alpha = {alpha:g}", item.rise.tolist(), item.force.tolist())
        for alpha, item in zip(alphas, bars, strict=True)
    ]
    result.plots.append(
        plot(
            "fig3-10-force-bars",
            "Bars and hinges: force over upward displacement",
            "displacement of the tip, mm",
            "force, N",
            [*curves, reference],
            "One row of cells a side, alternating diagonals (Fig. 3.10 d).",
        )
    )
    rows = ROWS[-1]
    curves = [
        line(f"alpha = {alpha:g}, {n} rows", item.rise.tolist(), item.force.tolist())
        for (alpha, n), item in found.items()
        if n == rows and (alpha, n) != finest
    ]
    result.plots.append(
        plot(
            "fig3-10-force-consistent",
            "Consistent: force over upward displacement",
            "displacement of the tip, mm",
            "force, N",
            [*curves, reference],
            f"{rows} rows of cells a side, alternating diagonals.",
        )
    )
    _energy_plot(result, alphas, bars, converged)
    _rows_plot(result, found, converged)


def _energy_plot(result: CaseResult, alphas: tuple[float, ...], bars: list[Lift], converged: Lift) -> None:
    """Energies by kind over the aspect ratio (Fig. 3.10 e, f)."""
    kinds = ("stretching", "bending", "folding", "total")
    series = [
        line(kind, list(alphas), [item.lifted.energy.as_dict()[kind] for item in bars]) for kind in kinds
    ]
    exact = converged.lifted.energy.as_dict()
    series += [
        line(f"{kind}, converged", list(alphas), [exact[kind]] * len(alphas), "reference") for kind in kinds
    ]
    result.plots.append(
        plot(
            "fig3-10-energy",
            "Energy by kind of the lifted sheet",
            "aspect ratio alpha",
            "energy, N mm",
            series,
            "Bars and hinges, one row a side, against the finest consistent mesh (Fig. 3.10 e, f).",
            log="y",
        )
    )


def _rows_plot(result: CaseResult, found: dict[tuple[float, int], Lift], converged: Lift) -> None:
    """The force at the tip over the rows of cells."""
    fine = sorted({alpha for alpha, _ in found})
    series = [
        line(
            f"consistent, alpha = {alpha:g}",
            [float(n) for n in ROWS],
            [found[alpha, n].force[-1] for n in ROWS],
        )
        for alpha in fine
    ]
    series.append(
        line("finest", [float(n) for n in ROWS], [float(converged.force[-1])] * len(ROWS), "reference")
    )
    result.plots.append(
        plot(
            "fig3-10-rows",
            "Force at the tip over rows",
            "rows of cells a side",
            "force, N",
            series,
            f"Displacement {LIFT:g} mm; alpha is that of the cells, so more rows are more cells along too.",
            log="x",
        )
    )


def _notes(
    result: CaseResult,
    alphas: tuple[float, ...],
    bars: list[Lift],
    found: dict[tuple[float, int], Lift],
    finest: tuple[float, int],
) -> None:
    exact = float(found[finest].force[-1])
    ratios = ", ".join(
        f"{item.force[-1] / exact:.2g} ({alpha:g})" for alpha, item in zip(alphas, bars, strict=True)
    )
    result.notes.append(
        f"Bars and hinges take these multiples of the converged force of {exact:.4f} N (alpha in brackets): {ratios}. "
        "The coarse mesh is the softest, as the source finds, and still too stiff; what locks is the twist of long "
        "cells, (alpha + 1 / alpha)^2 of St Venant's in a strip."
    )
    energy = found[finest].lifted.energy
    result.notes.append(
        "The source reports a high proportion of bar energy. Here it is "
        f"{100 * bars[0].lifted.energy.stretching / bars[0].lifted.energy.total:.1f} % at alpha = {alphas[0]:g}, "
        f"{100 * bars[-1].lifted.energy.stretching / bars[-1].lifted.energy.total:.1f} % at {alphas[-1]:g} and "
        f"{100 * energy.stretching / energy.total:.1f} % converged: bending leads until the sheet is pulled taut. "
        "Sizes and displacement of the source are not printed."
    )
    result.notes.append(
        "One row of cells cannot curve across the crease: the consistent formulation is then 40 to 50 % too soft. "
        "It needs rows, not longer cells. Rows of alternating cells as long as they are high (alpha = 1) are "
        "the last to come in."
    )
