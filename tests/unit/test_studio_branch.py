"""A state at rest says whether a run from flat ends in it; branches meet without a snap, too."""

from __future__ import annotations

import base64
import io
import json
import zipfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh.analysis.contact import self_contact
from bh.commands.run import solve
from bh.live import Session
from bh.scene.load import load_scene
from bh.studio import branch
from bh.studio.desk import Desk
from bh.studio.messages import read
from bh.studio.sheets import of_file, of_library, of_model

MIURA = Path(__file__).resolve().parents[2] / "examples" / "miura.fold"


def take(desk: Desk, **message: object) -> list[dict[str, object]]:
    return desk.take(read(json.dumps(message)))


def told(desk: Desk) -> dict[str, Any]:
    """What the window is told of the state at rest."""
    desk.frame = desk.session.rest()
    assert desk.frame.at_rest, desk.frame.note
    found = desk.from_flat(lambda: True)
    assert found is not None
    answer = found.message()
    assert answer["kind"] == "branch"
    return answer


def round_the_meeting(desk: Desk) -> None:
    """Half of the creases the wrong way, then all the right way: no snap, and another branch."""
    creases = desk.session.creases
    for crease in creases[: len(creases) // 2]:
        take(desk, do="fold", crease=crease, angle=-0.5)
    assert told(desk)["here"]
    take(desk, do="percent", value=30.0)
    frame = desk.session.rest()
    assert frame.at_rest
    assert not desk.session.left  # nothing has snapped


def test_another_branch_is_told_and_comes_out_with_its_state(tmp_path: Path) -> None:
    desk = Desk(of_file(MIURA.name, MIURA.read_bytes()))
    take(desk, do="percent", value=30.0)
    assert told(desk) == {"kind": "branch", "here": True, "said": "ends here: it came this way"}
    straight = desk.frame.points
    take(desk, do="flatten")
    desk.session.rest()
    round_the_meeting(desk)
    answer = told(desk)
    assert not answer["here"]
    off = float(np.linalg.norm(desk.frame.points - straight, axis=1).max())
    assert off > 1.0
    assert f"{desk.frame.state.energy.total:.4g} here, {off:.3g} mm apart" in str(answer["said"])
    assert desk.session.left
    file, said = take(desk, do="export", what="scene")
    assert "`bh run miura.toml --resume`" in str(said["text"])
    with zipfile.ZipFile(io.BytesIO(base64.b64decode(str(file["data"])))) as archive:
        archive.extractall(tmp_path)
    scene = load_scene(tmp_path / "miura.toml")
    path = solve(scene, tmp_path / "miura-out", resume=True, estimate=False, neighbours=False).path
    np.testing.assert_allclose(path[-1].points, desk.frame.points, atol=1e-6)


def test_a_scene_is_not_saved_before_its_branch_is_looked_at() -> None:
    """Who saves at once gets the state, too."""
    desk = Desk(of_file(MIURA.name, MIURA.read_bytes()))
    round_the_meeting(desk)
    file, _ = take(desk, do="export", what="scene")
    with zipfile.ZipFile(io.BytesIO(base64.b64decode(str(file["data"])))) as archive:
        assert "miura-out/path.bh" in archive.namelist()


def test_the_branch_of_a_run_is_told_as_such() -> None:
    """Pulled, taken back and folded back: it ends where a run from flat does; a hand ends the looking."""
    desk = Desk(of_library("arc"))
    for percent in (40.0, 30.0):
        take(desk, do="percent", value=percent)
        desk.session.rest()
    assert told(desk)["said"] == "ends here"
    at = (desk.frame.points[3] + [0.0, 0.0, 4.0]).tolist()
    take(desk, do="pull", node=3, to=at)
    desk.frame = desk.session.rest()
    assert desk.from_flat(lambda: False) is None
    assert told(desk)["said"] == "ends here"
    assert not desk.session.left


def test_a_run_from_flat_that_ends_early_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """As `bh run` would; the state is kept."""
    desk = Desk(of_library("arc"))
    for percent in (20.0, 15.0):
        take(desk, do="percent", value=percent)
        desk.session.rest()
    stopped = SimpleNamespace(reached=False, outcome="unstable")
    monkeypatch.setattr(branch, "trace", lambda *_, **__: stopped)
    answer = told(desk)
    assert not answer["here"]
    assert answer["said"] == "does not get here: it ends early, unstable"
    assert desk.session.left


def test_a_run_from_flat_ends_between_two_iterations_when_it_is_told_to() -> None:
    desk = Desk(of_library("arc"))
    for percent in (60.0, 50.0):
        take(desk, do="percent", value=percent)
        desk.frame = desk.session.rest()
    asked = 0

    def going() -> bool:
        nonlocal asked
        asked += 1
        return asked < 7

    assert desk.from_flat(going) is None
    assert asked == 7
    assert told(desk)["here"]


def test_a_scene_whose_branch_is_not_known_in_time_brings_its_state(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bh.studio.desk.from_flat", lambda *_: None)
    desk = Desk(of_library("arc"))
    for percent in (20.0, 15.0):
        take(desk, do="percent", value=percent)
        desk.session.rest()
    file, said = take(desk, do="export", what="scene")
    assert "--resume" in str(said["text"])
    with zipfile.ZipFile(io.BytesIO(base64.b64decode(str(file["data"])))) as archive:
        assert "arc-out/path.bh" in archive.namelist()


@pytest.mark.slow
def test_a_sector_that_touches_tells_its_branch() -> None:
    """Closed one crease after the other it rests at 10.73 N mm, a run of both from flat at 10.24."""
    sector = meshes.annulus_sector([60.0, 75.0], 15.0, 0.6, folds=["mountain", "mountain"])
    model = bh.Model(
        meshes.structured(sector, along=5, rows=2), bh.Sheet(E=4000.0, nu=0.3, t=0.2), contact=2.0
    )
    for crease in model.mesh.creases:
        model = model.crease(crease, Lstar=10.0)
    desk = Desk(of_model(model))
    session: Session = desk.session
    for crease in session.creases:
        session.fold(crease, 3.1)
        session.rest()
    answer = told(desk)
    assert not answer["here"]
    assert str(answer["said"]).startswith("ends on another branch: 10.24 N mm there, 10.73 here")
    assert desk.frame.state.energy.contact > 0.0 or session.left
    assert session.left


@pytest.mark.parametrize("asked", [0, 1])
def test_nothing_is_told_of_a_sheet_on_its_way(asked: int) -> None:
    desk = Desk()
    take(desk, do="percent", value=20.0)
    desk.work(0.0 if asked else 1e-9)
    assert desk.from_flat(lambda: True) is None


def test_panels_that_pass_through_each_other_do_so_in_the_run_from_flat() -> None:
    """As in the scene that is saved; a run that looks where they meet would end elsewhere, or not for long."""
    roll = meshes.strip(20.0, 60.0, [15.0, 30.0, 45.0], folds=["mountain"] * 3)
    desk = Desk(
        of_model(bh.Model(meshes.structured(roll, along=8, rows=2), bh.Sheet(E=4000.0, nu=0.3, t=0.2)))
    )
    for percent in (70.0, 65.0):
        take(desk, do="percent", value=percent)
        desk.session.rest()
    assert desk.session.model.contact == "auto"
    assert desk.session.scene().contact is False
    assert told(desk)["said"] == "ends here"
    assert len(self_contact(desk.frame.state)) > 10


@pytest.mark.parametrize("percent", [50.0, None])
def test_a_run_that_was_ended_before_it_begins_says_nothing(percent: float | None) -> None:
    """It would speak of what was asked since, and not of the state that is shown."""
    desk = Desk(of_library("arc"))
    take(desk, do="percent", value=30.0)
    desk.frame = desk.session.rest()
    if percent is None:
        take(desk, do="undo")
    else:
        take(desk, do="percent", value=percent)
    assert desk.from_flat(lambda: False) is None
