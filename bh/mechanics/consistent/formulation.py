"""The consistent formulation: triangles of coupled bars and coupled hinges, which converge to Kirchhoff-Love theory.

Energy: 1/2 A t E:C:E of Green's strain E, smoothed over the edges of triangles, with plane stress of any Poisson's
ratio; and 1/2 A D ((1 - nu) kappa:kappa + nu tr(kappa)^2) with kappa = (1/A) sum_e L_e theta_e mu_e (x) mu_e of three
angles between the triangle and the sheet's tangent plane at its edges. docs/formulation.md derives it.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.remarks import Remark
from bh.formulations.state import Energy, State
from bh.loading.load_step import LoadStep
from bh.materials import Material
from bh.mechanics.consistent import remarks
from bh.mechanics.consistent.clamps import read_slopes
from bh.mechanics.consistent.derivatives import ConsistentDerivatives
from bh.mechanics.consistent.elements import LINEAR
from bh.mechanics.consistent.growth import hinge_shift
from bh.mechanics.consistent.kernels import TURN
from bh.mechanics.consistent.membrane import Measure, constant_strain, smoothed_strain
from bh.mechanics.consistent.resultants import resultants
from bh.mechanics.consistent.system import ConsistentSystem
from bh.mechanics.shared.base_system import refuse_outside
from bh.mechanics.shared.crease_curves import refuse_curves
from bh.mechanics.shared.density import to_triangles
from bh.mechanics.shared.kinematics import dihedral_angles
from bh.model.model import Model
from bh.model.refinement import Refinement

if TYPE_CHECKING:
    from bh.loading.symmetry import Mirror

Array = NDArray[np.float64]


class Consistent:
    """Formulation "consistent"."""

    name = "consistent"
    takes_nu = True
    refinement: Refinement | None = Refinement(
        "staggered", ((1.0, 0.171), (2.0, 0.066), (4.0, 0.017), (8.0, 0.0048)), 8.0, 1.9
    )

    def __init__(self, measure: Measure = smoothed_strain, material: Material = LINEAR) -> None:
        """What measures the strain of the sheet, and its material (E, nu and t are the sheet's)."""
        self.measure, self.material = measure, material

    def system(self, model: Model, load_step: LoadStep, start: State | None) -> ConsistentSystem:
        """The system of one step that begins at `start` (None: the stress-free sheet)."""
        return ConsistentSystem(model, load_step, start, None, self.measure, self.material)

    def half(self, model: Model, load_step: LoadStep, start: State | None, plane: Mirror) -> ConsistentSystem:
        """The system of the kept half of a symmetric sheet; `start` is a state of the whole."""
        return ConsistentSystem(model, load_step, start, plane, self.measure, self.material)

    def whole(
        self, whole: ConsistentSystem, half: ConsistentSystem, plane: Mirror, q: Array, lam: float
    ) -> Array:
        """Unknowns of the whole sheet from those of its half; rotations follow from the positions."""
        return _unknowns(whole, half.positions(q, lam), lam)

    def part(
        self, whole: ConsistentSystem, half: ConsistentSystem, plane: Mirror, q: Array, lam: float
    ) -> Array:
        """Unknowns of the half from those of the whole sheet."""
        return _unknowns(half, whole.positions(q, lam), lam)

    def derivatives(self, system: ConsistentSystem, q: Array, lam: float) -> ConsistentDerivatives:
        """Derivatives of a system by its element data at unknowns q (size,).

        Raises:
            ModelError: the material is not linear, panels are in contact, the sheet expands or couples.
        """
        if system.contact_blocks is not None:
            raise ModelError("sensitivities are those of a sheet without contact; set contact = False")
        if not (system.elements.stretching.constant and system.elements.bending.constant):
            raise ModelError("sensitivities are those of linear materials; this one has moduli that change")
        refuse_curves(system.curves)
        refuse_outside(system.load_step)
        if system.elements.coupling is not None:
            raise ModelError("sensitivities are those of sheets whose stretching and bending are not coupled")
        if system.elements.growth is not None:
            raise ModelError("sensitivities are those of sheets at rest as drawn; this one expands")
        return ConsistentDerivatives(system, q, lam)

    def remarks(self, model: Model) -> tuple[Remark, ...]:
        """What to know of the mesh and the loads of a model; empty where there is nothing to say."""
        return remarks.remarks(model)

    def observe(
        self,
        model: Model,
        system: ConsistentSystem,
        q: Array,
        lam: float,
        step: int = 0,
        stable: bool | None = None,
    ) -> State:
        """Everything that can be read from the unknowns `q` at `lam`.

        Dihedral angles of creases are those between the tangent planes of the sheet at both sides; elsewhere, where
        the sheet is smooth, they are those between the triangles.
        """
        e, mesh = system.elements, system.mesh
        topology = mesh.topology
        x = system.near(q, lam)
        now = system.internal(x, q[system.moving :], lam)
        _, M, S, L = system.split(now.forces)
        contact, rubbed = system.press_on(x, lam, now.f)
        stretching, bending = (
            system.stretching_by_triangle(x, lam),
            system.bending_by_triangle(now.theta, x, lam),
        )
        folding, dissipated = 0.5 * e.spring_stiffness * now.turns**2, 0.0
        if system.curves is not None:
            folding, dissipated = system.curves.held(e.spring_stiffness, now.turns)

        angles = dihedral_angles(x, topology.hinges)
        prescribed = ~np.isnan(e.prescribed.end)
        angles[prescribed] = e.prescribed.at(lam)[prescribed]
        angles[e.springs] = e.spring_rest.at(lam) + now.turns
        if e.growth is not None:
            angles[e.springs] -= hinge_shift(mesh, e.growth.theta.at(lam))[e.springs]
        moments = np.full(len(angles), np.nan)
        ends = mesh.points[topology.hinges[:, 1:3]]
        lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        moments[e.springs] = (S - e.couple.at(lam) + L[e.springs]) / lengths[e.springs]
        turning = (e.patches.kind == TURN) & (e.patches.hinge >= 0)
        by_hinge = np.zeros(len(angles))
        by_hinge[e.patches.hinge[turning]] = M[turning]
        moments[prescribed] = (by_hinge / lengths)[prescribed]
        slopes, couples = read_slopes(
            mesh, e.patches, now.theta, M, None if e.growth is None else e.growth.theta.at(lam)
        )
        return State(
            mesh=mesh, step=step, lam=lam, points=system.positions(q, lam),
            energy=Energy(
                float(stretching.sum()), float(bending.sum()), float(folding.sum()), now.lock, contact, dissipated,
                0.0 if system.outside is None else system.outside.spring_energy(x), rubbed,
            ),
            dihedral_angles=angles,
            energy_density={
                "stretching": stretching / mesh.areas,
                "bending": bending / mesh.areas,
                "folding": to_triangles(mesh, folding, topology.hinge_edges[e.springs]),
            },
            reactions=system.displacements.reactions(now.f - system.force.at(lam)),
            crease_moments=moments, stable=stable, edge_slopes=slopes, clamp_couples=couples,
            recover=partial(
                resultants, model.sections, mesh, e, self.material, x, now.theta, lam,
                None if system.load_step.changed is None else system.load_step.changed.at(lam),
            ),
            contact_forces=system.contact_forces(x, lam),
            crease_history=system.crease_history_at(q, lam) if system.yields else None,
        )  # fmt: skip


class ConstantStrain(Consistent):
    """The same with constant-strain triangles: the member that `linear-shell` of `fem` is the twin of.

    Stiff where the sheet is bent within its plane; asked for by `name`.
    """

    name = "bh.mechanics.consistent.formulation:ConstantStrain"
    refinement = None

    def __init__(self, material: Material = LINEAR) -> None:
        """The material (E, nu and t are the sheet's)."""
        super().__init__(constant_strain, material)


def _unknowns(system: ConsistentSystem, x: Array, lam: float) -> Array:
    return np.concatenate((system.displacements.unknowns(x), system.rotations_at(x, lam)))
