"""What drivers ask of a system about what can stand in its way; every formulation answers alike, by its barriers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Barrier(Protocol):
    """What keeps parts apart that can meet; positions are those that `places` gives, (n, 3), mm."""

    @property
    def seconds(self) -> float:
        """What it has taken so far, s, counted by its work."""
        ...

    def places(self, x: Array, lam: float) -> Array:
        """Positions of all that can meet.

        Args:
            x: (nodes, 3) positions of the sheet, mm.
            lam: load parameter of the step, 0 to 1.

        Returns:
            (n, 3) mm, those of the sheet first.
        """
        ...

    def passed(self, x: Array, moved: Array) -> bool:
        """Would something pass through something on the straight way?

        Args:
            x: (n, 3) where the way begins, mm.
            moved: (n, 3) where it ends, mm.
        """
        ...

    def free_part(self, x: Array, moved: Array) -> float:
        """How much of the straight way is free, 0 to 1.

        Args:
            x: (n, 3) where the way begins, mm.
            moved: (n, 3) where it ends, mm.
        """
        ...

    def approach(self, x: Array, moved: Array) -> float:
        """How much of it leads to where parts begin to press, 0 to 1.

        Args:
            x: (n, 3) where the way begins, mm.
            moved: (n, 3) where it ends, mm.
        """
        ...

    def clear_ways(self, places: Sequence[Array]) -> float:
        """How many of the straight ways from place to place are clear.

        Args:
            places: positions.
        """
        ...

    def clear(self, x: Array) -> bool:
        """Does nothing meet?"""
        ...

    def meetings(self, x: Array) -> str:
        """What meets, in words."""
        ...

    def presses(self, x: Array) -> bool:
        """Does anything press?"""
        ...

    def room(self, x: Array) -> float:
        """What is left of the reach to the pair that presses hardest, in parts of it."""
        ...

    def harden(self, factor: float) -> None:
        """Press by a number of times what the model asks for.

        Args:
            factor: 1 for the model's own.
        """
        ...

    def asleep(self) -> AbstractContextManager[None]:
        """While it lasts it keeps nothing apart."""
        ...


class InTheWay:
    """The part of a system that `bh.solvers.system.Hindered` asks for; where there are no barriers, nothing is.

    Attributes:
        barrier: between panels, or None.
        barriers: all of them.
    """

    barrier: Barrier | None = None
    barriers: tuple[Barrier, ...] = ()

    def near(self, q: Array, lam: float) -> Array:
        """(n, 3) positions of the nodes that can meet, mm.

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        raise NotImplementedError

    def _passed(self, q: Array, lam: float, q_new: Array, lam_new: float) -> str:
        """Whether something would pass through the sheet on the straight way between two states, in words."""
        for barrier in self.barriers:
            if barrier.passed(
                barrier.places(self.near(q, lam), lam), barrier.places(self.near(q_new, lam_new), lam_new)
            ):
                what = (
                    "panels would pass through each other"
                    if barrier is self.barrier
                    else "a mould would pass through"
                )
                return f"{what} on the way there"
        return ""

    def free_part(self, q: Array, dq: Array, lam: float, since: float | None = None) -> float:
        """How much of a step dq (size,) from q nothing stands in, 0 to 1; see `bh.solvers.system.Limited`."""
        return self._least(q, dq, lam, since, "free_part")

    def approach(self, q: Array, dq: Array, lam: float, since: float | None = None) -> float:
        """How much of a step dq (size,) from q leads to where something begins to press, 0 to 1.

        Args:
            q: (size,) unknowns.
            dq: (size,) step.
            lam: load parameter of the step, 0 to 1.
            since: that of q, if it is another one: moulds move on the way.
        """
        return self._least(q, dq, lam, since, "approach")

    def _least(self, q: Array, dq: Array, lam: float, since: float | None, what: str) -> float:
        part = 1.0
        for barrier in self.barriers:
            # prescribed nodes are where they are at the end of the way, moulds where they come from
            begin = lam if since is None or barrier is self.barrier else since
            x, moved = self.near(q, begin), self.near(q + dq, lam)
            part = min(part, getattr(barrier, what)(barrier.places(x, begin), barrier.places(moved, lam)))
        return part

    def meetings(self, x: Array) -> str:
        """Which parts of the sheet meet or lie too near at positions x (n, 3), in words; empty where it is clear.

        Args:
            x: (nodes, 3) positions, mm.
        """
        if self.barrier is None or self.barrier.clear(x):
            return ""
        return self.barrier.meetings(x) or "layers nearer than contact allows"

    @property
    def hindered(self) -> bool:
        """Does anything stand in the way, ever?"""
        return bool(self.barriers)

    @property
    def looking(self) -> float:
        """What looks for contact have taken so far, s of one core of 2.5 GHz, counted by their work."""
        return sum(barrier.seconds for barrier in self.barriers)

    @contextmanager
    def unhindered(self) -> Iterator[None]:
        """While it lasts nothing stands in the way."""
        with ExitStack() as stack:
            for barrier in self.barriers:
                stack.enter_context(barrier.asleep())
            yield

    def clear_ways(self, places: Sequence[tuple[Array, float]]) -> float:
        """How many of the straight ways from place to place are clear of all that can press.

        If it is all of them, the last place is one that the path has come to.

        Args:
            places: unknowns (size,) and load parameter of each; the first is an accepted state.
        """
        ways = len(places) - 1.0
        for barrier in self.barriers:
            ways = min(
                ways, barrier.clear_ways([barrier.places(self.near(q, lam), lam) for q, lam in places])
            )
        return ways

    def pressing(self, q: Array, lam: float) -> bool:
        """Does anything press that can stand in the way at q (size,)?

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        x = self.near(q, lam)
        return any(barrier.presses(barrier.places(x, lam)) for barrier in self.barriers)

    def room(self, q: Array, lam: float) -> float:
        """What the pair that presses hardest at q (size,) has left of the reach of its barrier, 0 to 1.

        Args:
            q: (size,) unknowns.
            lam: load parameter of the step, 0 to 1.
        """
        x = self.near(q, lam)
        return min((barrier.room(barrier.places(x, lam)) for barrier in self.barriers), default=1.0)

    def harden(self, factor: float) -> None:
        """Let everything press by a number of times what the model asks for, until told otherwise.

        Args:
            factor: 1 for the model's own.
        """
        for barrier in self.barriers:
            barrier.harden(factor)

    def reshaped(self, one: tuple[Array, float], other: tuple[Array, float]) -> float:
        """By how much two shapes differ, rigid motions aside: the norm over all nodes, mm.

        Args:
            one: unknowns (size,) and load parameter.
            other: the same of the other shape.
        """
        return apart_in_shape(self.near(*one), self.near(*other))


def apart_in_shape(x: Array, y: Array) -> float:
    """Norm of what is left between two shapes (n, 3), mm, where one is turned onto the other (Kabsch 1976).

    Args:
        x: (n, 3) positions, mm.
        y: (n, 3) positions of the same nodes, mm.
    """
    x, y = x - x.mean(axis=0), y - y.mean(axis=0)
    left, _, right = np.linalg.svd(x.T @ y)
    left[:, 2] *= np.sign(np.linalg.det(left @ right))  # no mirror image
    return float(np.linalg.norm(x @ (left @ right) - y))
