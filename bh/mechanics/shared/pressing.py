"""What presses on a sheet and stands in its way: panels that stop each other, moulds, bars, and friction between them.

The part of a system that is asked of states with contact; a sheet that touches nothing has none of it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.state import State
from bh.loading.load_step import LoadStep
from bh.mechanics.shared.displacements import Displacements
from bh.mechanics.shared.outside import Outside
from bh.model.model import Model
from bh.model.mould import Mould
from bh.solvers.in_the_way import InTheWay
from meshes import SheetMesh
from meshes.topology import Ints

if TYPE_CHECKING:
    from bh.mechanics.contact.barrier import SheetBarrier
    from bh.mechanics.contact.blocks import ContactBlocks
    from bh.mechanics.contact.friction import Friction
    from bh.mechanics.contact.moulds import MouldBarrier

Array = NDArray[np.float64]
SLIP = 0.01  # of the thickness: slip up to which a contact sticks


class PressedSheet(InTheWay):
    """Contact of a sheet in one step; see `bh.solvers.system.Hindered` and `bh.solvers.lagging.Lagging`."""

    mesh: SheetMesh
    displacements: Displacements
    outside: Outside | None
    barrier: SheetBarrier | None = None  # between panels
    moulds: MouldBarrier | None = None
    barriers: tuple[SheetBarrier, ...] = ()  # all of them
    friction: Friction | None = None
    contact_blocks: ContactBlocks | None = None
    _kept: Array = np.zeros((0, 2))  # what friction remembers

    def begin_contact(self, model: Model, load_step: LoadStep, start: State | None, x: Array) -> None:
        """What can press in a step that begins at positions x (n, 3), mm; call it when bodies are known.

        Args:
            model: the whole sheet.
            load_step: of the step.
            start: the state that the step begins at; None for the stress-free sheet.
            x: (nodes, 3) positions where the step begins, mm.

        Raises:
            ModelError: the first state meets itself or a mould, or friction acts nowhere.
        """
        moulds = tuple(body for body in load_step.bodies if isinstance(body, Mould))
        if model.stops_itself:
            from bh.mechanics.contact.barrier import sheet_barrier

            self.barrier = sheet_barrier(model)
            self._check_start(x)
        if moulds:
            from bh.mechanics.contact.moulds import MouldBarrier

            self.moulds = MouldBarrier(model, moulds)
            self.moulds.check_start(x, 0.0, start is None)
        self.barriers = tuple(each for each in (self.barrier, self.moulds) if each is not None)
        if model.rubs:
            self._begin_friction(model, start, x)
        if self.barriers or self.friction is not None:
            from bh.mechanics.contact.blocks import ContactBlocks

            self.contact_blocks = ContactBlocks()

    def _begin_friction(self, model: Model, start: State | None, x: Array) -> None:
        from bh.mechanics.contact.blocks import partners
        from bh.mechanics.contact.friction import Friction, Rubbing

        def of_barrier(barrier: SheetBarrier, x: Array, lam: float) -> Rubbing:
            return barrier.rubbing(barrier.places(x, lam), model.friction)

        sources: list[Callable[[Array, float], Rubbing]] = [partial(of_barrier, b) for b in self.barriers]
        bodies = None if self.outside is None else self.outside.bodies
        corners = 0 if self.moulds is None else len(self.moulds.velocity)
        if bodies is not None and bodies.indenters:
            first = len(x) + corners

            def of_bodies(x: Array, lam: float) -> Rubbing:
                return bodies.rubbing(x, lam, model.friction, first)

            sources.append(of_bodies)
        if not sources:
            return
        used = 0.0 if start is None else start.energy.friction
        self.friction = Friction(sources, self._places, SLIP * model.sheet.t, partners(model.mesh), used)
        self.friction.begin(x, 0.0)
        self._kept = self.friction.history_at(x, 0.0)

    def _check_start(self, x: Array) -> None:
        """Raises `ModelError` where the step begins with a sheet that passes through itself."""
        if self.barrier is not None and not self.barrier.begin(
            x + (self.displacements.home - self.displacements.reference)
        ):
            raise ModelError(
                f"contact: {self.barrier.first_meetings(x)}; begin with panels apart (layers of a folded form: "
                "untangle = true)"
            )

    # ------------------------------------------------------------------------------- energy and its derivatives

    def _places(self, x: Array, lam: float) -> Array:
        """Positions of the nodes x (n, 3), of the corners of moulds, and of the centres of bars, mm."""
        places = x if self.moulds is None else self.moulds.places(x, lam)
        bodies = None if self.outside is None else self.outside.bodies
        return places if bodies is None else np.vstack((places, bodies.centres(lam)))

    def _place_rates(self, v: Array, moving: float) -> Array:
        """Their rates, for velocities v (n, 3) of the nodes and a rate of lambda."""
        rates = v if self.moulds is None else self.moulds.rates(v, moving)
        bodies = None if self.outside is None else self.outside.bodies
        return rates if bodies is None else np.vstack((rates, moving * bodies.velocity))

    def press(self, x: Array, lam: float, f: Array) -> float:
        """Adds what acts from outside, contact and friction to nodal forces f (n, 3), N; returns the energy, N mm.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
            f: (nodes, 3) N; the gradient is added.
        """
        energy = 0.0 if self.outside is None else self.outside.forces(x, lam, f)
        return energy + self.touch(x, lam, f)

    def touch(self, x: Array, lam: float, f: Array) -> float:
        """The same of barriers and friction alone.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
            f: (nodes, 3) N; the gradient is added.
        """
        energy = self._contact(x, lam, f)
        if self.friction is not None and energy < np.inf:
            used, rubbed = self.friction.forces(x, lam)
            f += rubbed[: len(x)]
            energy += used
        return energy

    def _contact(self, x: Array, lam: float, f: Array) -> float:
        energy = 0.0
        for barrier in self.barriers:
            energy += barrier.forces(barrier.places(x, lam), f)
        return energy

    def press_on(self, x: Array, lam: float, f: Array) -> tuple[float, float]:
        """Energy of what presses, and what friction has used up; what all that presses does is added to nodal forces.

        Held nodes that are pressed on hand it on to their supports, so reactions are read behind this.

        Args:
            x: (n, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
            f: (n, 3) N; the gradient is added.

        Returns:
            N mm, of panels and moulds, and of friction.
        """
        if self.outside is not None:
            self.outside.forces(x, lam, f)
        energy = self._contact(x, lam, f)
        if self.friction is None:
            return energy, 0.0
        f += self.friction.forces(x, lam)[1][: len(x)]
        return energy, self.friction.dissipated(x, lam)

    def contact_forces(self, x: Array, lam: float) -> dict[str, Array]:
        """(3,) force of every body of the step on the sheet, friction included, N, by its name.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        found = {} if self.outside is None else self.outside.contact_forces(x, lam)
        rubbed = None if self.friction is None else self.friction.forces(x, lam)[1]
        if self.moulds is not None:
            corners = self.moulds.corner_forces(self.moulds.places(x, lam))
            if rubbed is not None:
                corners = corners + rubbed[len(x) : len(x) + len(corners)]
            found |= self.moulds.by_mould(corners)
        if rubbed is not None and self.outside is not None and self.outside.bodies is not None:
            indenters = self.outside.bodies.indenters
            for indenter, more in zip(indenters, rubbed[len(rubbed) - len(indenters) :], strict=True):
                found[indenter.name] = found[indenter.name] + more
        return found

    def _touching(self, x: Array, lam: float) -> tuple[Ints, Array] | None:
        """What contact and friction add to the tangent, pairs of nodes (p, 2) and (p, 6, 6); None without contact.

        A pair that the pattern of the tangent has no place for makes it be built anew.
        """
        if self.contact_blocks is None:
            return None
        found = [barrier.blocks(barrier.places(x, lam)) for barrier in self.barriers]
        if self.friction is not None:
            found.append(self.friction.blocks(x, lam))
        pairs, blocks = (np.concatenate(part) for part in zip(*found, strict=True))
        if not self.contact_blocks.known(pairs):
            vars(self).pop("_pattern", None)
        return pairs, blocks

    def touch_rates(self, x: Array, v: Array, lam: float, moving: float) -> Array:
        """(n, 3) rate of the gradient of `touch` for velocities v (n, 3), moulds moving as lambda does.

        Args:
            x: (nodes, 3) positions, mm.
            v: (nodes, 3) velocities.
            lam: load parameter of the step, 0 to 1.
            moving: rate of lambda.
        """
        return self._touch_rates(x, v, lam, moving)[: len(x)]

    def _touch_rates(self, x: Array, v: Array, lam: float, moving: float) -> Array:
        out = np.zeros_like(self._places(x, lam))
        for barrier in self.barriers:
            rates = barrier.times(barrier.places(x, lam), barrier.rates(v, moving))
            out[: len(rates)] += rates
        if self.friction is not None:
            out += self.friction.times(x, self._place_rates(v, moving), lam)
        return out

    def touch_power(self, x: Array, lam: float) -> float:
        """Rate of the energy of `touch` with lambda at fixed x: the work of moulds and of bars that rub, N mm.

        Args:
            x: (nodes, 3) positions, mm.
            lam: load parameter of the step, 0 to 1.
        """
        rates, total = self._place_rates(np.zeros_like(x), 1.0), 0.0
        if self.moulds is not None:
            total += float(
                np.vdot(self.moulds.corner_forces(self.moulds.places(x, lam)), self.moulds.velocity)
            )
        if self.friction is not None:
            total += float(np.vdot(self.friction.forces(x, lam)[1], rates))
        return total

    def touch_stiffness(self, x: Array, v: Array, lam: float) -> float:
        """Second derivative of that energy by lambda, and once by lambda and along v (n, 3), N mm.

        Args:
            x: (nodes, 3) positions, mm.
            v: (nodes, 3) rates of prescribed positions.
            lam: load parameter of the step, 0 to 1.
        """
        if self.moulds is None and self.friction is None:
            return 0.0
        rates = self._place_rates(np.zeros_like(x), 1.0)
        alone = self._touch_rates(x, np.zeros_like(x), lam, 1.0)
        return float(np.vdot(alone, rates)) + float(np.vdot(alone[: len(x)], v))

    # ------------------------------------------------------------------------------- friction, one state after another

    @property
    def lags(self) -> bool:
        """Is there something that is taken from states before (`bh.solvers.lagging.Lagging`)?"""
        return self.friction is not None

    def lag_back(self) -> None:
        """Take it from the state that was accepted last."""
        if self.friction is not None:
            self.friction.back()

    def lag(self, q: Array, lam: float, settled: float) -> bool:
        """Take it from q (size,) unless it changes by less than a part of `settled`; whether it has changed.

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
            settled: largest change, in parts of it.
        """
        return self.friction is not None and self.friction.renew(self.near(q, lam), lam, settled)
