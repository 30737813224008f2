"""What tests ask of meshes and of messages."""

from __future__ import annotations

import numpy as np

from meshes import SheetMesh


def winding(mesh: SheetMesh) -> np.ndarray:
    """Doubled signed area of every triangle as seen from +z."""
    a, b, c = (mesh.points[mesh.triangles[:, k], :2] for k in range(3))
    return (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]


def one_line(error: BaseException) -> str:
    text = str(error)
    assert text.isprintable()
    assert ";" in text  # the thing; the mend
    return text
