"""The window opened from Python or a notebook: a server in a thread of its own, and what is seen in it."""

from __future__ import annotations

import asyncio
import html
import sys
import threading
import webbrowser
from pathlib import Path

from bh.errors import InputError
from bh.live import Frame
from bh.model.model import Model
from bh.runtime.terminal import say
from bh.studio.desk import Desk
from bh.studio.scene_sheets import SCENE, of_scene
from bh.studio.server import Studio
from bh.studio.sheets import LIBRARY, LONGEST, LiveSheet, of_file, of_library, of_model

HEIGHT = 760  # pixels of the frame in a notebook


class Opened:
    """A window on a sheet; in a notebook it shows itself, in a frame.

    Attributes:
        address: of the window, on this machine; its token is good for as long as the server runs.
    """

    def __init__(self, sheet: LiveSheet | None = None, port: int = 0) -> None:
        """Serve it in a thread of its own.

        Args:
            sheet: that every window begins with; None for a pattern of the library.
            port: 0 for a free one.

        Raises:
            InputError: the port is taken.
        """
        self.address = ""
        self._studio = Studio(sheet)
        self._loop = asyncio.new_event_loop()
        self._stop = asyncio.Event()
        self._failed: InputError | None = None
        ready = threading.Event()
        self._thread = threading.Thread(target=self._serve, args=(port, ready), daemon=True)
        self._thread.start()
        ready.wait()
        if self._failed is not None:
            raise self._failed

    @property
    def frame(self) -> Frame | None:
        """The newest equilibrium of the window that was opened last; None while none is open."""
        desk = self._desk
        return None if desk is None else desk.frame

    @property
    def model(self) -> Model | None:
        """The model whose steps lead to what is asked in that window, for `bh.trace`; None while none is open."""
        desk = self._desk
        return None if desk is None else desk.session.scene()

    @property
    def _desk(self) -> Desk | None:
        desks = [window.desk for window in self._studio.windows if window.desk is not None]
        return desks[-1] if desks else None

    def close(self) -> None:
        """End the server and all of its windows; a second time does nothing."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join()

    def wait(self) -> None:
        """Until it is closed, or Ctrl-C ends it."""
        try:
            while self._thread.is_alive():
                self._thread.join(0.5)
        except KeyboardInterrupt:
            self.close()

    def _serve(self, port: int, ready: threading.Event) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._until_stopped(port, ready))
        finally:
            ready.set()
            self._loop.close()

    async def _until_stopped(self, port: int, ready: threading.Event) -> None:
        try:
            server, self.address = self._studio.serve(port)
        except InputError as error:
            self._failed = error
            return
        ready.set()
        await self._stop.wait()
        await self._studio.close(server)

    def _repr_html_(self) -> str:
        """The frame that a notebook shows."""
        if not self._thread.is_alive():
            return "<p>This window was closed; open it again by <code>bh.studio(...)</code>.</p>"
        return (
            f'<iframe src="{html.escape(self.address)}" title="bh studio" '
            f'style="width: 100%; height: {HEIGHT}px; border: 0"></iframe>'
        )

    def __repr__(self) -> str:
        """One line: "a window of bh studio at http://127.0.0.1:..."."""
        state = f"at {self.address}" if self._thread.is_alive() else "that was closed"
        return f"a window of bh studio {state}"


def opened(
    what: Model | LiveSheet | Path | str | None = None,
    *,
    material: str = "card",
    port: int = 0,
    browser: bool | None = None,
    wait: bool | None = None,
) -> Opened:
    """Open the window on a sheet: `bh.studio(model)`.

    Args:
        what: a model or a scene, whose steps are left out; a drawing; the name of a pattern of the library; None for
            one of them.
        material: of a drawing or pattern, one of those of `bh fold`.
        port: of this machine; 0 for a free one.
        browser: open it in the browser of this machine; None for yes, but in a notebook, which shows the window itself.
        wait: until it is closed by Ctrl-C; None for yes in a script, which would end, and no where somebody types.

    Returns:
        the window; `model` and `frame` say what is seen in it, `close` ends it.

    Raises:
        InputError: the drawing cannot be read or meshed, there is no such pattern, or the port is taken.
    """
    from bh.plotting.notebook import in_notebook

    shown = in_notebook()
    typed = shown or hasattr(sys, "ps1") or bool(sys.flags.interactive)
    window = Opened(sheet_of(what, material), port)
    if not shown:
        say(f"the window is at {window.address}{'' if typed else ' (Ctrl-C ends it)'}")
    if (not shown) if browser is None else browser:
        webbrowser.open(window.address)
    if (not typed) if wait is None else wait:
        window.wait()
    return window


def sheet_of(what: Model | LiveSheet | Path | str | None, material: str) -> LiveSheet | None:
    """The sheet for the window.

    Args:
        what: as of `opened`.
        material: of a drawing or pattern.

    Raises:
        InputError: it is none of these, or the file cannot be read or meshed.
    """
    if what is None:
        return None if material == "card" else of_library(next(iter(LIBRARY)), material)
    if isinstance(what, LiveSheet):
        return what
    if isinstance(what, Model):
        return of_model(what)
    if not isinstance(what, str | Path):
        raise InputError(
            f"a window cannot be opened on a {type(what).__name__}; give a bh.Model, a drawing, or one of "
            f"{', '.join(LIBRARY)}"
        )
    if str(what) in LIBRARY and not Path(what).exists():
        return of_library(str(what), material)
    if Path(what).suffix.lower() == SCENE:
        return of_scene(Path(what))
    return of_file(str(what), read_drawing(what), material)


def read_drawing(file: Path | str) -> bytes:
    """The bytes of a drawing, a little more than the longest at most.

    Args:
        file: its path.

    Raises:
        InputError: it cannot be read.
    """
    try:
        with Path(file).open("rb") as stream:
            return stream.read(LONGEST + 1)
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(
            f"'{file}' cannot be read ({why}); give a drawing, or one of {', '.join(LIBRARY)}"
        ) from error
