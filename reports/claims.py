"""The front page's table: what the source says, what it published, what came out here, and at what cost.

A record is about a claim of the source where its `source` begins so, as in "source 3.5.1, Fig. 3.9: phi = 90 degrees":
the place before the colon, what is said there behind it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from reports.figures import csv_link
from reports.records import Case, Check

PREFIX = "source "
MOST_ROWS = 10  # of one quantity with published values of their own; more are told by the worst of them


@dataclass(frozen=True)
class Claim:
    """One row: the record that stands for it (the worst of `count`), numbered as in the file."""

    case: Case
    number: int
    check: Check
    count: int

    @property
    def place(self) -> str:
        """Where the source says it: chapter, figure, equation."""
        return (self.check.source or "").removeprefix(PREFIX).partition(": ")[0]

    @property
    def words(self) -> str:
        """What the source says, where the record tells."""
        return (self.check.source or "").partition(": ")[2]

    @property
    def yes_or_no(self) -> bool:
        """Is the figure the answer to a question, 1 for yes?"""
        check = self.check
        return (check.unit, check.reference, check.tolerance) == ("", 1.0, 0.0) and check.value in (
            0.0,
            1.0,
            None,
        )

    @property
    def verdict(self) -> str:
        """One of "holds", "differs" and "reported"."""
        return {True: "holds", False: "differs", None: "reported"}[self.check.passed]


def claims(cases: Iterable[Case]) -> list[Claim]:
    """A row for every claim of the source with a published value, in the order of the cases."""
    found: list[Claim] = []
    for case in cases:
        for group in case.groups:
            if not group["source"].startswith(PREFIX):
                continue
            rows = [(n, check) for n, check in group["rows"] if check.reference is not None]
            published = dict.fromkeys(check.reference for _, check in rows)
            apart = [[row for row in rows if row[1].reference == value] for value in published]
            for alike in apart if len(published) <= MOST_ROWS else [rows]:
                number, check = max(alike, key=_severity)
                found.append(Claim(case, number, check, len(alike)))
    return found


def claims_csv(found: Iterable[Claim]) -> str:
    """Link to the table as CSV."""
    rows: list[list[Any]] = [
        [
            "case",
            "place",
            "claim",
            "quantity",
            "published",
            "ours",
            "error bar",
            "unit",
            "error",
            "tolerance",
            "verdict",
            "of records",
            "unknowns",
            "wall_time_s",
            "command",
        ]
    ]
    for claim in found:
        check = claim.check
        quick = " --quick" if claim.case.info.quick else ""
        rows.append(
            [
                claim.case.name,
                claim.place,
                claim.words,
                check.quantity,
                check.reference,
                check.value,
                check.bar,
                check.unit,
                check.error,
                check.tolerance,
                claim.verdict,
                claim.count,
                check.unknowns,
                check.wall_time_s,
                f"bh verify {claim.case.name}{quick}",
            ]
        )
    return csv_link(rows)


def _severity(row: tuple[int, Check]) -> tuple[int, float]:
    """Failed before passed before reported, and among those by how much of the tolerance, or how far off."""
    check = row[1]
    rank = {False: 2, True: 1, None: 0}[check.passed]
    size = check.error if math.isnan(check.use) else check.use
    return rank, math.inf if size is None else abs(size)
