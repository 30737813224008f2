"""Discs folded along radial creases: cones with two states (`verification.theory.creased_cone`).

The state at rest is folded from the flat disc. Its middle is then pushed through while the creases are held at the rim, until it
snaps, and let go: the other state. Pushed back the same way it must come to rest where it began. The largest energy on
either way less that of the state it began in is the barrier to such a push; it is no closed form, so both models are compared.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bh import Displace, Fold, Model, Path, Sheet, trace
from bh.formulations.state import State
from meshes import SheetMesh
from meshes.curves import Arc
from verification.framework.checks import CaseResult, Context
from verification.studies.solver.published.common import Claim, Level, by_shell, converged
from verification.theory.creased_cone import ConeState, cone_state

SOURCE = "Lechenault and Adda-Bedia (2015), Andrade, Adda-Bedia and Dias (2019); the elastica on a sphere solved in verification.theory.creased_cone"
HOLE, RIM = 20.0, 100.0  # mm
SHEET = Sheet(E=4000.0, nu=0.0, t=0.05)
PSI = math.radians(60.0)  # fold angle
LEVELS = ((4, 4), (8, 8), (16, 16))  # cells of half a panel around, and from the hole to the rim
SHELL = (6, 4)
ENERGY, ELEVATION, BARRIER = 0.01, 0.5, 0.1  # relative, degrees, and relative to the shell; set before the first run
AGAIN = 1e-6  # relative difference of the energies at rest before and after
REST, PUSHED, SNAPPED, BACK, AGAIN_AT_REST = range(5)


@dataclass(frozen=True)
class Disc:
    """A disc with equal radial creases, in which case, and how far its middle is pushed against the rim.

    Attributes:
        creases: how many.
        push: of the hole's edge along z, mm, down.
    """

    creases: int
    push: float


DISCS = (Disc(4, 75.0), Disc(3, 75.0))


def disc_mesh(creases: int, half: int, rings: int) -> SheetMesh:
    """Rings whose radii grow by one factor, mirrored about every crease and every panel's middle.

    Args:
        creases: how many rays are creases, the first on the x axis.
        half: cells around in half a panel.
        rings: cells from the hole to the rim.
    """
    around = 2 * half * creases
    radii = HOLE * (RIM / HOLE) ** (np.arange(rings + 1) / rings)
    phase = 2.0 * math.pi * np.arange(around) / around
    points = np.array([(r * math.cos(p), r * math.sin(p)) for r in radii for p in phase])

    def node(ring: int, ray: int) -> int:
        return ring * around + ray % around

    triangles = []
    for ring in range(rings):
        for ray in range(around):
            a, b = node(ring, ray), node(ring, ray + 1)
            c, d = node(ring + 1, ray + 1), node(ring + 1, ray)
            first = (ray // half) % 2 == 0
            triangles += [(a, d, c), (a, c, b)] if first else [(a, d, b), (d, c, b)]
    rays = {f"ray-{i + 1}": 2 * half * i for i in range(creases)}
    sets = {
        f"crease:{name}": [(node(k, ray), node(k + 1, ray)) for k in range(rings)] for name, ray in rays.items()
    }
    for name, ring in (("inner", 0), ("outer", rings)):
        sets[f"edge:{name}"] = [(node(ring, k), node(ring, k + 1)) for k in range(around)]
    curves = {f"edge:{n}": Arc((0.0, 0.0), r, 0.0, 2.0 * math.pi) for n, r in (("inner", HOLE), ("outer", RIM))}
    return SheetMesh(
        points=points,
        triangles=np.array(triangles),
        edge_sets={name: np.array(pairs) for name, pairs in sets.items()},
        folds=dict.fromkeys(rays, "mountain"),
        curves=curves,
    )


def cone_model(disc: Disc, formulation: str, half: int, rings: int) -> Model:
    """Folded, pushed through, let go, pushed back and let go.

    Args:
        disc: which.
        formulation: by name.
        half: cells around in half a panel.
        rings: cells from the hole to the rim.
    """
    mesh = disc_mesh(disc.creases, half, rings)
    tips = [int(mesh.edge_sets[f"crease:{name}"][-1, 1]) for name in mesh.folds]
    model = Model(mesh, SHEET, formulation=formulation).support(tips, "z").support("rigid-body")
    model = model.step(*(Fold(name, to=math.pi - PSI) for name in mesh.folds))
    for push in (-disc.push, disc.push):
        model = model.step(Displace("edge:inner", "z", further=push)).step(release="edge:inner")
    return model


def elevations(state: State) -> tuple[float, float]:
    """Of the middles of the panels and of the creases, seen from the apex, mean over both, degrees.

    The apex lies where generators meet: each is a straight line from the hole to the rim.
    """
    mesh, points = state.mesh, state.points
    around = len(mesh.edge_sets["edge:inner"])
    inner, outer = points[:around], points[-around:]
    rise = np.degrees(np.arcsin((outer - inner)[:, 2] / np.linalg.norm(outer - inner, axis=1)))
    half = around // (2 * len(mesh.folds))
    turn = np.arange(around) % (2 * half)
    return float(rise[turn == half].mean()), float(rise[turn == 0].mean())


def creased_cones(result: CaseResult, context: Context) -> None:
    """Both states of discs with four and three creases; four in a quick run."""
    for disc in DISCS[:1] if context.quick else DISCS:
        levels = LEVELS[:2] if context.quick else LEVELS
        found = [(mesh, trace(cone_model(disc, "consistent", *mesh), neighbours=False)) for mesh in levels]
        shell = trace(cone_model(disc, "shell", *SHELL), neighbours=False)
        for step, snapped in ((REST, False), (SNAPPED, True)):
            exact = cone_state(disc.creases, PSI, snapped)
            params = {"sheet": f"{disc.creases} radial creases", "state": "snapped" if snapped else "at rest"}
            _state(result, params, exact, step, found, shell)
        _ways(result, disc, found[-1], shell)


def _end(path: Path, step: int) -> State | None:
    ends = [state for state in path if state.step == step and state.lam == 1.0]
    return ends[-1] if ends else None


def _energy(path: Path, step: int) -> float:
    state = _end(path, step)
    scale = SHEET.bending_stiffness() * math.log(RIM / HOLE)
    return math.nan if state is None else state.energy.total / scale


def _state(
    result: CaseResult,
    params: dict[str, str],
    exact: ConeState,
    step: int,
    found: list[tuple[tuple[int, int], Path]],
    shell: Path,
) -> None:
    energy = Claim("energy over B ln(R / r0)", exact.energy, SOURCE, ENERGY, params)
    converged(
        result, energy, [Level(f"{h} x {k} a half panel", 1.0 / h, _energy(path, step), path) for (h, k), path in found]
    )
    by_shell(result, energy, Level("{} x {} a half panel".format(*SHELL), 1.0, _energy(shell, step), shell))
    for formulation, path in (("consistent", found[-1][1]), ("shell", shell)):
        state = _end(path, step)
        seen = (math.nan, math.nan) if state is None else elevations(state)
        for what, value, angle in zip(("middle", "crease"), seen, (exact.middle, exact.crease), strict=True):
            result.check(
                f"elevation of the {what} less the closed form",
                value - math.degrees(angle),
                unit="degrees",
                reference=0.0,
                source=SOURCE,
                tolerance=ELEVATION,
                params={**params, "formulation": formulation},
                path=path,
            )
        result.check(
            "the state is stable",
            state is not None and state.stable is True,
            reference=1.0,
            source="Fourier modes (m^2 - 1)(m^2 - 1 + lambda) > 0",
            tolerance=0.0,
            params={**params, "formulation": formulation},
            path=path,
        )


def barrier(path: Path, begin: int) -> float:
    """Largest energy on the way from the end of a step to the other state, less that at its beginning, N mm."""
    first = _end(path, begin)
    way = [state.energy.total for state in path if state.step == begin + 1]
    return math.nan if first is None or not way else max(way) - first.energy.total


def _ways(result: CaseResult, disc: Disc, finest: tuple[tuple[int, int], Path], shell: Path) -> None:
    (half, rings), path = finest
    params = {"sheet": f"{disc.creases} radial creases", "formulation": "consistent", "mesh": f"{half} x {rings}"}
    for name, begin in (("from rest", REST), ("from the snapped state", SNAPPED)):
        result.check(
            f"barrier to a push of the middle, {name}",
            barrier(path, begin),
            unit="N mm",
            reference=barrier(shell, begin),
            source="the shell",
            tolerance=BARRIER,
            params=params,
            path=path,
        )
    for formulation, each in (("consistent", path), ("shell", shell)):
        result.check(
            "energy at rest after both ways over that before",
            _energy(each, AGAIN_AT_REST) / _energy(each, REST),
            reference=1.0,
            source="the same state",
            tolerance=AGAIN,
            params={**params, "formulation": formulation},
            path=each,
        )
