"""What is known of the error of any path: by a coarser mesh, by an accuracy that was asked for, or why nothing is."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bh
import bh.solving.accuracy
import bh.solving.given_mesh
import meshes
from bh.commands.cli import main
from bh.errors import PathFileError, SceneError
from bh.model.refinement import DEFAULT
from bh.paths.estimate import Accuracy, Trial
from bh.scene.example import example
from bh.scene.load import parse_scene
from bh.solvers.outcome import Outcome
from bh.solving.accuracy import estimate, mark_doubtful, trusted
from bh.solving.levels import folder_of
from bh.solving.trace import trace

SHEET = bh.Sheet(E=4000.0, nu=0.38, t=0.127)
SECTOR = meshes.annulus_sector(100.0, 10.0, 0.4)
SCENE = """{accuracy}
[pattern]
kind = "annulus_sector"
radius = 100.0
width = 10.0
angle = 0.4
[sheet]
E = 4000.0
nu = 0.38
t = 0.127
{mesh}
[model]
{formulation}
[[steps]]
fold = {{ crease = "crease", by = 0.6, Lstar = 25.0 }}
"""
CONSISTENT = 'formulation = "consistent"'


def scene(accuracy: str = "", mesh: str = "", formulation: str = "") -> str:
    return SCENE.format(accuracy=accuracy, mesh=mesh, formulation=formulation)


def model(along: int = 16, rows: int = 4, formulation: str = "consistent", **how: object) -> bh.Model:
    mesh = meshes.structured(SECTOR, along=along, rows=rows, **how)  # type: ignore[arg-type]
    return bh.Model(mesh, SHEET, formulation=formulation).fold("crease", by=0.6, Lstar=25.0)


# --- of a given mesh ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", ["consistent", "shell"])
def test_a_given_mesh_is_compared_with_a_coarser_one(formulation: str) -> None:
    """The error that is told holds against a mesh that is twice as fine, and costs less than a third."""
    path = bh.trace(model(formulation=formulation), estimate=True)
    told = path.accuracy
    assert told is not None
    assert path.estimate_reason == ""
    coarse, given = told.trials
    assert coarse.mesh == "8 x 2 staggered cells"
    assert given.value[0] == path[-1].energy.total
    assert coarse.unknowns < given.unknowns / 3
    truth = bh.trace(model(32, 8, "shell"))[-1].energy.total
    assert abs(path[-1].energy.total - truth) / truth < 1.5 * told.estimate < 0.3
    assert "by its own estimate" in str(told)
    assert "asked" not in str(told)


def test_no_estimate_is_made_unless_asked_for() -> None:
    path = bh.trace(model(8, 2))
    assert path.accuracy is None
    assert "estimate=True" in path.estimate_reason


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (lambda: model(rows=1), "one row of cells"),
        (lambda: model(formulation="bars-and-hinges"), "not known to converge"),
        (
            lambda: replace(
                model(),
                mesh=meshes.SheetMesh(
                    model().mesh.points, model().mesh.triangles, edge_sets=model().mesh.edge_sets
                ),
            ),
            "read from a file",
        ),
        (lambda: model(8, 2).support("node:0", "xyz").support("edge:end", "xyz"), "one mesh"),
    ],
)
def test_why_there_is_none(changed, words: str) -> None:  # type: ignore[no-untyped-def]
    path = bh.trace(changed(), estimate=True)
    assert path.accuracy is None
    assert words in path.estimate_reason
    assert "\n" not in path.estimate_reason


def test_a_snap_of_the_coarser_mesh_alone_is_doubtful(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its value is on another branch and tells nothing of the error."""
    monkeypatch.setattr(
        bh.solving.given_mesh, "snaps", lambda path: (1,) if len(path.model.mesh.triangles) < 100 else ()
    )
    path = bh.trace(model(), estimate=True)
    assert path.accuracy is None
    assert path.estimate_reason.startswith("doubtful")
    assert "in step 1 on a coarser mesh and not on this one" in path.estimate_reason


def pulled(along: int, rows: int) -> bh.Model:
    """A short sector (R = 60 mm) clamped at one end, folded by its spring, then lifted at a corner of the other end."""
    mesh = meshes.structured(meshes.annulus_sector(60.0, 10.0, 0.785), along=along, rows=rows)
    clamped = bh.Model(mesh, SHEET, formulation="consistent").support("edge:start", "xyz", clamp=True)
    folded = clamped.fold("crease", rest=0.5 * math.pi, Lstar=25.0)
    return folded.force("corner:outer-end", each=(0.0, 0.0, 0.0154))


SHELL_PULLED = (
    0.844  # N mm, `pulled` by the shell on 32 x 4 mirrored cells; 0.855 on 24 x 3; it passes no limit point
)


@pytest.mark.slow
def test_a_limit_point_of_a_coarse_mesh_is_told_as_doubtful() -> None:
    """32 x 4 cells have a limit point under the tip load that finer ones and the shell have not.

    The mesh that is half as fine snaps, too, but while it folds: it repeats nothing.
    """
    coarse, fine = bh.trace(pulled(32, 4), estimate=True), bh.trace(pulled(64, 8))
    assert coarse.outcome == fine.outcome == "reached"
    assert coarse[-1].energy.total > 1.1 * SHELL_PULLED
    assert coarse.accuracy is None
    assert coarse.estimate_reason.startswith(
        "doubtful: the sheet snaps to another branch in step 2 on this mesh"
    )
    assert "in step 1 on a coarser mesh" in coarse.estimate_reason
    assert fine.critical_points == []
    assert fine[-1].energy.total == pytest.approx(SHELL_PULLED, rel=0.01)


def test_a_path_file_keeps_what_is_known_of_the_error(tmp_path: Path) -> None:
    path = bh.trace(model(), file=tmp_path / "a.bh", estimate=True)
    stored = bh.Path.load(tmp_path / "a.bh")
    assert path.accuracy is not None
    assert stored.accuracy is not None
    assert stored.accuracy.as_dict() == path.accuracy.as_dict()
    none = bh.trace(model(rows=1), file=tmp_path / "b.bh", estimate=True)
    assert bh.Path.load(tmp_path / "b.bh").estimate_reason == none.estimate_reason
    asked = bh.trace(model(), accuracy=bh.Goal(0.2))
    asked.save(tmp_path / "c.bh")
    again = bh.Path.load(tmp_path / "c.bh").accuracy
    assert again is not None
    assert asked.accuracy is not None
    assert str(again) == str(asked.accuracy)


# --- of an accuracy -----------------------------------------------------------------------------------------------


def trial(value: float, snaps: tuple[int, ...] = (), outcome: Outcome = Outcome.REACHED) -> Trial:
    return Trial("consistent", 1.0, "cells", 10, 10, 1, 0.1, outcome, np.array([value]), snaps)


def test_a_snap_that_the_next_mesh_does_not_repeat_is_left_out() -> None:
    """10.4 lies on another branch; with it the three values would be told to be far from their limit."""
    values = [trial(10.4, (1,)), trial(5.0), trial(5.5), trial(5.6)]
    marked = mark_doubtful(values[:2])
    assert [t.doubtful for t in marked] == [True, False]
    assert estimate(trusted(mark_doubtful(values[:3]), "consistent"))[0] == math.inf
    told, _ = estimate(trusted(mark_doubtful(values), "consistent"))
    assert told == pytest.approx(estimate([np.array([v]) for v in (5.0, 5.5, 5.6)])[0])
    assert not any(t.doubtful for t in mark_doubtful([trial(v, (1,)) for v in (1.0, 1.1, 1.2)]))
    ended = [trial(1.0, (1,)), trial(math.nan, outcome=Outcome.LIMIT_POINT)]
    assert not any(t.doubtful for t in mark_doubtful(ended))


def test_only_a_snap_in_the_same_step_is_repeated() -> None:
    """A mesh that snaps while it folds does not confirm one that snaps while it is pulled."""
    values = [trial(1.0, (1,)), trial(1.1, (2,)), trial(1.2, (1, 2))]
    assert [t.doubtful for t in mark_doubtful(values)] == [True, False, False]


def test_a_snap_of_the_finest_mesh_alone_is_not_mixed_with_the_others() -> None:
    """5.5 and 5.6 lie on another branch than 5.61, near by chance; three meshes that snap are an estimate."""
    values = [trial(5.5), trial(5.6), trial(5.61, (1,))]
    assert estimate(trusted(mark_doubtful(values), "consistent"))[0] == math.inf
    values += [trial(5.62, (1,)), trial(5.625, (1,))]
    assert math.isfinite(estimate(trusted(mark_doubtful(values), "consistent"))[0])


def test_a_sheet_that_stores_nothing_has_no_error() -> None:
    """Straight creases that nothing holds fold for nothing: relative errors of rounding are not told."""
    flat = meshes.strip(40.0, 20.0, [10.0])
    free = bh.Model(meshes.structured(flat, along=4), SHEET).fold("all", by=0.8, Lstar=25.0)
    told = bh.trace(free, accuracy=0.05).accuracy
    assert told is not None
    assert told.met
    assert len(told.trials) == 3


class _Counted:
    """Counts the meshes that are really solved, and can be told to stop the run at one of them."""

    def __init__(self, stop: int = 99) -> None:
        self.words: list[str] = []
        self.updates, self.stop = 0, stop

    def stage(self, words: str) -> None:
        self.words.append(words)

    def update(self, step: int, steps: int, lam: float, iterations: int, energy: float) -> None:
        self.updates += 1
        if len(self.words) == self.stop:
            raise KeyboardInterrupt

    def close(self, outcome: str) -> None:
        pass


def test_a_run_that_was_stopped_goes_on_from_its_meshes(tmp_path: Path) -> None:
    """Progress says which mesh it is on; what was solved is not solved again, and the answer is the same."""
    file = tmp_path / "path.bh"
    first = _Counted(stop=3)
    with pytest.raises(KeyboardInterrupt):
        trace(model(), accuracy=0.1, file=file, progress=first)
    assert first.words[0].startswith("consistent, ")
    assert len(set(first.words)) == 3
    assert len(list(folder_of(file).glob("*.bh"))) == 3
    assert not file.exists()
    second = _Counted()
    path = trace(model(), accuracy=0.1, file=file, resume=True, progress=second)
    whole = _Counted()
    again = trace(model(), accuracy=0.1, progress=whole)
    assert second.updates < whole.updates
    assert path[-1].energy.total == pytest.approx(again[-1].energy.total, rel=1e-9)
    assert path.accuracy is not None
    assert again.accuracy is not None
    assert path.accuracy.estimate == pytest.approx(again.accuracy.estimate, rel=1e-6)
    third = _Counted()
    trace(model(), accuracy=0.1, file=file, resume=True, progress=third)
    assert third.updates == 0
    with pytest.raises(PathFileError, match="another model"):
        trace(
            replace(model(), sheet=bh.Sheet(E=4000.0, nu=0.38, t=0.2)), accuracy=0.1, file=file, resume=True
        )
    with pytest.raises(PathFileError, match="no solved meshes"):
        trace(model(), accuracy=0.1, file=tmp_path / "other.bh", resume=True)


# --- scenes -------------------------------------------------------------------------------------------------------


def test_a_scene_without_a_mesh_is_solved_to_five_percent(tmp_path: Path) -> None:
    assert parse_scene(scene()).accuracy == bh.Goal(DEFAULT) == bh.Goal(0.05)
    assert parse_scene(scene(mesh="[mesh]\nalong = 8")).accuracy is None
    drawing = '<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="40mm" viewBox="0 0 60 40">'
    drawing += '<rect width="60" height="40" stroke="black" fill="none"/>'
    drawing += '<path d="M0 20 Q30 8 60 20" stroke="red"/></svg>'
    (tmp_path / "sheet.svg").write_text(drawing)
    text = example(Path("sheet.svg"), tmp_path)
    assert "accuracy = 0.05" in text
    assert parse_scene(text, tmp_path).accuracy == bh.Goal(0.05)
    assert parse_scene(text.replace("accuracy = 0.05\n", ""), tmp_path).accuracy == bh.Goal(0.05)
    assert parse_scene(example()).accuracy == bh.Goal(0.05)


def test_a_formulation_without_an_estimate_needs_a_mesh() -> None:
    for accuracy in ("", "accuracy = 0.1"):
        with pytest.raises(SceneError, match=r"add a table \[mesh\]"):
            parse_scene(scene(accuracy, formulation='formulation = "bars-and-hinges"'))
    assert parse_scene(scene(formulation=CONSISTENT)).accuracy == bh.Goal(0.05)


def test_the_command_tells_the_error_of_any_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """In its last lines and in result.json; or one line that says why there is none."""
    monkeypatch.chdir(tmp_path)
    for mesh, words, known in (
        ("[mesh]\nalong = 16\nrows = 4", "a coarser mesh was solved, too", True),
        ("[mesh]\nalong = 16", "no estimate: the panels have one row", False),
    ):
        Path("scene.toml").write_text(scene(mesh=mesh, formulation=CONSISTENT))
        assert main(["run", "scene.toml", "-o", "out", "--force"]) == 0
        told = capsys.readouterr().out.splitlines()[-2]
        assert told.startswith("accuracy: ")
        assert words in told
        result = json.loads(Path("out/result.json").read_text())
        assert (result["accuracy"] is not None) is known
        assert (result["no_estimate"] is None) is known
    assert main(["run", "scene.toml", "-o", "out", "--no-estimate"]) == 0
    assert "none was asked for" in capsys.readouterr().out


def test_the_command_keeps_and_resumes_the_meshes_of_a_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(scene("accuracy = 0.2"))
    assert main(["run", "scene.toml", "-o", "out", "--resume"]) == 2
    assert "no solved meshes" in capsys.readouterr().err
    assert main(["run", "scene.toml", "-o", "out"]) == 0
    kept = sorted(file.name for file in Path("out/path-levels").glob("*.bh"))
    assert len(kept) >= 3
    capsys.readouterr()
    assert main(["run", "scene.toml", "-o", "out", "--resume"]) == 0
    assert "had reached its end before" in capsys.readouterr().out
    Path("scene.toml").write_text(scene("accuracy = 0.19"))
    assert (
        main(["run", "scene.toml", "-o", "out"]) == 0
    )  # anew, beside the finished result until it is finished
    assert sorted(file.name for file in Path("out/path-levels").glob("*.bh")) == kept
    assert not Path("out/path-unfinished-levels").exists()


def test_what_is_known_survives_plain_data() -> None:
    told = bh.trace(model(), accuracy=bh.Goal(0.2)).accuracy
    assert told is not None
    data = json.loads(json.dumps(told.as_dict()))
    assert Accuracy.from_dict(data).as_dict() == data
    older = [
        {**trial, "snapped": False} for trial in data["trials"]
    ]  # said whether a mesh snapped, not in which steps
    for trial in older:
        del trial["snaps"]
    assert Accuracy.from_dict({**data, "trials": older}).as_dict() == data


def test_three_meshes_of_gmsh_are_trusted_half_as_much() -> None:
    """The same values say twice the error where meshes are no halves of each other, until there is a fourth."""
    halved = bh.Path(model())
    unlike = bh.Path(bh.Model(meshes.unstructured(SECTOR, size=8.0), SHEET, formulation="consistent"))
    safety = bh.solving.accuracy.safety
    assert safety(unlike, 3) == 2.0 * safety(halved, 3)
    assert safety(unlike, 4) == safety(halved, 4) == safety(halved, 3)
    values = [np.array([value]) for value in (0.546, 0.674, 0.708)]
    told = [estimate(values, 0.0, safety(path, 3))[0] for path in (halved, unlike)]
    assert told[1] == pytest.approx(2.0 * told[0])
