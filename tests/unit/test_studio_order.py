"""In which order a window is told things: positions first, their stability when nobody asks, and nothing twice."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import pytest
import tornado.websocket

from bh.studio import server
from bh.studio.desk import Desk
from bh.studio.messages import read
from bh.studio.server import Studio

Told = tuple[dict[str, Any], int]  # numbers of a frame, and bytes behind them


async def frame(socket: tornado.websocket.WebSocketClientConnection) -> Told:
    """The next frame that comes."""
    while not isinstance(message := await socket.read_message(), bytes):
        assert message is not None
    length = int.from_bytes(message[:4], "little")
    return json.loads(message[4 : 4 + length]), len(message) - 4 - length


def dragged(percents: list[float], until: str) -> list[Told]:
    """Frames of a window whose slider is moved on as soon as the sheet has arrived; the last is waited for to be so."""
    told: list[Told] = []

    async def visit() -> None:
        studio = Studio()
        site, address = studio.serve()
        socket = await tornado.websocket.websocket_connect(
            address.replace("http", "ws").replace("/?", "/socket?")
        )
        for number, percent in enumerate(percents, 1):
            await socket.write_message(json.dumps({"do": "percent", "value": percent}))
            goal = until if number == len(percents) else "arrived"
            while True:
                head, floats = await frame(socket)
                if head["kind"] != "frame":
                    continue
                told.append((head, floats))
                await socket.write_message("drawn")
                if head["heard"] == number and head[goal]:
                    break
        socket.close()
        await studio.close(site)

    asyncio.run(asyncio.wait_for(visit(), 30.0))
    return told


def test_stability_does_not_keep_a_wish_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    """While a slider goes on nothing is told twice, and no state is looked at."""
    monkeypatch.setattr(server, "CALM", 60.0)
    told = dragged([10.0, 12.0, 14.0], "arrived")
    moved = [(head, floats) for head, floats in told if any(head["asked"].values())]
    assert [head["heard"] for head, _ in moved if head["arrived"]] == [1, 2, 3]
    assert all(floats for _, floats in moved)
    assert not any(head["rest"] for head, _ in moved)
    assert all(head["stable"] is None for head, _ in moved if head["arrived"])


def test_numbers_come_behind_the_positions_and_without_them() -> None:
    """A sheet that was counted stable lies as it did: its positions are not sent again."""
    told = dragged([10.0], "rest")
    (there, sent), (rest, again) = told[-2:]
    assert there["arrived"]
    assert not there["rest"]
    assert sent > 0
    assert rest["stable"]
    assert again == 0
    assert rest["top"] == there["top"]
    assert rest["energy"] == there["energy"]


def test_positions_are_sent_anew_to_who_has_them_no_more() -> None:
    """Another colour, and a sheet that is described anew, which the window lays flat."""
    desk = Desk()
    desk.update(1.0)
    assert not desk.fresh
    desk.take(read(json.dumps({"do": "colour", "by": "strain"})))
    assert desk.fresh
    desk.update(1.0)
    assert not desk.untold
    desk.describe()
    assert desk.fresh
