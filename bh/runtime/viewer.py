"""How `path.plot()` shows a path: paths know nothing of pictures, the facade of `bh` says who shows them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Viewer = Callable[..., Any]
_viewers: list[Viewer] = []


def use(viewer: Viewer) -> None:
    """Take a function of a path and options as what shows it."""
    _viewers[:] = [viewer]


def show(path: object, **options: Any) -> Any:
    """Show a path, by what `use` was given last.

    Args:
        path: that is shown.
        **options: for the viewer.

    Raises:
        LookupError: there is no viewer.
    """
    if not _viewers:
        raise LookupError("nothing shows paths here; import bh, or call bh.runtime.viewer.use")
    return _viewers[0](path, **options)
