"""One window: the sheet that lies in it, what is asked of it, and what it shows. It knows no network."""

from __future__ import annotations

import base64
import json
import struct
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import bh.studio.messages as asked
from bh.errors import InputError
from bh.live import Controls, Frame, Session
from bh.live.session import held
from bh.model.sheet import Sheet
from bh.scene.folding import MATERIALS
from bh.solving.trace import trace
from bh.studio.exports import FORMATS, export
from bh.studio.sheets import LIBRARY, LiveSheet, material_of, of_file, of_library

Array = NDArray[np.float64]
BUDGET = 0.03  # s of an update
Json = dict[str, object]


class Desk:
    """What one window works at.

    Attributes:
        sheet: what was opened.
        session: its handling.
    """

    def __init__(self, sheet: LiveSheet | None = None) -> None:
        """Begin with a sheet, or with a pattern of the library."""
        self.material = "card"
        self._colour = "bending"
        self._shown: tuple[object, ...] = ()
        self.put(sheet or of_library("arc"))

    # ------------------------------------------------------------------------------- what is asked

    def put(self, sheet: LiveSheet, controls: Controls | None = None) -> None:
        """Put a sheet on the desk.

        Args:
            sheet: to be handled.
            controls: as it was handled before; None for flat.
        """
        model = sheet.model if sheet.model.supports else held(sheet.model)
        self.sheet = replace(sheet, model=model)
        self.session = Session(model)
        if controls is not None:
            self.session.ask(controls)
        self.frame = self.session.update(0.0)
        self._shown = ()

    def take(self, message: asked.Asked) -> list[Json]:
        """Do what a window asks.

        Args:
            message: checked.

        Returns:
            answers, beside the frames: a new sheet, a file, a line.

        Raises:
            InputError: it cannot be done; the desk is as before.
        """
        if self._laid(message):
            return [self.describe()]
        match message:
            case asked.Fold(crease=crease, angle=angle):
                self.session.fold(crease, angle)
            case asked.Percent(value=value):
                for crease in self.session.creases:
                    self.session.fold(crease, 0.01 * value * self.sheet.full[crease])
            case asked.Pull(node=node, to=to):
                self.session.pull(node, to)
            case asked.LetGo(node=node):
                self.session.let_go(node)
            case asked.Plain(do=what):
                return self._plain(what)
            case asked.Colour(by=by):
                self._colour, self._shown = by, ()
            case asked.Export(what=what):
                name, data = export(what, self.sheet, self.session, self.session.rest(20.0))
                return [{"kind": "file", "name": name, "data": base64.b64encode(data).decode()}]
        return []

    def _laid(self, message: asked.Asked) -> bool:
        """Whether a message puts another sheet on the desk, or the same one held or made otherwise."""
        match message:
            case asked.Open(name=name, data=data):
                self.put(of_file(name, data, self.material))
            case asked.Pattern(name=name):
                self.put(of_library(name, self.material))
            case asked.Hold(node=node, on=on):
                self._hold(node, on)
            case asked.Material():
                self._change(message)
            case _:
                return False
        return True

    def _plain(self, what: str) -> list[Json]:
        if what == "check":
            return [self._check()]
        if what == "flatten":
            self.session.ask(Controls(dict.fromkeys(self.session.creases, 0.0)))
            self.session.let_go()
        elif not (self.session.undo() if what == "undo" else self.session.redo()):
            return [_line(f"there is nothing to {what}")]
        return []

    def _hold(self, node: int, on: bool) -> None:
        model, mesh = self.sheet.model, self.session.mesh
        if node >= len(mesh.points):
            raise InputError(f"there is no node {node} to hold; choose one of 0 to {len(mesh.points) - 1}")
        other = tuple(s for s in model.supports if getattr(s, "at", None) not in ([node], (node,)))
        model = replace(model, supports=other)
        model = model.support([node], "xyz") if on else model
        self.put(replace(self.sheet, model=model), self.session.wanted)

    def _change(self, message: asked.Material) -> None:
        now = self.sheet.model.sheet
        if message.name is not None:
            young, nu, t, _ = material_of(message.name)
            self.material, now = message.name, Sheet(E=young, nu=nu, t=t)
        nu = now.nu if self.sheet.model.formulation != "bars-and-hinges" else 0.0
        sheet = replace(
            now, E=message.E or now.E, nu=nu if message.nu is None else message.nu, t=message.t or now.t
        )
        self.put(self.sheet.of(sheet), self.session.wanted)

    def _check(self) -> Json:
        """The same state by a run from flat, on this mesh and on a coarser one: how far it is off."""
        frame = self.session.rest(20.0)
        if not any(step.actuations for step in self.session.scene().steps):
            return _line("there is nothing to check yet")
        path = trace(self.session.scene(), estimate=True, warn=False)
        off = float(np.abs(path[-1].points - frame.points).max())
        error = path.accuracy
        estimate = (
            f"its energy is off by about {100.0 * error.estimate:.2g} % on this mesh"
            if error is not None and error.estimate is not None
            else f"its error on this mesh is not known: {path.estimate_reason}"
        )
        return _line(f"a run from flat ends as {path.outcome}, at most {off:.2g} mm from here; {estimate}")

    # ------------------------------------------------------------------------------- what is shown

    @property
    def busy(self) -> bool:
        """Whether there is something to solve, or something to show that was not yet."""
        return self._now() != self._shown or not (self.frame.at_rest or self.frame.note)

    def _now(self) -> tuple[object, ...]:
        return self.session.wanted, self.sheet

    def update(self, budget: float = BUDGET) -> bytes:
        """Work for a while, and the frame that came of it: a length, JSON of numbers, positions, colours.

        Args:
            budget: s of wall time.

        Returns:
            4 bytes (little endian) length of the JSON text, the text, then float32: (n, 3) positions, mm, and (n,)
            values of the colour.
        """
        self._shown = self._now()
        self.frame = frame = self.session.update(budget)
        values = self._values(frame)
        top = float(np.percentile(values, 99.0)) if len(values) else 0.0
        head = {
            "kind": "frame",
            "rest": frame.at_rest,
            "note": frame.note,
            "snapped": frame.snapped,
            "stable": frame.state.stable,
            "energy": frame.state.energy.as_dict(),
            "asked": dict(frame.wanted.folds),
            "folds": frame.fold_angles(),
            "grips": {str(n): list(g.to) for n, g in frame.wanted.grips.items()},
            "forces": {str(n): list(f) for n, f in frame.forces.items()},
            "strain": float(np.abs(frame.state.strain).max()),
            "top": top,
            "ms": 1e3 * frame.seconds,
            "iterations": frame.iterations,
        }
        text = json.dumps(head, allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        return struct.pack("<I", len(text)) + text + _floats(frame.points) + _floats(values)

    def _values(self, frame: Frame) -> Array:
        state = frame.state
        if self._colour in ("bending", "stretching"):
            return np.asarray(state.nodal_energy_density(self._colour))
        values = np.zeros(len(state.points))
        if self._colour == "strain":
            np.maximum.at(values, state.mesh.topology.edges[:, 0], np.abs(state.strain))
            np.maximum.at(values, state.mesh.topology.edges[:, 1], np.abs(state.strain))
        return values

    def describe(self) -> Json:
        """The sheet as a window draws it: flat, with its creases by name."""
        mesh, model = self.session.mesh, self.sheet.model
        creases = [
            {
                "name": name,
                "fold": mesh.folds.get(name, "flat"),
                "edges": np.asarray(mesh.crease_edges(name)).ravel().tolist(),
                "full": self.sheet.full.get(name, np.pi),
                "handled": name in self.session.creases,
            }
            for name in mesh.creases
        ]
        held_nodes = sorted({int(n) for s in model.supports for n in _nodes(s)})
        return {
            "kind": "sheet",
            "name": self.sheet.name,
            "points": np.round(mesh.points, 6).ravel().tolist(),
            "triangles": mesh.triangles.ravel().tolist(),
            "boundary": mesh.topology.boundary.ravel().tolist(),
            "creases": creases,
            "held": held_nodes,
            "material": {"name": self.material, "E": model.sheet.E, "nu": model.sheet.nu, "t": model.sheet.t},
            "materials": {name: about for name, (_, _, _, about) in MATERIALS.items()},
            "library": list(LIBRARY),
            "formats": list(FORMATS),
            "formulation": model.formulation,
            "unknowns": self.session.size,
            "percent": self.sheet.percent,
            "remarks": list(self.sheet.remarks),
        }


def _nodes(support: object) -> list[int]:
    at = getattr(support, "at", ())
    return [] if isinstance(at, str) else [int(node) for node in at]


def _line(text: str) -> Json:
    return {"kind": "line", "text": text}


def _floats(values: Array) -> bytes:
    return np.ascontiguousarray(values, dtype="<f4").tobytes()
