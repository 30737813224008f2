"""Worker processes that end with their parent, however it ends, and at once where it is interrupted."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from typing import Any, TypeVar

Result = TypeVar("Result")


class Workers(ProcessPoolExecutor):
    """Processes of this machine; left by an exception, they end in the middle of what they do.

    Args:
        count: how many.
    """

    def __init__(self, count: int) -> None:
        """Spawned, not forked: the parent may have threads, and macOS and Windows can do nothing else."""
        super().__init__(count, get_context("spawn"), follow_parent)

    def submit(self, fn: Callable[..., Result], /, *args: Any, **options: Any) -> Future[Result]:
        """Have a process call `fn`; the processes are started here, deaf to interrupts from their first moment.

        Args:
            fn: that can be pickled.
            *args: for it.
            **options: for it, by name.
        """
        with interrupts_wait():
            return super().submit(fn, *args, **options)

    def __exit__(self, kind: type[BaseException] | None, *error: object) -> None:
        """Wait for the processes to end, but not for what they do if the block was left by an exception."""
        self.end() if kind is not None else self.shutdown(wait=True)

    def end(self) -> None:
        """End the processes, also in the middle of a task."""
        for process in list((getattr(self, "_processes", None) or {}).values()):
            process.terminate()
        self.shutdown(wait=True, cancel_futures=True)


def follow_parent() -> None:
    """As a worker: leave interrupts to the parent, and end when that has gone, also if it was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is not None:

        def follow() -> None:
            parent.join()
            os._exit(1)

        threading.Thread(target=follow, daemon=True).start()


@contextmanager
def interrupts_wait() -> Iterator[None]:
    """Ctrl-C goes to a whole group of processes; one that is only starting would print a traceback.

    What is started inside inherits that it waits, and this process hears of it right behind.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
