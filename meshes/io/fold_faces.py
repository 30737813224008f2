"""Faces of a FOLD frame: built from edges, turned to agree, cut into triangles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from meshes.curves import Array
from meshes.errors import FileFormatError
from meshes.io.fold_frame import Face, Frame, Side, side
from meshes.planar import check_crossings

THIN = 1e-10  # doubled area over longest side squared of a degenerate triangle, as in SheetMesh


def _directed(face: Face) -> list[tuple[int, int]]:
    return [(ring[i - 1], ring[i]) for ring in face for i in range(len(ring))]


def sides_of(faces: Sequence[Face]) -> dict[Side, list[int]]:
    """The one or two faces at every side.

    Args:
        faces: rings of vertex numbers each.

    Returns:
        The numbers of the one or two faces at every side.

    Raises:
        FileFormatError: an edge has more than two faces.
    """
    sides: dict[Side, list[int]] = {}
    for number, face in enumerate(faces):
        for a, b in _directed(face):
            sides.setdefault(side(a, b), []).append(number)
    for (a, b), at in sides.items():
        if len(at) > 2:
            raise FileFormatError(
                f"edge {a}-{b} belongs to {len(at)} faces (non-manifold): {at[0]}, {at[1]}, {at[2]}; "
                "a sheet has one or two faces an edge"
            )
    return sides


def faces_of_graph(frame: Frame) -> list[Face]:
    """The bounded faces of a plane graph, without the holes that B edges outline.

    Returns:
        the faces, each with its rings of vertices.

    Raises:
        FileFormatError: the frame lies in space, its edges cross or hang loose, or B edges enclose nothing.
    """
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
    sides = sides_of(faces)
    for number, (a, b) in enumerate(frame.edges):
        if side(a, b) not in sides:
            raise FileFormatError(
                f"edge {number} ({a}-{b}) hangs loose: it has the same face on both sides; "
                "lengthen its line to another one or remove it"
            )
    inside = _inside(frame, sides, len(faces))
    return [face for number, face in enumerate(faces) if inside[number]]


def _check_plane_graph(frame: Frame) -> None:
    import shapely

    xy, edges = frame.points[:, :2], np.array(frame.edges)
    size = float(np.linalg.norm(np.ptp(xy, axis=0)))
    check_crossings(xy[edges].reshape(-1, 4))
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


def _inside(frame: Frame, sides: dict[Side, list[int]], count: int) -> list[bool]:
    """Which faces are sheet: those at the outside, and a closed line of B edges leads into a hole or out."""
    inside: list[bool | None] = [None] * count
    near: list[list[int]] = [[] for _ in range(count)]
    borders: list[list[tuple[int, int]]] = [[] for _ in range(count)]
    for number, edge in enumerate(frame.edges):
        at = sides[side(*edge)]
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


def orient(frame: Frame, faces: list[Face], sides: dict[Side, list[int]]) -> list[Face]:
    """The faces of one sheet, turned to agree: with +z where it is flat, else with most of the faces.

    Args:
        frame: the frame that the faces belong to.
        faces: rings of vertex numbers each.
        sides: the faces at every side, see `sides_of`.

    Returns:
        The same faces in the same order; those that were against the others run the other way.

    Raises:
        FileFormatError: the sheet is one-sided, or in pieces.
    """
    ahead = [set(_directed(face)) for face in faces]
    turned: list[bool | None] = [None] * len(faces)
    turned[0] = False
    todo = [0]
    while todo:
        face = todo.pop()
        for a, b in ahead[face]:
            for other in sides[side(a, b)]:
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
        areas = [area(frame.points[:, :2], face) for face in faces]
        against = sum(-size if turn else size for size, turn in zip(areas, turned, strict=True)) < 0.0
    return [
        [ring[::-1] for ring in face] if turn != against else face
        for face, turn in zip(faces, turned, strict=True)
    ]


def area(xy: Array, face: Face) -> float:
    """Signed area of a face, counter-clockwise positive, in the square of the unit of `xy` (n, 2).

    It is taken from the first vertex, lest far-off sheets lose digits.

    Args:
        xy: (n, 2) in any unit.
        face: rings of vertices.
    """
    total = 0.0
    for ring in face:
        corners = (xy[ring] - xy[face[0][0]]).tolist()  # few: plain numbers are faster than arrays
        total += 0.5 * sum(
            x * v - y * u for (x, y), (u, v) in zip(corners, corners[1:] + corners[:1], strict=True)
        )
    return total


# --- triangles ------------------------------------------------------------------------------------


def triangulate(points: Array, face: Face, flat: bool) -> list[list[int]]:
    """Triangles of one face, turned as the face is.

    Args:
        points: (n, 3) positions of all vertices, mm.
        face: rings of vertex numbers, the outside first.
        flat: True if the frame lies in a plane z = constant.

    Returns:
        Three vertex numbers a triangle.

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
    return np.asarray(xyz @ np.column_stack((first, np.cross(normal, first))))


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
