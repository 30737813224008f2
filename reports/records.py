"""Stored results as the report reads them: strict models of `checks.json`, and cases with what belongs to them."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from reports.figures import Plot, ReportError, csv_link

VERDICTS = ("holds", "reported", "differs")  # from the best to the worst


class Check(BaseModel):
    """One record: a figure, its reference, and how far they may be apart. `error` is relative, or absolute to 0."""

    model_config = ConfigDict(strict=True)

    case: str
    quantity: str
    params: dict[str, Any] = {}
    value: float | None
    unit: str = ""
    reference: float | None = None
    source: str | None = None
    error: float | None = None
    tolerance: float | None = None
    passed: bool | None
    unknowns: float | None = None
    iterations: float | None = None
    wall_time_s: float | None = None
    outcome: str = "reached"

    @property
    def use(self) -> float:
        """The error as a share of the tolerance; nan where there is none to compare."""
        if self.tolerance is None or self.error is None:
            return math.nan
        if self.tolerance == 0.0:
            return 0.0 if self.error == 0.0 else math.inf
        return abs(self.error) / self.tolerance

    @property
    def bar(self) -> float | None:
        """The error bar of the value, where the case gives one among the parameters."""
        found = self.params.get("error_bar")
        return float(found) if isinstance(found, int | float) and math.isfinite(found) else None

    @property
    def result(self) -> str:
        if self.passed is None:
            return "reported"
        if self.passed:
            return "pass"
        return "failed" if self.outcome == "reached" else f"failed: {self.outcome}"


class Picture(BaseModel):
    """A picture beside the results, what it shows in words, and a caption."""

    model_config = ConfigDict(strict=True)

    file: str
    alt: str
    caption: str = ""


class Scene(BaseModel):
    """Folded sheets to be turned: frames of `bh.interactive`, and a picture for where they cannot be."""

    model_config = ConfigDict(strict=True)

    file: str
    still: str
    title: str
    alt: str
    caption: str = ""


class CaseInfo(BaseModel):
    """What a case says of itself."""

    model_config = ConfigDict(strict=True)

    name: str
    title: str = ""
    question: str = ""
    source: str = ""
    verdict: str = ""
    notes: list[str] = []
    plots: list[Plot] = []
    pictures: list[Picture] = []
    scenes: list[Scene] = []
    wall_time_s: float | None = None
    # of the run that the case is from; None where that is the run of the whole file
    versions: dict[str, str] | None = None
    date: str | None = None
    machine: str | dict[str, Any] | None = None
    quick: bool | None = None


class Results(BaseModel):
    """The file checks.json."""

    model_config = ConfigDict(strict=True)

    checks: list[Check]
    versions: dict[str, str] = {}
    date: str = ""
    machine: str | dict[str, Any] = ""
    quick: bool = False
    cases: list[CaseInfo] = []


class FramesOfModel(BaseModel):
    """The shapes of one model; arrays in base64, see `bh.interactive.frames`."""

    model_config = ConfigDict(strict=True, extra="forbid")

    name: str
    nodes: str
    triangles: str
    outline: str
    points: str
    density: dict[str, str]
    energy: dict[str, list[float]]


class Frames(BaseModel):
    """A file of `bh.interactive.frames`."""

    model_config = ConfigDict(strict=True, extra="forbid")

    format: Literal[1]
    label: str
    lambdas: list[float]
    tops: dict[str, float]
    eye: list[float]
    models: list[FramesOfModel]


Stored = TypeVar("Stored", bound=BaseModel)


@dataclass(frozen=True)
class Case:
    """A case with its records, numbered as in the file, and with its pictures read in."""

    info: CaseInfo
    checks: list[tuple[int, Check]]
    plots: list[dict[str, Any]] = field(default_factory=list)
    pictures: list[dict[str, Any]] = field(default_factory=list)
    scenes: list[dict[str, Any]] = field(default_factory=list)

    @property
    def name(self) -> str:
        return self.info.name

    @property
    def title(self) -> str:
        return self.info.title or self.name

    @property
    def anchor(self) -> str:
        """The id of its heading."""
        return "case-" + "".join(letter if letter.isalnum() else "-" for letter in self.name)

    def count(self, passed: bool | None) -> int:
        return sum(check.passed is passed for _, check in self.checks)

    @property
    def judged(self) -> int:
        return self.count(True) + self.count(False)

    @property
    def verdict(self) -> str:
        """The worse of what the case says and what its records say."""
        found = "differs" if self.count(False) else "holds" if self.count(True) else "reported"
        said = self.info.verdict if self.info.verdict in VERDICTS else found
        return max(found, said, key=VERDICTS.index)

    @cached_property
    def worst(self) -> Check | None:
        """The check that uses most of its tolerance."""
        compared = [check for _, check in self.checks if not math.isnan(check.use)]
        return max(compared, key=lambda check: check.use, default=None)

    @property
    def groups(self) -> list[dict[str, Any]]:
        """The records by quantity, unit and source, with the parameters that all of a group share."""
        found: dict[tuple[str, str, str], list[tuple[int, Check]]] = {}
        for number, check in self.checks:
            found.setdefault((check.quantity, check.unit, check.source or ""), []).append((number, check))
        groups = []
        for (quantity, unit, source), rows in found.items():
            first = rows[0][1].params
            common = {
                key: value
                for key, value in first.items()
                if len(rows) > 1 and all(check.params.get(key, first) == value for _, check in rows)
            }
            groups.append(
                {"quantity": quantity, "unit": unit, "source": source, "common": common, "rows": rows}
            )
        return groups

    def has(self, name: str) -> bool:
        """Whether any record gives this figure."""
        return any(getattr(check, name) is not None for _, check in self.checks)

    @property
    def csv(self) -> str:
        """Link to all records as CSV."""
        names = ("quantity", "value", "unit", "reference", "error", "tolerance", "passed", "unknowns", "iterations",
                 "wall_time_s", "outcome", "source")  # fmt: skip
        keys = list(dict.fromkeys(key for _, check in self.checks for key in check.params))
        rows: list[list[Any]] = [[*names, *keys]]
        for _, check in self.checks:
            rows.append([*(getattr(check, name) for name in names), *(check.params.get(key) for key in keys)])
        return csv_link(rows)


def read(file: Path) -> Results:
    """Stored results.

    Raises:
        ReportError: no such file, or not the results of `bh verify`; the message names the entry.
    """
    try:
        text = file.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise ReportError(f"there are no results in '{file.parent}'; run `bh verify` first") from error
    except (OSError, UnicodeDecodeError) as error:
        raise ReportError(f"'{file}' cannot be read ({error}); choose another folder") from error
    results = validated(Results, text, str(file))
    names = [info.name for info in results.cases]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ReportError(f"'{file}': case '{twice}' is there twice; run `bh verify` again")
    return results


def known_cases() -> list[str]:
    """Names of all verification cases that there are."""
    from verification.framework.cases import CASES

    return list(CASES)


def shortfall(results: Results) -> str:
    """What a full run has and these results have not, in a few words: "1 of 5 cases run, 1 of them quick"."""
    known = known_cases()
    there = {info.name for info in results.cases} | {check.case for check in results.checks}
    run = [name for name in known if name in there]
    quick = sum(results.quick if info.quick is None else info.quick for info in results.cases)
    words = [f"{len(run)} of {len(known)} cases run"] if len(run) < len(known) else []
    if quick:
        some = f"{quick} of them quick" if words else f"{quick} of {len(known)} cases quick"
        words.append("quick" if quick == len(results.cases) else some)
    return ", ".join(words)


def validated(model: type[Stored], text: str, name: str) -> Stored:
    """JSON text as one of the models.

    Raises:
        ReportError: not JSON, or not of this form; names the file and the entry.
    """
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ReportError(f"'{name}' is not JSON; run `bh verify` again") from error
    try:
        return model.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        place = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in first["loc"])
        entry = place.lstrip(".") or "the file"
        raise ReportError(f"'{name}': {entry}: {first['msg'].lower()}; run `bh verify` again") from error


def schema(model: type[BaseModel]) -> dict[str, Any]:
    """The JSON schema (draft 2020-12) of the files that a model reads."""
    titles = {
        Results: "Results of bh verify (checks.json)",
        Frames: "Folded sheets, frame by frame (*.frames.json)",
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **model.model_json_schema(),
        "title": titles[model],
    }
