"""How long `bh studio FILE` takes to the first folded picture: `python -m benchmarks.studio_start examples/wave.svg`.

The command runs in a process of its own, and who asks is a socket in place of a browser, which has to start besides.
The slider goes to 30 % as soon as the sheet is there; the picture is that in equilibrium with it. Seconds of the
processor are those of the command, which a busy machine hardly changes.

With `--browser` another start is measured besides: the command opens the browser of this machine itself, in a new
profile and without a graphics card, and the picture is one that was drawn in its page; the processor's seconds are
those of both then. The page's times, counted from its first byte, are told besides: sheet, and flat and folded picture.
`--record` keeps what was measured.
"""

from __future__ import annotations

import argparse
import asyncio
import importlib
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import tornado.httpclient
import tornado.websocket

from benchmarks.record import Measured, with_option
from bh.runtime.terminal import say
from tests.unit.browsers import OPTIONS, PROGRAM

RUNS = 5
PATIENCE = 60.0  # s
BH = Path(sys.executable).with_name("bh")
PERCENT = 30.0


async def folded(address: str) -> None:
    """Ask for the fold, and wait for its picture.

    Args:
        address: of the window, with its token.
    """
    socket = await tornado.websocket.websocket_connect(
        tornado.httpclient.HTTPRequest(
            address.replace("http:", "ws:").replace("/?", "/socket?"),
            headers={"Origin": address.split("/?")[0]},
        )
    )
    await socket.write_message(json.dumps({"do": "percent", "value": PERCENT}))
    while (message := await socket.read_message()) is not None:
        if isinstance(message, bytes):
            head = json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])
            await socket.write_message("drawn")
            if head["kind"] == "frame" and any(head["asked"].values()) and head["rest"]:
                socket.close()
                return
    raise ConnectionError("the window has closed")


def start(file: str) -> tuple[float, float]:
    """Seconds from the command to the folded picture, and those of the processor.

    Args:
        file: a drawing, or a pattern of the library.
    """
    began, before = time.perf_counter(), _processor()
    command = [str(BH), "studio", file, "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            asyncio.run(folded(process.stdout.readline().split()[4]))
            wall = time.perf_counter() - began
        finally:
            process.kill()
    return wall, _processor() - before


FOLDS = """() => {
  const s = window.studio;
  if (!s?.head) return null;
  window.times ??= { sheet: performance.now() };
  const slider = document.getElementById("percent");
  if (slider.value === "0") {
    slider.value = PERCENT; slider.dispatchEvent(new Event("input", { bubbles: true }));
  }
  if (s.rest && Object.values(s.head.asked).some((angle) => angle !== 0)) {
    return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now()))));
  }
  return null;
}""".replace("PERCENT", str(PERCENT))


def seen(file: str) -> tuple[float, float]:
    """Seconds from the command to the folded picture in a browser that it opens, and those of the processor of both.

    Args:
        file: a drawing, or a pattern of the library.
    """
    from playwright.sync_api import Error, sync_playwright

    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile, sync_playwright() as driver:
        words = [
            *(str(PROGRAM), *OPTIONS, "--no-sandbox", "--headless=new", "--no-first-run"),
            *("--remote-debugging-port=0", f"--user-data-dir={profile}", "%s", "&"),
        ]
        port = Path(profile, "DevToolsActivePort")
        began = time.perf_counter()
        process = subprocess.Popen(
            [str(BH), "studio", file],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "BROWSER": " ".join(words)},
        )
        try:
            while not (port.exists() and port.read_text()):
                time.sleep(0.01)
            chromium = driver.chromium.connect_over_cdp(f"http://127.0.0.1:{port.read_text().split()[0]}")
            page = chromium.contexts[0].pages[0]
            drawn = None
            while drawn is None:
                if time.perf_counter() - began > PATIENCE:
                    raise TimeoutError(f"there is no folded picture of '{file}' after {PATIENCE:.0f} s")
                try:
                    drawn = page.evaluate(FOLDS)
                except Error:  # the page is not there yet
                    time.sleep(0.01)
            wall = time.perf_counter() - began
            say(
                f"the page had the sheet at {page.evaluate('times.sheet'):.0f} ms, its picture at {drawn:.0f} ms"
            )
            me = importlib.import_module("psutil").Process(process.pid)  # it has no types
            spent = sum(sum(each.cpu_times()[:2]) for each in (me, *me.children(recursive=True)))
            chromium.new_browser_cdp_session().send("Browser.close")
        finally:
            process.kill()
            process.wait()
    return wall, spent


def _processor() -> float:
    """Seconds that children have had of the processor."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main(words: Sequence[str] | None = None) -> None:
    """Print a line a file."""
    parser = with_option(argparse.ArgumentParser(description=__doc__.splitlines()[0]), "studio_start")
    parser.add_argument("files", nargs="*", default=["examples/wave.svg"])
    parser.add_argument("--browser", action="store_true", help="besides, open one and look at its page")
    given = parser.parse_args(words)
    found = Measured("studio_start", "From the command to the first folded picture", words)
    for file in given.files:
        for way, asked in (("socket", start), ("browser", seen))[: 1 + given.browser]:
            times = np.array([asked(file) for _ in range(RUNS)])
            (wall, cpu), (least, _) = np.median(times, axis=0), times.min(axis=0)
            say(f"{file}, {way}: median {wall:.1f} s (least {least:.1f} s), {cpu:.1f} s of the processor")
            params = {"file": file, "by": way}
            found.spread("time from the command to the folded picture", times[:, 0].tolist(), "s", params)
            found.spread("processor time of the start", times[:, 1].tolist(), "s", params)
    found.write(given.record)


if __name__ == "__main__":
    main()
