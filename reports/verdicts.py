"""What became of the claims of the source, as the front page shows it: four counts, and a row for every claim."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from reports.figures import csv_link
from reports.records import Check
from verification.framework.source_claims import COUNTED, Judged, Verdict, is_own, judge_all

WORDS = {
    Verdict.REPRODUCED: "reproduced by the converging model, or in closed form",
    Verdict.SOURCE_ONLY: "only by the source's own model, bars and hinges",
    Verdict.NOT: "not reproduced",
    Verdict.MISPRINT: "wrong in print",
    Verdict.UNRUN: "not run",
}
ANCHORS = {verdict: f"claims-{verdict.name.lower().replace('_', '-')}" for verdict in Verdict}
SHOWN_FIRST = (Verdict.NOT, Verdict.SOURCE_ONLY, Verdict.MISPRINT, Verdict.REPRODUCED, Verdict.UNRUN)


@dataclass(frozen=True)
class Group:
    """The claims of one verdict."""

    verdict: Verdict
    rows: list[Judged]

    @property
    def words(self) -> str:
        """What the verdict means."""
        return WORDS[self.verdict]

    @property
    def anchor(self) -> str:
        """The id of its heading."""
        return ANCHORS[self.verdict]

    @property
    def unexplained(self) -> int:
        """How many are without a reason, where one is owed."""
        owed = self.verdict in (Verdict.NOT, Verdict.SOURCE_ONLY)
        return sum(not row.claim.reason for row in self.rows) if owed else 0

    @property
    def unasked(self) -> int:
        """How many of the source's model alone have no converged value beside them."""
        return sum(row.converged is None for row in self.rows) if self.verdict is Verdict.SOURCE_ONLY else 0


def groups(checks: Sequence[Check]) -> list[Group]:
    """Claims by verdict, those that did not come out first; of those that were not run only if there are any."""
    judged = judge_all(checks)
    found = [Group(verdict, [row for row in judged if row.verdict is verdict]) for verdict in SHOWN_FIRST]
    return [group for group in found if group.rows or group.verdict in COUNTED]


def counted(found: Sequence[Group]) -> list[Group]:
    """The four counts in the order of the first screen."""
    by_verdict = {group.verdict: group for group in found}
    return [by_verdict[verdict] for verdict in COUNTED]


def tally(checks: Iterable[Check]) -> list[tuple[str, int, int]]:
    """Checks with a tolerance, those against others and those against the program itself apart: words, passed, all."""
    kinds: dict[bool, list[bool]] = {False: [], True: []}
    for check in checks:
        if check.passed is not None:
            kinds[is_own(check)].append(check.passed)
    return [
        ("against closed forms, published values and the shell", sum(kinds[False]), len(kinds[False])),
        (
            "against the program itself (refinements, differences, promises)",
            sum(kinds[True]),
            len(kinds[True]),
        ),
    ]


def told(checks: Sequence[Check]) -> str:
    """The four counts in one line, for a terminal."""
    return ", ".join(f"{len(group.rows)} {group.verdict}" for group in counted(groups(checks)))


def verdicts_csv(found: Iterable[Group]) -> str:
    """Link to the claims with their verdicts as CSV."""
    titles = "key place claim verdict printed source_model converged unit within records reason command"
    rows: list[list[Any]] = [titles.split()]
    for group in found:
        for row in group.rows:
            claim = row.claim
            shown = row.converged or row.source
            rows.append(
                [
                    claim.key,
                    claim.place,
                    claim.says,
                    group.verdict.value,
                    claim.reference(shown[1]) if shown else None,
                    row.source[1].value if row.source else None,
                    row.converged[1].value if row.converged else None,
                    shown[1].unit if shown else "",
                    claim.within,
                    row.count,
                    claim.reason,
                    f"bh verify {claim.case}",
                ]
            )
    return csv_link(rows)
