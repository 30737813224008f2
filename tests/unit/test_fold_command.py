"""`bh fold`, and files that `bh check`, `bh init` and scenes take: any drawing to a folded sheet."""

from __future__ import annotations

import itertools
import json
import math
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from numpy.typing import NDArray

import bh
from bh.commands.cli import main
from bh.commands.fold import TimeUpError, _Clock, _timed, fold_file
from bh.errors import InputError
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from bh.runtime.progress import Silent
from bh.scene.folding import Wish, proposals
from bh.scene.load import load_scene, parse_scene
from bh.solvers.system import clear_part
from meshes import strip, structured, unstructured
from meshes.errors import FileFormatError
from meshes.io import read_fold, read_pattern
from meshes.quantities import spoken

RIM = '<rect width="80" height="60" stroke="black" fill="none"/>'
CREASE = '<line x1="40" y1="0" x2="40" y2="60" stroke="blue"/>'


def svg(folder: Path, body: str = RIM + CREASE, size: str = 'width="80mm" height="60mm"') -> Path:
    file = folder / "sheet.svg"
    file.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {size} viewBox="0 0 80 60">{body}</svg>')
    return file


def fold(folder: Path, **keys: object) -> Path:
    """A strip of two squares of 1 unit in the plane y = 0, as Origami Simulator writes it."""
    data = {
        "vertices_coords": [[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 0, -1], [1, 0, -1], [0, 0, -1]],
        "edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 0], [1, 4]],
        "edges_assignment": ["B", "B", "B", "B", "B", "B", "V"],
        "faces_vertices": [[0, 1, 4, 5], [1, 2, 3, 4]],
        "edges_foldAngle": [0, 0, 0, 0, 0, 0, 70.0],
        **keys,
    }
    file = folder / "strip.fold"
    file.write_text(json.dumps({key: value for key, value in data.items() if value is not None}))
    return file


def result(folder: Path) -> dict[str, object]:
    found: dict[str, object] = json.loads((folder / "result.json").read_text())
    return found


def folds(folder: Path, crease: str = "valley") -> float:
    angle = result(folder)["fold_angle"][crease]["mean"]  # type: ignore[index]
    return math.degrees(abs(angle))


class TestOneCommand:
    def test_a_drawing_folds_by_80_percent(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        out = tmp_path / "out"
        assert main(["fold", str(svg(tmp_path)), "-o", str(out), "--write", "glb", "--write", "stl"]) == 0
        assert folds(out) == pytest.approx(144.0, abs=0.01)
        assert {"folded.png", "folded.glb", "folded.stl", "path.bh", "sheet.toml"} <= {
            p.name for p in out.iterdir()
        }
        assert not list(out.glob(".fold-*"))
        assert "assumed: springs at every crease want 144 degrees, 80 % of the way" in capsys.readouterr().out
        again = load_scene(out / "sheet.toml")
        energy = bh.trace(again.model)[-1].energy.total
        assert energy == pytest.approx(result(out)["energy"]["total"], abs=1e-9)  # type: ignore[index]

    def test_the_scene_is_not_written_over(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        file, out = svg(tmp_path), tmp_path / "out"
        assert main(["fold", str(file), "-o", str(out), "-q", "--angle", "60deg"]) == 0
        assert folds(out) == pytest.approx(60.0, abs=0.01)
        assert main(["fold", str(file), "-o", str(out), "-q"]) == 2
        assert "add --force" in capsys.readouterr().err
        assert main(["fold", str(file), "-o", str(out), "-q", "--percent", "20", "--force"]) == 0
        assert folds(out) == pytest.approx(36.0, abs=0.01)

    def test_angles_of_the_file_are_used(self, tmp_path: Path) -> None:
        file = fold(tmp_path)
        assert main(["fold", str(file), "-o", str(tmp_path / "out"), "-q", "--fit", "100"]) == 0
        assert folds(tmp_path / "out") == pytest.approx(70.0, abs=0.01)
        size = np.ptp(load_scene(tmp_path / "out" / "strip.toml").model.mesh.points, axis=0)
        np.testing.assert_allclose(size, [100.0, 50.0, 0.0], atol=1e-9)

    def test_a_size_that_cannot_be_is_said(self, tmp_path: Path) -> None:
        first = proposals(fold(tmp_path))[0]
        assert any("fitted to 200 mm" in line for line in first.assumed)
        assert not any("fitted" in line for line in proposals(fold(tmp_path, frame_unit="cm"))[0].assumed[1:])

    def test_closed_angles_go_by_80_percent(self, tmp_path: Path) -> None:
        file = fold(tmp_path, edges_foldAngle=[0, 0, 0, 0, 0, 0, 180.0])
        assert "part = 0.8" in proposals(file)[0].text

    def test_nets_pass_through_themselves_unless_asked(self, tmp_path: Path) -> None:
        """Both say so in the scene."""
        loose, firm = (proposals(fold(tmp_path), Wish(contact=asked))[0].text for asked in (False, True))
        assert parse_scene(loose, tmp_path).model.contact is False
        assert parse_scene(firm, tmp_path).model.contact == "auto"

    def test_a_cp_file(self, tmp_path: Path) -> None:
        file = tmp_path / "x.cp"
        rim = [(0, 0, 80, 0), (80, 0, 80, 60), (80, 60, 0, 60), (0, 60, 0, 0)]
        rows = [(1, *row) for row in rim] + [(2, 40, 0, 40, 60)]
        file.write_text("\n".join(" ".join(map(str, row)) for row in rows))
        assert main(["fold", str(file), "-o", str(tmp_path / "out"), "-q"]) == 0
        assert folds(tmp_path / "out", "mountain") == pytest.approx(144.0, abs=0.01)

    def test_a_curve_is_folded_on_a_finer_mesh(self, tmp_path: Path) -> None:
        body = RIM + '<path d="M0 20 Q40 45 80 20" stroke="red" fill="none"/>'
        offers = proposals(svg(tmp_path, body))
        assert offers[0].text.count("accuracy")
        assert "staggered" in offers[1].text
        for offer in offers:
            assert parse_scene(offer.text, tmp_path).model.mesh.folds["m1"] == "mountain"

    def test_a_corner_is_no_curve(self, tmp_path: Path) -> None:
        """Straight lines that meet at an angle, in pieces: the faces of the drawing do."""
        knee = '<path d="M0 10 L10 20 L20 30 L30 40 L40 30 L50 20 L60 10 L70 0" stroke="red" fill="none"/>'
        only, softer = proposals(svg(tmp_path, RIM + knee))
        assert 'formulation = "consistent"' in softer.text
        assert all('kind = "drawn"' in offer.text for offer in (only, softer))
        assert 'kind = "drawn"' in only.text

    def test_turns_where_creases_cross_are_no_curve(self, tmp_path: Path) -> None:
        """A spiral of a net turns by 11 degrees at every vertex, where others meet it."""
        zigzag = '<path d="M0 30 L20 26 L40 26 L60 30 L80 38" stroke="red" fill="none"/>'
        others = "".join(
            f'<path d="M{x} 0 L{x} {y} L{x} 60" stroke="blue" fill="none"/>'
            for x, y in ((20, 26), (40, 26), (60, 30))
        )
        assert [offer.mesh for offer in proposals(svg(tmp_path, RIM + zigzag + others))] == [
            "the faces of the drawing",
            "the faces of the drawing, which may bend",
        ]
        assert "gmsh" in proposals(svg(tmp_path, RIM + zigzag))[-3].text

    def test_lines_that_nearly_meet_are_joined_as_the_remark_advises(self, tmp_path: Path) -> None:
        knee = '<path d="M0 30 H39.8" stroke="red"/><path d="M40 0 V60" stroke="blue"/>'
        first = proposals(svg(tmp_path, RIM + knee))[0]
        assert "gap = 0.21" in first.text
        assert any(line.startswith("lines that end close to others (1) are joined") for line in first.assumed)
        mesh = parse_scene(first.text, tmp_path).model.mesh
        assert mesh.points[mesh.crease_edges("m1")][..., 0].max() == pytest.approx(40.0)

    def test_without_an_outline_the_hull_is_taken(self, tmp_path: Path) -> None:
        lines = '<path d="M0 30 H80" stroke="red"/><path d="M0 0 L30 10 L80 0" stroke="blue"/>'
        first = proposals(svg(tmp_path, lines))[0]
        assert 'outline = "hull"' in first.text
        assert any("the convex hull of all lines is taken" in line for line in first.assumed)
        mesh = parse_scene(first.text, tmp_path).model.mesh
        assert mesh.areas.sum() == pytest.approx(80.0 * 30.0)

    def test_one_of_two_sheets_is_folded(self, tmp_path: Path) -> None:
        other = RIM.replace("<rect", '<rect x="100"') + '<path d="M100 20 H180" stroke="blue"/>'
        file = svg(tmp_path, RIM + '<path d="M0 30 H80" stroke="red"/>' + other)
        first = proposals(file)[0]
        assert any("the drawing holds 2 sheets: the first" in line for line in first.assumed)
        assert "mountain" in parse_scene(first.text, tmp_path).model.mesh.folds
        assert main(["fold", str(file), "-o", str(tmp_path / "out"), "-q", "--sheet", "2"]) == 0
        mesh = load_scene(tmp_path / "out" / "sheet.toml").model.mesh
        assert "mountain" not in mesh.folds
        assert folds(tmp_path / "out", "valley") == pytest.approx(144.0, abs=0.01)

    def test_paper_is_taken_where_card_is_thick(self, tmp_path: Path) -> None:
        narrow = "".join(
            f'<path d="M{x} 0 V60" stroke="{"red" if x % 4 else "blue"}"/>' for x in range(2, 80, 2)
        )
        assert "t = 0.1" in proposals(svg(tmp_path, RIM + narrow))[0].text
        assert "t = 0.3" in proposals(svg(tmp_path))[0].text
        assert "t = 0.3" in proposals(svg(tmp_path, RIM + narrow), Wish(material="card"))[0].text

    def test_materials_of_the_table_are_taken(self, tmp_path: Path) -> None:
        text = proposals(svg(tmp_path), Wish(material="card-300"))[0].text
        assert "[sheet]                          # card, 300 g/m2" in text
        assert "E = 4242.6" in text  # the mean of 6000 and 3000 MPa
        assert "t = 0.375" in text

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["--material", "jelly"], "'jelly' is not known; use one of paper"),
            (["--material", "card300"], "steel, or of the table of materials: paper-80, card-160, card-300"),
            (["--angle", "60"], "angle of 3437.75 degrees cannot be; give 0 to 180, such as 60deg"),
            (["--angle", "60 degs"], "'--angle': \"60 degs\" is no angle: write 60deg"),
            (["--fit", "8inchs"], "'--fit': \"8inchs\" is no length: write 8in"),
            (["--angle", "200deg"], "200 degrees cannot be"),
            (["--percent", "0"], "0 percent cannot be"),
            (["--angle", "60deg", "--percent", "20"], "give one of them"),
            (["--fit", "-1"], "fit = -1.0 cannot be"),
        ],
    )
    def test_bad_wishes(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], words: str
    ) -> None:
        assert main(["fold", str(svg(tmp_path)), "-o", str(tmp_path / "out"), *arguments]) == 2
        assert words in capsys.readouterr().err
        assert not (tmp_path / "out").exists()

    def test_no_crease(self, tmp_path: Path) -> None:
        with pytest.raises(InputError, match="no mountain or valley crease to fold"):
            proposals(svg(tmp_path, RIM))

    def test_a_clock_ends_a_run(self) -> None:
        clock = _Clock(Silent(), -1.0, -1.0)
        with pytest.raises(TimeUpError, match=r"lambda = 0\.50"):
            clock.update(0, 1, 0.5, 3, 1.0)

    def test_a_run_that_will_end_in_time_goes_on_beyond_its_share(self) -> None:
        clock = _Clock(Silent(), 10.0, 20.0)
        clock.spent = 5.0
        clock.update(0, 1, 0.05, 3, 1.0)
        clock.spent = 10.5
        clock.update(0, 1, 0.45, 3, 1.0)
        clock.spent = 12.0
        clock.check(0.5)  # 0.4 in the last 4 s: 5.5 s more of the 8 s that are left
        clock.spent = 16.5
        with pytest.raises(TimeUpError, match=r"its 16 s were over at lambda = 0\.50"):
            clock.check(0.5)  # nothing in the last 5.5 s
        clock.update(0, 1, 0.55, 3, 1.0)
        clock.spent = 19.9
        clock.check(0.9)  # beyond half of the way: the next scene would have to be faster than this one
        clock.spent = 20.0
        with pytest.raises(TimeUpError, match=r"its 20 s were over at lambda = 0\.90"):
            clock.check(0.9)
        clock.spent = 8.0
        clock.update(0, 1, 1.0, 3, 1.0)
        clock.update(0, 1, 0.1, 3, 1.0)  # another mesh
        clock.spent = 14.0
        with pytest.raises(TimeUpError):
            clock.check(0.2)

    def test_time_is_counted_by_work(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        """However slow the machine is, the same scenes are tried in the same order."""
        monkeypatch.setattr("time.process_time", itertools.count(0.0, 1000.0).__next__)
        done = fold_file(svg(tmp_path), tmp_path / "out", Wish(angle=1.0))
        assert done.path.reached
        assert not done.notes
        assert done.seconds >= 1000.0
        clock = _Clock(Silent(), 1.0, 1.0)
        clock.count(50_000, factored=True)
        clock.check(0.2)
        clock.count(50_000)  # a trial of a line search
        assert clock.spent < 0.6
        clock.count(50_000, factored=True)
        with pytest.raises(TimeUpError, match=r"its 1 s were over at lambda = 0\.20"):
            clock.check(0.2)

    def test_looks_for_contact_are_counted_too(self) -> None:
        mesh = structured(strip(10.0, 60.0, [20.0, 40.0]), along=3, rows=2)
        spent = []
        for contact in (0.1, False):
            model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127), contact=contact)
            model = model.step(bh.Fold(mesh.creases[0], by=0.3))
            clock = _Clock(Silent(), 10.0, 10.0)
            system = formulation(model.formulation).system(model, load_steps(model)[0], None)
            timed = _timed(system, clock)
            q = system.start()
            spread: NDArray[np.float64] = 0.1 * np.arange(len(q), dtype=float)
            clear_part(timed, q, spread, 0.0)  # between two evaluations
            timed.tangent(q, 0.0, timed.evaluate(q, 0.0).forces)
            spent.append(clock.spent)
        assert spent[0] > spent[1] + 1e-5

    def test_angles(self) -> None:
        assert spoken("90deg", "angle") == pytest.approx(math.pi / 2)
        assert spoken("1.5 rad", "angle") == spoken("1.5", "angle") == 1.5


class TestChecksAndScenes:
    def test_check_takes_drawings(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        picture = tmp_path / "flat.png"
        assert main(["check", str(fold(tmp_path)), "--picture", str(picture)]) == 0
        out = capsys.readouterr().out
        assert picture.is_file()
        assert "drawn to 70 degrees" in out
        assert "sheet: 200 x 100 mm" in out

    def test_init_takes_fold_files(self, tmp_path: Path) -> None:
        fold(tmp_path)
        assert main(["init", str(tmp_path / "scene.toml"), "--drawing", str(tmp_path / "strip.fold")]) == 0
        assert load_scene(tmp_path / "scene.toml").accuracy is not None

    def test_a_fold_file_is_meshed_anew(self, tmp_path: Path) -> None:
        fold(tmp_path, frame_unit="cm")
        tail = '[sheet]\nE = 4000.0\nt = 0.2\n[[steps]]\nfold = { crease = "all", by = "drawn" }\n'
        own = parse_scene(f'[pattern]\nfile = "strip.fold"\nscale = 30.0\n{tail}', tmp_path).model.mesh
        new = parse_scene(
            f'[pattern]\nfile = "strip.fold"\nscale = 30.0\n[mesh]\nkind = "gmsh"\nsize = 8.0\n{tail}',
            tmp_path,
        ).model.mesh
        assert len(own.triangles) == 4 < len(new.triangles)
        for mesh in (own, new):
            assert mesh.areas.sum() == pytest.approx(1800.0)
            assert mesh.folds["v1"] == "valley"
            np.testing.assert_allclose(mesh.fold_angles["v1"], -math.radians(70.0))

    def test_the_hull_is_taken_in_a_scene(self, tmp_path: Path) -> None:
        svg(tmp_path, CREASE + '<line x1="0" y1="30" x2="80" y2="30" stroke="red"/>')
        tail = '[sheet]\nE = 4000.0\nt = 0.2\n[[steps]]\nfold = { crease = "all", by = 0.1, Lstar = 9.0 }\n'
        text = f'[pattern]\nfile = "sheet.svg"\noutline = "hull"\n[mesh]\nkind = "gmsh"\nsize = 9.0\n{tail}'
        assert parse_scene(text, tmp_path).model.mesh.areas.sum() == pytest.approx(2400.0)


class TestFoldFiles:
    def test_frames_by_title(self, tmp_path: Path) -> None:
        frame = {"frame_title": "wide", "frame_inherit": True, "frame_parent": 0, "frame_unit": "in"}
        file = fold(tmp_path, file_frames=[frame])
        assert np.ptp(read_fold(file, "wide").points[:, 0]) == pytest.approx(50.8)
        with pytest.raises(FileFormatError, match='no frame titled "high"; titles: "wide"'):
            read_fold(file, "high")

    def test_an_open_frame_goes_before_a_folded_one(self, tmp_path: Path) -> None:
        flat = {"vertices_coords": [[0, 0], [3, 0], [6, 0], [6, 3], [3, 3], [0, 3]]}
        frame = {**flat, "frame_classes": ["creasePattern"], "frame_inherit": True, "frame_parent": 0}
        file = fold(tmp_path, frame_classes=["foldedForm"], file_frames=[frame])
        assert np.ptp(read_fold(file).points[:, 0]) == pytest.approx(6.0)

    def test_a_flat_folded_form_is_told(self, tmp_path: Path) -> None:
        over = [[0, 0], [1, 0], [0.1, 0], [0.1, 1], [1, 1], [0, 1]]
        with pytest.raises(FileFormatError, match="folded flat"):
            read_fold(fold(tmp_path, vertices_coords=over))

    @pytest.mark.parametrize("axis", [0, 1, 2])
    def test_any_plane_is_laid_flat(self, tmp_path: Path, axis: int) -> None:
        flat = np.array([[0, 0], [1, 0], [2, 0], [2, 1], [1, 1], [0, 1]], dtype=float)
        u, v = np.roll(np.eye(3), axis, axis=1)[[0, 1]]
        tilt = np.linalg.qr(np.array([[1.0, 0.2, 0.1], [0.3, 1.0, 0.4], [0.2, 0.5, 1.0]]))[0]
        tilt *= np.sign(np.linalg.det(tilt))
        points = (flat @ np.array([u, v])) @ tilt.T
        for faces in ([[0, 1, 4, 5], [1, 2, 3, 4]], None):
            mesh = read_fold(fold(tmp_path, vertices_coords=points.tolist(), faces_vertices=faces))
            assert mesh.flat
            assert mesh.areas.sum() == pytest.approx(2.0)
            assert mesh.folds["v1"] == "valley"

    def test_inches_and_scale(self, tmp_path: Path) -> None:
        file = fold(tmp_path, frame_unit="in")
        assert np.ptp(read_fold(file).points[:, 0]) == pytest.approx(50.8)
        assert np.ptp(read_pattern(file).rings[0][:, 0]) == pytest.approx(50.8)
        assert np.ptp(read_fold(file, scale=10.0).points[:, 0]) == pytest.approx(20.0)
        assert np.ptp(read_pattern(file, scale=10.0).rings[0][:, 0]) == pytest.approx(20.0)
        with pytest.raises(FileFormatError, match="give one of them"):
            read_fold(file, scale=10.0, fit=20.0)


class TestDrawnAngles:
    def test_by_drawn_for_all_on_every_mesh(self, tmp_path: Path) -> None:
        """A crease that ends inside is one of 'all mountains', too: its angle counts under both names."""
        body = RIM + '<line x1="20" y1="30" x2="60" y2="30" stroke="red" stroke-opacity="0.35"/>'
        mesh = unstructured(read_pattern(svg(tmp_path, body)), size=10.0)
        np.testing.assert_allclose(mesh.fold_angles["mountain"], 0.35 * math.pi)
        model = bh.Model(mesh, bh.Sheet(E=4000.0, nu=0.3, t=0.2), formulation="consistent")
        path = bh.trace(model.fold("all", by="drawn", part=0.5, Lstar=0.1))
        assert path.reached
        assert np.median(path[-1].fold_angle("m1")) > 0.3

    def test_a_part_of_drawn_angles_only(self) -> None:
        with pytest.raises(bh.ModelError, match="part"):
            bh.Fold("all", by=0.5, part=0.5)


class TestAllSheets:
    """Two sheets with a crease, and a frame with none, on one page."""

    PAGE = (
        RIM
        + CREASE
        + '<g transform="translate(100 0)"><rect width="40" height="30" stroke="black" fill="none"/>'
        + '<path d="M0 10H40" stroke="red"/></g><rect x="160" width="20" height="10" stroke="black" fill="none"/>'
    )

    def test_they_are_folded_side_by_side(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        file, out = svg(tmp_path, self.PAGE), tmp_path / "out"
        assert main(["fold", str(file), "-o", str(out), "--sheet", "all", "--angle", "60deg"]) == 0
        assert folds(out / "sheet-1") == pytest.approx(60.0, abs=0.01)
        assert folds(out / "sheet-2", "mountain") == pytest.approx(60.0, abs=0.01)
        assert "sheet = 2" in (out / "sheet-2" / "sheet.toml").read_text()
        told = capsys.readouterr()
        assert "sheet 3 is left out: " in told.err
        assert "there is no mountain or valley crease" in told.err
        image = plt.imread(out / "folded.png")
        assert image.shape[:2] == (450, 1200)
        for tile in (image[:, :600, :3], image[:, 600:, :3]):
            assert 0.02 < (tile.min(axis=2) < 0.95).mean() < 0.9
        # one scale: the first sheet is larger
        assert (image[:, :600, :3].min(axis=2) < 0.95).sum() > 2 * (
            image[:, 600:, :3].min(axis=2) < 0.95
        ).sum()

    def test_nothing_else_is_a_sheet(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        file = svg(tmp_path, self.PAGE)
        assert main(["fold", str(file), "--sheet", "both"]) == 2
        assert "'both' is no sheet; give a number from 1, or all" in capsys.readouterr().err

    def test_no_sheet_that_folds(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        file = svg(tmp_path, RIM)
        assert main(["fold", str(file), "-o", str(tmp_path / "out"), "--sheet", "all"]) == 2
        assert "there is no mountain or valley crease" in capsys.readouterr().err
        assert not (tmp_path / "out").exists()


def test_scenes_that_follow_have_a_part_of_the_time_however_far_one_has_come(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clocks: list[tuple[float, float]] = []

    def refused(scene: object, place: object, clock: _Clock) -> object:
        clocks.append((clock._share, clock._most))
        raise InputError("not today")

    monkeypatch.setattr("bh.commands.fold._solved", refused)
    with pytest.raises(InputError, match="not today"):
        fold_file(Path("tests/data/ring_pleats.svg"), tmp_path, Wish(), seconds=50.0)
    assert len(clocks) > 1
    assert clocks[0] == (30.0, 40.0)
