"""Case `agreement`: what counts as held, and that work is the energy gained."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bh
import meshes
from verification.framework.random_scenes import OutOfTimeError, processor_limit
from verification.studies.solver.agreement import KINDS, Row, judged
from verification.studies.solver.agreement_work import PARTS, balance

ROW = Row(
    number=1,
    kind="network",
    words="a sheet",
    formulation="consistent",
    energy=1.02,
    estimate=0.015,
    truth=1.0,
    bar=0.006,
    work=1.0200001,
    gained=1.02,
    allowed=1e-5,
    covered=1.0,
    seconds=1.0,
)


def test_a_sheet_holds_only_if_nothing_is_off_by_more_than_it_says() -> None:
    assert ROW.held
    assert not replace(ROW, estimate=0.013).held
    assert not replace(ROW, work=1.021).held
    assert not replace(ROW, why="more than 90 s of processor time").held
    assert not replace(ROW, truth=float("nan")).held


def test_the_count_is_of_all_sheets_and_names_those_that_do_not_hold() -> None:
    rows = [replace(ROW, number=k) for k in range(99)] + [replace(ROW, number=99, energy=1.1)]
    found = judged(rows)
    assert (found.checks[0].value, found.checks[0].reference, found.checks[0].passed) == (99.0, 100.0, True)
    assert found.notes[0].startswith("Sheet 99 (network: a sheet): default 1.1 (consistent, told 1.50%)")
    assert judged([*rows[2:], rows[-1], rows[-1]]).checks[0].passed is False


def test_kinds_are_those_asked_for() -> None:
    assert {kind for kind, _ in KINDS} == {"network", "wide panel", "closed ring"}


@pytest.mark.parametrize("Lstar", [None, 20.0])
def test_work_is_the_energy_gained(Lstar: float | None) -> None:
    """Of folds by springs and of imposed ones; a path whose last energy is another one does not balance."""
    mesh = meshes.structured(meshes.annulus_sector(80.0, 12.0, 0.6), along=8, rows=2)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, nu=0.2, t=0.2), formulation="consistent", contact=False)
    path = bh.trace(model.fold("crease", by=0.9, Lstar=Lstar))
    found = balance(path)
    assert found.covered == pytest.approx(1.0)
    assert found.off <= found.allowed <= 1e-3
    shifted = bh.Path(path.model, path.provenance)
    last = path.records[-1]
    shifted.records = [*path.records[:-1], replace(last, q=last.q + 0.02 * np.cos(np.arange(len(last.q))))]
    shifted.steps = list(path.steps)
    wrong = balance(shifted)  # the way does not lead there
    assert wrong.covered < 1.0


def test_parts_are_even() -> None:
    assert PARTS % 2 == 0


def test_what_takes_too_long_is_given_up_wherever_it_is() -> None:
    def deaf() -> None:
        while True:
            try:
                while True:
                    pass
            except Exception:  # as some library on the way might
                continue

    with pytest.raises(OutOfTimeError), processor_limit(0.05):
        deaf()
