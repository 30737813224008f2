"""Coulomb's friction where a sheet presses on itself or on bodies, with what sticks remembered.

At a contact c the parts move past each other by u = s + P sum_i w_i (x_i - x_i0) since the state that was accepted
last: w_i are the weights of its nodes, P = 1 - n n^T takes the part across the normal, and s is how far it had been
moved while it stuck. Its potential, with the normal force N times the coefficient mu, is

    mu N (y^2 / e - y^3 / (3 e^2)),  y = |u| < e,        mu N (y - e / 3),  y >= e,

whose force grows to mu N as the slip grows to e (Li et al. 2020, f_1). N, n and w are those of a state before: they
are taken anew where a state has been found, until the forces of friction do not change any more (semi-implicit, and
implicit in the limit). Where a state is accepted what is beyond e is used up, and s is the rest: so what sticks does
not creep, and the force is the same in the increment that follows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bh.mechanics.contact.blocks import in_pairs
from meshes.topology import Ints

Array = NDArray[np.float64]
ROW = 16  # numbers of a contact in what is remembered: kind and nodes, s, normal, force, weights
# numbers before the positions: energies by forces of ends and by means, lambda, what had not settled
HEAD = 4
TINY = 1e-300


@dataclass(frozen=True, eq=False)
class Rubbing:
    """Contacts (c) that rub.

    Attributes:
        keys: (c, 5) what is in contact: the kind, and up to four nodes, -1 for none.
        weights: (c, 4) of the nodes in their relative position.
        normals: (c, 3) unit vectors.
        force: (c,) coefficient times normal force, N.
        stuck: (c, 3) s, mm.
    """

    keys: Ints
    weights: Array
    normals: Array
    force: Array
    stuck: Array

    @classmethod
    def none(cls) -> Rubbing:
        """No contacts."""
        return cls(
            np.zeros((0, 5), dtype=np.int64),
            np.zeros((0, 4)),
            np.zeros((0, 3)),
            np.zeros(0),
            np.zeros((0, 3)),
        )

    @classmethod
    def joined(cls, parts: Sequence[Rubbing]) -> Rubbing:
        """All contacts of several lists."""
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in cls.__annotations__))

    @property
    def nodes(self) -> Ints:
        """(c, 4) nodes; 0, with no weight, where there is none."""
        return np.maximum(self.keys[:, 1:], 0)

    def across(self, v: Array) -> Array:
        """(c, 3) parts of vectors (c, 3) across the normals."""
        return np.asarray(v - np.einsum("ci,cj,cj->ci", self.normals, self.normals, v))

    def relative(self, y: Array) -> Array:
        """(c, 3) weighted sums of places or rates y (n, 3) of the nodes."""
        return np.asarray(np.einsum("ck,ckj->cj", self.weights, y[self.nodes]))


class Friction:
    """Friction of one step; places are those of the sheet's nodes, and below them of all that moves with lambda."""

    def __init__(
        self,
        sources: Sequence[Callable[[Array, float], Rubbing]],
        places: Callable[[Array, float], Array],
        slip: float,
        partner: Ints,
        dissipated: float,
    ) -> None:
        """Nothing rubs yet.

        Args:
            sources: each gives the contacts, with nothing stuck, at positions (n, 3) of the sheet and a lambda.
            places: all places of positions (n, 3) of the sheet and a lambda.
            slip: e, mm.
            partner: (n,) another node for every node of the sheet (`blocks.partners`).
            dissipated: what friction has used up before the step, N mm.
        """
        self._sources, self._places = sources, places
        self._slip, self._partner = slip, partner
        self._used = self._told = dissipated  # by the forces of ends of increments, and by their means
        self._before = np.zeros((0, 3))  # places of the state that was accepted last
        self._kept = self._now = Rubbing.none()
        self._change: tuple[Array, float, float] | None = None  # where it was looked at last, and what it was

    def begin(self, x: Array, lam: float) -> None:
        """Begin at a state in which nothing is stuck.

        Args:
            x: (nodes, 3) positions of the sheet, mm.
            lam: load parameter of the step, 0 to 1.
        """
        self._before = self._places(x, lam)
        self._kept = self._now = self._found(x, lam)

    def _found(self, x: Array, lam: float) -> Rubbing:
        """Contacts at a state, with what had been stuck in them where they were there before."""
        found = Rubbing.joined([source(x, lam) for source in self._sources])
        known = {tuple(key): s for key, s in zip(self._kept.keys.tolist(), self._kept.stuck, strict=True)}
        if not known:
            return found
        nothing = np.zeros(3)
        stuck = np.array([known.get(tuple(key), nothing) for key in found.keys.tolist()]).reshape(-1, 3)
        return replace(found, stuck=stuck)

    def back(self) -> None:
        """Take the normal forces of the state that was accepted last."""
        self._now, self._change = self._kept, None

    def renew(self, x: Array, lam: float, settled: float) -> bool:
        """Take the normal forces of a state unless they change those of friction by less; whether they were taken.

        Args:
            x: (nodes, 3) positions of the sheet, mm.
            lam: load parameter of the step, 0 to 1.
            settled: largest change that is nothing, in parts of the forces of friction.
        """
        new = self._found(x, lam)
        change = self._changed(new, self._places(x, lam))
        if change > settled:
            self._now, self._change = new, None
            return True
        self._change = (x.copy(), lam, change)
        return False

    def _changed(self, new: Rubbing, places: Array) -> float:
        """By how much the forces of friction change if these contacts are taken, in parts of them."""
        was, will = self._pushes(self._now, places), self._pushes(new, places)
        size = max(float(np.linalg.norm(was)), float(np.linalg.norm(will)))
        return float(np.linalg.norm(will - was)) / size if size > TINY else 0.0

    def _change_at(self, x: Array, lam: float) -> float:
        """The same with the normal forces of a state, which are not taken; looked at once."""
        if self._change is not None and self._change[1] == lam and np.array_equal(self._change[0], x):
            return self._change[2]
        return self._changed(self._found(x, lam), self._places(x, lam))

    # ------------------------------------------------------------------------------- energy and its derivatives

    def _slips(self, rubbing: Rubbing, places: Array) -> tuple[Array, Array]:
        """(c, 3) slips and their sizes (c,), mm."""
        u = rubbing.across(rubbing.stuck + rubbing.relative(places - self._before))
        return u, np.linalg.norm(u, axis=1)

    def _per_slip(self, y: Array) -> Array:
        """(c,) force over slip, in parts of mu N, 1 / mm."""
        e = self._slip
        return np.where(y < e, 2.0 / e - y / e**2, 1.0 / np.maximum(y, e))

    def _potential(self, y: Array) -> Array:
        e = self._slip
        return np.where(y < e, y**2 / e - y**3 / (3.0 * e**2), y - e / 3.0)

    def _pushes(self, rubbing: Rubbing, places: Array) -> Array:
        """(places, 3) gradient, N."""
        out = np.zeros_like(places)
        if len(rubbing.force):
            u, y = self._slips(rubbing, places)
            push = (rubbing.force * self._per_slip(y))[:, None] * u
            np.add.at(out, rubbing.nodes, rubbing.weights[:, :, None] * push[:, None])
        return out

    def forces(self, x: Array, lam: float) -> tuple[float, Array]:
        """Energy, used up before included, N mm, and its gradient (places, 3), N.

        Args:
            x: (nodes, 3) positions of the sheet, mm.
            lam: load parameter of the step, 0 to 1.
        """
        places = self._places(x, lam)
        _, y = self._slips(self._now, places)
        energy = self._used + float(self._now.force @ self._potential(y))
        return energy, self._pushes(self._now, places)

    def dissipated(self, x: Array, lam: float) -> float:
        """What friction has used up, N mm: slips times the means of the forces at both ends of increments.

        What is held where the sheet sticks is in it.

        Args:
            x: (nodes, 3) positions of the sheet, mm.
            lam: load parameter of the step, 0 to 1.
        """
        _, y = self._slips(self._now, self._places(x, lam))
        held = self._now.force @ self._potential(np.minimum(y, self._slip))
        return self._told + float(held) + self._lost(y)

    def _lost(self, y: Array) -> float:
        """What slips (c,), mm, since the last state use up, by the means of the forces there and here, N mm."""
        before = {tuple(key): f for key, f in zip(self._kept.keys.tolist(), self._kept.force, strict=True)}
        rubbed = set(self._kept.keys[:, 1:].ravel().tolist()) - {-1}
        old = np.array(
            [  # what slides on to the next triangle has rubbed before, what touches anew has not
                before.get(tuple(key), force if rubbed & set(key[1:3]) else 0.0)
                for key, force in zip(self._now.keys.tolist(), self._now.force.tolist(), strict=True)
            ]
        )
        return float(0.5 * (old + self._now.force) @ np.maximum(y - self._slip, 0.0))

    def _stiffness(self, x: Array, lam: float) -> Array:
        """(c, 3, 3) second derivatives by the slips, N / mm."""
        rubbing, e = self._now, self._slip
        u, y = self._slips(rubbing, self._places(x, lam))
        ratio = self._per_slip(y)
        along = u / np.maximum(y, TINY)[:, None]
        more = np.where(y < e, 2.0 / e - 2.0 * y / e**2, 0.0) - ratio
        across = np.eye(3) - np.einsum("ci,cj->cij", rubbing.normals, rubbing.normals)
        H = ratio[:, None, None] * across + np.einsum("c,ci,cj->cij", more, along, along)
        return np.asarray(rubbing.force[:, None, None] * H)

    def blocks(self, x: Array, lam: float) -> tuple[Ints, Array]:
        """Hessian as pairs of the sheet's nodes (p, 2) and their matrices (p, 6, 6), N / mm.

        Args:
            x: (nodes, 3) positions of the sheet, mm.
            lam: load parameter of the step, 0 to 1.
        """
        rubbing = self._now
        H, nodes = self._stiffness(x, lam), rubbing.keys[:, 1:]
        part = np.einsum("ci,cj,cab->cijab", rubbing.weights, rubbing.weights, H)
        row, column = (
            np.broadcast_to(nodes[:, :, None], part.shape[:3]),
            np.broadcast_to(nodes[:, None, :], part.shape[:3]),
        )
        own = (row >= 0) & (row < len(x)) & (column >= 0) & (column < len(x))
        return in_pairs(row[own], column[own], part[own], self._partner)

    def times(self, x: Array, rates: Array, lam: float) -> Array:
        """(places, 3) Hessian times velocities (places, 3).

        Args:
            x: (nodes, 3) positions of the sheet, mm.
            rates: (places, 3) velocities.
            lam: load parameter of the step, 0 to 1.
        """
        rubbing, out = self._now, np.zeros_like(rates)
        push = np.einsum("cab,cb->ca", self._stiffness(x, lam), rubbing.relative(rates))
        np.add.at(out, rubbing.nodes, rubbing.weights[:, :, None] * push[:, None])
        return out

    # ------------------------------------------------------------------------------- what is remembered

    def history_at(self, x: Array, lam: float) -> Array:
        """(k, 2) what is remembered where a state is accepted: energy, lambda, what has not settled, places, contacts.

        Args:
            x: (nodes, 3) positions of the sheet, mm.
            lam: load parameter of the step, 0 to 1.
        """
        rubbing = self._now
        u, y = self._slips(rubbing, self._places(x, lam))
        stuck = u * np.minimum(1.0, self._slip / np.maximum(y, TINY))[:, None]
        lost = self._potential(y) - self._potential(np.minimum(y, self._slip))
        rows = np.hstack((rubbing.keys, stuck, rubbing.normals, rubbing.force[:, None], rubbing.weights))
        used, told = self._used + float(rubbing.force @ lost), self._told + self._lost(y)
        flat = np.concatenate(
            ([used, lam, told, self._change_at(x, lam)], x.ravel(), np.zeros(x.size % 2), rows.ravel())
        )
        return flat.reshape(-1, 2)

    def fits(self, history: Array, nodes: int) -> bool:
        """Can it be what is remembered of a sheet with so many nodes?

        Args:
            history: (k, 2) that is asked about.
            nodes: of the sheet.
        """
        size, head = history.size, self._head(nodes)
        if history.shape[1:] != (2,) or size < head or (size - head) % ROW or not np.isfinite(history).all():
            return False
        keys = history.ravel()[head:].reshape(-1, ROW)[:, :5]
        last = len(self._before) - 1
        return bool(
            (keys == np.round(keys)).all() and (keys[:, 1:] >= -1).all() and (keys[:, 1:] <= last).all()
        )

    @staticmethod
    def unsettled(history: Array) -> float:
        """By how much the forces of friction still changed where a state was accepted, in parts of them.

        Args:
            history: (k, 2) of that state, as `history_at` gives it.
        """
        return float(history.ravel()[3])

    @staticmethod
    def _head(nodes: int) -> int:
        return HEAD + 3 * nodes + (3 * nodes) % 2

    def remember(self, history: Array, nodes: int) -> None:
        """Go on from there.

        Args:
            history: (k, 2) as `history_at` gives it.
            nodes: of the sheet.
        """
        flat = history.ravel()
        rows = flat[self._head(nodes) :].reshape(-1, ROW)
        self._used, lam, self._told = (float(each) for each in flat[:3])
        self._before = self._places(flat[HEAD : HEAD + 3 * nodes].reshape(-1, 3), lam)
        keys, stuck, normals, force, weights = np.split(rows, [5, 8, 11, 12], axis=1)
        self._change = None
        self._kept = self._now = Rubbing(keys.astype(np.int64), weights, normals, force[:, 0], stuck)
