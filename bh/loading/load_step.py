"""What a step is made of for a formulation: ramps a hinge and a node, and what creases are called."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.model.actuations import Array, Bar, Ramp, Tether
from bh.model.laws import HELD, SHEET
from bh.model.pinch import Pinched
from bh.model.supports import Constraints
from meshes import SheetMesh
from meshes.topology import Ints


@dataclass(frozen=True)
class StepProgram:
    """One step. Hinge arrays have one entry for each row of `mesh.topology.hinges`.

    Attributes:
        law: (m,) SHEET (uncreased), SPRING (elastic crease) or HELD (angle imposed exactly).
        stiffness: (m,) of spring creases a length, N mm / (mm rad).
        rest: rest dihedral angles of the springs, rad; start is nan where a held crease is released: the spring then
            begins with the moment that the crease has. `rest_ends` are those at the ends of each edge (m, 2), at the
            lower and the higher node, for a formulation whose angles vary along an edge.
        held: imposed dihedral angles, rad; start is nan where the angle at the start of the step is to be taken. What a
            pinch imposes depends on that angle, see `held_angles`.
        pinch: which held creases are pinched in this step, or were before.
        moment: couple a length that closes the dihedral angle below the sheet, N mm / mm.
        force: (n, 3) dead forces, N.
        constraints: supports and prescribed displacements.
        bodies: bars and tethers that act in this step.
    """

    law: NDArray[np.int64]
    stiffness: Array
    rest: Ramp
    rest_ends: Ramp
    held: Ramp
    pinch: Pinched
    moment: Ramp
    force: Ramp
    constraints: Constraints
    bodies: tuple[Bar | Tether, ...] = ()

    def held_angles(self, now: Array) -> Ramp:
        """Imposed angles for a step that begins with dihedral angles `now`, (m,) or (m, 2) at the ends of each edge."""
        ends = now.ndim == 2

        def spread(values: Array) -> Array:
            return np.repeat(values, 2).reshape(-1, 2) if ends else values

        start = spread(self.held.start)
        start = np.where(np.isnan(start), now, start)
        toward, base = spread(self.pinch.toward), spread(self.pinch.base)
        base = np.where(np.isnan(base), start, base)
        part = self.pinch.ends if ends else self.pinch.part
        return Ramp(start, np.where(np.isnan(toward), spread(self.held.end), base + part * (toward - base)))

    @property
    def rotation(self) -> float:
        """Largest change of an imposed or rest angle in this step, rad."""
        begin = np.where(np.isnan(self.pinch.toward), math.pi, self.pinch.present)
        held = np.where(np.isnan(self.held.start), begin, self.held.start)
        change = np.concatenate(
            (np.abs(self.held.end - held)[self.law == HELD], np.abs(np.nan_to_num(self.rest.rate)))
        )
        return float(change.max(initial=0.0))


@dataclass(frozen=True, eq=False)
class Ended:
    """Where a step ended before its actuations were complete.

    Attributes:
        lam: its control parameter there.
        points: (n, 3) node positions, mm.
        dihedral_angles: (m,) rad.
    """

    lam: float
    points: Array
    dihedral_angles: Array


def crease_hinges(mesh: SheetMesh, crease: str) -> Ints:
    """Rows of `mesh.topology.hinges` along a crease, in order."""
    found = edge_hinges(mesh, crease)
    return found[found >= 0]


def hinge_name(mesh: SheetMesh, hinge: int) -> str:
    """A row of `mesh.topology.hinges` in words: "crease 'NAME' (edge 3-7)", or "edge 3-7" off creases.

    Where several names share the edge (FOLD files name all mountains, and each chain of them) it is the shortest one.
    """
    a, b = mesh.topology.hinges[hinge, 1:3].tolist()
    on = [name for name in mesh.creases if hinge in crease_hinges(mesh, name)]
    if not on:
        return f"edge {a}-{b}"
    return f"crease '{min(on, key=lambda name: len(mesh.crease_edges(name)))}' (edge {a}-{b})"


def open_ends(mesh: SheetMesh, step: StepProgram) -> list[str]:
    """Where an imposed fold ends inside the sheet, one line each: no sheet can follow it there without a limit.

    The slopes have a dislocation at such a node and the curvature goes with 1 / r (docs/fem.md). An end that is faded
    out to a tenth of the largest angle, or that another crease goes on from, is none.
    """
    topology = mesh.topology
    angle = np.where(step.law == HELD, np.abs(math.pi - step.held.end), 0.0)
    ends = topology.hinges[:, 1:3]
    creased = np.bincount(ends[step.law != SHEET].ravel(), minlength=len(mesh.points))
    creased[topology.boundary.ravel()] = 0
    held = np.flatnonzero(angle > 0.1 * angle.max(initial=0.0))
    return [
        f"{hinge_name(mesh, hinge)} ends inside the sheet at node {node} with its angle imposed: the energy there "
        "has no limit under refinement; let the angle fade out, or give the crease a spring"
        for hinge in held.tolist()
        for node in ends[hinge].tolist()
        if creased[node] == 1
    ]


def edge_hinges(mesh: SheetMesh, crease: str) -> Ints:
    """Hinge of every edge of a crease, in order; -1 where the edge lies on the boundary."""
    topology = mesh.topology
    return topology.edge_hinges[topology.find_edges(mesh.crease_edges(crease))]
