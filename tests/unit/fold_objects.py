"""A small FOLD object, how tests read it."""

from __future__ import annotations

import json
import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np

from meshes import SheetMesh
from meshes.io import read_fold

DATA = pathlib.Path(__file__).parents[1] / "data"

SQUARE: dict[str, Any] = {
    "vertices_coords": [[0, 0], [2, 0], [2, 2], [0, 2], [1, 1]],
    "edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [4, 2], [1, 4], [4, 3]],
    "edges_assignment": ["B", "B", "B", "B", "M", "M", "V", "F"],
    "edges_foldAngle": [0, 0, 0, 0, -90, -60, 45, 0],
    "faces_vertices": [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
}

Read = Callable[..., SheetMesh]


def reader(folder: pathlib.Path) -> Read:
    """What reads a FOLD object; keys that are given override it, None deletes them."""

    def read(data: dict[str, Any] | None = None, /, frame: int | None = None, **changes: object) -> SheetMesh:
        whole = {key: value for key, value in ({**(data or {}), **changes}).items() if value is not None}
        path = folder / "sheet.fold"
        path.write_text(json.dumps(whole))
        return read_fold(path, frame)

    return read


def pairs(mesh: SheetMesh, name: str) -> list[list[int]]:
    return [list(pair) for pair in mesh.edge_sets[name].tolist()]


def undirected(pairs: np.ndarray) -> set[tuple[int, int]]:
    return {tuple(sorted(pair)) for pair in pairs.tolist()}
