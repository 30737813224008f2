"""Cases `problem_a` and `problem_b` (source 6.4.1, 6.4.2): fit plane curves, and move the tip furthest."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bh.applications.inverse.fit import arc_length, curvature, fit_curve, move_tip
from bh.applications.inverse.models import model
from bh.applications.inverse.optimisers import Genetic, Polished
from bh.applications.inverse.pieces import LEVELS
from bh.applications.inverse.problems import CURVES, Design, resample
from bh.applications.inverse.simulate import simulate
from bh.applications.inverse.surrogate import shipped
from bh.errors import InputError
from verification.framework.checks import CaseResult, Context, line, plot

Array = NDArray[np.float64]
SHEET = LEVELS["arc"][1]  # mesh of strips that are folded: 1.25 mm along the crease, 4 rows a panel
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
    _sheets(result, context, best, errors)
    _plots(result, errors, best)
    return result


def _sheets(
    result: CaseResult, context: Context, best: dict[str, Any], errors: dict[str, list[float]]
) -> None:
    """The same designs folded by the formulation that converges: how near does a sheet come, and what stands?

    The source has a closed form of plane arcs. A sheet opens a little, its ends bow, and where the curvature jumps the
    crease turns a little out of its plane.
    """
    strips: dict[tuple[str, int], Array] = {}
    found: dict[str, list[float]] = {}
    for name, fits in best.items():
        context.tell(f"problem_a: {name}, folded as a sheet")
        found[name] = []
        for n, (problem, top) in enumerate(fits, 1):
            try:
                crease = folded_crease(problem.design(top.x))
            except InputError as error:
                result.notes.append(f"The fit of the {name} with {n} segments is no sheet: {error}.")
                break
            strips[name, n] = crease
            params: dict[str, Any] = {"curve": name, "n": n, "formulation": "consistent"}
            off = np.linalg.norm(resample(crease[:, :2], problem.samples) - problem.goal, axis=-1)
            found[name].append(float(off.mean()) / problem.size)
            says = "mean distance over the length of the curve, folded as a sheet"
            result.check(says, found[name][-1], source=CURVES_IN, params=params)
            high = np.abs(crease[:, 2]).max()
            result.check("crease folded as a sheet, off its plane", high, unit="mm", params=params)
        _stands(result, name, found[name], errors[name])
    three = list(zip(found["spiral"][:3], found["cosine"][:3], strict=False))
    says = "the spiral is fitted worse than the cosine, folded as sheets"
    both: dict[str, Any] = {"formulation": "consistent", "n": len(three)}
    worse = bool(three) and all(s > c for s, c in three)
    result.check(says, worse, reference=1.0, source=CURVES_IN, params=both)
    result.pictures.append(_drawn(context, best, strips))


def folded_crease(design: Design) -> Array:
    """(k, 3) crease of a strip that is folded by the formulation that converges, mm.

    Raises:
        DesignError: it cannot be cut from one sheet, or not be folded.
    """
    setting = replace(model().setting, edge=SHEET.edge, rows=SHEET.rows)
    return simulate(*design.lists(), setting).crease()


def _stands(result: CaseResult, name: str, found: list[float], plane: list[float]) -> None:
    """What the source says of a curve, asked of folded sheets, up to the number of segments that can be cut."""
    params: dict[str, Any] = {"curve": name, "formulation": "consistent"}
    result.check("fits that can be cut with panels of 5 mm", len(found), params={**params, "of": len(plane)})
    if len(found) < 2:
        return
    says = "errors do not grow with n, folded as sheets"
    falls = (np.diff(found) <= 0.0).all()
    result.check(says, falls, reference=1.0, source=CURVES_IN, params={**params, "n": len(found)})
    says = "two segments have less than a quarter of the error of one, folded as sheets"
    result.check(says, found[1] < 0.25 * found[0], reference=1.0, source=CURVES_IN, params=params)
    ratio = found[-1] / plane[len(found) - 1]
    says = "error of the last fit as a sheet over that of the closed form"
    result.check(says, ratio, source=CURVES_IN, params={**params, "n": len(found)})


def _drawn(context: Context, best: dict[str, Any], strips: dict[tuple[str, int], Array]) -> dict[str, str]:
    """Fig. 6.15: targets, closed forms and folded sheets of one, two and most segments, side by side."""
    from matplotlib.figure import Figure

    most = len(next(iter(best.values())))
    counts = sorted({1, 2, most})
    figure = Figure(figsize=(4.0 * len(counts), 3.6 * len(best)), layout="constrained")
    axes = figure.subplots(len(best), len(counts), squeeze=False)
    for row, (name, fits) in zip(axes, best.items(), strict=True):
        for ax, n in zip(row, counts, strict=True):
            problem, top = fits[n - 1]
            ax.plot(
                problem.target[:, 0], problem.target[:, 1], "k-", linewidth=3.0, alpha=0.25, label="target"
            )
            points = problem.points(top.x[None])[0]
            ax.plot(points[:, 0], points[:, 1], "C1-", label="closed form (source)")
            crease = strips.get((name, n))
            if crease is not None:
                ax.plot(crease[:, 0], crease[:, 1], "C0--", label="folded as a sheet")
            said = "" if crease is not None else ": no sheet"
            ax.set_title(f"{name}, n = {n}{said}", fontsize="small")
            ax.set_aspect("equal", adjustable="datalim")
    axes[0, 0].legend(fontsize="small")
    context.folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(context.folder / "problem_a_sheets.png", dpi=90)
    return {
        "file": "problem_a_sheets.png",
        "alt": "targets, closed forms and folded sheets",
        "caption": "Fig. 6.15: fits by the source's closed form, and the same creases folded as sheets.",
    }


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
    converged = _converged(result, 1 if context.quick else most)
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
                line("model that converges", n_all[: len(converged)], converged, "points"),
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
