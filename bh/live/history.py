"""What a hand can go back to: what was asked for, with the state in which the sheet was at rest."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bh.live.controls import Controls

Array = NDArray[np.float64]
# of the unknowns that are kept; of what lies further back there are the controls alone
MOST_BYTES = 8_000_000


@dataclass(frozen=True, eq=False)
class Mark:
    """Where a sheet was.

    Attributes:
        controls: what was asked for.
        q: (n,) unknowns of the state at rest with that; None where it had not come to rest, or is too long ago.
        left: as of `Session.left`.
        ways: that it had begun, as of `Session.straight`.
    """

    controls: Controls
    q: Array | None = None
    left: bool = False
    ways: int = 0


def lightened(marks: list[Mark], most: int) -> list[Mark]:
    """The last marks, without the unknowns of those that lie too far back.

    Args:
        marks: the newest last.
        most: marks that are kept.

    Returns:
        `most` of them, with unknowns of `MOST_BYTES` in all.
    """
    kept, size = marks[-most:], 0
    for k in range(len(kept) - 1, -1, -1):
        q = kept[k].q
        if q is None:
            continue
        size += q.nbytes
        if size > MOST_BYTES:
            kept[k] = replace(kept[k], q=None)
    return kept
