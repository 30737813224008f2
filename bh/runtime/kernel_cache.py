"""A place for compiled kernels where neither the installation nor the home can be written.

numba keeps them beside the source, else in the user's cache folder, and refuses to compile at all where it may write to
neither. Then they go to a private folder for temporary files, which later runs find again.
"""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from pathlib import Path

NAME = "curved-crease-workbench"
KERNELS = (
    "mechanics/shared",
    "mechanics/bars_and_hinges",
    "mechanics/consistent",
    "solvers",
    "analysis",
)  # packages of `bh` with compiled code


def ensure() -> None:
    """Set NUMBA_CACHE_DIR where numba would find no folder to write to. Must run before kernels are defined."""
    here = Path(__file__).parents[1]
    if all(writable(here / package / "__pycache__") for package in KERNELS):
        return
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given and writable(Path(given)):
        return
    home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    folder = Path(home, NAME)
    if not (folder.is_absolute() and writable(folder)):
        folder = _temporary()
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if "numba" in sys.modules:  # it has read the environment already
        sys.modules["numba"].config.CACHE_DIR = str(folder)


def writable(folder: Path) -> bool:
    """Whether files can be made in a folder, which is made if need be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _temporary() -> Path:
    """A folder for temporary files that is ours alone: what is loaded from it is run."""
    folder = Path(tempfile.gettempdir(), f"{NAME}-{getattr(os, 'getuid', lambda: 'user')()}")
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        ours = stat.S_ISDIR(found.st_mode) and getattr(os, "getuid", lambda: found.st_uid)() == found.st_uid
        if ours and not found.st_mode & 0o022 and writable(folder):
            return folder
    except OSError:
        pass
    return Path(tempfile.mkdtemp(prefix=f"{NAME}-"))
