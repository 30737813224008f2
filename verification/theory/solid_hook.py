"""Raasch's hook as a solid: linear elasticity in three dimensions with quadratic hexahedra (scikit-fem).

Half of its width: pushed along it, the middle plane moves along it alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray
from skfem.helpers import ddot, sym_grad, trace

from bh.runtime.threads import one_blas_thread
from verification.theory.curved_shells import HOOK, HOOK_WIDTH, hook_place, hook_stations

Array = NDArray[np.float64]
RIM = np.array(
    [0.0, 0.25, 0.6, 1.1, 1.8]
)  # thicknesses from a long edge: twist shears a strip through only there


def solid_hook(along: int, middle: int, through: int) -> tuple[float, int]:
    """Mean displacement of the hook's end face along the force that is spread over it.

    Args:
        along: cells along the hook.
        middle: cells from its edge's own to its middle plane.
        through: cells through its thickness.

    Returns:
        the displacement, and the number of unknowns.
    """
    stations = hook_stations(along)
    rim = RIM * HOOK.t / HOOK_WIDTH
    across = np.concatenate((rim, np.linspace(rim[-1], 0.5, middle + 1)[1:]))
    height = np.linspace(-0.5 * HOOK.t, 0.5 * HOOK.t, through + 1)
    block = skfem.MeshHex.init_tensor(stations, across, height)
    lifted = skfem.MeshHex2.from_mesh(block)
    x, y, angle = hook_place(lifted.doflocs[0])
    h = lifted.doflocs[2]
    bent = np.stack((x - h * np.sin(angle), y + h * np.cos(angle), HOOK_WIDTH * lifted.doflocs[1]))
    mesh = skfem.MeshHex2(bent, lifted.t)
    held = block.facets_satisfying(lambda at: np.isclose(at[0], 0.0))
    plane = block.facets_satisfying(lambda at: np.isclose(at[1], 0.5))
    pushed = block.facets_satisfying(lambda at: np.isclose(at[0], stations[-1]))
    element = skfem.ElementVector(skfem.ElementHex2())
    basis = skfem.Basis(mesh, element, intorder=4)
    mu = HOOK.E / (2.0 * (1.0 + HOOK.nu))
    lame = 2.0 * mu * HOOK.nu / (1.0 - 2.0 * HOOK.nu)

    def work(u: Any, v: Any, _: Any) -> Any:
        return 2.0 * mu * ddot(sym_grad(u), sym_grad(v)) + lame * trace(sym_grad(u)) * trace(sym_grad(v))

    def spread(v: Any, _: Any) -> Any:
        return v[2] / (HOOK_WIDTH * HOOK.t)

    with one_blas_thread():
        K = skfem.BilinearForm(work).assemble(basis)
        f = skfem.LinearForm(spread).assemble(skfem.FacetBasis(mesh, element, facets=pushed, intorder=4))
        fixed = basis.get_dofs(held).flatten(), basis.get_dofs(plane).all(["u^1", "u^2"])
        u = skfem.solve(*skfem.condense(K, f, D=np.unique(np.concatenate(fixed))))
    return 2.0 * float(f @ u), K.shape[0]  # half of the face is half of the force
