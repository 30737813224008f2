"""The window from Python and from a notebook: served beside what goes on, shown as a frame, and read back."""

from __future__ import annotations

import asyncio
import json
import os
import socket
import subprocess
import sys
import textwrap
import time
import urllib.error
import urllib.request
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tornado.websocket

import bh
from bh.errors import InputError
from bh.studio import door
from bh.studio.door import HOST, Door
from bh.studio.opening import Opened, sheet_of
from bh.studio.sheets import of_library
from tests.unit.test_notebooks import executed

DATA = Path(__file__).resolve().parents[1] / "data"


def test_what_is_seen_is_read_back_and_a_run_repeats_it() -> None:
    called: Any = bh.studio  # a module, for type checkers
    window = called(of_library("strip").model, browser=False, wait=False)
    assert window.model is None
    with pytest.raises(urllib.error.HTTPError, match="403"):
        urllib.request.urlopen(window.address.split("?")[0])
    seen = []

    async def talk() -> None:
        socket = await tornado.websocket.websocket_connect(
            window.address.replace("http", "ws").replace("/?", "/socket?")
        )
        await socket.read_message()
        await socket.write_message(json.dumps({"do": "percent", "value": 30}))
        while not (window.frame and window.frame.at_rest and any(window.frame.wanted.folds.values())):
            if isinstance(await socket.read_message(), bytes):
                await socket.write_message("drawn")
        seen.append((window.frame.points, window.model))
        socket.close()

    asyncio.run(asyncio.wait_for(talk(), 60.0))
    ((points, model),) = seen
    np.testing.assert_allclose(bh.trace(model)[-1].points, points, atol=1e-8)
    window.close()
    window.close()
    assert "closed" in repr(window)
    assert "<iframe" not in window._repr_html_()
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(window.address)


def test_it_is_opened_on_drawings_patterns_and_nothing_else() -> None:
    assert sheet_of(None, "card") is None
    for what, name in ((DATA / "miura.svg", "miura.svg"), ("pleats", "pleats"), (of_library("arc"), "arc")):
        found = sheet_of(what, "card")
        assert found is not None
        assert found.name == name
    odd: Any = 7
    for bad, words in (("no such.svg", "cannot be read"), (odd, "on a int"), ("a\0b.svg", "cannot be read")):
        with pytest.raises(InputError, match=words):
            sheet_of(bad, "card")


def test_a_port_that_is_taken_is_one_line() -> None:
    window = Opened()
    port = int(window.address.split(":")[2].split("/")[0])
    with pytest.raises(InputError, match=f"port {port} cannot be used"):
        Opened(port=port)
    window.close()


@pytest.mark.parametrize("port", [70_000, -1])
def test_a_port_that_there_is_not_is_one_line(port: int) -> None:
    """The system would take 4464 for 70,000."""
    with pytest.raises(InputError, match=f"no port {port}; take one of 0 to 65535"):
        Opened(port=port)


def test_a_script_waits_and_a_closed_window_ends_it(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        textwrap.dedent("""
        import threading, bh
        from bh.studio import opening
        one = opening.Opened
        class Seen(one):
            def __init__(self, *given):
                super().__init__(*given)
                threading.Timer(0.3, self.close).start()
        opening.Opened = Seen
        window = bh.studio("strip", browser=False)
        print("after", repr(window))
        """)
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=60, check=True)
    first, last = done.stdout.splitlines()[0], done.stdout.splitlines()[-1]
    assert "the window is at http://127.0.0.1:" in first
    assert last == "after a window of bh studio that was closed"


def test_a_notebook_shows_the_window_as_a_frame_and_goes_on(tmp_path: Path) -> None:
    """A real kernel: the frame's page answers who has the token, while cells run; its state is read in a cell."""
    nbformat = import_module("nbformat")
    cells = [
        "import bh, meshes, urllib.request\n"
        "mesh = meshes.structured(meshes.annulus_sector(100.0, 25.0, 1.5), along=8, rows=1)\n"
        "window = bh.studio(bh.Model(mesh, bh.Sheet(E=3500.0, nu=0.3, t=0.3)))\nwindow",
        "page = urllib.request.urlopen(window.address).read().decode()\n'bh studio' in page, page.count('<canvas')",
        "window.close()\nwindow",
    ]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text) for text in cells])
    done = executed(nbformat.writes(notebook), tmp_path)
    first, second, third = (cell.outputs[-1]["data"] for cell in done.cells)
    assert first["text/html"].startswith('<iframe src="http://127.0.0.1:')
    assert "token=" in first["text/html"]
    assert second["text/plain"] == "(True, 1)"
    assert "was closed" in third["text/html"]


def test_a_browser_that_came_before_the_program_is_told_why_there_is_no_window(tmp_path: Path) -> None:
    """It starts while the drawing is read; who asks with the token gets the line that the terminal has."""
    drawing, browser, page = (tmp_path / name for name in ("none.svg", "browser.py", "page"))
    drawing.write_text("no drawing")
    browser.write_text(
        textwrap.dedent(f"""
        import sys, urllib.error, urllib.request
        try:
            urllib.request.urlopen(sys.argv[1])
        except urllib.error.HTTPError as error:
            open("{page}.part", "wb").write(error.read())
            import os
            os.rename("{page}.part", "{page}")
        """)
    )
    done = subprocess.run(
        [Path(sys.executable).with_name("bh"), "studio", drawing],
        env={**os.environ, "BROWSER": f"{sys.executable} {browser} %s &"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 2
    for _ in range(200):
        if page.exists():
            break
        time.sleep(0.02)
    told = page.read_text()
    assert told.startswith("bh studio: ")
    assert told.endswith("save the drawing as SVG again")
    assert done.stderr.rstrip().endswith(told.split(": ", 2)[2])


def test_a_door_that_nobody_has_come_to_is_closed_and_tells_nothing_without_the_token(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(door, "PATIENCE", 0.1)
    Door.opened().refuse("nobody hears this")
    one = Door.opened()
    port = one.sockets[0].getsockname()[1]
    with socket.create_connection((HOST, port)) as stranger:
        stranger.sendall(b"GET /?token=guessed HTTP/1.1\r\n\r\n")
        one.refuse("a secret")
        assert stranger.recv(100) == b""
    with pytest.raises(OSError, match="refused"):
        socket.create_connection((HOST, port))
