"""The server of the window: this machine only, a token in the address, a desk for every window."""

from __future__ import annotations

import asyncio
import contextlib
import json
import secrets
import threading
import time
from collections.abc import Callable, Coroutine, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from urllib.parse import urlsplit

import tornado.web
import tornado.websocket
from tornado.httpserver import HTTPServer
from tornado.websocket import WebSocketClosedError

from bh.errors import InputError
from bh.runtime.memory import give_back
from bh.runtime.terminal import say
from bh.studio.desk import Desk
from bh.studio.door import HOST, Door
from bh.studio.messages import read
from bh.studio.sheets import LONGEST, LiveSheet

STATIC = Path(__file__).with_name("static")
LONGEST_MESSAGE = LONGEST * 4 // 3 + 4096  # bytes of a file in base64, and its name
LONGEST_REQUEST = 65_536  # bytes of a request's body; no page takes one
MOVES = ["fold", "percent", "pull", "pinch"]  # of which only the last counts
WINDOWS = 8  # at once
QUIET = 0.4  # s without a wish before a finer mesh is begun
LINGERS = 1.0  # s behind the end of a window, after which its memory goes back
CALM = 0.1  # s without a word of the browser before the stability of what was reached is counted
TELLS = 0.3  # s, after which a window is told that the way takes longer
POLICY = (
    "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; connect-src 'self' ws:"
)
HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}


class Studio:
    """What all windows of a server share.

    Attributes:
        token: that an address must have.
        sheet: that a new window begins with; None for a pattern of the library.
        windows: that are open.
        tasks: of all windows that are at work, also of those that were just closed.
    """

    def __init__(self, sheet: LiveSheet | None = None) -> None:
        """A new token."""
        self.token = secrets.token_urlsafe(16)
        self.sheet = sheet
        self._first: Future[Desk] | None = None  # of the window that is waited for
        self.windows: dict[Window, None] = {}  # in the order in which they were opened
        self.tasks: set[asyncio.Task[None]] = set()
        self.pool = ThreadPoolExecutor(2 * WINDOWS, thread_name_prefix="bh-studio")

    def application(self) -> tornado.web.Application:
        """The pages and the socket."""
        shared = {"studio": self}
        return tornado.web.Application(
            [
                (r"/", Page, shared),
                (r"/socket", Window, shared),
                (r"/static/(.*)", Static, {"path": str(STATIC)}),
            ],
            websocket_max_message_size=LONGEST_MESSAGE,
        )

    def serve(self, port: int = 0, door: Door | None = None) -> tuple[HTTPServer, str]:
        """Listen on this machine.

        Args:
            port: 0 for a free one.
            door: that is open already, whose token is taken; None for a new one.

        Returns:
            the server and the address with its token.

        Raises:
            InputError: the port is taken.
        """
        door = door or Door.opened(port, self.token)
        self.token = door.token
        server = HTTPServer(self.application(), max_body_size=LONGEST_REQUEST)
        server.add_sockets(door.sockets)
        return server, door.address

    def prepare(self) -> None:
        """Begin with the desk of the first window before it is there: its browser has to start besides."""
        self._first = self.pool.submit(Desk, self.sheet)

    def desk(self) -> Desk:
        """A desk for a window.

        Raises:
            InputError: the sheet cannot be handled.
        """
        first, self._first = self._first, None
        return Desk(self.sheet) if first is None else first.result()

    async def close(self, server: HTTPServer) -> None:
        """End the server, its windows and their work, which is waited for.

        Args:
            server: of `serve`.
        """
        server.stop()
        for window in list(self.windows):
            window.close()
            window.on_close()
        await server.close_all_connections()
        await asyncio.gather(*self.tasks, return_exceptions=True)
        self.pool.shutdown(wait=False, cancel_futures=True)


class Page(tornado.web.RequestHandler):
    """The page itself, for who has the token."""

    def initialize(self, studio: Studio) -> None:
        """What is shared."""
        self.studio = studio

    def set_default_headers(self) -> None:
        """Nothing from elsewhere, nothing kept."""
        for name, value in HEADERS.items():
            self.set_header(name, value)

    def get(self) -> None:
        """The page."""
        if not allowed(self.request, self.get_query_argument("token", ""), self.studio.token):
            raise tornado.web.HTTPError(403)
        self.set_header("Content-Type", "text/html; charset=utf-8")
        self.write((STATIC / "index.html").read_bytes())


class Static(tornado.web.StaticFileHandler):
    """Scripts and styles of the page."""

    def set_default_headers(self) -> None:
        """As the page's own."""
        for name, value in HEADERS.items():
            self.set_header(name, value)


class Window(tornado.websocket.WebSocketHandler):
    """One window: messages in, frames out, one at a time; its desk goes when it is closed."""

    def initialize(self, studio: Studio) -> None:
        """What is shared."""
        self.studio = studio
        self.desk: Desk | None = None
        self.queue: asyncio.Queue[str | bytes] = asyncio.Queue()
        self.drawn = True  # the last frame
        self.stirred = asyncio.Event()  # the browser has said something
        self.sent = self.spoken = 0.0  # s, when the last frame was, and when the browser said something
        self.since = 0.0  # s, when the wish that the window was told nothing of was heard
        self.tasks: set[asyncio.Task[None]] = set()
        self.heard = 0  # messages
        self.taken = 0  # of them, and how many the last frame knew of
        self.told = 0
        self.going = threading.Event()  # nobody has asked for anything since the finer mesh was begun

    def check_origin(self, origin: str) -> bool:
        """Only this server's own page."""
        return urlsplit(origin).netloc == self.request.host

    async def get(self, *args: str, **kwargs: str) -> None:
        """Refuse who has no token, or one window too many, before the socket is opened."""
        if not allowed(self.request, self.get_query_argument("token", ""), self.studio.token):
            raise tornado.web.HTTPError(403)
        if len(self.studio.windows) >= WINDOWS:
            raise tornado.web.HTTPError(503)
        await super().get(*args, **kwargs)

    def open(self, *args: str, **kwargs: str) -> None:  # noqa: ARG002 - Tornado's own arguments
        """Begin to work.

        Args:
            args: of the address; there are none.
            kwargs: none.
        """
        self.studio.windows[self] = None
        self.set_nodelay(True)
        self._begin(self._work())

    def on_message(self, message: str | bytes) -> None:
        """A frame was drawn, or something is asked."""
        if message == "drawn":
            self.drawn = True
        else:
            self.heard += 1
            self.going.clear()
            self.queue.put_nowait(message)
        self.spoken = time.monotonic()
        self.stirred.set()

    def on_close(self) -> None:
        """Give everything back."""
        self.studio.windows.pop(self, None)
        self.going.clear()
        for task in self.tasks:
            task.cancel()
        self.desk = None
        # a thread may be in the middle of an iteration, and holds the desk until that ends
        asyncio.get_running_loop().call_later(LINGERS, give_back)

    def _begin(self, work: Coroutine[None, None, None]) -> None:
        """A task that ends with the window, and that the server waits for when it ends."""

        async def told() -> None:
            with contextlib.suppress(WebSocketClosedError):  # nobody is there to be told
                await work

        task = asyncio.create_task(told())
        for known in (self.tasks, self.studio.tasks):
            known.add(task)
            task.add_done_callback(known.discard)

    async def _work(self) -> None:
        run, pool = asyncio.get_running_loop().run_in_executor, self.studio.pool
        try:
            desk = await run(pool, self.studio.desk)
        except Exception as error:
            await self._say(_told(error, "another one is there"))
            desk = await run(pool, Desk)
        self.desk = desk
        await self._say(desk.describe())
        while True:
            try:
                await self._next(desk)
            except WebSocketClosedError:
                raise
            except Exception as error:  # a sheet that breaks takes its session down, not the server
                await self._say(_told(error, "the sheet begins anew"))
                await run(pool, desk.anew)
                await self._say(desk.describe())

    async def _next(self, desk: Desk) -> None:
        """What is due: to show, to hear, to solve, or to wait. No wish waits for what only tells more of a state."""
        if self.drawn and self._due(desk):  # first, or wishes that keep coming would keep it from being shown
            await self._show(desk)
        elif not self.queue.empty():
            await self._hear(desk)
        elif desk.moving:  # it is solved as fast as it goes, and shown as fast as the browser draws
            await self._solve(desk)
        elif self._due(desk):
            await self._stir()
        elif desk.busy:  # the sheet has arrived and is shown: what is left is to look whether it is stable
            left = CALM - (time.monotonic() - max(self.sent, self.spoken))
            await (self._stir(left) if left > 0.0 else self._solve(desk))
        else:
            self.going = threading.Event()  # its own, so that one that was ended stays so
            self.going.set()
            self._begin(self._refine(desk, self.going))
            while self.queue.empty():
                await self._stir()

    async def _stir(self, most: float | None = None) -> None:
        """Wait until the browser says something, for `most` s at the longest."""
        self.stirred.clear()
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self.stirred.wait(), most)

    async def _hear(self, desk: Desk) -> None:
        """Do what was asked meanwhile."""
        if self.told == self.taken:
            self.since = time.monotonic()
        waiting = []
        while not self.queue.empty():
            waiting.append(self.queue.get_nowait())
        left = newest(waiting)
        while left:
            await self._do(
                desk, left.pop(0), lambda: not left and self.queue.empty() and self.desk is not None
            )
        self.taken += len(waiting)

    def _due(self, desk: Desk) -> bool:
        """Whether there is something that the window does not show yet."""
        if desk.stale:
            return False  # the frame answers what was asked before
        if not desk.moving:
            return desk.untold or self.told != self.taken
        return desk.fresh or (self.told != self.taken and time.monotonic() - self.since > TELLS)

    async def _solve(self, desk: Desk) -> None:
        """Work for a while."""
        await asyncio.get_running_loop().run_in_executor(self.studio.pool, desk.work)
        for answer in desk.news():
            await self._say(answer)

    async def _show(self, desk: Desk) -> None:
        """Send the newest frame."""
        self.told = self.taken
        frame = await asyncio.get_running_loop().run_in_executor(
            self.studio.pool, desk.picture, self.told, desk.fresh
        )
        self.drawn, self.sent = False, time.monotonic()
        await self.write_message(frame, binary=True)

    async def _refine(self, desk: Desk, going: threading.Event) -> None:
        """After a while without a wish, the same state on a finer mesh."""
        heard = self.heard
        await asyncio.sleep(QUIET)
        if not going.is_set():
            return
        run = asyncio.get_running_loop().run_in_executor
        try:
            found = await run(self.studio.pool, desk.finer, going.is_set, heard)
        except Exception as error:
            if going.is_set():
                await self._say({"kind": "line", "text": f"no finer mesh ({type(error).__name__}: {error})"})
            return
        if not going.is_set():
            return
        if found is not None:
            await self.write_message(found, binary=True)
        try:
            flat = await run(self.studio.pool, desk.from_flat, going.is_set)
            told = flat.message() if flat is not None else None
        except Exception as error:
            told = {"kind": "line", "text": f"no run from flat ({type(error).__name__}: {error})"}
        if told is not None and going.is_set():
            await self._say(told)

    async def _do(self, desk: Desk, message: str | bytes, alone: Callable[[], bool]) -> None:
        """One message, answered; the last good state is kept where it cannot be done."""
        asked: list[str] = []

        def work() -> list[dict[str, object]]:
            wish = read(message)
            asked.append(wish.do)
            return desk.take(wish, alone)

        try:
            answers = await asyncio.get_running_loop().run_in_executor(self.studio.pool, work)
        except Exception as error:
            answers = [_told(error, "the sheet stays as it was")]
        for answer in answers:  # the page knows by it what has made its sheet, to ask for it again
            await self._say({**answer, "of": asked[0] if asked else ""})

    async def _say(self, answer: dict[str, object]) -> None:
        await self.write_message(json.dumps(answer))


def allowed(request: tornado.httputil.HTTPServerRequest, token: str, wanted: str) -> bool:
    """Whether a request comes by the address of this machine, with the token.

    Args:
        request: with its host.
        token: that it has.
        wanted: that it should have.
    """
    host = request.host.rsplit(":", 1)[0]
    return host in (HOST, "localhost") and secrets.compare_digest(token.encode(), wanted.encode())


def newest(waiting: Sequence[str | bytes]) -> list[str | bytes]:
    """Messages that are worth doing: of moves of the same slider or point with nothing else between only the last.

    Args:
        waiting: in the order in which they came.

    Returns:
        the others left out, in the same order.
    """
    kept: list[str | bytes] = []
    later: set[tuple[object, ...]] = set()  # what is moved again before anything else is asked
    for message in reversed(waiting):
        subject = _subject(message)
        if subject is None:
            later.clear()
        elif subject in later:
            continue
        else:
            later.add(subject)
        kept.append(message)
    return kept[::-1]


def _subject(message: str | bytes) -> tuple[object, ...] | None:
    """What a message moves, where a later one of the same makes it useless."""
    try:
        data = json.loads(message)
    except (ValueError, RecursionError):
        return None
    if not isinstance(data, dict) or data.get("do") not in MOVES:
        return None
    return str(data["do"]), *(repr(data.get(key)) for key in ("crease", "node", "a", "b"))


def _told(error: Exception, then: str) -> dict[str, object]:
    """A line for what was refused, or for a fault of the program and what becomes of the sheet."""
    text = str(error)
    if not isinstance(error, InputError):
        text = f"a fault of the program ({type(error).__name__}: {text}); {then}"
    return {"kind": "line", "text": " ".join(text.split()), "bad": True}


def open_window(
    sheet: LiveSheet | None = None, port: int = 0, browser: bool = True, door: Door | None = None
) -> None:
    """Serve the window until it is interrupted.

    Args:
        sheet: that it begins with; None for a pattern of the library.
        port: 0 for a free one.
        browser: open it in the browser of this machine.
        door: that is open already; None for a new one.

    Raises:
        InputError: the port is taken.
    """
    door = door or Door.opened(port)
    if browser:
        door.show()

    async def run() -> None:
        studio = Studio(sheet)
        studio.prepare()
        server, address = studio.serve(door=door)
        say(f"the window is at {address} (Ctrl-C ends it)")
        try:
            await asyncio.Event().wait()
        finally:
            await studio.close(server)

    asyncio.run(run())
