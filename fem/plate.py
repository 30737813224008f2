"""The linear Kirchhoff plate, by two elements of scikit-fem: the limit of the nonlinear shell at small deflections.

They share nothing with the shell.

- Morley (1968): piecewise quadratic, nonconforming, int D [(1 - nu) H : H + nu tr(H)^2] / 2 with H the second
  derivatives.
- HHJ (Hellan 1967, Herrmann 1967, Johnson 1973): quadratic w, linear moments whose normal-normal component is
  continuous, not hybridised. With compliance C^-1 and f the load,

      int C^-1 m : t - b(t, w) = 0,  b(m, v) = int f v,  b(t, w) = sum_T [ int_T t : H - int_dT t_nn dw/dn ds ].

The edge is held by w = 0; where it is simply supported m_nn = 0 is imposed for HHJ and natural for Morley, where it is
clamped the other way round.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
import skfem
from numpy.typing import NDArray
from skfem.helpers import dd, ddot, dot, eye, grad, mul, trace

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Plate:
    """A plate of bending stiffness D (N mm) and Poisson's ratio nu, held all round.

    Attributes:
        D: bending stiffness, N mm.
        nu: Poisson's ratio.
        clamped: True for clamped edges, False for simply supported ones.
        pressure: N/mm^2.
        force: N, at the vertex nearest to `at`.
        at: (x, y) of the force, mm.
    """

    D: float
    nu: float
    clamped: bool
    pressure: float = 0.0
    force: float = 0.0
    at: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Deflection:
    """Deflection (n,) at the vertices of the mesh, mm, and elastic energy, N mm.

    Attributes:
        w: (n,) deflection at the vertices of the mesh, mm.
        energy: elastic energy, N mm.
    """

    w: Array
    energy: float


def morley(mesh: skfem.MeshTri, plate: Plate) -> Deflection:
    """Solve with Morley's element.

    Args:
        mesh: triangles, mm.
        plate: stiffness, support and load.
    """
    basis = skfem.Basis(mesh, skfem.ElementTriMorley(), intorder=4)

    def stiffness(u: Any, v: Any, _: Any) -> Any:
        return plate.D * ((1.0 - plate.nu) * ddot(dd(u), dd(v)) + plate.nu * trace(dd(u)) * trace(dd(v)))

    K, f = skfem.BilinearForm(stiffness).assemble(basis), _load(basis, mesh, plate)
    boundary = basis.get_dofs(mesh.boundary_facets())
    fixed = boundary.all() if plate.clamped else boundary.all("u")
    x = skfem.solve(*skfem.condense(K, f, D=fixed))
    return Deflection(x[basis.nodal_dofs[0]], 0.5 * float(f @ x))


def hhj(mesh: skfem.MeshTri, plate: Plate) -> Deflection:
    """Solve with the Hellan-Herrmann-Johnson element of second order.

    Args:
        mesh: triangles, mm.
        plate: stiffness, support and load.
    """
    moment, quadratic = skfem.ElementTriHHJ1(), skfem.ElementTriP2G()
    inside = skfem.Basis(mesh, moment, intorder=4)
    bending = skfem.Basis(mesh, quadratic, intorder=4)

    def compliance(m: Any, t: Any, _: Any) -> Any:
        factor = 1.0 / (plate.D * (1.0 - plate.nu**2))
        trace_part = eye(plate.nu * trace(m), 2)
        return factor * ddot((1.0 + plate.nu) * m - trace_part, t)

    def curvature(w: Any, t: Any, _: Any) -> Any:
        return ddot(t, dd(w))

    def kink(w: Any, t: Any, at: Any) -> Any:
        return -dot(at.n, mul(t, at.n)) * dot(grad(w), at.n)

    B = skfem.BilinearForm(curvature).assemble(bending, inside)
    interior = np.setdiff1d(np.arange(mesh.facets.shape[1]), mesh.boundary_facets())
    for facets, side in ((interior, 0), (interior, 1), (mesh.boundary_facets(), 0)):
        edges = [
            skfem.InteriorFacetBasis(mesh, e, facets=facets, side=side, intorder=4)
            for e in (quadratic, moment)
        ]
        # the normal is that of side 0 on both sides
        B = B + (1.0 - 2.0 * side) * skfem.BilinearForm(kink).assemble(*edges)
    f = _load(bending, mesh, plate)
    K = sp.bmat([[skfem.BilinearForm(compliance).assemble(inside), -B], [-B.T, None]], format="csr")
    fixed = bending.get_dofs(mesh.boundary_facets()).all() + inside.N
    if not plate.clamped:
        fixed = np.concatenate((fixed, inside.get_dofs(mesh.boundary_facets()).all()))
    x = skfem.solve(*skfem.condense(K, np.concatenate((np.zeros(inside.N), -f)), D=fixed))
    w = x[inside.N :]
    return Deflection(w[bending.nodal_dofs[0]], 0.5 * float(f @ w))


def _load(basis: skfem.Basis, mesh: skfem.MeshTri, plate: Plate) -> Array:
    def pressure(v: Any, _: Any) -> Any:
        return plate.pressure * v

    f: Array = skfem.LinearForm(pressure).assemble(basis)
    nearest = int(np.argmin(((mesh.p.T - plate.at) ** 2).sum(axis=1)))
    f[basis.nodal_dofs[0, nearest]] += plate.force
    return f
