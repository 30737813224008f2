"""Cases `problem_a` and `problem_b` (source 6.4.1, 6.4.2): fit plane curves, and move the tip furthest."""

from __future__ import annotations

import time
from functools import partial
from typing import Any

import numpy as np

from bh.applications.inverse.fit import arc_length, curvature, fit_curve, move_tip
from bh.applications.inverse.models import model
from bh.applications.inverse.optimisers import Genetic, Polished
from bh.applications.inverse.problems import CURVES
from bh.applications.inverse.simulate import simulate
from bh.applications.inverse.surrogate import shipped
from verification.framework.checks import CaseResult, Context, line, plot

CURVES_IN = "source 6.4.1, Fig. 6.15"
TIP = "source 6.4.2, Fig. 6.17"


def run(context: Context) -> CaseResult:
    """Problem A: parabola, spiral and cosine with one to six segments."""
    result = CaseResult(
        name="problem_a",
        title="A crease that folds along a plane curve",
        question="How near do one to six circular segments come to the source's three curves?",
        source=CURVES_IN,
    )
    most = 2 if context.quick else 6
    errors: dict[str, list[float]] = {}
    best: dict[str, Any] = {}
    for name, target in CURVES.items():
        context.tell(f"problem_a: {name}")
        check = partial(result.check, params={"curve": name})
        check(
            "arc length",
            arc_length(target),
            unit="mm",
            reference=300.0,
            source="Eq. 6.17 to 6.19",
            tolerance=3e-4,
        )
        began = time.perf_counter()
        found = fit_curve(target, most, Polished(Genetic(60, 20)))
        errors[name] = [float(f.value) for _, f in found]
        best[name] = found
        for n, value in enumerate(errors[name], 1):
            result.check(
                "mean distance over the length of the curve",
                value,
                source=CURVES_IN,
                params={"curve": name, "n": n},
            )
        falls = float((np.diff(errors[name]) <= 0.0).all())
        check("errors do not grow with n", falls, reference=1.0, source=CURVES_IN, tolerance=0.0)
        result.check(
            "two segments over one, error",
            errors[name][1] / errors[name][0],
            source=CURVES_IN + ": one is much worse",
            params={"curve": name, "seconds": time.perf_counter() - began},
        )
        check(
            "two segments have less than a quarter of the error of one",
            errors[name][1] < 0.25 * errors[name][0],
            reference=1.0,
            source=CURVES_IN,
            tolerance=0.0,
        )
    worse = all(s > c for s, c in zip(errors["spiral"][:3], errors["cosine"][:3], strict=True))
    result.check(
        "the spiral is fitted worse than the cosine (n = 1 to 3)",
        worse,
        reference=1.0,
        source=CURVES_IN + ": its curvature has the larger slope",
        tolerance=0.0,
    )
    _plots(result, errors, best)
    return result


def _plots(result: CaseResult, errors: dict[str, list[float]], best: dict[str, Any]) -> None:
    """Errors over segments, curvatures of the targets, and the fits."""
    most = len(next(iter(errors.values())))
    counts = [float(i) for i in range(1, most + 1)]
    result.plots.append(
        plot(
            "problem-a-errors",
            "Error of the fit",
            "segments",
            "mean distance / length",
            [line(name, counts, values, "points") for name, values in errors.items()],
            "Fig. 6.15: errors fall with the number of segments, most of all from one to two.",
            log="y",
        )
    )
    series = []
    for name, target in CURVES.items():
        s, k = curvature(target)
        keep = slice(50, None, 200)
        series.append(line(name, s[keep].tolist(), np.clip(k[keep], -0.1, 0.1).tolist()))
    result.plots.append(
        plot(
            "problem-a-curvature",
            "Curvature of the targets",
            "arc length, mm",
            "curvature, 1/mm",
            series,
            "Fig. 6.16, cut off at 0.1 /mm. Segments fit those best whose curvature changes least.",
        )
    )
    for name, found in best.items():
        target = CURVES[name][::100]
        shapes = [line("target", target[:, 0].tolist(), target[:, 1].tolist(), "reference")]
        for count in (1, 2, most):
            problem, top = found[count - 1]
            points = problem.points(top.x[None])[0]
            shapes.append(line(f"n = {count}", points[:, 0].tolist(), points[:, 1].tolist()))
        result.plots.append(
            plot(
                f"problem-a-{name}",
                f"Fit of the {name}",
                "x, mm",
                "y, mm",
                shapes,
                "Folded crease and target.",
            )
        )


def run_b(context: Context) -> CaseResult:
    """Problem B: the largest movement of the tip by pinching, one to four segments; the best strips are simulated."""
    result = CaseResult(
        name="problem_b",
        title="The crease whose tip moves furthest when it is pinched",
        question="How far can pinches move the end of a crease of one to four segments?",
        source=TIP,
    )
    context.tell("problem_b")
    most = 2 if context.quick else 4
    found = move_tip(most, Polished(Genetic(100, 60)), surrogate=shipped())
    moved = [-float(f.value) for _, f in found]
    for n, (problem, top) in enumerate(found, 1):
        design = problem.design(top.x, top.on)
        result.check(
            "largest movement of the tip",
            moved[n - 1],
            unit="mm",
            source=TIP,
            params={
                "n": n,
                "k0": [round(float(k), 5) for k in design.k0],
                "length": [round(float(s), 1) for s in design.length],
                "pinched": [int(f) for f in design.pinched],
            },
        )
        check = partial(result.check, params={"n": n})
        check("the rules allow it", top.allowed, reference=1.0, source="Eq. 6.21", tolerance=0.0)
        after, before = (
            simulate(*design.lists()),
            simulate(design.k0.tolist(), design.length.tolist(), [False] * n),
        )
        whole = float(np.linalg.norm(after.t - before.t))
        check(
            "the same of the whole simulated strip",
            whole,
            unit="mm",
            reference=moved[n - 1],
            source=TIP,
            tolerance=0.02,
        )
        check("the first segment is pinched", design.pinched[0], reference=1.0, source=TIP)
        check(
            "sector angle of the first segment over half a turn",
            abs(problem.surrogate.domain.curvature(design.k0[0])) * design.length[0] / np.pi,
            source=TIP + ": moderately curved, long",
        )
    steps = np.diff([0.0, *moved])
    result.check(
        "movement grows with every segment", (steps > 0.0).all(), reference=1.0, source=TIP, tolerance=0.0
    )
    n_all = [float(i) for i in range(1, most + 1)]
    converged = _converged(result, most)
    if most > 2:
        fit = np.polyfit(n_all, moved, 1)
        rest = np.abs(np.polyval(fit, n_all) - moved).max() / moved[-1]
        result.check("largest distance from a line in n, over the last", rest, source=TIP + ": nearly linear")
    result.plots.append(
        plot(
            "problem-b-tip",
            "Largest movement of the tip",
            "segments",
            "mm",
            [
                line("source's model", n_all, moved, "points"),
                line("model that converges", n_all, converged, "points"),
            ],
            "Fig. 6.17 (c), and the same asked of the model that converges.",
        )
    )
    return result


def _converged(result: CaseResult, most: int) -> list[float]:
    """The same problem asked of the model that converges: movements of the tip, mm."""
    found = move_tip(most, Polished(Genetic(100, 60)), surrogate=model())
    moved = [-float(f.value) for _, f in found]
    for n, (problem, top) in enumerate(found, 1):
        design = problem.design(top.x, top.on)
        k0, length, pinched = design.lists()
        after, before = model().land(k0, length, pinched), model().land(k0, length, [False] * n)
        check = partial(result.check, params={"n": n, "formulation": "consistent"})
        check(
            "largest movement of the tip, model that converges",
            moved[n - 1],
            unit="mm",
            params={
                "n": n,
                "formulation": "consistent",
                "k0": [round(k, 5) for k in k0],
                "length": [round(s, 1) for s in length],
                "pinched": [int(on) for on in pinched],
            },
        )
        whole = float(np.linalg.norm(after.end - before.end))
        check(
            "the same of the whole simulated strip, model that converges",
            whole,
            unit="mm",
            reference=moved[n - 1],
            source="chain of pieces",
            tolerance=0.01,
        )
        check("its error bar, model that converges", after.bar + before.bar, unit="mm")
        check("the first segment is pinched, model that converges", pinched[0], reference=1.0, source=TIP)
    grows = bool((np.diff([0.0, *moved]) > 0.0).all())
    result.check("movement grows with every segment, model that converges", grows, reference=1.0, source=TIP)
    return moved
