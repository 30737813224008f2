"""What the colours of the window show: a value at every node, in a unit, computed only where it is chosen.

Stresses, curvatures and surface strains belong to triangles; a node shows the mean, by area, of those around it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations import yield_criteria
from bh.formulations.state import State
from bh.formulations.stress import Stress
from meshes import SheetMesh

Array = NDArray[np.float64]
SIDES = ("top", "bottom")
TOP = 99.0  # percentile where the scale ends; single nodes, such as one that is held, may lie above it


@dataclass(frozen=True)
class Colour:
    """Something to colour a sheet by.

    Attributes:
        label: what it is.
        unit: of its values, for a person.
        values: (n,) at the nodes of a state, not negative.
    """

    label: str
    unit: str
    values: Callable[[State], Array]


def _energy(kind: str) -> Callable[[State], Array]:
    return lambda state: state.nodal_energy_density(kind)


def _edges(state: State) -> Array:
    """Largest strain of the edges at every node."""
    values, size = np.zeros(len(state.points)), np.abs(state.strain)
    for ends in state.mesh.topology.edges.T:
        np.maximum.at(values, ends, size)
    return values


def _stress(read: Callable[[Stress, str], Array]) -> Callable[[State], Array]:
    """The larger of the values of both faces of the sheet."""

    def values(state: State) -> Array:
        stress = state.stress()
        return at_nodes(state.mesh, np.maximum(*(np.abs(read(stress, side)) for side in SIDES)))

    return values


def _largest(components: Array) -> Array:
    """(t,) the principal value of largest size, of strains or curvatures (t, 3) in components xx, yy, 2 xy."""
    return np.asarray(np.abs(yield_criteria.principal(components * [1.0, 1.0, 0.5])).max(axis=-1))


COLOURS: Mapping[str, Colour] = {
    "bending": Colour("bending energy", "N mm / mm²", _energy("bending")),
    "stretching": Colour("stretching energy", "N mm / mm²", _energy("stretching")),
    "stress": Colour("equivalent stress", "MPa", _stress(Stress.equivalent)),
    "utilisation": Colour(
        "stress over strength",
        "1 is yield",
        lambda state: at_nodes(state.mesh, state.stress().largest()),
    ),
    "curvature": Colour(
        "largest curvature", "1/mm", lambda state: at_nodes(state.mesh, _largest(state.stress().curvature))
    ),
    "surface": Colour(
        "strain of the faces", "1", _stress(lambda stress, side: _largest(stress.strain_at(side)))
    ),
    "strain": Colour("strain of edges", "1", _edges),
}


def offered(state: State) -> dict[str, Colour]:
    """What a sheet can be coloured by.

    Args:
        state: any of its states.

    Returns:
        by name; without stresses where the formulation has none, without its part of the strength where none is given.
        The equivalent stress of a sheet with a grain is Hill's, of others von Mises's.
    """
    found = {}
    for name, colour in COLOURS.items():
        try:
            colour.values(state)
        except ModelError:
            continue
        if name == "stress":
            law = "von Mises" if state.stress().sheet.grain is None else "Hill"
            colour = Colour(f"{colour.label} ({law})", colour.unit, colour.values)
        found[name] = colour
    return found


def top_of(values: Array) -> float:
    """Where a scale of values ends: their 99th percentile; 0 where there are none."""
    return float(np.percentile(values, TOP)) if len(values) else 0.0


def at_nodes(mesh: SheetMesh, values: Array) -> Array:
    """(n,) means at nodes, by area, of values (t,) of the triangles around.

    Args:
        mesh: of the triangles.
        values: (t,).
    """
    nodes, areas = mesh.triangles.ravel(), np.repeat(mesh.areas, 3)
    count = len(mesh.points)
    weights = np.bincount(nodes, areas, minlength=count)
    return np.asarray(np.bincount(nodes, areas * np.repeat(values, 3), minlength=count) / weights)
