"""The shell's word on a design: a whole strip simulated by another formulation than the one that designed it.

`bh` does not import the shell: the formulation is asked for by its name, and found where `fem` is installed beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bh.applications.inverse.simulate import Setting, Simulated, simulate

Array = NDArray[np.float64]
MESHES = ((2.5, 2), (1.25, 4))  # cells along the crease, mm, and rows a panel, coarse first


@dataclass(frozen=True, eq=False)
class Verdict:
    """Where a strip ends by the shell.

    Attributes:
        strips: on each of its meshes, coarse first.
    """

    strips: tuple[Simulated, ...]

    @property
    def end(self) -> Array:
        """(3,) end of the crease in the frame at its start on the finest mesh, mm."""
        return self.strips[-1].t

    @property
    def change(self) -> float:
        """How far the last refinement moved the end, mm; the shell's own error is smaller."""
        return float(np.linalg.norm(self.strips[-1].t - self.strips[-2].t))

    def missed(self, target: Array) -> float:
        """Distance of the end from a point (3,), mm."""
        return float(np.linalg.norm(self.end - target))


def judge(
    k0: Sequence[float],
    length: Sequence[float],
    pinched: Sequence[bool],
    setting: Setting,
    meshes: Sequence[tuple[float, int]] = MESHES,
) -> Verdict:
    """Fold and pinch a strip by the shell, on all its meshes at once, as its kernels let go of the interpreter.

    Args:
        k0: (n,) curvatures before folding, 1/mm.
        length: (n,), mm.
        pinched: (n,).
        setting: sheet, fold and pinch; its mesh and formulation are replaced.
        meshes: two or more, coarse first.

    Raises:
        DesignError: a path ended early.
    """
    with ThreadPoolExecutor(len(meshes)) as pool:
        strips = [
            pool.submit(
                simulate, k0, length, pinched, replace(setting, edge=edge, rows=rows, formulation="shell")
            )
            for edge, rows in meshes
        ]
    return Verdict(tuple(strip.result() for strip in strips))
