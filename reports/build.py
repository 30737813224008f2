"""The report page, built from a folder of stored results; reads, formats and writes, and never solves."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from meshes.errors import FileFormatError
from meshes.io.export import replacing
from reports.figures import (
    Plot,
    ReportError,
    csv_link,
    legend,
    markup,
    picture_link,
    plot_rows,
    scientific,
    svg,
    typeset,
)

SOURCE = (
    "Equation numbers, “the source” and “App. B” refer to the dissertation “How Curved Creases Enhance the "
    "Stiffness and Enable Shape Morphing of Thin-Sheet Structures” by Woodruff."
)
VERDICTS = ("holds", "reported", "differs")  # from the best to the worst
MOST_FAILURES = 25  # that are listed at the top
TEMPLATES = Path(__file__).parent / "templates"


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


@dataclass(frozen=True)
class Case:
    """A case with its records, numbered as in the file, and with its pictures read in."""

    info: CaseInfo
    checks: list[tuple[int, Check]]
    plots: list[dict[str, Any]] = field(default_factory=list)
    pictures: list[dict[str, Any]] = field(default_factory=list)

    @property
    def name(self) -> str:
        return self.info.name

    @property
    def title(self) -> str:
        return self.info.title or self.name

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


def build(results_folder: Path, out_file: Path) -> Path:
    """Write the report of the results in a folder as one self-contained HTML page.

    The same results give the same page, byte for byte.

    Returns:
        the absolute path of the page.

    Raises:
        ReportError: results that are missing or not valid, or a page that cannot be written.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    folder = Path(results_folder)
    results = read(folder / "checks.json")
    cases = _cases(results, folder)
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "number": number, "share": share, "seconds": seconds, "plain": typeset,
        "unlike": lambda params, common: {key: v for key, v in params.items() if key not in common},
        "text": lambda text: Markup(markup(text)), "params": lambda params: Markup(_params(params)),
    }  # fmt: skip
    failed = [item for case in cases for item in case.checks if item[1].passed is False]
    missing = [name for name in known_cases() if name not in [case.name for case in cases]]
    page = environment.get_template("report.html").render(
        results=results,
        source=SOURCE,
        missing=missing,
        shortfall=shortfall(results),
        others=_others(results),
        date=_date(results.date),
        cases=cases,
        machine=_machine(results.machine),
        style=Markup((TEMPLATES / "style.css").read_text(encoding="utf-8")),
        judged=sum(case.judged for case in cases),
        reported=sum(case.count(None) for case in cases),
        failed=failed,
        most_failures=MOST_FAILURES,
        odd=[item for case in cases for item in case.checks if item[1].passed and item[1].use > 1.0],
        seconds_in_all=sum(case.info.wall_time_s or 0.0 for case in cases),
    )
    target = Path(out_file)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with replacing(target) as temporary:
            temporary.write_text(page, encoding="utf-8", newline="\n")
    except FileFormatError as error:
        raise ReportError(str(error)) from error
    except OSError as error:
        raise ReportError(
            f"folder '{target.parent}' cannot be made ({error.strerror}); choose another place"
        ) from error
    return target.resolve()


def read(file: Path) -> Results:
    """Stored results.

    Raises:
        ReportError: no such file, or not the results of `bh verify`; the message names the entry.
    """
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise ReportError(f"there are no results in '{file.parent}'; run `bh verify` first") from error
    except OSError as error:
        raise ReportError(f"'{file}' cannot be read ({error.strerror}); choose another folder") from error
    except (ValueError, RecursionError) as error:
        raise ReportError(f"'{file}' is not JSON; run `bh verify` again") from error
    try:
        results = Results.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        place = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in first["loc"])
        entry = place.lstrip(".") or "the file"
        raise ReportError(f"'{file}': {entry}: {first['msg'].lower()}; run `bh verify` again") from error
    names = [info.name for info in results.cases]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ReportError(f"'{file}': case '{twice}' is there twice; run `bh verify` again")
    return results


def known_cases() -> list[str]:
    """Names of all verification cases that there are."""
    from verification.cases import CASES

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


def _others(results: Results) -> list[tuple[str, str]]:
    """Cases from an earlier run than the last, with its date and what else was not as in the last one."""
    found = []
    for info in results.cases:
        if info.date in (None, results.date):
            continue
        words = [_date(info.date or "")]
        versions = results.versions if info.versions is None else info.versions
        for key, value in versions.items():
            if results.versions.get(key, value) != value:
                words.append(f"{key} {value}")
        found.append((info.name, "; ".join(words)))
    return found


def _cases(results: Results, folder: Path) -> list[Case]:
    """Every case with what belongs to it; records of cases that say nothing of themselves get a plain one."""
    infos = {info.name: info for info in results.cases}
    for check in results.checks:
        infos.setdefault(check.case, CaseInfo(name=check.case))
    for info in infos.values():
        info.quick = results.quick if info.quick is None else info.quick
    count = 0
    cases = []
    for name, info in infos.items():
        plots = []
        for plot in info.plots:
            count += 1
            drawn = svg(plot, f"plot{count}-")
            plots.append(
                {"plot": plot, "svg": drawn, "legend": legend(plot), "csv": csv_link(plot_rows(plot))}
            )
        pictures = []
        for picture in info.pictures:
            link, width, height = picture_link(_inside(folder, picture.file))
            pictures.append({"picture": picture, "link": link, "width": width, "height": height})
        checks = [(n, check) for n, check in enumerate(results.checks, start=1) if check.case == name]
        cases.append(Case(info, checks, plots, pictures))
    return cases


def _inside(folder: Path, name: str) -> Path:
    """A file of the results folder; results from elsewhere must not pull in other files."""
    file = (folder / name).resolve()
    if not file.is_relative_to(folder.resolve()):
        raise ReportError(f"picture '{name}' lies outside the results folder; put it there")
    return file


def _machine(machine: str | dict[str, Any]) -> list[tuple[str, str]]:
    if isinstance(machine, str):
        return [("machine", machine)] if machine else []
    return [(key, "unknown" if value is None else str(value)) for key, value in machine.items()]


def _date(text: str) -> str:
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        return text
    zone = {None: "", timedelta(0): " UTC"}.get(moment.utcoffset(), f" {moment:%z}")
    return f"{moment.day} {moment:%B %Y, %H:%M}{zone}"


# --- figures in words ------------------------------------------------------------------------------------------


def number(value: float | None, digits: int = 5, full: bool = False) -> str:
    """A number with so many significant digits; without trailing zeros where it is exact, unless in `full`."""
    if value is None:
        return "\N{EN DASH}"
    if not math.isfinite(value):
        return "not a number" if math.isnan(value) else ("∞" if value > 0 else "\N{MINUS SIGN}∞")
    if value == 0.0:
        return "0"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    short = not full and float(f"{mantissa}e{exponent}") == value
    power = int(exponent)
    if -4 <= power < 6:
        text = f"{value:,.{max(digits - 1 - power, 0)}f}".replace(",", "\u2009")
    else:
        text = mantissa
    if short and "." in text:
        text = text.rstrip("0").rstrip(".")
    text = text.replace("-", "\N{MINUS SIGN}")
    return text if -4 <= power < 6 else scientific(text, power)


def share(value: float | None, check: Check) -> str:
    """An error or tolerance: in percent where it is relative and not tiny, else as a number with the unit."""
    if value is None or not math.isfinite(value):
        return number(value)
    if not check.reference:
        return f"{number(value, 2)}\u00a0{check.unit}".strip()
    return f"{number(100.0 * value, 2)}\u00a0%" if abs(value) >= 1e-5 else number(value, 2)


def seconds(value: float | None) -> str:
    """A time in the unit that suits it."""
    if value is None or not math.isfinite(value):
        return number(value)
    if value < 1.0:
        return f"{number(1e3 * value, 2)}\u00a0ms"
    if value < 90.0:
        return f"{number(value, 2 if value < 10.0 else 3)}\u00a0s"
    return f"{int(value // 60)}\u00a0min\u00a0{int(value % 60)}\u00a0s"


def _params(params: dict[str, Any]) -> str:
    """Parameters as small key=value pairs, each kept on one line."""
    return " ".join(
        f'<span class="kv"><i>{markup(str(key))}</i>=\u2060{markup(_plain(value))}</span>'
        for key, value in params.items()
    )


def _plain(value: Any) -> str:
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "none"}[value]
    if isinstance(value, int | float):
        return number(float(value))
    if isinstance(value, Iterable) and not isinstance(value, str | dict):
        return "(" + ", ".join(_plain(part) for part in value) + ")"
    return str(value)
