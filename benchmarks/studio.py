"""How long from the slider to the new state in the browser: `python -m benchmarks.studio`, on a quiet machine.

The browser runs on the same machine, without a graphics card. Times are of whole events: the message, the solve, the
frame and its drawing. `--session` leaves the window out. Sizes may be given as numbers 1 to 3; `--record` keeps what
was measured.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence

import numpy as np

import bh
import meshes
from benchmarks.record import Measured, Params, with_option
from bh.live import Session
from bh.runtime.terminal import say
from bh.studio.sheets import LiveSheet, of_model
from tests.unit.browsers import opened
from tests.unit.studio_visits import served

CELLS = ((20, 4), (48, 8), (96, 16))  # about 1,000, 5,000 and 20,000 unknowns
EVENTS = 40
EVENT = """(value) => new Promise((done) => {
  const slider = document.getElementById("percent"), began = performance.now();
  slider.value = value; slider.dispatchEvent(new Event("input"));
  const look = () => {
    const head = studio.head;
    if (head.rest && Math.abs(100 * Object.values(head.asked)[0] / Math.PI - value) < 0.3)
      requestAnimationFrame(() => done(performance.now() - began));
    else setTimeout(look, 1);
  };
  look();
})"""


def sheet(along: int, rows: int) -> LiveSheet:
    """A sector with one crease."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 30.0, 1.5), along=along, rows=rows)
    return of_model(bh.Model(mesh, bh.Sheet(E=3500.0, nu=0.3, t=0.3)))


def session_times(what: LiveSheet, rests: bool) -> tuple[list[float], list[float]]:
    """Seconds of events without a window, and those of the processor, which a busy machine does not change.

    A dragged sheet is in equilibrium with the slider when the next event comes; at rest it is known to be stable, too.
    """
    session, times, spent = Session(what.model), [], []
    for k in range(EVENTS):
        session.fold("all", 0.01 * (k + 1) * np.pi)
        began, cpu = time.perf_counter(), time.process_time()
        frame = session.rest() if rests else session.update(60.0)
        times.append(time.perf_counter() - began)
        spent.append(time.process_time() - cpu)
        if not (frame.arrived and session.imbalance() <= 1e-8):
            raise ArithmeticError(f"event {k} did not end in equilibrium")
    return times[5:], spent[5:]


def window_times(what: LiveSheet) -> list[float]:
    """Seconds from the event to the drawn frame."""
    with served(what) as address, opened() as chromium:
        page = chromium.new_context(viewport={"width": 1400, "height": 820}, bypass_csp=True).new_page()
        page.goto(address)
        page.wait_for_function("window.studio?.head", timeout=60_000)
        times = [1e-3 * page.evaluate(EVENT, 1.0 * (k + 1)) for k in range(EVENTS)]
    return times[5:]


def main(words: Sequence[str] | None = None) -> None:
    """Print a line a size."""
    parser = with_option(argparse.ArgumentParser(description=__doc__.splitlines()[0]), "studio")
    parser.add_argument("sizes", nargs="*", type=int, default=range(1, len(CELLS) + 1), metavar="1 to 3")
    parser.add_argument("--session", action="store_true", help="leave the window out")
    given = parser.parse_args(words)
    found = Measured("studio", "Events of a slider", words)
    for number in given.sizes:
        what = sheet(*CELLS[number - 1])
        size = Session(what.model).size
        kinds = []
        for rests, name in ((False, "session, dragged"), (True, "session, at rest after each event")):
            times, spent = session_times(what, rests)
            kinds += [(name, times), (f"{name}, of the processor", spent)]
        if not given.session:
            kinds.append(("window", window_times(what)))
        for name, measured in kinds:
            middle, most = 1e3 * np.percentile(measured, [50, 95])
            say(f"{size:,} unknowns, {name}: median {middle:.0f} ms, 95th percentile {most:.0f} ms")
            params: Params = {"unknowns": size, "of": name}
            found.spread("time of an event", [1e3 * each for each in measured], "ms", params, size)
    found.write(given.record)


if __name__ == "__main__":
    main()
