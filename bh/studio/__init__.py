"""A window in which a sheet is folded, pulled and read while it is handled: `bh studio`, `bh.studio(model)`.

The physics is `bh.live`; the server speaks to a browser on the same machine and to nobody else. The module is called
as a function: `bh.studio(model)` opens the window, in a notebook as a frame (`bh.studio.opening.opened`).
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bh.studio.opening import Opened
    from bh.studio.server import open_window
    from bh.studio.sheets import of_file, of_library, of_model

__all__ = ["Opened", "of_file", "of_library", "of_model", "open_window"]
_HOME = {
    "Opened": "opening",
    "of_file": "sheets",
    "of_library": "sheets",
    "of_model": "sheets",
    "open_window": "server",
}


class _Module(ModuleType):
    """A module that is called; what it offers is loaded when it is asked for: the command opens a browser first."""

    def __call__(self, *args: object, **kwargs: object) -> Opened:
        """Opens a window, as `bh.studio.opening.opened`, whose arguments it takes."""
        window: Opened = import_module(f"{__name__}.opening").opened(*args, **kwargs)
        return window

    def __getattr__(self, name: str) -> object:
        """A name of the table, loaded now."""
        if name not in _HOME:
            raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


sys.modules[__name__].__class__ = _Module
