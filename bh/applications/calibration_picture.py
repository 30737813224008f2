"""Residuals of a calibration as a picture: what was measured beside what is fitted, and the rest over the noise."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bh.applications.calibrated import Calibration
from bh.errors import ModelError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BLUE, RED = "#0072b2", "#d55e00"


def picture(found: Calibration) -> Figure:
    """One row for each kind of data; residuals that are noise lie between the lines, 95 of 100.

    Args:
        found: by `calibrate`.

    Raises:
        ModelError: it was made by `fit`, which knows no kinds of data.
    """
    from matplotlib.figure import Figure

    if not found.parts:
        raise ModelError("this calibration has no data of its own to draw; make it by bh.calibrate")
    rows = len(found.parts)
    figure = Figure(figsize=(9.0, 3.2 * rows), dpi=110, layout="constrained")
    for row, part in zip(figure.subplots(rows, 2, squeeze=False), found.parts, strict=True):
        number = np.arange(1, len(part.measured) + 1)
        row[0].errorbar(
            number, part.measured, 1.96 * part.sigma, fmt="o", color=BLUE, capsize=3, label="measured, 95 %"
        )
        row[0].plot(number, part.predicted, "s-", color=RED, markersize=4, label="fitted")
        row[0].set(xlabel="reading", ylabel=f"{part.label}, {part.unit}")
        row[0].legend()
        off = (part.predicted - part.measured) / part.sigma
        row[1].axhspan(-1.96, 1.96, color="0.9")
        row[1].axhline(0.0, color="0.5", linewidth=0.8)
        row[1].plot(number, off, "o", color=BLUE)
        for axes in row:
            axes.xaxis.get_major_locator().set_params(integer=True)
        row[1].set(xlabel="reading", ylabel="(fitted - measured) / noise")
    return figure
