"""Case `bending_fit` (source 4.5): can what the source does not print explain its bending tests?

Nine figures of the fifteen tests are known: five stiffnesses (two of the straight corrugation, three of the
parabolic-edge one, whose lines coincide) and the ratios of the other three patterns. What is not printed is drawn at
random within stated ranges (`rigs`): stiffness and law of the creases, tape, friction under the bar, depth, place; the
modulus multiplies everything. The five stiffnesses calibrate, the ratios are predicted. Guesses are kept in
`bending_fit_runs.json` as they are done; a run that was stopped goes on.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial

import numpy as np

from verification.framework.checks import CaseResult, Context, Cost, line, plot
from verification.framework.random_scenes import OutOfTimeError, processor_limit
from verification.framework.store import Store
from verification.studies.ch4.corrugations import AZIMUTHS, ORDER, POINT, RATIOS
from verification.studies.ch4.rigs import MODULUS, Guess, beside, drawn, stiffness
from verification.studies.ch4.three_point import SOURCE

CASE, RUNS = "bending_fit", "bending_fit_runs.json"
SEED = 20261130
DRAWN, BESIDE, QUICK = 12, 5, (2, 1)
FAR = 0.15  # of a range, to guesses beside the best
LIMIT_S = 60.0  # processor time of a guess
SOLVED_WITH = 4000.0  # MPa
WITHIN = 0.25  # of a printed figure: as much as the claims of `three_point` are given
Test = tuple[str, str]
KNOWN: dict[Test, float] = {
    ("straight", "x"): 0.15,
    ("straight", "y"): 4.0,
    ("parabolic-edge", "x"): 2.5,
    ("parabolic-edge", "xy"): 2.5,
    ("parabolic-edge", "y"): 2.5,
}
PREDICTED = tuple(kind for kind in ORDER if not any(kind == known for known, _ in KNOWN))


@dataclass(frozen=True)
class Trial:
    """A guess, and its stiffnesses with 4000 MPa by test ("kind/direction", N/mm); nan where there is none."""

    guess: Guess
    found: Mapping[str, float]
    seconds: float

    def of(self, kind: str, name: str) -> float:
        """One of them, N/mm."""
        return self.found.get(f"{kind}/{name}", math.nan)

    @property
    def scale(self) -> float:
        """Modulus over 4000 MPa that fits best, within its range; springs of tape and bar go with it."""
        logs = [math.log(value / self.of(*test)) for test, value in KNOWN.items()]
        least, most = (limit / SOLVED_WITH for limit in MODULUS)
        return float(np.clip(math.exp(np.mean(logs)), least, most)) if np.isfinite(logs).all() else 1.0

    @property
    def misfit(self) -> float:
        """Root mean square of ln(simulated over printed) of the five; infinite where one is missing."""
        logs = [math.log(self.scale * self.of(*test) / value) for test, value in KNOWN.items()]
        return float(np.sqrt(np.mean(np.square(logs)))) if np.isfinite(logs).all() else math.inf


def tried(guess: Guess, tests: Sequence[Test]) -> Trial:
    """The tests with a guess, given up after `LIMIT_S`.

    Args:
        guess: what is not printed.
        tests: kind and direction of each.
    """
    began, found = time.process_time(), {}
    try:
        with processor_limit(LIMIT_S):
            for kind, name in tests:
                found[f"{kind}/{name}"] = stiffness(guess, kind, name)
    except OutOfTimeError:
        pass
    return Trial(guess, found, time.process_time() - began)


def run(context: Context) -> CaseResult:
    """Guesses anywhere, then beside the best, then the other patterns with the best."""
    store = Store.open(context.folder, RUNS, context.quick)
    anywhere, near = QUICK if context.quick else (DRAWN, BESIDE)
    trials: list[Trial] = []
    for number in range(anywhere + near):
        rng = np.random.default_rng([SEED, number])
        guess = drawn(rng) if number < anywhere else beside(best(trials).guess, rng, FAR)
        trials.append(_kept(context, store, str(number), guess, tuple(KNOWN)))
    chosen = best(trials)
    others = tuple((kind, name) for kind in PREDICTED for name in AZIMUTHS)
    return judged(trials, _kept(context, store, "others", chosen.guess, others))


def _kept(context: Context, store: Store, key: str, guess: Guess, tests: Sequence[Test]) -> Trial:
    if key not in store.runs:
        context.tell(f"{CASE}: guess {key}")
        store.keep(key, asdict(tried(guess, tests)))
    kept = store.runs[key]
    return Trial(Guess(**kept["guess"]), kept["found"], kept["seconds"])


def best(trials: Sequence[Trial]) -> Trial:
    """The guess that comes nearest to the five."""
    return min(trials, key=lambda trial: trial.misfit)


def judged(trials: Sequence[Trial], others: Trial) -> CaseResult:
    """The case from its guesses.

    Args:
        trials: the five tests with each guess.
        others: the tests of the other patterns with the best one.
    """
    result = CaseResult(
        name=CASE,
        title="Can what is not printed explain the bending tests?",
        question="Which creases, tape and friction reproduce the printed stiffnesses and ratios together?",
        source=SOURCE,
    )
    chosen = best(trials)
    scale = chosen.scale
    params = {**chosen.guess.words(), "E": round(scale * SOLVED_WITH), "formulation": "consistent"}
    took = Cost(wall_time_s=sum(trial.seconds for trial in trials))
    for (kind, name), printed in KNOWN.items():
        result.check(
            "stiffness that calibrates, N/mm, by the best guess",
            scale * chosen.of(kind, name),
            unit="N/mm",
            reference=printed,
            params={**params, "kind": kind, "about": name},
            path=took,
        )
    for kind in ORDER:
        source = others if kind in PREDICTED else chosen
        result.check(
            "k_x / k_y, predicted by the best guess" if kind in PREDICTED else "k_x / k_y, by the best guess",
            source.of(kind, "x") / source.of(kind, "y"),
            reference=RATIOS[kind],
            params={**params, "kind": kind},
        )
    for kind in PREDICTED:
        for name in AZIMUTHS:
            value = scale * others.of(kind, name)
            where = {**params, "kind": kind, "about": name}
            result.check(
                "stiffness, predicted by the best guess", value, unit="N/mm", source="measured", params=where
            )
    for kind in POINT:
        x, xy, y = (others.of(kind, name) for name in ("x", "xy", "y"))
        result.check(
            "point patterns: k_x < k_xy < k_y, by the best guess",
            float(x < xy < y),
            reference=1.0,
            params={**params, "kind": kind},
        )
    _ranges(result, trials)
    _plots(result, trials, chosen)
    return result


def _ranges(result: CaseResult, trials: Sequence[Trial]) -> None:
    """What all guesses span: a printed figure outside of that cannot be explained by them."""
    whole = [trial for trial in trials if math.isfinite(trial.misfit)]
    check = partial(result.check, params={"guesses": len(trials), "formulation": "consistent"})
    check("guesses with all five tests", len(whole), source="measured")
    if not whole:
        return
    check("misfit of the best guess, root mean square of ln", best(trials).misfit, source="measured")
    firm = {
        "parabolic-edge about x over straight about y": (
            ("parabolic-edge", "x"),
            ("straight", "y"),
        ),
        "parabolic-edge about x over about y": (("parabolic-edge", "x"), ("parabolic-edge", "y")),
        "parabolic-edge about y over straight about y": (("parabolic-edge", "y"), ("straight", "y")),
        "straight about x over about y": (("straight", "x"), ("straight", "y")),
    }
    for words, (above, below) in firm.items():
        ratios = [trial.of(*above) / trial.of(*below) for trial in whole]
        printed = KNOWN[above] / KNOWN[below]
        span = {"guesses": len(whole), "printed": printed, "formulation": "consistent"}
        for name, value in (("least", min(ratios)), ("largest", max(ratios))):
            result.check(f"{words}: {name} of all guesses", value, source="measured", params=span)
    within = sum(
        all(abs(trial.scale * trial.of(*test) / value - 1.0) <= WITHIN for test, value in KNOWN.items())
        for trial in whole
    )
    check(f"guesses within {100 * WITHIN:g} % of all five", within, source="measured")
    result.notes.append(
        "Ranges: L* 2 to 100 mm; creases that are springs with one rest angle, or yield at 0.3 to 3 N mm / mm and "
        "were folded by one couple and let go; sheets that lie free, or are held by tape sideways (0.03 to 30 N/mm), "
        "or down as well; a bar without friction, or to which mountains stick (up to 10 N/mm); 5.5 to 6.5 mm deep; up "
        "to 3 mm off the middle; E 3000 to 5500 MPa. Coulomb's friction lies between the two bars. The bar keeps the "
        "slope with which it comes to lie on two mountains; the parabolic-edge corrugation is symmetric under a bar "
        "along x, where it misses most, so that one free to tilt is no other there."
    )


def _plots(result: CaseResult, trials: Sequence[Trial], chosen: Trial) -> None:
    x = [float(k) for k in range(len(KNOWN))]
    series = [
        line(
            "guesses" if k == 0 else "",
            x,
            [trial.scale * trial.of(*test) for test in KNOWN],
            "points",
        )
        for k, trial in enumerate(trials)
        if math.isfinite(trial.misfit)
    ]
    series.append(line("the best guess", x, [chosen.scale * chosen.of(*test) for test in KNOWN]))
    series.append(line("printed", x, list(KNOWN.values()), "reference"))
    result.plots.append(
        plot(
            "bending-fit",
            "Five printed stiffnesses and all guesses",
            ", ".join(f"{k}: {kind} about {name}" for k, (kind, name) in enumerate(KNOWN)),
            "stiffness, N/mm",
            series,
            "Each guess with the modulus that fits best.",
            log="y",
        )
    )
