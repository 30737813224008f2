"""The report: complete, self-contained, honest, the same every time; bad results are refused with one line."""

from __future__ import annotations

import base64
import json
import math
import re
from collections import Counter
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from meshes.errors import InputError
from reports.build import build, one_page
from reports.figures import Plot, svg, typeset
from reports.formatting import number, seconds, share
from verification.framework.cases import CASES
from verification.framework.chapters import chapter_of

# a page for each chapter that has a case, run or not
CHAPTER_PAGES = sorted({f"{chapter_of(name).page}.html" for name in CASES})
VOID = {"meta", "img", "br", "link", "input", "hr"}
MESHES = ("staggered", "alternating", "one-way", "mirrored")


def record(
    case: str, quantity: str, value: float | None, passed: bool | None = None, **more: Any
) -> dict[str, Any]:
    found: dict[str, Any] = {
        "case": case,
        "quantity": quantity,
        "params": {},
        "value": value,
        "unit": "",
        "reference": None,
        "source": "",
        "error": None,
        "tolerance": None,
        "passed": passed,
        "unknowns": None,
        "iterations": None,
        "wall_time_s": None,
    }
    return found | more


def results(folder: Path, failing: int = 2) -> dict[str, Any]:
    """A folder as `bh verify` writes it: three cases, `failing` failed checks, a picture; returns the data."""
    from PIL import Image

    folder.mkdir(parents=True, exist_ok=True)
    Image.new("RGB", (120, 90), "#31688e").save(folder / "sheet.png")
    checks: list[dict[str, Any]] = []
    series = []
    alphas = [1.0, 3.0, 4.0, 8.0, 20.0]
    left = failing
    for row, mesh in enumerate(MESHES):
        ratios = [1.0 + (0.02 + 0.01 * row) * (1 + math.sin(alpha)) / alpha for alpha in alphas]
        series.append({"label": mesh, "x": alphas, "y": [*ratios[:-1], None], "style": "line"})
        for alpha, ratio in zip(alphas, ratios, strict=True):
            passed = None if alpha < 3.0 else left <= 0
            left -= passed is False
            checks.append(
                record(
                    "strips",
                    "bending_out_of_plane",
                    ratio,
                    passed,
                    unit="U_BH / U_Th",
                    reference=1.0,
                    params={"mesh": mesh, "alpha": alpha, "formulation": "bars-and-hinges"},
                    source="Fig. 3.5 (e)",
                    error=ratio - 1.0,
                    tolerance={True: 0.1, False: 1e-4, None: None}[passed],
                    unknowns=480,
                    iterations=1,
                    wall_time_s=0.0012,
                )
            )
    series.append({"label": "theory", "x": alphas, "y": [1.0] * 5, "style": "reference"})
    checks.append(record("cone", "energy", 0.0533, None, unit="N mm", reference=0.0547, error=0.0256))
    checks.append(record("derivatives", "gradient", 3e-12, True, reference=0.0, error=3e-12, tolerance=1e-9))
    plot = {
        "id": "strips-bending",
        "title": "bending <out> of plane",
        "kind": "line",
        "series": series,
        "x": {"label": "aspect ratio alpha = H / W", "log": True},
        "y": {"label": "U_BH / U_Th", "log": False},
        "caption": "Energy over theory & more.",
    }
    picture = {"file": "sheet.png", "alt": 'A folded sheet, "coloured" by energy', "caption": "App. B (a)"}
    case = {
        "source": "source 3.4.1",
        "verdict": "holds",
        "notes": [],
        "plots": [],
        "pictures": [],
        "wall_time_s": 0.5,
    }
    cases = [
        case
        | {
            "name": "strips",
            "title": "Thin strips",
            "question": "How stiff?",
            "plots": [plot, plot],
            "verdict": "differs" if failing else "holds",
            "notes": ["Twisting gives (alpha + 1/alpha)^2 <b>."],
        },
        case
        | {
            "name": "cone",
            "title": "A cone",
            "question": "How near?",
            "pictures": [picture],
            "verdict": "reported",
        },
        case | {"name": "derivatives", "title": "Derivatives", "question": "Exact?"},
    ]
    data = {
        "checks": checks,
        "versions": {"python": "3.11.4", "numpy": "2.4.6"},
        "date": "2026-11-22T02:18:33+00:00",
        "machine": {"system": "Linux", "cores": 2},
        "quick": True,
        "cases": cases,
    }
    write(folder, data)
    return data


def write(folder: Path, data: Any) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    text = data if isinstance(data, str) else json.dumps(data)
    (folder / "checks.json").write_text(text, encoding="utf-8")


class Page(HTMLParser):
    """Elements with their attributes, the text of each, and what is not well formed."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.wrong: list[str] = []
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if len(attrs) != len(dict(attrs)):
            self.wrong.append(f"<{tag}> repeats an attribute")
        self.found.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.wrong.append(f"</{tag}> at {self.getpos()} closes nothing")

    def handle_data(self, data: str) -> None:
        if not self.open or self.open[-1] != "style":
            self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.found if name == tag]


def written(folder: Path) -> dict[Path, str]:
    """Every page of the report that is made of the results in a folder, by file, the front page first."""
    front = build(folder, folder / "report.html")
    return {
        file: file.read_text(encoding="utf-8")
        for file in (front, *sorted((folder / "report").glob("*.html")))
    }


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("results")
    results(found)
    return found


@pytest.fixture(scope="module")
def site(folder: Path) -> dict[Path, str]:
    return written(folder)


@pytest.fixture(scope="module")
def html(folder: Path) -> str:
    """All of the report as one page."""
    return one_page(folder)


@pytest.fixture(scope="module")
def page(html: str) -> Page:
    return Page(html)


def test_pages_are_well_formed(site: dict[Path, str], html: str) -> None:
    assert [file.name for file in site] == ["report.html", *CHAPTER_PAGES]
    for text in (*site.values(), html):
        page = Page(text)
        assert page.wrong == []
        assert page.open == []
        assert page.all("html")[0]["lang"] == "en"
        assert len(page.all("h1")) == 1
        assert len(page.all("main")) == 1


def test_ids_are_unique_and_links_lead_somewhere(site: dict[Path, str], html: str, folder: Path) -> None:
    pages = {file: Page(text) for file, text in site.items()} | {folder / "print.html": Page(html)}
    ids = {file: Counter(a["id"] for _, a in page.found if a.get("id")) for file, page in pages.items()}
    for file, page in pages.items():
        assert [name for name, count in ids[file].items() if count > 1] == []
        for name in (n for _, a in page.found for n in (a.get("aria-labelledby") or "").split()):
            assert name in ids[file]
        for link in (a["href"] for a in page.all("a") if not (a["href"] or "").startswith("data:")):
            other, _, anchor = (link or "").partition("#")
            there = (file.parent / other).resolve() if other else file
            assert there in ids, f"{file.name}: {link}"
            assert not anchor or anchor in ids[there], f"{file.name}: {link}"
    linked = {a["href"] for a in pages[folder / "report.html"].all("a")}
    assert {"report/chapter-3.html", "report/solver.html"} <= linked


def test_nothing_comes_from_elsewhere(site: dict[Path, str]) -> None:
    for text in site.values():
        for tag, attributes in Page(text).found:
            for name in ("src", "href", "xlink:href", "srcset", "action", "data"):
                value = attributes.get(name)
                assert value is None or not re.match(r"(?!data:)[a-z]+:|//", value), f"<{tag} {name}={value}>"
        assert "<script" not in text  # no sheets to turn in these results
        assert "<link" not in text
        assert "@import" not in text
        assert not re.search(r"url\((?!#)", text)
        assert "http://" not in text
        assert "https://" not in text


def test_pictures_and_plots_say_what_they_show(page: Page) -> None:
    images = page.all("img")
    assert [image["alt"] for image in images] == ['A folded sheet, "coloured" by energy']
    assert str(images[0]["src"]).startswith("data:image/webp;base64,")
    plots = [attributes for attributes in page.all("svg") if attributes.get("role") == "img"]
    assert len(plots) == 2
    assert all(plot["aria-labelledby"] for plot in plots)
    assert "bending <out> of plane" in page.text


def test_tables_have_captions_and_headers(page: Page) -> None:
    tables = len(page.all("table"))
    assert tables == 6
    assert len(page.all("caption")) == tables
    assert all(header.get("scope") for header in page.all("th"))


def test_verdicts_are_counted(page: Page) -> None:
    judged = 4 * 4 + 1
    assert f"2 of {judged} checks failed." in page.text
    assert "14 of 16" in page.text
    assert "✗ differs" in page.text
    assert "1 of 1" in page.text
    assert "○ reported" in page.text


def test_failed_records_are_shown_as_failed(html: str, page: Page) -> None:
    rows = [a for a in page.all("tr") if a.get("class") == "fail" and a.get("id")]
    assert len(rows) == 2
    assert page.text.count("✗ failed") == 2
    listed = re.search(r'<ul class="failures">.*?</ul>', html, re.DOTALL)
    assert listed is not None
    assert re.findall(r'href="#(check-\d+)"', listed[0]) == [row["id"] for row in rows]


def test_a_clean_run_says_so(tmp_path: Path) -> None:
    results(tmp_path, failing=0)
    page = Page(one_page(tmp_path))
    assert "17 of 17 checks against closed forms, published values and the shell" in page.text
    assert "0 of 0 checks against the program itself" in page.text
    assert "failed." not in page.text
    assert "✗" not in page.text
    assert "What differs, and why" in page.text


def test_a_verdict_cannot_hide_failed_records(tmp_path: Path) -> None:
    data = results(tmp_path)
    for case in data["cases"]:
        case["verdict"] = "holds"
    write(tmp_path, data)
    page = Page(one_page(tmp_path))
    assert page.text.count("✗ differs") == 3  # the table, the contents of the chapter and the case


def test_passed_records_beyond_their_tolerance_are_pointed_out(tmp_path: Path) -> None:
    data = results(tmp_path, failing=0)
    data["checks"][-1]["error"] = 1.0
    write(tmp_path, data)
    page = Page(one_page(tmp_path))
    assert "1 record is marked as passed with an error beyond the tolerance" in page.text


def test_unreached_states_name_their_outcome(tmp_path: Path) -> None:
    lost = record("fold", "energy", None, False, reference=1.0, tolerance=0.1, outcome="limit-point")
    write(tmp_path, {"checks": [lost]})
    page = Page(one_page(tmp_path))
    assert "1 of 1 checks failed" in page.text
    assert "✗ failed: limit-point" in page.text
    assert "bh verify fold" in page.text


def test_data_behind_plots_can_be_had(page: Page) -> None:
    links = {a["download"]: a["href"] for a in page.all("a") if a.get("download")}
    assert set(links) == {"strips-bending.csv", "strips.csv", "cone.csv", "derivatives.csv", "verdicts.csv"}
    lines = base64.b64decode(str(links["strips-bending.csv"]).split(",")[1]).decode().splitlines()
    assert lines[0] == "series,aspect ratio alpha = H / W,U_BH / U_Th"
    assert len(lines) == 1 + 25
    assert lines[5] == "staggered,20.0,"


def test_same_results_give_the_same_pages(tmp_path: Path, html: str, site: dict[Path, str]) -> None:
    results(tmp_path)
    assert one_page(tmp_path) == html
    again = {file.name: text for file, text in written(tmp_path).items()}
    assert again == {file.name: text for file, text in site.items()}


def test_reproduction_and_environment_are_told(page: Page) -> None:
    for words in (
        "bh verify strips",
        "bh verify cone",
        "2.4.6",
        "22 November 2026, 02:18 UTC",
        "quick run",
        "Woodruff",
    ):
        assert words in page.text


def test_what_is_missing_or_quick_is_named(tmp_path: Path) -> None:
    data = results(tmp_path)
    page = Page(one_page(tmp_path))
    assert f"3 of {len(CASES)} cases run, quick. Not run: shear_calibration, appendix_b" in page.text
    assert "20 records of strips" in page.text
    assert "1 record of cone" in page.text
    data["cases"] = [{"name": name, "quick": name == "cone"} for name in CASES]
    data["cases"][0] |= {
        "date": "2025-01-02T03:04:00+00:00",
        "versions": {"python": "3.11.4", "numpy": "1.0"},
    }
    write(tmp_path, data)
    page = Page(one_page(tmp_path))
    assert "Not run" not in page.text
    assert f"1 of {len(CASES)} cases quick" in page.text
    assert "strips is of 2 January 2025, 03:04 UTC; numpy 1.0" in page.text


def test_text_of_results_is_escaped(html: str) -> None:
    assert "<b>" not in html
    assert "² &lt;b&gt;." in html


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "there are no results"),
        ("{", "is not JSON"),
        ("[]", "the file: input should be"),
        ({}, "checks: field required"),
        ({"checks": [{"case": "a"}]}, r"checks\[0\]\.quantity: field required"),
        ({"checks": [record("a", "b", "1.0")]}, r"checks\[0\]\.value: .*valid number"),  # type: ignore[arg-type]
        ({"checks": [record("a", "b", 1.0, "yes")]}, r"checks\[0\]\.passed: .*boolean"),  # type: ignore[arg-type]
        ({"checks": [], "cases": [{"name": "a"}, {"name": "a"}]}, "case 'a' is there twice"),
        (
            {"checks": [], "cases": [{"name": "a", "pictures": [{"file": "x.png", "alt": ""}]}]},
            "x.png' is missing",
        ),
        (
            {"checks": [], "cases": [{"name": "a", "pictures": [{"file": "checks.json", "alt": ""}]}]},
            "cannot be read",
        ),
        (
            {"checks": [], "cases": [{"name": "a", "pictures": [{"file": "../x.png", "alt": ""}]}]},
            "lies outside",
        ),
        ({"checks": [], "cases": [{"name": "a", "plots": [{"id": "p"}]}]}, r"cases\[0\]\.plots\[0\]\.title"),
        (
            {
                "checks": [],
                "cases": [
                    {
                        "name": "a",
                        "plots": [
                            {
                                "id": "p",
                                "title": "",
                                "x": {"label": ""},
                                "y": {"label": ""},
                                "series": [{"label": "s", "x": [1.0], "y": []}],
                            }
                        ],
                    }
                ],
            },
            "1 x for 0 y",
        ),
    ],
)
def test_bad_results_are_refused_in_one_line(tmp_path: Path, content: Any, message: str) -> None:
    folder = tmp_path / "results"
    if content is not None:
        write(folder, content)
    with pytest.raises(InputError, match=message) as caught:
        build(folder, tmp_path / "report.html")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "report.html").exists()


def test_a_page_that_cannot_be_written_is_an_input_error(tmp_path: Path) -> None:
    results(tmp_path)
    (tmp_path / "blocked").write_text("")
    with pytest.raises(InputError, match="cannot be made") as caught:
        build(tmp_path, tmp_path / "blocked" / "report.html")
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="is a folder"):
        build(tmp_path, tmp_path)


def test_strange_plots_are_drawn(tmp_path: Path) -> None:
    def drawn(y: list[float | None], log: bool) -> str:
        series = {"label": "a $ _b", "x": [1.0, 2.0, 3.0][: len(y)], "y": y, "style": "points"}
        axes = {"x": {"label": "$x"}, "y": {"label": "y", "log": log}}
        return svg(Plot.model_validate({"id": "p", "title": "t", "series": [series], **axes}), "p-")

    many: list[list[float | None]] = [
        [],
        [None, None],
        [1.0, math.inf, math.nan],
        [1.0, 1.0, 1.0 + 1e-14],
        [0.0, -1.0, 2.0],
        [1e-9, 1.0, 1e9],
    ]
    for y in many:
        for log in (False, True):
            assert Page(drawn(y, log)).wrong == []
    assert "10⁻⁹" in drawn([1e-9, 1.0, 1e9], True)
    assert "1e" not in drawn([1.0, 1.0, 1.0 + 1e-14], False)


def test_numbers_have_sensible_digits() -> None:
    assert number(1.0) == "1"
    assert number(1.0, full=True) == "1.0000"
    assert number(0.0533124) == "0.053312"
    assert number(-4.526e-6, 3) == "−4.53\u2009×\u200910⁻⁶"  # noqa: RUF001
    assert number(12345.0) == "12\u2009345"
    assert number(9.99999, 3) == "10.0"
    assert number(None) == "–"  # noqa: RUF001
    assert number(math.nan) == "not a number"
    assert (seconds(0.0012), seconds(4.31), seconds(200.0)) == (
        "1.2\u00a0ms",
        "4.3\u00a0s",
        "3\u00a0min\u00a020\u00a0s",
    )


def test_errors_are_shares_of_the_reference(tmp_path: Path) -> None:
    from reports.records import Check

    against_one = Check(**record("a", "b", 1.0, unit="mm", reference=2.0))
    against_zero = Check(**record("a", "b", 1.0, unit="mm", reference=0.0))
    assert share(0.028, against_one) == "2.8\u00a0%"
    assert share(0.028, against_zero) == "0.028\u00a0mm"


def test_text_is_typeset() -> None:
    assert typeset("(theta + 1/theta)^2.") == "(θ + 1/θ)²."
    assert typeset("about 4.5e-06 N, -3 at 1,745, or 2E3.") == (
        "about 4.5\u2009×\u200910⁻⁶ N, −3 at 1\u2009745, or 2\u2009×\u200910³."  # noqa: RUF001
    )
    assert typeset("Eq. 3.2-3.4, 20-30, 1e, v1e3, 1,2") == "Eq. 3.2-3.4, 20-30, 1e, v1e3, 1,2"
    assert typeset("theta_a, alphabet, 2^-3, x^2.5") == "θ_a, alphabet, 2⁻³, x^2.5"
    assert typeset("t = 1, 3 % of") == "t\u00a0=\u00a01, 3\u00a0% of"


@pytest.mark.parametrize("reuse", [True, False])
def test_command_says_where_the_report_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reuse: bool
) -> None:
    import typer

    import verification.framework.run as verification
    from reports.command import report

    asked = []

    def run(cases: Any, folder: Path, quick: bool, tell: Any, jobs: int) -> dict[str, Any]:
        assert jobs >= 1
        asked.append((cases, quick))
        tell("strips: differs")
        return results(folder)

    monkeypatch.setattr(verification, "run", run)
    if reuse:
        results(tmp_path)
    app = typer.Typer()
    app.command()(report)
    done = CliRunner().invoke(app, ["--results", str(tmp_path), "--quick", *(["--reuse"] if reuse else [])])
    assert done.exit_code == 0, done.output
    assert asked == ([] if reuse else [(None, True)])
    assert "15 of 17 checks passed, 5 reported" in done.output
    assert f"report: {tmp_path / 'report.html'}" in done.output.replace("\n", "")
    assert (tmp_path / "report.html").is_file()


# ------------------------------------------------------------------------------------------ results of strangers

HOSTILE = """x"'><script src=file:///tmp/x.js></script><img src=x onerror=alert(1)><!--"""
WORDS = {"file", "still", "kind", "style", "verdict", "outcome", "date"}  # not free


def poisoned(data: Any, key: str = "") -> Any:
    """The data with something hostile at the end of every text and every name."""
    if isinstance(data, dict):
        free = key in ("params", "versions", "machine", "tops", "density", "energy")
        return {k + HOSTILE if free else k: poisoned(v, k) for k, v in data.items()}
    if isinstance(data, list):
        return [poisoned(item, key) for item in data]
    return data + HOSTILE if isinstance(data, str) and key not in WORDS else data


class Loud(HTMLParser):
    """What a page has that acts: scripts and handlers of events."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.found += [f"{tag} {name}" for name in given if name.startswith("on")]
        if tag == "script" and "x.js" in str(given.get("src")):
            self.found.append("script")
        if tag == "img" and given.get("src") == "x":
            self.found.append("img")


def test_names_in_results_cannot_run_scripts(tmp_path: Path) -> None:
    folder = tmp_path / "results"
    data = poisoned(results(folder))
    (folder / "checks.json").write_text(json.dumps(data), encoding="utf-8")
    front = build(folder, folder / "report.html")
    pages = [front, *front.with_suffix("").glob("*.html")]
    assert len(pages) > 1
    for page in (*(page.read_text(encoding="utf-8") for page in pages), one_page(folder)):
        parser = Loud()
        parser.feed(page)
        assert parser.found == []
        assert "x&#" in page or "&lt;script" in page or len(pages) > 2


def test_names_in_frames_cannot_run_scripts() -> None:
    import bh
    import meshes
    from bh.plotting import interactive

    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.7), along=6)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127), formulation="bars-and-hinges").fold("crease", by=0.2)
    data = poisoned(dict(interactive.view(bh.trace(model)).data))
    parser = Loud()
    parser.feed(interactive.figure(data, "sheet" + HOSTILE, "title" + HOSTILE))
    assert parser.found == []


@pytest.mark.parametrize(
    "name", ["checks.schema.json", "report.html", "previous.json", "checks.json.part", "sub/a.png"]
)
def test_nothing_is_written_through_links(name: str, tmp_path: Path) -> None:
    """A results folder from elsewhere, with a link of a name that is written."""
    from verification.framework.run import run

    folder = tmp_path / "results"
    results(folder)
    victim = tmp_path / "victim"
    victim.write_text("mine")
    (folder / name).parent.mkdir(exist_ok=True)
    (folder / name).symlink_to(victim)
    with pytest.raises(InputError, match="symbolic link") as caught:
        build(folder, folder / "report.html")
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="symbolic link"):
        run(["shear_calibration"], folder)
    assert victim.read_text() == "mine"
