"""The window in a browser, for tests: a server in a thread of its own, and a page that looks at it."""

from __future__ import annotations

import asyncio
import base64
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from bh.studio.server import Studio
from bh.studio.sheets import LiveSheet

PATIENCE = 90_000  # ms; a film is drawn by software beside other tests
DROP = """([name, data]) => {
  const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0)), carried = new DataTransfer();
  carried.items.add(new File([bytes], name));
  document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: carried, bubbles: true, cancelable: true }));
}"""


@contextmanager
def served(sheet: LiveSheet | None = None) -> Iterator[str]:
    """A server in a thread of its own, whose windows begin with a sheet; its address."""
    found: list[str] = []
    ready, loop = threading.Event(), asyncio.new_event_loop()

    async def serve() -> None:
        studio = Studio(sheet)
        site, where = studio.serve()
        found.append(where)
        ready.set()
        try:
            await asyncio.Event().wait()
        finally:
            await studio.close(site)

    def run() -> None:
        asyncio.set_event_loop(loop)
        tasks.append(loop.create_task(serve()))
        try:
            loop.run_until_complete(tasks[0])
        except asyncio.CancelledError:
            loop.close()

    tasks: list[asyncio.Task[None]] = []
    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    assert ready.wait(10.0)
    try:
        yield found[0]
    finally:
        loop.call_soon_threadsafe(tasks[0].cancel)
        thread.join(10.0)


class Visit:
    """A window that is open, and what the browser had to say."""

    def __init__(self, chromium: Any, address: str, width: int = 1400, **options: Any) -> None:
        """Open it, and wait for the sheet; `bypass_csp` lets the test look into the page."""
        self.context = chromium.new_context(
            viewport={"width": width, "height": 820}, bypass_csp=True, accept_downloads=True, **options
        )
        self.page = self.context.new_page()
        self.page.set_default_timeout(PATIENCE)
        self.told: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda message: self.told.append(f"{message.type}: {message.text}"))
        self.page.on("pageerror", lambda error: self.told.append(f"error: {error}"))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.finer = 0  # finer meshes that came
        self.page.on("websocket", lambda socket: socket.on("framereceived", self._heard))
        self.page.goto(address)
        self.page.wait_for_function("window.studio?.head")

    def _heard(self, frame: str | bytes) -> None:
        self.finer += isinstance(frame, bytes) and b'"mesh": {' in frame[:500]

    def rests(self, condition: str = "true") -> None:
        """Wait until the sheet is in equilibrium with all that was asked, and a condition on `head` holds."""
        try:
            self.page.wait_for_function(
                f"""(() => {{
                  const head = studio.head;
                  if (head?.note) throw new Error(`cannot go on: ${{head.note}}`);
                  return studio.rest && ({condition});
                }})()"""
            )
        except Exception as error:
            seen = self.page.evaluate(
                "[document.getElementById('badge').textContent, message.textContent, JSON.stringify(studio.head)]"
            )
            raise AssertionError(f"{condition}: {str(error).splitlines()[0]}; {seen}; {self.told}") from error

    def points(self) -> np.ndarray[Any, Any]:
        return np.array(self.page.evaluate("Array.from(studio.points)")).reshape(-1, 3)

    def drop(self, file: Path) -> None:
        """Drop a drawing on the page as a hand does, and wait until it lies there."""
        self.page.evaluate(DROP, [file.name, base64.b64encode(file.read_bytes()).decode()])
        self.page.wait_for_function(f"studio.sheet.name === '{file.name}'")
