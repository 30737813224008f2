"""What the source claims, and what became of each claim: a verdict that follows from stored records.

`verification/claims.toml` says what is claimed and which records speak for it; nothing there is a verdict.
"""

from __future__ import annotations

import math
import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache, partial
from operator import itemgetter
from pathlib import Path
from typing import Any

from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass as validated

from meshes.errors import InputError
from verification.framework.records import Record

FILE = Path(__file__).parents[1] / "claims.toml"
PREFIX = "source "  # of the source of a record that is about a claim
STRICT = ConfigDict(extra="forbid")
Numbered = tuple[int, Record]


class Model(StrEnum):
    """What a record was made by, as far as it says something about sheets."""

    SOURCE = "source"  # bars and hinges, and what is fitted to them
    CONVERGING = "converging"  # the consistent formulation and the shells
    EXACT = "exact"  # closed forms and geometry


class Verdict(StrEnum):
    """What became of a claim."""

    REPRODUCED = "reproduced"
    SOURCE_ONLY = "source's model only"
    NOT = "not reproduced"
    MISPRINT = "wrong in print"
    UNRUN = "not run"


FORMULATIONS = {
    "bars-and-hinges": Model.SOURCE,
    "consistent": Model.CONVERGING,
    "shell": Model.CONVERGING,
    "linear-shell": Model.CONVERGING,
}
COUNTED = (Verdict.REPRODUCED, Verdict.SOURCE_ONLY, Verdict.NOT, Verdict.MISPRINT)


@validated(frozen=True, config=STRICT)
class Selector:
    """Records of a case: of one of the quantities, with all of the parameters (a list: one of its values)."""

    case: str
    quantity: tuple[str, ...]
    where: dict[str, Any] | None = None

    def takes(self, record: Record) -> bool:
        """Whether the record is one of them and has something to be compared with."""
        return (
            record.case == self.case
            and record.quantity in self.quantity
            and record.reference is not None
            and all(_one_of(record.params.get(key), value) for key, value in (self.where or {}).items())
        )


@validated(frozen=True, config=STRICT)
class SourceClaim:
    """One claim; the fields are those of `verification/claims.toml`, which says what they mean."""

    key: str
    place: str
    says: str
    case: str
    quantity: tuple[str, ...]
    where: dict[str, Any] | None = None
    model: Model | None = None
    printed: float | None = None
    within: float | None = None
    beside: tuple[Selector, ...] = ()
    right: tuple[Selector, ...] = ()
    reason: str = ""

    @property
    def selectors(self) -> tuple[Selector, ...]:
        """Of all records that speak for it."""
        return (Selector(self.case, self.quantity, self.where), *self.beside)

    def takes(self, record: Record) -> bool:
        """Whether a record speaks for it."""
        return any(selector.takes(record) for selector in self.selectors)

    def reference(self, record: Record) -> float:
        """What the source prints, in the unit of the record."""
        found = record.reference if self.printed is None else self.printed
        if found is None:
            raise InputError(f"claim '{self.key}': '{record.quantity}' is compared with nothing")
        return found

    def studied(self, record: Record) -> bool:
        """Whether the study that made a record has judged it by what is printed."""
        return record.passed is not None and record.reference == self.reference(record)

    def agrees(self, record: Record) -> bool | None:
        """Whether a record agrees with what is printed; None where nothing says how near is near."""
        if self.studied(record):
            return record.passed
        if record.value is None or not math.isfinite(record.value):
            return False
        reference = self.reference(record)
        if self.within is not None:
            scale = abs(reference) if reference != 0.0 else 1.0
            return abs(record.value - reference) <= self.within * scale
        if reference == 1.0 and record.unit == "" and record.value in (0.0, 1.0):
            return record.value == 1.0  # the answer to a question
        return None


@dataclass(frozen=True)
class Judged:
    """A claim with its verdict, and of each side the record that is farthest off, numbered as in the file."""

    claim: SourceClaim
    verdict: Verdict
    source: Numbered | None = None
    converged: Numbered | None = None
    right: Numbered | None = None
    count: int = 0


def model_of(record: Record, claim: SourceClaim) -> Model:
    """What made a record.

    Raises:
        InputError: the record names no formulation and the claim no model.
    """
    name = record.params.get("formulation")
    if name in FORMULATIONS:
        return FORMULATIONS[str(name)]
    way = record.params.get("way")
    if isinstance(way, str):
        return Model.SOURCE if way.startswith("as the source") else Model.CONVERGING
    if claim.model is None:
        raise InputError(f"claim '{claim.key}': '{record.quantity}' names no formulation; give `model`")
    return claim.model


def judge(claim: SourceClaim, records: Sequence[Numbered]) -> Judged:
    """What the records make of a claim.

    Of each model the records that a study judges speak; where it judges none, those of its finest mesh, by `within`.

    Args:
        claim: what is claimed.
        records: stored records with their numbers; those of other claims are passed over.

    Returns:
        reproduced where the converging model (or a closed form) agrees; the source's model only where that one alone
        does, or was alone asked; wrong in print where nothing does and what should stand there is shown; else not.
    """
    mine = [item for item in records if claim.takes(item[1])]
    by_model = {model: [item for item in mine if model_of(item[1], claim) is model] for model in Model}
    source = _speaking(claim, by_model[Model.SOURCE])
    converged = _speaking(claim, [*by_model[Model.CONVERGING], *by_model[Model.EXACT]])
    right = [item for item in records if any(selector.takes(item[1]) for selector in claim.right)]
    found = partial(
        Judged, claim, source=_worst(claim, source), converged=_worst(claim, converged), count=len(mine)
    )
    if not source and not converged:
        return found(Verdict.UNRUN)
    if converged and all(claim.agrees(record) for _, record in converged):
        return found(Verdict.REPRODUCED)
    if right and all(record.passed for _, record in right):
        return found(Verdict.MISPRINT, right=right[0])
    alone = source and all(claim.agrees(record) for _, record in source)
    return found(Verdict.SOURCE_ONLY if alone else Verdict.NOT)


def judge_all(records: Iterable[Record]) -> list[Judged]:
    """Every claim with its verdict, in the order of the file; records are numbered from 1."""
    by_case: dict[str, list[Numbered]] = {}
    for item in enumerate(records, start=1):
        by_case.setdefault(item[1].case, []).append(item)
    return [judge(claim, _of_its_cases(claim, by_case)) for claim in claims()]


def _of_its_cases(claim: SourceClaim, by_case: Mapping[str, list[Numbered]]) -> list[Numbered]:
    """Records of the cases that a claim names, in their order: no other can speak for it."""
    cases = {selector.case for selector in (*claim.selectors, *claim.right)}
    return sorted((item for case in cases for item in by_case.get(case, [])), key=itemgetter(0))


def counts(judged: Iterable[Judged]) -> dict[Verdict, int]:
    """How many claims came out how; the four counts and those that were not run."""
    found = Counter(item.verdict for item in judged)
    return {verdict: found[verdict] for verdict in Verdict}


def unclaimed(records: Iterable[Record]) -> list[tuple[str, str]]:
    """Case and quantity of records about the source, with a reference, of which no claim takes any: each needs one."""
    about = [
        record
        for record in records
        if (record.source or "").startswith(PREFIX) and record.reference is not None
    ]
    selectors = [selector for claim in claims() for selector in (*claim.selectors, *claim.right)]
    taken = {(r.case, r.quantity) for r in about if any(selector.takes(r) for selector in selectors)}
    return list(dict.fromkeys(key for r in about if (key := (r.case, r.quantity)) not in taken))


def unheard(records: Sequence[Record]) -> list[str]:
    """Keys of the claims on cases that were run, of which a selector takes no record: a quantity has another name."""
    ran = {record.case for record in records}
    return [
        claim.key
        for claim in claims()
        for selector in (*claim.selectors, *claim.right)
        if selector.case in ran and not any(selector.takes(record) for record in records)
    ]


def is_own(record: Record) -> bool:
    """Whether a record compares the program with itself, and not with a claim, a closed form or another model."""
    return (record.source or "").startswith(_file()[1])


def claims() -> tuple[SourceClaim, ...]:
    """All claims.

    Raises:
        InputError: an entry of the file is not valid; the message names it.
    """
    return _file()[0]


@cache
def _file() -> tuple[tuple[SourceClaim, ...], tuple[str, ...]]:
    data: Mapping[str, Any] = tomllib.loads(FILE.read_text(encoding="utf-8"))
    adapter = TypeAdapter(SourceClaim)
    found = []
    for entry in data["claim"]:
        try:
            found.append(adapter.validate_python(entry))
        except ValidationError as error:
            raise InputError(f"'{FILE.name}', claim '{entry.get('key')}': {error}") from error
    keys = Counter(claim.key for claim in found)
    twice = next((key for key, count in keys.items() if count > 1), None)
    if twice is not None:
        raise InputError(f"'{FILE.name}': claim '{twice}' is there twice")
    return tuple(found), tuple(data["own"])


def _one_of(value: Any, wanted: Any) -> bool:
    return value in wanted if isinstance(wanted, list) else value == wanted


def _speaking(claim: SourceClaim, items: list[Numbered]) -> list[Numbered]:
    """The records of one model that count."""
    studied = [item for item in items if claim.studied(item[1])]
    if studied:
        return studied
    open_ones = [item for item in items if claim.agrees(item[1]) is not None]
    finest: dict[Any, tuple[float, list[Numbered]]] = {}
    for item in open_ones:
        record = item[1]
        size = float(record.params.get("along", 1)) * float(record.params.get("rows", 1))
        apart = {key: value for key, value in record.params.items() if key not in ("along", "rows")}
        key = (record.case, record.quantity, record.reference, str(sorted(apart.items(), key=str)))
        known = finest.get(key, (0.0, []))
        if size > known[0]:
            finest[key] = (size, [item])
        elif size == known[0]:
            finest[key] = (size, [*known[1], item])
    return [item for _, group in finest.values() for item in group]


def _worst(claim: SourceClaim, items: list[Numbered]) -> Numbered | None:
    """The record that disagrees, or is farthest off."""

    def off(item: Numbered) -> tuple[bool, float]:
        record, reference = item[1], claim.reference(item[1])
        value = math.inf if record.value is None else abs(record.value - reference) / (abs(reference) or 1.0)
        return claim.agrees(record) is not True, value

    return max(items, key=off, default=None)
