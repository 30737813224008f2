"""The address of a server that is not there yet: the browser starts while the program is still being read.

Connections wait in the queue of the socket until the server takes it over, or until they are told why there is none.
"""

from __future__ import annotations

import contextlib
import secrets
import selectors
import socket
import threading
import time
import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass

from bh.errors import InputError

HOST = "127.0.0.1"
QUEUE = 128  # connections
LAST_PORT = 65535
PATIENCE = 3.0  # s that a browser has to ask, before the program ends without a window
LONGEST = 65_536  # bytes of a request that is not served


@dataclass(frozen=True)
class Door:
    """Sockets that listen on this machine, and the token that lets in.

    Attributes:
        sockets: that listen.
        token: part of the address.
    """

    sockets: Sequence[socket.socket]
    token: str

    @classmethod
    def opened(cls, port: int = 0, token: str | None = None) -> Door:
        """Listen on this machine.

        Args:
            port: 0 for a free one.
            token: None for a new one.

        Raises:
            InputError: the port is taken, or there is none such.
        """
        from tornado.netutil import bind_sockets

        if not 0 <= port <= LAST_PORT:  # the system would take what is left of it after a division
            raise InputError(f"there is no port {port}; take one of 0 to {LAST_PORT}, 0 for a free one")
        try:
            sockets = bind_sockets(port, address=HOST, backlog=QUEUE)
        except OSError as error:
            raise InputError(
                f"port {port} cannot be used ({error.strerror}); leave --port out for a free one"
            ) from error
        return cls(sockets, token or secrets.token_urlsafe(16))

    @property
    def address(self) -> str:
        """Of the page, with the token."""
        return f"http://{HOST}:{self.sockets[0].getsockname()[1]}/?token={self.token}"

    def show(self) -> None:
        """Open the page in the browser of this machine, which may be slow to start: nobody waits for it here."""
        threading.Thread(target=webbrowser.open, args=(self.address,), daemon=True).start()

    def refuse(self, why: str) -> None:
        """Tell the browser that waits why there is no window, and close.

        Args:
            why: a line.
        """
        body = why.encode()
        head = (
            "HTTP/1.1 503 Service Unavailable\r\nContent-Type: text/plain; charset=utf-8\r\n"
            f"Content-Length: {len(body)}\r\nX-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n"
        )
        ends = time.monotonic() + PATIENCE
        with selectors.DefaultSelector() as waiting, contextlib.ExitStack() as opened:
            for each in self.sockets:
                opened.enter_context(each)
                waiting.register(each, selectors.EVENT_READ)
            while (left := ends - time.monotonic()) > 0.0:
                for key, _ in waiting.select(left):
                    found = key.fileobj
                    assert isinstance(found, socket.socket)
                    try:
                        if found in self.sockets:  # a browser may open more connections than it asks by
                            waiting.register(opened.enter_context(found.accept()[0]), selectors.EVENT_READ)
                            continue
                        waiting.unregister(found)
                        found.settimeout(PATIENCE)
                        if f"token={self.token} ".encode() in found.recv(LONGEST).split(b"\r\n")[0]:
                            found.sendall(head.encode() + body)
                            return
                    except OSError:  # it has gone again
                        continue
