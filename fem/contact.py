"""Panels of the shell that stop each other: the barrier of `bh.mechanics.contact` on the shell's own nodes.

The surface that collides is that of the nodes, with quadratic positions every element as four triangles, so a bowed
element is known to a fraction of its rise. The barrier is no mechanics of the sheet: the judge shares it with the
judged, as both share what a support or a force is.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.model import Model
from bh.solvers.in_the_way import InTheWay
from fem.assembly import Pattern, scatter, turn_blocks
from fem.components import Components
from fem.here import Here
from meshes.curved import ElementMesh
from meshes.topology import Ints

if TYPE_CHECKING:
    from bh.mechanics.contact.barrier import SheetBarrier
    from bh.mechanics.contact.blocks import ContactBlocks

Array = NDArray[np.float64]


class StoppedShell(InTheWay):
    """What drivers ask of a shell about its panels (`bh.solvers.system.Hindered`); of one without contact, nothing.

    Attributes:
        contact_blocks: pairs of nodes that the pattern of the tangent has places for; None without contact.
    """

    mesh: ElementMesh
    components: Components
    barrier: SheetBarrier | None = None
    contact_blocks: ContactBlocks | None = None
    _here: Here | None = None

    def hinder(self, model: Model, x: Array, pressed: bool) -> None:
        """Let panels stop each other if a model asks for it, from where the step begins.

        Args:
            model: of the sheet.
            x: (n, 3) positions of all nodes, mm.
            pressed: bars press in the step.

        Raises:
            ModelError: contact does not fit the sheet, or the step begins with a sheet that meets itself.
        """
        if model.rubs and (pressed or model.stops_itself):
            raise ModelError("the shell knows no friction; take formulation consistent or bars-and-hinges")
        if not model.stops_itself:
            return
        from bh.mechanics.contact.barrier import sheet_barrier
        from bh.mechanics.contact.blocks import ContactBlocks

        if model.contact == "thickness" and any(zone.sheet.t != model.sheet.t for zone in model.zones):
            raise ModelError("contact = thickness: zones have another thickness; give a gap in mm")
        self.barrier = sheet_barrier(Model(self.mesh.linear, model.sheet, contact=model.contact))
        self.barriers, self.contact_blocks = (self.barrier,), ContactBlocks()
        if not self.barrier.begin(x):
            raise ModelError(f"contact: {self.barrier.first_meetings(x)}; begin with panels apart")

    def node_positions(self, components: Array) -> Array:
        """(n, 3) positions of all nodes, middle nodes included, mm."""
        return self.mesh.nodes + self.components.moves(components)

    def near(self, q: Array, lam: float) -> Array:
        """(n, 3) the same at unknowns q (size,).

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        return self.node_positions(self.components.whole(q, lam))

    @contextmanager
    def unhindered(self) -> Iterator[None]:
        """While it lasts no panels stop each other."""
        if not self.hindered:
            yield
            return
        self._here = None  # what is remembered there was looked at awake, and the other way round behind it
        try:
            with super().unhindered():
                yield
        finally:
            self._here = None

    def harden(self, factor: float) -> None:
        """Let panels press by a number of times what the model asks for, until told otherwise.

        Args:
            factor: 1 for the model's own.
        """
        self._here = None  # what is remembered there was pressed otherwise
        super().harden(factor)

    def meetings(self, x: Array) -> str:
        """Which parts of the sheet meet or lie too near, in words; empty where it is clear.

        Args:
            x: (corners, 3) positions, mm; middle nodes are taken half way between them.
        """
        if self.hindered and self.mesh.degree == 2:
            x = np.vstack((x, x[self.mesh.sheet.topology.edges].mean(axis=1)))
        return super().meetings(x)

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
        if self.barrier is None or self.contact_blocks is None:
            return None
        pairs, found = self.barrier.blocks(x)
        if not self.contact_blocks.known(pairs):
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
        assert self.contact_blocks is not None
        places = pattern.touching[self.contact_blocks.rows(pairs)]
        scatter(blocks, np.zeros((len(pairs), 0)), places, data)
