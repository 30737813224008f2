"""Mid-plane of a folded sheet with parallel creases, and how far it bends and twists (source Fig. 5.8).

At each place along the creases the mid-plane is the line from the middle of the first outer panel to that of the last:
halfway between the edge "inner" and the first crease, and halfway between the last crease and the edge "outer".
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.errors import ModelError
from bh.formulations.state import State
from bh.runtime.one_line import OneLine
from meshes import SheetMesh
from meshes.curves import arc_lengths, interpolated

Array = NDArray[np.float64]
STATIONS = 201
NEAR = 0.02  # of the length, on each side of a place, for the direction of the mid-line there


@dataclass(frozen=True, eq=False, repr=False)
class MidPlane(OneLine):
    """The mid-plane at k stations.

    Attributes:
        u: (k,) parts of the length from the edge "start", 0 to 1.
        inner: (k, 3) inner ends of its lines, mm.
        outer: (k, 3) outer ends of its lines, mm.
    """

    u: Array
    inner: Array
    outer: Array

    @property
    def centre(self) -> Array:
        """(k, 3) the mid-line, mm."""
        return np.asarray(0.5 * (self.inner + self.outer))

    def bending(self, at: float = 0.5) -> float:
        """Angle between the lines from the centre at `at` to both ends, rad; pi if the mid-line is straight.

        `at` is a part of the length, 0 to 1.
        """
        start, here, end = self._at(self.centre, [0.0, at, 1.0])
        a, b = start - here, end - here
        return math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b))

    def twist(self, u: ArrayLike = 1.0, at: float = 0.5) -> Array:
        """Angles between the lines at `u` and the plane of the mid-line and of the line at `at`, rad, shaped as u.

        Positive where the outer side rises above that plane. The source measures from the plane of the unfolded
        sheet, in which its supports keep the section at the pinch.

        Args:
            u: shares of the crease's length, 0 to 1.
            at: share at which the pinch is.

        Returns:
            of the shape of `u`.
        """
        across = self.outer - self.inner
        across = across / np.linalg.norm(across, axis=1)[:, None]
        before, behind = self._at(self.centre, [max(at - NEAR, 0.0), min(at + NEAR, 1.0)])
        (here,) = self._at(across, [at])
        normal = np.cross(behind - before, here)
        normal /= np.linalg.norm(normal)
        where = np.atleast_1d(np.asarray(u, dtype=float)).ravel()
        lines = self._at(across, where.tolist())
        lines /= np.linalg.norm(lines, axis=1)[:, None]
        angles = np.arcsin(np.clip(lines @ normal, -1.0, 1.0))
        return np.asarray(angles.reshape(np.shape(u)))

    def _at(self, values: Array, u: list[float]) -> Array:
        return np.column_stack([np.interp(u, self.u, values[:, axis]) for axis in range(3)])


def midplane(state: State, stations: int = STATIONS) -> MidPlane:
    """The mid-plane of a solved sheet whose creases run from its edge "start" to its edge "end".

    Args:
        state: of a path.
        stations: how many lines.

    Raises:
        MeshError: the sheet has no edges "inner" and "outer".
        ModelError: it has no crease.
    """
    mesh = state.mesh
    if not mesh.creases:
        raise ModelError("a sheet without creases has no mid-plane; give it one crease or more")
    names = mesh.creases  # in order from the inner to the outer edge
    u = np.linspace(0.0, 1.0, stations)
    inner, first, last, outer = (
        _rail(state, mesh, place, u)
        for place in ("edge:inner", f"crease:{names[0]}", f"crease:{names[-1]}", "edge:outer")
    )
    return MidPlane(u, 0.5 * (inner + first), 0.5 * (last + outer))


def _rail(state: State, mesh: SheetMesh, place: str, u: Array) -> Array:
    """(k, 3) points of a deformed rail at parts u of its length in the flat sheet."""
    nodes = mesh.nodes(place)
    s = arc_lengths(mesh.points[nodes])
    return interpolated(u * s[-1], s, state.points[nodes])
