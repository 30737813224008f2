"""The source's formulation: bars (Eq. 3.4), bending hinges (Eq. 3.11) and folding hinges (Eq. 3.12).

Energy (Eq. 3.1): 1/2 k_s delta^2 for bars, 1/2 k_b theta^2 and 1/2 k_f (phi - phi_R)^2 for hinges. A crease whose
angle is imposed exactly is a hinge with a multiplier (its moment), in augmented form (Hestenes 1969; Powell 1969).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.remarks import Remark
from bh.formulations.state import Energy, State
from bh.loading.load_step import LoadStep
from bh.mechanics.bars_and_hinges import remarks
from bh.mechanics.bars_and_hinges.derivatives import BarHingeDerivatives
from bh.mechanics.bars_and_hinges.system import BarsAndHingesSystem
from bh.mechanics.shared.base_system import refuse_outside
from bh.mechanics.shared.crease_curves import refuse_curves
from bh.mechanics.shared.density import to_triangles
from bh.mechanics.shared.hinge_lock import lock_terms
from bh.mechanics.shared.kinematics import dihedral_angles
from bh.model.model import Model

if TYPE_CHECKING:
    from bh.loading.symmetry import Mirror

Array = NDArray[np.float64]


class BarsAndHinges:
    """Formulation "bars-and-hinges"; Poisson's ratio of the sheet is taken as 0, as in the source (3.3.2)."""

    name = "bars-and-hinges"
    takes_nu = False

    def system(self, model: Model, load_step: LoadStep, start: State | None) -> BarsAndHingesSystem:
        """The system of one step that begins at `start` (None: the stress-free sheet)."""
        return BarsAndHingesSystem(model, load_step, start)

    def half(
        self, model: Model, load_step: LoadStep, start: State | None, plane: Mirror
    ) -> BarsAndHingesSystem:
        """The system of the kept half of a symmetric sheet; `start` is a state of the whole."""
        return BarsAndHingesSystem(model, load_step, start, plane)

    def whole(
        self, whole: BarsAndHingesSystem, half: BarsAndHingesSystem, plane: Mirror, q: Array, lam: float
    ) -> Array:
        """Unknowns of the whole sheet from those of its half."""
        out = np.empty(whole.size)
        out[: whole.primal] = whole.displacements.unknowns(half.positions(q, lam))
        if whole.elements.prescribed:
            at = np.full(len(plane.hinge), np.nan)
            kept = half.elements.source[-half.elements.prescribed :]
            at[kept] = q[half.primal :] / plane.hinge_weight[kept]
            at = np.where(np.isnan(at), at[plane.hinge], at)
            out[whole.primal :] = at[whole.elements.source[-whole.elements.prescribed :]]
        return out

    def part(
        self, whole: BarsAndHingesSystem, half: BarsAndHingesSystem, plane: Mirror, q: Array, lam: float
    ) -> Array:
        """Unknowns of the half from those of the whole sheet."""
        out = np.empty(half.size)
        out[: half.primal] = half.displacements.unknowns(whole.positions(q, lam))
        if half.elements.prescribed:
            at = np.zeros(len(plane.hinge))
            at[whole.elements.source[-whole.elements.prescribed :]] = q[whole.primal :]
            kept = half.elements.source[-half.elements.prescribed :]
            out[half.primal :] = plane.hinge_weight[kept] * at[kept]
        return out

    def derivatives(self, system: BarsAndHingesSystem, q: Array, lam: float) -> BarHingeDerivatives:
        """Derivatives of a system by its element data at unknowns q (size,).

        Raises:
            ModelError: bars measure Green's strain, of which there are none, or panels are in contact.
        """
        if system.contact_blocks is not None:
            raise ModelError("sensitivities are those of a sheet without contact; set contact = False")
        refuse_curves(system.curves)
        refuse_outside(system.load_step)
        return BarHingeDerivatives(system, q, lam)

    def remarks(self, model: Model) -> tuple[Remark, ...]:
        """What to know of the mesh and the loads of a model; empty where there is nothing to say."""
        return remarks.remarks(model)

    def observe(
        self,
        model: Model,
        system: BarsAndHingesSystem,
        q: Array,
        lam: float,
        step: int = 0,
        stable: bool | None = None,
    ) -> State:
        """Everything that can be read from the unknowns `q` at `lam`."""
        e, mesh = system.elements, system.mesh
        x = system.near(q, lam)
        _, _, f, forces, turn = system.internal_forces(x, q, lam)
        contact, rubbed = system.press_on(x, lam, f)
        phi = dihedral_angles(x, e.hinges)
        s_bar, s_hinge = forces[: len(e.bars)], forces[len(e.bars) :]
        stretch = 0.5 * s_bar**2 / np.maximum(e.bar_stiffness, 1e-300)
        bend = slice(0, e.bending)
        spring = slice(e.bending, e.bending + e.spring)
        by_hinge, dissipated = 0.5 * e.hinge_stiffness * turn**2, 0.0
        if system.curves is not None:
            by_hinge[spring], dissipated = system.curves.held(e.hinge_stiffness[spring], turn[spring])
        by_lock = lock_terms(phi, e.lock)[:, 0].sum()
        density = {
            "stretching": to_triangles(mesh, stretch, np.arange(len(e.bars))),
            "bending": to_triangles(mesh, by_hinge[bend], mesh.topology.hinge_edges[e.source[bend]]),
            "folding": to_triangles(mesh, by_hinge[spring], mesh.topology.hinge_edges[e.source[spring]]),
        }
        angles = np.empty(len(e.hinges))
        angles[e.source] = phi
        moments = np.full(len(e.hinges), np.nan)
        crease = slice(e.bending, None)
        elastic = s_hinge.copy()  # of springs the spring's own moment, without the couple applied to it
        elastic[spring] -= e.couple.at(lam)[spring]
        moments[e.source[crease]] = elastic[crease] / system.hinge_lengths[crease]
        reactions = system.displacements.reactions(f - system.force.at(lam))
        return State(
            mesh=mesh, step=step, lam=lam, points=system.positions(q, lam),
            energy=Energy(
                float(stretch.sum()), float(by_hinge[bend].sum()), float(by_hinge[spring].sum()), float(by_lock),
                contact, dissipated, 0.0 if system.outside is None else system.outside.spring_energy(x), rubbed,
            ),
            dihedral_angles=angles, energy_density=density, reactions=reactions,
            crease_moments=moments, stable=stable,
            contact_forces=system.contact_forces(x, lam),
            crease_history=system.crease_history_at(q, lam) if system.yields else None,
        )  # fmt: skip
