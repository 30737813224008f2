"""Meshes and folded states as FOLD files, with what was computed under keys of the namespace `bh`."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from meshes.curved import edge_middles
from meshes.curves import Array
from meshes.errors import FileFormatError, MeshError
from meshes.io.export import replacing, shown
from meshes.io.fold import SETS
from meshes.io.fold_frame import show
from meshes.mesh import SheetMesh

BEZIER = "edges_bh:controlPoints"
CURVED = 1e-7  # of the sheet's size: edges that are bent by less are straight
LISTS = ("vertices", "edges", "faces")


class FoldedFrame(NamedTuple):
    """A folded state, as a frame.

    Attributes:
        title: of the frame.
        points: (n, 3), mm.
        angles: (e,) fold angles, rad, mountain positive, one for each of `mesh.topology.edges`, or None.
        results: further keys of the frame, with a colon in each as the format asks ("faces_bh:bendingEnergyDensity").
            Those that begin with vertices_, edges_ or faces_ have one number for each of them.
    """

    title: str
    points: ArrayLike
    angles: ArrayLike | None = None
    results: Mapping[str, Any] = {}


def write_fold(
    path: str | os.PathLike[str],
    mesh: SheetMesh,
    *,
    frames: Sequence[FoldedFrame | tuple[str, ArrayLike, ArrayLike | None]] = (),
    title: str | None = None,
) -> None:
    """Write a mesh as the key frame of a FOLD file, and folded states as further frames; lengths in mm.

    Edges are those of `mesh.topology.edges`: B on the boundary (of a cut: both lips, on doubled vertices), M and V on
    creases as `mesh.folds` says, U and J in "edge:unassigned" and "edge:join", else F. Fold angles are written if the
    mesh has any, null on a crease without. Edges that lie on curves of the mesh have the control point of a quadratic
    Bezier curve in "edges_bh:controlPoints" (null on the others), which `read_pattern` reads. The file appears whole
    or not at all.

    Args:
        path: of the file.
        mesh: the key frame.
        frames: a `FoldedFrame` of each state, or its title, points and fold angles alone.
        title: of the file.

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
    if (bent := _control_points(mesh)) is not None:
        data[BEZIER] = bent
    states = []
    for number, (name, points, folds, results) in enumerate(FoldedFrame(*frame) for frame in frames):
        what = f"{shown(path)}: state {number} ({show(str(name))})"
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
        states.append(state | _results(what, results, mesh))
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


def _control_points(mesh: SheetMesh) -> list[list[list[float]] | None] | None:
    """Of every edge the control point of a quadratic Bezier curve, None for straight ones; None if all are."""
    if not mesh.curves or not mesh.flat:
        return None
    try:
        middle = edge_middles(mesh)[:, :2]
    except MeshError:  # nodes were moved off their curves: the edges are all that is known
        return None
    chord = mesh.points[mesh.topology.edges, :2].mean(axis=1)
    bent = np.linalg.norm(middle - chord, axis=1) > CURVED * mesh.size
    if not bent.any():
        return None
    control = (2.0 * middle - chord).tolist()
    return [[point] if curved else None for point, curved in zip(control, bent.tolist(), strict=True)]


def _results(what: str, results: Mapping[str, Any], mesh: SheetMesh) -> dict[str, Any]:
    """Keys of a frame as JSON has them, with the numbers of vertices, edges and faces checked."""
    counts = dict(zip(LISTS, (len(mesh.points), len(mesh.topology.edges), len(mesh.triangles)), strict=True))
    found: dict[str, Any] = {}
    for key, value in results.items():
        owner = key.split("_")[0]
        if ":" not in key:
            raise FileFormatError(f"{what}: key '{key}' has no namespace; write it as bh:{key}")
        found[key] = (
            _numbers(f"{what}: {key}", value, (counts[owner],)).tolist() if owner in counts else value
        )
    return found


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
