"""What the mesh of a model does to the answer of the consistent formulation."""

from __future__ import annotations

import numpy as np

from bh.formulations.remarks import Remark, loaded, one_row
from bh.model.model import Model


def remarks(model: Model) -> tuple[Remark, ...]:
    """What to know of a model that the consistent formulation solves; empty where there is nothing to say.

    Returns:
        one remark each.
    """
    stretched = _stretched(model)
    return () if stretched is None else (stretched,)


def _stretched(model: Model) -> Remark | None:
    if not loaded(model) or np.isnan(model.mesh.aspect_ratio) or not one_row(model):
        return None
    return Remark(
        "loads",
        "triangles of one strain are too stiff in bending within the plane (4.4, 1.9, 1.2, 1.05 times with 1, 2, "
        "4, 8 rows): where a load pulls the folded sheet use rows",
    )
