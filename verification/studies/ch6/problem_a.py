"""Cases `problem_a` and `problem_b` (source 6.4.1, 6.4.2): fit plane curves, and move the tip furthest."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from bh.applications.inverse.fit import arc_length, curvature, fit_curve, move_tip
from bh.applications.inverse.optimisers import Genetic, Polished
from bh.applications.inverse.problems import CURVES
from bh.applications.inverse.simulate import simulate
from verification.framework.checks import CaseResult, Check, Context, line, plot

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
    most = 3 if context.quick else 6
    errors: dict[str, list[float]] = {}
    best: dict[str, Any] = {}
    for name, target in CURVES.items():
        context.tell(f"problem_a: {name}")
        _add(
            result,
            "problem_a",
            "arc length",
            arc_length(target),
            "mm",
            300.0,
            3e-4,
            "Eq. 6.17 to 6.19",
            curve=name,
        )
        began = time.perf_counter()
        found = fit_curve(target, most, Polished(Genetic(60, 20)))
        errors[name] = [float(f.value) for _, f in found]
        best[name] = found
        for n, value in enumerate(errors[name], 1):
            _add(result, "problem_a", "mean distance over the length of the curve", value, "", None, None, CURVES_IN,
                 curve=name, n=n)  # fmt: skip
        falls = float((np.diff(errors[name]) <= 0.0).all())
        _add(result, "problem_a", "errors do not grow with n", falls, "", 1.0, 0.0, CURVES_IN, curve=name)
        _add(result, "problem_a", "two segments over one, error", errors[name][1] / errors[name][0], "", None, None,
             CURVES_IN + ": one is much worse", curve=name, seconds=time.perf_counter() - began)  # fmt: skip
        _add(result, "problem_a", "two segments have less than a quarter of the error of one",
             float(errors[name][1] < 0.25 * errors[name][0]), "", 1.0, 0.0, CURVES_IN, curve=name)  # fmt: skip
    worse = all(s > c for s, c in zip(errors["spiral"][:3], errors["cosine"][:3], strict=True))
    _add(result, "problem_a", "the spiral is fitted worse than the cosine (n = 1 to 3)", float(worse), "", 1.0, 0.0,
         CURVES_IN + ": its curvature has the larger slope")  # fmt: skip
    counts = [float(i) for i in range(1, most + 1)]
    result.plots.append(
        plot("problem-a-errors", "Error of the fit", "segments", "mean distance / length",
             [line(name, counts, values, "points") for name, values in errors.items()],
             "Fig. 6.15: errors fall with the number of segments, most of all from one to two.", log="y")
    )  # fmt: skip
    series = []
    for name, target in CURVES.items():
        s, k = curvature(target)
        keep = slice(50, None, 200)
        series.append(line(name, s[keep].tolist(), np.clip(k[keep], -0.1, 0.1).tolist()))
    result.plots.append(
        plot("problem-a-curvature", "Curvature of the targets", "arc length, mm", "curvature, 1/mm", series,
             "Fig. 6.16, cut off at 0.1 /mm. Segments fit those best whose curvature changes least.")
    )  # fmt: skip
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
    return result


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
    found = move_tip(most, Polished(Genetic(100, 60)))
    moved = [-float(f.value) for _, f in found]
    for n, (problem, top) in enumerate(found, 1):
        design = problem.design(top.x, top.on)
        _add(result, "problem_b", "largest movement of the tip", moved[n - 1], "mm", None, None, TIP, n=n,
             k0=[round(float(k), 5) for k in design.k0], length=[round(float(s), 1) for s in design.length],
             pinched=[int(f) for f in design.pinched])  # fmt: skip
        _add(result, "problem_b", "the rules allow it", float(top.allowed), "", 1.0, 0.0, "Eq. 6.21", n=n)
        after, before = (
            simulate(*design.lists()),
            simulate(design.k0.tolist(), design.length.tolist(), [False] * n),
        )
        whole = float(np.linalg.norm(after.t - before.t))
        _add(
            result,
            "problem_b",
            "the same of the whole simulated strip",
            whole,
            "mm",
            moved[n - 1],
            0.02,
            TIP,
            n=n,
        )
        _add(
            result,
            "problem_b",
            "the first segment is pinched",
            float(design.pinched[0]),
            "",
            1.0,
            None,
            TIP,
            n=n,
        )
        _add(result, "problem_b", "sector angle of the first segment over half a turn", float(
            abs(problem.surrogate.domain.curvature(design.k0[0])) * design.length[0] / np.pi
        ), "", None, None, TIP + ": moderately curved, long", n=n)  # fmt: skip
    steps = np.diff([0.0, *moved])
    _add(
        result,
        "problem_b",
        "movement grows with every segment",
        float((steps > 0.0).all()),
        "",
        1.0,
        0.0,
        TIP,
    )
    n_all = [float(i) for i in range(1, most + 1)]
    if most > 2:
        fit = np.polyfit(n_all, moved, 1)
        rest = np.abs(np.polyval(fit, n_all) - moved).max() / moved[-1]
        _add(result, "problem_b", "largest distance from a line in n, over the last", float(rest), "", None, None,
             TIP + ": nearly linear")  # fmt: skip
    result.plots.append(
        plot(
            "problem-b-tip",
            "Largest movement of the tip",
            "segments",
            "mm",
            [line("found", n_all, moved, "points")],
            "Fig. 6.17 (c).",
        )
    )
    return result


def _add(
    result: CaseResult, case: str, quantity: str, value: float, unit: str, reference: float | None,
    tolerance: float | None, source: str, **params: Any,
) -> None:  # fmt: skip
    result.checks.append(Check(case, quantity, params, float(value), unit, reference, source, tolerance))
