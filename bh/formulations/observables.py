"""What can be read from a state as one number, by name; any of it can end a step (`Until`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.model.plugins import named
from meshes import SheetMesh
from meshes.topology import Ints

if TYPE_CHECKING:
    from bh.formulations.state import State

Array = NDArray[np.float64]
Observable = Callable[["State", str | None], float]


@dataclass(frozen=True)
class Until:
    """Ends a step of a model where an observable has a value; the step has failed if it never has it.

    Attributes:
        observable: a name of `OBSERVABLES`, or "module:function" of a function of a `State` (or that function itself,
            if it can be imported).
        value: wanted, in the observable's unit.
        of: the crease or place that it is of, where it needs one.
        tolerance: on the value.
    """

    observable: str
    value: float
    of: str | None = None
    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        if callable(self.observable):
            object.__setattr__(self, "observable", _importable(self.observable))
        if self.observable not in OBSERVABLES and ":" not in self.observable:
            known = ", ".join(OBSERVABLES)
            raise ModelError(
                f"observable '{self.observable}' is not known; use one of {known}, or module:function"
            )
        if not math.isfinite(self.value):
            raise ModelError(f"until {self.observable} = {self.value} cannot be; give a finite number")
        if not (math.isfinite(self.tolerance) and self.tolerance > 0.0):
            raise ModelError(f"until: tolerance = {self.tolerance} cannot be; give a positive number")
        if self.of is None and self.observable in NEEDS:
            raise ModelError(f"until {self.observable} needs `of`, {NEEDS[self.observable]}")

    def measure(self, state: State) -> float:
        """The observable of a state."""
        if self.observable in OBSERVABLES:
            return OBSERVABLES[self.observable](state, self.of)
        return float(named(self.observable)(state))


def until_of(actuations: Sequence[object]) -> Until | None:
    """What ends a step early, if anything does."""
    return next((item for item in actuations if isinstance(item, Until)), None)


def depth(to: float, tolerance: float = 1e-4) -> Until:
    """Fold until a corrugation is `to` mm deep, highest mountain to lowest valley point (see `depth_of`)."""
    if not (math.isfinite(to) and to > 0.0):
        raise ModelError(f"depth = {to} mm cannot be; give a positive length in mm")
    return Until("depth", to, tolerance=tolerance)


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
                "the creases leave the direction of the depth open; use at least two of either kind"
            )
        up = np.array([-a, -b, 1.0]) @ frame
        up /= np.linalg.norm(up)
        if math.hypot(a, b) < 1e-12:
            break
    return float((x[nodes["mountain"]] @ up).max() - (x[nodes["valley"]] @ up).min()), up


def crease_nodes(mesh: SheetMesh, fold: str) -> Ints:
    """Nodes of all creases that are drawn as `fold` ("mountain" or "valley")."""
    names = [name for name in mesh.creases if mesh.folds.get(name) == fold]
    if not names:
        raise ModelError(f"a depth needs mountain and valley creases, but the sheet has no {fold}")
    return np.unique(np.concatenate([mesh.nodes(f"crease:{name}") for name in names]))


def _component(read: Callable[[State, str], Array], axis: int) -> Observable:
    return lambda state, of: float(read(state, of or "all")[axis])


def _moved(state: State, of: str) -> Array:
    return np.asarray(state.displacement(of).mean(axis=0))


OBSERVABLES: dict[str, Observable] = {
    "depth": lambda state, of: depth_of(state)[0],
    "energy": lambda state, of: state.energy.total,
    "stretching": lambda state, of: state.energy.stretching,
    "bending": lambda state, of: state.energy.bending,
    "folding": lambda state, of: state.energy.folding,
    "fold_angle": lambda state, of: float(state.fold_angle(str(of)).mean()),
    "largest_fold": lambda state, of: float(np.abs(state.fold_angle(str(of))).max()),
    "dihedral": lambda state, of: float(state.dihedral(str(of)).mean()),
    "moment": lambda state, of: float(state.crease_moment(str(of)).mean()),
    **{f"reaction_{axis}": _component(lambda s, of: s.reaction(of), k) for k, axis in enumerate("xyz")},
    **{f"displacement_{axis}": _component(_moved, k) for k, axis in enumerate("xyz")},
}
NEEDS = {
    **dict.fromkeys(("fold_angle", "largest_fold", "dihedral", "moment"), "the name of a crease"),
    **{
        f"{what}_{axis}": "a place such as edge:start"
        for what in ("reaction", "displacement")
        for axis in "xyz"
    },
}


def _importable(function: Callable[[State], float]) -> str:
    """ "module:function" of a function, which must be found again in another process."""
    module, name = getattr(function, "__module__", ""), getattr(function, "__qualname__", "")
    if getattr(import_module(module), name, None) is not function:
        raise ModelError(
            f"until takes a function at the top of a module, not {name or function!r}; give it a name"
        )
    return f"{module}:{name}"
