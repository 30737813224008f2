"""Closed bodies of triangles from STL files, binary and as text, and from OBJ files."""

from __future__ import annotations

import itertools
import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meshes.errors import FileFormatError
from meshes.io.files import drawing_bytes
from meshes.limits import check_limit
from meshes.topology import Ints

Array = NDArray[np.float64]
KINDS = (".stl", ".obj")
_HEAD = 84  # bytes before the triangles of a binary STL file: a name, and how many there are
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_SAME = 1e-6  # of the size: corners that are nearer than that are one, where a file is not closed otherwise


def read_solid(path: str | os.PathLike[str]) -> tuple[Array, Ints]:
    """A closed body of triangles, its corners in the unit of the file.

    Corners that lie in one place are one, triangles without an area are left out, and the rest is turned outwards.

    Args:
        path: of an STL file (binary or text) or an OBJ file; polygons of the latter are cut from their first corner.

    Returns:
        (n, 3) corners and (t, 3) triangles, counter-clockwise seen from outside.

    Raises:
        FileFormatError: it cannot be read, has no triangles or too many, or is not closed; one line.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in KINDS:
        raise FileFormatError(f"'{suffix}' is no file of a body; give a .stl or an .obj file")
    data = drawing_bytes(path, suffix[1:].upper())
    points, triangles = _obj(data) if suffix == ".obj" else _stl(data)
    if not np.isfinite(points).all() or (len(points) and float(np.abs(points).max()) > 1e12):
        raise FileFormatError("has corners that are no numbers of a bearable size; save it again")
    joined = _joined(points, triangles, 0.0)
    if len(joined[1]) == 0:
        raise FileFormatError("has no triangles with an area; save the body as a mesh of triangles")
    if _open_edges(joined[1]):
        size = float(np.ptp(joined[0], axis=0).max())
        joined = _joined(points, triangles, _SAME * size)
    return _checked(*joined)


def _stl(data: bytes) -> tuple[Array, Ints]:
    count = int.from_bytes(data[80:_HEAD], "little") if len(data) >= _HEAD else -1
    if (
        count >= 0 and len(data) == _HEAD + count * _FACET.itemsize
    ):  # programs begin binary files with "solid", too
        check_limit("solid_triangles", count, "this body", FileFormatError)
        corners = np.frombuffer(data, _FACET, count, _HEAD)["corners"].reshape(-1, 3).astype(float)
    elif data.lstrip()[:5].lower() == b"solid" and (b"vertex" in data or count < 0 or len(data) < 2 * _HEAD):
        corners = _text_corners(data)
    elif count >= 0:
        held = (len(data) - _HEAD) // _FACET.itemsize
        raise FileFormatError(
            f"is cut short or no STL: it says {count:,} triangles and holds {held:,}; save it again"
        )
    else:
        raise FileFormatError("is empty or no STL file; save the body as STL")
    return corners, np.arange(len(corners)).reshape(-1, 3)


def _text_corners(data: bytes) -> Array:
    """(3 t, 3) corners of an STL file that is text."""
    lines = [line.split() for line in data.splitlines()]
    rows = [line[1:4] for line in lines if line and line[0].lower() == b"vertex"]
    check_limit("solid_triangles", len(rows) / 3, "this body", FileFormatError)
    if len(rows) % 3:
        raise FileFormatError(f"has {len(rows)} corners, which are no triangles; save it again")
    return _numbers(rows)


def _obj(data: bytes) -> tuple[Array, Ints]:
    lines = [line.split() for line in data.splitlines()]
    rows = [line[1:4] for line in lines if line and line[0] == b"v"]
    faces = [line[1:] for line in lines if line and line[0] == b"f"]
    check_limit("solid_triangles", sum(max(len(face) - 2, 0) for face in faces), "this body", FileFormatError)
    check_limit("solid_triangles", len(rows) / 3, "this body", FileFormatError)
    found: list[tuple[int, int, int]] = []
    for face in faces:
        try:
            corners = [int(word.split(b"/")[0]) for word in face]
        except ValueError as error:
            raise FileFormatError(
                f"has a face that is no list of corners ({error}); save it again"
            ) from error
        corners = [corner - 1 if corner > 0 else len(rows) + corner for corner in corners]
        if any(not 0 <= corner < len(rows) for corner in corners):
            raise FileFormatError("has a face with a corner that it does not have; save it again")
        found += [(corners[0], b, c) for b, c in itertools.pairwise(corners[1:])]
    return _numbers(rows), np.array(found, dtype=np.int64).reshape(-1, 3)


def _numbers(rows: list[list[bytes]]) -> Array:
    try:
        return np.array([[float(word) for word in row] for row in rows]).reshape(-1, 3)
    except ValueError as error:
        raise FileFormatError(f"has a corner that is no three numbers ({error}); save it again") from error


def _joined(points: Array, triangles: Ints, within: float) -> tuple[Array, Ints]:
    """Corners in one place, or in one cell of a grid of that width, as one; triangles that keep three corners."""
    keys = np.round((points - points.min(axis=0)) / within) if within and len(points) else points
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    corners = points[first]
    joined = np.asarray(number.reshape(-1)[triangles], dtype=np.int64)
    a, b, c = joined.T
    joined = joined[(a != b) & (b != c) & (c != a)]
    used, number = np.unique(joined, return_inverse=True)
    return corners[used], np.asarray(number.reshape(joined.shape), dtype=np.int64)


def _open_edges(triangles: Ints) -> int:
    """How many edges do not belong to two triangles that pass them in opposite directions."""
    ends = np.vstack([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    size = int(triangles.max()) + 1
    along, back = (ends @ np.array(w, dtype=np.int64) for w in ((size, 1), (1, size)))
    keys, counts = np.unique(along, return_counts=True)
    lonely = ~np.isin(keys, back) | (counts > 1)
    return int(lonely.sum())


def _checked(points: Array, triangles: Ints) -> tuple[Array, Ints]:
    missing = _open_edges(triangles)
    if missing:
        raise FileFormatError(
            f"is not closed: {missing:,} edges do not join two triangles that face the same way; repair the mesh "
            "(a program such as MeshLab or Blender does it) and save it again"
        )
    corner = points[triangles] - points.mean(axis=0)
    volume = float(np.einsum("tc,tc->", corner[:, 0], np.cross(corner[:, 1], corner[:, 2]))) / 6.0
    if abs(volume) <= 1e-12 * float(np.ptp(points, axis=0).max()) ** 3:
        raise FileFormatError("has no inside: its volume is zero; save a solid body")
    return points, triangles if volume > 0.0 else np.ascontiguousarray(triangles[:, ::-1])


def encloses(points: Array, triangles: Ints, at: Array) -> NDArray[np.bool_]:
    """Which places lie inside a closed body: those round which its triangles wind (van Oosterom and Strackee 1983).

    Args:
        points: (n, 3) corners.
        triangles: (t, 3) of them.
        at: (k, 3) places.

    Returns:
        (k,) True inside.
    """
    inside = np.zeros(len(at), dtype=bool)
    near = np.flatnonzero(((at > points.min(axis=0)) & (at < points.max(axis=0))).all(axis=1))
    corner = points[triangles]
    for k in near.tolist():
        a, b, c = (corner[:, i] - at[k] for i in range(3))
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        triple = np.einsum("tc,tc->t", a, np.cross(b, c))
        rest = la * lb * lc
        for u, v, w in ((a, b, lc), (b, c, la), (c, a, lb)):
            rest = rest + np.einsum("tc,tc->t", u, v) * w
        inside[k] = abs(float(np.arctan2(triple, rest).sum())) > np.pi  # half of the solid angle, 2 pi inside
    return inside
