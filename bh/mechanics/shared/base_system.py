"""What every system of a supported sheet of triangles answers alike: positions, loads, and what to say of a state."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from bh.formulations.state import State
from bh.loading.load_step import StepProgram
from bh.mechanics.shared import penetration as closing
from bh.mechanics.shared.contact import Touching
from bh.mechanics.shared.displacements import Displacements
from bh.mechanics.shared.kinematics import dihedral_angles
from bh.mechanics.shared.motions import describe_motion
from bh.model.laws import HELD
from bh.model.model import Model
from bh.model.supports import TURNED
from bh.solvers.system import System, grows_ahead

if TYPE_CHECKING:
    from bh.loading.symmetry import Mirror

Array = NDArray[np.float64]


class SupportedSheet:
    """The part of `bh.solvers.System` that depends on nodes, triangles and supports only.

    Unknowns begin with the free displacements of the nodes in local axes (mm); what follows is the formulation's own.
    """

    size: int

    def __init__(
        self, model: Model, program: StepProgram, start: State | None, plane: Mirror | None = None
    ) -> None:
        self.mesh = model.mesh
        self.program = program
        self.force = program.force
        start_points = self.mesh.points if start is None else start.points
        if plane is None:
            self.displacements = Displacements(self.mesh, program.constraints, start_points)
        else:
            from bh.mechanics.shared.mirrored import MirroredDisplacements

            self.displacements = MirroredDisplacements(self.mesh, program.constraints, start_points, plane)
        self.constraints = self.displacements.constraints
        self.moving = len(self.displacements.free)
        if self.constraints.rigid_body:
            self.displacements.check_balance(self.force)
        self.touching = Touching(self.mesh, program.bodies, start_points) if program.bodies else None

    @property
    def rotation(self) -> float:
        return self.program.rotation

    def positions(self, q: Array, lam: float) -> Array:
        """(n, 3) node positions, mm."""
        return self.displacements.positions(q[: self.moving], lam)

    def vectors(self, dq: Array) -> Array:
        """(n, 3) changes of positions, mm, for changes dq (size,) of the unknowns."""
        return self.displacements.vectors(dq[: self.moving])

    def loads(self, forces: Array) -> Array:
        """(size,) what nodal forces (n, 3), N, are to the unknowns; their part along supports is left out."""
        out = np.zeros(self.size)
        out[: self.moving] = self.displacements.components(forces)
        return out

    def angles(self, q: Array, lam: float) -> Array:
        """(m,) dihedral angles between the triangles at every hinge of the mesh, rad."""
        return dihedral_angles(self.positions(q, lam), self.mesh.topology.hinges)

    def objection(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        return closing.objection(self.mesh, self.angles(q, lam), self.angles(q_new, lam_new))

    def crossing(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        return closing.crossing(self.mesh, self.angles(q, lam), self.angles(q_new, lam_new))

    def contact(self, q: Array, lam: float) -> str:
        """Which panels have met at a hinge that is not held, or an empty string."""
        reference = dihedral_angles(self.mesh.points, self.mesh.topology.hinges)
        return closing.touching(self.mesh, self.angles(q, lam), reference, self.program.law != HELD)

    def obstacle(self, q: Array, lam: float) -> tuple[str, str]:
        touching = self.contact(q, lam)
        if touching:
            return "contact", touching
        loaded = self.force.start.any() or self.force.end.any()
        turned = (
            self.constraints.rigid_body
            and loaded
            and grows_ahead(cast(System, self), q, lam, self._unbalanced)
        )
        return ("mechanism", TURNED) if turned else ("", "")

    def _unbalanced(self, q: Array, lam: float) -> float:
        return self.displacements.unbalanced(self.positions(q, lam), self.force.at(lam))

    def describe(self, q: Array, lam: float, motion: Array) -> str:
        return describe_motion(self.mesh, self.positions(q, lam), self.vectors(motion))
