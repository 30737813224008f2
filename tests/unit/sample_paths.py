"""Models and helpers that tests of paths share."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

import numpy as np
import pytest

import meshes
from bh import (
    Force,
    Model,
    Moment,
    Newton,
    Path,
    Sheet,
    trace,
)
from bh.solvers.newton import Solution

SHEET = Sheet(E=4000.0, t=0.127)
D = SHEET.bending_stiffness(nu=0.0)
MESH = meshes.structured(meshes.annulus_sector(100.0, 10.0, math.pi / 4), along=8)
FREE = Model(MESH, SHEET, formulation="bars-and-hinges")
CORNERS = (
    FREE.support("corner:inner-start", "xyz")
    .support("corner:outer-start", "yz")
    .support("corner:inner-end", "z")
)


def column() -> Model:
    """A strip that is shortened beyond its buckling load: the path leaves an unstable state on the way."""
    strip = meshes.structured(meshes.strip(40.0, 8.0), along=20)
    model = (
        Model(strip, Sheet(E=1000.0, t=0.2), formulation="bars-and-hinges")
        .support("edge:start", "xyz")
        .support("edge:end", "yz")
    )
    return model.displace("edge:end", "x", -0.02)


def several_steps() -> Model:
    model = CORNERS.crease("crease", Lstar=30.0).fold("crease", rest=2.4, Lstar=30.0)
    model = model.step(Force("corner:outer-end", each=(0.0, 0.0, 1e-4)), Moment("crease", 1e-4))
    return model.fold("crease", to=2.6).fold("crease", to=2.0)


MODELS = {
    "held": FREE.fold("crease", to=1.2),
    "spring, supported": CORNERS.fold("crease", rest=1.2, Lstar=20.0),
    "several steps": several_steps(),
    "column that buckles": column(),
}
every = pytest.mark.parametrize("name", MODELS)


def reached(model: Model, **how: Any) -> Path:
    path = trace(model, **how)
    assert path.outcome == "reached", path.reason
    return path


def assert_same_records(one: Path, two: Path) -> None:
    """Bit for bit, but for the time that it took."""
    assert len(one) == len(two)
    for a, b in zip(one.records, two.records, strict=True):
        assert np.array_equal(a.q, b.q)
        same = [f.name for f in fields(a) if f.name not in ("q", "wall_time_s", "critical")]
        assert [getattr(a, name) for name in same] == [getattr(b, name) for name in same]
        for c, d in zip(a.critical, b.critical, strict=True):
            assert all(np.array_equal(getattr(c, f.name), getattr(d, f.name)) for f in fields(c))


class Meter:
    def __init__(self) -> None:
        self.updates: list[tuple[int, int, float, int, float]] = []
        self.closed: list[str] = []

    def update(self, step: int, steps: int, lam: float, iterations: int, energy: float) -> None:
        self.updates.append((step, steps, lam, iterations, energy))

    def close(self, outcome: str) -> None:
        self.closed.append(outcome)


class Refusing(Newton):
    """Solves up to lambda = 0.5 and then gives up."""

    def solve(self, system: Any, q: Any, lam: float, *rest: Any, **more: Any) -> Solution:
        if lam > 0.5:
            return Solution(q, system.evaluate(q, lam), 1, False, "no more")
        return super().solve(system, q, lam, *rest, **more)
