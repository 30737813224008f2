"""Case `bending_fit`: guesses stay within their ranges, and what is best is told with its residuals."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from verification.studies.ch4.bending_fit import KNOWN, PREDICTED, Trial, best, judged
from verification.studies.ch4.rigs import (
    DEPTH,
    FREE,
    GRIP,
    LSTAR,
    MODULUS,
    OFFSET,
    TAPE,
    Guess,
    beside,
    drawn,
)

GUESS = Guess(25.0, "springs", 1.0, "down", 1.0, 0.0, 6.0, 0.0)
ALL = {f"{kind}/{name}": value for (kind, name), value in KNOWN.items()}


def test_guesses_are_drawn_within_their_ranges_and_the_same_again() -> None:
    for number in range(50):
        guess = drawn(np.random.default_rng([1, number]))
        assert guess == drawn(np.random.default_rng([1, number]))
        near = beside(guess, np.random.default_rng([2, number]), 0.3)
        assert (near.law, near.hold) == (guess.law, guess.hold)
        for one in (guess, near):
            for value, (low, high) in (
                (one.Lstar, LSTAR),
                (one.tape, TAPE),
                (one.grip, GRIP),
                (one.depth, DEPTH),
                (one.offset, OFFSET),
            ):
                assert low <= value <= high
            assert one.rig.tape == (0.0 if one.hold == FREE else one.tape)


def test_the_modulus_takes_what_it_can() -> None:
    assert Trial(GUESS, ALL, 1.0).misfit == pytest.approx(0.0, abs=1e-12)
    assert Trial(GUESS, {k: v / 1.2 for k, v in ALL.items()}, 1.0).misfit == pytest.approx(0.0, abs=1e-12)
    twice = Trial(GUESS, {k: 2.0 * v for k, v in ALL.items()}, 1.0)
    assert twice.scale == pytest.approx(MODULUS[0] / 4000.0)
    assert twice.misfit == pytest.approx(math.log(1.5))
    assert Trial(GUESS, {**ALL, "straight/x": math.nan}, 1.0).misfit == math.inf


def test_the_best_is_told_with_its_residuals() -> None:
    near = Trial(GUESS, {**ALL, "straight/y": 4.4}, 1.0)
    far = Trial(replace(GUESS, tape=5.0), {**ALL, "straight/y": 40.0}, 1.0)
    lost = Trial(replace(GUESS, tape=6.0), {}, 1.0)
    assert best([far, near, lost]) is near
    others = Trial(GUESS, {f"{kind}/{name}": 1.0 for kind in PREDICTED for name in ("x", "xy", "y")}, 1.0)
    checks = {
        (c.quantity, c.params.get("kind"), c.params.get("about")): c
        for c in judged([far, near, lost], others).checks
    }
    told = checks["stiffness that calibrates, N/mm, by the best guess", "straight", "y"]
    assert told.value == pytest.approx(4.4 * near.scale)
    assert told.reference == 4.0
    assert checks["guesses with all five tests", None, None].value == 2.0
    assert checks["guesses within 25 % of all five", None, None].value == 1.0
    assert checks["k_x / k_y, predicted by the best guess", PREDICTED[0], None].value == 1.0
