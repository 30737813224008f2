"""How many drawings of a folder open in the window and go to 80 % by the slider: `python -m benchmarks.studio_gallery`.

`BH_DRAWINGS=FOLDER` names the folder. Of every drawing the slider is moved in forty events, each with the budget of a
frame, then it is left until the sheet is at rest. Times are of the processor. A stall is an answer that takes more than
a second. Arguments are parts of names of drawings; without any all are opened. `--record` keeps what was measured.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.record import Measured, with_option
from bh.errors import InputError
from bh.runtime.terminal import say
from bh.studio.desk import Desk
from bh.studio.messages import Percent
from bh.studio.sheets import of_file
from meshes.io.drawing import PATTERNS

EVENTS, WANTED = 40, 80.0  # of the slider, and where it ends, percent
STALL = 1.0  # s of processor time of one answer
LONGEST = 120.0  # s of processor time of one drawing


@dataclass(frozen=True)
class Run:
    """What became of a drawing.

    Attributes:
        opened: s of processor time until the first picture; nan where it cannot be opened.
        slowest: s of the slowest answer.
        spent: s in all after opening.
        triangles: of its mesh.
        note: why it is not there, or an empty string.
        share: of the way that its creases have gone, percent.
    """

    opened: float
    slowest: float
    spent: float
    triangles: int
    note: str
    share: float = 0.0


def run(file: Path) -> Run:
    """Open a drawing and fold it by the slider.

    Args:
        file: a drawing.
    """
    began = time.process_time()
    try:
        desk = Desk(of_file(file.name, file.read_bytes()))
    except InputError as error:
        return Run(float("nan"), 0.0, 0.0, 0, f"not opened: {error}")
    desk.update()
    opened = time.process_time() - began
    slowest, events = 0.0, iter(range(1, EVENTS + 1))
    began = time.process_time()
    while (spent := time.process_time() - began) < LONGEST:
        event = next(events, None)
        if event is None and not desk.busy:
            break
        before = time.process_time()
        if event is not None:
            desk.take(Percent(do="percent", value=WANTED * event / EVENTS))
        desk.update()
        slowest = max(slowest, time.process_time() - before)
    frame = desk.frame
    note = "" if frame.at_rest else frame.note or f"not at rest after {LONGEST:.0f} s"
    full = desk.sheet.full
    gone = [angle / full[name] for name, angle in frame.controls.folds.items()]
    share = 100.0 * float(np.mean(gone)) if gone else 0.0
    return Run(opened, slowest, spent, len(desk.session.mesh.triangles), note, share)


def main(words: Sequence[str] | None = None) -> None:
    """Print a line a drawing, and the counts."""
    parser = with_option(argparse.ArgumentParser(description=__doc__.splitlines()[0]), "studio_gallery")
    parser.add_argument("parts", nargs="*", help="parts of names of drawings")
    given = parser.parse_args(words)
    measured = Measured("studio_gallery", "Drawings of a folder, by the slider", words)
    folder, parts = os.environ.get("BH_DRAWINGS", ""), given.parts
    files = (
        sorted(each for each in Path(folder).rglob("*") if each.suffix.lower() in PATTERNS) if folder else []
    )
    files = [each for each in files if not parts or any(part in str(each) for part in parts)]
    if not files:
        raise InputError(f"BH_DRAWINGS = '{folder}' has no drawings; name a folder")
    runs = {}
    for file in files:
        found = runs[file] = run(file)
        state = found.note or ("STALL" if found.slowest > STALL else "there")
        say(
            f"{file.relative_to(folder)}: {found.triangles} triangles, opened {found.opened:.1f} s, "
            f"slowest {found.slowest:.2f} s, {found.spent:.1f} s in all, {found.share:.0f} %: {state}"
        )
    there = [each for each in runs.values() if not each.note]
    calm = [each for each in there if each.slowest <= STALL]
    opened = [each for each in runs.values() if each.triangles]
    say(
        f"{len(runs)} drawings, {len(opened)} opened, {len(there)} at {WANTED:.0f} %, "
        f"{len(calm)} of them without a stall above {STALL:.0f} s"
    )
    for quantity, value in (("played", runs.values()), ("opened", opened), ("there", there), ("calm", calm)):
        measured.add("drawings", len(value), "", {"that are": quantity})
    if there:
        params = {"that are": "there"}
        measured.add("slowest answer, largest", max(each.slowest for each in there), "s", params)
        measured.spread("slowest answer", [each.slowest for each in there], "s", params)
        measured.spread("all answers of a drawing", [each.spent for each in there], "s", params)
    measured.write(given.record)


if __name__ == "__main__":
    main()
