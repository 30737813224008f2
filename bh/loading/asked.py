"""What steps ask of hinges and nodes, and what belongs to the step in hand alone."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bh.loading.load_step import Pinched
from bh.model.laws import PRESCRIBED, SPRING
from bh.model.step import Body
from meshes import SheetMesh
from meshes.topology import dihedral_angles

Array = NDArray[np.float64]
Direction = tuple[float, float, float]


@dataclass(eq=False)
class Asked:
    """What hinges (m,) and nodes (n,) are asked for at the end of a step; the next step begins with it.

    For the fields see `LoadStep`; `borne` are forces beside `force`, by name; `pressed` (t,) are pressures and `turned`
    (e,) couples on edges. `pinched` marks hinges whose prescribed angle
    follows from a solved state.
    """

    law: NDArray[np.int64]
    stiffness: Array
    rest: Array
    rest_ends: Array
    prescribed: Array
    moment: Array
    force: Array
    borne: dict[str, Array]
    pressed: Array
    turned: Array
    pinched: NDArray[np.bool_]
    curve: NDArray[np.int64]  # row of the builder's `laws` of creases that are no straight line, else -1
    displaced: dict[tuple[int, Direction], float]  # nan where it is not known yet
    growth: Array | None = (
        None  # (2, t, 3, 3) strain and curvature at rest at the corners, where there are some
    )
    changed: Array | None = None  # (t,) of temperature or moisture, which is in `growth`

    @classmethod
    def nothing(cls, mesh: SheetMesh) -> Asked:
        """Nothing yet: the stress-free sheet."""
        hinges, nodes = len(mesh.topology.hinges), len(mesh.points)
        return cls(
            law=np.zeros(hinges, dtype=np.int64),
            stiffness=np.zeros(hinges),
            rest=dihedral_angles(mesh.points, mesh.topology.hinges),
            rest_ends=np.full((hinges, 2), math.pi),
            prescribed=np.full(hinges, np.nan),
            moment=np.zeros(hinges),
            force=np.zeros((nodes, 3)),
            borne={},
            pressed=np.zeros(len(mesh.triangles)),
            turned=np.zeros(len(mesh.topology.edges)),
            pinched=np.zeros(hinges, dtype=bool),
            curve=np.full(hinges, -1, dtype=np.int64),
            displaced={},
        )

    def copy(self) -> Asked:
        """The same in arrays of its own."""
        return Asked(**{name: value.copy() for name, value in vars(self).items() if value is not None})

    @property
    def dead(self) -> Array:
        """(n, 3) all dead forces, N."""
        return sum(self.borne.values(), self.force)

    def angles(self) -> Array:
        """(m,) angles that this is meant to bring about, rad."""
        by_law = [self.law == PRESCRIBED, self.law == SPRING]
        return np.select(by_law, [self.prescribed, self.rest], math.pi)


@dataclass(eq=False)
class StepInHand:
    """What belongs to the step in hand alone.

    Attributes:
        angles: (m,) that a late actuation begins with, rad.
        pinch: see `LoadStep`.
        released, folded: (m,) hinges that were let go of, or folded as a whole.
        given: (2, m) angles and moments that something was given, nan elsewhere.
        moved: displacements that were asked for, mm, and whether from where nodes are.
        zones: what zones ask for, and where these are.
        bodies: see `LoadStep`.
        grown: triangles that something was asked of.
    """

    angles: Array
    pinch: Pinched
    released: NDArray[np.bool_]
    folded: NDArray[np.bool_]
    given: Array
    moved: dict[tuple[int, Direction], tuple[float, bool]] = field(default_factory=dict)
    zones: dict[int, tuple[float, float]] = field(default_factory=dict)
    bodies: list[Body] = field(default_factory=list)
    grown: set[int] = field(default_factory=set)

    @classmethod
    def after(cls, asked: Asked) -> StepInHand:
        """Nothing is asked for yet. A pinch of an earlier step stays as it is until something else is."""
        hinges, now = len(asked.law), asked.angles()
        pinch = replace(Pinched.none(hinges), present=now.copy())
        pinch.toward[asked.pinched] = asked.prescribed[asked.pinched]
        none = np.zeros(hinges, dtype=bool)
        return cls(now, pinch, none, none.copy(), np.full((2, hinges), np.nan))
