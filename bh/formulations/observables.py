"""What can be read from a state as one number, by name; any of it can end a step (`Until`)."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations.state import State
from bh.model.plugins import named
from bh.model.until import Until
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
Observable = Callable[[State, str | None], float]


def measure(until: Until, state: State) -> float:
    """The observable of an `Until` at a state, in its own unit.

    Args:
        until: names the observable.
        state: of a path.

    Raises:
        ModelError: the state has no such thing, or "module:function" cannot be imported.
    """
    if until.observable in OBSERVABLES:
        return OBSERVABLES[until.observable](state, until.of)
    return float(named(until.observable)(state))


def depth_of(state: State) -> tuple[float, Array]:
    """Depth of a corrugation (mm) and the direction (3,) that it is measured in.

    The distance from the lowest valley to the highest mountain point between two parallel plates, one over all mountain
    creases and the other under all valley creases, in the direction in which that is least. A free sheet has no other
    vertical, and its rigid motions change nothing.

    Raises:
        ModelError: there are not both mountain and valley creases, or plates could tilt between them for ever.
    """
    from scipy.optimize import linprog

    nodes = {fold: crease_nodes(state.mesh, fold) for fold in ("mountain", "valley")}
    x = state.points - state.points.mean(axis=0)
    used = x[np.concatenate(list(nodes.values()))]
    up = np.linalg.svd(used - used.mean(axis=0))[2][2]
    corner = x[state.mesh.triangles]
    faces = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]).sum(axis=0)
    up = up if up @ faces > 0.0 else -up
    for _ in range(20):
        frame = np.vstack((np.linalg.svd(up[None])[2][1:], up))
        top, low = x[nodes["mountain"]] @ frame.T, x[nodes["valley"]] @ frame.T
        # slopes (a, b), height of the upper plate, height of the lower one
        above = np.column_stack((-top[:, :2], -np.ones(len(top)), np.zeros(len(top))))
        below = np.column_stack((low[:, :2], np.zeros(len(low)), np.ones(len(low))))
        A, limits = np.vstack((above, below)), np.concatenate((-top[:, 2], low[:, 2]))
        found = linprog([0.0, 0.0, 1.0, -1.0], A, limits, bounds=[(-1.0, 1.0)] * 2 + [(None, None)] * 2)
        a, b = found.x[:2]
        if max(abs(a), abs(b)) > 0.999:
            raise ModelError(
                "the creases leave the direction of the depth open; use at least two of either kind, "
                "and fold less than to where the sheet is as deep as wide"
            )
        up = np.array([-a, -b, 1.0]) @ frame
        up /= np.linalg.norm(up)
        if math.hypot(a, b) < 1e-12:
            break
    return float((x[nodes["mountain"]] @ up).max() - (x[nodes["valley"]] @ up).min()), up


def crease_nodes(mesh: SheetMesh, fold: str) -> Ints:
    """Nodes of all creases that are drawn as `fold` ("mountain" or "valley").

    Args:
        mesh: has the creases.
        fold: "mountain" or "valley".

    Returns:
        (k,) rising node indices.

    Raises:
        ModelError: no crease is drawn so.
    """
    names = [name for name in mesh.creases if mesh.folds.get(name) == fold]
    if not names:
        raise ModelError(f"a depth needs mountain and valley creases, but the sheet has no {fold}")
    return np.unique(np.concatenate([mesh.nodes(f"crease:{name}") for name in names]))


def _component(read: Callable[[State, str], Array], axis: int) -> Observable:
    return lambda state, of: float(read(state, of or "all")[axis])


def _moved(state: State, of: str) -> Array:
    return np.asarray(state.displacement(of).mean(axis=0))


OBSERVABLES: dict[str, Observable] = {
    "depth": lambda state, _: depth_of(state)[0],
    "energy": lambda state, _: state.energy.total,
    "stretching": lambda state, _: state.energy.stretching,
    "bending": lambda state, _: state.energy.bending,
    "folding": lambda state, _: state.energy.folding,
    "fold_angle": lambda state, of: float(state.fold_angle(str(of)).mean()),
    "largest_fold": lambda state, of: float(np.abs(state.fold_angle(str(of))).max()),
    "dihedral": lambda state, of: float(state.dihedral(str(of)).mean()),
    "moment": lambda state, of: float(state.crease_moment(str(of)).mean()),
    **{f"reaction_{axis}": _component(lambda s, of: s.reaction(of), k) for k, axis in enumerate("xyz")},
    **{f"displacement_{axis}": _component(_moved, k) for k, axis in enumerate("xyz")},
}
