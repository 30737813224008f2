"""Creases of the shell whose moment is no straight line, and what those that yield have been through.

A law (`bh.model.hinge_laws`) is asked at every point of integration on an edge, where the fold angle beta, linear along
the edge, has turned by some angle from rest; what it remembers is kept there, too. Its turns are those of the dihedral
angle, towards a valley: the opposite of beta's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.loading.load_step import LoadStep
from bh.model.hinge_laws import HingeLaw
from bh.model.laws import SPRING
from fem.spaces import Tables
from fem.state import ShellState
from meshes.topology import Ints

Array = NDArray[np.float64]


class Held(NamedTuple):
    """What creases answer at turns of theirs; zero in rows without a law.

    Attributes:
        energy: (c,) stored and dissipated, N mm.
        gradient: (c, r) its derivative by beta, N mm / rad.
        tangent: (c, r, r) the second one, N mm / rad^2.
        dissipated: (c,) N mm.
    """

    energy: Array
    gradient: Array
    tangent: Array
    dissipated: Array


@dataclass(eq=False)
class CreaseLaws:
    """Laws of the creased edges of one step: c edges with p points each, of m hinges in the mesh.

    Attributes:
        groups: each law with the rows (k,) of creased edges that have it and their stiffness at rest, N mm / (mm rad).
        springs: (c,) False where the angle is imposed: the law answers nothing, but goes on to yield.
        hinges: (c,) rows of the mesh's hinges.
        weights: (c, p) lengths that the points stand for, mm.
        turn: (r, p) functions of beta there.
        history: (m p, 2) permanent turns and the sums of their changes, rad, as they were accepted last.
    """

    groups: tuple[tuple[HingeLaw, Ints, float], ...]
    springs: NDArray[np.bool_]
    hinges: Ints
    weights: Array
    turn: Array
    history: Array

    @property
    def remembers(self) -> bool:
        """Does a crease yield?"""
        return any(law.remembers for law, _, _ in self.groups)

    @property
    def lawed(self) -> NDArray[np.bool_]:
        """(c,) Has the crease a law of its own?"""
        out = np.zeros(len(self.hinges), dtype=bool)
        for _, rows, _ in self.groups:
            out[rows] = True
        return out

    def _at(self, rows: Ints) -> Ints:
        """(k p,) rows of `history` of creased edges (k,)."""
        points = self.turn.shape[1]
        return np.asarray((points * self.hinges[rows][:, None] + np.arange(points)).ravel())

    def held(self, turned: Array) -> Held:
        """What creases answer.

        Args:
            turned: (c, r) beta less that at rest, rad.
        """
        c, r = turned.shape
        out = Held(np.zeros(c), np.zeros((c, r)), np.zeros((c, r, r)), np.zeros(c))
        for law, whole, k in self.groups:
            rows = whole[self.springs[whole]]
            if not len(rows):
                continue
            weights = self.weights[rows]
            now = law.respond(-(turned[rows] @ self.turn).ravel(), self.history[self._at(rows)], k)
            energy, moment, slope, lost = (values.reshape(weights.shape) * weights for values in now[:4])
            out.energy[rows], out.dissipated[rows] = energy.sum(axis=1), lost.sum(axis=1)
            out.gradient[rows] = -moment @ self.turn.T
            out.tangent[rows] = np.einsum("cp,ip,jp->cij", slope, self.turn, self.turn)
        return out

    def accepted(self, turned: Array) -> Array:
        """(m p, 2) history where turns (c, r) are accepted, those of imposed angles too.

        Args:
            turned: (c, r) beta less that at rest, rad.
        """
        out = self.history.copy()
        for law, rows, k in self.groups:
            if law.remembers:
                at = self._at(rows)
                out[at] = law.respond(-(turned[rows] @ self.turn).ravel(), self.history[at], k).history
        return out

    def by_edge(self) -> Array:
        """(m, 2) means of the history along each hinge's edge."""
        shares = np.zeros((len(self.history) // self.turn.shape[1], self.turn.shape[1]))
        shares[self.hinges] = self.weights / self.weights.sum(axis=1, keepdims=True)
        return np.asarray(np.einsum("mp,mpk->mk", shares, self.history.reshape(*shares.shape, 2)))


def crease_laws(
    load_step: LoadStep, hinges: Ints, weights: Array, table: Tables, start: ShellState | None
) -> CreaseLaws | None:
    """The laws of a step's creases; None where all are straight lines.

    Args:
        load_step: has the laws.
        hinges: (c,) rows of the mesh's hinges that are creased.
        weights: (c, p) lengths that the points of their edges stand for, mm.
        table: of the elements.
        start: state that the step begins at; None for the flat sheet.
    """
    if load_step.curve is None:
        return None
    groups = _groups(load_step.laws, load_step.curve[hinges], load_step.stiffness[hinges])
    told = None if start is None else start.point_history
    history = np.zeros((len(load_step.law) * weights.shape[1], 2)) if told is None else told
    return CreaseLaws(groups, load_step.law[hinges] == SPRING, hinges, weights, table.turn, history)


def _groups(
    laws: Sequence[HingeLaw], curve: Ints, stiffness: Array
) -> tuple[tuple[HingeLaw, Ints, float], ...]:
    found = ((law, np.flatnonzero(curve == i)) for i, law in enumerate(laws))
    return tuple((law, rows, float(stiffness[rows[0]])) for law, rows in found if len(rows))
