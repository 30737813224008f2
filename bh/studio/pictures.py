"""What a window has of the frames of its desk, so that it is sent nothing twice."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bh.live import Frame
from bh.studio.colours import Colour, top_of
from bh.studio.frames import Json, head_of, packed


class Pictures:
    """Frames as they travel: with positions where the window lacks them, else numbers alone."""

    def __init__(self) -> None:
        """The window has nothing."""
        self._points: NDArray[np.float64] | None = None
        self._colour: Colour | None = None
        self._told: tuple[object, ...] = ()
        self._top = 0.0

    def forget(self) -> None:
        """The window has laid its sheet anew."""
        self._points = None

    def fresh(self, frame: Frame, colour: Colour | None) -> bool:
        """Whether the window lacks the positions of a frame, or their values of a colour.

        Args:
            frame: of a session.
            colour: of its values; None for none.
        """
        return self._points is not frame.points or self._colour is not colour

    def untold(self, frame: Frame, colour: Colour | None) -> bool:
        """Whether it does not know where the sheet lies, that it is at rest there, or why it cannot go on.

        Args:
            frame: of a session.
            colour: of its values; None for none.
        """
        return self.fresh(frame, colour) or self._told != (frame.at_rest, frame.note)

    def packed(self, frame: Frame, colour: Colour | None, more: Json, whole: bool) -> bytes:
        """A frame as it travels.

        Args:
            frame: of a session.
            colour: of its values; None for none.
            more: numbers beside those of the frame.
            whole: with positions and values; else it has the numbers alone.

        Returns:
            see `bh.studio.frames.packed`; after the numbers (n, 3) positions, mm, and (n,) values of the colour.
        """
        arrays: tuple[NDArray[np.float64], ...] = ()
        self._told = (frame.at_rest, frame.note)
        if whole:
            values = np.zeros(len(frame.points)) if colour is None else colour.values(frame.state)
            self._points, self._colour, self._top = frame.points, colour, top_of(values)
            arrays = frame.points, values
        return packed({**head_of(frame), "top": self._top, **more}, *arrays)
