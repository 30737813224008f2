"""How long `bh studio FILE` takes to the first folded picture: `python -m benchmarks.studio_start examples/wave.svg`.

The command runs in a process of its own, and who asks is a socket in place of a browser, which has to start besides.
The slider goes to 30 % as soon as the sheet is there; the picture is that in equilibrium with it. Seconds of the
processor are those of the command, which a busy machine hardly changes.
"""

from __future__ import annotations

import asyncio
import json
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import tornado.httpclient
import tornado.websocket

from bh.runtime.terminal import say

RUNS = 5
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


def _processor() -> float:
    """Seconds that children have had of the processor."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Print a line a file."""
    for file in sys.argv[1:] or ["examples/wave.svg"]:
        times = np.array([start(file) for _ in range(RUNS)])
        (wall, cpu), (least, _) = np.median(times, axis=0), times.min(axis=0)
        say(f"{file}: median {wall:.1f} s (least {least:.1f} s), {cpu:.1f} s of the processor")


if __name__ == "__main__":
    main()
