"""What breaks is told in one line: in the window that it belongs to, with what lay there, and to no other window."""

from __future__ import annotations

import asyncio
import gc
import json
import threading
import time
import weakref
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import tornado.websocket

from bh.errors import InputError
from bh.live import Session
from bh.runtime.progress import ProgressMeter
from bh.studio import desk as desks
from bh.studio import server
from bh.studio.desk import Desk
from bh.studio.messages import read
from bh.studio.server import Studio
from bh.studio.sheets import LiveSheet, of_library

Told = list[dict[str, Any]]


def take(desk: Desk, **message: object) -> list[dict[str, object]]:
    return desk.take(read(json.dumps(message)))


def visited(until: Callable[[Told], bool], *asked: dict[str, object], sheet: LiveSheet | None = None) -> Told:
    """Lines and sheets that a window is told, until they say enough; it asks as soon as there is a sheet."""
    told: Told = []

    async def visit() -> None:
        studio = Studio(sheet)
        site, address = studio.serve()
        where = address.replace("http", "ws").replace("/?", "/socket?")
        client = await tornado.websocket.websocket_connect(where)
        waiting = list(asked)
        while not until(told):
            message = await client.read_message()
            if isinstance(message, bytes):
                await client.write_message("drawn")
                while waiting:
                    await client.write_message(json.dumps(waiting.pop(0)))
            else:
                told.append(json.loads(message or "{}"))
        client.close()
        await studio.close(site)

    asyncio.run(asyncio.wait_for(visit(), 20.0))
    return told


def lines(told: Told) -> list[str]:
    return [each["text"] for each in told if each["kind"] == "line"]


def test_a_sheet_that_is_refused_half_way_leaves_the_desk_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its way may be refused behind its session: neither of them is on the desk then."""
    desk = Desk()
    before = desk.sheet, desk.session, desk.frame

    def refused(*_: object) -> None:
        raise InputError("no way")

    with monkeypatch.context() as patch:
        patch.setattr(Session, "update", refused)
        with pytest.raises(InputError, match="no way"):
            take(desk, do="pattern", name="strip")
    assert (desk.sheet, desk.session, desk.frame) == before
    with monkeypatch.context() as patch:
        patch.setattr(desks, "offered", lambda _: 1 / 0)
        with pytest.raises(ArithmeticError):
            take(desk, do="pattern", name="strip")
    assert (desk.sheet, desk.session, desk.frame) == before


def test_a_message_that_breaks_says_that_the_sheet_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    def breaks(*_: object) -> None:
        raise ArithmeticError("odd\nin two lines")

    monkeypatch.setattr(Desk, "take", breaks)
    told = visited(lambda told: bool(lines(told)), {"do": "undo"})
    assert lines(told) == [
        "a fault of the program (ArithmeticError: odd in two lines); the sheet stays as it was"
    ]
    assert [each["kind"] for each in told] == ["sheet", "line"]


def test_a_sheet_that_breaks_begins_anew_beside_the_other_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not in the thread that speaks with all of them; where it breaks again it gives way to another one."""
    threads: list[str] = []
    put = Desk.put

    def noted(desk: Desk, sheet: LiveSheet, *more: Any) -> None:
        threads.append(threading.current_thread().name)
        if sheet.name == "strip" and len(threads) > 1:
            raise ArithmeticError("again")
        put(desk, sheet, *more)

    def breaks(desk: Desk, *_: object) -> None:
        if desk.sheet.name == "strip":
            raise ArithmeticError("odd")

    monkeypatch.setattr(Desk, "put", noted)
    monkeypatch.setattr(Desk, "work", breaks)
    told = visited(lambda told: len(told) > 2, {"do": "percent", "value": 20}, sheet=of_library("strip"))
    assert [each.get("name") for each in told] == ["strip", None, "arc"]
    assert lines(told) == ["a fault of the program (ArithmeticError: odd); the sheet begins anew"]
    assert all(name.startswith("bh-studio") for name in threads)


@pytest.mark.parametrize("error", [InputError("it cannot be handled"), ArithmeticError("odd")])
def test_a_window_whose_first_sheet_breaks_is_told_and_hears_on(
    monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    put = Desk.put

    def refuses(desk: Desk, sheet: LiveSheet, *more: Any) -> None:
        if sheet.name == "strip":
            raise error
        put(desk, sheet, *more)

    monkeypatch.setattr(Desk, "put", refuses)
    told = visited(lambda told: len(told) > 2, {"do": "pattern", "name": "pleats"}, sheet=of_library("strip"))
    assert str(error) in lines(told)[0]
    assert [each["name"] for each in told if each["kind"] == "sheet"] == ["arc", "pleats"]


def test_moves_are_left_out_only_where_nothing_else_is_asked_between_them() -> None:
    """What is saved or taken back between two moves is so of the first."""
    first, second, third = (json.dumps({"do": "percent", "value": k}) for k in range(3))
    pulls = [json.dumps({"do": "pull", "node": k, "to": [0, 0, 0]}) for k in range(2)]
    for other in ({"do": "export", "what": "scene"}, {"do": "undo"}, {"do": "hold", "node": 1, "on": True}):
        between = json.dumps(other)
        assert server.newest([first, second, between, third]) == [second, between, third]
    assert server.newest([first, pulls[0], second, pulls[1], pulls[0]]) == [second, pulls[1], pulls[0]]


def test_undo_goes_over_what_was_asked_in_one_breath() -> None:
    """A material, a slider, undo and the slider again, all of it while the server was at something else."""
    desk = Desk()
    asked = [
        {"do": "material", "t": 0.5},
        {"do": "percent", "value": 10.0},
        {"do": "undo"},
        {"do": "percent", "value": 20.0},
    ]
    for message in server.newest([json.dumps(each) for each in asked]):
        desk.take(read(message))
    assert desk.sheet.model.sheet.t == 0.5
    np.testing.assert_allclose(list(desk.session.wanted.folds.values()), 0.2 * np.pi)


def endless(*_: object, progress: ProgressMeter, **__: object) -> None:
    """A run that tells of its increments and does not come to an end."""
    ends = time.monotonic() + 15.0
    while time.monotonic() < ends:
        progress.update(0, 1, 0.5, 1, 0.0)
        time.sleep(0.01)


def test_a_check_gives_way_to_what_is_asked_next(monkeypatch: pytest.MonkeyPatch) -> None:
    """However long its run takes: the slider is answered."""
    monkeypatch.setattr("bh.studio.branch.trace", endless)
    asked: list[dict[str, object]] = [{"do": "percent", "value": 10}, {"do": "check"}, {"do": "check"}]
    began = time.monotonic()
    told = visited(lambda told: len(lines(told)) > 1, *asked, {"do": "export", "what": "no such"})
    assert lines(told)[:2] == ["the check was ended by what was asked next"] * 2
    assert time.monotonic() - began < 10.0


def test_a_window_that_is_closed_ends_its_check(monkeypatch: pytest.MonkeyPatch) -> None:
    begun = threading.Event()

    def run(*given: object, progress: ProgressMeter, **more: object) -> None:
        begun.set()
        endless(*given, progress=progress, **more)

    monkeypatch.setattr("bh.studio.branch.trace", run)

    async def visit() -> None:
        studio = Studio()
        site, address = studio.serve()
        where = address.replace("http", "ws").replace("/?", "/socket?")
        client = await tornado.websocket.websocket_connect(where)
        await client.write_message(json.dumps({"do": "percent", "value": 10}))
        await client.write_message(json.dumps({"do": "check"}))
        while not begun.is_set():
            await asyncio.sleep(0.01)
        (desk,) = [weakref.ref(window.desk) for window in studio.windows if window.desk is not None]
        client.close()
        while desk() is not None:
            await asyncio.sleep(0.05)
            gc.collect()
        await studio.close(site)

    asyncio.run(asyncio.wait_for(visit(), 10.0))
