"""A closed ring folded along its circle: a saddle of constant crease curvature (`verification.theory.folded_ring`).

A quarter of it, from a crest to a trough, between two mirror planes. Energies are reported only: rulings
lean, so the isometric state would need a moment at the free edges, which a layer of width sqrt(t R) takes off
slowly with t. Height and curvature miss the 0.1 % that was set before the first run, and the checks say so;
the note has the figures.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import meshes
from bh import Model, Path, Sheet, trace
from bh.formulations.state import State
from verification.framework.checks import CaseResult, Context
from verification.studies.solver.published.common import Claim, Level, by_shell, converged
from verification.theory import folded_ring as theory

Array = NDArray[np.float64]
SOURCE = (
    "Dias, Dudte, Mahadevan and Santangelo (2012), Dias and Audoly (2014); the rod solved in "
    "verification.theory.folded_ring"
)
RADIUS, WIDTH = 100.0, 5.0  # mm
SHEET = Sheet(E=4000.0, nu=0.0, t=0.02)
ANGLES = (120.0, 90.0)  # dihedral, degrees
LEVELS = ((24, 1), (48, 2), (96, 4))  # cells along a quarter, rows a panel
SHELL = (48, 2)
HEIGHT = CURVATURE = 1e-3  # relative tolerances, set before the first run
APART = 1e-3  # relative, of the heights by the two models; asked after first results


def ring_model(angle: float, formulation: str, along: int, rows: int) -> Model:
    """A quarter of the ring, folded to a dihedral angle.

    Args:
        angle: degrees.
        formulation: by name.
        along: cells along the quarter.
        rows: of cells in each panel.
    """
    pattern = meshes.annulus_sector(RADIUS, WIDTH, 0.5 * math.pi)
    model = Model(
        meshes.structured(
            pattern, along=along, rows=rows, kind="mirrored" if formulation == "shell" else "staggered"
        ),
        SHEET,
        formulation=formulation,
    )
    model = model.support("edge:start", "y", clamp=True).support("edge:end", "x", clamp=True)
    return model.support("rigid-body").fold("crease", to=math.radians(angle))


def height(state: State) -> float:
    """From trough to crest of the crease, over R."""
    return float(np.ptp(state.crease_points("crease")[:, 2])) / RADIUS


def crease_curvature(state: State) -> Array:
    """(k,) curvature of the circles through three neighbouring nodes of the crease, 1 / mm."""
    p = state.crease_points("crease")
    a, b, c = p[1:-1] - p[:-2], p[2:] - p[1:-1], p[2:] - p[:-2]
    sides = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1) * np.linalg.norm(c, axis=1)
    return np.asarray(2.0 * np.linalg.norm(np.cross(a, b), axis=1) / sides)


NOTE = (
    "Closed ring: asked was 0.1 % of height and crease curvature. Heights are 0.4 % (120 degrees) and 0.2 % "
    "(90 degrees) off by the consistent formulation, 0.3 % and 0.2 % by the shell; mean curvatures 0.1 % and "
    "0.05 % (no order), 0.1 % and 0.2 % by the shell. Heights of the consistent formulation show no "
    "order on three meshes. That both models are "
    "on the same side and within 0.06 % of each other suggests the closed form's narrow isometric ring, not "
    "the meshes (its energy is 0.67 to 0.85 of that ring's); a narrower or thinner ring was not tried. That "
    "they are judged against each other as well was added after first results."
)


def closed_ring(result: CaseResult, _context: Context) -> None:
    """Two dihedral angles."""
    result.notes.append(NOTE)
    for angle in ANGLES:
        exact = theory.folded_ring(math.radians(angle))
        params = {"sheet": "ring", "dihedral angle": angle}
        high = Claim("height of the crease over R", exact.height, SOURCE, HEIGHT, params)
        bent = Claim("mean of kappa R sin(theta / 2) along the crease", 1.0, SOURCE, CURVATURE, params)
        found = [(n, rows, _solved(angle, "consistent", n, rows)) for n, rows in LEVELS]
        sine = math.sin(0.5 * math.radians(angle))
        converged(result, high, [_level(n, rows, path, height) for n, rows, path in found])
        converged(result, bent, [_level(n, rows, path, _turn(sine)) for n, rows, path in found])
        path = _solved(angle, "shell", *SHELL)
        by_shell(result, high, _level(*SHELL, path, height))
        by_shell(result, bent, _level(*SHELL, path, _turn(sine)))
        result.check(
            "height of the crease over that by the shell",
            height(found[-1][2][-1]) / height(path[-1]),
            reference=1.0,
            source="the shell",
            tolerance=APART,
            params=params,
            path=found[-1][2],
        )
        for formulation, last in (("consistent", found[-1][2]), ("shell", path)):
            _reported(result, {**params, "formulation": formulation}, last, exact.energy)


def _solved(angle: float, formulation: str, along: int, rows: int) -> Path:
    return trace(ring_model(angle, formulation, along, rows), neighbours=False)


def _turn(sine: float) -> Callable[[State], float]:
    return lambda state: float(crease_curvature(state).mean()) * RADIUS * sine


def _level(along: int, rows: int, path: Path, read: Callable[[State], float]) -> Level:
    return Level(f"{along} x {rows}", 1.0 / rows, read(path[-1]), path)


def _reported(result: CaseResult, params: dict[str, Any], path: Path, energy: float) -> None:
    """Energy over that of a narrow isometric ring, and how much the curvature varies."""
    state, sine = path[-1], math.sin(0.5 * math.radians(params["dihedral angle"]))
    bent = crease_curvature(state) * RADIUS * sine
    scale = SHEET.bending_stiffness() * WIDTH / RADIUS * energy
    result.check(
        "energy over that of the narrow isometric ring",
        4.0 * state.energy.total / scale,
        params=params,
        path=path,
    )
    result.check("least kappa R sin(theta / 2)", float(bent.min()), params=params, path=path)
    result.check("largest kappa R sin(theta / 2)", float(bent.max()), params=params, path=path)
    result.check(
        "the state is stable",
        path.stable is True,
        reference=1.0,
        source="asked",
        tolerance=0.0,
        params=params,
        path=path,
    )
