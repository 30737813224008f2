"""What a window keeps is of the state that it shows: refined meshes, branches, snaps, undone states, refusals."""

from __future__ import annotations

import asyncio
import json
import socket
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tornado.websocket

from bh.errors import InputError
from bh.live import Frame, Session, history
from bh.studio import desk as desks
from bh.studio.branch import FromFlat
from bh.studio.desk import Desk
from bh.studio.door import HOST, Door
from bh.studio.finer import Finer
from bh.studio.opening import sheet_of
from bh.studio.server import Studio
from bh.studio.sheets import of_file, of_library
from tests.unit.test_studio_branch import MIURA, round_the_meeting, take, told
from tests.unit.test_studio_scenes import SCENE


def rested(desk: Desk) -> Frame:
    """The frame that the window is shown once the sheet is at rest."""
    while desk.busy:
        desk.work(1.0)
    return desk.frame


@pytest.fixture
def miura() -> Desk:
    return Desk(of_file(MIURA.name, MIURA.read_bytes()))


def test_a_finer_mesh_is_of_the_state_and_not_of_what_was_asked(
    monkeypatch: pytest.MonkeyPatch, miura: Desk
) -> None:
    """The same controls on another branch are refined anew."""
    seen: list[object] = []

    def finer(_: object, frame: Frame, __: Callable[[], bool]) -> Finer:
        seen.append(frame.state)
        return Finer(reason="none")

    monkeypatch.setattr(desks, "finer", finer)
    take(miura, do="percent", value=30.0)
    first = rested(miura)
    for _ in range(2):
        assert miura.finer(lambda: True) is not None
    assert seen == [first.state]
    take(miura, do="flatten")
    rested(miura)
    round_the_meeting(miura)
    second = rested(miura)
    assert second.wanted == first.wanted
    assert np.abs(second.points - first.points).max() > 1.0
    assert miura.finer(lambda: True) is not None
    assert seen == [first.state, second.state]


def test_undo_to_the_same_controls_in_another_state_is_shown(miura: Desk) -> None:
    """As behind one stroke that goes over a snap and back."""
    take(miura, do="percent", value=30.0)
    points = rested(miura).points
    there = miura._was()
    take(miura, do="flatten")
    rested(miura)
    round_the_meeting(miura)
    assert np.abs(rested(miura).points - points).max() > 1.0
    assert miura.session.wanted == there[1].controls
    miura._past = [there]
    take(miura, do="undo")
    np.testing.assert_array_equal(rested(miura).points, points)


def test_undo_over_another_material_does_not_forget_how_the_sheet_came_there(miura: Desk) -> None:
    round_the_meeting(miura)
    take(miura, do="material", t=0.4)
    rested(miura)
    take(miura, do="undo")
    assert not miura.session.straight
    assert not told(miura)["here"]


def test_what_is_folded_and_pulled_at_once_is_looked_at() -> None:
    """A scene folds first and pulls then; a sheet of another material is asked for both at once."""
    desk = Desk(of_library("arc"))
    take(desk, do="percent", value=30.0)
    assert desk.session.straight
    take(desk, do="pull", node=3, to=(rested(desk).points[3] + [0.0, 0.0, 4.0]).tolist())
    rested(desk)
    take(desk, do="material", t=0.3)
    rested(desk)
    assert not desk.session.straight


def test_a_branch_that_was_left_meanwhile_is_not_noted(monkeypatch: pytest.MonkeyPatch, miura: Desk) -> None:
    """Another thread takes a wish while the run from flat goes on."""
    take(miura, do="percent", value=30.0)
    rested(miura)

    def found(*_: object) -> FromFlat:
        take(miura, do="undo")
        return FromFlat(False, "elsewhere")

    monkeypatch.setattr(desks, "from_flat", found)
    miura.from_flat(lambda: True)
    assert not miura.session.left


@pytest.mark.parametrize("what", ["check", "export"])
def test_a_snap_on_the_way_to_a_file_is_told(monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    desk = Desk()
    rest = desk.session.rest
    monkeypatch.setattr(desk.session, "rest", lambda most: replace(rest(most), snapped=True))
    take(desk, **({"do": "check"} if what == "check" else {"do": "export", "what": "result"}))
    head = desk.picture()
    assert json.loads(head[4 : 4 + int.from_bytes(head[:4], "little")])["snapped"]


def test_a_refused_material_leaves_the_desk_as_it_was(tmp_path: Path) -> None:
    file = tmp_path / "ring.toml"
    file.write_text(SCENE)
    desk = Desk(sheet_of(file, "card"))
    with pytest.raises(InputError, match="was made for this sheet"):
        take(desk, do="material", name="steel")
    assert desk.material == "card"


def test_states_that_were_undone_end_at_a_size_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the window and of a session."""
    desk = Desk()
    session = Session(desk.session.model)
    session.rest()
    monkeypatch.setattr(history, "MOST_BYTES", 4 * 8 * session.size)
    for value in range(10, 20):
        take(desk, do="percent", value=float(value))
        rested(desk)
        session.fold("all", 0.01 * value)
        session.rest()
    for _ in range(10):
        take(desk, do="undo")
        rested(desk)
        assert session.undo()
        session.rest()
    marks = [mark for _, mark, _ in desk._undone]
    for each in (marks, session._undone):
        assert len(each) == 10
        assert [mark.q is not None for mark in each] == [False] * 6 + [True] * 4


def test_a_browser_that_holds_a_second_connection_ready_is_told_too() -> None:
    """Chromium opens one beside the one by which it asks, and says nothing there."""
    door = Door.opened()
    place = (HOST, door.sockets[0].getsockname()[1])
    with socket.create_connection(place), socket.create_connection(place, timeout=5.0) as asks:
        work = threading.Thread(target=door.refuse, args=("bh studio: no",))
        work.start()
        asks.sendall(f"GET /?token={door.token} HTTP/1.1\r\nHost: x\r\n\r\n".encode())
        answer = b""
        while piece := asks.recv(4096):
            answer += piece
        work.join()
    assert answer.startswith(b"HTTP/1.1 503 ")
    assert answer.endswith(b"\r\n\r\nbh studio: no")


def test_a_run_from_flat_that_breaks_is_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def breaks(*_: object) -> None:
        raise ArithmeticError("odd")

    monkeypatch.setattr(Desk, "from_flat", breaks)
    lines: list[Any] = []

    async def visit() -> None:
        studio = Studio()
        site, address = studio.serve()
        where = address.replace("http", "ws").replace("/?", "/socket?")
        client = await tornado.websocket.websocket_connect(where)
        while not lines:
            message = await client.read_message()
            if isinstance(message, bytes):
                await client.write_message("drawn")
            elif json.loads(message or "{}")["kind"] == "line":
                lines.append(message)
        client.close()
        await studio.close(site)

    asyncio.run(asyncio.wait_for(visit(), 20.0))
    assert "odd" in lines[0]
