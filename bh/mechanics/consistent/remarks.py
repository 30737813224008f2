"""What the mesh of a model does to the answer of the consistent formulation."""

from __future__ import annotations

from bh.formulations.remarks import Remark, loaded, one_row
from bh.model.model import Model


def remarks(model: Model) -> tuple[Remark, ...]:
    """What to know of a model that the consistent formulation solves; empty where there is nothing to say.

    Returns:
        one remark each.
    """
    few = _rows(model)
    return () if few is None else (few,)


def _rows(model: Model) -> Remark | None:
    """One row of cells does not see a panel bow across, in any formulation (docs/formulation.md)."""
    if not one_row(model):
        return None
    pulled = ", and 39 % where a folded sector is lifted by its tip" if loaded(model) else ""
    return Remark(
        "rows",
        "no node of the mesh lies inside a panel, so that it cannot bow across: folded energies come out 4 to "
        f"32 % low{pulled}; use rows = 4 (smaller triangles of other meshes), or accuracy = 0.05 in place of the mesh",
    )
