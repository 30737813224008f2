"""What every system of a supported sheet of triangles answers alike: positions, loads, and what to say of a state."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.state import State
from bh.loading.load_step import LoadStep, crease_hinges
from bh.loading.tethers import NONE, Tethers, tethers
from bh.mechanics.shared import penetration as hinge_penetration
from bh.mechanics.shared.crease_curves import CreaseCurves
from bh.mechanics.shared.displacements import Displacements
from bh.mechanics.shared.kinematics import dihedral_angles, dihedral_gradients
from bh.mechanics.shared.outside import Outside
from bh.mechanics.shared.pressing import PressedSheet
from bh.model.constraints import MOTIONS, TURNED, rigid_motions
from bh.model.laws import PRESCRIBED, SHEET
from bh.model.model import Model
from bh.solvers.factor import Matrix
from bh.solvers.follower import FollowerMatrix
from bh.solvers.hinged import Stops
from bh.solvers.outcome import Outcome
from bh.solvers.system import System, grows_ahead
from meshes import SheetMesh
from meshes.topology import Ints

if TYPE_CHECKING:
    from bh.loading.symmetry import Mirror

Array = NDArray[np.float64]
TINIEST = 1e-300  # N; less is nothing


class SupportedSheet(PressedSheet):
    """The part of `bh.solvers.System` that depends on nodes, triangles and supports only.

    Unknowns begin with the free displacements of the nodes in local axes (mm); what follows is the formulation's own.
    """

    size: int
    curves: CreaseCurves | None = None  # None where all creases are straight lines
    tethers: Tethers  # in the place of supports that the step lets go of

    def __init__(
        self, model: Model, load_step: LoadStep, start: State | None, plane: Mirror | None = None
    ) -> None:
        """Unknowns, loads and bodies that press of the step.

        Args:
            model: the whole sheet.
            load_step: what is prescribed.
            start: the state that the step begins at; None for the stress-free sheet.
            plane: of the half, or None for the whole sheet.

        Raises:
            ModelError: supports leave nothing to move, or forces push a free sheet.
        """
        self.mesh = model.mesh
        self.load_step = load_step
        self.force = load_step.force
        start_points = self.mesh.points if start is None else start.points
        if plane is None:
            self.displacements = Displacements(self.mesh, load_step.constraints, start_points)
        else:
            from bh.mechanics.shared.mirrored import MirroredDisplacements

            self.displacements = MirroredDisplacements(self.mesh, load_step.constraints, start_points, plane)
        self.tethers = NONE
        if not load_step.bodies:
            self.displacements.bring_home()
        self.constraints = self.displacements.constraints
        self.moving = len(self.displacements.free)
        if self.constraints.rigid_body:
            self.displacements.check_balance(self.force)
        if model.stops_itself and plane is not None:
            raise ModelError("contact is solved on the whole sheet; leave out symmetry, or contact")
        acts = load_step.bodies or load_step.pressure is not None or load_step.ground is not None
        self.outside = Outside(self.mesh, load_step, start_points, self.displacements) if acts else None
        if self.constraints.rigid_body and load_step.pressure is not None:
            raise ModelError(
                "a pressure pushes a sheet that nothing holds as a whole; add supports or springs"
            )
        self.begin_contact(model, load_step, start, start_points)

    def _let_go(self, start: State | None, begin: Array, couples: Array | None = None) -> None:
        """Tethers for what the step lets go of, from unknowns `begin` on, and for `couples` (rotations,) of clamps."""
        if self.load_step.releases and start is not None:
            exerted = start.reactions - self.displacements.reactions(start.reactions)
            pull = self.displacements.components(exerted)
            pull = pull if couples is None else np.concatenate((pull, couples))
            self.tethers = tethers(begin, pull, self.moving, self.mesh.areas)

    @property
    def conservative(self) -> bool:
        """Is the residual the gradient of the energy? Not under a pressure on a sheet with free edges."""
        return self.outside is None or self.outside.conservative

    def _followed(self, matrix: Matrix, x: Array, lam: float) -> Matrix:
        """The tangent with the skew part of what follows the sheet at positions x (n, 3), where there is some."""
        if self.outside is None or self.conservative:
            return matrix
        skew = self.outside.skew(x, lam, self.size)
        return matrix if skew is None else FollowerMatrix(matrix, skew)

    def _outer_scale(self, load: Array, x: Array, lam: float) -> Array:
        """Forces whose size says what is small: dead loads (n, 3), and below them what acts from outside, N."""
        return load if self.outside is None else self.outside.scale(load, x, lam)

    @property
    def remembers(self) -> bool:
        """Does what it answers depend on states before (`bh.solvers.system.Remembering`)?"""
        return self.friction is not None or self.yields

    @property
    def yields(self) -> bool:
        """Do creases remember what they were turned by?"""
        return self.curves is not None and self.curves.remembers

    @property
    def history(self) -> Array:
        """(k, 2) of creases as they were accepted last, rad (`State.crease_history`), then of friction."""
        kept = self._kept if self.friction is not None else np.zeros((0, 2))
        return np.vstack((self._turned, kept))

    @property
    def _turned(self) -> Array:
        return self.curves.history if self.curves is not None and self.yields else np.zeros((0, 2))

    def history_at(self, q: Array, lam: float) -> Array:
        """(k, 2) what is remembered where a state is accepted; see `bh.solvers.system.Remembering`.

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        turned = self.crease_history_at(q, lam) if self.yields else np.zeros((0, 2))
        if self.friction is None:
            return turned
        return np.vstack((turned, self.friction.history_at(self.near(q, lam), lam)))

    def crease_history_at(self, q: Array, lam: float) -> Array:
        """(m, 2) the part of it that is of creases.

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        raise NotImplementedError

    def remember(self, history: Array) -> None:
        """Go on from a history (k, 2).

        Args:
            history: as `history_at` gives it.
        """
        count = len(self._turned)
        if self.curves is not None and self.yields:
            self.curves.history = history[:count]
        if self.friction is not None and len(history) > count:
            self._kept = history[count:]
            self.friction.remember(self._kept, len(self.mesh.points))

    def unsettled(self, history: Array) -> float:
        """By how much forces of friction still changed where a state was accepted (`bh.solvers.lagging.Lagging`).

        Args:
            history: (k, 2) of that state.
        """
        count = len(self._turned)
        return 0.0 if self.friction is None else self.friction.unsettled(history[count:])

    def takes(self, history: Array) -> bool:
        """Can a history (k, 2) from a file be one of this system?

        Args:
            history: that is asked about.
        """
        count = len(self._turned)
        if self.friction is None:
            return history.shape == (count, 2)
        return self.friction.fits(history[count:], len(self.mesh.points))

    @cached_property
    def rotation(self) -> float:
        """Largest change of an imposed or rest angle in the step, rad."""
        return self.load_step.rotation

    def positions(self, q: Array, lam: float) -> Array:
        """(n, 3) node positions, mm."""
        return self.displacements.positions(q[: self.moving], lam)

    def near(self, q: Array, lam: float) -> Array:
        """(n, 3) positions, mm, from an origin that is not far from the sheet, for all that is of differences only.

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        return self.displacements.near(q[: self.moving], lam)

    def rounding(self, q: Array, lam: float) -> float:
        """Largest force of rounding over the typical force of the state, see `bh.solvers.system.Rounded`."""
        x = self.near(q, lam)
        typical = typical_force(self._size(x, q, lam), self._outer_scale(self.force.at(lam), x, lam))
        return self._floor(x) / typical if typical > TINIEST else 0.0

    def noise(self, q: Array, lam: float) -> float:
        """Energy of rounding, N mm, see `bh.solvers.system.Rounded`: a force of rounding in as many edges as nodes."""
        return 0.5 * len(self.mesh.points) * self._floor(self.near(q, lam)) ** 2 / self._stiffest_edge

    @property
    def _stiffest_edge(self) -> float:
        """Largest stiffness of an edge, N / mm."""
        raise NotImplementedError

    def _floor(self, x: Array) -> float:
        """Largest force of rounding, N, at positions x (n, 3), that nobody can balance."""
        raise NotImplementedError

    def _size(self, x: Array, q: Array, lam: float) -> float:
        """Typical force of the elements, N, at positions x (n, 3) of unknowns q (size,)."""
        raise NotImplementedError

    def vectors(self, dq: Array) -> Array:
        """(n, 3) changes of positions, mm, for changes dq (size,) of the unknowns."""
        return self.displacements.vectors(dq[: self.moving])

    def loads(self, forces: Array) -> Array:
        """(size,) what nodal forces (n, 3), N, are to the unknowns; their part along supports is left out."""
        out = np.zeros(self.size)
        out[: self.moving] = self.displacements.components(forces)
        return out

    def angles(self, q: Array, lam: float) -> Array:
        """(m,) dihedral angles between the triangles at every hinge of the mesh, rad.

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        return dihedral_angles(self.near(q, lam), self.mesh.topology.hinges)

    def objection(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        """Why an increment between two states is not to be trusted, or an empty string."""
        if passed := self._passed(q, lam, q_new, lam_new):
            return passed
        asked = np.where(self.load_step.law == SHEET, 0.0, self.rotation * abs(lam_new - lam))
        return hinge_penetration.objection(self.mesh, self.angles(q, lam), self.angles(q_new, lam_new), asked)

    def penetration(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        """Which panels passed through each other between two states, or an empty string."""
        if passed := self._passed(q, lam, q_new, lam_new):
            return passed
        return hinge_penetration.penetration(self.mesh, self.angles(q, lam), self.angles(q_new, lam_new))

    def left_to_close(self, q: Array, q_new: Array, lam: float) -> float:
        """Least part of its way to closed that a hinge is left with, of those in the zone of the locks; 1 for none."""
        return hinge_penetration.left_to_close(self.angles(q, lam), self.angles(q_new, lam))

    def stops(self, q: Array, q_new: Array, lam: float) -> Stops:
        """Hinges that a step would close, or turn too far; see `bh.solvers.hinged.Hinged`."""
        return hinge_penetration.stops(self.angles(q, lam), self.angles(q_new, lam))

    def turning(self, q: Array, lam: float, hinges: Ints) -> Array:
        """(k, size) derivatives of the dihedral angles of some hinges of the mesh by the unknowns, rad / mm."""
        nodes = self.mesh.topology.hinges[hinges]
        gradients = dihedral_gradients(self.near(q, lam), nodes).reshape(-1, 4, 3)
        out = np.empty((len(hinges), self.size))
        for row, where, gradient in zip(out, nodes, gradients, strict=True):
            forces = np.zeros_like(self.mesh.points)
            forces[where] = gradient
            row[:] = self.loads(forces)
        return out

    def contact(self, q: Array, lam: float) -> str:
        """Which panels have met at a hinge that is not prescribed, or an empty string.

        Args:
            q: (n,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        reference = dihedral_angles(self.mesh.points, self.mesh.topology.hinges)
        return hinge_penetration.panels_in_contact(
            self.mesh, self.angles(q, lam), reference, self.load_step.law != PRESCRIBED
        )

    def obstacle(self, q: Array, lam: float) -> tuple[Outcome, str] | None:
        """Outcome and reason where panels have met or loads turn a free sheet; None where nothing is in the way."""
        touching = self.contact(q, lam)
        if touching:
            return Outcome.CONTACT, touching
        loaded = self.force.start.any() or self.force.end.any()
        turned = (
            self.constraints.rigid_body
            and loaded
            and grows_ahead(cast(System, self), q, lam, self._unbalanced)
        )
        return (Outcome.MECHANISM, TURNED) if turned else None

    def _unbalanced(self, q: Array, lam: float) -> float:
        return self.displacements.unbalanced(self.near(q, lam), self.force.at(lam))

    def describe(self, q: Array, lam: float, motion: Array) -> str:
        """A motion (size,) of the unknowns in words."""
        return describe_motion(self.mesh, self.positions(q, lam), self.vectors(motion))


def refuse_outside(load_step: LoadStep) -> None:
    """Raises `ModelError` where a step has what derivatives by the design do not know.

    Args:
        load_step: of the step.

    Raises:
        ModelError: a pressure, springs to the ground or couples on edges; one line.
    """
    if not (load_step.pressure is None and load_step.ground is None and load_step.edge_couple is None):
        raise ModelError(
            "sensitivities do not know pressure, springs to the ground and couples on edges; leave them out"
        )


def typical_force(size: float, load: Array) -> float:
    """The larger of the elements' typical force and the largest component of the loads, N, never 0.

    Args:
        size: typical force of the elements, N.
        load: (n, 3) on the nodes, N.
    """
    return max(size, float(np.abs(load).max(initial=0.0)), TINIEST)


def describe_motion(mesh: SheetMesh, x: Array, motion: Array) -> str:
    """What moves in `motion` (n, 3) at positions x (n, 3): the whole sheet, a crease, or a few nodes.

    A clause such as "crease 'a' turns" to be followed by how.

    Args:
        mesh: of the sheet.
        x: (nodes, 3) positions, mm.
        motion: (nodes, 3) of any length.
    """
    size = float(np.linalg.norm(motion))
    if size == 0.0:
        return "nothing moves"
    rigid = rigid_motions(x)
    rigid /= np.linalg.norm(rigid, axis=0)
    share, *_ = np.linalg.lstsq(rigid, motion.ravel() / size, rcond=None)
    if float(np.linalg.norm(rigid @ share)) > 0.99:
        named = " and ".join(MOTIONS[k] for k in np.flatnonzero(np.abs(share) > 0.3 * np.abs(share).max()))
        return f"the whole sheet moves ({named})"
    hinges = mesh.topology.hinges
    turn = np.einsum("hk,hk->h", dihedral_gradients(x, hinges), motion[hinges].reshape(-1, 12))
    total = float(turn @ turn)
    for crease in mesh.creases:
        if float((turn[crease_hinges(mesh, crease)] ** 2).sum()) > 0.5 * total:
            return f"crease '{crease}' turns"
    node = int(np.argmax(np.linalg.norm(motion, axis=1)))
    at = ", ".join(f"{c:.4g}" for c in x[node])
    return f"node {node} at ({at}) moves with its neighbours"
