"""The six scenes of `speed_error`: a pattern, what is done to it, and three figures that are read from the end.

Energy (N mm) is that of the sheet and its spring; the curve is that of the crease, or of the middle line of a strip; a
stiffness says how the sheet resists what drives it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import meshes
from bh import Displace, Force, Model, Path, Sheet, State, trace
from bh.solvers.walk import Strategy
from meshes import CreasePattern, SheetMesh
from verification.studies.app_b.shell_folding import ROTATE
from verification.studies.ch3.fig3_10 import upward

Array = NDArray[np.float64]
SHEET = Sheet(E=4000.0, nu=0.38, t=0.127)  # App. B
STRIP = Sheet(E=1000.0, nu=0.0, t=0.1)  # 3.4.1
LENGTH, HEIGHT = 10.0, 1.0  # mm, of the strip
TWIST, PUSH = 0.15, 0.02  # mm, each corner one way; N/mm on the middle line
LSTAR, REST, LIFT = 25.0, 0.5 * math.pi, 10.0  # mm, rad, mm


@dataclass(frozen=True)
class Problem:
    """One scene at any density.

    Attributes:
        name, title: short, and in words.
        pattern: the flat sheet; the curve is that of its crease "crease".
        cells: along the crease for every row on either side, so that cells are about as wide as high.
        actuate: the model of a mesh and a formulation's name.
        stiffness: read from the solved path, in `unit`; `what` says which.
        turning: all that happens is that the crease turns, which the shell can do in one increment.
        asked: what the energy of the consistent formulation on its finest mesh may be off.
    """

    name: str
    title: str
    pattern: CreasePattern
    cells: int
    actuate: Callable[[SheetMesh, str], Model]
    stiffness: Callable[[Path], float]
    what: str
    unit: str
    turning: bool = True
    asked: float = 0.01

    @property
    def length(self) -> float:
        """Of the curve, mm."""
        return float(self.pattern.creases[0].curve.length)

    def strategy(self, name: str) -> Strategy | None:
        """The driver's own, but for shells that turn a crease by a right angle at once."""
        return ROTATE if self.turning and is_shell(name) else None


def is_shell(name: str) -> bool:
    """Whether a formulation of this name is one of the shells."""
    return name.endswith("shell")


def curve(state: State, samples: int) -> Array:
    """(samples + 1, 3) points of the deformed crease, equally spaced in the flat sheet, mm.

    What lies between nodes is taken from the curve that the formulation itself draws: straight between nodes, or
    quadratic. `samples` a multiple of the cells along the crease leaves nothing to interpolate.
    """
    own = getattr(state, "crease_curve", None)
    points = own("crease", 3) if own is not None else state.crease_points("crease")
    at = np.linspace(0.0, len(points) - 1.0, samples + 1)
    if own is None:
        return np.column_stack([np.interp(at, np.arange(len(points)), points[:, i]) for i in range(3)])
    left = 2 * np.minimum(at // 2, (len(points) - 3) // 2).astype(np.int64)
    s = (at - left)[:, None] - 1.0
    out: Array = (
        0.5 * s * (s - 1.0) * points[left]
        + (1.0 - s**2) * points[left + 1]
        + 0.5 * s * (s + 1.0) * points[left + 2]
    )
    return out


def _fold_stiffness(path: Path) -> float:
    """Mean moment a length of crease over the mean fold angle, N."""
    state = path[-1]
    return float(state.crease_moment("crease").mean() / state.fold_angle("crease").mean())


def _appendix_b(actuation: str, mesh: SheetMesh, name: str) -> Model:
    model = Model(mesh, SHEET, formulation=name, contact=False)
    model = model.support("corner:inner-start", "xyz").support("corner:outer-start", "yz")
    if actuation == "d":
        model = model.support("corner:inner-end", "z").support("corner:outer-end", "z")
    else:
        model = model.support("edge:inner", "z").support("edge:outer", "z")
    return model.fold("crease", to=math.pi / 2)


def _free(mesh: SheetMesh, name: str) -> Model:
    return Model(mesh, SHEET, formulation=name, contact=False).fold("crease", rest=REST, Lstar=LSTAR)


def _twisted(mesh: SheetMesh, name: str) -> Model:
    low, high = "corner:inner-end", "corner:outer-end"
    held = Model(mesh, STRIP, formulation=name, contact=False).support("edge:start", "xyz")
    return held.step(Displace(low, "z", -TWIST), Displace(high, "z", TWIST))


def _torque(path: Path) -> float:
    """Couple of the two corners over the angle that the end has turned, N mm / rad."""
    state = path[-1]
    low, high = (int(path.model.mesh.nodes(f"corner:{c}-end")[0]) for c in ("inner", "outer"))
    arm = state.points[high] - state.points[low]
    couple = 0.5 * arm[1] * (state.reactions[high, 2] - state.reactions[low, 2])
    return float(couple / math.atan2(arm[2], arm[1]))


def _bent(mesh: SheetMesh, name: str) -> Model:
    """Held at both ends but for one that rolls, with an even line load on the middle line.

    A `total` on a crease is a line load to shells; the others get the share of each node (the end nodes are held).
    """
    model = (
        Model(mesh, STRIP, formulation=name, contact=False)
        .support("edge:start", "xyz")
        .support("edge:end", "yz")
    )
    nodes = mesh.nodes("crease:crease")
    if is_shell(name):
        return model.force("crease:crease", total=(0.0, 0.0, -PUSH * LENGTH))
    share = -PUSH * LENGTH / (len(nodes) - 1)
    return model.step(Force(nodes[1:-1].tolist(), each=(0.0, 0.0, share)))


def _sag(path: Path) -> float:
    """Line load over the deflection of the middle of the strip, N / mm^2."""
    middle = curve(path[-1], 2)[1]
    return float(PUSH / -middle[2])


def _lifted(mesh: SheetMesh, name: str) -> Model:
    """Folded free by its spring; then one end stays where it is and the tip of the crease goes up (fig3_10)."""
    folded = _free(mesh, name)
    start = trace(folded, strategy=ROTATE if is_shell(name) else None)[-1]
    up, moved = upward(start), start.displacement()
    held = [
        Displace([node], axis, float(moved[node, i]))
        for node in mesh.nodes("edge:start").tolist()
        for i, axis in enumerate("xyz")
    ]
    tip = int(mesh.nodes("crease:crease")[-1])
    return folded.step(*held, Displace([tip], tuple(up.tolist()), float(moved[tip] @ up) + LIFT))


def _lift_force(path: Path) -> float:
    """Force of the tip over its rise, N/mm."""
    tip = int(path.model.mesh.nodes("crease:crease")[-1])
    return float(np.linalg.norm(path[-1].reactions[tip])) / LIFT


def _sector(angle: float) -> CreasePattern:
    return meshes.annulus_sector(100.0, 10.0, angle)


_STRIP = meshes.strip(LENGTH, HEIGHT, [0.5 * HEIGHT], "flat")
_MOMENT = ("moment of the crease a length over its fold angle", "N")

PROBLEMS = (
    Problem(
        "a",
        "App. B (a): edges in the plane, 90 degrees",
        _sector(math.pi / 4),
        8,
        lambda mesh, name: _appendix_b("a", mesh, name),
        _fold_stiffness,
        *_MOMENT,
    ),
    Problem(
        "d",
        "App. B (d): held at its corners, 90 degrees",
        _sector(math.pi / 4),
        8,
        lambda mesh, name: _appendix_b("d", mesh, name),
        _fold_stiffness,
        *_MOMENT,
    ),
    Problem(
        "free",
        "Free annulus, spring crease, rest angle 90 degrees",
        _sector(math.pi / 2),
        16,
        _free,
        _fold_stiffness,
        *_MOMENT,
    ),
    Problem(
        "torsion",
        "Strip of 3.4.1 twisted by 17 degrees",
        _STRIP,
        20,
        _twisted,
        _torque,
        "couple over angle",
        "N mm / rad",
        turning=False,
    ),
    Problem(
        "bending",
        "Strip of 3.4.1 under a line load",
        _STRIP,
        20,
        _bent,
        _sag,
        "line load over deflection of the middle",
        "N / mm^2",
        turning=False,
    ),
    Problem(
        "lifted",
        "Cantilevered annulus, tip lifted by 10 mm",
        _sector(math.pi / 4),
        8,
        _lifted,
        _lift_force,
        "force over rise",
        "N/mm",
        turning=False,
        asked=0.04,
    ),
)
