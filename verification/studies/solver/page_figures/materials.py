"""Sheets with a grain, stresses of a bent strip and creases that are wide (docs/materials.md)."""

from __future__ import annotations

import math

import numpy as np

import bh
import meshes
from meshes.cells import Kind
from verification.framework.checks import CaseResult
from verification.studies.solver.closed_forms import KINDS

GRAIN_MESHES = (("shell", 20, 2), ("consistent", 32, 4), ("consistent", 64, 8))
FOLDED = 1.2  # rad
WIDTHS = (2.0, 1.0, 0.5, 0.25, 0.0)  # mm, of creases; 0 is a sharp one
SHELL_OF_CREASES, CELLS_OF_CREASES = (96, 3), (96, 8)
PULL = 0.01  # N, at the end of a strip
SHELL = "the shell"


def grains(result: CaseResult, quick: bool) -> None:
    """Energies of a folded sector with the grain in three directions, and of one that is alike in all.

    Args:
        result: gets the checks.
        quick: without the finest meshes.
    """
    sheets = {"alike": bh.Sheet(E=6000.0, nu=0.3, t=0.127)}
    for degrees in (0, 45, 90):
        sheets[f"{degrees} degrees"] = bh.Sheet.orthotropic(
            E1=6000.0, E2=3000.0, G12=1640.0, nu12=0.3, grain=f"{degrees}deg", t=0.127
        )
    for grain, sheet in sheets.items():
        judge = None
        for formulation, along, rows in GRAIN_MESHES[: 2 if quick else 3]:
            pattern = meshes.annulus_sector(100.0, 10.0, math.pi / 4.0)
            mesh = meshes.structured(pattern, along=along, rows=rows, kind=KINDS[formulation])
            path = bh.trace(bh.Model(mesh, sheet, formulation=formulation).fold("crease", by=FOLDED))
            energy = path.require()[-1].energy.total
            judge = energy if judge is None else judge
            result.check(
                "energy of a folded sector with a grain",
                energy,
                unit="N mm",
                reference=None if formulation == "shell" else judge,
                source=f"{SHELL}, 20 x 2 cells",
                params={"grain": grain, "formulation": formulation, "along": along, "rows": rows},
                path=path,
            )


def stresses(result: CaseResult, quick: bool) -> None:
    """Largest error of the stresses at the corners of triangles of a strip that a force at its end bends.

    Args:
        result: gets the checks.
        quick: without the finest mesh.
    """
    for formulation in ("consistent", "shell"):
        for along in (10, 20) if quick else (10, 20, 40):
            mesh = meshes.structured(meshes.strip(40.0, 10.0), along=along, rows=along // 10)
            model = bh.Model(mesh, bh.Sheet(E=193_000.0, nu=0.0, t=0.2), formulation=formulation)
            model = model.support("edge:start", "xyz", clamp=True)
            path = bh.trace(model.step(bh.Force("edge:end", total=(0.0, 0.0, PULL)))).require()
            stress = path[-1].stress()
            exact = 6.0 * PULL * (40.0 - mesh.points[mesh.triangles, 0]) / (10.0 * 0.2**2)
            off = [
                np.abs(sign * stress.corners.at(side)[..., 0] - exact).max()
                for side, sign in (("top", -1.0), ("bottom", 1.0))
            ]
            result.check(
                "stress of a bent strip, largest error over the root's",
                float(max(off) / exact.max()),
                reference=0.0,
                source="6 P (l - x) / (b t^2)",
                params={"formulation": formulation, "along": along},
                path=path,
            )


def wide_creases(result: CaseResult, quick: bool) -> None:
    """A clamped strip with a wide crease against its closed form, and curved creases of several widths.

    Args:
        result: gets the checks.
        quick: without the finest meshes.
    """
    for formulation, cells in (("consistent", 8), ("consistent", 16), ("shell", 4)):
        found, exact = lifted_crease(formulation, cells)
        result.check(
            "rise of a strip with a wide crease",
            found,
            unit="mm",
            reference=exact,
            source="the crease's turn and the panels' bending, closed form",
            params={"formulation": formulation, "along": cells},
        )
    sharp = None
    for width in reversed(WIDTHS[1:] if quick else WIDTHS):
        state = folded_crease("shell", width, *((24, 1) if quick else SHELL_OF_CREASES), "mirrored")
        angle = float(state.fold_angle("crease").mean())
        sharp = angle if sharp is None else sharp
        params = {"formulation": "shell", "width": width}
        result.check("fold angle of a curved wide crease", angle, unit="rad", params=params)
        off = sharp - angle
        result.check("fold angle less than that of a sharp crease", off, unit="rad", params=params)
        result.check("energy of a curved wide crease", state.energy.total, unit="N mm", params=params)
    if not quick:
        state = folded_crease("consistent", 1.0, *CELLS_OF_CREASES, "alternating")
        params = {"formulation": "consistent", "width": 1.0}
        result.check("energy of a curved wide crease", state.energy.total, unit="N mm", params=params)


def lifted_crease(formulation: str, cells: int) -> tuple[float, float]:
    """Rise of the end of a clamped strip (40 x 20 mm) with a crease of 4 mm in its middle, and its closed form, mm.

    Args:
        formulation: name.
        cells: along and across.
    """
    width, k, load, a = 4.0, 0.2, 1e-7, 20.0
    sheet = bh.Sheet(E=4000.0, nu=0.0, t=0.2)
    pattern = meshes.wide_creases(meshes.strip(20.0, 2.0 * a, [a]), width)
    mesh = meshes.structured(pattern, along=cells, rows=cells, kind=KINDS[formulation])
    model = bh.Model(mesh, sheet, formulation=formulation).support("edge:inner", "xyz", clamp=True)
    model = model.wide_crease("crease", stiffness=k).step(bh.LineForce("edge:outer", (0.0, 0.0, load)))
    state = bh.trace(model, estimate=False, neighbours=False).require()[-1]
    turned = (width**2 / 12.0 + a**2) / k
    exact = load * (turned + (2.0 * a) ** 3 / (3.0 * sheet.bending_stiffness()))
    return float(state.displacement("edge:outer")[:, 2].mean()), exact


def folded_crease(formulation: str, width: float, along: int, rows: int, kind: Kind) -> bh.State:
    """A curved crease (R = 100, 0.6 rad, t = 0.2, L* = 20 mm) that is 1 rad folded at rest.

    Args:
        formulation: name.
        width: of the crease, mm; 0 for a sharp one.
        along: cells along it.
        rows: of cells a panel.
        kind: of cells.
    """
    pattern = meshes.annulus_sector(100.0, 10.0, 0.6)
    pattern = meshes.wide_creases(pattern, width) if width else pattern
    mesh = meshes.structured(pattern, along=along, rows=rows, kind=kind)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, nu=0.3, t=0.2), formulation=formulation)
    if width:
        model = model.wide_crease("crease", Lstar=20.0).fold("crease", rest=math.pi - 1.0)
    else:
        model = model.fold("crease", rest=math.pi - 1.0, Lstar=20.0)
    return bh.trace(model, estimate=False, neighbours=False).require()[-1]
