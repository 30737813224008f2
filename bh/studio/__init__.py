"""A window in which a sheet is folded, pulled and read while it is handled: `bh studio`, `bh.studio.open_window`.

The physics is `bh.live`; the server speaks to a browser on the same machine and to nobody else.
"""

from bh.studio.server import open_window
from bh.studio.sheets import of_file, of_library, of_model

__all__ = ["of_file", "of_library", "of_model", "open_window"]
