"""A window in which a sheet is folded, pulled and read while it is handled: `bh studio`, `bh.studio(model)`.

The physics is `bh.live`; the server speaks to a browser on the same machine and to nobody else. The module is called
as a function: `bh.studio(model)` opens the window, in a notebook as a frame (`bh.studio.opening.opened`).
"""

from __future__ import annotations

import sys
from types import ModuleType

from bh.studio.opening import Opened, opened
from bh.studio.server import open_window
from bh.studio.sheets import of_file, of_library, of_model

__all__ = ["Opened", "of_file", "of_library", "of_model", "open_window"]


class _Module(ModuleType):
    """A module that is called."""

    __call__ = staticmethod(opened)


sys.modules[__name__].__class__ = _Module
