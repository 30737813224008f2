"""Creases whose moment is no straight line, and what those that yield have been through.

At a state such a crease is a spring of its present slope and a couple: k' turn + couple' is its moment, so that the
compiled passes over springs serve it as they are. Sheets without such creases have no `CreaseCurves` at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.state import State
from bh.loading.load_step import LoadStep
from bh.model.hinge_laws import HingeLaw
from bh.model.laws import SPRING
from bh.model.model import Model
from bh.model.ramp import Ramp
from meshes.topology import Ints

Array = NDArray[np.float64]


class Straightened(NamedTuple):
    """Springs (h,) as straight lines at a state.

    Attributes:
        stiffness: (h,) slopes, N mm / rad.
        couple: (h,) couples, N mm, with those that are applied.
        missing: energy, N mm, that the straight lines do not tell.
    """

    stiffness: Array
    couple: Array
    missing: float


class Held(NamedTuple):
    """What springs hold at a state: (h,) energies stored, N mm, and the sum of what has been dissipated, N mm."""

    stored: Array
    dissipated: float


@dataclass(eq=False)
class CreaseCurves:
    """Laws of the creases of one step.

    Attributes:
        laws: of the model.
        curve: (m,) row of `laws` at every hinge of the mesh, else -1.
        stiffness: (m,) at rest a length, N mm / (mm rad).
        lengths: (m,) of the edges, mm.
        springs: (h,) rows of the mesh's hinges of the springs of the formulation, in its order.
        history: (m, 2) permanent turns and the sums of their changes, rad, as they were accepted last.
    """

    laws: Sequence[HingeLaw]
    curve: Ints
    stiffness: Array
    lengths: Array
    springs: Ints
    history: Array
    groups: tuple[tuple[HingeLaw, Ints], ...] = field(init=False)

    def __post_init__(self) -> None:
        """Group springs by law."""
        of_spring = self.curve[self.springs]
        rows = ((law, np.flatnonzero(of_spring == i)) for i, law in enumerate(self.laws))
        self.groups = tuple((law, found) for law, found in rows if len(found))

    @property
    def remembers(self) -> bool:
        """Does a crease yield?"""
        return any(law.remembers for law in self.laws)

    def slopes(self, stiffness: Array, turns: Array) -> Array:
        """(h,) stiffness of all springs at turns (h,), N mm / rad.

        Args:
            stiffness: (h,) of straight lines, N mm / rad.
            turns: (h,) rad.
        """
        return self.straight(stiffness, np.zeros_like(stiffness), turns).stiffness

    def straight(self, stiffness: Array, couple: Array, turns: Array) -> Straightened:
        """All springs as straight lines at turns (h,).

        Args:
            stiffness: (h,) of straight lines, N mm / rad.
            couple: (h,) applied couples, N mm.
            turns: (h,) rad.
        """
        k, couple, missing = stiffness.copy(), couple.copy(), 0.0
        for law, rows in self.groups:
            hinges, turn = self.springs[rows], turns[rows]
            length = self.lengths[hinges]
            now = law.respond(turn, self.history[hinges], self._k(hinges))
            k[rows] = now.stiffness * length
            rest = now.moment * length - k[rows] * turn
            couple[rows] += rest
            missing += float((now.energy * length - (0.5 * k[rows] * turn + rest) * turn).sum())
        return Straightened(k, couple, missing)

    def held(self, stiffness: Array, turns: Array) -> Held:
        """Energies of all springs at turns (h,).

        Args:
            stiffness: (h,) of straight lines, N mm / rad.
            turns: (h,) rad.
        """
        stored, lost = 0.5 * stiffness * turns**2, 0.0
        for law, rows in self.groups:
            hinges = self.springs[rows]
            now = law.respond(turns[rows], self.history[hinges], self._k(hinges))
            stored[rows] = (now.energy - now.dissipated) * self.lengths[hinges]
            lost += float((now.dissipated * self.lengths[hinges]).sum())
        return Held(stored, lost)

    def accepted(self, turns: Array) -> Array:
        """(m, 2) history where the turns (m,) of all hinges of the mesh are accepted, those of imposed angles too.

        Args:
            turns: (m,) dihedral angles less those at rest, rad.
        """
        out = self.history.copy()
        for i, law in enumerate(self.laws):
            hinges = np.flatnonzero(self.curve == i)
            if law.remembers and len(hinges):
                out[hinges] = law.respond(turns[hinges], self.history[hinges], self._k(hinges)).history
        return out

    def _k(self, hinges: Ints) -> float:
        """Stiffness a length of one law's hinges (one or more): it is the same for all of them."""
        return float(self.stiffness[hinges[0]])


def crease_curves(
    model: Model, load_step: LoadStep, start: State | None, springs: Ints, halved: bool
) -> CreaseCurves | None:
    """The laws of a step's creases, or None where all are straight lines.

    Args:
        model: of the sheet.
        load_step: of the step.
        start: state that the step begins at; None for the stress-free sheet.
        springs: (h,) rows of `mesh.topology.hinges` of the formulation's springs.
        halved: one half of a symmetric sheet is solved.

    Raises:
        ModelError: half a sheet is solved, or the stiffness of its elements is given.
    """
    if load_step.curve is None:
        return None
    if halved:
        raise ModelError(
            "creases with a law of their own (bilinear, table, elastic-plastic, ...) are solved on the whole sheet; "
            "leave out symmetry"
        )
    if model.stiffness is not None:
        raise ModelError(
            "creases with a law of their own take no given element stiffness; leave out one of them"
        )
    count = len(load_step.law)
    told = None if start is None else start.crease_history
    history = np.zeros((count, 2)) if told is None else told
    return CreaseCurves(
        load_step.laws, load_step.curve, load_step.stiffness, edge_lengths(model), springs, history
    )


def edge_lengths(model: Model) -> Array:
    """(m,) stress-free lengths of the edges of all hinges, mm.

    Args:
        model: of the sheet.
    """
    ends = model.mesh.points[model.mesh.topology.hinges[:, 1:3]]
    return np.asarray(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))


def letting_go(
    model: Model, load_step: LoadStep, start: State | None, angles: Array, carried: Array
) -> LoadStep:
    """The step with a couple on creases that are let go of, which holds them where they are and fades out.

    Args:
        model: of the sheet.
        load_step: of the step.
        start: state that the step begins at.
        angles: (m,) dihedral angles of all hinges there, rad.
        carried: (m,) moments of all hinges there without those of locks, N mm.
    """
    if load_step.freed is None or load_step.curve is None or start is None:
        return load_step
    freed = np.flatnonzero(load_step.freed & (load_step.law == SPRING))
    curves = crease_curves(model, load_step, start, freed, False)
    assert curves is not None
    none = np.zeros(len(freed))
    turns = (angles - load_step.rest.start)[freed]
    line = curves.straight(none, none, turns)
    length = curves.lengths[freed]
    own = line.stiffness * turns + line.couple
    begin = load_step.moment.start.copy()
    begin[freed] = (carried[freed] - own) / length
    return replace(load_step, moment=Ramp(begin, load_step.moment.end))


def refuse_curves(curves: CreaseCurves | None) -> None:
    """Sensitivities are those of straight lines.

    Args:
        curves: of a system.

    Raises:
        ModelError: it has creases with laws of their own.
    """
    if curves is not None:
        raise ModelError(
            "sensitivities are those of creases of one stiffness; this sheet has a crease with a law of its own"
        )
