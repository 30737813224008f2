"""What a step is for a formulation: ramps of every hinge and node; and what creases are called in messages."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.model.constraints import Constraints
from bh.model.hinge_laws import HingeLaw
from bh.model.laws import PRESCRIBED, SHEET
from bh.model.ramp import Ramp
from bh.model.step import Body
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Pinched:
    """Prescribed creases whose angles at the end of a step follow from those at its start.

    Attributes:
        toward: (m,) angle in the middle of the pinch, rad; nan where there is none.
        base: (m,) angle that the pinch goes from, rad; nan where it is the one that the step begins with.
        part: (m,) how far the edge goes from there to `toward`, and `ends` (m, 2) at its lower and its higher node.
        present: (m,) what the steps before make of the angle at the start, rad, for the size of increments only.
    """

    toward: Array
    base: Array
    part: Array
    ends: Array
    present: Array

    @classmethod
    def none(cls, hinges: int) -> Pinched:
        """No pinch on that many hinges."""
        empty = np.full(hinges, np.nan)
        return cls(empty, empty.copy(), np.zeros(hinges), np.zeros((hinges, 2)), np.full(hinges, np.pi))


@dataclass(frozen=True)
class LoadStep:
    """One step. Hinge arrays have one entry for each row of `mesh.topology.hinges`.

    Attributes:
        law: (m,) SHEET (uncreased), SPRING (elastic crease) or PRESCRIBED (angle imposed exactly).
        stiffness: (m,) of spring creases a length, N mm / (mm rad).
        rest: rest dihedral angles of the springs, rad; start is nan where a prescribed crease is released: the
            spring then begins with the moment that the crease has. `rest_ends` are those at the ends of each edge
            (m, 2), at the lower and the higher node, for a formulation whose angles vary along an edge.
        prescribed: imposed dihedral angles, rad; start is nan where the angle at the start of the step is to be taken.
            What a pinch imposes depends on that angle, see `prescribed_angles`.
        pinch: which prescribed creases are pinched in this step, or were before.
        moment: couple a length that closes the dihedral angle below the sheet, N mm / mm.
        force: (n, 3) dead forces, N.
        constraints: supports and prescribed displacements.
        bodies: indenters and tethers that act in this step.
        releases: supports are let go of, whose forces on the sheet go to zero during the step.
        curve: (m,) row of `laws` of creases whose moment is no straight line, else -1; None where there is none.
        laws: those laws.
        pressure: (t,) on the triangles along their normals, N / mm^2; None where there is none.
        edge_couple: (e,) dead couples a length on edges of the boundary, N mm / mm; None where there are none.
        ground: (n, 3) stiffness of springs along x, y and z to where nodes lie in the stress-free sheet, N / mm; None
            where there are none.
        freed: (m,) such creases whose angle was imposed up to here; what imposed it fades out during the step.
        growth: (2, t, 3, 3) strain and curvature (1 / mm) at which triangles are at rest, at their corners, components
            xx, yy, 2 xy in the axes of the drawing; None for a sheet that is at rest as it is drawn.
        changed: (t,) change of temperature or moisture that is in `growth`; None with it.
    """

    law: NDArray[np.int64]
    stiffness: Array
    rest: Ramp
    rest_ends: Ramp
    prescribed: Ramp
    pinch: Pinched
    moment: Ramp
    force: Ramp
    constraints: Constraints
    bodies: tuple[Body, ...] = ()
    releases: bool = False
    curve: Ints | None = None
    laws: tuple[HingeLaw, ...] = ()
    freed: NDArray[np.bool_] | None = None
    pressure: Ramp | None = None
    edge_couple: Ramp | None = None
    ground: Array | None = None
    growth: Ramp | None = None
    changed: Ramp | None = None

    def prescribed_angles(self, now: Array) -> Ramp:
        """Imposed angles for a step that begins with dihedral angles `now`, (m,) or (m, 2) at the ends of each edge."""
        ends = now.ndim == 2

        def spread(values: Array) -> Array:
            return np.repeat(values, 2).reshape(-1, 2) if ends else values

        start = spread(self.prescribed.start)
        start = np.where(np.isnan(start), now, start)
        toward, base = spread(self.pinch.toward), spread(self.pinch.base)
        base = np.where(np.isnan(base), start, base)
        part = self.pinch.ends if ends else self.pinch.part
        return Ramp(
            start, np.where(np.isnan(toward), spread(self.prescribed.end), base + part * (toward - base))
        )

    @property
    def rotation(self) -> float:
        """Largest change of an imposed or rest angle in this step, rad."""
        begin = np.where(np.isnan(self.pinch.toward), math.pi, self.pinch.present)
        prescribed = np.where(np.isnan(self.prescribed.start), begin, self.prescribed.start)
        change = np.concatenate(
            (
                np.abs(self.prescribed.end - prescribed)[self.law == PRESCRIBED],
                np.abs(np.nan_to_num(self.rest.rate)),
            )
        )
        return float(change.max(initial=0.0))


@dataclass(frozen=True, eq=False)
class StepEnd:
    """Where a step ended.

    Attributes:
        lam: its control parameter there.
        points: (n, 3) node positions, mm.
        dihedral_angles: (m,) rad.
    """

    lam: float
    points: Array
    dihedral_angles: Array


def same_until_here(one: LoadStep, other: LoadStep) -> bool:
    """Whether two load steps ask for the same, so that a state of the one is a state of the other.

    Args:
        one: of a stored model.
        other: of another model on the same mesh.
    """

    def alike(a: object, b: object) -> bool:
        if isinstance(a, np.ndarray) is not isinstance(b, np.ndarray):
            return False
        if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
            return np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
        if isinstance(a, Ramp | Pinched | Constraints) and type(a) is type(b):
            return all(alike(x, y) for x, y in zip(vars(a).values(), vars(b).values(), strict=True))
        return bool(a == b)

    return all(alike(a, b) for a, b in zip(vars(one).values(), vars(other).values(), strict=True))


def crease_hinges(mesh: SheetMesh, crease: str) -> Ints:
    """Rows of `mesh.topology.hinges` along a crease, in order.

    Args:
        mesh: has the crease.
        crease: its name.

    Returns:
        (k,) rows, in order along the crease.
    """
    found = edge_hinges(mesh, crease)
    return found[found >= 0]


def hinge_name(mesh: SheetMesh, hinge: int) -> str:
    """A row of `mesh.topology.hinges` in words: "crease 'NAME' (edge 3-7)", or "edge 3-7" off creases.

    Where several names share the edge (FOLD files name all mountains, and each chain of them) it is the shortest one.

    Args:
        mesh: has the hinge.
        hinge: row of `mesh.topology.hinges`.
    """
    a, b = mesh.topology.hinges[hinge, 1:3].tolist()
    on = [name for name in mesh.creases if hinge in crease_hinges(mesh, name)]
    if not on:
        return f"edge {a}-{b}"
    return f"crease '{min(on, key=lambda name: len(mesh.crease_edges(name)))}' (edge {a}-{b})"


def open_ends(mesh: SheetMesh, step: LoadStep) -> list[str]:
    """Where an imposed fold ends inside the sheet, one line each: no sheet can follow it there without a limit.

    The slopes have a dislocation at such a node and the curvature goes with 1 / r (docs/fem.md). An end that is faded
    out to a tenth of the largest angle, or that another crease goes on from, is none.

    Args:
        mesh: of the sheet.
        step: that is asked about.

    Returns:
        the lines, none where every fold ends well.
    """
    topology = mesh.topology
    angle = np.where(step.law == PRESCRIBED, np.abs(math.pi - step.prescribed.end), 0.0)
    ends = topology.hinges[:, 1:3]
    creased = np.bincount(ends[step.law != SHEET].ravel(), minlength=len(mesh.points))
    creased[topology.boundary.ravel()] = 0
    prescribed = np.flatnonzero(angle > 0.1 * angle.max(initial=0.0))
    return [
        f"{hinge_name(mesh, hinge)} ends inside the sheet at node {node} with its angle imposed: the energy there "
        "has no limit under refinement; let the angle fade out, or give the crease a spring"
        for hinge in prescribed.tolist()
        for node in ends[hinge].tolist()
        if creased[node] == 1
    ]


def edge_hinges(mesh: SheetMesh, crease: str) -> Ints:
    """Hinge of every edge of a crease, in order; -1 where the edge lies on the boundary.

    Args:
        mesh: has the crease.
        crease: its name.

    Returns:
        (edges of the crease,) rows, or -1.
    """
    topology = mesh.topology
    return topology.edge_hinges[topology.find_edges(mesh.crease_edges(crease))]
