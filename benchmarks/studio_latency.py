"""From the slider to the picture: `python -m benchmarks.studio_latency`, better on a quiet machine.

A browser on this machine, without a graphics card, moves the slider "All creases"; the time is that from the slider's
own event until the picture that shows its state is drawn: a pixel of it is read back, which waits for that. "Drag" is
one event behind the other. "Pause" is an event after a second of rest, when the finer mesh is being solved and has to
give way. The state shown is one in equilibrium with what was asked for. Beside it: processor time that the server took
for an event (of all its threads), which a busy machine does not change, and the load of the machine, as `uptime` tells
it.

A browser that finds no graphics card draws WebGL by SwiftShader and composes the page itself: so it is started here.
`--composed` tells it to take SwiftShader for a card, as the tests do, which it then composes the whole page by. Sizes
may be given as numbers 1 to 3; `--record` keeps what was measured. On a busy machine `nice` does not help much:
Chromium sets threads of its own back to 0.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Sequence

import numpy as np

from benchmarks.record import Measured, with_option
from benchmarks.studio import CELLS, sheet
from bh.live import Session
from bh.runtime.terminal import say
from bh.studio.sheets import LiveSheet
from tests.unit.browsers import OPTIONS, PLAIN, opened
from tests.unit.studio_visits import served

EVENTS, FIRST = 45, 5  # of the slider, and how many of them warm up
PAUSES = 12
ASKED = (33, 66, 150)  # ms
WATCH = """async () => {
  const { renderer, whenDrawn } = await import("./static/view.js");
  const gl = renderer.getContext(), pixel = new Uint8Array(4);
  window.drawn = () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  window.done = () => {};
  whenDrawn(() => window.done());
}"""
EVENT = """(value) => new Promise((found) => {
  const slider = document.getElementById("percent"), began = performance.now();
  window.done = () => {
    const { head } = studio;
    if (!head.arrived) return;
    if (Math.abs(100 * Object.values(head.asked)[0] / Math.PI - value) > 0.3) return;
    window.done = () => {}; drawn(); found(performance.now() - began);
  };
  slider.value = value; slider.dispatchEvent(new Event("input", { bubbles: true }));
  slider.dispatchEvent(new Event("change", { bubbles: true }));
})"""


def measured(
    what: LiveSheet, pause: float, options: tuple[str, ...] = PLAIN
) -> tuple[list[float], list[float]]:
    """Milliseconds from the event to the picture, and of the processor for it.

    Args:
        what: the sheet.
        pause: s between two events.
        options: of the browser.
    """
    times, spent = [], []
    with served(what) as address, opened(options) as chromium:
        page = chromium.new_context(viewport={"width": 1400, "height": 820}, bypass_csp=True).new_page()
        page.set_default_timeout(120_000)
        page.goto(address)
        page.wait_for_function("window.studio?.head")
        page.evaluate(WATCH)
        for k in range(FIRST + (PAUSES if pause else EVENTS - FIRST)):
            if pause:
                page.wait_for_timeout(1e3 * pause)
            began = time.process_time()
            times.append(page.evaluate(EVENT, 1.0 * (k + 1)))
            spent.append(1e3 * (time.process_time() - began))
    return times[FIRST:], spent[FIRST:]


def main(words: Sequence[str] | None = None) -> None:
    """Print a line a size and a way of moving."""
    parser = with_option(argparse.ArgumentParser(description=__doc__.splitlines()[0]), "studio_latency")
    parser.add_argument("sizes", nargs="*", type=int, default=range(1, len(CELLS) + 1), metavar="1 to 3")
    parser.add_argument("--composed", action="store_true", help="a browser that takes SwiftShader for a card")
    given = parser.parse_args(words)
    found = Measured("studio_latency", "From the slider to the picture", words)
    for number in given.sizes:
        what, asked = sheet(*CELLS[number - 1]), ASKED[number - 1]
        size = Session(what.model).size
        for name, pause in (("drag", 0.0), ("pause", 1.0)):
            times, spent = measured(what, pause, OPTIONS if given.composed else PLAIN)
            middle, most = np.percentile(times, [50, 95])
            load = os.getloadavg()[0]
            say(
                f"{size:,} unknowns, {name}: median {middle:.0f} ms, 95th percentile {most:.0f} ms, processor "
                f"{np.median(spent):.0f} ms, {len(times)} events ({asked} ms asked); "
                f"load {load:.1f}"
            )
            params = {
                "unknowns": size,
                "moved": name,
                "asked": asked,
                "composed": given.composed,
                "load": load,
            }
            found.spread("time from the slider to the picture", times, "ms", params, size)
            found.spread("processor time of an event", spent, "ms", params, size)
    found.write(given.record)


if __name__ == "__main__":
    main()
