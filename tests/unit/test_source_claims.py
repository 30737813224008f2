"""Verdicts on the claims of the source follow from records; nothing is claimed twice, nothing is left out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from meshes.errors import InputError
from reports.records import Check, read
from reports.verdicts import counted, groups, tally, told
from verification.framework import source_claims
from verification.framework.cases import ALL_CASES
from verification.framework.run import RECORDS
from verification.framework.source_claims import (
    Selector,
    SourceClaim,
    Verdict,
    claims,
    counts,
    judge,
    judge_all,
    model_of,
    unclaimed,
    unheard,
)

CLAIM = SourceClaim(key="k", place="1.1", says="it is so", case="c", quantity=("q",))


def record(value: float | None, formulation: str | None = None, **changes: Any) -> Check:
    params = {} if formulation is None else {"formulation": formulation}
    given: dict[str, Any] = {
        "case": "c",
        "quantity": "q",
        "params": params | changes.pop("params", {}),
        "value": value,
        "unit": "mm",
        "reference": 2.0,
        "source": "source 1.1",
        "passed": None,
    }
    return Check(**(given | changes))


def verdict(claim: SourceClaim, *records: Check) -> Verdict:
    return judge(claim, list(enumerate(records, start=1))).verdict


def test_the_converging_model_decides() -> None:
    good, bad = {"tolerance": 0.1, "passed": True}, {"tolerance": 0.1, "passed": False}
    source, shell = "bars-and-hinges", "shell"
    assert verdict(CLAIM, record(2.0, source, **good), record(2.0, shell, **good)) is Verdict.REPRODUCED
    assert verdict(CLAIM, record(9.0, source, **bad), record(2.0, shell, **good)) is Verdict.REPRODUCED
    assert verdict(CLAIM, record(2.0, source, **good), record(9.0, shell, **bad)) is Verdict.SOURCE_ONLY
    assert verdict(CLAIM, record(2.0, source, **good)) is Verdict.SOURCE_ONLY
    assert verdict(CLAIM, record(9.0, source, **bad), record(9.0, shell, **bad)) is Verdict.NOT
    assert verdict(CLAIM, record(2.0, source, case="other", **good)) is Verdict.UNRUN


def test_reported_figures_are_judged_by_the_claim_and_by_the_finest_mesh() -> None:
    claim = SourceClaim("k", "1.1", "it is so", "c", ("q",), within=0.1)
    coarse = record(9.0, "shell", params={"along": 8, "rows": 1})
    fine = record(2.1, "shell", params={"along": 16, "rows": 2})
    assert verdict(claim, coarse, fine) is Verdict.REPRODUCED
    assert verdict(claim, coarse) is Verdict.NOT
    assert verdict(CLAIM, coarse, fine) is Verdict.UNRUN  # nothing says how near is near
    assert verdict(claim, record(None, "shell", outcome="stalled", passed=False)) is Verdict.NOT


def test_a_misprint_needs_what_is_right() -> None:
    right = (Selector("c", ("derived",)),)
    claim = SourceClaim("k", "1.1", "it is so", "c", ("q",), within=0.1, right=right)
    off = record(4.0, "consistent")
    derived = record(4.0, "consistent", quantity="derived", reference=4.0, tolerance=0.1, passed=True)
    assert verdict(claim, off, derived) is Verdict.MISPRINT
    assert verdict(claim, off) is Verdict.NOT
    assert verdict(claim, off, record(4.0, "consistent", quantity="derived", passed=False)) is Verdict.NOT


def test_what_is_printed_may_differ_from_what_a_study_compares_with() -> None:
    claim = SourceClaim("k", "1.1", "it is so", "c", ("q",), printed=3.0, within=0.1)
    passed = record(2.0, "consistent", tolerance=0.1, passed=True)  # the study's reference is another one
    assert verdict(claim, passed) is Verdict.NOT
    assert verdict(claim, record(3.0, "consistent", tolerance=0.1, passed=False)) is Verdict.REPRODUCED


def test_a_record_says_what_made_it() -> None:
    assert model_of(record(1.0, params={"way": "as the source, cells of 1 mm"}), CLAIM) == "source"
    assert model_of(record(1.0, params={"way": "converged"}), CLAIM) == "converging"
    with pytest.raises(InputError, match="names no formulation; give `model`"):
        model_of(record(1.0), CLAIM)


def test_the_worst_record_stands_for_a_side() -> None:
    claim = SourceClaim("k", "1.1", "it is so", "c", ("q",), within=0.5)
    found = judge(claim, list(enumerate((record(2.1, "shell"), record(2.6, "shell", params={"a": 1})), 1)))
    assert found.converged is not None
    assert found.converged[0] == 2
    assert found.verdict is Verdict.REPRODUCED


def test_claims_are_sound() -> None:
    for claim in claims():
        for selector in (*claim.selectors, *claim.right):
            assert selector.case in ALL_CASES, claim.key
        assert claim.place
        assert claim.says
    assert len({claim.key for claim in claims()}) == len(claims())


def test_a_claim_that_is_not_valid_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "claims.toml"
    file.write_text('own = []\n[[claim]]\nkey = "odd"\nplace = "1"\nverdict = "reproduced"\n')
    monkeypatch.setattr(source_claims, "FILE", file)
    with pytest.raises(InputError, match="claim 'odd'"):
        source_claims._file.__wrapped__()


def test_kept_records_are_claimed_and_heard() -> None:
    """Every kept record about the source belongs to a claim, and every claim on a kept case finds its records."""
    records = [check for file in sorted(RECORDS.glob("*.json")) for check in read(file).checks]
    assert unclaimed(records) == []
    kept = {check.case for check in records}
    alone = {
        claim.key
        for claim in claims()
        if {selector.case for selector in (*claim.selectors, *claim.right)} <= kept
    }
    assert alone & set(unheard(records)) == set()
    judged = [item for item in judge_all(records) if item.claim.key in alone]
    assert len(judged) > 10
    assert counts(judged)[Verdict.UNRUN] == 0


def test_counts_are_told() -> None:
    records = [check for file in sorted(RECORDS.glob("*.json")) for check in read(file).checks]
    found = groups(records)
    assert sum(len(group.rows) for group in found) == len(claims())
    assert [group.verdict for group in counted(found)] == [
        Verdict.REPRODUCED,
        Verdict.SOURCE_ONLY,
        Verdict.NOT,
        Verdict.MISPRINT,
    ]
    assert told(records).endswith("3 wrong in print")  # Eq. A.12, 5.4 and 5.6: the record of `appendix_a`
    (_, passed, others), (_, own_passed, own) = tally(records)
    judged = [check for check in records if check.passed is not None]
    assert others + own == len(judged)
    assert passed + own_passed == sum(bool(check.passed) for check in judged)
    assert own > 0
