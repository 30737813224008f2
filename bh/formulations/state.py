"""One equilibrium state of a sheet, as the user reads it. The same names for every formulation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.stress import Resultants, Stress, stress_of
from bh.loading.load_step import crease_hinges
from bh.model.wide_crease import strip_fold
from meshes import SheetMesh

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Energy:
    """Elastic energy by kind, N mm (Eq. 3.1): bars, bending hinges, spring creases.

    Attributes:
        lock: what the locks of hinges hold that are about to close (`Model.hinge_lock`), zero otherwise. It is no part
            of the theory and of none of the others, but of what the actuation has done as work:
            work = change of (total + lock + contact + ground).
        dissipated: what creases that yield have used up, as `lock` no part of the others; work = change of
            (total + lock + contact + ground + dissipated + friction) where their angles are not imposed.
        ground: what springs to the ground hold (`bh.GroundSpring`), zero otherwise; apart like the locks.
        contact: what panels hold that press on each other (`Model.contact`), or that moulds press on, zero otherwise;
            apart like the locks.
        friction: what friction has used up (`Model.friction`), and holds where it sticks, zero otherwise; apart, too.
    """

    stretching: float
    bending: float
    folding: float
    lock: float = 0.0
    contact: float = 0.0
    dissipated: float = 0.0
    ground: float = 0.0
    friction: float = 0.0

    @property
    def total(self) -> float:
        """Elastic energy of the sheet without the locks, N mm (Eq. 3.1)."""
        return self.stretching + self.bending + self.folding

    def as_dict(self) -> dict[str, float]:
        """Elastic energies by kind and their total, N mm.

        Returns:
            N mm by kind; "total" is their sum.
        """
        return {
            "stretching": self.stretching,
            "bending": self.bending,
            "folding": self.folding,
            "total": self.total,
        }


@dataclass(frozen=True, eq=False, repr=False)
class State:
    """A solved state.

    Attributes:
        mesh: the stress-free sheet.
        step: index of the step, from 0; `lam` its control parameter in [0, 1].
        points: (n, 3) node positions, mm.
        energy: elastic energies, N mm.
        dihedral_angles: (m,) at every hinge of `mesh.topology.hinges`, rad in [0, 2 pi]; a closed one reads 0 or 2 pi.
        energy_density: by kind ("stretching", "bending", "folding") energy an area of each triangle, N mm / mm^2.
        reactions: (n, 3) forces that supports exert on the sheet, N; zero at free nodes.
        crease_moments: (m,) moment a length carried by each crease hinge, N mm / mm, nan off creases; positive
            where it works to open the dihedral angle below the sheet against the crease. Near closed with what the
            lock carries (`Model.hinge_lock`).
        contact_forces: force of every `Indenter` and `Mould` of the step on the sheet, (3,), N, by its name.
        edge_slopes: (e,) at edges of the boundary the angle from the triangle up to the sheet's tangent plane, rad, nan
            inside; and `clamp_couples` (e,) what clamps carry there, N mm. None where a formulation has no slopes, or
            keeps them otherwise.
        ended: the outcome where the path ended early at this state, such as "stalled": it is not what was asked for.
        stable: True if the tangent is positive definite there (False: not, None: not known).
        crease_history: (m, 2) permanent turn of creases that yield and the sum of its changes, rad, zero elsewhere;
            None where no crease of the sheet can yield.
        recover: what makes the resultants that `stress` is made of, when they are asked for; None where a formulation
            has none.
    """

    mesh: SheetMesh
    step: int
    lam: float
    points: Array
    energy: Energy
    dihedral_angles: Array
    energy_density: Mapping[str, Array]
    reactions: Array
    crease_moments: Array
    stable: bool | None = None
    contact_forces: Mapping[str, Array] = field(default_factory=dict)
    edge_slopes: Array | None = None
    clamp_couples: Array | None = None
    ended: str = ""
    recover: Callable[[], Resultants] | None = None
    crease_history: Array | None = None

    def __repr__(self) -> str:
        """One line: "State(step 0, lambda 1, energy 0.0534 N mm, stable)", or "..., ENDED EARLY: stalled)"."""
        stable = {True: ", stable", False: ", not stable", None: ""}[self.stable]
        ended = f", ENDED EARLY: {self.ended}" if self.ended else ""
        return f"State(step {self.step}, lambda {self.lam:.4g}, energy {self.energy.total:.4g} N mm{stable}{ended})"

    def dihedral(self, crease: str) -> Array:
        """Dihedral angles along a crease, one an edge in order, rad; of a wide crease see `fold_angle`.

        Returns:
            (edges,) in order along the crease, 0 to 2 pi, less than pi at a mountain.
        """
        if crease in self.mesh.wide_creases:
            return np.pi - self.fold_angle(crease)
        return self.dihedral_angles[crease_hinges(self.mesh, crease)]

    def fold_angle(self, crease: str) -> Array:
        """Fold angles pi - phi along a crease, one an edge in order, rad; mountain positive.

        Of a wide crease the angle between the panels on both sides of the strip, one an edge of its left line.

        Returns:
            (edges,) in order along the crease.
        """
        if crease in self.mesh.wide_creases:
            return strip_fold(self.mesh, crease, self.stress().curvature)
        return np.pi - self.dihedral(crease)

    def crease_moment(self, crease: str) -> Array:
        """Moment a length along a crease, one an edge in order, N mm / mm.

        Returns:
            (edges,) in order along the crease.
        """
        return self.crease_moments[crease_hinges(self.mesh, crease)]

    def permanent_fold(self, crease: str) -> Array:
        """Fold that a crease keeps when it is let go, one an edge in order, rad; mountain positive.

        It is what its rest angle has moved by since the sheet was made; zero where the crease has not yielded.

        Returns:
            (edges,) in order along the crease.
        """
        hinges = crease_hinges(self.mesh, crease)
        return np.zeros(len(hinges)) if self.crease_history is None else -self.crease_history[hinges, 0]

    def crease_points(self, crease: str) -> Array:
        """(k, 3) deformed nodes along a crease, in order, mm."""
        return self.points[self.mesh.nodes(f"crease:{crease}")]

    def displacement(self, at: str = "all") -> Array:
        """(k, 3) displacements of the nodes of a place, mm."""
        nodes = self.mesh.nodes(at)
        return self.points[nodes] - self.mesh.points[nodes]

    def reaction(self, at: str = "all") -> Array:
        """(3,) resultant of the reactions at a place, N."""
        total: Array = self.reactions[self.mesh.nodes(at)].sum(axis=0)
        return total

    def stress(self) -> Stress:
        """Strains, membrane forces, moments and stresses of every triangle; computed when it is asked for.

        Raises:
            ModelError: the formulation has none, or the stress-free sheet is not flat.
        """
        if self.recover is None:
            raise ModelError(
                "bars and hinges have no stress: a bar stands for more than one direction of the sheet; take consistent"
            )
        return stress_of(self.mesh, self.recover(), self.crease_moments)

    @property
    def strain(self) -> Array:
        """(e,) strain of every edge of the mesh: change of length over stress-free length."""
        ends = self.mesh.topology.edges
        before, now = (
            np.linalg.norm(x[ends[:, 1]] - x[ends[:, 0]], axis=1) for x in (self.mesh.points, self.points)
        )
        return np.asarray(now / before - 1.0)

    def nodal_energy_density(self, kind: str) -> Array:
        """(n,) energy density of a kind, averaged from the triangles to nodes by area, N mm / mm^2."""
        mesh = self.mesh
        density = self.energy_density[kind]
        weight = np.zeros(len(mesh.points))
        value = np.zeros(len(mesh.points))
        for corner in range(3):
            np.add.at(weight, mesh.triangles[:, corner], mesh.areas)
            np.add.at(value, mesh.triangles[:, corner], mesh.areas * density)
        return value / weight
