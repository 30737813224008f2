"""A sheet that is not at rest as it is drawn: strains and curvatures at rest, in one step.

Stretching: the energy of a cell is that of its strain less the one at rest, the mean of its triangles by area. With
constant moduli that is 1/2 gamma.K.gamma + N0.gamma + c, where N0 is linear and c quadratic in lambda.

Bending: three angles theta0 at the edges of a triangle have the curvature at rest, kappa0 = map theta0, and the energy
is that of theta - theta0. Each side of an edge can take its theta0 into its rotation, so that what is left is a change
of the rest angle of every hinge by both: a sheet that is curved at rest needs no elements of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.mechanics.consistent.patches import turned_strains
from bh.mechanics.consistent.stretching import Grown, Pair, Stretching
from bh.model.ramp import Ramp
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Growth:
    """Of one step.

    Attributes:
        strain: of cells with three and with five bars (c, 3), in their own axes.
        theta: (t, 3) angles at the edges of triangles that have their curvature at rest, rad.
        curvature: (t, 3) at rest, in the axes of the drawing, 1 / mm; `mean` (t, 3) the strain there.
        forces: (b,) N0 of the bars, N / mm.
        energies: c at lambda = 0, its mixed part, and at 1: c = (1 - l)^2 c0 + 2 l (1 - l) c01 + l^2 c1, N mm.
    """

    strain: tuple[Ramp, Ramp]
    theta: Ramp
    curvature: Ramp
    mean: Ramp
    forces: Ramp
    energies: tuple[float, float, float]

    def strains(self, lam: float) -> Pair:
        """Strains (c, 3) of both kinds of cells at rest."""
        return self.strain[0].at(lam), self.strain[1].at(lam)

    def at(self, lam: float) -> Grown:
        """What they do to the membrane."""
        first, mixed, last = self.energies
        constant = (1.0 - lam) ** 2 * first + 2.0 * lam * (1.0 - lam) * mixed + lam**2 * last
        return Grown(self.forces.at(lam), constant)

    def power(self, gamma: Array, lam: float) -> float:
        """Derivative of the energy of stretching by lambda at given gamma (b,), N mm.

        Args:
            gamma: (b,) of the bars, mm^2.
            lam: load parameter of the step, 0 to 1.
        """
        first, mixed, last = self.energies
        constant = -2.0 * (1.0 - lam) * first + 2.0 * (1.0 - 2.0 * lam) * mixed + 2.0 * lam * last
        return float(self.forces.rate @ gamma) + constant

    def second(self, gamma_rate: Array) -> float:
        """Second derivative of the energy by lambda, beside that of the bars' own and once the mixed one, N mm.

        Args:
            gamma_rate: (b,) rates of gamma with lambda.
        """
        first, mixed, last = self.energies
        return float(self.forces.rate @ gamma_rate) + 2.0 * (first - 2.0 * mixed + last)


def sheet_growth(
    mesh: SheetMesh, growth: Ramp | None, stretching: Stretching, maps: Array, angle: Array
) -> Growth | None:
    """Strains, angles and forces of what a step asks for.

    Args:
        mesh: of the sheet, flat.
        growth: (2, t, 3, 3) strain and curvature at rest at the corners of triangles; None for none.
        stretching: of the sheet.
        maps: (t, 3, 3) curvatures of triangles from the angles at their edges, in their own frames, 1 / mm.
        angle: (t,) of these frames to the drawing, rad.

    Raises:
        ModelError: the material has no constant moduli.
    """
    if growth is None:
        return None
    if not stretching.constant:
        raise ModelError(
            "a sheet expands with linear materials only; the moduli of this one change, so leave out expand"
        )
    means = [at.mean(axis=2) for at in (growth.start, growth.end)]
    cells = [_of_cells(mesh, stretching, strain) for strain, _ in means]
    bent = [turned_strains(curvature, angle, 0.5) for _, curvature in means]
    theta = [np.asarray(np.linalg.solve(maps, each[..., None])[..., 0], dtype=float) for each in bent]
    (N0, c0), (N1, c1) = (stretching.at_rest(each, each) for each in cells)
    mixed = stretching.at_rest(cells[0], cells[1])[1]
    return Growth(
        (Ramp(cells[0][0], cells[1][0]), Ramp(cells[0][1], cells[1][1])),
        Ramp(*theta),
        Ramp(means[0][1], means[1][1]),
        Ramp(means[0][0], means[1][0]),
        Ramp(N0, N1),
        (c0, mixed, c1),
    )


def hinge_shift(mesh: SheetMesh, theta: Array) -> Array:
    """(m,) by how much the rest angle of every hinge changes, rad: what both of its sides are bent at rest.

    Args:
        mesh: of the sheet.
        theta: (t, 3) angles at the edges of triangles at rest, rad.
    """
    total = np.bincount(mesh.topology.triangle_edges.ravel(), theta.ravel(), len(mesh.topology.edges))
    return np.asarray(total[mesh.topology.hinge_edges])


def with_growth(
    rest: Ramp, mesh: SheetMesh, growth: Growth | None, hinge: Ints, half_edge: Ints | None = None
) -> Ramp:
    """Rest angles of hinges of a sheet that is bent at rest, rad.

    Args:
        rest: of the same sheet without growth, of any shape, rad.
        mesh: of the sheet.
        growth: of the step; None leaves the angles as they are.
        hinge: rows of hinges, of that shape, -1 at clamps.
        half_edge: sides, 3 triangle + k, of that shape; where there are clamps.
    """
    if growth is None:
        return rest
    sides = np.zeros_like(hinge) if half_edge is None else half_edge
    ends = (rest.start, growth.theta.start), (rest.end, growth.theta.end)
    return Ramp(
        *(
            at + np.where(hinge >= 0, hinge_shift(mesh, theta)[hinge], theta.ravel()[sides])
            for at, theta in ends
        )
    )


def _of_cells(mesh: SheetMesh, stretching: Stretching, strain: Array) -> Pair:
    """Strains at rest of both kinds of cells in their own axes, from those of triangles (t, 3)."""
    three, five = stretching.membrane.cells
    beside = mesh.topology.edge_triangles[mesh.topology.hinge_edges]
    one, two = beside[five.source].T
    mean = five.share[:, None] * strain[one] + (1.0 - five.share[:, None]) * strain[two]
    points = mesh.points
    return (
        turned_strains(strain[three.source], three.angle(points), 0.5),
        turned_strains(mean, five.angle(points), 0.5),
    )
