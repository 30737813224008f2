"""FOLD files, version 1.2 (https://github.com/edemaine/fold/blob/main/doc/spec.md), to and from `SheetMesh`.

FOLD's fold angles are degrees, valley positive; ours are rad, mountain positive. Frames count as in FOLD: 0
is the key frame (the top of the file), i + 1 is `file_frames[i]`.
"""

from __future__ import annotations

import itertools
import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from meshes.curves import Array
from meshes.errors import FileFormatError, InputError
from meshes.io.export import replacing, shown
from meshes.mesh import SheetMesh
from meshes.pattern import FoldKind
from meshes.topology import boundary_loops, build

UNITS = {
    "unit": 1.0, "mm": 1.0, "cm": 10.0, "m": 1e3, "in": 25.4, "pt": 25.4 / 72.0, "um": 1e-3, "nm": 1e-6,
}  # fmt: skip
LETTERS = "MVFBUCJ"
FOLDS: dict[str, FoldKind] = {"M": "mountain", "V": "valley"}
SETS = {"F": "edge:flat", "U": "edge:unassigned", "J": "edge:join"}
LIMIT = 1e12  # mm; beyond it products of coordinates lose all meaning
THIN = 1e-10  # doubled area over longest side squared of a degenerate triangle, as in SheetMesh
STRAIGHT = 1e-3  # rad; files give coordinates to some six digits

Face = list[list[int]]  # rings of vertices: the outside, then holes the other way round
Side = tuple[int, int]  # two vertices, the smaller one first


@dataclass(frozen=True)
class _Frame:
    """One frame, checked: what the file says about points (n, 3) in mm, edges and faces."""

    points: Array
    edges: list[Side]
    letters: list[str]
    angles: list[float] | None  # degrees, valley positive; nan where the file has null
    faces: list[Face]

    @cached_property
    def flat(self) -> bool:
        return bool(np.ptp(self.points[:, 2]) <= 1e-9 * np.linalg.norm(np.ptp(self.points, axis=0)))


def read_fold(path: str | os.PathLike[str], frame: int | None = None) -> SheetMesh:
    """The sheet of one frame of a FOLD file, with faces triangulated, in mm.

    Vertices keep their order; those that belong to no face are dropped. Faces are turned to agree with each
    other, and counter-clockwise from +z where the sheet is flat: mountain and valley then are as seen from +z.
    A frame without faces_vertices gets them from its edges if these are a plane graph; B edges round holes.

    The edge sets are "crease:mountain" and "crease:valley" (all such edges), their chains "crease:m1", ...,
    "crease:v1", ... in the order of the file, "edge:boundary", and where there are any "edge:flat" (F),
    "edge:unassigned" (U, or not in edges_vertices), "edge:join" (J) and "edge:facet" (added to cut faces into
    triangles). `fold_angles` are there if the file has edges_foldAngle (nan for a null).

    Args:
        frame: 0 for the key frame, i + 1 for file_frames[i]; None for the first frame that has vertices.

    Raises:
        FileFormatError: the file cannot be read, is not FOLD, or its frame is not one manifold sheet.
    """
    import shapely

    try:
        return _sheet(_checked(_select(_load(path), frame)))
    except (InputError, shapely.errors.ShapelyError) as error:
        text = " ".join(str(error).split())
        raise FileFormatError(f"{shown(path)}: {text}") from error


# --- the file -------------------------------------------------------------------------------------


def _load(path: str | os.PathLike[str]) -> dict[str, Any]:
    def refuse(constant: str) -> None:
        raise FileFormatError(f"{constant} is not JSON; write a number")

    try:
        text = Path(path).read_bytes().decode("utf-8-sig")
        if not text.strip():
            raise FileFormatError("the file is empty; give a FOLD file")
        data = json.loads(text, parse_constant=refuse)
    except IsADirectoryError as error:
        raise FileFormatError("this is a folder; name a .fold file in it") from error
    except OSError as error:
        raise FileFormatError(f"cannot be read ({error.strerror}); check the name and rights") from error
    except UnicodeDecodeError as error:
        raise FileFormatError(f"byte {error.start} is not UTF-8; save the file as UTF-8 text") from error
    except RecursionError as error:
        raise FileFormatError("brackets are nested too deeply; FOLD has only lists of lists") from error
    except FileFormatError:
        raise
    except ValueError as error:  # JSON errors, numbers of thousands of digits, null characters in the path
        raise FileFormatError(f"this is not JSON ({str(error)[:80]}); mend it or export it again") from error
    if not isinstance(data, dict):
        raise FileFormatError(f"the top of the file is {_show(data)}; a FOLD file is a JSON object {{...}}")
    return data


def _select(data: dict[str, Any], frame: int | None) -> dict[str, Any]:
    """The frame asked for, with all it inherits."""
    frames = [data, *_list(data, "file_frames")]
    for number, each in enumerate(frames):
        if not isinstance(each, dict):
            raise FileFormatError(f"file_frames[{number - 1}] is {_show(each)}; a frame is an object {{...}}")
    if frame is not None:
        if isinstance(frame, bool) or not isinstance(frame, int | np.integer) or not 0 <= frame < len(frames):
            raise FileFormatError(f"there is no frame {frame!r}; the file has frames 0 to {len(frames) - 1}")
        return _inherited(frames, int(frame))
    for number in range(len(frames)):
        found = _inherited(frames, number)
        if found.get("vertices_coords"):
            return found
    raise FileFormatError("no frame has vertices_coords; give the coordinates of the vertices")


def _inherited(frames: list[dict[str, Any]], number: int) -> dict[str, Any]:
    line = [number]
    while True:
        inherit = frames[line[-1]].get("frame_inherit", False)
        if not isinstance(inherit, bool):
            raise FileFormatError(f"frame_inherit of frame {line[-1]} is {_show(inherit)}; use true or false")
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


def _checked(frame: dict[str, Any]) -> _Frame:
    points = _points(frame)
    count = len(points)
    edges: list[Side] = []
    numbers: dict[Side, int] = {}
    for number, pair in enumerate(_list(frame, "edges_vertices")):
        what = f"edges_vertices[{number}]"
        if not isinstance(pair, list) or len(pair) != 2:
            raise FileFormatError(f"{what} is {_show(pair)}; an edge is a list of two vertex numbers")
        a, b = (_index(vertex, count, f"a vertex of {what}") for vertex in pair)
        if a == b:
            raise FileFormatError(f"{what} joins vertex {a} to itself; remove it")
        if _side(a, b) in numbers:
            raise FileFormatError(f"{what} repeats edge {numbers[_side(a, b)]} ({a}-{b}); remove one of them")
        numbers[_side(a, b)] = number
        edges.append((a, b))
    angles = _angles(frame, len(edges))
    letters = _letters(frame, len(edges), angles)
    faces: list[Face] = []
    for number, ring in enumerate(_list(frame, "faces_vertices")):
        what = f"faces_vertices[{number}]"
        if not isinstance(ring, list) or len(ring) < 3:
            raise FileFormatError(f"{what} is {_show(ring)}; a face is a list of three or more vertices")
        ring = [_index(vertex, count, f"a vertex of {what}") for vertex in ring]
        if len(set(ring)) < len(ring):
            raise FileFormatError(f"{what} uses a vertex twice; name every corner once, split slit faces")
        faces.append([ring])
    if not faces and not edges:
        raise FileFormatError("the frame has no faces_vertices and no edges_vertices; give one of them")
    return _Frame(points, edges, letters, angles, faces)


def _points(frame: dict[str, Any]) -> Array:
    unit = frame.get("frame_unit", "unit")
    if not isinstance(unit, str) or unit not in UNITS:
        raise FileFormatError(f"frame_unit {_show(unit)} is not known; use one of {', '.join(UNITS)}")
    rows = _list(frame, "vertices_coords")
    if not rows:
        raise FileFormatError("the frame has no vertices_coords; give [x, y] or [x, y, z] for every vertex")
    points = np.zeros((len(rows), 3))
    for vertex, row in enumerate(rows):
        if not isinstance(row, list) or len(row) not in (2, 3):
            raise FileFormatError(f"vertices_coords[{vertex}] is {_show(row)}; give [x, y] or [x, y, z]")
        for axis, value in enumerate(row):
            if not _is_number(value) or not abs(value) <= LIMIT / UNITS[unit]:
                raise FileFormatError(
                    f"vertices_coords[{vertex}] holds {_show(value)}; give numbers up to {LIMIT:g} mm in size"
                )
            points[vertex, axis] = value
    return points * UNITS[unit]


def _angles(frame: dict[str, Any], count: int) -> list[float] | None:
    if frame.get("edges_foldAngle") is None:
        return None
    values = _list(frame, "edges_foldAngle")
    _same_length("edges_foldAngle", len(values), count)
    for edge, value in enumerate(values):
        if value is not None and not (_is_number(value) and abs(value) <= 180.0 + 1e-9):
            raise FileFormatError(f"edges_foldAngle[{edge}] is {_show(value)}; give degrees from -180 to 180")
    return [math.nan if value is None else float(value) for value in values]


def _letters(frame: dict[str, Any], count: int, angles: list[float] | None) -> list[str]:
    if frame.get("edges_assignment") is None:  # then the sign of the angle says which crease it is
        return ["M" if angle < 0.0 else "V" if angle > 0.0 else "U" for angle in angles or [0.0] * count]
    letters = _list(frame, "edges_assignment")
    _same_length("edges_assignment", len(letters), count)
    for edge, letter in enumerate(letters):
        if not isinstance(letter, str) or len(letter) != 1 or letter not in LETTERS:
            raise FileFormatError(f"edges_assignment[{edge}] is {_show(letter)}; use one of {LETTERS}")
    return letters


def _same_length(key: str, length: int, count: int) -> None:
    if length != count:
        raise FileFormatError(f"{key} has {length} entries for {count} edges_vertices; give one an edge")


def _list(frame: dict[str, Any], key: str) -> list[Any]:
    value = frame.get(key)
    if value is None:
        return []
    if not isinstance(value, list):
        raise FileFormatError(f"{key} is {_show(value)}; give a list")
    return value


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _index(value: object, count: int, what: str) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < count:
        raise FileFormatError(f"{what} is {_show(value)}; use a whole number from 0 to {count - 1}")
    return value


def _show(value: object) -> str:
    """A JSON value in a few characters of ASCII on one line (lists and objects can be nested deeply)."""
    if isinstance(value, dict | list):
        return "an object" if isinstance(value, dict) else f"a list of {len(value)}"
    text = json.dumps(value)
    return text if len(text) <= 40 else f"{text[:36]} ..."


def _side(a: int, b: int) -> Side:
    return (a, b) if a < b else (b, a)


# --- faces ----------------------------------------------------------------------------------------


def _directed(face: Face) -> list[tuple[int, int]]:
    return [(ring[i - 1], ring[i]) for ring in face for i in range(len(ring))]


def _sides(faces: Sequence[Face]) -> dict[Side, list[int]]:
    """The one or two faces at every side."""
    sides: dict[Side, list[int]] = {}
    for number, face in enumerate(faces):
        for a, b in _directed(face):
            sides.setdefault(_side(a, b), []).append(number)
    for (a, b), at in sides.items():
        if len(at) > 2:
            raise FileFormatError(
                f"edge {a}-{b} belongs to {len(at)} faces (non-manifold): {at[0]}, {at[1]}, {at[2]}; "
                "a sheet has one or two faces an edge"
            )
    return sides


def _faces_of_graph(frame: _Frame) -> list[Face]:
    """The bounded faces of a plane graph, without the holes that B edges outline."""
    import shapely

    if not frame.flat:
        raise FileFormatError("a frame in space has no faces_vertices; give them (flat edges do without)")
    _check_plane_graph(frame)
    xy = frame.points[:, :2]
    vertex = {tuple(xy[v]): v for edge in frame.edges for v in edge}
    polygons = shapely.polygonize(shapely.linestrings(xy[np.array(frame.edges)])).geoms
    faces = []
    for polygon in shapely.orient_polygons(np.array(list(polygons), dtype=object)):
        rings = [np.asarray(ring.coords)[:-1] for ring in (polygon.exterior, *polygon.interiors)]
        faces.append([[vertex[tuple(point)] for point in ring] for ring in rings])
    sides = _sides(faces)
    for number, (a, b) in enumerate(frame.edges):
        if _side(a, b) not in sides:
            raise FileFormatError(
                f"edge {number} ({a}-{b}) hangs loose: it has the same face on both sides; "
                "lengthen its line to another one or remove it"
            )
    inside = _inside(frame, sides, len(faces))
    return [face for number, face in enumerate(faces) if inside[number]]


def _check_plane_graph(frame: _Frame) -> None:
    import shapely

    xy, edges = frame.points[:, :2], np.array(frame.edges)
    size = float(np.linalg.norm(np.ptp(xy, axis=0)))
    lines = shapely.linestrings(xy[edges])
    tree = shapely.STRtree(lines)
    used = np.unique(edges)
    at, on = tree.query(shapely.points(xy[used]), predicate="dwithin", distance=1e-9 * size)
    for v, edge in zip(used[at].tolist(), on.tolist(), strict=True):
        a, b = frame.edges[edge]
        if v not in (a, b):
            raise FileFormatError(
                f"vertex {v} lies on edge {edge} ({a}-{b}) that does not end there; "
                "split the edge at the vertex or merge vertices in one place"
            )
    for i, j in tree.query(lines, predicate="intersects").T.tolist():
        if i < j and not set(frame.edges[i]) & set(frame.edges[j]):
            raise FileFormatError(f"edges {i} and {j} cross; give them a vertex where they meet")


def _inside(frame: _Frame, sides: dict[Side, list[int]], count: int) -> list[bool]:
    """Which faces are sheet: those at the outside, and a closed line of B edges leads into a hole or out."""
    inside: list[bool | None] = [None] * count
    near: list[list[int]] = [[] for _ in range(count)]
    borders: list[list[tuple[int, int]]] = [[] for _ in range(count)]
    for number, edge in enumerate(frame.edges):
        at = sides[_side(*edge)]
        if len(at) == 1:
            inside[at[0]] = True
            continue
        for face, other in (at, at[::-1]):
            if frame.letters[number] == "B":
                borders[face].append((other, number))
            else:
                near[face].append(other)
    todo = [face for face in range(count) if inside[face]]
    crossings: list[tuple[int, int, int]] = []
    while todo or crossings:
        if todo:  # borders wait until their region is through, so that a conflict shows at the wrong border
            face = todo.pop()
            crossings += [(face, other, number) for other, number in borders[face]]
            reached, value = near[face], bool(inside[face])
        else:
            face, other, number = crossings.pop()
            reached, value = [other], not inside[face]
            if inside[other] is not None and inside[other] != value:
                a, b = frame.edges[number]
                raise FileFormatError(
                    f"edge {number} ({a}-{b}) is assigned B but does not part the sheet from a hole; "
                    "close its line round the hole, or assign M, V, F or U"
                )
        for other in reached:
            if inside[other] is None:
                inside[other] = value
                todo.append(other)
    return [bool(value) for value in inside]


def _orient(frame: _Frame, faces: list[Face], sides: dict[Side, list[int]]) -> list[Face]:
    """The faces of one sheet, turned to agree: with +z where it is flat, else with most of the faces."""
    ahead = [set(_directed(face)) for face in faces]
    turned: list[bool | None] = [None] * len(faces)
    turned[0] = False
    todo = [0]
    while todo:
        face = todo.pop()
        for a, b in ahead[face]:
            for other in sides[_side(a, b)]:
                if other == face:
                    continue
                value = bool(turned[face]) != ((a, b) in ahead[other])
                if turned[other] is None:
                    turned[other] = value
                    todo.append(other)
                elif turned[other] != value:
                    raise FileFormatError(
                        f"faces {face} and {other} have no common side up (one-sided band); cut the band open"
                    )
    if None in turned:
        raise FileFormatError(
            f"faces 0 and {turned.index(None)} are not joined through common edges; a file holds one sheet"
        )
    against = sum(map(bool, turned)) > len(faces) / 2
    if frame.flat:
        areas = [_area(frame.points[:, :2], face) for face in faces]
        against = sum(-area if turn else area for area, turn in zip(areas, turned, strict=True)) < 0.0
    return [
        [ring[::-1] for ring in face] if turn != against else face
        for face, turn in zip(faces, turned, strict=True)
    ]


def _area(xy: Array, face: Face) -> float:
    """Signed area, counter-clockwise positive; from the first vertex, lest far-off sheets lose digits."""
    total = 0.0
    for ring in face:
        x, y = (xy[ring] - xy[face[0][0]]).T
        total += 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    return total


# --- triangles ------------------------------------------------------------------------------------


def _triangulate(points: Array, face: Face, flat: bool) -> list[list[int]]:
    """Triangles (vertex numbers) of one face, turned as the face is; `points` (n, 3).

    Raises:
        FileFormatError: the face has no area or is no simple polygon (in space: seen along its mean normal).
    """
    import shapely

    vertices = [vertex for ring in face for vertex in ring]
    xyz = points[vertices] - points[vertices[0]]
    xy = xyz[:, :2] if flat else _projected(xyz)
    triangles = [[0, 1, 2]]
    if len(vertices) > 3:
        ends = np.cumsum([len(ring) for ring in face])
        outside, *holes = np.split(xy, ends[:-1])
        polygon = shapely.Polygon(outside, holes)
        if not polygon.is_valid:
            raise FileFormatError(f"is not a simple polygon ({shapely.is_valid_reason(polygon)}); redraw it")
        if len(vertices) == 4:
            triangles = _halves(xy, xyz, vertices)
        else:
            triangles = _delaunay(polygon, xy, len(vertices) + 2 * len(holes) - 2)
    if min(_fullness(xy, triangle) for triangle in triangles) <= THIN:
        raise FileFormatError("has no area or corners in one place; remove it or merge its vertices")
    return [[vertices[i] for i in triangle] for triangle in triangles]


def _projected(xyz: Array) -> Array:
    """(k, 2) positions of a ring in space in the plane of its mean normal, counter-clockwise."""
    after = np.roll(xyz, -1, axis=0)
    normal = np.cross(xyz, after).sum(axis=0)
    steps = np.linalg.norm(after - xyz, axis=1)
    if np.linalg.norm(normal) <= THIN * steps.max() ** 2:
        raise FileFormatError("has no area; remove it or move its vertices apart")
    normal /= np.linalg.norm(normal)
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    return xyz @ np.column_stack((first, np.cross(normal, first)))


def _fullness(xy: Array, triangle: Sequence[int]) -> float:
    """Doubled signed area over the square of the longest side."""
    a, b, c = xy[list(triangle)].tolist()
    sides = [(q[0] - p[0], q[1] - p[1]) for p, q in ((a, b), (b, c), (c, a))]
    longest = max(x * x + y * y for x, y in sides)
    return (sides[0][0] * sides[1][1] - sides[0][1] * sides[1][0]) / longest if longest > 0.0 else 0.0


def _halves(xy: Array, xyz: Array, vertices: list[int]) -> list[list[int]]:
    """A quadrilateral cut along its shorter diagonal; of two alike, the one at the smallest vertex number."""
    cuts = [[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]]
    full = [min(_fullness(xy, triangle) for triangle in cut) for cut in cuts]
    if min(full) <= 1e-6:  # a corner that is straight or points inwards leaves one choice only
        return cuts[int(full[1] > full[0])]
    lengths = [float(np.linalg.norm(xyz[i + 2] - xyz[i])) for i in range(2)]
    if abs(lengths[0] - lengths[1]) <= 1e-9 * lengths[0]:
        return cuts[vertices.index(min(vertices)) % 2]
    return cuts[int(lengths[1] < lengths[0])]


def _delaunay(polygon: Any, xy: Array, count: int) -> list[list[int]]:
    """`count` constrained Delaunay triangles of a polygon with corners `xy`; none is flat on a straight side."""
    import shapely

    corner = {tuple(point): i for i, point in enumerate(xy.tolist())}
    parts = shapely.constrained_delaunay_triangles(polygon).geoms
    triangles = [[corner[point] for point in part.exterior.coords[:3]] for part in parts]
    if len(corner) < len(xy) or len(triangles) != count:
        raise FileFormatError("cannot be cut into triangles; merge vertices in one place or give triangles")
    if sum(_fullness(xy, triangle) for triangle in triangles) < 0.0:
        triangles = [triangle[::-1] for triangle in triangles]
    return triangles


# --- the sheet ------------------------------------------------------------------------------------


def _sheet(frame: _Frame) -> SheetMesh:
    faces = frame.faces or _faces_of_graph(frame)
    sides = _sides(faces)
    _check_edges(frame, sides)
    faces = _orient(frame, faces, sides)
    corners: list[list[int]] = []
    for number, face in enumerate(faces):
        try:
            if frame.flat and _area(frame.points[:, :2], face) < 0.0:
                raise FileFormatError("is turned over (folded flat); choose a frame where it lies open")
            corners += _triangulate(frame.points, face, frame.flat)
        except FileFormatError as error:
            names = ", ".join(map(str, face[0][:5])) + (", ..." if len(face[0]) > 5 else "")
            raise FileFormatError(f"face {number} (vertices {names}) {error}") from error
    _check_fans(corners)
    if frame.flat and frame.faces:
        _check_overlap(frame.points[:, :2], corners)

    used, triangles = np.unique(np.array(corners), return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    new = np.full(len(frame.points), -1)
    new[used] = np.arange(len(used))
    named, fold_angles = _edge_sets(frame, sides)
    edge_sets = {name: new[np.array(pairs)] for name, pairs in named.items() if pairs}
    topology = build(triangles, len(used))
    loops = boundary_loops(topology)
    if loops:
        edge_sets["edge:boundary"] = np.vstack([np.column_stack((each, np.roll(each, -1))) for each in loops])
    drawn = {_side(a, b) for a, b in new[np.array(list(sides))].tolist()}
    added = [pair for pair in topology.edges.tolist() if tuple(pair) not in drawn]
    if added:
        edge_sets["edge:facet"] = np.array(added)
    creases = [name.removeprefix("crease:") for name in edge_sets if name.startswith("crease:")]
    return SheetMesh(
        points=frame.points[used],
        triangles=triangles,
        edge_sets=edge_sets,
        folds={name: FOLDS[name[0].upper()] for name in creases},
        fold_angles={name: fold_angles[name] for name in creases if name in fold_angles},
        kind="imported",
    )


def _check_edges(frame: _Frame, sides: dict[Side, list[int]]) -> None:
    """Every edge is the side of a face, creases lie inside the sheet, borders and cuts at its rim."""
    for number, ((a, b), letter) in enumerate(zip(frame.edges, frame.letters, strict=True)):
        edge = f"edge {number} ({a}-{b})"
        faces = sides.get(_side(a, b))
        if faces is None:
            raise FileFormatError(f"{edge} is not a side of any face; remove it or add its faces")
        if len(faces) == 2 and letter == "C":
            raise FileFormatError(f"{edge} is a cut (C) inside the sheet; double its vertices to open it")
        if len(faces) == 2 and letter == "B":
            raise FileFormatError(f"{edge} is assigned B but has a face on both sides; assign M, V, F or U")
        if len(faces) == 1 and letter in FOLDS:
            raise FileFormatError(f"{edge} is assigned {letter} but has a face on one side only; assign B")


def _check_fans(triangles: list[list[int]]) -> None:
    """The triangles at every vertex form one fan (or a full turn)."""
    link: dict[int, dict[int, list[int]]] = {}
    for t in triangles:
        for i in range(3):
            near = link.setdefault(t[i], {})
            near.setdefault(t[i - 1], []).append(t[i - 2])
            near.setdefault(t[i - 2], []).append(t[i - 1])
    for vertex, near in link.items():
        todo = [next(iter(near))]
        seen = set(todo)
        while todo:
            fresh = set(near[todo.pop()]) - seen
            seen |= fresh
            todo += fresh
        if len(seen) < len(near):
            raise FileFormatError(
                f"at vertex {vertex} parts of the sheet touch at a point (non-manifold); double the vertex"
            )


def _check_overlap(xy: Array, triangles: list[list[int]]) -> None:
    import shapely

    parts = shapely.polygons(xy[np.array(triangles)])
    total, covered = float(shapely.area(parts).sum()), float(shapely.union_all(parts).area)
    if covered < (1.0 - 1e-6) * total:
        raise FileFormatError(
            f"faces of the flat sheet lie over each other ({1.0 - covered / total:.2g} of its area); "
            "draw every face in its own place"
        )


def _edge_sets(frame: _Frame, sides: dict[Side, list[int]]) -> tuple[dict[str, list[Side]], dict[str, Array]]:
    """The named edges inside the sheet (vertex pairs in order) and the fold angles of the creases (rad)."""
    sets: dict[str, list[Side]] = {}
    angles: dict[str, Array] = {}
    for letter, fold in FOLDS.items():
        chains = _chains(frame, [number for number, each in enumerate(frame.letters) if each == letter])
        named = {f"{letter.lower()}{i + 1}": chain for i, chain in enumerate(chains)}
        for name, chain in ({fold: list(itertools.chain(*chains))} | named).items():  # the whole first
            sets[f"crease:{name}"] = [(a, b) for _, a, b in chain]
            if frame.angles is not None:
                angles[name] = -np.radians([frame.angles[number] for number, _, _ in chain])
    for letter, name in SETS.items():
        edges = (edge for edge, each in zip(frame.edges, frame.letters, strict=True) if each == letter)
        sets[name] = [edge for edge in edges if len(sides[_side(*edge)]) == 2]
    listed = {_side(*edge) for edge in frame.edges}
    sets["edge:unassigned"] += [side for side, at in sides.items() if len(at) == 2 and side not in listed]
    return sets, angles


Step = tuple[int, int, int]  # number of an edge, and the vertices it is walked from and to


def _chains(frame: _Frame, numbers: list[int]) -> list[list[Step]]:
    """The lines that edges of one assignment make up, each in the direction of its first edge in the file."""
    at: dict[int, list[int]] = {}
    for number in numbers:
        for vertex in frame.edges[number]:
            at.setdefault(vertex, []).append(number)
    beyond: dict[tuple[int, int], int] = {}
    for vertex, met in at.items():
        for one, two in [(met[0], met[1])] if len(met) == 2 else _straight(frame, vertex, met):
            beyond[one, vertex], beyond[two, vertex] = two, one
    free = set(numbers)

    def walk(edge: int, vertex: int) -> list[Step]:
        steps: list[Step] = []
        while beyond.get((edge, vertex)) in free:
            edge = beyond[edge, vertex]
            free.discard(edge)
            other = sum(frame.edges[edge]) - vertex
            steps.append((edge, vertex, other))
            vertex = other
        return steps

    chains = []
    for number in numbers:
        if number in free:
            free.discard(number)
            a, b = frame.edges[number]
            ahead = walk(number, b)
            back = [(edge, head, tail) for edge, tail, head in reversed(walk(number, a))]
            chains.append([*back, (number, a, b), *ahead])
    return chains


def _straight(frame: _Frame, vertex: int, met: list[int]) -> list[tuple[int, int]]:
    """Pairs of the edges `met` at a vertex that go straight on into each other, the straightest first."""
    ends = np.array([sum(frame.edges[number]) - vertex for number in met])
    away = frame.points[ends] - frame.points[vertex]
    away /= np.linalg.norm(away, axis=1)[:, None]
    bend = [(float(np.linalg.norm(away[i] + away[j])), i, j) for i in range(len(met)) for j in range(i)]
    pairs: list[tuple[int, int]] = []
    taken: set[int] = set()
    for angle, i, j in sorted(bend):
        if angle <= STRAIGHT and not taken & {i, j}:
            taken |= {i, j}
            pairs.append((met[i], met[j]))
    return pairs


# --- writing --------------------------------------------------------------------------------------


def write_fold(
    path: str | os.PathLike[str],
    mesh: SheetMesh,
    *,
    frames: Sequence[tuple[str, ArrayLike, ArrayLike | None]] = (),
    title: str | None = None,
) -> None:
    """Write a mesh as the key frame of a FOLD file, and folded states as further frames; lengths in mm.

    Edges are those of `mesh.topology.edges`: B on the boundary, M and V on creases as `mesh.folds` says, U
    and J in "edge:unassigned" and "edge:join", else F. Fold angles are written if the mesh has any, null on a
    crease without. The file appears whole or not at all.

    Args:
        frames: (title, points (n, 3) in mm, fold angles (e,) in rad, mountain positive, one for each of
            `mesh.topology.edges`, or None) of each state.

    Raises:
        FileFormatError: arrays that do not fit the mesh, or the file cannot be written.
    """
    edges = mesh.topology.edges
    letters, angles = _assignment(mesh)
    data: dict[str, Any] = {
        "file_spec": 1.2,
        "file_creator": "curved-crease-workbench",
        "file_classes": ["singleModel", "animation"] if frames else ["singleModel"],
    }
    if title is not None:
        data["file_title"] = str(title)
    data |= {
        "frame_classes": ["creasePattern" if mesh.flat else "foldedForm"],
        "frame_attributes": ["2D" if mesh.flat else "3D", "manifold", "orientable"],
        "frame_unit": "mm",
        "vertices_coords": (mesh.points[:, :2] if mesh.flat else mesh.points).tolist(),
        "edges_vertices": edges.tolist(),
        "edges_assignment": letters,
    }
    if angles is not None:
        data["edges_foldAngle"] = _degrees(angles)
    data["faces_vertices"] = mesh.triangles.tolist()
    states = []
    for number, (name, points, folds) in enumerate(frames):
        what = f"{shown(path)}: state {number} ({_show(str(name))})"
        place = _numbers(f"{what}: points", points, mesh.points.shape)
        state = {
            "frame_title": str(name),
            "frame_classes": ["foldedForm"],
            "frame_attributes": ["3D", "manifold", "orientable"],
            "frame_parent": 0,
            "frame_inherit": True,
            "vertices_coords": place.tolist(),
        }
        if folds is not None:
            state["edges_foldAngle"] = _degrees(_numbers(f"{what}: fold angles", folds, (len(edges),)))
        states.append(state)
    if states:
        data["file_frames"] = states
    # one line a key: still readable, and a difference of two files says what changed
    text = ",\n".join(f'"{key}": {json.dumps(value, allow_nan=False)}' for key, value in data.items())
    with replacing(path) as temporary:
        temporary.write_text("{\n" + text + "\n}\n", encoding="utf-8")


def _assignment(mesh: SheetMesh) -> tuple[list[str], Array | None]:
    """Letter and drawn fold angle (rad, mountain positive; nan unknown) of every edge of the topology."""
    topology = mesh.topology
    letters = np.full(len(topology.edges), "F")
    angles = np.zeros(len(letters))
    for letter, name in SETS.items():
        if name in mesh.edge_sets:
            letters[topology.find_edges(mesh.edge_sets[name])] = letter
    for crease in mesh.creases:
        at = topology.find_edges(mesh.crease_edges(crease))
        fold = mesh.folds.get(crease, "flat")
        letters[at] = {"mountain": "M", "valley": "V", "flat": "F"}[fold]
        angles[at] = mesh.fold_angles.get(crease, np.nan if fold != "flat" else 0.0)
    rim = topology.edge_triangles[:, 1] < 0
    letters[rim], angles[rim] = "B", 0.0
    return letters.tolist(), angles if mesh.fold_angles else None


def _degrees(angles: Array) -> list[float | None]:
    """FOLD's fold angles (valley positive) of ours."""
    return [None if math.isnan(angle) else 0.0 - angle for angle in np.degrees(angles).tolist()]


def _numbers(what: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise FileFormatError(f"{what} are not numbers; give an array of shape {shape}") from error
    if array.shape != shape or not np.isfinite(array).all():
        raise FileFormatError(f"{what} have shape {array.shape} or are not finite; give shape {shape}")
    return array
