"""What the report is made of: chapters, claims of the source, changes, sheets to turn, schemas, the PDF."""

from __future__ import annotations

import base64
import json
import re
import shutil
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import bh
import meshes
from bh.plotting import interactive
from meshes.errors import InputError
from reports.build import build, one_page
from reports.changes import changes, since_kept, since_release
from reports.claims import claims
from reports.pdf import browser, print_report
from reports.records import Case, CaseInfo, Check, Frames, Results, read, schema
from tests.unit.test_report import Page, record, results, write
from verification.framework import run as runner
from verification.framework.cases import ALL_CASES, BY_NAME
from verification.framework.chapters import CHAPTERS, OTHER, chapter_of
from verification.framework.release import RELEASE, of_release
from verification.framework.run import RECORDS, run


def case(*records: dict[str, Any]) -> Case:
    checks = [(n, Check(**r)) for n, r in enumerate(records, start=1)]
    return Case(CaseInfo(name=records[0]["case"]), checks)


# ------------------------------------------------------------------------------------------------- chapters


@pytest.mark.parametrize("name", ALL_CASES)
def test_every_case_has_a_chapter(name: str) -> None:
    """A case names a chapter that there is, else it would land on the page of the others."""
    assert chapter_of(name) != OTHER


def test_chapters_are_those_of_the_source() -> None:
    assert [chapter.key for chapter in CHAPTERS] == ["3", "4", "5", "6", "A", "B", "solver"]
    found = {name: chapter_of(name).page for name in ("fig5_5", "tables4", "appendix_b_cross")}
    assert list(found.values()) == ["chapter-5", "chapter-4", "appendix-b"]
    assert chapter_of("never heard of") == OTHER


def test_a_case_of_no_chapter_is_shown_all_the_same(tmp_path: Path) -> None:
    write(tmp_path, {"checks": [record("novelty", "energy", 1.0, True, tolerance=0.1, error=0.0)]})
    build(tmp_path, tmp_path / "report.html")
    assert "bh verify novelty" in (tmp_path / "report" / "other.html").read_text(encoding="utf-8")


# --------------------------------------------------------------------------------------------------- claims


def test_claims_are_what_the_source_says() -> None:
    place = "source 3.5.1, Fig. 3.9: phi = 90 degrees"
    found = claims(
        [
            case(
                record(
                    "a",
                    "angle",
                    91.0,
                    True,
                    source=place,
                    reference=90.0,
                    error=1 / 90,
                    tolerance=0.1,
                    unit="deg",
                ),
                record(
                    "a",
                    "angle",
                    88.0,
                    True,
                    source=place,
                    reference=90.0,
                    error=2 / 90,
                    tolerance=0.1,
                    unit="deg",
                ),
                record("a", "angle", 10.0, source=place, reference=90.0, error=0.9, unit="deg"),
                record("a", "energy", 1.0, source="Eq. 3.13", reference=1.0, error=0.0),
                record("a", "reported only", 1.0, source=place),
                record(
                    "a", "stiffer", 1.0, True, source="source Fig. 3", reference=1.0, error=0.0, tolerance=0.0
                ),
            )
        ]
    )
    assert [(claim.number, claim.count, claim.verdict) for claim in found] == [
        (2, 3, "holds"),
        (6, 1, "holds"),
    ]
    assert (found[0].place, found[0].words) == ("3.5.1, Fig. 3.9", "phi = 90 degrees")
    assert [claim.yes_or_no for claim in found] == [False, True]


def test_each_published_value_has_its_row_and_its_error_bar(tmp_path: Path) -> None:
    rows = [
        record(
            "a",
            "energy",
            value,
            source="source Table B.1",
            reference=table,
            error=abs(value / table - 1),
            unit="N mm",
            params={"actuation": name, "error_bar": bar},
        )
        for name, value, table, bar in (("a", 0.0537, 0.0547, 2.5e-4), ("d", 0.0504, 0.0513, None))
    ]
    assert [claim.check.bar for claim in claims([case(*rows)])] == [2.5e-4, None]
    write(tmp_path, {"checks": rows})
    words = Page(one_page(tmp_path)).text
    assert "0.0547 N mm 0.0537 ± 0.00025 N mm off by 1.8" in words
    (link,) = [
        a["href"] or "" for a in Page(one_page(tmp_path)).all("a") if a.get("download") == "claims.csv"
    ]
    table = base64.b64decode(link.split(",")[1]).decode().splitlines()
    assert len(table) == 3
    assert ",0.0547,0.0537,0.00025,N mm," in table[1]


def test_a_claim_that_fails_stands_for_the_others() -> None:
    def row(value: float, passed: bool) -> dict[str, Any]:
        error = abs(value - 1.0)
        return record(
            "a", "ratio", value, passed, source="source 3", reference=1.0, error=error, tolerance=0.1
        )

    (claim,) = claims([case(row(1.09, True), row(1.2, False), row(1.01, True))])
    assert (claim.number, claim.verdict) == (2, "differs")


def test_error_against_time_is_on_the_front_page(tmp_path: Path) -> None:
    data = results(tmp_path)
    assert "is not in these results" in Page(build(tmp_path, tmp_path / "report.html").read_text()).text
    plot = data["cases"][0]["plots"][0]
    plots = [
        plot | {"id": f"speed-error-b-{quantity}-{axis}", "title": f"{quantity} against {axis}"}
        for quantity in ("curve", "energy")
        for axis in ("time", "unknowns")
    ]
    data["cases"].append(
        data["cases"][2] | {"name": "speed_error", "title": "Speed and error", "plots": plots}
    )
    write(tmp_path, data)
    front = Page(build(tmp_path, tmp_path / "report.html").read_text())
    assert "energy against time" in front.text
    assert "curve against time" not in front.text
    assert "energy against unknowns" not in front.text
    whole = Page(one_page(tmp_path))
    names = [a["id"] for _, a in whole.found if a.get("id")]
    assert len(names) == len(set(names))


# -------------------------------------------------------------------------------------------------- changes


def test_changes_against_the_last_results(tmp_path: Path) -> None:
    before = results(tmp_path, failing=0)
    shutil.copyfile(tmp_path / "checks.json", tmp_path / "previous.json")
    now = json.loads(json.dumps(before))
    now["checks"][3] |= {"passed": False, "error": 0.5, "value": 1.5}
    now["checks"][8]["value"] *= 1.0 + 1e-9
    now["checks"][12]["params"]["alpha"] = 99.0
    write(tmp_path, now)
    found = changes(tmp_path, read(tmp_path / "checks.json"))
    assert found is not None
    assert [number for number, _, _ in found.broken] == [4]
    assert [row[0] for row in found.moved] == [4]
    assert (found.new, found.gone, found.same) == (1, 1, len(now["checks"]) - 2)
    assert "1 that passed then fails now." in one_page(tmp_path)


def test_no_last_results_and_broken_ones(tmp_path: Path) -> None:
    results(tmp_path)
    assert changes(tmp_path, read(tmp_path / "checks.json")) is None
    assert "Since the last results" not in one_page(tmp_path)
    (tmp_path / "previous.json").write_text("{")
    assert "cannot be compared" in one_page(tmp_path)


def test_changes_against_the_records_that_are_kept(tmp_path: Path) -> None:
    """Of the cases that were run since, and no others; a case whose record is shown itself has not changed."""
    now = results(tmp_path, failing=0)
    name = now["cases"][0]["name"]
    kept = json.loads(json.dumps(now))
    records = tmp_path / "records"
    records.mkdir()
    (records / f"{name}.json").write_text(json.dumps(kept))
    assert since_kept(read(tmp_path / "checks.json"), records) is None
    mine = [number for number, check in enumerate(now["checks"], 1) if check["case"] == name]
    kept["cases"] = [{**info, "date": "2026-01-01T00:00:00+00:00"} for info in kept["cases"]]
    kept["cases"] = [info for info in kept["cases"] if info["name"] == name]
    held = next(number for number in mine if now["checks"][number - 1]["passed"])
    kept["checks"][held - 1] |= {"passed": False, "error": 0.5, "value": 1.5}
    (records / f"{name}.json").write_text(json.dumps(kept))
    found = since_kept(read(tmp_path / "checks.json"), records)
    assert found is not None
    assert found[1] == [name]
    assert [number for number, _, _ in found[0].mended] == [held]
    assert found[0].new == found[0].gone == 0
    assert found[0].same == len(mine) - 1


def test_changes_since_the_release(tmp_path: Path) -> None:
    """A release keeps a value and a verdict for each record; what moved since is told beside what is new or gone."""
    data = {**results(tmp_path), "quick": False}
    write(tmp_path, data)
    file = tmp_path / "release.json"
    name = data["cases"][0]["name"]
    mine = [n for n, check in enumerate(data["checks"], 1) if check["case"] == name]
    held = next(n for n in mine if data["checks"][n - 1]["passed"])
    before = json.loads(json.dumps(data))
    assert since_release(read(tmp_path / "checks.json"), file) is None
    before["cases"] = before["cases"][:1]
    before["checks"][held - 1] |= {"passed": False, "value": before["checks"][held - 1]["value"] + 1.0}
    before["checks"][held - 1]["params"]["error_bar"] = 0.1  # a result: the record is the same one
    before["checks"].append({**before["checks"][held - 1], "quantity": "what is gone"})
    file.write_text(json.dumps(of_release(before, "1.2.3")))
    found = since_release(read(tmp_path / "checks.json"), file)
    assert found is not None
    assert (found.version, found.cases, name in found.later) == ("1.2.3", 1, False)
    assert len(found.later) == len(data["cases"]) - 1
    assert [n for n, _, _ in found.changes.mended] == [n for n, *_ in found.changes.moved] == [held]
    assert (found.changes.gone, found.changes.new, found.changes.same) == (1, 0, len(mine) - 1)
    data["checks"][held - 1]["unit"] = "s"  # times are measured anew, and no changes
    write(tmp_path, data)
    again = since_release(read(tmp_path / "checks.json"), file)
    assert again is not None
    assert not again.changes.moved


def test_the_shipped_release_is_read() -> None:
    kept = json.loads(RELEASE.read_text(encoding="utf-8"))
    assert set(kept["cases"]) <= set(BY_NAME)
    assert all(len(key) == 12 for case in kept["cases"].values() for key in case)


def test_a_run_keeps_the_results_that_it_replaces(tmp_path: Path) -> None:
    run(["shear_calibration"], tmp_path, quick=True)
    first = (tmp_path / "checks.json").read_bytes()
    assert not (tmp_path / "previous.json").exists()
    run(["shear_calibration"], tmp_path, quick=True)
    assert (tmp_path / "previous.json").read_bytes() == first
    found = changes(tmp_path, read(tmp_path / "checks.json"))
    assert found is not None
    assert not found.moved
    assert found.new == found.gone == 0


# ---------------------------------------------------------------------------------------------- sheets to turn


@pytest.fixture(scope="module")
def path() -> bh.Path:
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.5), along=6, rows=1)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127)).support("rigid-body")
    return bh.trace(model.fold("crease", to=2.6).fold("crease", to=2.0))


def unpacked(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype=kind)


def test_frames_hold_the_states(path: bh.Path) -> None:
    data = interactive.view(path).data
    (model,) = data["models"]
    mesh = path.model.mesh
    points = unpacked(model["points"], "<f4").reshape(len(path), -1, 3)
    assert points[-1] == pytest.approx(path[-1].points, abs=1e-5)
    nodes, triangles = unpacked(model["nodes"], "<i4"), unpacked(model["triangles"], "<i4").reshape(-1, 3)
    assert np.array_equal(nodes[triangles], mesh.triangles)
    assert len(nodes) == len(mesh.points) + len(mesh.nodes("crease:crease"))  # cut open along the crease
    density = unpacked(model["density"]["bending"], "<f4").reshape(len(path), -1)
    assert density[-1] == pytest.approx(path[-1].nodal_energy_density("bending"), rel=1e-6)
    assert model["energy"]["total"] == [state.energy.total for state in path]
    assert data["lambdas"] == pytest.approx(path.lambdas)
    jsonschema.validate(data, schema(Frames))


def test_paths_side_by_side_share_their_lambdas(path: bh.Path) -> None:
    data = interactive.view({"one": path, "two": path}).data
    assert [model["name"] for model in data["models"]] == ["one", "two"]
    with pytest.raises(bh.plotting.PlotError, match="no states at the same lambda"):
        interactive.view({"one": path, "none": bh.Path(path.model)})


def test_a_view_is_a_page_of_its_own(path: bh.Path, tmp_path: Path) -> None:
    view = interactive.view(path, 'A <sheet> of "paper"')
    text = view.save(tmp_path / "sheet.html").read_text(encoding="utf-8")
    assert "A &lt;sheet&gt; of &quot;paper&quot;" in text
    assert "plotly.js" in text[:200_000]
    assert not re.search(r'<(script|link|img)[^>]+(src|href)="(?!data:)', text)
    assert view._repr_html_().startswith("<iframe")
    assert repr(view) == f"View(1 models, {len(path)} frames)"


def test_sheets_are_in_the_chapter(path: bh.Path, tmp_path: Path) -> None:
    data = results(tmp_path)
    frames = interactive.view(path).data
    (tmp_path / "cone.frames.json").write_text(json.dumps(frames))
    scene = {"file": "cone.frames.json", "still": "sheet.png", "title": "A <cone>", "alt": "A cone, folded"}
    data["cases"][1]["scenes"] = [scene]
    write(tmp_path, data)
    build(tmp_path, tmp_path / "report.html")
    text = (tmp_path / "report" / "chapter-3.html").read_text(encoding="utf-8")
    assert '<img src="data:image/webp' in text
    assert 'alt="A cone, folded"' in text
    assert "A &lt;cone&gt;" in text
    assert sorted(file.name for file in (tmp_path / "report" / "assets").iterdir()) == [
        "plotly.min.js",
        "viewer.js",
    ]
    assert 'src="assets/plotly.min.js"' in text
    assert "assets/plotly" not in (tmp_path / "report" / "solver.html").read_text(encoding="utf-8")
    assert "<script" not in one_page(tmp_path).replace('<script type="application/json"', "")
    for broken, message in (({**frames, "eye": "up"}, r"eye: .*array"), ({}, "format: field required")):
        (tmp_path / "cone.frames.json").write_text(json.dumps(broken))
        with pytest.raises(InputError, match=message):
            build(tmp_path, tmp_path / "report.html")


# ------------------------------------------------------------------------------------------------- schemas


def test_results_obey_their_schema(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is run, and a kept record beside it; all kept records are held against the schema below."""
    kept = tmp_path / "records"
    kept.mkdir()
    shutil.copyfile(RECORDS / "problem_c.json", kept / "problem_c.json")
    monkeypatch.setattr(runner, "RECORDS", kept)
    run(["shear_calibration", "derivatives"], tmp_path, quick=True)
    build(tmp_path, tmp_path / "report.html")
    stored = json.loads((tmp_path / "checks.schema.json").read_text(encoding="utf-8"))
    assert stored == schema(Results)
    jsonschema.Draft202012Validator.check_schema(stored)
    results_ = json.loads((tmp_path / "checks.json").read_text(encoding="utf-8"))
    assert {info["name"] for info in results_["cases"]} == {"shear_calibration", "derivatives", "problem_c"}
    jsonschema.validate(results_, stored)
    with pytest.raises(jsonschema.ValidationError, match="'yes'"):
        jsonschema.validate({"checks": [record("a", "b", 1.0) | {"passed": "yes"}]}, stored)


@pytest.mark.parametrize("file", sorted(RECORDS.glob("*.json")), ids=lambda file: file.stem)
def test_kept_records_obey_the_schema(file: Path) -> None:
    jsonschema.validate(json.loads(file.read_text(encoding="utf-8")), schema(Results))


# ------------------------------------------------------------------------------------------------------ PDF


def test_a_pdf_needs_a_browser(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    results(tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match="a PDF needs a browser"):
        print_report(tmp_path, tmp_path / "report.pdf")


@pytest.mark.skipif(browser() is None, reason="no chromium or chrome on this machine")
def test_the_report_is_printed(tmp_path: Path) -> None:
    results(tmp_path)
    file = print_report(tmp_path, tmp_path / "report.pdf")
    assert file.read_bytes()[:5] == b"%PDF-"
    assert file.stat().st_size > 20_000
