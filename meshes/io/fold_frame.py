"""One frame of a FOLD file, read and checked."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from meshes.curves import Array
from meshes.errors import FileFormatError
from meshes.io.files import drawing_bytes
from meshes.limits import check_limit

UNITS = {
    "unit": 1.0,
    "mm": 1.0,
    "cm": 10.0,
    "m": 1e3,
    "in": 25.4,
    "pt": 25.4 / 72.0,
    "um": 1e-3,
    "nm": 1e-6,
}  # mm a unit
LETTERS = "MVFBUCJ"
BENDS = re.compile(r"edges_(\w+:)?controlPoints")  # an extension of the format
MOST_BENDS = 2  # control points of a curve: cubic
PLANE = 1e-6  # of the size: points that are no farther off lie in a plane
LIMIT = 1e12  # mm; beyond it products of coordinates lose all meaning

Face = list[list[int]]  # rings of vertices: the outside, then holes the other way round
Side = tuple[int, int]  # two vertices, the smaller one first


@dataclass(frozen=True)
class Frame:
    """One frame, checked: what the file says about points, edges and faces.

    Attributes:
        points: (n, 3), mm.
        edges: two vertex numbers each.
        letters: assignment of every edge, one of M, V, F, B, U, C and J.
        angles: fold angles of the edges, degrees, valley positive, nan where the file has null; None without
            any.
        faces: rings of vertex numbers each; may be empty.
        bends: (k, 3) control points between the ends of an edge that is a Bezier curve, mm, by its number.
    """

    points: Array
    edges: list[Side]
    letters: list[str]
    angles: list[float] | None
    faces: list[Face]
    bends: Mapping[int, Array] = field(default_factory=dict)

    @cached_property
    def flat(self) -> bool:
        """True if all vertices have one z (to 1e-9 of the size)."""
        return bool(np.ptp(self.points[:, 2]) <= 1e-9 * np.linalg.norm(np.ptp(self.points, axis=0)))


def laid_flat(frame: Frame) -> Frame:
    """The frame turned into the plane z = 0, if it lies in some other plane.

    The side that the faces show (or, without faces, the side of the positive axis that is nearest to the normal) comes
    to look along +z; nothing is mirrored, so mountains stay mountains.

    Args:
        frame: checked.
    """
    if frame.flat or len(frame.points) < 3:
        return frame
    middle = frame.points.mean(axis=0)
    away = frame.points - middle
    _, size, axes = np.linalg.svd(away, full_matrices=False)
    if size[2] > PLANE * size[0] or size[1] <= PLANE * size[0]:
        return frame
    normal = axes[2] * np.sign(axes[2][np.argmax(np.abs(axes[2]))])
    if frame.faces:
        ring = away[frame.faces[0][0]]
        normal = normal * (np.sign(np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0) @ normal) or 1.0)
    normal = np.where(np.abs(normal) < PLANE, 0.0, normal)
    normal /= np.linalg.norm(normal)
    across = np.array((1.0, 0.0, 0.0)) if abs(normal[0]) < 0.9 else np.array((0.0, 1.0, 0.0))
    across = across - (across @ normal) * normal
    across /= np.linalg.norm(across)

    def turned(points: Array) -> Array:
        along = np.column_stack((points @ across, points @ np.cross(normal, across)))
        return np.column_stack((along, np.zeros(len(along))))

    bends = {edge: turned(points) for edge, points in frame.bends.items()}
    return replace(frame, points=turned(frame.points), bends=bends)


MOST_OBJECTS = 200_000  # in JSON, some 70 bytes each in memory


def load(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The JSON object at the top of a FOLD file.

    Returns:
        the object, as JSON has it.

    Raises:
        FileFormatError: the file cannot be read, or is not a JSON object.
    """

    def refuse(constant: str) -> None:
        raise FileFormatError(f"{constant} is not JSON; write a number")

    try:
        text = drawing_bytes(path, "FOLD").decode("utf-8-sig")
        if not text.strip():
            raise FileFormatError("the file is empty; give a FOLD file")
        if text.count("{") > MOST_OBJECTS:
            raise FileFormatError(f"more than {MOST_OBJECTS:,} objects {{...}}; FOLD has one a frame")
        data = json.loads(text, parse_constant=refuse)
    except UnicodeDecodeError as error:
        raise FileFormatError(f"byte {error.start} is not UTF-8; save the file as UTF-8 text") from error
    except RecursionError as error:
        raise FileFormatError("brackets are nested too deeply; FOLD has only lists of lists") from error
    except FileFormatError:
        raise
    except ValueError as error:  # JSON errors, numbers of thousands of digits, null characters in the path
        raise FileFormatError(f"this is not JSON ({str(error)[:80]}); mend it or export it again") from error
    if not isinstance(data, dict):
        raise FileFormatError(f"the top of the file is {show(data)}; a FOLD file is a JSON object {{...}}")
    return data


def select(data: dict[str, Any], frame: int | str | None) -> dict[str, Any]:
    """The frame asked for, with all it inherits.

    Args:
        data: the top of the file.
        frame: 0 for the key frame, i + 1 for file_frames[i], or the frame_title of one; None for the first frame that
            has vertices and is no folded form, or the first that has vertices where all are.

    Returns:
        the keys of the frame.

    Raises:
        FileFormatError: there is no such frame, or frames inherit in a circle.
    """
    frames = [data, *_list(data, "file_frames")]
    check_limit("frames", len(frames), "this file", FileFormatError)
    for number, each in enumerate(frames):
        if not isinstance(each, dict):
            raise FileFormatError(f"file_frames[{number - 1}] is {show(each)}; a frame is an object {{...}}")
    if isinstance(frame, str):
        return _inherited(frames, _titled(frames, frame))
    if frame is not None:
        if isinstance(frame, bool) or not isinstance(frame, int | np.integer) or not 0 <= frame < len(frames):
            raise FileFormatError(f"there is no frame {frame!r}; the file has frames 0 to {len(frames) - 1}")
        return _inherited(frames, int(frame))
    found = [_inherited(frames, number) for number in range(len(frames))]
    found = [each for each in found if each.get("vertices_coords")]
    if not found:
        raise FileFormatError("no frame has vertices_coords; give the coordinates of the vertices")
    return next((each for each in found if not _is_folded(each)), found[0])


def _is_folded(frame: dict[str, Any]) -> bool:
    classes = frame.get("frame_classes")
    return isinstance(classes, list) and "foldedForm" in classes


def _titled(frames: list[dict[str, Any]], title: str) -> int:
    """Number of the frame that has a title (that of the file stands for the key frame)."""
    titles = [str(each.get("frame_title") or each.get("file_title") or "") for each in frames]
    if title not in titles:
        listed = ", ".join(show(each) for each in titles if each) or "none has one"
        raise FileFormatError(f"there is no frame titled {show(title)}; titles: {listed}")
    return titles.index(title)


def _inherited(frames: list[dict[str, Any]], number: int) -> dict[str, Any]:
    line = [number]
    while True:
        inherit = frames[line[-1]].get("frame_inherit", False)
        if not isinstance(inherit, bool):
            raise FileFormatError(f"frame_inherit of frame {line[-1]} is {show(inherit)}; use true or false")
        if not inherit:
            break
        parent = frames[line[-1]].get("frame_parent")
        parent = _index(parent, len(frames), f"frame_parent of frame {line[-1]}")
        if parent in line:
            raise FileFormatError(f"frame {line[-1]} inherits from itself by frame {parent}; break the loop")
        line.append(parent)
    merged: dict[str, Any] = {}
    for each in reversed(line):
        merged.update(frames[each])
    return merged


def check(frame: dict[str, Any]) -> Frame:
    """A frame in mm, every number of which is known to fit the others.

    Args:
        frame: a JSON object with all it inherits, see `select`.

    Raises:
        FileFormatError: one line that names the key, the place in it and the mend.
    """
    for key in ("vertices_coords", "edges_vertices", "faces_vertices"):
        check_limit("entities", len(_list(frame, key)), f"{key} of this frame", FileFormatError)
    points = _points(frame)
    count = len(points)
    edges: list[Side] = []
    numbers: dict[Side, int] = {}
    for number, pair in enumerate(_list(frame, "edges_vertices")):
        what = f"edges_vertices[{number}]"
        if not isinstance(pair, list) or len(pair) != 2:
            raise FileFormatError(f"{what} is {show(pair)}; an edge is a list of two vertex numbers")
        a, b = (_index(vertex, count, f"a vertex of {what}") for vertex in pair)
        if a == b:
            raise FileFormatError(f"{what} joins vertex {a} to itself; remove it")
        if side(a, b) in numbers:
            raise FileFormatError(f"{what} repeats edge {numbers[side(a, b)]} ({a}-{b}); remove one of them")
        numbers[side(a, b)] = number
        edges.append((a, b))
    angles = _angles(frame, len(edges))
    letters = _letters(frame, len(edges), angles)
    faces: list[Face] = []
    for number, ring in enumerate(_list(frame, "faces_vertices")):
        what = f"faces_vertices[{number}]"
        if not isinstance(ring, list) or len(ring) < 3:
            raise FileFormatError(f"{what} is {show(ring)}; a face is a list of three or more vertices")
        ring = [_index(vertex, count, f"a vertex of {what}") for vertex in ring]
        if len(set(ring)) < len(ring):
            raise FileFormatError(f"{what} uses a vertex twice; name every corner once, split slit faces")
        faces.append([ring])
    if not faces and not edges:
        raise FileFormatError("the frame has no faces_vertices and no edges_vertices; give one of them")
    return Frame(points, edges, letters, angles, faces, _bends(frame, len(edges)))


def _points(frame: dict[str, Any]) -> Array:
    unit = frame.get("frame_unit", "unit")
    if not isinstance(unit, str) or unit not in UNITS:
        raise FileFormatError(f"frame_unit {show(unit)} is not known; use one of {', '.join(UNITS)}")
    rows = _list(frame, "vertices_coords")
    if not rows:
        raise FileFormatError("the frame has no vertices_coords; give [x, y] or [x, y, z] for every vertex")
    points = [_point(row, f"vertices_coords[{vertex}]", unit) for vertex, row in enumerate(rows)]
    return np.array(points) * UNITS[unit]


def _point(row: object, what: str, unit: str) -> list[float]:
    """x, y and z of a row, in its unit."""
    if not isinstance(row, list) or len(row) not in (2, 3):
        raise FileFormatError(f"{what} is {show(row)}; give [x, y] or [x, y, z]")
    for value in row:
        if not _is_number(value) or not abs(value) <= LIMIT / UNITS[unit]:
            raise FileFormatError(f"{what} holds {show(value)}; give numbers up to {LIMIT:g} mm in size")
    return [float(value) for value in (*row, 0.0)[:3]]


def _bends(frame: dict[str, Any], count: int) -> dict[int, Array]:
    """Control points (k, 3) of the edges that are curves, mm."""
    found: dict[int, Array] = {}
    unit = frame.get("frame_unit", "unit")
    for key in filter(BENDS.fullmatch, frame):
        rows = _list(frame, key)
        _same_length(key, len(rows), count)
        for edge, row in enumerate(rows):
            what = f"{key}[{edge}]"
            if row is None or row == []:
                continue
            if not isinstance(row, list) or len(row) > MOST_BENDS:
                raise FileFormatError(
                    f"{what} is {show(row)}; give null, or one or two points (quadratic, cubic Bezier curves)"
                )
            points = [_point(point, f"{what}[{k}]", unit) for k, point in enumerate(row)]
            found[edge] = np.array(points) * UNITS[unit]
    return found


def _angles(frame: dict[str, Any], count: int) -> list[float] | None:
    if frame.get("edges_foldAngle") is None:
        return None
    values = _list(frame, "edges_foldAngle")
    _same_length("edges_foldAngle", len(values), count)
    for edge, value in enumerate(values):
        if value is not None and not (_is_number(value) and abs(value) <= 180.0 + 1e-9):
            raise FileFormatError(f"edges_foldAngle[{edge}] is {show(value)}; give degrees from -180 to 180")
    return [math.nan if value is None else float(value) for value in values]


def _letters(frame: dict[str, Any], count: int, angles: list[float] | None) -> list[str]:
    if frame.get("edges_assignment") is None:  # then the sign of the angle says which crease it is
        return ["M" if angle < 0.0 else "V" if angle > 0.0 else "U" for angle in angles or [0.0] * count]
    letters = _list(frame, "edges_assignment")
    _same_length("edges_assignment", len(letters), count)
    for edge, letter in enumerate(letters):
        if not isinstance(letter, str) or len(letter) != 1 or letter not in LETTERS:
            raise FileFormatError(f"edges_assignment[{edge}] is {show(letter)}; use one of {LETTERS}")
    return letters


def _same_length(key: str, length: int, count: int) -> None:
    if length != count:
        raise FileFormatError(f"{key} has {length} entries for {count} edges_vertices; give one an edge")


def _list(frame: dict[str, Any], key: str) -> list[Any]:
    value = frame.get(key)
    if value is None:
        return []
    if not isinstance(value, list):
        raise FileFormatError(f"{key} is {show(value)}; give a list")
    return value


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _index(value: object, count: int, what: str) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < count:
        raise FileFormatError(f"{what} is {show(value)}; use a whole number from 0 to {count - 1}")
    return value


def show(value: object) -> str:
    """A JSON value in a few characters of ASCII on one line (lists and objects can be nested deeply)."""
    if isinstance(value, dict | list):
        return "an object" if isinstance(value, dict) else f"a list of {len(value)}"
    text = json.dumps(value)
    return text if len(text) <= 40 else f"{text[:36]} ..."


def side(a: int, b: int) -> Side:
    """The pair of two vertices, the smaller one first.

    Args:
        a: vertex.
        b: vertex.
    """
    return (a, b) if a < b else (b, a)
