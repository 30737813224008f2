"""One window: the sheet that lies in it, what is asked of it, and what it shows. It knows no network."""

from __future__ import annotations

import base64
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import bh.studio.messages as asked
from bh.analysis.contact import self_contact
from bh.errors import InputError
from bh.formulations.state import State
from bh.live import Controls, Frame, Mark, Session, held
from bh.live.holding import handled
from bh.model.sheet import Sheet
from bh.runtime.memory import give_back
from bh.studio.branch import FromFlat, check, from_flat
from bh.studio.colours import offered, top_of
from bh.studio.exports import beside, export, film, moving
from bh.studio.finer import Finer, finer
from bh.studio.frames import Json, creases_of, described, line, packed, surface
from bh.studio.pictures import Pictures
from bh.studio.sheets import BARS, LiveSheet, material_of, of_file, of_library
from bh.studio.strokes import Was, moved, pushed

BUDGET = 0.03  # s of an update
FARTHEST = 10.0  # sizes of the sheet that a hand may be away from it
LONGEST_REST = 20.0  # s that a file may wait for the state at rest, and for a run from flat
TIDY = 5.0  # s between two times that free memory goes back to the system


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
        self._snapped = False  # since the last picture
        self._pictures = Pictures()
        self._finer: tuple[State, Finer] | None = None  # a state, and what a finer mesh says of it
        self._flat: tuple[State, FromFlat] | None = None  # a state, and where a run from flat ends
        self._tidied = time.monotonic()
        self._news: list[Json] = []
        self._past: list[Was] = []  # before every stroke
        self._undone: list[Was] = []
        self._stroke: tuple[object, ...] | None = None
        self.put(sheet or of_library("arc"))

    # ------------------------------------------------------------------------------- what is asked

    def put(self, sheet: LiveSheet, controls: Controls | None = None, there: Mark | None = None) -> None:
        """Put a sheet on the desk.

        Args:
            sheet: to be handled.
            controls: as it was handled before; None for flat, or as it is drawn.
            there: where it lay when it was on the desk before; None for a new one.

        Raises:
            InputError: it cannot be handled; the desk is as before.
        """
        model = sheet.model if sheet.model.supports else held(sheet.model)
        session = Session(model, settles=sheet.settles)
        if controls is not None:
            session.ask(controls)
        if there is not None:
            session.go_back(there)
        frame = session.update(0.0)
        colours = offered(frame.state)
        # nothing is laid before all of it is known to be good
        self.sheet = sheet if model is sheet.model else replace(sheet, model=model)
        self.session, self.frame, self._colours = session, frame, colours
        self._finer = None  # it is of another sheet
        give_back()
        if self._colour != "none" and self._colour not in colours:
            self._colour = "bending"
        self._shown = ()

    def anew(self) -> None:
        """Begin anew with the sheet, or where that breaks, too, with a pattern of the library."""
        try:
            self.put(self.sheet)
        except Exception:  # whatever it was, the window goes on
            self.put(of_library("arc"))

    def take(self, message: asked.Asked, alone: Callable[[], bool] = lambda: True) -> list[Json]:
        """Do what a window asks.

        Args:
            message: checked.
            alone: whether nothing else is asked yet, for which a check gives way.

        Returns:
            answers, beside the frames: a new sheet, a file, a line.

        Raises:
            InputError: it cannot be done; the desk is as before.
        """
        if isinstance(message, asked.Plain):
            return self._plain(message.do, alone)
        before, asked_before = self._was(), (self._now(), self.material)
        answers = [self.describe()] if self._laid(message) else self._done(message)
        # a file is no stroke, though jaws may have moved while the sheet came to rest for it
        if (self._now(), self.material) != asked_before and not isinstance(message, asked.Export):
            self._remember(message, before)
        return answers

    def _was(self) -> Was:
        """What lies on the desk and how, to go back to."""
        return self.sheet, self.session.mark(), self.material

    def _remember(self, message: asked.Asked, before: Was) -> None:
        """What was asked for before a stroke; its moves after the first are of one change with it."""
        number = message.stroke if isinstance(message, asked.Move) else None
        stroke = None if number is None else (message.do, number, *moved(message))
        if stroke is None or stroke != self._stroke:
            pushed(self._past, before)
        self._stroke = stroke
        self._undone.clear()

    def _done(self, message: asked.Asked) -> list[Json]:
        """Do what leaves the sheet on the desk."""
        match message:
            case asked.Fold(crease=crease, angle=angle):
                self.session.fold(crease, angle)
            case asked.Percent(value=value):
                for crease in self.session.creases:
                    self.session.fold(crease, 0.01 * value * self.sheet.full[crease])
            case asked.Pull(node=node, to=to):
                self._near(f"node {node} is pulled", np.array(to) - self.session.mesh.points.mean(axis=0))
                self.session.pull(node, to)
            case asked.Pinch(a=a, b=b, gap=gap):
                self._near("jaws are opened", np.array([gap or 0.0]))
                self.session.pinch(a, b, gap)
            case asked.LetGo(node=node):
                self.session.let_go(node)
            case asked.Colour(by=by):
                self._paint(by)
            case asked.Export(what=what):
                self.frame = self._rest()
                if what in ("scene", "python") and not self._flat_known():
                    self.session.leave(self.frame.state)
                name, data = export(what, self.sheet, self.session, self.frame)
                return [_file(name, data), *map(line, beside(what, name, self.session, self.frame))]
            case asked.Film(pictures=pictures, ms=ms, kind=kind):
                name = f"{Path(self.sheet.name).stem or 'sheet'}.{kind}"
                return [_file(name, film(pictures, ms) if kind == "gif" else moving(pictures, ms))]
        return []

    def _laid(self, message: asked.Asked) -> bool:
        """Whether a message puts another sheet on the desk, or the same one held or made otherwise."""
        match message:
            case asked.Open(name=name, data=data):
                self.put(of_file(name, data, self.material))
            case asked.Pattern(name=name, values=values):
                self.put(of_library(name, self.material, values))
            case asked.Spring(crease=crease, Lstar=Lstar):
                self.put(self.sheet.sprung(crease, Lstar), self.session.wanted)
            case asked.Crease(crease=crease, kind=kind):
                self._turn(self.sheet.turned(crease, kind))
            case asked.Contact(on=on):
                self.put(self.sheet.stopping(on), self.session.wanted)
            case asked.Hold(node=node, on=on):
                self._hold(node, on)
            case asked.Material():
                self._change(message)
            case _:
                return False
        return True

    def _plain(self, what: str, alone: Callable[[], bool]) -> list[Json]:
        if what == "check":
            return [line(check(self.session, self._rest(), alone))]
        now = self._was()
        if what == "flatten":
            flat = Controls(dict.fromkeys(self.session.creases, 0.0))
            if flat != self.session.wanted:
                pushed(self._past, now)
                self._undone.clear()
                self.session.let_go()
                self.session.ask(flat)
            return []
        past, future = (self._past, self._undone) if what == "undo" else (self._undone, self._past)
        if not past:
            return [line(f"there is nothing to {what}")]
        sheet, there, material = past[-1]
        if sheet is self.sheet:
            self.session.go_back(there)
        else:
            self.put(sheet, there=there)
        self.material = material
        past.pop()
        pushed(future, now)
        self._stroke, self._shown = None, ()  # the same controls may be those of another state
        return [] if sheet is now[0] else [self.describe()]

    def _near(self, what: str, away: NDArray[np.float64]) -> None:
        """Refuse a place (mm from the middle of the flat sheet) from which no sheet comes back as it was."""
        size = float(np.ptp(self.session.mesh.points, axis=0).max())
        far = float(np.linalg.norm(away))
        if far > FARTHEST * size:
            raise InputError(
                f"{what} {far:.3g} mm away, the sheet is {size:.3g} mm wide; stay within {FARTHEST:g} times that"
            )

    def _flat_known(self) -> bool:
        """Whether it is known where a run from flat ends: not of a sheet on its way, or in time, or where it breaks."""
        ends = time.monotonic() + LONGEST_REST
        try:
            return self.from_flat(lambda: time.monotonic() < ends) is not None
        except Exception:  # the state is good, and is saved itself
            return False

    def _paint(self, by: str) -> None:
        if by != "none" and by not in self._colours:
            known = ", ".join((*self._colours, "none"))
            raise InputError(f"this sheet cannot be coloured by '{by}'; choose one of {known}")
        self._colour, self._shown = by, ()

    def _hold(self, node: int, on: bool) -> None:
        model, mesh = self.sheet.model, self.session.mesh
        if node >= len(mesh.points):
            raise InputError(f"there is no node {node} to hold; choose one of 0 to {len(mesh.points) - 1}")
        other = tuple(s for s in model.supports if getattr(s, "at", None) not in ([node], (node,)))
        if not on and len(other) == len(model.supports):
            raise InputError(f"node {node} is not held on its own; change its support in the scene")
        model = replace(model, supports=other)
        model = model.support([node], "xyz") if on else model
        self.put(replace(self.sheet, model=model), self.session.wanted)

    def _turn(self, sheet: LiveSheet) -> None:
        """The same handling of other kinds of creases; one that was flat goes as far as the others have gone."""
        wanted = self.session.wanted
        parts = [angle / sheet.full[name] for name, angle in wanted.folds.items() if sheet.full[name]]
        gone = float(np.median(parts)) if parts else 0.0
        names = handled(sheet.model.mesh)
        folds = {name: wanted.folds.get(name, gone * sheet.full[name]) for name in names}
        self.put(sheet, replace(wanted, folds=folds))

    def _change(self, message: asked.Material) -> None:
        now = self.sheet.model.sheet
        if message.name is not None:
            young, nu, t, _ = material_of(message.name)
            now = Sheet(E=young, nu=nu, t=t)
        nu = now.nu if self.sheet.model.formulation != BARS else 0.0
        sheet = replace(
            now, E=message.E or now.E, nu=nu if message.nu is None else message.nu, t=message.t or now.t
        )
        self.put(self.sheet.of(sheet), self.session.wanted)
        self.material = message.name or self.material

    def _rest(self) -> Frame:
        """The state at rest; a snap on the way there is told with the next picture."""
        frame = self.session.rest(LONGEST_REST)
        self._snapped = self._snapped or frame.snapped
        return frame

    # ------------------------------------------------------------------------------- what is shown

    @property
    def busy(self) -> bool:
        """Whether there is something to solve, or something to show that was not yet."""
        return self.stale or not (self.frame.at_rest or self.frame.note)

    @property
    def stale(self) -> bool:
        """Whether something was asked since it was worked last: the frame knows nothing of it."""
        return self._now() != self._shown

    @property
    def moving(self) -> bool:
        """Whether the sheet is on its way to what is asked; else it is there, or cannot go on."""
        return self.stale or not (self.frame.arrived or self.frame.note)

    @property
    def fresh(self) -> bool:
        """Whether the window has not got these positions, or not in this colour."""
        return self._pictures.fresh(self.frame, self._colours.get(self._colour))

    @property
    def untold(self) -> bool:
        """Whether the window does not know where the sheet lies, or that it is at rest there."""
        return self._pictures.untold(self.frame, self._colours.get(self._colour))

    def _now(self) -> tuple[object, ...]:
        return self.session.wanted, self.sheet

    def work(self, budget: float = BUDGET) -> None:
        """Work for a while at what is asked.

        Args:
            budget: s of wall time.
        """
        self._shown = self._now()
        self.frame = self.session.update(budget)
        self._snapped = self._snapped or self.frame.snapped
        if self.frame.note and self.sheet.settles and self.sheet.model.formulation == BARS:
            self._bend()
        if time.monotonic() - self._tidied > TIDY:
            give_back()
            self._tidied = time.monotonic()

    def _bend(self) -> None:
        """Slender faces of bars collapse under stiff springs: the same faces, which may bend, fold further."""
        note, nu = self.frame.note, material_of(self.material)[1]
        self.put(self.sheet.bent(nu), self.session.wanted)
        text = f"bars and hinges cannot go on ({note}); now its faces may bend, and it folds anew"
        self._news += [self.describe(), line(text)]

    def news(self) -> list[Json]:
        """What came of the work beside frames.

        Returns:
            since this was asked last: another sheet, a line.
        """
        news, self._news = self._news, []
        return news

    def picture(self, heard: int = 0, whole: bool = True) -> bytes:
        """The newest frame as it travels.

        Args:
            heard: messages that have been taken until now; it is handed on.
            whole: with positions; False for the numbers alone, where the window has those.

        Returns:
            see `Pictures.packed`.
        """
        more: Json = {"snapped": self._snapped, "left": self.session.left, "heard": heard}
        self._snapped = False
        return self._pictures.packed(self.frame, self._colours.get(self._colour), more, whole)

    def update(self, budget: float = BUDGET) -> bytes:
        """Work for a while, and the frame that came of it.

        Args:
            budget: s of wall time.

        Returns:
            see `picture`.
        """
        self.work(budget)
        return self.picture()

    def finer(self, going: Callable[[], bool], heard: int = 0) -> bytes | None:
        """The state that is shown, on a finer mesh; other threads may work at the desk meanwhile.

        Args:
            going: asked between two iterations; False ends it.
            heard: messages that have come until now; it is handed on.

        Returns:
            a frame of kind "finer" with its mesh, the error of the energy and why there is none; None where it was
            ended, or there is no state at rest to be refined.
        """
        frame = self.frame
        if not frame.at_rest:
            return None
        known = self._finer  # read once: another thread may put another sheet on the desk
        if known is None or known[0] is not frame.state:
            found = finer(self.sheet.model, frame, going)
            give_back()  # the factors of its meshes: it may be long until the next wish
            if found is None:
                return None
            known = self._finer = frame.state, found
        found = known[1]
        meets = len(self_contact(frame.state))
        head: Json = {
            "kind": "finer",
            "heard": heard,
            "error": found.error,
            "reason": found.reason,
            "meets": meets,
        }
        state = found.state
        if state is None:
            return packed(head)
        chosen = self._colours.get(self._colour)
        values = np.zeros(len(state.points)) if chosen is None else chosen.values(state)
        mesh = {**surface(state.mesh), "creases": creases_of(state.mesh)}
        return packed(
            {**head, "mesh": mesh, "top": top_of(values), "energy": state.energy.as_dict()},
            state.points,
            values,
        )

    def from_flat(self, going: Callable[[], bool]) -> FromFlat | None:
        """Whether the state that is shown is where a run from flat ends; where it is not, its scene brings it along.

        Args:
            going: asked while it is solved anew; False ends it.

        Returns:
            None where there is no state at rest, or it was ended.
        """
        frame, session = self.frame, self.session
        if not frame.at_rest:
            return None
        known = self._flat
        if known is None or known[0] is not frame.state:
            found = from_flat(session, frame, going)
            if found is None or not going():  # it may be of what was asked meanwhile
                return None
            known = self._flat = frame.state, found
            if not found.here:
                session.leave(frame.state)
        return known[1]

    def describe(self) -> Json:
        """The sheet as a window draws it: flat, with its creases by name; what it had is gone."""
        self._pictures.forget()
        return described(self.sheet, self.session, self.material, self._colours, self._colour)


def _file(name: str, data: bytes) -> Json:
    return {"kind": "file", "name": name, "data": base64.b64encode(data).decode()}
