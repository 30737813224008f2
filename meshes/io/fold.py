"""FOLD files, version 1.2 (https://github.com/edemaine/fold/blob/main/doc/spec.md), to `SheetMesh`.

FOLD's fold angles are degrees, valley positive; ours are rad, mountain positive. Frames count as in FOLD: 0
is the key frame (the top of the file), i + 1 is `file_frames[i]`.
"""

from __future__ import annotations

import itertools
import os
from dataclasses import replace
from typing import Any

import numpy as np

from meshes.curves import Array
from meshes.cuts import CUTS, open_cuts
from meshes.errors import FileFormatError, InputError
from meshes.io.export import one_line, shown
from meshes.io.fold_faces import area, faces_of_graph, orient, sides_of, triangulate
from meshes.io.fold_frame import UNITS, Frame, Side, check, laid_flat, load, select, side
from meshes.io.fold_layers import orders_of, untangled
from meshes.io.loose_ends import tie_ends
from meshes.io.sizes import check_lengths, size_remarks
from meshes.mesh import SheetMesh, count
from meshes.pattern import FoldKind
from meshes.topology import boundary_loops, build

FOLDS: dict[str, FoldKind] = {"M": "mountain", "V": "valley"}
SETS = {"F": "edge:flat", "U": "edge:unassigned", "J": "edge:join"}
BENT = "drawn as curves"  # of edges, in remarks
STRAIGHT = 1e-3  # rad; files give coordinates to some six digits


def read_fold(
    path: str | os.PathLike[str],
    frame: int | str | None = None,
    *,
    scale: float | None = None,
    fit: float | None = None,
    untangle: float | None = None,
) -> SheetMesh:
    """The sheet of one frame of a FOLD file, with faces triangulated, in mm.

    Vertices keep their order; those that belong to no face are dropped. Faces are turned to agree with each
    other, and counter-clockwise from +z where the sheet is flat: mountain and valley then are as seen from +z.
    A frame without faces_vertices gets them from its edges if these are a plane graph; B edges round holes.

    The edge sets are "crease:mountain" and "crease:valley" (all such edges), their chains "crease:m1", ...,
    "crease:v1", ... in the order of the file, "edge:boundary", and where there are any "edge:flat" (F),
    "edge:unassigned" (U, or not in edges_vertices), "edge:join" (J), "edge:cuts" (C: both lips, the sheet is open
    there on doubled nodes) and "edge:facet" (added to cut faces into triangles). `fold_angles` are there if the file
    has edges_foldAngle (nan for a null).

    Args:
        path: of the file.
        frame: 0 for the key frame, i + 1 for file_frames[i], or the frame_title of one; None for the first frame that
            has vertices and is no folded form (the first that has vertices where all are).
        scale: mm a unit of the file, in place of its frame_unit.
        fit: length of the longer side of the sheet's bounding box, mm, in place of a scale.
        untangle: layers of a folded form are moved this far apart, mm, in the order that its faceOrders give
            (`meshes.io.fold_layers`); None reads the frame as it is.

    Returns:
        The mesh, mm, of kind "imported". A flat pattern in another plane is laid into z = 0.

    Raises:
        FileFormatError: the file cannot be read, is not FOLD, or its frame is not one manifold sheet.
    """
    import shapely

    try:
        chosen = select(load(path), frame)
        found = _sized(laid_flat(check(chosen)), chosen, scale, fit)
        if untangle is not None:
            found = untangled(found, orders_of(chosen, len(found.faces)), untangle)
        mesh = sheet_of_frame(found)
        remarks = _remarks(found, chosen, scale is None and fit is None)
        return replace(mesh, remarks=(*remarks, *mesh.remarks))
    except (InputError, shapely.errors.ShapelyError) as error:
        raise FileFormatError(f"{shown(path)}: {one_line(error)}") from error


def _sized(frame: Frame, units: dict[str, Any], scale: float | None, fit: float | None) -> Frame:
    """The frame at another size."""
    check_lengths({"scale": scale, "fit": fit})
    if scale is not None:
        return replace(frame, points=frame.points * (scale / UNITS[units.get("frame_unit", "unit")]))
    if fit is not None:
        longest = float(np.ptp(frame.points, axis=0).max())
        return replace(frame, points=frame.points * (fit / (longest or 1.0)))
    return frame


def _remarks(frame: Frame, units: dict[str, Any], as_stated: bool) -> tuple[str, ...]:
    size = float(np.ptp(frame.points, axis=0).max())
    remarks = size_remarks(size, units.get("frame_unit", "unit") != "unit") if as_stated else []
    if frame.bends:
        remarks.append(
            f"{count(len(frame.bends), 'edge')} of the file {BENT}, of which its faces have the chords; "
            "with [mesh] or accuracy the curves are meshed"
        )
    return tuple(remarks)


# --- the sheet ------------------------------------------------------------------------------------


def sheet_of_frame(frame: Frame) -> SheetMesh:
    """The mesh of one checked frame, mm; the names are those of `read_fold`.

    Raises:
        FileFormatError: the frame is not one manifold sheet, or lies over itself.
    """
    frame = frame if frame.faces else tie_ends(frame)
    faces = frame.faces or faces_of_graph(frame)
    sides = sides_of(faces)
    _check_edges(frame, sides)
    faces = orient(frame, faces, sides)
    corners: list[list[int]] = []
    for number, face in enumerate(faces):
        try:
            if frame.flat and area(frame.points[:, :2], face) < 0.0:
                raise FileFormatError(
                    "is turned over (folded flat): the frame is a folded form; choose one where the sheet lies open, "
                    "or untangle = true (its layers, by its faceOrders)"
                )
            corners += triangulate(frame.points, face, frame.flat)
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
    drawn = {side(a, b) for a, b in new[np.array(list(sides))].tolist()}
    added = [pair for pair in topology.edges.tolist() if tuple(pair) not in drawn]
    if added:
        edge_sets["edge:facet"] = np.array(added)
    creases = [name.removeprefix("crease:") for name in edge_sets if name.startswith("crease:")]
    mesh = SheetMesh(
        points=frame.points[used],
        triangles=triangles,
        edge_sets=edge_sets,
        folds={name: FOLDS[name[0].upper()] for name in creases},
        fold_angles={name: fold_angles[name] for name in creases if name in fold_angles},
        kind="imported",
    )
    return open_cuts(mesh, [CUTS] if CUTS in edge_sets else [])


def _check_edges(frame: Frame, sides: dict[Side, list[int]]) -> None:
    """Every edge is the side of a face, creases lie inside the sheet, borders at its rim."""
    for number, ((a, b), letter) in enumerate(zip(frame.edges, frame.letters, strict=True)):
        edge = f"edge {number} ({a}-{b})"
        faces = sides.get(side(a, b))
        if faces is None:
            raise FileFormatError(f"{edge} is not a side of any face; remove it or add its faces")
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
            f"faces of the flat sheet lie over each other ({1.0 - covered / total:.2g} of its area): a form that is "
            "folded flat, or faces twice; choose a frame where the sheet lies open, or draw every face in its own place"
        )


def _edge_sets(frame: Frame, sides: dict[Side, list[int]]) -> tuple[dict[str, list[Side]], dict[str, Array]]:
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
        sets[name] = [edge for edge in edges if len(sides[side(*edge)]) == 2]
    inner = zip(frame.edges, frame.letters, strict=True)
    sets[CUTS] = [edge for edge, each in inner if each == "C" and len(sides[side(*edge)]) == 2]
    listed = {side(*edge) for edge in frame.edges}
    sets["edge:unassigned"] += [pair for pair, at in sides.items() if len(at) == 2 and pair not in listed]
    return sets, angles


Step = tuple[int, int, int]  # number of an edge, and the vertices it is walked from and to


def _chains(frame: Frame, numbers: list[int]) -> list[list[Step]]:
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


def _straight(frame: Frame, vertex: int, met: list[int]) -> list[tuple[int, int]]:
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
