"""The source's formulation: bars (Eq. 3.4), bending hinges (Eq. 3.11) and folding hinges (Eq. 3.12).

Energy (Eq. 3.1): 1/2 k_s delta^2 for bars, 1/2 k_b theta^2 and 1/2 k_f (phi - phi_R)^2 for hinges. A crease whose
angle is imposed exactly is a hinge with a multiplier (its moment), in augmented form (Hestenes 1969; Powell 1969).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.formulations.state import Energy, State
from bh.loading.load_step import StepProgram
from bh.mechanics.bars_and_hinges.system import BarsAndHingesSystem
from bh.mechanics.shared.hinge_lock import lock_terms
from bh.mechanics.shared.kinematics import dihedral_angles
from bh.model.model import Model
from meshes.topology import Ints

if TYPE_CHECKING:
    from bh.loading.symmetry import Mirror

Array = NDArray[np.float64]


class BarsAndHinges:
    """Formulation "bars-and-hinges"; Poisson's ratio of the sheet is taken as 0, as in the source (3.3.2)."""

    name = "bars-and-hinges"

    def system(self, model: Model, program: StepProgram, start: State | None) -> BarsAndHingesSystem:
        """The system of one step that begins at `start` (None: the stress-free sheet)."""
        return BarsAndHingesSystem(model, program, start)

    def half(
        self, model: Model, program: StepProgram, start: State | None, plane: Mirror
    ) -> BarsAndHingesSystem:
        """The system of the kept half of a symmetric sheet; `start` is a state of the whole."""
        return BarsAndHingesSystem(model, program, start, plane)

    def whole(
        self, whole: BarsAndHingesSystem, half: BarsAndHingesSystem, plane: Mirror, q: Array, lam: float
    ) -> Array:
        """Unknowns of the whole sheet from those of its half."""
        out = np.empty(whole.size)
        out[: whole.primal] = whole.displacements.unknowns(half.positions(q, lam))
        if whole.elements.held:
            at = np.full(len(plane.hinge), np.nan)
            kept = half.elements.source[-half.elements.held :]
            at[kept] = q[half.primal :] / plane.hinge_weight[kept]
            at = np.where(np.isnan(at), at[plane.hinge], at)
            out[whole.primal :] = at[whole.elements.source[-whole.elements.held :]]
        return out

    def part(
        self, whole: BarsAndHingesSystem, half: BarsAndHingesSystem, plane: Mirror, q: Array, lam: float
    ) -> Array:
        """Unknowns of the half from those of the whole sheet."""
        out = np.empty(half.size)
        out[: half.primal] = half.displacements.unknowns(whole.positions(q, lam))
        if half.elements.held:
            at = np.zeros(len(plane.hinge))
            at[whole.elements.source[-whole.elements.held :]] = q[whole.primal :]
            kept = half.elements.source[-half.elements.held :]
            out[half.primal :] = plane.hinge_weight[kept] * at[kept]
        return out

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
        x = system.positions(q, lam)
        _, _, f, forces, turn = system.internal_forces(x, q, lam)
        phi = dihedral_angles(x, e.hinges)
        s_bar, s_hinge = forces[: len(e.bars)], forces[len(e.bars) :]
        stretch = 0.5 * s_bar**2 / np.maximum(e.bar_stiffness, 1e-300)
        bend = slice(0, e.bending)
        spring = slice(e.bending, e.bending + e.spring)
        by_hinge = 0.5 * e.hinge_stiffness * turn**2
        by_lock = lock_terms(phi, e.lock)[:, 0].sum()
        density = {
            "stretching": to_triangles(model, stretch, np.arange(len(e.bars))),
            "bending": to_triangles(model, by_hinge[bend], mesh.topology.hinge_edges[e.source[bend]]),
            "folding": to_triangles(model, by_hinge[spring], mesh.topology.hinge_edges[e.source[spring]]),
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
            mesh=mesh, step=step, lam=lam, points=x,
            energy=Energy(
                float(stretch.sum()), float(by_hinge[bend].sum()), float(by_hinge[spring].sum()), float(by_lock)
            ),
            dihedral_angles=angles, energy_density=density, reactions=reactions,
            crease_moments=moments, stable=stable,
            pressing={} if system.touching is None else system.touching.pressing(x, lam),
        )  # fmt: skip


def to_triangles(model: Model, energy: Array, edges: Ints) -> Array:
    """Energy of edges shared by area among their triangles, as a density (t,), N mm / mm^2."""
    mesh = model.mesh
    sides = mesh.topology.edge_triangles[edges]
    areas = np.where(sides >= 0, mesh.areas[np.maximum(sides, 0)], 0.0)
    share = energy / areas.sum(axis=1)
    density = np.zeros(len(mesh.triangles))
    for side in range(2):
        inside = sides[:, side] >= 0
        np.add.at(density, sides[inside, side], share[inside])
    return density
