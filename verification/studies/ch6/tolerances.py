"""Case `tolerances`: 200 whole strips of five designs, made with random errors, against the ellipsoid of each design.

The ellipsoid is of chains of pieces (`bh.applications.inverse.tolerances.region`), the strips are simulated whole, both
on the same mesh and beside the strip that is made exactly there. (On two rows a pinch turns the strip by a tenth less
than in the limit, so the ellipsoid of the limit has other directions.) Some five minutes of processor time; every strip
is stored when it is done.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import bh.sweep
from bh.applications.inverse.converged import Converged
from bh.applications.inverse.models import model
from bh.applications.inverse.pieces import LEVELS
from bh.applications.inverse.problems import Design
from bh.applications.inverse.reach import Reach
from bh.applications.inverse.simulate import simulate
from bh.applications.inverse.tolerances import Region, Spreads, made, region
from bh.solvers.outcome import Outcome
from verification.framework.checks import CaseResult, Context
from verification.studies.ch6.landing import solved

Array = NDArray[np.float64]
TARGETS = (
    (-80.0, 100.0, -5.0),
    (-60.0, 120.0, -4.0),
    (50.0, 150.0, 0.0),
    (0.0, 120.0, -8.0),
    (100.0, 60.0, -3.0),
)
STRIPS, FEW = 200, 5
COARSE = 0  # level of the meshes of whole strips
LEVEL = LEVELS["pinch"][COARSE]
SEED, SPREADS, PROBABILITY = 7, Spreads(), 0.95
SHARE = 0.046  # three standard deviations of the share of 200 strips inside, where 0.95 are to be


@dataclass(frozen=True)
class StripTask:
    """A strip of a design that is made with errors.

    Attributes:
        k0: curvatures before folding, 1/mm.
        length: of the segments, mm.
        pinched: of each.
    """

    k0: tuple[float, ...]
    length: tuple[float, ...]
    pinched: tuple[bool, ...]

    @property
    def identity(self) -> str:
        """Of the task and all that its strips depend on."""
        return f"strip {self!r} {model().setting!r} {LEVEL} {SEED} {SPREADS!r}"

    def __call__(self, point: Mapping[str, Any]) -> dict[str, Any]:
        """Where the strip with the errors of the number {"strip"} ends; that of number -1 is made exactly."""
        number = int(point["strip"])
        setting = replace(model().setting, edge=LEVEL.edge, rows=LEVEL.rows)
        design = Design(np.array(self.k0), np.array(self.length), np.array(self.pinched))
        if number >= 0:
            design, setting = made(design, setting, SPREADS, np.random.default_rng([SEED, number]))
        return {"end": simulate(*design.lists(), setting).t}


def run(context: Context) -> CaseResult:
    """Shares of strips inside the ellipsoids, and their scatter along the axes."""
    result = CaseResult(
        name="tolerances",
        title="Where strips end that are not made exactly",
        question="Does the ellipsoid of a design hold the strips that are made with the spreads that it is for?",
        source="whole strips with random errors, simulated on one mesh",
    )
    context.folder.mkdir(parents=True, exist_ok=True)
    count = FEW if context.quick else STRIPS
    for number, target in enumerate(TARGETS[:1] if context.quick else TARGETS):
        context.tell(f"tolerances: {count} strips for the target {target}")
        design = Reach(verify=False)(target).design
        k0, length, pinched = design.lists()
        task = StripTask(tuple(k0), tuple(length), tuple(pinched))
        points = bh.sweep.table({"strip": list(range(-1, count))})
        data = solved(task, points, context.folder / f"tolerances_{number}_{count}.nc", 0)
        _compare(result, target, design, data)
    return result


def _compare(result: CaseResult, target: tuple[float, float, float], design: Design, data: Any) -> None:
    good = data["outcome"].values == Outcome.REACHED
    params = {"target": list(target), "strips": int(good.sum()) - 1, "segments": design.n}
    result.check(
        "strips that were reached",
        good.sum() - 1,
        reference=float(len(good) - 1),
        tolerance=0.0,
        params=params,
    )
    ends = data["end"].values[good]
    apart = ends[1:] - ends[0]
    limit = model()
    assert isinstance(limit, Converged)
    where = region(limit.on_mesh(COARSE), design, SPREADS, PROBABILITY)
    judged = len(apart) == STRIPS
    result.check(
        "share of strips in the ellipsoid of 95 %",
        where.holds(apart).mean(),
        reference=PROBABILITY,
        tolerance=SHARE / PROBABILITY if judged else None,
        params=params,
    )
    own = Region.of(apart, PROBABILITY)
    for i, name in enumerate(("longest", "middle", "shortest")):
        result.check(f"{name} semi-axis of the ellipsoid", where.axes[i], unit="mm", params=params)
        scatter = ((apart - where.middle) @ where.directions[:, i]).std()
        sampled = where.axes[i] / where.quantile
        result.check(
            f"scatter of strips along the {name} axis over that of the ellipsoid",
            scatter / sampled,
            reference=1.0,
            params=params,
        )
    result.check("longest semi-axis of the strips' own ellipsoid", own.axes[0], unit="mm", params=params)
    fine = region(limit, design, SPREADS, PROBABILITY)
    result.check(
        "longest semi-axis in the limit of fine meshes, which users are told",
        fine.axes[0],
        unit="mm",
        params=params,
    )
