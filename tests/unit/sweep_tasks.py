"""Tasks for the tests of sweeps; a module of its own, because workers import it by name."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np


def waves(point: Mapping[str, Any]) -> dict[str, Any]:
    """A number and an array whose length depends on the point."""
    x = float(point["x"])
    return {
        "sine": float(np.sin(x) / 3.0),
        "powers": x ** np.arange(1, 2 + int(point["n"])),
        "word": f"at {x:g}",
    }


def slow(point: Mapping[str, Any]) -> dict[str, Any]:
    time.sleep(0.02)
    return {"root": float(np.sqrt(float(point["x"]) + 0.1))}


def moody(point: Mapping[str, Any]) -> dict[str, Any]:
    if point["x"] == 2:
        raise ZeroDivisionError("no value\nat two")
    return {"inverse": 1.0 / (float(point["x"]) - 2.0)}


@dataclass(frozen=True)
class Deadly:
    """Kills its worker at x = 3: always, or only the first time (then a marker is in the folder)."""

    folder: str
    always: bool

    def __call__(self, point: Mapping[str, Any]) -> dict[str, Any]:
        if point["x"] == 3:
            marker = os.path.join(self.folder, "been-here")
            if self.always or not os.path.exists(marker):
                open(marker, "w").close()
                os.kill(os.getpid(), signal.SIGKILL)
        return {"double": 2.0 * float(point["x"])}
