"""Benchmarks of shells that are curved before they are loaded: pinched hemispheres, twisted strip, hook, opened ring.

Units of the benchmarks as they stand; they are consistent, so read mm, N, MPa.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bh.model.actuations import Force
from bh.model.model import Model
from bh.model.sheet import Sheet
from fem.kirchhoff_love import CurvedShell
from fem.loads import EdgeMoments
from meshes import SheetMesh
from meshes.curved import QuadraticMesh, lay_on
from verification.theory.shell_benchmarks import (
    FULL_MOMENT,
    STRIP,
    STRIP_LENGTH,
    clamped_sheet,
    grid,
    rectangle,
    rolled_strip_exact,
    with_couple,
)

Array = NDArray[np.float64]

HEMISPHERE = Sheet(E=6.825e7, nu=0.3, t=0.04)
RADIUS, HOLE = 10.0, math.radians(18.0)
PINCHED = {
    "hole of 18 degrees": 0.0940,
    "closed": 0.0924,
}  # under each of four forces of 2 (MacNeal and Harder 1985)
PINCH_TABLE = {  # share of four forces of 400: displacement outward of two, inward of two (Sze, Liu and Lo 2004)
    0.1: (1.499, 1.840),
    0.5: (3.406, 5.902),
    1.0: (4.067, 8.178),
}
PINCH = 400.0

TWISTED_LENGTH, TWISTED_WIDTH = 12.0, 1.1
TWISTED_E, TWISTED_NU = 29.0e6, 0.22
TWISTED = {  # thickness: force, displacement under it where the strip is wide along it (y) and where it is thin (z)
    0.32: (1.0, {"y": 1.754e-3, "z": 5.424e-3}),  # MacNeal and Harder (1985): beam theory
    0.0032: (1e-6, {"y": 1.294e-3, "z": 5.256e-3}),  # Simo, Fox and Rifai (1989)
}

HOOK = Sheet(E=3300.0, nu=0.35, t=2.0)
HOOK_RADII, HOOK_ANGLES, HOOK_WIDTH = (14.0, 46.0), (math.radians(60.0), math.radians(150.0)), 20.0
HOOK_TIP = 5.02  # Knight (1997): solid elements, under a force of 1 across the strip

RING_CURVATURE = 2.0 * math.pi / STRIP_LENGTH
OPENED = 0.75  # share of the couple that would make the ring straight


@dataclass(frozen=True, eq=False)
class Benchmark:
    """A surface that is not flat, and what is asked of it.

    Attributes:
        mesh: the stress-free surface.
        model: of `mesh.sheet`.
        at: nodes whose displacement is compared.
    """

    mesh: QuadraticMesh
    model: Model
    at: tuple[int, ...]

    @property
    def shell(self) -> CurvedShell:
        """The formulation that takes the surface."""
        return CurvedShell(self.mesh)


def _model(mesh: QuadraticMesh, sheet: Sheet) -> Model:
    return Model(mesh.sheet, sheet, formulation="shell", contact=False)


def _chart(along: int, across: int) -> SheetMesh:
    return grid(lambda u, v: np.column_stack((u, v)), along, across)


def open_hemisphere(cells: int, *shares: float) -> Benchmark:
    """A quarter of a hemisphere with a hole, pulled out along x and pushed in along y at its rim.

    Args:
        cells: along each side.
        *shares: of `PINCH`, a step each; none for one step under four forces of 2.
    """

    def surface(at: Array) -> Array:
        around, up = 0.5 * math.pi * at[:, 0], (0.5 * math.pi - HOLE) * at[:, 1]
        out = np.column_stack((np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)))
        return RADIUS * out

    mesh = lay_on(_chart(cells, cells), surface)
    model = _model(mesh, HEMISPHERE).support("corner:high-end", "z")
    return _pinched(mesh, model, ("edge:start", "edge:end"), shares)


def closed_hemisphere(cells: int) -> Benchmark:
    """The same without a hole: a quarter is an octant of the sphere, whose triangles are those of one cut into n^2.

    Args:
        cells: along each side, n.
    """
    rows = [[(i, j) for i in range(cells + 1 - j)] for j in range(cells + 1)]
    number = {place: k for k, place in enumerate(place for row in rows for place in row)}
    triangles = [
        [number[i + a, j + b] for a, b in corners]
        for corners in (((0, 0), (1, 0), (0, 1)), ((1, 0), (1, 1), (0, 1)))
        for i, j in number
        if all((i + a, j + b) in number for a, b in corners)
    ]
    sides = {
        "edge:start": [number[i, 0] for i in range(cells, -1, -1)],
        "edge:end": [number[0, j] for j in range(cells, -1, -1)],
    }
    sets = {name: np.column_stack((nodes[:-1], nodes[1:])) for name, nodes in sides.items()}
    chart = SheetMesh(np.array(list(number)) / cells, np.array(triangles), edge_sets=sets)

    def surface(at: Array) -> Array:
        weights = np.column_stack((at, 1.0 - at.sum(axis=1)))
        out = np.sin(0.5 * math.pi * weights)  # angles along the sides are alike
        return np.asarray(RADIUS * out / np.linalg.norm(out, axis=1, keepdims=True))

    mesh = lay_on(chart, surface)
    model = _model(mesh, HEMISPHERE).support([number[0, 0]], "z")
    return _pinched(mesh, model, ("edge:start", "edge:end"), ())


def _pinched(
    mesh: QuadraticMesh, model: Model, sides: tuple[str, str], shares: tuple[float, ...]
) -> Benchmark:
    """Both sides are planes of symmetry; half of each force acts on the quarter."""
    out, inward = (int(mesh.sheet.nodes(side)[0]) for side in sides)
    model = model.support(sides[0], "y", clamp=True).support(sides[1], "x", clamp=True)
    for force in [0.5 * PINCH * share for share in shares] or [1.0]:
        pull = Force(f"node:{out}", each=(force, 0.0, 0.0))
        model = model.step(pull, Force(f"node:{inward}", each=(0.0, -force, 0.0)))
    return Benchmark(mesh, model, (out, inward))


def twisted_strip(cells: int, thickness: float, direction: str) -> Benchmark:
    """A strip along x, clamped where it lies along y, that turns by 90 degrees to its end, where a force acts.

    Args:
        cells: along it.
        thickness: one of `TWISTED`.
        direction: of the force, "y" or "z".
    """

    def surface(at: Array) -> Array:
        angle, across = 0.5 * math.pi * at[:, 0], TWISTED_WIDTH * (at[:, 1] - 0.5)
        return np.column_stack((TWISTED_LENGTH * at[:, 0], across * np.cos(angle), across * np.sin(angle)))

    mesh = lay_on(_chart(cells, max(2, 2 * round(cells / 12))), surface)
    sheet = Sheet(E=TWISTED_E, nu=TWISTED_NU, t=thickness)
    force = np.where(np.array(["x", "y", "z"]) == direction, TWISTED[thickness][0], 0.0)
    ends = mesh.sheet.nodes("edge:end")
    model = clamped_sheet(mesh.sheet, sheet)
    return Benchmark(mesh, model.force("edge:end", total=tuple(force)), (int(ends[len(ends) // 2]),))


def hook_place(s: Array) -> tuple[Array, Array, Array]:
    """Where the middle line of the hook is at arc lengths s (k,): x, y and the angle of its tangent to x, rad."""
    (first, second), (turn, _) = HOOK_RADII, HOOK_ANGLES
    up, down = np.minimum(s / first, turn), np.maximum(s - first * turn, 0.0) / second
    angle = up - down
    x = first * np.sin(up) + second * (math.sin(turn) - np.sin(turn - down))
    y = first * (1.0 - np.cos(up)) + second * (np.cos(turn - down) - math.cos(turn))
    return x, y, angle


def hook_stations(cells: int) -> Array:
    """(cells + 1,) arc lengths along the hook, one of them where its two arcs meet."""
    lengths = [radius * angle for radius, angle in zip(HOOK_RADII, HOOK_ANGLES, strict=True)]
    meet = max(1, round(cells * lengths[0] / sum(lengths)))
    rest = np.linspace(lengths[0], sum(lengths), cells - meet + 1)[1:]
    return np.concatenate((np.linspace(0.0, lengths[0], meet + 1), rest))


def hook(along: int, across: int) -> Benchmark:
    """Raasch's hook: a strip along two arcs, clamped at one end, pushed along its width at the other.

    Args:
        along: cells along it.
        across: cells across it.
    """
    stations = hook_stations(along)

    def surface(at: Array) -> Array:
        x, y, _ = hook_place(at[:, 0])
        return np.column_stack((x, y, HOOK_WIDTH * at[:, 1]))

    def place(u: Array, v: Array) -> Array:
        return np.column_stack((stations[np.rint(u * along).astype(int)], v))

    mesh = lay_on(grid(place, along, across), surface)
    model = clamped_sheet(mesh.sheet, HOOK)
    tip = tuple(mesh.sheet.nodes("edge:end").tolist())
    return Benchmark(mesh, model.force("edge:end", total=(0.0, 0.0, 1.0)), tip)


def hook_beam(thin: bool) -> float:
    """Displacement of the hook's tip by the theory of curved beams (twist, bending and shear, Castigliano).

    Args:
        thin: with the torsion of a thin strip, w t^3 / 3, as a Kirchhoff-Love shell has it; else with
            Saint-Venant's, w t^3 / 3 (1 - 0.63 t / w (1 - t^4 / (12 w^4))), Timoshenko and Goodier's.
    """
    w, t, shear = HOOK_WIDTH, HOOK.t, HOOK.E / (2.0 * (1.0 + HOOK.nu))
    torsion = w * t**3 / 3.0 * (1.0 if thin else 1.0 - 0.63 * t / w * (1.0 - (t / w) ** 4 / 12.0))
    ends = hook_stations(2)
    (x_tip,), (y_tip,), _ = hook_place(ends[-1:])
    points, weights = np.polynomial.legendre.leggauss(20)
    total = 0.0
    for low, high in pairwise(ends):
        x, y, angle = hook_place(low + 0.5 * (high - low) * (points + 1.0))
        moment = np.stack((y_tip - y, x - x_tip))  # of a unit force along z
        twist = moment[0] * np.cos(angle) + moment[1] * np.sin(angle)
        bend = moment[1] * np.cos(angle) - moment[0] * np.sin(angle)
        flexible = twist**2 / (shear * torsion) + bend**2 / (HOOK.E * t * w**3 / 12.0) + 1.2 / (shear * w * t)
        total += 0.5 * (high - low) * float(weights @ flexible)
    return total


def opened_ring(along: int, steps: int = 3) -> tuple[Benchmark, list[EdgeMoments]]:
    """A strip that is a full circle when it is at rest, clamped at one end, opened by a couple at the other.

    Args:
        along: cells along it.
        steps: that the couple is put on in.
    """
    radius = 1.0 / RING_CURVATURE

    def surface(at: Array) -> Array:
        angle = at[:, 0] / radius
        return np.column_stack((radius * np.sin(angle), at[:, 1], radius * (1.0 - np.cos(angle))))

    mesh = lay_on(rectangle(STRIP_LENGTH, 1.0, along, max(1, along // 12)), surface)
    clamped = clamped_sheet(mesh.sheet, STRIP)
    model, moments = with_couple(clamped, -OPENED * FULL_MOMENT, steps)
    return Benchmark(mesh, model, tuple(mesh.sheet.nodes("edge:end").tolist())), moments


def opened_ring_exact() -> tuple[float, float, float]:
    """Energy (N mm) and tip x, z (mm) of the opened ring, exactly; see `shell_benchmarks.rolled_strip_exact`."""
    return rolled_strip_exact(-OPENED * FULL_MOMENT, RING_CURVATURE)
