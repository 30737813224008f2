"""docs/drawing.md: its commands and its Python run on the example, its table is what the importer does."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import bh
import meshes
from bh.commands.cli import main
from bh.errors import InputError
from bh.formulations.registry import remarks
from bh.scene.example import example
from bh.scene.json_schema import schema
from bh.scene.load import SECTIONS, load_scene, parse_scene
from bh.scene.report import report
from bh.scene.toml_text import read_toml
from meshes.io.strokes import Rules, Stroke, parse_colour

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "drawing.md").read_text(encoding="utf-8")
EXAMPLES = sorted((ROOT / "examples").glob("*.toml"))


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    shutil.copy(ROOT / "examples" / "wave.svg", tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_tutorial_runs(here: Any, capsys: pytest.CaptureFixture[str]) -> None:
    commands = [line[3:] for line in PAGE.splitlines() if line.startswith("bh ")]
    assert len(commands) == 7
    for command in commands:
        assert main(shlex.split(command)) == 0, capsys.readouterr().err
    out = capsys.readouterr().out
    assert "sheet: 120 x 80 mm" in out
    assert "wave: reached" not in out
    assert "scene: reached" in out
    for name in ("scene-check.png", "folded.png", "flat.dxf", "folded.glb", "folded.fold"):
        assert (here / name).stat().st_size > 500
    assert len(json.loads((here / "folded.fold").read_text())["file_frames"]) >= 2


def test_the_python_runs(here: Any, capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, object] = {}
    for code in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL):
        exec(compile(code, "docs/drawing.md", "exec"), names)
    outcome, angle, again, energy = capsys.readouterr().out.split()
    assert outcome == again == "reached"
    assert float(energy) == pytest.approx(0.976, abs=0.02)
    assert 0.5 < float(angle) < 0.8


def test_the_scene_of_the_page_is_read(here: Any) -> None:
    (text,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    rest = (
        "[sheet]\nE = 4000.0\nt = 0.2\n[mesh]\nalong = 20\n[[steps]]\nfold = { crease = 'all', by = 0.1 }\n"
    )
    mesh = parse_scene(text + rest, here).model.mesh
    assert mesh.points.max(axis=0)[:2] == pytest.approx([240.0, 160.0])


def test_the_table_is_what_the_importer_does() -> None:
    rows = re.findall(r"^\| (\w+) \| ([\w, ]+) \| \w+ `(#\w+)` \| ([\w-]*) *\|$", PAGE, re.MULTILINE)
    assert len(rows) == 7
    rules = Rules()

    def kind(**look: Any) -> Any:
        return rules.kind(Stroke(lambda tolerance: np.zeros((0, 2)), "a line", **look))

    for word, layers, colour, dash in rows:
        assert kind(colour=parse_colour(colour)) == word
        for layer in layers.split(", "):
            assert kind(layer=layer, colour=(1, 200, 1)) == word
            assert kind(layer=f"3_{layer.upper()} lines", colour=(128, 128, 128)) == word
        if dash:
            assert kind(colour=(0, 0, 0), dash=dash.replace("-", "")) == word


class TestInit:
    def test_the_library(self, here: Any, capsys: pytest.CaptureFixture[str]) -> None:
        assert main(["init"]) == 0
        assert main(["check", "scene.toml", "--no-picture"]) == 0
        assert main(["init"]) == 2
        assert "--force" in capsys.readouterr().err
        assert main(["init", "--force"]) == 0

    def test_drawings_are_solved_to_an_accuracy(self, here: Any) -> None:
        (here / "cross.svg").write_text(
            '<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="60mm" viewBox="0 0 60 60">'
            '<rect width="60" height="60" stroke="black" fill="none"/>'
            '<path d="M0,0 L60,60 M60,0 L0,60" stroke="red"/>FACETS</svg>'
        )
        text = (here / "cross.svg").read_text()
        (here / "rulings.svg").write_text(text.replace("FACETS", '<path d="M30,0 L30,60" stroke="yellow"/>'))
        for name, kind in (("wave", "staggered"), ("cross", "gmsh"), ("rulings", "gmsh")):
            scene = parse_scene(example(Path(f"{name}.svg"), here), here)
            assert scene.accuracy is not None
            assert scene.model.mesh.kind == kind
            (line,) = [line for line in report(scene) if line.startswith("mesh")]
            assert "chosen by the run, until the energy is right to 5 %" in line
            assert not any(line.startswith("remark (aspect") for line in report(scene))
        with pytest.raises(InputError, match="no drawing"):
            example(Path("scene.toml"), here)

    def test_from_another_folder(self, here: Any, monkeypatch: Any) -> None:
        monkeypatch.setenv("BH_ALLOW_OUTSIDE", "1")  # as the command that is printed says
        (here / "scenes").mkdir()
        assert main(["init", "scenes/wave.toml", "--drawing", "wave.svg"]) == 0
        assert load_scene(here / "scenes" / "wave.toml").model.mesh.kind == "staggered"

    def test_the_example_is_what_is_written(self) -> None:
        assert (ROOT / "examples" / "wave.toml").read_text() == example(Path("wave.svg"), ROOT / "examples")


class TestCheck:
    def test_pictures(self, here: Any) -> None:
        for scene in ("appendix_b_a", "miura"):
            for suffix in ("png", "svg", "pdf"):
                assert (
                    main(["check", str(ROOT / "examples" / f"{scene}.toml"), "--picture", f"a.{suffix}"]) == 0
                )
                assert (here / f"a.{suffix}").stat().st_size > 1000
        assert main(["check", str(ROOT / "examples" / "miura.toml"), "--picture", "a.gif"]) == 2

    def test_words(self) -> None:
        lines = report(load_scene(ROOT / "examples" / "appendix_b_a.toml"))
        assert "support at corner:inner-start: fix xyz, 1 node" in lines
        assert any(line.startswith("crease crease: mountain, 78.5") for line in lines)
        assert any(line.startswith("places: corner:inner-start") for line in lines)

    def test_errors_are_one_line(self, here: Any, capsys: pytest.CaptureFixture[str]) -> None:
        (here / "bad.toml").write_text("[pattern]\nfile = 'wave.svg'\n[sheet]\nE = 1.0\nt = 0.1\n[[steps]]\n")
        assert main(["check", "bad.toml"]) == 2
        assert capsys.readouterr().err.count("\n") == 1


class TestSchema:
    @pytest.mark.parametrize("file", EXAMPLES, ids=lambda f: f.stem)
    def test_examples_fit(self, file: Any) -> None:
        jsonschema.Draft202012Validator(schema()).validate(read_toml(file.read_text(encoding="utf-8")))

    def test_it_is_a_schema_of_every_section(self) -> None:
        jsonschema.Draft202012Validator.check_schema(schema())
        properties = schema()["properties"]
        assert isinstance(properties, dict)
        assert set(properties) == set(SECTIONS)

    def test_things_of_ones_own_are_allowed(self) -> None:
        scene = read_toml((ROOT / "examples" / "wave.toml").read_text())
        own = {"pattern": {"kind": "mine:fan", "blades": 5}, "steps": [{"mine:twist": {"by": 1.0}}]}
        jsonschema.validate(scene | own | {"supports": [{"kind": "mine:grip", "at": "all"}]}, schema())

    @pytest.mark.parametrize(
        ("section", "value"),
        [
            ("sheet", {"E": -1.0, "t": 0.1}),
            ("sheet", {"E": 1.0, "t": 0.1, "colour": "red"}),
            ("mesh", {"kind": "gmsh"}),
            ("steps", []),
            ("steps", [{"bend": {}}]),
            ("colour", {}),
        ],
    )
    def test_what_cannot_be_is_refused(self, section: str, value: Any) -> None:
        scene = read_toml((ROOT / "examples" / "wave.toml").read_text())
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(scene | {section: value}, schema())

    def test_the_command(self, here: Any, capsys: pytest.CaptureFixture[str]) -> None:
        assert main(["schema"]) == 0
        assert json.loads(capsys.readouterr().out) == schema()
        assert main(["schema", "-o", "s.json"]) == 0
        assert json.loads((here / "s.json").read_text()) == schema()


class TestRemarks:
    """The mesh-pattern facts are told, and a good mesh is not scolded."""

    def codes(
        self, mesh: str, steps: str = "fold = { crease = 'crease', to = 2.0 }", how: str = "bars-and-hinges"
    ) -> Any:
        text = (
            "[pattern]\nkind = 'annulus_sector'\nradius = 60.0\nwidth = 10.0\nangle = 1.0\n"
            "[sheet]\nE = 4000.0\nt = 0.1\n"
            f"[mesh]\n{mesh}\n[model]\nformulation = '{how}'\n[[supports]]\nat = 'edge:inner'\n"
            f"fix = 'xyz'\n[[steps]]\n{steps}\n"
        )
        model = parse_scene(text).model
        assert bh.remarks(model) == remarks(model)
        return [remark.code for remark in bh.remarks(model)]

    @pytest.mark.parametrize(
        ("mesh", "codes"),
        [
            ("aspect_ratio = 8.0", ["crease"]),
            ("aspect_ratio = 2.0", ["crease", "aspect-ratio"]),
            ("aspect_ratio = 20.0", ["crease", "aspect-ratio"]),
            ("aspect_ratio = 8.0\nkind = 'alternating'", ["crease"]),
            ("aspect_ratio = 8.0\nkind = 'one-way'", ["crease", "diagonals"]),
            ("aspect_ratio = 8.0\nkind = 'mirrored'\nrows = 2", ["crease", "diagonals", "rows"]),
            ("size = 3.0\nkind = 'gmsh'", ["crease", "rulings"]),
        ],
    )
    def test_bars_and_hinges(self, mesh: str, codes: Any) -> None:
        assert self.codes(mesh) == codes
        few = [] if "rows" in mesh or "gmsh" in mesh else ["rows"]
        assert self.codes(mesh, how="consistent") == few

    def test_what_bars_and_hinges_are_off_by_is_told_in_one_line(self) -> None:
        sheet = bh.Sheet(E=4000.0, t=0.2)
        several = meshes.annulus_sector([60.0, 70.0], 10.0, 1.0, ["mountain", "valley"])
        for pattern, kind, code, figure in (
            (meshes.annulus_sector(60.0, 10.0, 1.0), "one-way", "crease", "1.07 to 2.08 times"),
            (several, "staggered", "creases", "1.06 to 1.22 times"),
            (meshes.full_annulus(60.0, 10.0), "staggered", "ring", "4.3 times (more with shorter cells)"),
        ):
            mesh = meshes.structured(pattern, aspect_ratio=8, kind=kind)  # type: ignore[arg-type]
            model = bh.Model(mesh, sheet, formulation="bars-and-hinges").fold("all", by=0.5)
            (remark,) = [r for r in bh.remarks(model) if r.code == code]
            assert figure in remark.text
            assert 'formulation = "consistent" converges' in remark.text
            assert code not in [r.code for r in bh.remarks(replace(model, formulation="consistent"))]

    def test_loads(self) -> None:
        pull = "force = { at = 'edge:end', total = [0.0, 0.0, 0.001] }"
        assert self.codes("aspect_ratio = 8.0", pull) == ["crease", "loads"]
        assert self.codes("aspect_ratio = 8.0", pull, "consistent") == ["rows"]
        assert self.codes("aspect_ratio = 8.0\nrows = 2", pull, "consistent") == []
        assert self.codes("aspect_ratio = 8.0", pull, "shell") == []

    def test_the_command_prints_them(self, here: Any, capsys: pytest.CaptureFixture[str]) -> None:
        text = (ROOT / "examples" / "wave.toml").read_text().replace("accuracy = 0.05\n", "")
        text += '[mesh]\naspect_ratio = 1.0\n[model]\nformulation = "bars-and-hinges"\n'
        (here / "coarse.toml").write_text(text)
        assert main(["run", "coarse.toml"]) == 0
        assert main(["check", "coarse.toml", "--no-picture"]) == 0
        assert capsys.readouterr().out.count("cells have the aspect ratio") == 2
        assert any(
            "aspect-ratio" in line
            for line in json.loads((here / "coarse-out/result.json").read_text())["remarks"]
        )

    def test_remarks_of_a_drawing_stay_with_the_path(self, here: Any) -> None:
        import bh

        text = (here / "wave.svg").read_text().replace("</svg>", '<path d="M40,0 V80" stroke="black"/></svg>')
        (here / "ruled.svg").write_text(text)
        meshed = example(Path("ruled.svg"), here).replace("accuracy = 0.05\n", "")
        scene = parse_scene(meshed + '[mesh]\nkind = "gmsh"\nsize = 9.0\n', here)
        (remark,) = [remark for remark in bh.remarks(scene.model) if remark.code == "drawing"]
        assert remark.code == "drawing"
        assert "boundary lines lie inside" in remark.text
        path = bh.trace(scene.model, file=here / "path.bh")
        assert bh.Path.load(here / "path.bh").remarks == path.remarks
        assert any("boundary" in r for r in path.remarks)


def test_a_pinch_by_bars_and_hinges_is_told() -> None:
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.8), aspect_ratio=8)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127), formulation="bars-and-hinges").fold(
        "crease", rest=1.6, Lstar=25.0
    )
    assert "pinch" not in [remark.code for remark in remarks(model)]
    pinched = model.pinch("crease")
    assert "pinch" in [remark.code for remark in remarks(pinched)]
    assert [remark.code for remark in remarks(replace(pinched, formulation="consistent"))] == ["rows"]
