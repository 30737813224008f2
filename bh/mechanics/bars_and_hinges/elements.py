"""Element arrays of a sheet of bars and hinges for one step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.loading.load_step import LoadStep
from bh.mechanics.bars_and_hinges.stiffness import (
    bending_hinge_stiffness,
    folding_hinge_stiffness,
    sheet_bars,
)
from bh.mechanics.shared.hinge_lock import ZONE, lock_terms, until_closed
from bh.mechanics.shared.kinematics import dihedral_angles
from bh.model.laws import PRESCRIBED, SHEET, SPRING
from bh.model.model import Model
from bh.model.ramp import Ramp
from meshes.topology import Ints

Array = NDArray[np.float64]
PENALTY = 300.0  # of a prescribed crease, in parts of E t h^2 with h the height of its wings


@dataclass(frozen=True, eq=False)
class Elements:
    """Element arrays of one step. Hinges are ordered: bending, spring creases, prescribed creases.

    `source` (h,) is the row of `mesh.topology.hinges` of each hinge, `lock` (h,) the stiffness of its lock. Held
    creases have no stiffness (their moment is a multiplier); `penalty` (prescribed,) is their weight in the tangent,
    N mm / rad.
    """

    bars: Ints
    bar_length: Array
    bar_stiffness: Array
    hinges: Ints
    source: Ints
    hinge_stiffness: Array
    lock: Array
    rest: Ramp
    couple: Ramp
    bending: int
    spring: int
    prescribed: int
    penalty: Array
    green: bool = False


def sheet_elements(
    model: Model, load_step: LoadStep, prescribed_start: Array, moment_start: Array
) -> Elements:
    """Element stiffness of a model in one step; `prescribed_start` and `moment_start` (m,) are what it begins with.

    Dihedral angles (rad) and total moments (N mm) of all hinges; moments are zero off creases.

    Args:
        model: of the sheet.
        load_step: actuations of the step.
        prescribed_start: (m,) dihedral angles of all hinges at the start, rad.
        moment_start: (m,) total moments of all hinges at the start, N mm; zero off creases.

    Raises:
        ModelError: a sheet with a grain, with zones, or one that expands.
    """
    mesh, sheet = model.mesh, model.sheet
    if model.zones:
        raise ModelError(
            "bars and hinges are of one sheet all over; fold one with zones or wide creases by 'consistent' or 'shell'"
        )
    if load_step.growth is not None:
        raise ModelError(
            "bars and hinges are at rest as they are drawn; expand a sheet by 'consistent' or 'shell'"
        )
    if sheet.directed:
        raise ModelError(
            "bars and hinges are alike in all directions; fold a sheet with a grain in the formulation 'consistent' or "
            "'shell', or leave out E2, G12 and grain"
        )
    topology = mesh.topology
    points = mesh.points
    edge_vector = points[topology.edges[:, 1]] - points[topology.edges[:, 0]]
    lengths = np.linalg.norm(edge_vector, axis=1)
    sides = topology.edge_triangles
    areas = mesh.areas[sides[:, 0]] + np.where(sides[:, 1] >= 0, mesh.areas[sides[:, 1]], 0.0)
    k_bar = sheet_bars(sheet.E, sheet.t, lengths, areas, mesh.spans)

    hinge_length, hinge_area = lengths[topology.hinge_edges], areas[topology.hinge_edges]
    groups = [np.flatnonzero(load_step.law == law) for law in (SHEET, SPRING, PRESCRIBED)]
    source = np.concatenate(groups)
    reference = dihedral_angles(points, topology.hinges)
    k_bend = bending_hinge_stiffness(sheet.E, sheet.t, hinge_length, hinge_area)
    k_fold = folding_hinge_stiffness(load_step.stiffness, hinge_length)
    if model.stiffness is not None:
        k_bar = model.stiffness.bars
        k_bend = k_fold = model.stiffness.hinges
    # augmentation well above what the bars give a wing
    gamma = PENALTY * sheet.E * sheet.t * (0.5 * hinge_area / hinge_length) ** 2
    stiffness = np.select([load_step.law == SHEET, load_step.law == SPRING], [k_bend, k_fold], 0.0)
    lock = _lock_stiffness(model, load_step, stiffness, k_bend, reference)
    imposed = load_step.prescribed_angles(prescribed_start)
    law = load_step.law[source]

    def ramp(bend: Array, spring: Array, prescribed: Array) -> Array:
        return np.where(
            law == SHEET, bend[source], np.where(law == SPRING, spring[source], prescribed[source])
        )

    # a released crease begins with the moment that it has; what its lock and its couple take of it is not the spring's
    of_spring = (
        moment_start - lock_terms(prescribed_start, lock)[:, 1] - load_step.moment.start * hinge_length
    )
    rest_from = np.where(
        np.isnan(load_step.rest.start), prescribed_start - of_spring / _nonzero(k_fold), load_step.rest.start
    )
    rest = Ramp(ramp(reference, rest_from, imposed.start), ramp(reference, load_step.rest.end, imposed.end))
    scale = np.where(law == PRESCRIBED, 0.0, hinge_length[source])
    couple = Ramp(load_step.moment.start[source] * scale, load_step.moment.end[source] * scale)
    return Elements(
        bars=topology.edges, bar_length=lengths, bar_stiffness=k_bar,
        hinges=np.ascontiguousarray(topology.hinges[source]), source=source,
        hinge_stiffness=stiffness[source], lock=lock[source], rest=rest, couple=couple,
        bending=len(groups[0]), spring=len(groups[1]), prescribed=len(groups[2]), penalty=gamma[groups[2]],
        green=model.stiffness is not None and model.stiffness.green,
    )  # fmt: skip


def bending_moments(model: Model, angles: Array) -> Array:
    """(m,) moments, N mm, of all hinges as bending hinges of the sheet at dihedral angles (m,), rad.

    Args:
        model: of the sheet.
        angles: (m,) dihedral angles, rad.
    """
    topology, points = model.mesh.topology, model.mesh.points
    turn = angles - dihedral_angles(points, topology.hinges)
    if model.stiffness is not None:
        return np.asarray(model.stiffness.hinges * turn)
    ends = points[topology.hinges[:, 1:3]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    area = model.mesh.areas[topology.edge_triangles[topology.hinge_edges]].sum(axis=1)
    return np.asarray(bending_hinge_stiffness(model.sheet.E, model.sheet.t, length, area) * turn)


def _lock_stiffness(
    model: Model, load_step: LoadStep, stiffness: Array, sheet: Array, reference: Array
) -> Array:
    """(m,) stiffness of the locks, N mm / rad: the hinge's own, or the sheet's at that edge where it is larger.

    So a soft crease stops as hard as the sheet beside it. `sheet` (m,) is Eq. 3.11 for all edges; where stiffness is
    given, the mean of all hinges stands for it. Held creases follow their angle exactly and have none, and neither
    have hinges that are made closed (their `reference` angle, rad, lies in the zone).
    """
    if not model.hinge_lock or len(stiffness) == 0:
        return np.zeros_like(stiffness)
    if model.stiffness is not None:
        sheet = np.full_like(stiffness, model.stiffness.hinges.mean())
    without = (load_step.law == PRESCRIBED) | (until_closed(reference) < ZONE)
    return np.where(without, 0.0, np.maximum(stiffness, sheet))


def _nonzero(stiffness: Array) -> Array:
    return np.where(stiffness == 0.0, np.inf, stiffness)
