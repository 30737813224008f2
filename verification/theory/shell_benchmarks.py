"""Nonlinear shell benchmarks with published values: Sze, Liu and Lo (2004), Finite Elements in Analysis and Design 40.

Units of the benchmarks as they stand; they are consistent, so read mm, N, MPa.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bh.model.model import Model
from bh.model.sheet import Sheet
from fem.loads import EdgeMoments
from meshes import Arc, SheetMesh

Array = NDArray[np.float64]

STRIP = Sheet(E=1.2e6, nu=0.0, t=0.1)  # width 1: E I = 100
STRIP_LENGTH, SHEAR_LENGTH = 12.0, 10.0
FULL_MOMENT = 50.0 * math.pi / 3.0  # rolls the strip of length 12 to a circle
SHEAR = {4.0: (3.286, 6.698)}  # end force: tip -u, w (table 1 of the paper)

RING = Sheet(E=21.0e6, nu=0.0, t=0.03)
RING_RADII, RING_LOAD = (6.0, 10.0), 0.8 * 4.0  # line force of 0.8 a length on the lip
RING_TABLE = {  # share of the load: deflection at the inner and the outer end of the lip
    0.1: (4.277, 5.876),
    0.2: (6.725, 9.160),
    0.5: (10.468, 13.768),
    1.0: (13.891, 17.528),
}


def grid(place: Callable[[Array, Array], Array], along: int, across: int, turned: bool = False) -> SheetMesh:
    """A structured mesh of the image of the unit square, diagonals alternating.

    Args:
        place: maps (k,) parameters u along and v across to (k, 2) points.
        along: cells in the direction of u.
        across: cells in the direction of v.
        turned: True where `place` reverses the orientation.

    Edge sets: "edge:start" (u = 0), "edge:end" (u = 1), "edge:rail-j"; corners "corner:low-end" and "corner:high-end".
    """
    u, v = np.meshgrid(np.linspace(0.0, 1.0, along + 1), np.linspace(0.0, 1.0, across + 1))
    node = np.arange(u.size).reshape(u.shape)
    triangles = []
    for j in range(across):
        for i in range(along):
            a, b, c, d = node[j, i], node[j, i + 1], node[j + 1, i + 1], node[j + 1, i]
            triangles += [(a, b, c), (a, c, d)] if (i + j) % 2 == 0 else [(a, b, d), (b, c, d)]
    cells = np.array(triangles)
    sets = {
        "edge:start": np.column_stack((node[:-1, 0], node[1:, 0])),
        "edge:end": np.column_stack((node[:-1, -1], node[1:, -1])),
    }
    for j in range(across + 1):
        sets[f"edge:rail-{j}"] = np.column_stack((node[j, :-1], node[j, 1:]))
    return SheetMesh(
        place(u.ravel(), v.ravel()),
        cells[:, ::-1] if turned else cells,
        edge_sets=sets,
        corners={"corner:low-end": int(node[0, -1]), "corner:high-end": int(node[-1, -1])},
    )


def rectangle(length: float, width: float, along: int, across: int = 1) -> SheetMesh:
    """A strip along x."""
    return grid(lambda u, v: np.column_stack((length * u, width * v)), along, across)


def slit_ring(along: int, across: int) -> SheetMesh:
    """A full annulus slit along the x axis, every circle of nodes a curve of its own."""
    inner, outer = RING_RADII

    def place(u: Array, v: Array) -> Array:
        radius = inner + (outer - inner) * v
        return np.column_stack((radius * np.cos(2.0 * math.pi * u), radius * np.sin(2.0 * math.pi * u)))

    mesh = grid(place, along, across, turned=True)
    curves = {
        f"edge:rail-{j}": Arc((0.0, 0.0), inner + (outer - inner) * j / across, 0.0, 2.0 * math.pi)
        for j in range(across + 1)
    }
    return SheetMesh(mesh.points, mesh.triangles, mesh.edge_sets, mesh.corners, curves=curves)


def clamped_sheet(mesh: SheetMesh, sheet: Sheet) -> Model:
    """Clamped at "edge:start"."""
    return Model(mesh, sheet, formulation="shell", contact=False).support("edge:start", "xyz", clamp=True)


def rolled_strip(along: int, steps: int = 3) -> tuple[Model, list[EdgeMoments]]:
    """The strip under an end moment, in steps of at most 120 degrees at the tip; cells of one shape at any `along`."""
    mesh = rectangle(STRIP_LENGTH, 1.0, along, max(1, along // 12))
    return with_couple(clamped_sheet(mesh, STRIP), FULL_MOMENT, steps)


def with_couple(model: Model, couple: float, steps: int) -> tuple[Model, list[EdgeMoments]]:
    """A model with a couple a length, N, at "edge:end", put on in equal steps."""
    moments = []
    for step in range(steps):
        model = model.force("corner:low-end", each=(0.0, 0.0, 0.0))  # a step has to act in some way
        ends = (couple * step / steps, couple * (step + 1) / steps)
        moments.append(EdgeMoments((("edge:end", *ends),)))
    return model, moments


def rolled_strip_exact(moment: float = FULL_MOMENT, rest: float = 0.0) -> tuple[float, float, float]:
    """Energy (N mm) and tip x, z (mm) of the strip under an end moment, exactly.

    That is for energies quadratic in Green's strain and in the second fundamental form.
    With stretch s, rotation a length r and the curvature k at rest the form is s r - k. Stationary energy:
    E A e s + E I (s r - k) r = 0 with e = (s^2 - 1) / 2, and E I (s r - k) s = M. A strip that is flat at rest shortens
    by t^2 r^2 / 12, 2e-4 here: the error of any theory that takes the sheet as thin.

    Args:
        moment: couple a length, N.
        rest: curvature of the strip at rest, 1/mm.
    """
    EI, EA, length = STRIP.E * STRIP.t**3 / 12.0, STRIP.E * STRIP.t, STRIP_LENGTH
    stretch = 1.0
    for _ in range(50):
        rate = (moment / (EI * stretch) + rest) / stretch
        bent = stretch * rate - rest
        strain = -EI / EA * bent * rate / stretch
        stretch = math.sqrt(1.0 + 2.0 * strain)
    energy = 0.5 * length * (EA * strain**2 + EI * bent**2)
    angle = rate * length
    return energy, stretch / rate * math.sin(angle), stretch / rate * (1.0 - math.cos(angle))


def sheared_strip(along: int) -> Model:
    """The strip under a dead end force."""
    model = clamped_sheet(rectangle(SHEAR_LENGTH, 1.0, along), STRIP)
    return model.force("edge:end", total=(0.0, 0.0, max(SHEAR)))


def pulled_ring(along: int, across: int) -> Model:
    """The slit ring, one step for each share of the load in the table."""
    model = clamped_sheet(slit_ring(along, across), RING)
    for share in RING_TABLE:
        model = model.force("edge:end", total=(0.0, 0.0, share * RING_LOAD))
    return model
