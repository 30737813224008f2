"""What colours of a folded sheet stand for: an energy density at its nodes, on one scale."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.plotting.offscreen import PlotError

if TYPE_CHECKING:
    from matplotlib.colors import ListedColormap

    from bh.formulations.state import State

Array = NDArray[np.float64]
KINDS = ("stretching", "bending", "folding")
BLANK_SHEET, COLOURS = "#b9c4cf", "viridis"
NOISE = 1e-18  # N mm / mm^2: rounding of a sheet that folds rigidly; bent paper has 1e-9 and more


class Colouring(NamedTuple):
    """Values (n,) at nodes, N mm / mm^2; colours end at `top` > 0; `cut` if some lie above it."""

    values: Array
    top: float
    cut: bool


def colouring_of(state: State, colour: str | None, top: float | None) -> Colouring | None:
    """Values of a state and where their colours end; None for a sheet of one colour.

    Args:
        state: whose sheet is drawn.
        colour: stretching, bending, folding, total, or None.
        top: energy density where the colours end, N mm / mm^2; None for the largest there is.

    Raises:
        PlotError: not a state, an unknown colour, or a `top` that is negative or not finite.
    """
    if not hasattr(state, "nodal_energy_density"):
        raise PlotError(f"{type(state).__name__} is not a state; give one of a path, such as path[-1]")
    if colour is None:
        return None
    if colour == "total":
        values = np.sum([state.nodal_energy_density(kind) for kind in KINDS], axis=0)
    elif colour in KINDS:
        values = state.nodal_energy_density(colour)
    else:
        raise PlotError(f"colour '{colour}' is not known; use one of {', '.join(KINDS)}, total")
    if top is None:
        top = float(values.max(initial=0.0))
    if not (np.isfinite(top) and top >= 0.0):
        raise PlotError(f"top = {top} cannot be; give an energy density in N mm / mm^2")
    if top <= NOISE:
        return None
    return Colouring(values, top, bool(values.max(initial=0.0) > top * (1.0 + 1e-9)))


def shades_of_edges() -> ListedColormap:
    """The colour map, a shade lighter where it is dark and a shade darker where it is light."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    colours = colormaps[COLOURS](np.linspace(0.0, 1.0, 256))[:, :3]
    dark = colours @ (0.30, 0.59, 0.11) < 0.36
    return ListedColormap(np.where(dark[:, None], 0.72 * colours + 0.28, 0.78 * colours))
