"""Shells that are not at rest as they are drawn: generalised strains and curvatures at rest, in one step.

The energy is that of the measures less those at rest. The mean e0 of a strain in a triangle is measured as the shell
measures its own, eps0_k = sum_ij Q_kij X_i . e0 X_j, so that a sheet that swells alike all over has no stress on curved
triangles either; what differs from the mean is projected (least squares by area). A curvature b0 is measured likewise:
kappa0_k = int sigma_k : b0 dA.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from bh.model.ramp import Ramp
from fem.sections import in_drawing
from fem.shell import ShellElements, maps
from fem.spaces import MOMENTS, STRAINS, barycentric

Array = NDArray[np.float64]
INSIDE = {1: 1, 2: 4}  # degree of the points inside for each degree of positions, as in `fem.spaces`
HALF = np.diag([1.0, 1.0, 0.5])  # strains (xx, yy, 2 xy) times these are a double contraction


@dataclass(frozen=True, eq=False)
class AtRest:
    """Measures at rest in a step, and their means in the axes of the drawing.

    Attributes:
        strain: (t, 3 m) generalised strains; curvature (t, 3 m) generalised curvatures.
        mean: (2, t, 3) strain and curvature of triangles, components xx, yy, 2 xy.
    """

    strain: Ramp
    curvature: Ramp
    mean: Ramp

    @property
    def rate(self) -> tuple[Array, Array]:
        """Their rates with lambda."""
        return self.strain.rate, self.curvature.rate


def at_rest(elements: ShellElements, growth: Ramp | None) -> AtRest | None:
    """Measures at rest of what a step asks for.

    Args:
        elements: of the sheet.
        growth: (2, t, 3, 3) strain and curvature at rest at the corners of triangles; None for none.
    """
    if growth is None:
        return None
    start, end = (_measures(elements, at) for at in (growth.start, growth.end))
    means = Ramp(growth.start.mean(axis=2), growth.end.mean(axis=2))
    return AtRest(Ramp(start[0], end[0]), Ramp(start[1], end[1]), means)


def _measures(elements: ShellElements, corners: Array) -> tuple[Array, Array]:
    table, mesh = elements.tables, elements.mesh
    F = maps(mesh, table.slopes)
    J = np.linalg.det(F)
    points = np.full((1, 2), 1.0 / 3.0) if mesh.degree == 1 else get_quadrature(RefTri, INSIDE[2])[0].T
    strain, curvature = np.einsum("qc,ktci->ktqi", barycentric(points), corners)
    mean = corners[0].mean(axis=1)
    functions = [
        (table.factors[..., None, None] * basis[:, None]).reshape(len(points), -1, 2, 2)
        for basis in (STRAINS, MOMENTS)
    ]
    area = table.weights * J
    e = in_drawing(F, functions[0], covariant=True)
    mass = np.einsum("tq,tqki,ij,tqlj->tkl", area, e, HALF, e, optimize=True)
    load = np.einsum("tq,tqki,ij,tqj->tk", area, e, HALF, strain - mean[:, None], optimize=True)
    m = in_drawing(F, functions[1], covariant=False) / (J**2)[..., None, None]
    bent = np.einsum("tq,tqki,tqi->tk", area, m, curvature, optimize=True)
    tensor = np.stack((mean[:, [0, 2]] * [1.0, 0.5], mean[:, [2, 1]] * [0.5, 1.0]), axis=1)
    X = mesh.planar[mesh.triangles]
    alike = np.einsum("kij,tia,tab,tjb->tk", table.Q, X, tensor, X, optimize=True)
    return alike + np.linalg.solve(mass, load[..., None])[..., 0], np.asarray(bent)
