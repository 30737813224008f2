"""What a sheet is coloured by: energy densities at nodes, or stresses that jump across creases."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.plotting.offscreen import PlotError
from bh.plotting.panels import cut_open

if TYPE_CHECKING:
    from bh.formulations.state import State

Array = NDArray[np.float64]
KINDS = ("stretching", "bending", "folding")
STRESSES = {"stress": ("equivalent stress", "MPa"), "utilisation": ("stress over strength", "1")}


class Colouring(NamedTuple):
    """What is shown by colours.

    Attributes:
        values: (n,) at nodes, of stresses the mean of the panels there.
        top: where the colours end, above 0.
        cut: whether some values lie above it.
        label: what the values are, and their `unit`.
        corners: (t, 3) values at the corners of triangles; None where those of the nodes are all there is.
    """

    values: Array
    top: float
    cut: bool
    label: str
    unit: str
    corners: Array | None = None

    def on_panels(self, state: State) -> Array:
        """(m,) values at the nodes of the sheet cut open (`bh.plotting.panels`).

        Args:
            state: that is coloured.
        """
        nodes, triangles = cut_open(state.mesh)
        if self.corners is None:
            return np.asarray(self.values[nodes])
        return _means(triangles, self.corners, len(nodes))


def colouring_of(state: State, colour: str | None, top: float | None) -> Colouring | None:
    """What a state is coloured by; None for the plain sheet, and where all is zero.

    Args:
        state: of a path.
        colour: as for `bh.plotting.picture`.
        top: where the colours end; None for the largest value there is.

    Raises:
        PlotError: not a state, or an unknown colour.
        ModelError: the state has no stress, or the sheet no strength.
    """
    if not hasattr(state, "nodal_energy_density"):
        raise PlotError(f"{type(state).__name__} is not a state; give one of a path, such as path[-1]")
    if colour is None:
        return None
    corners, label, unit = None, f"{colour} energy density", "N mm / mm²"
    if colour in STRESSES:
        label, unit = STRESSES[colour]
        stress = state.stress().corners
        if colour == "stress":
            corners = np.maximum(stress.equivalent("top"), stress.equivalent("bottom"))
        else:
            corners = stress.largest()
        values = _means(state.mesh.triangles, corners, len(state.points))
    elif colour == "total":
        values = np.sum([state.nodal_energy_density(kind) for kind in KINDS], axis=0)
    elif colour in KINDS:
        values = state.nodal_energy_density(colour)
    else:
        raise PlotError(
            f"colour '{colour}' is not known; use one of {', '.join((*KINDS, 'total', *STRESSES))}"
        )
    largest = float((values if corners is None else corners).max(initial=0.0))
    if top is None:
        top = largest
    if not (np.isfinite(top) and top >= 0.0):
        raise PlotError(f"top = {top} cannot be; give a value in {unit}")
    if top == 0.0:
        return None
    return Colouring(values, top, bool(largest > top * (1.0 + 1e-9)), label, unit, corners)


def _means(places: NDArray[np.int64], corners: Array, count: int) -> Array:
    """(count,) means of the values (t, 3) of the corners at the places (t, 3)."""
    total = np.bincount(places.ravel(), corners.ravel(), minlength=count)
    return np.asarray(total / np.maximum(np.bincount(places.ravel(), minlength=count), 1))
