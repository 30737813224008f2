"""Bending stiffness of folded corrugations under loads spread over strips: any formulation can bear them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

import meshes
from bh import Model, Path, depth, trace
from bh.analysis.stiffness_probe import Probe
from bh.applications.corrugation.folding import LSTAR, POLYESTER, SHARPEST
from bh.formulations.observables import depth_of
from verification.studies.ch4.corrugations import AZIMUTHS, DEPTH

Array = NDArray[np.float64]
SPAN, REACH = (
    50.0,
    10.0,
)  # mm: between the supports; half of a strip, whose load fades as cos^2: 10 mm in the mean
CUTS = 8  # of the edges of a triangle where loads are integrated


@dataclass(frozen=True)
class Stiff:
    """One corrugation folded 6 mm deep on one mesh.

    Attributes:
        path: that folded it.
        reached: it could be folded.
        about: stiffness by the direction of the bar, "x" and "y", N/mm; nan where it was not folded.
        energy: folded, N mm.
    """

    path: Path
    reached: bool
    about: dict[str, float]
    energy: float


@lru_cache(maxsize=64)
def stiff(kind: str, formulation: str, along: int, rows: int) -> Stiff:
    """Fold a free corrugation by one rest angle of all creases, and bend it by loads on three strips.

    Args:
        kind: one of the five.
        formulation: of the model.
        along: cells along the creases.
        rows: of cells in a panel.
    """
    mesh = meshes.structured(meshes.corrugation(kind), along=along, rows=rows)
    model = Model(mesh, POLYESTER, formulation=formulation, contact=False).support("rigid-body")
    path = trace(model.fold("all", by=SHARPEST, Lstar=LSTAR, until=depth(DEPTH)), warn=False)
    if not path.reached:
        return Stiff(path, False, {"x": math.nan, "y": math.nan}, math.nan)
    return Stiff(path, True, bending(path, ("x", "y")), path[-1].energy.total)


def bending(path: Path, names: tuple[str, ...]) -> dict[str, float]:
    """Stiffness against a load spread over a strip across the middle, carried by two strips `SPAN` mm apart, N/mm.

    From the tangent of the last state. What is held is the mean height and the mean tilt of each support strip, and
    the middle one may tilt about the span: six loads that are smooth, so meshes converge, and no part has to be rigid.

    Args:
        path: of a free corrugation.
        names: directions of the bar, of `AZIMUTHS`.
    """
    axes, points = lying(path)
    probe = Probe(path)
    found = {}
    for name in names:
        turn = AZIMUTHS[name]
        along = points @ [math.cos(turn), math.sin(turn), 0.0]
        across = points @ [-math.sin(turn), math.cos(turn), 0.0]
        middle = 0.5 * float(across.min() + across.max())
        rows: list[Array] = []
        for place in (-0.5 * SPAN, 0.5 * SPAN, 0.0):
            rows += strip(path.model.mesh, along, across - middle - place)
        K = probe.against(np.array(rows)[:, :, None] * axes[2])[-2:, -2:]
        found[name] = float(K[0, 0] - K[0, 1] ** 2 / K[1, 1])
    return found


def lying(path: Path) -> tuple[Array, Array]:
    """Axes (3, 3) in rows of the last state as it lies, the last one up, and its nodes (n, 3) in them, mm."""
    state = path[-1]
    up = depth_of(state)[1]
    first = np.array([1.0, 0.0, 0.0]) - up[0] * up
    first /= np.linalg.norm(first)
    axes = np.vstack((first, np.cross(up, first), up))
    return axes, state.points @ axes.T


def strip(mesh: meshes.SheetMesh, along: Array, across: Array) -> tuple[Array, Array]:
    """Nodal shares (n,) of a unit load on a strip, and of a unit couple that tilts it (forces in 1 / mm).

    Args:
        mesh: flat.
        along: (n,) of the nodes along the strip, mm.
        across: (n,) from its middle, mm.
    """
    corners = _barycentric(CUTS)
    nodes = mesh.triangles
    at = across[nodes] @ corners.T
    weight = np.where(np.abs(at) < REACH, np.cos(0.5 * math.pi * at / REACH) ** 2, 0.0)
    weight *= mesh.areas[:, None] / len(corners)
    weight /= weight.sum()
    where = along[nodes] @ corners.T
    where = where - float((weight * where).sum())
    tilting = weight * where / float((weight * where**2).sum())
    shares = []
    for load in (weight, tilting):
        out = np.zeros(len(along))
        np.add.at(out, nodes, load @ corners)
        shares.append(out)
    return shares[0], shares[1]


def _barycentric(cuts: int) -> Array:
    """(cuts^2, 3) centroids of the parts of a triangle whose edges are cut evenly."""
    found = []
    for i in range(cuts):
        for j in range(cuts - i):
            found.append((i + 1 / 3, j + 1 / 3))
            if j < cuts - i - 1:
                found.append((i + 2 / 3, j + 2 / 3))
    part = np.array(found) / cuts
    return np.column_stack((part, 1.0 - part.sum(axis=1)))
