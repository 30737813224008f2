"""Kinds of creases, contact and undo: what is seen under the hand, and what a run makes of the scene."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bh
from bh.analysis.contact import self_contact
from bh.errors import InputError
from bh.live import Frame
from bh.scene.load import load_scene
from bh.studio.desk import Desk
from bh.studio.messages import read
from bh.studio.sheets import of_file, of_library

DATA = Path(__file__).resolve().parents[1] / "data"
# two wide panels beside a narrow one
NARROW: Mapping[str, float | Sequence[float]] = {"length": 60.0, "width": 50.0, "creases": [22.0, 28.0]}


def take(desk: Desk, **message: object) -> list[dict[str, object]]:
    return desk.take(read(json.dumps(message)))


def settled(desk: Desk) -> Frame:
    for _ in range(400):
        desk.update(0.2)
        if not desk.busy:
            break
    assert desk.frame.at_rest, desk.frame.note
    return desk.frame


def saved(desk: Desk, what: str, place: Path) -> Path:
    answer = take(desk, do="export", what=what)[0]
    file = place / str(answer["name"])
    file.write_bytes(base64.b64decode(str(answer["data"])))
    return file


def described(desk: Desk, crease: str) -> dict[str, Any]:
    found: Any = desk.describe()["creases"]
    return next(each for each in found if each["name"] == crease)


def test_a_crease_is_folded_the_other_way_and_not_at_all(tmp_path: Path) -> None:
    """Its angle is as before, the other way; flat it is sheet. Scene and lines of Python end in what is seen."""
    desk = Desk(of_library("strip", values=NARROW))
    take(desk, do="percent", value=30.0)
    settled(desk)
    for kind, folded in (("mountain", 0.3 * np.pi), ("flat", 0.0), ("valley", -0.3 * np.pi)):
        (answer,) = take(desk, do="crease", crease="crease-2", kind=kind)
        assert answer["kind"] == "sheet"
        frame = settled(desk)
        angle = float(frame.state.fold_angle("crease-2").mean())
        if kind == "flat":
            assert "crease-2" not in frame.fold_angles()
            assert abs(angle) < 0.1
            assert described(desk, "crease-2")["turns"]
        else:
            assert angle == pytest.approx(folded, abs=1e-9)
        path = bh.trace(load_scene(saved(desk, "scene", tmp_path)).model)
        np.testing.assert_allclose(path[-1].points, frame.points, atol=1e-6)
        place: dict[str, Any] = {}
        lines = (
            saved(desk, "python", tmp_path).read_text().replace('"strip.toml"', f'"{tmp_path}/strip.toml"')
        )
        exec(compile(lines, "strip.py", "exec"), place)
        np.testing.assert_allclose(place["frame"].points, frame.points, atol=1e-6)
    assert not desk.sheet.drawn  # as it was drawn
    with pytest.raises(InputError, match="no crease 'x'"):
        take(desk, do="crease", crease="x", kind="flat")


def test_what_was_flat_is_a_spring_as_the_others_are() -> None:
    desk = Desk(of_file("miura.svg", (DATA / "miura.svg").read_bytes()))
    name = desk.session.creases[0]
    take(desk, do="percent", value=20.0)
    settled(desk)
    law = desk.sheet.model.creases[name]
    take(desk, do="crease", crease=name, kind="flat")
    assert name not in desk.sheet.model.creases
    with pytest.raises(InputError, match="is flat; make it a mountain"):
        take(desk, do="spring", crease=name, Lstar=1.0)
    take(desk, do="crease", crease=name, kind="valley")
    assert desk.sheet.model.creases[name] == law
    assert desk.session.wanted.folds[name] == pytest.approx(0.2 * desk.sheet.full[name])


def test_panels_stop_each_other_while_they_are_handled_and_a_run_repeats_it(tmp_path: Path) -> None:
    """Both folded up they pass through each other; with contact nothing does, and the run of the scene ends there."""
    desk = Desk(of_library("strip", values=NARROW))
    take(desk, do="crease", crease="crease-2", kind="mountain")
    take(desk, do="percent", value=58.0)
    assert len(self_contact(settled(desk).state)) > 0
    (answer,) = take(desk, do="contact", on=True)
    assert answer["contact"]
    frame = settled(desk)
    assert len(self_contact(frame.state)) == 0
    assert frame.state.energy.contact > 0.0
    assert frame.fold_angles()["crease-1"] == pytest.approx(0.58 * np.pi)
    file = saved(desk, "scene", tmp_path)
    assert 'contact = "thickness"' in file.read_text()
    path = bh.trace(load_scene(file).model)
    np.testing.assert_allclose(path[-1].points, frame.points, atol=1e-6)
    (answer,) = take(desk, do="contact", on=False)
    assert not answer["contact"]
    assert len(self_contact(settled(desk).state)) > 0


def test_a_sheet_that_cannot_be_laid_leaves_the_desk_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(of_library("strip"))
    before = desk.sheet, desk.session

    def refused(*_: object, **__: object) -> None:
        raise bh.ModelError("the first state meets itself")

    monkeypatch.setattr("bh.studio.desk.Session", refused)
    with pytest.raises(InputError, match="meets itself"):
        take(desk, do="contact", on=True)
    assert (desk.sheet, desk.session) == before


def test_a_stroke_is_taken_back_at_once_and_other_changes_too() -> None:
    """However often the sheet was at rest within it; materials, kinds and other sheets are changes as well."""
    desk = Desk(of_library("strip"))
    asked: list[dict[str, float]] = []

    def now() -> dict[str, float]:
        settled(desk)
        return dict(desk.session.wanted.folds)

    asked.append(now())
    for stroke, values in ((1, (5.0, 10.0, 15.0)), (2, (20.0, 12.0))):
        for value in values:
            take(desk, do="percent", value=value, stroke=stroke)
            settled(desk)
        asked.append(now())
    take(desk, do="pull", node=0, to=[0.0, 0.0, 3.0], stroke=3)
    take(desk, do="pull", node=1, to=[0.0, 0.0, 3.0], stroke=3)  # another point is another change
    take(desk, do="material", name="steel")
    take(desk, do="crease", crease="crease-2", kind="flat")
    assert [len(take(desk, do="undo")) for _ in range(4)] == [1, 1, 0, 0]  # sheets are told of
    assert desk.material == "card"
    assert desk.sheet.model.sheet.E == of_library("strip").model.sheet.E
    for before in (asked[2], asked[1], asked[0]):
        assert now() == before
        assert not desk.session.wanted.grips
        told = take(desk, do="undo")
    assert "nothing to undo" in str(told[0]["text"])
    for after in asked[1:]:
        assert not take(desk, do="redo")
        assert now() == after
    take(desk, do="pattern", name="arc")
    (answer,) = take(desk, do="undo")
    assert answer["name"] == "strip"
    assert now() == asked[2]
    take(desk, do="flatten")
    take(desk, do="undo")
    assert now() == asked[2]


@pytest.mark.parametrize(("angles", "half"), [((0, 0), (90.0, 90.0)), ((-90, 0), (45.0, 0.0))])
def test_creases_that_a_file_draws_flat_can_be_folded_and_turned(
    angles: tuple[float, float], half: tuple[float, float]
) -> None:
    """A file may give the angles of the flat sheet; where some are given, the others stay as they are drawn."""
    across = [(0, 0), (10, 0), (20, 0), (30, 0), (30, 10), (20, 10), (10, 10), (0, 10)]
    drawing = {
        "vertices_coords": across,
        "edges_vertices": [[k, (k + 1) % 8] for k in range(8)] + [[1, 6], [2, 5]],
        "edges_assignment": ["B"] * 8 + ["M", "V"],
        "edges_foldAngle": [0] * 8 + list(angles),
        "faces_vertices": [[0, 1, 6, 7], [1, 2, 5, 6], [2, 3, 4, 5]],
    }
    desk = Desk(of_file("flat.fold", json.dumps(drawing).encode()))
    take(desk, do="percent", value=50.0)
    np.testing.assert_allclose(np.degrees(list(desk.session.wanted.folds.values())), half)
    take(desk, do="crease", crease=desk.session.creases[0], kind="valley")
    np.testing.assert_allclose(np.degrees(list(desk.session.wanted.folds.values())), half)
