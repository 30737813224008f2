"""Scenes in the window, and wide creases: one slider, by the name of the crease, for what a scene folds."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest

import bh
import meshes
from bh.commands.run import solve
from bh.errors import InputError
from bh.live import Frame, Session
from bh.scene.load import load_scene
from bh.studio.desk import Desk
from bh.studio.messages import read
from bh.studio.opening import sheet_of
from bh.studio.sheets import of_file, of_model

DATA = Path(__file__).resolve().parents[1] / "data"
SCENE = """
[pattern]
kind = "annulus_sector"
radius = [60.0, 75.0]
width = 15.0
angle = 0.6
fold = ["mountain", "valley"]
[mesh]
kind = "alternating"
along = 8
rows = 1
[sheet]
E = 4000.0
nu = 0.3
t = 0.2
[creases.crease-1]
width = "1.5mm"
Lstar = 20
[creases.crease-2]
Lstar = 20
[[steps]]
fold = [{ crease = "crease-1", rest = "2.1rad" }, { crease = "crease-2", by = 0.5, Lstar = 20 }]
"""


def take(desk: Desk, **message: object) -> list[dict[str, object]]:
    return desk.take(read(json.dumps(message)))


def settled(desk: Desk) -> Frame:
    frame = desk.session.rest()
    assert frame.at_rest, frame.note
    return frame


@pytest.fixture
def desk(tmp_path: Path) -> Desk:
    file = tmp_path / "ring.toml"
    file.write_text(SCENE)
    return Desk(sheet_of(file, "card"))


def test_a_wide_crease_has_one_slider_and_is_told(desk: Desk) -> None:
    """By its own name; its two lines are no creases that could be turned, and a remark says what is driven."""
    creases: Any = desk.describe()["creases"]
    assert {each["name"]: (each["fold"], each["handled"], each["turns"]) for each in creases} == {
        "crease-1": ("wide", True, False),
        "crease-2": ("valley", True, True),
    }
    lines = [desk.session.mesh.crease_edges(f"crease-1-{side}") for side in ("left", "right")]
    edges = next(each["edges"] for each in creases if each["name"] == "crease-1")
    assert len(edges) == 2 * sum(map(len, lines))
    assert sum("'crease-1' is a strip" in text for text in desk.sheet.remarks) == 1
    assert desk.session.creases == ("crease-2", "crease-1")
    with pytest.raises(InputError, match="no crease 'crease-1-left'"):
        take(desk, do="fold", crease="crease-1-left", angle=0.5)


def test_a_slider_of_a_wide_crease_does_what_its_scene_does(desk: Desk, tmp_path: Path) -> None:
    """Its rest angle: the frame is where the scene's own step ends, and where the scene that is saved ends."""
    take(desk, do="fold", crease="crease-1", angle=0.4)  # first elsewhere
    settled(desk)
    take(desk, do="fold", crease="crease-1", angle=float(np.pi - 2.1))
    take(desk, do="fold", crease="crease-2", angle=0.5)
    frame = settled(desk)
    assert 0.8 < frame.fold_angles()["crease-1"] / (np.pi - 2.1) < 1.05
    (answer,) = take(desk, do="export", what="scene")
    saved = tmp_path / "saved.toml"
    saved.write_bytes(base64.b64decode(str(answer["data"])))
    assert 'crease = "crease-1", rest = 2.1' in saved.read_text()
    path = bh.trace(load_scene(saved).model, warn=False)
    np.testing.assert_allclose(path[-1].points, frame.points, atol=1e-6)
    own = bh.trace(load_scene(tmp_path / "ring.toml").model.support("rigid-body"), warn=False)
    assert own[-1].energy.total == pytest.approx(frame.state.energy.total, rel=1e-6)
    again = Desk(sheet_of(saved, "card"))  # and the window opens what it has saved
    take(again, do="percent", value=10.0)
    assert settled(again).wanted.folds == pytest.approx(dict.fromkeys(again.session.creases, 0.1 * np.pi))


def test_a_wide_crease_of_a_model_goes_both_ways_and_back() -> None:
    pattern = meshes.wide_creases(meshes.strip(40.0, 20.0, [10.0]), 2.0)
    model = bh.Model(meshes.structured(pattern, along=4, rows=1), bh.Sheet(E=4000.0, nu=0.0, t=0.2))
    session = Session(model.wide_crease("crease", Lstar=20.0))
    for angle in (0.6, -0.6, 0.0):
        session.fold("all", angle)
        assert session.rest().fold_angles()["crease"] == pytest.approx(angle, abs=0.02)
    desk = Desk(of_model(session.model))
    take(desk, do="percent", value=20.0)
    assert settled(desk).fold_angles()["crease"] == pytest.approx(0.2 * np.pi, abs=0.02)
    with pytest.raises(InputError, match="the strip of crease 'crease' was made for this sheet"):
        take(desk, do="material", t=0.4)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "the file is empty"),
        ("x = ", "not TOML"),
        (SCENE.replace("[mesh]", "[other]"), "has 'other', which the window does not keep"),
        (SCENE.split("[mesh]")[0] + "[sheet]" + SCENE.split("[sheet]")[1], "has no mesh"),
        (SCENE.replace("along = 8", "along = 1500"), "the window takes 8000"),
        (SCENE.replace('kind = "annulus_sector"', 'file = "../x.svg"'), "put the drawing beside the scene"),
    ],
)
def test_scenes_that_cannot_be_opened_are_one_line(text: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "x.toml"
    file.write_text(text)
    with pytest.raises(InputError, match=words) as told:
        sheet_of(file, "card")
    assert "\n" not in str(told.value)


def test_a_scene_that_is_dropped_is_told_how_to_be_opened() -> None:
    """It may name Python that is run; who drops a file does not know that."""
    with pytest.raises(InputError, match=r"open it by `bh studio ring\.toml`"):
        of_file("ring.toml", SCENE.encode())


def test_a_scene_of_a_drawing_comes_with_it(tmp_path: Path) -> None:
    """The scene that the window has saved of a drawing, opened again from its folder."""
    desk = Desk(of_file("miura.svg", (DATA / "miura.svg").read_bytes()))
    (answer,) = take(desk, do="export", what="scene")
    assert str(answer["name"]) == "miura.zip"
    file = tmp_path / "miura.zip"
    file.write_bytes(base64.b64decode(str(answer["data"])))
    with ZipFile(file) as archive:
        archive.extractall(tmp_path)
    again = sheet_of(tmp_path / "miura.toml", "card")
    assert again is not None
    assert again.drawing is not None
    assert again.drawing == desk.sheet.drawing
    assert again.model.creases == desk.sheet.model.creases
    np.testing.assert_array_equal(again.model.mesh.points, desk.session.mesh.points)


@pytest.mark.parametrize("name", ["prog.exe", "noise.svg", "list.fold", "photo.dxf", "empty.cp"])
def test_a_refused_file_is_named_as_it_was_dropped(name: str) -> None:
    """Not by the folder where it lies meanwhile."""
    data = {"list.fold": b"[1, 2]", "photo.dxf": b"\x89PNG", "empty.cp": b""}.get(name, b"MZ\x90<")
    with pytest.raises(InputError) as told:
        of_file(name, data)
    assert str(told.value).lstrip("'").startswith(name)
    assert "bh-studio-" not in str(told.value)


def test_a_sheet_that_cannot_go_on_is_saved_where_it_lies(tmp_path: Path) -> None:
    """Not where it is asked to be: its scene has the controls that it is in equilibrium with, and its state."""
    desk = Desk()
    take(desk, do="percent", value=30.0)
    desk.session.update(0.0)
    march = desk.session._under.march
    march._increment = 0.2
    while march.here.lam == 0.0:
        desk.session.update(1e-9)
    march.stuck = "no way on"
    file, said = take(desk, do="export", what="scene")
    assert "cannot go on (no way on): it is saved as it lies" in str(said["text"])
    assert desk.frame.note
    assert 0.0 < desk.frame.fold_angles()["crease"] < 0.29 * np.pi
    (tmp_path / "arc.zip").write_bytes(base64.b64decode(str(file["data"])))
    with ZipFile(tmp_path / "arc.zip") as archive:
        archive.extractall(tmp_path)
    scene = load_scene(tmp_path / "arc.toml")
    resumed = solve(scene, tmp_path / "arc-out", resume=True, estimate=False, neighbours=False).path
    for path in (resumed, bh.trace(scene.model)):
        assert path.reached
        np.testing.assert_allclose(path[-1].points, desk.frame.points, atol=1e-6)
    lines, told = take(desk, do="export", what="python")
    angle = desk.frame.controls.folds["crease"]
    assert f'{{"crease": {angle!r}}}' in base64.b64decode(str(lines["data"])).decode()
    assert "as it lies" in str(told["text"])


@pytest.mark.parametrize(
    "error", [InputError("no"), MemoryError(), RuntimeError("Factor is exactly singular")]
)
def test_a_run_from_flat_that_breaks_does_not_keep_a_state_from_being_saved(
    monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    """It comes with its state, as one whose branch is not known in time."""

    def breaks(*_: object) -> None:
        raise error

    monkeypatch.setattr("bh.studio.desk.from_flat", breaks)
    desk = Desk()
    take(desk, do="percent", value=10.0)
    settled(desk)
    file, said = take(desk, do="export", what="scene")
    assert file["name"] == "arc.zip"
    assert "--resume" in str(said["text"])


def test_a_file_is_nothing_to_take_back() -> None:
    """Jaws that float move while the sheet comes to rest for it: that is no stroke, and redo is kept."""
    desk = Desk()
    take(desk, do="percent", value=30.0)
    right = settled(desk).points[:, 0]
    jaws = {"a": int(np.argmin(right)), "b": int(np.argmax(right))}
    take(desk, do="pinch", **jaws)
    settled(desk)
    gap = desk.session.wanted.jaws[0].gap(desk.session.wanted.grips)
    for part in (0.9, 0.8):
        take(desk, do="pinch", **jaws, gap=part * gap)
    take(desk, do="undo")
    wanted, past = desk.session.wanted, len(desk._past)
    take(desk, do="export", what="result")
    assert desk.session.wanted != wanted
    assert len(desk._past) == past
    take(desk, do="redo")
    assert desk.session.wanted.jaws[0].gap(desk.session.wanted.grips) == pytest.approx(0.8 * gap, rel=1e-9)


E4000 = "E = 4000.0\nnu = 0.3\nt = 0.2\n"


@pytest.mark.parametrize(
    ("sheet", "more"),
    [
        (E4000, '[[supports]]\nat = "edge:inner"\nclamp = true'),
        (E4000, '[[supports]]\nat = "rigid-body"'),
        (E4000 + "expansion = [1e-5, 2e-5]", ""),
        ("plies = [{ E = 4000.0, nu = 0.3, t = 0.1 }, { E = 2000.0, nu = 0.3, t = 0.1 }]", ""),
        (E4000, '[creases.crease-1]\nLstar = 20\nrest = 2.9\nlaw = { kind = "softening", peak = 0.2 }'),
        (
            E4000,
            "[creases.crease-1.law]\nkind = 'table'\nturns = [-1.0, 0.0, 1.0]\nmoments = [-0.1, 0.0, 0.3]",
        ),
    ],
    ids=["clamp", "rigid-body", "expansion", "plies", "softening", "table"],
)
def test_a_scene_comes_out_with_all_that_its_sheet_is(sheet: str, more: str, tmp_path: Path) -> None:
    """Supports, sheet and creases of every kind that a scene may give: a run ends in what is seen."""
    head, rest = SCENE.split("[sheet]")
    steps = rest[rest.index("[[steps]]") :].replace('rest = "2.1rad"', "by = 0.4")
    first, second = (tmp_path / name for name in ("ring.toml", "saved.toml"))
    first.write_text(f"{head}[sheet]\n{sheet}\n{more}\n{steps}")
    desk = Desk(sheet_of(first, "card"))
    take(desk, do="percent", value=20.0)
    frame = settled(desk)
    (answer,) = take(desk, do="export", what="scene")
    second.write_bytes(base64.b64decode(str(answer["data"])))
    springs = "law" in more
    assert springs == (abs(frame.fold_angles()["crease-1"] - frame.wanted.folds["crease-1"]) > 1e-4)
    saved = load_scene(second).model
    assert saved.sheet == desk.session.model.sheet
    assert dict(saved.creases) == dict(desk.session.model.creases)
    path = bh.trace(saved, warn=False)
    np.testing.assert_allclose(path[-1].points, frame.points, atol=1e-6)


def test_a_node_that_is_held_with_others_is_told_as_such(tmp_path: Path) -> None:
    """Its dot does nothing: that is a line, and the sheet stays."""
    file = tmp_path / "ring.toml"
    file.write_text(SCENE.replace("[creases.crease-1]", "[[supports]]\nat = [0, 1, 9]\n[creases.crease-1]"))
    desk = Desk(sheet_of(file, "card"))
    session = desk.session
    for node in (1, 5):
        with pytest.raises(InputError, match=f"node {node} is not held on its own"):
            take(desk, do="hold", node=node, on=False)
    assert desk.session is session
    take(desk, do="hold", node=5, on=True)
    take(desk, do="hold", node=5, on=False)
    assert desk.session.model.supports == session.model.supports


def test_the_scene_of_a_sheet_without_a_fold_is_run_too(tmp_path: Path) -> None:
    """Its only crease is made flat: nothing acts, or a pull alone does."""
    desk = Desk()
    take(desk, do="crease", crease="crease", kind="flat")
    saved = tmp_path / "arc.toml"
    for pull in (False, True):
        if pull:
            take(desk, do="pull", node=0, to=[75.0, 0.0, 10.0])
        frame = settled(desk)
        (answer,) = take(desk, do="export", what="scene")
        saved.write_bytes(base64.b64decode(str(answer["data"])))
        path = bh.trace(load_scene(saved).model)
        assert path.reached
        np.testing.assert_allclose(path[-1].points, frame.points, atol=1e-6)
