"""Random handling for as long as wanted: `python -m benchmarks.studio_dragging --seconds 3600 --seed 1`.

A seeded hand drags sliders, pulls, pinches and lets go of points, holds nodes, undoes, changes the material and opens
other patterns. Of every state that is shown the forces are computed anew, at rest by a system that knows the
controls of the frame and nothing else; now and then its scene is saved and solved as `bh run` does, from flat or, where
the window says that a run from flat ends elsewhere, from the state beside it. Seconds are of the processor. It ends
with exit code 1 where a state is out of balance, a scene does not end in the state that was seen, or the memory has
grown by more than `LEAK` since the first `WARM` seconds. By then every way of handling has
been gone, so that the kernels that they take are there: one that is compiled keeps about 1 MB, one that is loaded from
the cache half as much. `--record` keeps what was seen.
"""

from __future__ import annotations

import argparse
import base64
import gc
import importlib
import json
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from io import BytesIO
from pathlib import Path
from zipfile import ZipFile

import numpy as np

from benchmarks.record import Measured, with_option
from bh.commands.run import solve
from bh.errors import InputError
from bh.formulations.protocols import PlacedSystem
from bh.formulations.registry import formulation
from bh.live import Frame
from bh.live.controls import Way
from bh.loading.builder import LoadStepBuilder
from bh.model.actuations import Force
from bh.model.model import Model
from bh.model.step import Step
from bh.runtime.compiling import compilations_heard
from bh.runtime.memory import give_back
from bh.runtime.terminal import say
from bh.scene.load import load_scene
from bh.studio.branch import SAME
from bh.studio.desk import Desk
from bh.studio.messages import read
from bh.studio.sheets import LIBRARY

TOLERANCE = 1e-6  # imbalance: that of a state that is told as a neutral one; the others keep 1e-8
LEAK = 50.0  # MB
WARM = 300.0  # s of processor time before the memory is read first; half of a run that is shorter than twice that
MINUTE = 60.0  # s of processor time between two lines
COMPARED = 40  # one of so many states at rest is saved as a scene that is solved
DRAWINGS = Path(__file__).parents[1] / "tests" / "data"
FILES = ("miura.svg", "pleats.svg")
WAYS = (
    "percent",
    "fold",
    "drag",
    "drag",
    "pinch",
    "let-go",
    "undo",
    "redo",
    "hold",
    "material",
    "flatten",
    "colour",
    "open",
)


@dataclass
class Log:
    """What was seen.

    Attributes:
        actions, frames, rests: how many there were.
        refused: requests that were answered by a line.
        stuck: frames that said why the sheet cannot go on, and `snaps` those that said it left its branch.
        worst: largest imbalance of a state that was shown as an equilibrium, `off` how many had more than `TOLERANCE`.
        compared: states whose scene was solved, and `beside` those of them whose scene came with the state, as a run
            from flat ends elsewhere; `unreached` scenes that did not end; `wrong` those that ended in another state.
        slowest: s of processor time of one answer.
    """

    actions: int = 0
    frames: int = 0
    rests: int = 0
    refused: int = 0
    stuck: int = 0
    snaps: int = 0
    worst: float = 0.0
    off: int = 0
    compared: int = 0
    beside: int = 0
    unreached: list[str] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)
    slowest: float = 0.0


class Hand:
    """A seeded hand at a desk."""

    def __init__(self, seed: int) -> None:
        """Begin with a pattern of the library."""
        self.random = np.random.default_rng(seed)
        self.desk = Desk()
        self.log = Log()
        self.gone: set[str] = set()  # ways that were gone

    def act(self) -> None:
        """Do something, watch what comes of it."""
        way = str(self.random.choice(WAYS))
        moves = self._moves(way)
        self.gone |= {way} if moves else set()
        for message in moves:
            self.log.actions += 1
            try:
                self.desk.take(read(json.dumps(message)))
            except InputError:
                self.log.refused += 1
            for _ in range(self.random.integers(0, 4)):
                self._frame()
        if self.random.random() < 0.3:
            for _ in range(60):
                if not self.desk.busy:
                    break
                self._frame()
            self._rest()

    def _moves(self, way: str) -> list[dict[str, object]]:
        random, session = self.random, self.desk.session
        if way == "percent":
            a, b = random.uniform(-30.0, 90.0, 2)
            return [{"do": way, "value": v} for v in np.linspace(a, b, random.integers(1, 12)).tolist()]
        if way == "fold" and session.creases:
            crease = str(random.choice(session.creases))
            return [{"do": way, "crease": crease, "angle": a} for a in random.uniform(-1.0, 2.5, 3).tolist()]
        if way == "drag":
            node = self._node()
            at = self.desk.frame.points[node]
            size = float(np.ptp(session.mesh.points, axis=0).max())
            far = size * random.choice([0.02, 0.1, 0.3, 3.0], p=[0.4, 0.4, 0.15, 0.05])
            steps = np.cumsum(random.normal(0.0, far / 4.0, (random.integers(1, 15), 3)), axis=0)
            return [{"do": "pull", "node": node, "to": to} for to in (at + steps).tolist()]
        if way == "pinch":
            a = self._node()
            b = int(random.choice(np.delete(np.arange(len(session.mesh.points)), a)))
            wide = float(np.linalg.norm(self.desk.frame.points[a] - self.desk.frame.points[b]))
            parts = np.linspace(1.0, random.uniform(0.3, 1.2), random.integers(1, 10))
            return [{"do": way, "a": a, "b": b, "gap": wide * part} for part in parts.tolist()]
        if way == "hold":
            node = int(random.integers(len(session.mesh.points)))
            return [{"do": way, "node": node, "on": bool(random.random() < 0.4)}]
        if way == "material":
            return [{"do": way, "name": str(random.choice(["paper", "card", "pet", "steel"]))}]
        if way == "colour":
            return [{"do": way, "by": str(random.choice(["stress", "bending", "curvature", "none"]))}]
        if way == "open":
            return [self._another()] if random.random() < 0.25 else []
        return [{"do": way}] if way in ("undo", "redo", "flatten", "let-go") else []

    def _node(self) -> int:
        """Any node; one time in three one that is gripped already, where there is one."""
        gripped, count = sorted(self.desk.session.wanted.grips), len(self.desk.session.mesh.points)
        again = bool(gripped) and self.random.random() < 1.0 / 3.0
        return int(self.random.choice(gripped if again else count))

    def _another(self) -> dict[str, object]:
        if self.random.random() < 0.5:
            return {"do": "pattern", "name": str(self.random.choice(list(LIBRARY)))}
        name = str(self.random.choice(FILES))
        return {"do": "open", "name": name, "data": base64.b64encode((DRAWINGS / name).read_bytes()).decode()}

    def _frame(self) -> None:
        began = time.process_time()
        self.desk.update()
        self.log.slowest = max(self.log.slowest, time.process_time() - began)
        frame = self.desk.frame
        self.log.frames += 1
        self.log.stuck += bool(frame.note)
        self.log.snaps += frame.snapped
        if not np.isfinite(frame.points).all():
            raise ArithmeticError("a state with nan was shown")
        self._weigh(self.desk.session.imbalance())

    def _weigh(self, imbalance: float) -> None:
        self.log.worst = max(self.log.worst, imbalance)
        self.log.off += not imbalance <= TOLERANCE

    def _rest(self) -> None:
        frame, session = self.desk.frame, self.desk.session
        if not frame.at_rest:
            return
        self.log.rests += 1
        self._weigh(own_imbalance(session.model, frame))
        if self.log.rests % COMPARED or not any(frame.wanted.folds.values()):
            return
        self.log.compared += 1
        with tempfile.TemporaryDirectory() as folder:
            self._repeat(Path(folder))

    def _repeat(self, folder: Path) -> None:
        """Save the scene of the state at rest and solve it as a person does."""
        shown = self.desk.frame.points
        file, *_ = self.desk.take(read(json.dumps({"do": "export", "what": "scene"})))
        name, data = Path(str(file["name"])), base64.b64decode(str(file["data"]))
        if name.suffix == ".zip":
            with ZipFile(BytesIO(data)) as archive:
                archive.extractall(folder)
        else:
            (folder / name).write_bytes(data)
        out = folder / f"{name.stem}-out"
        beside = (out / "path.bh").exists()
        self.log.beside += beside
        scene = load_scene(folder / f"{name.stem}.toml")
        path = solve(scene, out, resume=beside, estimate=False, neighbours=False).path
        what = f"{self.desk.sheet.name}, {'from the state beside it' if beside else 'from flat'}"
        if not path.reached:
            self.log.unreached.append(f"{what}: {path.outcome}")
        elif (off := float(np.abs(path[-1].points - shown).max() / np.ptp(shown))) > SAME:
            energies = path[-1].energy.total, self.desk.frame.state.energy.total
            self.log.wrong.append(f"{what}: {off:.1e} of its size off, energies {energies}")


def own_imbalance(model: Model, frame: Frame) -> float:
    """Forces out of balance at rest under what the frame names and nothing else, by a system that is made anew.

    Returns:
        as of `Evaluation`; 0 where a formulation cannot begin at a shape.
    """
    start = replace(frame.controls, folds=dict.fromkeys(frame.controls.folds, 0.0))
    items = Way(start, frame.controls).actuations(model) or (Force([0], each=(0.0, 0.0, 0.0)),)
    system = formulation(model.formulation).system(model, LoadStepBuilder(model).build(Step(items)), None)
    if not isinstance(system, PlacedSystem):
        return 0.0
    return system.evaluate(system.unknowns_at(frame.points, 1.0), 1.0).imbalance


def resident() -> float:
    """Memory of this process that is in use, MB: without what waits to be collected, or lies free in the heap."""
    gc.collect()
    give_back()
    return float(importlib.import_module("psutil").Process().memory_info().rss) / 2**20  # it has no types


def keep(found: Measured, hand: Hand, memory: list[float], compiled: int) -> None:
    """What was seen, as figures of a record.

    Args:
        found: takes them.
        hand: that has handled.
        memory: MB at the base, every minute behind it, and at the end.
        compiled: kernels that were compiled.
    """
    log = hand.log
    counts: dict[str, float] = {
        "wishes": log.actions,
        "frames": log.frames,
        "states at rest": log.rests,
        "snaps told": log.snaps,
        "frames out of balance": log.off,
        "scenes solved": log.compared,
        "scenes solved from the state beside them": log.beside,
        "scenes that did not end in the state that was seen": len(log.wrong) + len(log.unreached),
        "kernels compiled": compiled,
    }
    for quantity, value in counts.items():
        found.add(quantity, value, "", {})
    found.add("largest imbalance", log.worst, "1", {})
    found.add("slowest answer, processor time", log.slowest, "s", {})
    readings = {"base": memory[0], "least": min(memory), "largest": max(memory), "end": memory[-1]}
    for at, value in {**readings, "grown": memory[-1] - memory[0]}.items():
        found.add("memory from the base on", value, "MB", {"at": at})


def main(words: Sequence[str] | None = None) -> int:
    """Print what was seen, and a line every minute of the processor."""
    parser = with_option(argparse.ArgumentParser(description=__doc__.splitlines()[0]), "studio_dragging")
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(words)
    found = Measured("studio_dragging", "Random handling", words)
    hand = Hand(given.seed)
    compiled: list[str] = []
    began, told = time.process_time(), 0.0
    memory: list[float] = []
    with compilations_heard(compiled.append):
        while (spent := time.process_time() - began) < given.seconds:
            hand.act()
            if not memory and spent > min(WARM, 0.5 * given.seconds):
                memory.append(resident())
                gone = f"ways not gone until now: {set(WAYS) - hand.gone}"
                say(f"{spent:.0f} s: {memory[0]:.0f} MB are the base, {gone}")
            if spent - told > MINUTE:
                told, now = spent, resident()
                memory += [now] if memory else []
                say(f"{spent:.0f} s: {now:.0f} MB, {len(compiled)} kernels compiled, {hand.log}")
                sys.stdout.flush()
    memory.append(resident())
    grown = memory[-1] - memory[0]
    say(f"{spent:.0f} s of the processor, memory grown by {grown:.0f} MB, {hand.log}")
    keep(found, hand, memory, len(compiled))
    found.write(given.record)
    return int(grown > LEAK or hand.log.off > 0 or bool(hand.log.wrong or hand.log.unreached))


if __name__ == "__main__":
    raise SystemExit(main())
