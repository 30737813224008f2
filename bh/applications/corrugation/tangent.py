"""Bending stiffness of a folded corrugation in any direction for small displacements, and how isotropic it is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.analysis.stiffness_probe import Probe
from bh.errors import ModelError
from bh.runtime.one_line import OneLine

if TYPE_CHECKING:
    from bh.applications.corrugation.folded import Folded

Array = NDArray[np.float64]
CLOSE = 3.0  # mm


@dataclass(frozen=True, eq=False, repr=False)
class Directional(OneLine):
    """Bending stiffness by direction.

    Attributes:
        azimuth: (k,) of the bar from the x axis, rad.
        stiffness: (k,) load on the bar over its displacement, N/mm.
    """

    azimuth: Array
    stiffness: Array

    @property
    def isotropy(self) -> float:
        """Least over largest stiffness: 1 for a plate, 0 for a mechanism in some direction."""
        return float(self.stiffness.min() / self.stiffness.max())

    @property
    def weakest(self) -> float:
        """Least stiffness, N/mm."""
        return float(self.stiffness.min())

    def about(self, azimuth: float) -> float:
        """Stiffness in the nearest direction that was asked for, N/mm."""
        gap = np.abs((self.azimuth - azimuth + 0.5 * math.pi) % math.pi - 0.5 * math.pi)
        return float(self.stiffness[int(np.argmin(gap))])


def tangent_bending(
    folded: Folded, directions: int | Sequence[float] | Array = 24, span: float = 50.0
) -> Directional:
    """Stiffness against a bar across the middle, between two lines `span` mm apart that hold the sheet from below.

    From the tangent of the folded state: along either line all creases and edges of the sheet are held at their
    height, and those of the middle section move down with the bar, which may turn about the span; everything slides as
    it likes. So three sections keep their shape and the sheet between them bends, without the rocking and the unfolding
    that contact on a few points adds.

    Args:
        folded: the corrugation.
        directions: how many, evenly from 0 to pi, or their azimuths, rad.
        span: between the lines, mm.

    Raises:
        ModelError: a span that the corrugation does not reach over, or no directions.
    """
    if isinstance(directions, int):
        azimuths = np.arange(directions) * math.pi / directions
    else:
        azimuths = np.atleast_1d(np.asarray(directions, dtype=float))
    if len(azimuths) == 0 or not (math.isfinite(span) and span > 0.0):
        raise ModelError(
            f"{len(azimuths)} directions and a span of {span} mm cannot be; give one, and a length"
        )
    probe = Probe(folded.path)
    return Directional(azimuths, np.array([_bending(probe, folded, float(a), span) for a in azimuths]))


def _bending(probe: Probe, folded: Folded, azimuth: float, span: float) -> float:
    along = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    across = np.array([-along[1], along[0], 0.0])
    s = folded.points @ across
    middle = 0.5 * float(s.min() + s.max())
    loads, turns = [], []
    for place in (-0.5 * span, 0.5 * span, 0.0):
        found, where = _section(folded, along, across, middle + place)
        if len(found) == 0:
            raise ModelError(f"the corrugation does not reach both supports {span:g} mm apart")
        loads.append(found)
        turns.append(where)
    bar = len(loads[2])
    K = probe.against(np.vstack(loads))[-bar:, -bar:]
    shape = np.column_stack((np.ones(bar), turns[2] - turns[2].mean()))
    A = shape.T @ K @ shape
    if bar == 1 or A[1, 1] <= 1e-12 * A[0, 0]:
        return float(A[0, 0])
    return float(A[0, 0] - A[0, 1] ** 2 / A[1, 1])


def _section(folded: Folded, along: Array, across: Array, place: float) -> tuple[Array, Array]:
    """Unit loads along z (m, n, 3) where a section meets creases and edges, and where they are along it (m,), mm.

    Points closer than `CLOSE` count once: near the corners of a sheet one that is held twice tells nothing new.
    """
    points, mesh = folded.points, folded.mesh
    cut, part, met = _crossings(points, np.vstack(list(mesh.edge_sets.values())), across, place)
    where = met @ along
    kept: list[int] = []
    for row in np.argsort(where).tolist():
        if not kept or where[row] - where[kept[-1]] > CLOSE:
            kept.append(row)
    loads = np.zeros((len(kept), len(points), 3))
    for k, row in enumerate(kept):
        loads[k, cut[row, 0], 2] += 1.0 - part[row]
        loads[k, cut[row, 1], 2] += part[row]
    return loads, where[kept]


def _crossings(
    points: Array, edges: NDArray[np.int64], across: Array, place: float
) -> tuple[NDArray[np.int64], Array, Array]:
    """Edges (k, 2) that a vertical plane cuts, the part of each where (k,), and the points (k, 3)."""
    gap = points @ across - place
    gap = np.where(np.abs(gap) < 1e-9, 1e-9, gap)  # beside nodes that lie in the plane
    a, b = gap[edges[:, 0]], gap[edges[:, 1]]
    cut = a * b < 0.0
    part = a[cut] / (a[cut] - b[cut])
    p, q = points[edges[cut, 0]], points[edges[cut, 1]]
    return edges[cut], part, (1.0 - part)[:, None] * p + part[:, None] * q
