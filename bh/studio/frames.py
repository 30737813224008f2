"""What the window is sent: the sheet as it lies flat, and its frames."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from bh.live import Frame, Jaws, Session
from bh.live.holding import chains
from bh.scene.folding import MATERIALS
from bh.studio.colours import Colour
from bh.studio.exports import FORMATS
from bh.studio.sheets import LIBRARY, LiveSheet
from meshes import SheetMesh
from meshes.wide import STRIP

Array = NDArray[np.float64]
Json = dict[str, object]


def line(text: str) -> Json:
    """A line for the person at the window."""
    return {"kind": "line", "text": text}


def packed(head: Json, *arrays: Array) -> bytes:
    """A frame as it travels: a length, JSON of numbers, then numbers.

    Args:
        head: without nan.
        arrays: of numbers, in the order in which they are read.

    Returns:
        4 bytes (little endian) length of the JSON text, the text filled up with blanks to whole words, then float32.
    """
    text = json.dumps(head, allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    floats = [np.ascontiguousarray(values, dtype="<f4").tobytes() for values in arrays]
    return b"".join((struct.pack("<I", len(text)), text, *floats))


def head_of(frame: Frame) -> Json:
    """Numbers of a frame.

    Args:
        frame: of a session.
    """
    return {
        "kind": "frame",
        "rest": frame.at_rest,
        "arrived": frame.arrived,
        "note": frame.note,
        "snapped": frame.snapped,
        "stable": frame.state.stable,
        "energy": frame.state.energy.as_dict(),
        "asked": dict(frame.wanted.folds),
        "folds": frame.fold_angles(),
        "grips": {str(n): list(g.to) for n, g in frame.wanted.grips.items()},
        "forces": {str(n): list(f) for n, f in frame.forces.items()},
        "pinches": [_pinched(frame, jaws, force) for jaws, force in frame.pinches().items()],
        "strain": float(np.abs(frame.state.strain).max()),
        "ms": 1e3 * frame.seconds,
        "iterations": frame.iterations,
    }


def _pinched(frame: Frame, jaws: Jaws, force: float) -> Json:
    """Nodes, line, distances (mm) and force (N) of a pinch."""
    return {
        "a": jaws.a,
        "b": jaws.b,
        "middle": list(jaws.middle),
        "along": list(jaws.along),
        "gap": jaws.gap(frame.wanted.grips),
        "apart": float(np.linalg.norm(frame.points[jaws.b] - frame.points[jaws.a])),
        "force": force,
    }


def surface(mesh: SheetMesh) -> Json:
    """The triangles and lines of a mesh as a window draws them.

    Args:
        mesh: of a sheet.
    """
    return {
        "points": np.round(mesh.points, 6).ravel().tolist(),
        "triangles": mesh.triangles.ravel().tolist(),
        "boundary": mesh.topology.boundary.ravel().tolist(),
    }


def creases_of(mesh: SheetMesh) -> list[Json]:
    """Name, kind and edges of every crease.

    Args:
        mesh: of a sheet.

    Returns:
        one each, with edges as pairs of nodes in one list; a wide crease is one, of kind "wide", with both its lines.
    """
    strips = mesh.wide_creases
    return [
        {
            "name": name,
            "fold": "wide" if name in strips else mesh.folds.get(name, "flat"),
            "edges": np.asarray(mesh.edge_sets[STRIP + name] if name in strips else mesh.crease_edges(name))
            .ravel()
            .tolist(),
        }
        for name in mesh.drawn_creases
    ]


def described(
    sheet: LiveSheet, session: Session, material: str, colours: Mapping[str, Colour], colour: str
) -> Json:
    """The sheet as a window draws it: flat, with its creases by name, and what can be chosen.

    Args:
        sheet: what was opened.
        session: its handling.
        material: its name.
        colours: that it can have.
        colour: that it has.
    """
    mesh, model = session.mesh, sheet.model
    flat = [name for name in mesh.drawn_creases if mesh.folds.get(name) == "flat"]
    whole = {*chains(mesh, list(mesh.creases))}
    turns = {*session.creases, *(name for name in flat if name in whole)} - {*mesh.wide_creases}
    creases = [
        {
            **each,
            "full": sheet.full.get(str(each["name"]), np.pi),
            "handled": each["name"] in session.creases,
            "turns": each["name"] in turns,
        }
        for each in creases_of(mesh)
    ]
    return {
        "kind": "sheet",
        "name": sheet.name,
        **surface(mesh),
        "creases": creases,
        "held": sorted({int(n) for s in model.supports for n in _nodes(s)}),
        "material": {"name": material, "E": model.sheet.E, "nu": model.sheet.nu, "t": model.sheet.t},
        "materials": {name: about for name, (_, _, _, about) in MATERIALS.items()},
        "library": list(LIBRARY),
        "values": dict(sheet.values),
        "springs": {name: law.Lstar for name, law in model.creases.items()},
        "formats": list(FORMATS),
        "formulation": model.formulation,
        "contact": model.stops_itself,
        "unknowns": session.size,
        "percent": sheet.percent,
        "remarks": list(sheet.remarks),
        "colours": {name: [each.label, each.unit] for name, each in colours.items()},
        "colour": colour,
    }


def _nodes(support: object) -> list[int]:
    at = getattr(support, "at", ())
    return [] if isinstance(at, str) else [int(node) for node in at]
