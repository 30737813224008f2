"""A sheet that answers while it is handled: folded by sliders, pulled by a hand, always in equilibrium.

`Session` takes changes and a budget of time, and gives the newest equilibrium. No window is in it; `bh.studio` is one.
"""

from bh.live.controls import Controls
from bh.live.frame import Frame
from bh.live.grips import Grip, Jaws
from bh.live.history import Mark
from bh.live.holding import held
from bh.live.session import Session

__all__ = ["Controls", "Frame", "Grip", "Jaws", "Mark", "Session", "held"]
