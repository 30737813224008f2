"""The report, built from stored results: a front page and a page a chapter. Reads and writes, never solves."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from bh.plotting import interactive
from meshes.errors import FileFormatError, InputError
from meshes.io.export import replacing
from reports import formatting
from reports.changes import MOST, changes, since_kept, since_release
from reports.claims import Claim, claims, claims_csv
from reports.figures import (
    Plot,
    ReportError,
    csv_link,
    legend,
    markup,
    picture_link,
    plot_rows,
    svg,
    typeset,
    with_prefix,
)
from reports.records import Case, CaseInfo, Frames, Results, known_cases, read, schema, shortfall, validated
from reports.sheet_map import CASE, sheet_map
from reports.verdicts import counted, groups, tally, verdicts_csv
from verification.framework.chapters import CHAPTERS, OTHER, Chapter, chapter_of
from verification.framework.folder import refuse_links
from verification.framework.source_claims import Verdict

SOURCE = (
    "Equation numbers, “the source” and “App. B” refer to the dissertation “How Curved Creases Enhance the "
    "Stiffness and Enable Shape Morphing of Thin-Sheet Structures” by Woodruff."
)
MOST_FAILURES = 25  # that are listed at the top
MOST_PARETO = 4  # plots of error against time on the front page
TEMPLATES = Path(__file__).parent / "templates"
ASSETS = {"plotly.min.js": interactive.library, "viewer.js": interactive.script}


@dataclass(frozen=True)
class Page:
    """A chapter with its cases, and those of it that have not been run."""

    chapter: Chapter
    cases: list[Case]
    missing: list[str]
    claims: list[Claim]

    @property
    def file(self) -> str:
        """Its name beside the other chapters."""
        return f"{self.chapter.page}.html"

    @property
    def verdict(self) -> str:
        """The worst verdict of its cases; "missing" without any."""
        found = {case.verdict for case in self.cases}
        return next((word for word in ("differs", "holds", "reported") if word in found), "missing")

    @property
    def scenes(self) -> bool:
        """Whether it has sheets to be turned."""
        return any(case.scenes for case in self.cases)


def build(results_folder: Path, out_file: Path) -> Path:
    """Write the report of the results in a folder: `out_file`, and beside it a folder of its name with the chapters.

    The pages need nothing else, and the same results give the same pages, byte for byte. The schemas of the results are
    written beside them.

    Returns:
        the absolute path of the front page.

    Raises:
        ReportError: results that are missing or not valid, or pages that cannot be written.
    """
    folder, target = Path(results_folder), Path(out_file)
    try:
        refuse_links(folder)
    except InputError as error:
        raise ReportError(str(error)) from error
    site = Site(folder, target.stem, target.name)
    pages = {
        page.file: site.render("chapter.html", page) for page in site.pages if page.cases or page.missing
    }
    front = site.render("front.html", None)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with replacing(target) as temporary:
            _write_folder(target.parent / target.stem, pages, site.scenes)
            temporary.write_text(front, encoding="utf-8", newline="\n")
        for name, model in (("checks", Results), ("frames", Frames)):
            text = json.dumps(schema(model), indent=1) + "\n"
            (folder / f"{name}.schema.json").write_text(text, encoding="utf-8")
    except FileFormatError as error:
        raise ReportError(str(error)) from error
    except OSError as error:
        raise ReportError(
            f"folder '{target.parent}' cannot be made ({error.strerror}); choose another place"
        ) from error
    return target.resolve()


def one_page(results_folder: Path) -> str:
    """The whole report as one page without scripts, to be printed.

    Raises:
        ReportError: results that are missing or not valid.
    """
    return Site(Path(results_folder), "", "", whole=True).render("print.html", None)


class Site:
    """The stored results, read once, and the pages that are made of them.

    `chapters` is the folder of the chapters as seen from the front page, `front` the front page as seen from there;
    with `whole` all is one page.
    """

    def __init__(self, folder: Path, chapters: str, front: str, *, whole: bool = False) -> None:
        """Read the results of a folder; `ReportError` where they are missing or not valid."""
        self.whole, self.chapters, self.front = whole, chapters, front
        self.results = read(folder / "checks.json")
        self.cases = _cases(self.results, folder)
        self.changes = changes(folder, self.results)
        self.since_release = since_release(self.results)
        self.since_kept = since_kept(self.results)
        self.verdicts = groups(self.results.checks)
        ran = [case.name for case in self.cases]
        self.missing = [name for name in known_cases() if name not in ran]
        self.pages = [self._page(chapter) for chapter in (*CHAPTERS, OTHER)]
        if not (self.pages[-1].cases or self.pages[-1].missing):
            self.pages.pop()

    @property
    def scenes(self) -> bool:
        """Whether any page has sheets to be turned."""
        return any(page.scenes for page in self.pages)

    @cached_property
    def map_plots(self) -> list[dict[str, Any]]:
        """Plots of the map of sheets, which the front page shows too."""
        return _shown_twice(self.cases, CASE, lambda _plot: True)

    @cached_property
    def pareto(self) -> tuple[Case, list[dict[str, Any]]] | None:
        """Error against time, which the front page shows too."""
        return _pareto(self.cases)

    def _page(self, chapter: Chapter) -> Page:
        cases = [case for case in self.cases if chapter_of(case.name) == chapter]
        missing = [name for name in self.missing if chapter_of(name) == chapter]
        return Page(chapter, cases, missing, claims(cases))

    def render(self, template: str, page: Page | None) -> str:
        """One page; `page` is the chapter that it shows, None for the front."""
        every = self.cases
        failed = [item for case in every for item in case.checks if item[1].passed is False]
        text: str = (
            _environment(self._linker(page))
            .get_template(template)
            .render(
                site=self,
                here=page,
                results=self.results,
                source=SOURCE,
                shortfall=shortfall(self.results),
                others=_others(self.results),
                date=formatting.date(self.results.date),
                seeds=_seeds(every),
                machine=_machine(self.results.machine),
                style=(TEMPLATES / "style.css").read_text(encoding="utf-8") + interactive.style(),
                reported=sum(case.count(None) for case in every),
                verdicts=self.verdicts,
                counted=counted(self.verdicts),
                unrun=sum(len(group.rows) for group in self.verdicts if group.verdict is Verdict.UNRUN),
                verdicts_csv=verdicts_csv(self.verdicts),
                tally=tally(self.results.checks),
                failed=failed,
                most_failures=MOST_FAILURES,
                most_moves=MOST,
                sheets=sheet_map(every),
                map_plots=self.map_plots,
                pareto=self.pareto,
                claims_csv=claims_csv(claim for shown in self.pages for claim in shown.claims),
                odd=[item for case in every for item in case.checks if item[1].passed and item[1].use > 1.0],
                seconds_in_all=sum(case.info.wall_time_s or 0.0 for case in every),
            )
        )
        return text

    def _linker(self, page: Page | None) -> Callable[[str, str], str]:
        """Links from `page` to an id on the page of a case, or to that page ("" for the front page)."""

        def link(case: str, anchor: str = "") -> str:
            tail = f"#{anchor}" if anchor else ""
            if self.whole:
                return tail or "#top"
            if not case:
                return f"../{self.front}{tail}" if page else tail or "#top"
            there = f"{chapter_of(case).page}.html"
            return there + tail if page else f"{self.chapters}/{there}{tail}"

        return link


def _environment(link: Callable[[str, str], str]) -> Any:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "number": formatting.number,
        "share": formatting.share,
        "seconds": formatting.seconds,
        "words": formatting.words,
        "plain": typeset,
        "date": formatting.date,
        "unlike": lambda params, common: {key: v for key, v in params.items() if key not in common},
        "text": lambda text: Markup(markup(text)),
        "params": lambda given: Markup(formatting.params(given)),
    }
    environment.globals["link"] = link
    return environment


def _write_folder(folder: Path, pages: dict[str, str], scenes: bool) -> None:
    """The chapters and what they load, complete before they take the place of those that were there."""
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".report-") as draft:
        new = Path(draft) / "new"
        (new / "assets").mkdir(parents=True)
        for name, page in pages.items():
            (new / name).write_text(page, encoding="utf-8", newline="\n")
        for name, text in ASSETS.items() if scenes else ():
            (new / "assets" / name).write_text(text(), encoding="utf-8", newline="\n")
        if folder.exists():
            shutil.move(folder, Path(draft) / "old")
        shutil.move(new, folder)


def _others(results: Results) -> list[tuple[str, str]]:
    """Cases from an earlier run than the last, with its date and what else was not as in the last one."""
    found = []
    for info in results.cases:
        if info.date in (None, results.date):
            continue
        differences = [formatting.date(info.date or "")]
        versions = results.versions if info.versions is None else info.versions
        for key, value in versions.items():
            if results.versions.get(key, value) != value:
                differences.append(f"{key} {value}")
        found.append((info.name, "; ".join(differences)))
    return found


def _seeds(cases: Sequence[Case]) -> str:
    """The seeds that records name."""
    found = sorted(
        {str(check.params["seed"]) for case in cases for _, check in case.checks if "seed" in check.params}
    )
    few = found if len(found) <= 6 else [*found[:6], f"and {len(found) - 6} more"]
    return ", ".join(few) or "none"


def _pareto(cases: Sequence[Case]) -> tuple[Case, list[dict[str, Any]]] | None:
    """Plots of error against time of the case `speed_error`, if it has been run: those of the energy, if it has any."""
    case = next((case for case in cases if case.name == "speed_error"), None)
    shown = _shown_twice(cases, "speed_error", lambda plot: plot.id.endswith("-time"))
    energies = [item for item in shown if "energy" in item["plot"].id]
    found = energies or shown or _shown_twice(cases, "speed_error", lambda _plot: True)
    return (case, found[:MOST_PARETO]) if case is not None and found else None


def _shown_twice(cases: Iterable[Case], name: str, wanted: Callable[[Plot], bool]) -> list[dict[str, Any]]:
    """Plots of a case that the front page shows too, with ids of their own."""
    items = [item for case in cases if case.name == name for item in case.plots if wanted(item["plot"])]
    return [{**item, "svg": with_prefix(item["svg"], "front-")} for item in items]


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
        pictures = [{"picture": picture, **_picture(folder, picture.file)} for picture in info.pictures]
        scenes = [
            {"scene": scene, "data": _frames(folder, scene.file), "still": _picture(folder, scene.still)}
            for scene in info.scenes
        ]
        for number, item in enumerate(scenes, start=1):
            item["html"] = _viewer(item, f"sheet-{name}-{number}")
        checks = [(n, check) for n, check in enumerate(results.checks, start=1) if check.case == name]
        cases.append(Case(info, checks, plots, pictures, scenes))
    return cases


def _viewer(item: dict[str, Any], name: str) -> str:
    from markupsafe import escape

    still, alt = item["still"], escape(item["scene"].alt)
    image = f'<img src="{still["link"]}" width="{still["width"]}" height="{still["height"]}" alt="{alt}">'
    return interactive.figure(item["data"], name, item["scene"].title, image)


def _picture(folder: Path, name: str) -> dict[str, Any]:
    link, width, height = picture_link(_inside(folder, name))
    return {"link": link, "width": width, "height": height}


def _frames(folder: Path, name: str) -> dict[str, Any]:
    """Frames of `bh.interactive`, as they are stored."""
    file = _inside(folder, name)
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ReportError(f"frames '{name}' cannot be read; run `bh verify` again") from error
    return validated(Frames, text, name).model_dump()


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
