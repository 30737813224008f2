"""Starts and ends: exactly flat, a closed ring that must buckle, back to flat, and a sheet without supports enough."""

from __future__ import annotations

import math

import numpy as np

import meshes
from bh import Automatic, Model, ModelError, Path, Sheet, trace
from verification.framework.checks import CaseResult
from verification.studies.solver.hard_cases.common import Found, annulus, check


def flat_start(result: CaseResult) -> Found:
    """Exactly flat: mountain goes up, valley down, mirror images of each other."""
    up = trace(annulus().fold("crease", to=2.0))
    down = trace(annulus().fold("crease", to=2.0 * math.pi - 2.0))
    rise = [float(p[-1].crease_points("crease")[:, 2].mean() - p[-1].points[:, 2].mean()) for p in (up, down)]
    yield check("flat start: mountain crease rises", float(rise[0] > 0.0), "", 1.0, "convention", 0.0, up)
    yield check("flat start: valley over mountain energy", down[-1].energy.total / up[-1].energy.total, "", 1.0,
                 "mirror symmetry", 1e-9, down)  # fmt: skip
    yield check("flat start: rise of the valley over that of the mountain", rise[1] / rise[0], "", -1.0,
                 "mirror symmetry", 1e-7, down)  # fmt: skip


def ring(result: CaseResult) -> Found:
    """A full annulus buckles out of its plane; both mirror images have one energy."""
    mesh = meshes.structured(meshes.full_annulus(100.0, 10.0), along=64)
    energies = []
    sheet = Sheet(E=4000.0, t=0.127)
    for to in (2.2, 2.0 * math.pi - 2.2):
        path = trace(Model(mesh, sheet).fold("crease", to=to))
        plane = _out_of_plane(path)
        energies.append(path[-1].energy.total)
        yield check("ring: rms distance of the crease from its plane", plane, "mm", None,
                     "planar before it buckles", None, path, dihedral=round(to, 4))  # fmt: skip
        yield check("ring: out of plane", float(plane > 1.0), "", 1.0, "must buckle", 0.0, path)
    yield check("ring: energy of the mirror image", energies[1], "N mm", energies[0], "mirror symmetry", 1e-6)
    planar = trace(Model(mesh, sheet).fold("crease", to=2.2), strategy=Automatic(at_bifurcation="primary"))
    yield check("ring, planar branch: rms distance of the crease from its plane", _out_of_plane(planar), "mm", 0.0,
                 "symmetry", 1e-9, planar)  # fmt: skip
    yield check(
        "ring, planar branch: found unstable", float(planar.stable is False), "", 1.0, "inertia", 0.0, planar
    )
    yield check("ring, planar branch: energy over the buckled one", planar[-1].energy.total / energies[0], "", None,
                 "above 1", None, planar)  # fmt: skip
    _, first = planar.critical_points[0]
    fold = math.degrees(first.lam * (math.pi - 2.2))
    yield check("ring, planar branch: fold angle where it loses its stability", fold, "degrees", None,
                 "bisection", None, planar, modes=first.negative[1])  # fmt: skip


def _out_of_plane(path: Path) -> float:
    crease = path[-1].crease_points("crease")
    spread = np.linalg.svd(crease - crease.mean(axis=0), compute_uv=False)
    return float(spread[2]) / math.sqrt(len(crease))


def back_to_flat(result: CaseResult) -> Found:
    """Fold to 60 degrees and unfold: nothing is left."""
    path = trace(annulus().fold("crease", to=math.pi / 3).fold("crease", to=math.pi))
    peak = max(state.energy.total for state in path)
    left = path[-1].energy.total / peak
    yield check("fold and unfold: energy left over its peak", left, "", 0.0, "elastic", 1e-10, path)


def mechanism(result: CaseResult) -> Found:
    """Missing supports are named with the motions that they leave."""
    said = ""
    try:
        trace(annulus().support("corner:inner-start", "xyz").fold("crease", to=2.0))
    except ModelError as error:
        said = str(error)
    named = "rotation about z" in said and "\n" not in said
    yield check("mechanism: named with its motions", float(named), "", 1.0, "one-line error", 0.0)
