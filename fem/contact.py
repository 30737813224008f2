"""Panels of the shell that stop each other: the barrier of `bh.mechanics.contact` on the shell's own nodes.

The surface that collides is that of the nodes, with quadratic positions every element as four triangles, so a bowed
element is known to a fraction of its rise. The barrier is no mechanics of the sheet: the judge shares it with the
judged, as both share what a support or a force is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.model import Model
from fem.assembly import NO_PAIRS, Pattern, scatter, turn_blocks
from fem.components import Components
from fem.here import Here
from meshes.curved import ElementMesh
from meshes.topology import Ints

if TYPE_CHECKING:
    from bh.mechanics.contact.barrier import SheetBarrier

Array = NDArray[np.float64]


class StoppedShell:
    """What drivers ask of a shell about its panels (`bh.solvers.system.Hindered`); of one without contact, nothing.

    Attributes:
        barrier: of all nodes, or None.
        touching: (p, 2) pairs of nodes that the pattern of the tangent has places for.
    """

    mesh: ElementMesh
    components: Components
    barrier: SheetBarrier | None = None
    touching: Ints = NO_PAIRS
    _here: Here | None = None

    def hinder(self, model: Model, x: Array) -> None:
        """Let panels stop each other if a model asks for it, from where the step begins.

        Args:
            model: of the sheet.
            x: (n, 3) positions of all nodes, mm.

        Raises:
            ModelError: contact does not fit the sheet, or the step begins with a sheet that meets itself.
        """
        if not model.stops_itself:
            return
        from bh.mechanics.contact.barrier import sheet_barrier

        if model.rubs:
            raise ModelError("the shell knows no friction; take formulation consistent or bars-and-hinges")
        if model.contact == "thickness" and any(zone.sheet.t != model.sheet.t for zone in model.zones):
            raise ModelError("contact = thickness: zones have another thickness; give a gap in mm")
        self.barrier = sheet_barrier(Model(self.mesh.linear, model.sheet, contact=model.contact))
        if not self.barrier.begin(x):
            raise ModelError(f"contact: {self.barrier.first_meetings(x)}; begin with panels apart")

    def node_positions(self, components: Array) -> Array:
        """(n, 3) positions of all nodes, middle nodes included, mm."""
        return self.mesh.nodes + self.components.moves(components)

    def nodes_at(self, q: Array, lam: float) -> Array:
        """(n, 3) the same at unknowns q (size,).

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        return self.node_positions(self.components.whole(q, lam))

    def free_part(self, q: Array, dq: Array, lam: float, since: float | None = None) -> float:
        """How much of a step dq (size,) from q no panels stand in, 0 to 1; see `bh.solvers.system.Limited`."""
        del since  # prescribed nodes are where they are at the end of the way
        if self.barrier is None:
            return 1.0
        return self.barrier.free_part(self.nodes_at(q, lam), self.nodes_at(q + dq, lam))

    def approach(self, q: Array, dq: Array, lam: float, since: float | None = None) -> float:
        """How much of a step leads to where panels begin to press on each other, 0 to 1.

        Args:
            q: (size,) unknowns.
            dq: (size,) step.
            lam: load parameter of the step, 0 to 1.
            since: not needed here, where nothing moves but the sheet.
        """
        del since
        if self.barrier is None:
            return 1.0
        return self.barrier.approach(self.nodes_at(q, lam), self.nodes_at(q + dq, lam))

    def pressing(self, q: Array, lam: float) -> bool:
        """Do panels press on each other?

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        return self.barrier is not None and self.barrier.presses(self.nodes_at(q, lam))

    @property
    def hindered(self) -> bool:
        """Do panels stop each other?"""
        return self.barrier is not None

    @property
    def looking(self) -> float:
        """What looks for contact have taken so far, s of one core of 2.5 GHz, counted by their work."""
        return 0.0 if self.barrier is None else self.barrier.seconds

    @contextmanager
    def unhindered(self) -> Iterator[None]:
        """While it lasts no panels stop each other."""
        if self.barrier is None:
            yield
            return
        self._here = None  # what is remembered there was looked at awake, and the other way round behind it
        try:
            with self.barrier.asleep():
                yield
        finally:
            self._here = None

    def clear_ways(self, places: Sequence[tuple[Array, float]]) -> float:
        """How many of the straight ways from place to place no panels come near each other on.

        Args:
            places: unknowns (size,) and load parameter of each; the first is an accepted state.
        """
        if self.barrier is None:
            return len(places) - 1.0
        return self.barrier.clear_ways([self.nodes_at(q, lam) for q, lam in places])

    def reshaped(self, one: tuple[Array, float], other: tuple[Array, float]) -> float:
        """By how much two shapes differ, rigid motions aside: the norm over all nodes, mm.

        Args:
            one: unknowns (size,) and load parameter.
            other: the same of the other shape.
        """
        from scipy.spatial.transform import Rotation

        x, y = (nodes - nodes.mean(axis=0) for nodes in (self.nodes_at(*one), self.nodes_at(*other)))
        return float(Rotation.align_vectors(x, y)[1])

    def meetings(self, x: Array) -> str:
        """Which parts of the sheet meet or lie too near, in words; empty where it is clear.

        Args:
            x: (corners, 3) positions, mm; middle nodes are taken half way between them.
        """
        if self.barrier is None:
            return ""
        if self.mesh.degree == 2:
            x = np.vstack((x, x[self.mesh.sheet.topology.edges].mean(axis=1)))
        if self.barrier.clear(x):
            return ""
        return self.barrier.meetings(x) or "layers nearer than contact allows"

    def passed(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        """Whether panels would pass through each other on the way between two states, in words; empty if not.

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
            q_new: (size,) unknowns behind it.
            lam_new: load parameter there.
        """
        if self.barrier is None:
            return ""
        if not self.barrier.passed(self.nodes_at(q, lam), self.nodes_at(q_new, lam_new)):
            return ""
        return "panels would pass through each other on the way there"

    def press(self, x: Array) -> tuple[float, Array | None]:
        """Energy of panels in contact, N mm, and its gradient (n, 3), N, at positions x (n, 3); None without."""
        if self.barrier is None:
            return 0.0, None
        gradient = np.zeros_like(x)
        return self.barrier.forces(x, gradient), gradient

    def blocks(self, x: Array) -> tuple[Ints, Array] | None:
        """What panels in contact add to the tangent at positions x (n, 3): pairs (p, 2) and matrices (p, 6, 6).

        Pairs that the pattern has no place for make it be built anew, with those of before unless they are many more.
        """
        if self.barrier is None:
            return None
        pairs, found = self.barrier.blocks(x)
        known = {(a, b) for a, b in self.touching.tolist()}
        if not known.issuperset((a, b) for a, b in pairs.tolist()):
            kept = self.touching if len(known) <= 2 * len(pairs) else pairs[:0]
            self.touching = np.unique(np.vstack((kept, pairs)), axis=0)
            for name in ("_pattern", "_springs"):
                vars(self).pop(name, None)
        return pairs, found

    def add_blocks(self, pairs: Ints, blocks: Array, pattern: Pattern, data: Array) -> None:
        """Add what `blocks` gives to the values of the tangent.

        Args:
            pairs: (p, 2) nodes.
            blocks: (p, 6, 6) N / mm.
            pattern: with places for them.
            data: values; added to.
        """
        constraints = self.components.constraints
        if (constraints.frame_of >= 0).any():
            turn_blocks(blocks, pairs, constraints.frame_of, constraints.frames)
        order = {(a, b): k for k, (a, b) in enumerate(self.touching.tolist())}
        rows = [order[a, b] for a, b in pairs.tolist()]
        scatter(blocks, np.zeros((len(pairs), 0)), pattern.touching[rows], data)
