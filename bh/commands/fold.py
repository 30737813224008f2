"""`bh fold`: a drawing to a folded sheet. Scenes are proposed and solved in turn until one folds all the way.

Each is solved in a folder of its own inside the output folder; that of the best goes where results belong, with the
scene, and the others are taken away.
"""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np
from numpy.typing import NDArray

from bh.analysis.contact import Contact, first_contact
from bh.commands.occupied import FINISHED, UNFINISHED
from bh.commands.result import result
from bh.commands.run import make_folder, remove_extras, solve, take_back, write_extras
from bh.errors import InputError
from bh.paths.path import Path as Trace
from bh.runtime.progress import ProgressMeter, meter, stage
from bh.scene.folding import Proposal, Wish, proposals
from bh.scene.load import Scene, parse_scene
from bh.solvers.automatic import Automatic
from bh.solvers.points import Increment, Point
from bh.solvers.system import Evaluation, Hindered, System, Tangent
from bh.solvers.walk import Strategy
from bh.solving.levels import folder_of, move
from meshes.io.export import replacing

Array = NDArray[np.float64]
SHARE = 0.6  # of the time that is left goes to each of the scenes but the last
RESERVED = 0.2  # of it is left for those that follow, however far a scene has come
# s that an evaluation of a system takes, a tangent with its factors, and an unknown of either (one core of 2.5 GHz):
# time is counted by work, so that the scene that is kept does not hang on the machine, or on what else runs on it
EVALUATION, TANGENT, UNKNOWN, FACTORED = 1e-4, 3e-4, 5e-7, 1e-5
SECONDS = 150.0  # so counted, 50 to 120 s of a slow core: less than a minute of a present one
HALFWAY = (
    0.5  # of the way: a scene that has come so far keeps the time, as the next one would have to be faster
)
LONG = 60.0  # s, after which a run that is not watched says what it does all the same


class TimeUpError(InputError):
    """The time for one of the scenes is over."""


@dataclass(frozen=True)
class Folded:
    """What has come of a file.

    Attributes:
        path: as far as it goes.
        scene: that it is of.
        proposal: the scene's text, and what is assumed in it.
        written: the files, the scene first.
        notes: what was tried before, and why it was left; one line each.
        seconds: processor time of all of it.
        contact: the first self-contact of the path, if any.
    """

    path: Trace
    scene: Scene
    proposal: Proposal
    written: tuple[Path, ...]
    notes: tuple[str, ...]
    seconds: float
    contact: Contact | None


class _Clock:
    """A meter that hands on to another one and ends a run whose time, counted by its work, is over.

    A run that would end in time at the pace of the last third of what it took, or has come beyond half of the way, goes
    on beyond its share.

    Args:
        inner: the meter.
        seconds: the run's share of the time.
        most: time that is left for everything, s.
    """

    def __init__(self, inner: ProgressMeter, seconds: float, most: float) -> None:
        self._inner = inner
        self._share, self._most = seconds, most
        self.spent = 0.0
        self._begin()

    def stage(self, words: str) -> None:
        stage(self._inner, words)
        self._begin()

    def _begin(self) -> None:
        """The way begins: time and way of states, 0 to 1."""
        self._states = [(self.spent, 0.0)]

    def update(self, step: int, steps: int, lam: float, iterations: int, energy: float) -> None:
        self._inner.update(step, steps, lam, iterations, energy)
        way = (step + lam) / steps
        if way < self._states[-1][1]:  # on another mesh
            self._begin()
        self._states.append((self.spent, way))
        self.check(lam)

    def count(self, unknowns: int, factored: bool = False) -> None:
        """Another evaluation of a system of this size, or its tangent, with the factors that it is made for."""
        self.spent += TANGENT + FACTORED * unknowns if factored else EVALUATION + UNKNOWN * unknowns

    def count_looks(self, seconds: float) -> None:
        """What looks at panels that stop each other have taken."""
        self.spent += seconds

    def check(self, lam: float) -> None:
        """Raise `TimeUpError` if the time is over."""
        if self.spent <= self._share:
            return
        third = (self.spent - self._states[0][0]) / 3.0
        way = self._states[-1][1]
        lately = way - next(before for at, before in reversed(self._states) if at <= self.spent - third)
        slow = way < HALFWAY and third * (1.0 - way) >= (self._most - self.spent) * lately
        if self.spent >= self._most or slow:
            raise TimeUpError(f"its {self.spent:.0f} s were over at lambda = {lam:.2f}")

    def timed(self, strategy: Strategy) -> Strategy:
        """The strategy, which counts its work and ends where the time is over in the middle of an increment, too."""
        return _Timed(strategy, self)

    def close(self, outcome: str) -> None:
        self._inner.close(outcome)


@dataclass(frozen=True)
class _Timed:
    """A strategy whose systems tell the clock whenever they are evaluated."""

    inner: Strategy
    clock: _Clock

    def __getattr__(self, name: str) -> object:
        return getattr(self.inner, name)  # what else drivers ask of a strategy

    def limits(self, system: System) -> tuple[float, float]:
        return self.inner.limits(system)

    def follow(
        self,
        system: System,
        history: Sequence[Point],
        increment: float | None = None,
        origin: Point | None = None,
    ) -> Iterator[Increment]:
        return self.inner.follow(_timed(system, self.clock), history, increment, origin)


class _TimedSystem:
    """A system that tells the clock whenever it is evaluated, or its tangent is made."""

    def __init__(self, system: System, clock: _Clock) -> None:
        self._system, self._clock = system, clock
        self._hindered = system if isinstance(system, Hindered) and system.hindered else None
        self._looked = 0.0

    def evaluate(self, q: Array, lam: float) -> Evaluation:
        self._clock.count(len(q))
        self._count_looks()
        self._clock.check(lam)
        return self._system.evaluate(q, lam)

    def _count_looks(self) -> None:
        """What looks for contact have taken since the last time, in this evaluation or between two."""
        if self._hindered is not None:
            taken = self._hindered.looking
            self._clock.count_looks(taken - self._looked)
            self._looked = taken

    def tangent(self, q: Array, lam: float, forces: Array) -> Tangent:
        self._clock.count(len(q), factored=True)
        self._count_looks()
        return self._system.tangent(q, lam, forces)


def _timed(system: System, clock: _Clock) -> System:
    """The system, which tells the clock of its work and has the abilities that it had.

    What it can do beside stands in its class, as `isinstance` of a protocol looks there, not at `__getattr__`, from
    Python 3.12 on.
    """

    def handed_on(name: str) -> property:
        return property(lambda _: getattr(system, name))

    names = (name for name in dir(system) if not name.startswith("_") and name not in vars(_TimedSystem))
    kind = type("_TimedSystem", (_TimedSystem,), {name: handed_on(name) for name in names})
    return cast(System, kind(system, clock))


def fold_file(
    file: Path,
    folder: Path,
    wish: Wish,
    *,
    seconds: float = SECONDS,
    progress: bool | ProgressMeter = False,
    force: bool = False,
) -> Folded:
    """Fold a file into a folder: NAME.toml, path.bh, result.json, folded.png and what else is wished for.

    Args:
        file: .svg, .dxf, .fold, .cp or .opx.
        folder: for the results; made if need be.
        wish: how to fold.
        seconds: time for solving, counted by work (`FACTORED`); a scene that takes more than its share of it makes
            room for the next.
        progress: as for `bh.trace`.
        force: write over a scene that is there.

    Raises:
        InputError: the file cannot be read or meshed, or the folder has a scene of that name already.
    """
    began = time.process_time()
    target = folder / f"{file.stem}.toml"
    if target.exists() and not force:
        raise InputError(f"'{target}' is there already; run it (bh run {target}), or add --force")
    offers = proposals(file, wish)
    made = make_folder(folder)
    copy = folder / file.name  # a scene names no file outside its folder
    own = copy.exists()
    if not own or not copy.samefile(file):
        with replacing(copy) as draft:
            shutil.copyfile(file, draft)
    tried: list[tuple[Proposal, Scene, Trace, Path]] = []
    notes: list[str] = []
    failed: InputError | None = None
    left = seconds
    for number, offer in enumerate(offers):
        if left <= 0.0 and tried:
            break
        share = left if number == len(offers) - 1 else SHARE * left
        place = folder / f".fold-{number}"
        shutil.rmtree(place, ignore_errors=True)
        try:
            scene = replace(parse_scene(offer.text, folder, file.stem), source=target)
            report = meter(progress)
            stage(report, offer.mesh)
            most = left if number == len(offers) - 1 else (1.0 - RESERVED) * left
            clock = _Clock(report, max(share, 1.0), max(most, 1.0))
            path, why = _solved(scene, place, clock)
        except InputError as error:
            failed = failed or error
            notes.append(f"{offer.mesh}: {error}")
            shutil.rmtree(place, ignore_errors=True)
            continue
        left -= clock.spent
        tried.append((offer, scene, path, place))
        if (
            path.reached
        ):  # an accuracy that is not met in the time is still said, which coarser meshes have none to say
            break
        notes.append(f"{offer.mesh}: {why}")
    if not tried:
        take_back(None if own else copy, made)
        raise failed or InputError(f"{file}: no mesh of it can be solved")
    best = max(enumerate(tried), key=lambda item: (item[1][2].reached, item[1][2][-1].lam, item[0]))[1]
    return _kept(best, folder, target, tuple(notes), began, [item[3] for item in tried])


def _solved(scene: Scene, place: Path, clock: _Clock) -> tuple[Trace, str]:
    """The path of a scene, as far as its time allows, and why it ended early.

    Raises:
        InputError: it cannot be solved at all.
    """
    try:
        timed = clock.timed(scene.strategy or Automatic())
        path = solve(scene, place, progress=clock, estimate=False, strategy=timed).path
    except TimeUpError as over:
        levels = sorted(folder_of(place / FINISHED[0]).glob("*.bh"), key=lambda found: found.stat().st_mtime)
        file = place / FINISHED[0]
        if not file.is_file() and levels:
            file = levels[-1]
        path = Trace.load(file)
        if file is not place / FINISHED[0]:
            path.save(place / FINISHED[0])
        return path, str(over)
    return path, f"{path.outcome} at lambda = {path[-1].lam:.2f}" if not path.reached else ""


def _kept(
    best: tuple[Proposal, Scene, Trace, Path],
    folder: Path,
    target: Path,
    notes: tuple[str, ...],
    began: float,
    places: list[Path],
) -> Folded:
    """Move the best to its place, with its scene and pictures, and take the others away."""
    offer, scene, path, place = best
    remove_extras(folder, "")
    for name in (*FINISHED, *UNFINISHED):
        (folder / name).unlink(missing_ok=True)
    (place / FINISHED[0]).replace(folder / FINISHED[0])
    move(folder_of(place / FINISHED[0]), folder_of(folder / FINISHED[0]))
    for each in places:
        shutil.rmtree(each, ignore_errors=True)
    with replacing(target) as draft:
        draft.write_text(offer.text, encoding="utf-8")
    contact = first_contact(path)
    text = result(path, scene, contact) | {"assumed": list(offer.assumed), "tried": list(notes)}
    with replacing(folder / FINISHED[1]) as draft:
        draft.write_text(json.dumps(text, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    written = [target, *(folder / name for name in FINISHED)]
    written += write_extras(path, scene, folder)
    return Folded(path, scene, offer, tuple(written), notes, time.process_time() - began, contact)
