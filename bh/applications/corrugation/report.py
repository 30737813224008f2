"""Bending tests of a corrugation as a table, as plain data and as a picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from bh.applications.corrugation.bending import BendingTest, Rig, three_point
from bh.applications.corrugation.folded import Folded
from bh.applications.corrugation.folding import fold, laid
from bh.errors import ModelError
from bh.model.model import Model
from bh.runtime.progress import ProgressMeter
from bh.solving.trace import trace

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def folded_by(model: Model, progress: bool | ProgressMeter = False) -> Folded:
    """Solve the steps of a free corrugation, and lay it down.

    Args:
        model: with mountain and valley creases, and the steps that fold it.
        progress: as for `bh.trace`.

    Raises:
        ModelError: it has no mountains or no valleys, does not reach the end of its steps, or something holds it.
    """
    for kind in ("mountain", "valley"):
        if kind not in model.mesh.folds.values():
            raise ModelError(
                f"a corrugation lies on its valleys under its mountains; this sheet has no {kind}"
            )
    path = trace(model, progress=progress, estimate=False, warn=False)
    if not path.reached:
        raise ModelError(f"the sheet could not be folded ({path.outcome}: {path.reason})")
    return laid(path)


def tests(source: str | Model, depth: float, azimuths: Sequence[float], rig: Rig) -> list[BendingTest]:
    """Fold a corrugation and bend it in several directions, each from the folded state.

    Args:
        source: name of a pattern of the library, or a model with the steps that fold it.
        depth: of a named one, mm.
        azimuths: of the bar from the x axis, rad.
        rig: supports and bar.

    Returns:
        a test a direction, in their order.

    Raises:
        ModelError: see `folded_by` and `three_point`.
    """
    folded = fold(source, depth) if isinstance(source, str) else folded_by(source)
    return [three_point(folded, azimuth, rig) for azimuth in azimuths]


def lines(found: Sequence[BendingTest]) -> list[str]:
    """A line a direction, and the least stiffness over the largest.

    Args:
        found: tests of one corrugation.

    Returns:
        the lines in order.
    """
    heads = ("bar / deg", "stiffness / N/mm", "R^2", "first peak / N", "pressed / mm", "outcome")
    rows = [
        (
            f"{math.degrees(test.azimuth):.4g}",
            f"{test.stiffness:.4g}" if math.isfinite(test.stiffness) else "",
            f"{test.r2:.3f}" if math.isfinite(test.r2) else "",
            f"{test.peak:.4g}",
            f"{test.displacement[-1]:.4g}",
            str(test.outcome) if not test.reason else f"{test.outcome}: {test.reason}",
        )
        for test in found
    ]
    widths = [max(len(row[k]) for row in (heads, *rows)) for k in range(len(heads) - 1)]
    table = [
        "  ".join([*(word.rjust(width) for word, width in zip(row, widths, strict=False)), row[-1]])
        for row in (heads, *rows)
    ]
    if not all(math.isfinite(test.stiffness) for test in found):
        table.append("no stiffness where the load has no part that rises to a peak; press further")
    stiff = [test.stiffness for test in found]
    if len(stiff) > 1 and all(value > 0.0 for value in stiff):
        table.append(f"least stiffness over largest: {min(stiff) / max(stiff):.3g}")
    return table


def as_dict(found: Sequence[BendingTest]) -> dict[str, object]:
    """Plain data for JSON: mm, N, N/mm, rad; what is not there is None.

    Args:
        found: tests of one corrugation.

    Returns:
        plain data.
    """
    return {
        "tests": [
            {
                "azimuth": test.azimuth,
                "stiffness": _plain(test.stiffness),
                "r2": _plain(test.r2),
                "peak": test.peak,
                "window": [_plain(end) for end in test.window],
                "outcome": str(test.outcome),
                "reason": test.reason,
                "displacement": test.displacement.tolist(),
                "load": test.load.tolist(),
            }
            for test in found
        ]
    }


def picture(found: Sequence[BendingTest]) -> Figure:
    """Load against displacement of the bar, a curve a direction, with the line of its stiffness.

    Args:
        found: tests of one corrugation.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.0, 4.0), dpi=110, layout="constrained")
    axes = figure.subplots()
    for test, dash in zip(found, ("-", "--", "-.", ":") * len(found), strict=False):
        name = f"bar at {math.degrees(test.azimuth):.4g}°: {test.stiffness:.3g} N/mm"
        (curve,) = axes.plot(test.displacement, test.load, dash, label=name)
        if math.isfinite(test.stiffness):
            ends = test.window
            base = float(np.interp(ends[0], test.displacement, test.load))
            rise = test.stiffness * (ends[1] - ends[0])
            axes.plot(ends, (base, base + rise), color=curve.get_color(), linewidth=4.0, alpha=0.3)
    axes.set(xlabel="displacement of the bar, mm", ylabel="load, N")
    axes.legend(frameon=False, fontsize="small")
    return figure


def _plain(value: float) -> float | None:
    return value if math.isfinite(value) else None
