"""A path that ends early is loud, and a folder with a run in it is not written over by accident."""

from __future__ import annotations

import sqlite3
import warnings
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh.commands.cli import main
from bh.commands.run import solve
from bh.model.compare import differing_keys, first_differing_step
from bh.model.serialise import describe
from bh.scene.load import load_scene, parse_scene

SCENE = """
[pattern]
kind = "annulus_sector"
radius = 100.0
width = 10.0
angle = 0.4
[sheet]
E = 4000.0
t = {t}
[mesh]
along = 4
[creases.crease]
Lstar = 25.0
[[steps]]
moment = {{ crease = "crease", to = 0.01 }}
[[steps]]
moment = {{ crease = "crease", to = {second} }}
"""


def text(**given: Any) -> str:
    return SCENE.format(**{"t": 0.1, "second": 0.03} | given)


def early() -> bh.Model:
    """A couple that no turn of the soft crease balances."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.4), along=4)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.1), formulation="bars-and-hinges", hinge_lock=False)
    return model.crease("crease", stiffness=0.1).fold("crease", rest=3.0).moment("crease", to=5.0)


@pytest.fixture(scope="module")
def early_path() -> bh.Path:
    """Without a word, as asked."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return bh.trace(early(), warn=False)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.toml").write_text(text())
    return tmp_path


def test_an_early_end_warns_raises_and_shows() -> None:
    with pytest.warns(
        bh.NotReachedWarning, match=r"ended early, limit-point, in step 2 of 2 at lambda 0\.0.*; impose the"
    ):
        path = bh.trace(early())
    assert repr(path[-1]).endswith("ENDED EARLY: limit-point)")
    assert "EARLY" not in repr(path[-2])
    assert path[-1] is path[-1]
    with pytest.raises(bh.NotReachedError, match="the path ended early, limit-point"):
        path.require()


def test_an_early_end_is_still_told_when_it_is_loaded(early_path: bh.Path, tmp_path: Path) -> None:
    early_path.save(tmp_path / "x.bh")
    assert "ENDED EARLY: limit-point" in repr(bh.Path.load(tmp_path / "x.bh")[-1])


def test_a_path_that_is_reached_is_quiet() -> None:
    model = parse_scene(text()).model
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        path = bh.trace(model)
    assert path.require() is path
    assert "EARLY" not in repr(path[-1])


def test_bh_run_says_whether_the_end_is_stable(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "a.toml", "-o", "out", "--no-estimate"]) == 0
    assert "\nstable: yes\n" in capsys.readouterr().out


def test_another_scene_is_not_written_over(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = ["run", "a.toml", "-o", "out", "-q", "--no-estimate"]
    assert main(run) == 0
    assert main(run) == 0  # the same again
    (here / "a.toml").write_text(text(t=0.2))
    before = (here / "out" / "path.bh").read_bytes()
    assert main(run) == 2
    err = capsys.readouterr().err
    assert "another scene (it differs in sheet.t = 0.1, now 0.2); add --force to replace it" in err
    assert main([*run, "--resume"]) == 2
    assert "it differs in sheet.t = 0.1, now 0.2" in capsys.readouterr().err
    assert (here / "out" / "path.bh").read_bytes() == before
    assert sorted(each.name for each in (here / "out").iterdir()) == ["path.bh", "result.json"]
    assert main([*run, "--force"]) == 0


def test_a_stopped_run_asks_for_resume_or_force(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    class Stop:
        def update(self, *_: Any) -> None:
            raise KeyboardInterrupt

        def close(self, outcome: Any) -> None:
            pass

    with pytest.raises(KeyboardInterrupt):
        solve(load_scene("a.toml"), Path("out"), progress=Stop())
    run = ["run", "a.toml", "-o", "out", "-q", "--no-estimate"]
    assert main(run) == 2
    assert (
        "a run of this scene that was stopped; add --resume to go on from it, --force to begin"
        in capsys.readouterr().err
    )
    assert main([*run, "--resume"]) == 0
    assert main(run) == 0  # it is whole now
    assert capsys.readouterr().out == ""


def test_resume_says_from_which_state_it_goes_on(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = ["run", "a.toml", "-o", "out", "--no-estimate"]
    assert main([*run, "-q"]) == 0
    states = sum(record.step == 0 for record in bh.read("out").path.records)
    (here / "a.toml").write_text(text(second=0.02))
    assert main([*run, "--resume"]) == 0
    first = capsys.readouterr().out.splitlines()[0]
    assert first == f"a: goes on from step 1, lambda 1 ({states} states are kept; step 2 is not what it was)"
    assert main([*run, "--resume"]) == 0
    assert "goes on" not in capsys.readouterr().out
    with closing(sqlite3.connect(here / "out" / "path.bh")) as db:
        db.execute("DELETE FROM steps WHERE step = 1")  # as a kill behind the last state leaves it
        lam, kept = db.execute(
            "SELECT lambda, (SELECT count(*) FROM states) FROM states ORDER BY id DESC"
        ).fetchone()
        db.commit()
    assert main([*run, "--resume"]) == 0
    first = capsys.readouterr().out.splitlines()[0]
    assert first == f"a: goes on from step 2, lambda {lam:.4g} ({kept} states are kept)"


def test_resume_keeps_the_steps_that_still_hold(here: Path) -> None:
    run = ["run", "a.toml", "-o", "out", "-q", "--no-estimate"]
    assert main(run) == 0
    first = bh.read("out").path
    (here / "a.toml").write_text(text(second=0.02))
    assert main([*run, "--resume"]) == 0
    again = bh.read("out").path
    kept = sum(record.step == 0 for record in first.records)
    assert [r.wall_time_s for r in again.records[:kept]] == [r.wall_time_s for r in first.records[:kept]]
    whole = bh.trace(parse_scene(text(second=0.02)).model)
    np.testing.assert_allclose(again[-1].points, whole[-1].points, atol=1e-9)
    assert again.reached
    assert sorted(each.name for each in (here / "out").iterdir()) == ["path.bh", "result.json"]


def test_keys_that_differ() -> None:
    one = parse_scene(text()).model
    data, arrays = describe(one)

    def keys(model: bh.Model) -> list[str]:
        return differing_keys(data, arrays, model)

    assert keys(one) == []
    assert keys(parse_scene(text(second=0.02)).model) == ["steps[1].moment.to = 0.03, now 0.02"]
    assert first_differing_step(keys(parse_scene(text(second=0.02)).model)) == 1
    (held,) = keys(one.support("edge:start"))
    assert held.startswith('supports[0] = nothing, now {"at": "edge:start"')
    assert keys(one.moment("crease", 0.0)) == ["steps[2] (added)"]
    assert first_differing_step(keys(one.support("edge:start"))) is None
    other = parse_scene(text().replace("along = 4", "along = 5")).model
    assert keys(other) == ["pattern or mesh"]
    assert differing_keys(data, arrays, other, chosen=True) == []


def test_results_are_read_back(here: Path) -> None:
    assert main(["run", "a.toml", "-o", "out", "-q", "--no-estimate"]) == 0
    run = bh.read("out")
    assert run.path.reached
    assert run.result["outcome"] == "reached"
    assert run.scene is not None
    assert run.scene.name == "a"
    assert run.scene.model is run.path.model
    assert repr(run) == f"Run(out, {run.path})"
    assert bh.read("out/path.bh").result == run.result
    with pytest.raises(bh.PathFileError, match=r"there is no path\.bh in"):
        bh.read(here)
    run.path.save("other.bh")
    assert bh.read("other.bh").result == {}
    assert "not solved from a scene" in bh.read("other.bh").scene_reason


def union_jack(skew: float) -> meshes.SheetMesh:
    """A sector of 4 x 16 cells whose diagonals meet in every second node; cross lines are turned by the skew, rad."""
    r, a = np.meshgrid(np.linspace(90.0, 110.0, 5), np.linspace(0.0, 0.785, 17), indexing="ij")
    a = a + skew * (r - 100.0) / 100.0
    points = np.column_stack(((r * np.cos(a)).ravel(), (r * np.sin(a)).ravel()))
    triangles = []
    for i in range(4):
        for j in range(16):
            p, q = 17 * i + j, 17 * (i + 1) + j
            cells = (
                [(p, q, q + 1), (p, q + 1, p + 1)] if (i + j) % 2 == 0 else [(p, q, p + 1), (q, q + 1, p + 1)]
            )
            triangles += cells
    crease = np.array([(34 + j, 35 + j) for j in range(16)])
    return meshes.SheetMesh(
        points, np.array(triangles), {"crease:crease": crease}, folds={"crease": "mountain"}
    )


def test_imported_meshes_get_remarks_and_locked_creases_are_said() -> None:
    """Nodes of four edges beside the normal of the crease make imposed angles lock: 17.4 in place of 0.083 N mm."""
    energies = []
    for skew in (0.0, 0.02):
        model = bh.Model(union_jack(skew), bh.Sheet(E=4000.0, t=0.127), formulation="bars-and-hinges")
        spring = model.fold("crease", by=1.57, Lstar=25.0)
        model = model.fold("crease", by=1.57)
        codes = [remark.code for remark in bh.remarks(model)]
        assert "crease" in codes
        assert ("four-edges" in codes) == (skew > 0.0)
        assert "four-edges" not in [remark.code for remark in bh.remarks(spring)]
        energies.append(bh.trace(model, warn=False)[-1].energy.total)
    assert energies[1] > 100.0 * energies[0]


def test_patterns_print_as_one_line() -> None:
    assert repr(meshes.strip(100.0, 40.0, [20.0])) == "CreasePattern(100 x 40 mm, 1 crease)"
    assert repr(meshes.full_annulus([20.0, 30.0], 5.0)) == "CreasePattern(70 x 70 mm, 2 creases, 1 hole)"
