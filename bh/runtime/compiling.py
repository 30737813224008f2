"""The first run on a computer compiles kernels: say so, once, and only where it really happens."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from bh.runtime.progress import ProgressMeter, note

_log = logging.getLogger(__name__)
WORDS = "compiling {} for this computer (numba): it happens once and takes some seconds; later runs load what is kept"
_PARTS = {
    "bh.mechanics.bars_and_hinges": "bars and hinges",
    "bh.mechanics.consistent": "the consistent formulation",
    "bh.mechanics": "the elements",
    "bh.solvers": "the solver",
    "bh.analysis": "the analyses",
    "fem": "the shell",
}  # what a kernel belongs to, by its module; the first that fits
_told = False


@contextmanager
def compilation_told(report: ProgressMeter) -> Iterator[None]:
    """Inside, a meter with a method `note` is told when a first kernel is compiled; so is the log (level INFO).

    Kernels that are loaded from the cache are no reason to say anything. It is said once a process.

    Args:
        report: of the run.
    """
    if _told:
        yield
        return

    def tell(module: str) -> None:
        global _told
        if not _told:
            _told = True
            words = WORDS.format(_part(module))
            _log.info(words)
            note(report, words)

    with compilations_heard(tell):
        yield


@contextmanager
def compilations_heard(heard: Callable[[str], None]) -> Iterator[None]:
    """Inside, `heard` is called with the module of each kernel that is compiled, when that begins.

    Args:
        heard: is called.
    """
    from numba.core import event

    class Listener(event.Listener):  # type: ignore[misc]
        def on_start(self, event: Any) -> None:
            heard(str(event.data["dispatcher"].py_func.__module__))

        def on_end(self, event: Any) -> None:
            """Nothing to say."""

    with event.install_listener("numba:compile", Listener()):
        yield


def _part(module: str) -> str:
    """What a module's kernels are for."""
    for prefix, words in _PARTS.items():
        if module.startswith(prefix):
            return f"kernels of {words}, then what else the scene needs,"
    return f"kernels ({module})"
