"""Starts and ends: exactly flat, a closed ring that must buckle, back to flat, and a sheet without supports enough."""

from __future__ import annotations

import math

import numpy as np

import meshes
from bh import Automatic, Model, ModelError, Path, Sheet, trace
from verification.framework.checks import CaseResult
from verification.studies.solver.hard_cases.common import annulus


def flat_start(result: CaseResult) -> None:
    """Exactly flat: mountain goes up, valley down, mirror images of each other."""
    up = trace(annulus().fold("crease", to=2.0))
    down = trace(annulus().fold("crease", to=2.0 * math.pi - 2.0))
    rise = [float(p[-1].crease_points("crease")[:, 2].mean() - p[-1].points[:, 2].mean()) for p in (up, down)]
    result.check(
        "flat start: mountain crease rises",
        rise[0] > 0.0,
        reference=1.0,
        source="convention",
        tolerance=0.0,
        path=up,
    )
    result.check(
        "flat start: valley over mountain energy",
        down[-1].energy.total / up[-1].energy.total,
        reference=1.0,
        source="mirror symmetry",
        tolerance=1e-9,
        path=down,
    )
    result.check(
        "flat start: rise of the valley over that of the mountain",
        rise[1] / rise[0],
        reference=-1.0,
        source="mirror symmetry",
        tolerance=1e-7,
        path=down,
    )


def ring(result: CaseResult) -> None:
    """A full annulus buckles out of its plane; both mirror images have one energy."""
    mesh = meshes.structured(meshes.full_annulus(100.0, 10.0), along=64)
    energies = []
    sheet = Sheet(E=4000.0, t=0.127)
    for to in (2.2, 2.0 * math.pi - 2.2):
        path = trace(Model(mesh, sheet, formulation="bars-and-hinges", contact=False).fold("crease", to=to))
        plane = _out_of_plane(path)
        energies.append(path[-1].energy.total)
        result.check(
            "ring: rms distance of the crease from its plane",
            plane,
            unit="mm",
            source="planar before it buckles",
            params={"dihedral": round(to, 4)},
            path=path,
        )
        result.check(
            "ring: out of plane", plane > 1.0, reference=1.0, source="must buckle", tolerance=0.0, path=path
        )
    result.check(
        "ring: energy of the mirror image",
        energies[1],
        unit="N mm",
        reference=energies[0],
        source="mirror symmetry",
        tolerance=1e-6,
    )
    planar = trace(
        Model(mesh, sheet, formulation="bars-and-hinges", contact=False).fold("crease", to=2.2),
        strategy=Automatic(at_bifurcation="primary"),
    )
    result.check(
        "ring, planar branch: rms distance of the crease from its plane",
        _out_of_plane(planar),
        unit="mm",
        reference=0.0,
        source="symmetry",
        tolerance=1e-9,
        path=planar,
    )
    result.check(
        "ring, planar branch: found unstable",
        planar.stable is False,
        reference=1.0,
        source="inertia",
        tolerance=0.0,
        path=planar,
    )
    result.check(
        "ring, planar branch: energy over the buckled one",
        planar[-1].energy.total / energies[0],
        source="above 1",
        path=planar,
    )
    _, first = planar.critical_points[0]
    fold = math.degrees(first.lam * (math.pi - 2.2))
    result.check(
        "ring, planar branch: fold angle where it loses its stability",
        fold,
        unit="degrees",
        source="bisection",
        params={"modes": first.negative[1]},
        path=planar,
    )


def _out_of_plane(path: Path) -> float:
    crease = path[-1].crease_points("crease")
    spread = np.linalg.svd(crease - crease.mean(axis=0), compute_uv=False)
    return float(spread[2]) / math.sqrt(len(crease))


def back_to_flat(result: CaseResult) -> None:
    """Fold to 60 degrees and unfold: nothing is left."""
    path = trace(annulus().fold("crease", to=math.pi / 3).fold("crease", to=math.pi))
    peak = max(state.energy.total for state in path)
    left = path[-1].energy.total / peak
    result.check(
        "fold and unfold: energy left over its peak",
        left,
        reference=0.0,
        source="elastic",
        tolerance=1e-10,
        path=path,
    )


def mechanism(result: CaseResult) -> None:
    """Missing supports are named with the motions that they leave."""
    said = ""
    try:
        trace(annulus().support("corner:inner-start", "xyz").fold("crease", to=2.0))
    except ModelError as error:
        said = str(error)
    named = "rotation about z" in said and "\n" not in said
    result.check(
        "mechanism: named with its motions", named, reference=1.0, source="one-line error", tolerance=0.0
    )
