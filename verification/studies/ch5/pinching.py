"""What the cases of Chapter 5 share: pinched sheets with parallel creases, and what is read from them.

The source pinches by forces over a zone whose length it does not print, with bars and hinges of one row of cells a
panel (alpha = 5). Two ways stand for that:

- "as the source": bars and hinges, the pinched angle over 10 mm of the crease ("grip"), the rest left to the sheet;
- "converged": the consistent formulation, a raised cosine over 20 mm, half as wide at half its depth. With a grip
  the energy would grow with the logarithm of the mesh, so that nothing converges; the consistent formulation with a
  grip tells the formulation from the profile.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

import bh
import meshes
from bh import Model, Path, Sheet, State, trace
from bh.analysis.midplane import MidPlane, midplane
from verification.framework.checks import CaseResult, line, plot

Array = NDArray[np.float64]
LENGTH, SPACING, LSTAR = 100.0, 5.0, 2.0  # mm (5.3.2)
SHEET = Sheet(E=4000.0, t=0.5)
FOLDED, PINCHED, NEARLY = (
    0.5 * math.pi,
    math.pi / 14.0,
    math.pi / 18.0,
)  # rad; NEARLY is what is left when pinched
END = 8.0  # mm at either end of the crease whose finite differences are not to be used (source 5.4.1)
CLEAR = 4.0  # mm beyond the zone from where a stencil of seven nodes does not reach into it


@dataclass(frozen=True)
class Way:
    """How a pinch is modelled; `meshes` are (cells along 100 mm, rows a panel), coarse first."""

    name: str
    formulation: str
    profile: str
    zone: float
    meshes: tuple[tuple[int, int], ...]
    judged: tuple[int, int] = (100, 1)  # the source's own mesh, or the finer one of a way that converges
    # N mm / mm, more than is needed, where couples close the crease and nothing is held
    couple: float | None = None

    def taken(self, quick: bool) -> tuple[tuple[int, int], ...]:
        """Meshes of a run."""
        return self.meshes[:1] if quick else self.meshes


AS_SOURCE = Way("as the source", "bars-and-hinges", "grip", 10.0, ((100, 1), (200, 2)))
CONVERGED = Way("converged", "consistent", "cosine", 20.0, ((50, 1), (100, 2)), (100, 2))
WAYS = (AS_SOURCE, CONVERGED)


@dataclass(frozen=True, eq=False)
class Pinched:
    """A sheet that was folded and pinched."""

    path: Path
    zone: float

    @property
    def reached(self) -> bool:
        """Whether it was folded and pinched to the end."""
        return self.path.reached

    @cached_property
    def folded(self) -> State:
        """The state before the pinch."""
        last = max(i for i, record in enumerate(self.path.records) if record.step == 0)
        return self.path[last]

    @cached_property
    def planes(self) -> tuple[MidPlane, MidPlane]:
        """Mid-planes before and after the pinch."""
        return midplane(self.folded), midplane(self.path[-1])

    @cached_property
    def bend(self) -> float:
        """Change of the bending angle beta_f - beta, degrees; positive where the sheet bends more."""
        before, after = (float(plane.bending()) for plane in self.planes)
        return math.degrees(before - after)

    @cached_property
    def twist(self) -> float:
        """Change of the twist angle at the right end theta_f - theta, degrees."""
        before, after = (float(plane.twist()) for plane in self.planes)
        return math.degrees(before - after)

    @cached_property
    def crease(self) -> bh.creases.CreaseProfile:
        """The first crease after the pinch."""
        return bh.creases.along(self.path[-1], self.path.model.mesh.creases[0])

    @cached_property
    def beyond(self) -> NDArray[np.bool_]:
        """(k,) nodes of the right half, beyond the pinched zone and off the end."""
        s = self.crease.u - 0.5 * self.crease.u[-1]
        return np.asarray((s > 0.5 * self.zone + CLEAR) & (s < 0.5 * self.crease.u[-1] - END))

    def peak(self, values: Array) -> tuple[float, float]:
        """Value of largest size beyond the zone, and its distance from the middle, mm."""
        where = np.flatnonzero(self.beyond)
        best = where[int(np.argmax(np.abs(values[where])))]
        return float(values[best]), float(self.crease.u[best] - 0.5 * self.crease.u[-1])

    def inside(self, values: Array) -> Array:
        """Values at the nodes of the pinched zone."""
        return np.asarray(values[np.abs(self.crease.u - 0.5 * self.crease.u[-1]) <= 0.5 * self.zone])


@dataclass(frozen=True)
class Stiffness:
    """What a sheet is made of, and the length scale of its creases, mm."""

    sheet: Sheet = SHEET
    Lstar: float = LSTAR


OF_5_3 = Stiffness()


def pinched(
    way: Way,
    mesh: tuple[int, int],
    curvature: float,
    creases: int = 1,
    spacing: float = SPACING,
    stiffness: Stiffness = OF_5_3,
    left: float = PINCHED,
    folds: Sequence[str] | None = None,
) -> Pinched:
    """Fold all creases to 90 degrees by the rest angle of their springs, then pinch their middles.

    Args:
        way: formulation, and how the pinch is modelled.
        mesh: cells along the creases, and rows a panel.
        curvature: of the flat creases, 1/mm.
        creases: how many.
        spacing: of the creases, mm.
        stiffness: of the sheet and its creases.
        left: dihedral angle that is left until closed, rad.
        folds: "mountain" or "valley" of every crease; None alternates.
    """
    along, rows = mesh
    pattern = meshes.parallel_creases(curvature, LENGTH, spacing, creases, folds)  # type: ignore[arg-type]
    model = Model(
        meshes.structured(pattern, along=along, rows=rows),
        stiffness.sheet,
        formulation=way.formulation,
        contact=False,
    )
    model = model.fold("all", by=FOLDED, Lstar=stiffness.Lstar)
    how = "imposed" if way.couple is None else "couple"
    path = trace(
        model.pinch(
            "all", by=math.pi - left, length=way.zone, profile=way.profile, how=how, couple=way.couple
        ),
        neighbours=False,  # the figures are of the branch that the source follows
    )
    return Pinched(path, way.zone)


def reached(result: CaseResult, every: Sequence[Pinched]) -> None:
    """How many of all simulations ended early, and what they took."""
    result.check(
        "simulations that did not reach their end",
        sum(not p.reached for p in every),
        reference=0.0,
        source="none unconverged with default settings",
        tolerance=0.0,
        params={"simulations": len(every)},
    )
    result.check(
        "time of all of them, one thread",
        sum(p.path.wall_time_s for p in every),
        unit="s",
        source="target: all of Chapter 5 in 180 s on two cores",
        params={"simulations": len(every)},
    )


@dataclass(frozen=True)
class Proportion:
    """A least-squares line through the origin."""

    slope: float
    r2: float


def proportion(x: Sequence[float], y: Sequence[float]) -> Proportion:
    """Fit y = slope x; R^2 is one less the squares that are left over those about the mean."""
    a, b = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    slope = float(a @ b / (a @ a))
    spread = float(((b - b.mean()) ** 2).sum())
    return Proportion(slope, 1.0 - float(((b - slope * a) ** 2).sum()) / max(spread, 1e-300))


def angle_plots(
    result: CaseResult,
    figure: str,
    title: str,
    x: tuple[str, Sequence[float]],
    curves: Mapping[str, Sequence[Pinched]],
    caption: str,
    way: str = "",
) -> None:
    """Changes of the bending and of the twist angle over x (label, values), a line for each of some rows of sheets."""
    for name, angle, read in (("bending", "beta_f - beta", "bend"), ("twist", "theta_f - theta", "twist")):
        series = [
            line(label, list(x[1]), [getattr(p, read) for p in sheets]) for label, sheets in curves.items()
        ]
        result.plots.append(
            plot(
                f"{figure}-{name}{way}",
                f"Change of the {name} angle{title}",
                x[0],
                f"{angle}, degrees",
                series,
                caption,
            )
        )
