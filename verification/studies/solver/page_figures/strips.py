"""Strips in their plane, App. B (a), stiffness, buckling and response (docs/formulation.md, docs/stiffness.md)."""

from __future__ import annotations

import math

import bh
import meshes
from bh.analysis.buckling import buckling_modes
from bh.analysis.stiffness_probe import Probe
from bh.applications.response import response
from bh.loading.builder import load_steps
from bh.mechanics.consistent.formulation import Consistent, ConstantStrain
from bh.solvers.linear import linear_response
from meshes.cells import Kind
from verification.framework.checks import CaseResult, reached_energy
from verification.studies.solver.convergence import folded, sector

MEASURES: dict[str, type[Consistent]] = {"smoothed": Consistent, "constant strain": ConstantStrain}
PATTERNS: tuple[Kind, ...] = ("staggered", "one-way", "alternating")
LONG, HIGH, TURN = 10.0, 1.0, 1e-4  # mm, mm, rad
SHEET = bh.Sheet(E=1000.0, t=0.1, nu=0.0)
LIMIT = 0.05370  # N mm, of App. B (a) at nu = 0.38 by the quadratic shell (case `convergence`)


def membranes(result: CaseResult, quick: bool) -> None:
    """Energy of a strip that is bent in its plane, over the beam's, by smoothed and by constant strains.

    Args:
        result: gets the checks.
        quick: without the finest mesh.
    """
    for name, measure in MEASURES.items():
        for kind in PATTERNS:
            for rows in (1, 2, 4) if quick else (1, 2, 4, 8):
                result.check(
                    "energy of a strip bent in its plane, over the beam's",
                    bent_in_plane(measure(), rows, kind),
                    reference=1.0,
                    source="a beam in pure bending",
                    params={"strain": name, "mesh": kind, "rows": rows},
                )


def bent_in_plane(formulation: Consistent, rows: int, kind: Kind) -> float:
    """Energy of a strip whose ends are turned in its plane, over that of a beam; nu = 0.

    Args:
        formulation: smoothed or constant strains.
        rows: of square cells.
        kind: of cells.
    """
    mesh = meshes.structured(meshes.strip(LONG, HIGH), along=10 * rows, rows=rows, kind=kind)
    model = bh.Model(mesh, SHEET, formulation="consistent").support("all", "z")
    model = model.support("edge:start", "x").support("corner:inner-start", "y")
    turns = [
        bh.Displace([int(i)], "x", -TURN * float(mesh.points[i, 1] - 0.5 * HIGH))
        for i in mesh.nodes("edge:end")
    ]
    model = model.step(*turns)
    system = formulation.system(model, load_steps(model)[0], None)
    beam = SHEET.E * SHEET.t * HIGH**3 / 12.0 * TURN**2 / (2.0 * LONG)
    return float(linear_response(system, system.start()).energy / beam)


def sectors(result: CaseResult, quick: bool) -> None:
    """Energy of App. B (a) on staggered meshes against the limit of all meshes, and with constant strains.

    Args:
        result: gets the checks.
        quick: without the finest meshes.
    """
    cases = [("consistent", size) for size in ((16, 1), (32, 2), (32, 4), (64, 4), (64, 8))]
    cases += [(ConstantStrain.name, size) for size in ((32, 4), (64, 12))]
    for formulation, (along, rows) in cases:
        if quick and rows > 4:
            continue
        path = folded(sector(along, rows, "staggered"), "a", 0.38, formulation)
        result.check(
            "energy of App. B (a), staggered",
            reached_energy(path),
            unit="N mm",
            reference=LIMIT,
            source="limit of all meshes, case convergence",
            params={"formulation": formulation, "along": along, "rows": rows},
            path=path,
        )
    ends = {
        name: reached_energy(folded(sector(16, 2, "staggered"), "a", 0.38, name))
        for name in (ConstantStrain.name, "linear-shell")
    }
    result.check(
        "energy of App. B (a) with constant strains",
        ends[ConstantStrain.name],
        unit="N mm",
        reference=ends["linear-shell"],
        source="the linear shell of fem, the same mesh",
        params={"along": 16, "rows": 2},
    )


def pressures(result: CaseResult, quick: bool) -> None:
    """Iterations that a cantilever takes which a pressure on its free edges blows round.

    Args:
        result: gets the checks.
        quick: the smallest pressure alone.
    """
    sheet, long = bh.Sheet(E=4000.0, nu=0.0, t=0.2), 60.0
    mesh = meshes.structured(meshes.strip(long, 6.0, [3.0], "flat"), kind="alternating", along=20, rows=1)
    held = bh.Model(mesh, sheet).support("edge:start", "xyz", clamp=True)
    for load in (2.0,) if quick else (2.0, 10.0, 20.0):
        pressure = bh.Pressure(load * sheet.bending_stiffness() / long**3)
        path = bh.trace(held.step(pressure), estimate=False, neighbours=False).require()
        params = {"p L^3 / D": load}
        result.check("iterations of a blown cantilever", path.iterations, params=params, path=path)


def couples(result: CaseResult, quick: bool) -> None:
    """How far a clamped strip twists under a couple about its axis, and bends in its plane under one across.

    Args:
        result: gets the checks.
        quick: the consistent formulation alone.
    """
    sheet, long, wide = bh.Sheet(E=4000.0, nu=0.3, t=0.2), 60.0, 10.0
    a = math.sqrt(24.0 * (1.0 - sheet.nu)) / wide * long
    rigidity = sheet.E / (2.0 + 2.0 * sheet.nu) * wide * sheet.t**3 / 3.0
    twist, bend = 1e-4, 0.01  # N mm
    twisted = twist * long * (1.0 - math.tanh(a) / a) / rigidity
    aside = bend * 45.0**2 / 2.0 / (sheet.E * sheet.t * wide**3 / 12.0)
    kinds: dict[str, tuple[int, int, Kind]] = {
        "consistent": (24, 4, "staggered"),
        "shell": (12, 2, "mirrored"),
    }
    for formulation in ("consistent",) if quick else ("consistent", "shell"):
        along, rows, kind = kinds[formulation]
        mesh = meshes.structured(meshes.strip(long, wide), along=along, rows=rows, kind=kind)
        model = bh.Model(mesh, sheet, formulation=formulation).support("edge:start", "xyz", clamp=True)
        params = {"formulation": formulation, "along": along, "rows": rows}
        end = mesh.nodes("edge:end")
        y = mesh.points[end, 1] - 0.5 * wide
        path = bh.trace(model.step(bh.Couple("edge:end", (twist, 0.0, 0.0)))).require()
        found = float(y @ path[-1].displacement("edge:end")[:, 2] / (y @ y))
        result.check(
            "twist of a strip under a couple",
            found,
            unit="rad",
            reference=twisted,
            source="Reissner (1952), a clamp that hinders warping",
            params=params,
            path=path,
        )
        path = bh.trace(model.step(bh.Couple("edge:end", (0.0, 0.0, bend)))).require()
        found = float(path[-1].displacement("near:45,5")[:, 1].mean())
        result.check(
            "bend of a strip in its plane under a couple",
            found,
            unit="mm",
            reference=aside,
            source="M x^2 / (2 E I)",
            params=params,
            path=path,
        )


def responses(result: CaseResult, quick: bool) -> None:
    """Stiffness at a corner, hinged and clamped; the buckling loads of the example; the strip that sways.

    Args:
        result: gets the checks.
        quick: with coarser meshes.
    """
    result.check("stiffness at a corner, clamped over hinged", clamped_over_hinged())
    mesh = meshes.structured(meshes.strip(60.0, 10.0, [5.0], "flat"), along=32, rows=2)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, nu=0.0, t=0.3), formulation="consistent")
    model = model.support("edge:start", "xyz").support("edge:end", "yz")
    press = bh.Displace("edge:end", "x", -0.01)
    euler = math.pi**2 * 0.3**2 / 12.0 / 60.0 / 0.01
    for number, mode in enumerate(buckling_modes(bh.Path(model), press, count=2), 1):
        result.check(
            "buckling factor of the example",
            mode.factor,
            reference=euler * number**2,
            source="Euler's column",
            params={"number": number},
        )
    found = response(
        arch(6 if quick else 24, 1 if quick else 4), "near:30,5", (0.0, 0.0, 1.0), -8.0, points=16
    )
    for peak in found.peaks[:1]:
        result.check("force at which a pressed arch sways", abs(peak.force), unit="N")
        result.check("way at which a pressed arch sways", abs(peak.displacement), unit="mm")


def clamped_over_hinged() -> float:
    """Stiffness of the far corner of a folded sector of 60 degrees across its plane, one end clamped or hinged."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, math.pi / 3.0), along=32, rows=2)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, nu=0.38, t=0.127), formulation="consistent")
    model = model.fold("crease", to=0.5 * math.pi)
    corner = [int(mesh.nodes("corner:outer-end")[0])]
    hinged = Probe(bh.trace(model), hold="edge:start").at(corner)
    held = bh.trace(model.step(hold="edge:start"))
    clamped = Probe(held).at(corner)
    return float(clamped.loaded((0.0, 0.0, 1.0)) / hinged.loaded((0.0, 0.0, 1.0)))


def arch(along: int, rows: int) -> bh.Model:
    """A strip that is buckled by 1 mm, with its middle free.

    Args:
        along: cells along it.
        rows: of cells a panel.
    """
    mesh = meshes.structured(meshes.strip(60.0, 10.0, [5.0]), along=along, rows=rows)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.3)).support("edge:start").support("edge:end", "yz")
    middle = "near:30,5"
    model = model.force(middle, each=(0.0, 0.0, 0.05)).displace("edge:end", "x", -1.0)
    return model.force(middle, each=(0.0, 0.0, 0.0))
