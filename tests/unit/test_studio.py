"""The window without a browser: what may be asked, what comes out, and who may speak to the server."""

from __future__ import annotations

import ast
import asyncio
import base64
import gc
import io
import json
import struct
import sys
import tomllib
import weakref
import zipfile
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tornado.httpclient
import tornado.websocket

import bh
from bh.commands.run import solve
from bh.errors import InputError
from bh.scene.load import load_scene
from bh.studio import server
from bh.studio.desk import Desk
from bh.studio.exports import FORMATS
from bh.studio.messages import read
from bh.studio.scenes import scene_text
from bh.studio.server import Studio
from bh.studio.sheets import LIBRARY, LONGEST, of_file, of_library, of_model

DATA = Path(__file__).resolve().parents[1] / "data"


def take(desk: Desk, **message: object) -> list[dict[str, object]]:
    return desk.take(read(json.dumps(message)))


def settled(desk: Desk) -> dict[str, Any]:
    """The numbers of the frame in which the sheet is at rest."""
    for _ in range(400):
        head = unpacked(desk, desk.update(0.2))[0]
        if head["rest"] or head["note"]:
            return head
    raise AssertionError("it never comes to rest")


def unpacked(desk: Desk, frame: bytes) -> tuple[dict[str, Any], np.ndarray[Any, Any]]:
    (length,) = struct.unpack("<I", frame[:4])
    floats = np.frombuffer(frame[4 + length :], dtype="<f4")
    assert len(floats) == 4 * len(desk.session.mesh.points)
    return json.loads(frame[4 : 4 + length]), floats


@pytest.fixture
def desk() -> Desk:
    return Desk()


def test_a_frame_has_the_positions_that_its_numbers_speak_of(desk: Desk) -> None:
    assert not take(desk, do="percent", value=30.0)
    assert desk.busy
    head = settled(desk)
    assert head["rest"]
    assert head["energy"]["total"] > 0.0
    assert head["asked"]["crease"] == pytest.approx(0.3 * np.pi)
    assert not desk.busy
    _, floats = unpacked(desk, desk.update(0.0))
    np.testing.assert_allclose(floats[: -len(desk.session.mesh.points)], desk.frame.points.ravel(), rtol=1e-6)
    assert floats[-len(desk.session.mesh.points) :].max() > 0.0  # colours


@pytest.mark.parametrize("name", LIBRARY)
def test_the_scene_that_comes_out_is_what_was_seen(name: str, tmp_path: Path) -> None:
    """Folded and pulled, exported, read by `load_scene`, traced: the same shape."""
    desk = Desk(of_library(name))
    take(desk, do="percent", value=25.0)
    settled(desk)
    node = int(np.argmax(desk.session.mesh.points[:, 0]))
    take(desk, do="pull", node=node, to=(desk.frame.points[node] + [0.0, 0.0, 5.0]).tolist())
    head = settled(desk)
    assert np.linalg.norm(head["forces"][str(node)]) > 0.0
    (answer,) = take(desk, do="export", what="scene")
    file = tmp_path / str(answer["name"])
    file.write_bytes(base64.b64decode(str(answer["data"])))
    path = bh.trace(load_scene(file).model)
    assert path.reached
    np.testing.assert_allclose(path[-1].points, desk.frame.points, atol=1e-6)


@pytest.mark.slow
def test_a_state_behind_a_snap_comes_out_with_the_state_itself(tmp_path: Path) -> None:
    """A run from flat ends on another branch; the scene says so, and `bh run --resume` ends in what was seen."""
    desk = Desk(of_library("arc"))
    take(desk, do="percent", value=30.0)
    settled(desk)
    node = int(np.argmax(desk.frame.points[:, 0]))
    far = desk.frame.points[node] + [-42.0, -28.0, -52.5]
    for part in (0.2, 0.4, 0.6, 0.8, 1.0):
        at = desk.frame.points[node] + part * (far - desk.frame.points[node])
        take(desk, do="pull", node=node, to=at.tolist())
        assert settled(desk)["rest"]
    assert desk.session.left
    answer, said = take(desk, do="export", what="scene")
    assert "by way of a snap: `bh run arc.toml --resume`" in str(said["text"])
    with zipfile.ZipFile(io.BytesIO(base64.b64decode(str(answer["data"])))) as archive:
        assert archive.namelist() == ["arc.toml", "arc-out/path.bh"]
        archive.extractall(tmp_path)
    assert "by way of a snap" in (tmp_path / "arc.toml").read_text()
    scene = load_scene(tmp_path / "arc.toml")
    flat = bh.trace(scene.model, warn=False, neighbours=False)
    assert np.abs(flat[-1].points - desk.frame.points).max() > 1.0
    path = solve(scene, tmp_path / "arc-out", resume=True, estimate=False, neighbours=False).path
    assert path.reached
    assert len(path) > 3  # the second step was solved
    np.testing.assert_allclose(path[-1].points, desk.frame.points, atol=1e-6)
    assert path[-1].energy.total == pytest.approx(desk.frame.state.energy.total, rel=1e-9)


@pytest.mark.slow
def test_a_pinched_wave_is_repeated_to_the_digit(tmp_path: Path) -> None:
    """A net of springs, folded and squeezed to 55 % without a snap; by motion to rest its run ended 16 mm away."""
    drawing = Path(__file__).resolve().parents[2] / "examples" / "wave.svg"
    desk = Desk(of_file(drawing.name, drawing.read_bytes()))
    for percent in range(6, 49, 6):
        take(desk, do="percent", value=percent)
        settled(desk)
    right = desk.frame.points[:, 0] + 0.3 * desk.frame.points[:, 1]
    a, b = int(np.argmin(right)), int(np.argmax(right))
    take(desk, do="pinch", a=a, b=b)
    settled(desk)
    gap = desk.session.wanted.jaws[0].gap(desk.session.wanted.grips)
    for k in range(1, 9):
        take(desk, do="pinch", a=a, b=b, gap=gap * (1.0 - 0.45 * k / 8))
        assert settled(desk)["rest"]
    assert not desk.session.left
    (answer,) = take(desk, do="export", what="scene")
    with zipfile.ZipFile(io.BytesIO(base64.b64decode(str(answer["data"])))) as archive:
        archive.extractall(tmp_path)
    scene = load_scene(tmp_path / "wave.toml")
    path = bh.trace(scene.model, strategy=scene.strategy, neighbours=False)
    assert path.reached
    np.testing.assert_allclose(path[-1].points, desk.frame.points, atol=1e-6)
    assert path[-1].energy.total == pytest.approx(desk.frame.state.energy.total, rel=1e-8)


def test_without_ffmpeg_an_mp4_says_what_to_install(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match="pip install imageio-ffmpeg"):
        take(desk, do="film", pictures=["aGVsbG8="], kind="mp4")


def test_a_drawing_comes_out_with_its_scene(tmp_path: Path) -> None:
    desk = Desk()
    drawing = (DATA / "miura.svg").read_bytes()
    take(desk, do="open", name="../../miura.svg", data=base64.b64encode(drawing).decode())
    take(desk, do="percent", value=40.0)
    assert settled(desk)["rest"]
    (answer,) = take(desk, do="export", what="scene")
    with zipfile.ZipFile(io.BytesIO(base64.b64decode(str(answer["data"])))) as archive:
        assert sorted(archive.namelist()) == ["miura.svg", "miura.toml"]
        archive.extractall(tmp_path)
    assert tomllib.loads((tmp_path / "miura.toml").read_text())["contact"] is False  # as it is in the window
    path = bh.trace(load_scene(tmp_path / "miura.toml").model)
    np.testing.assert_allclose(path[-1].points, desk.frame.points, atol=1e-5)


@pytest.mark.parametrize("what", [each for each in FORMATS if each != "scene"])
def test_every_format_is_written(desk: Desk, what: str) -> None:
    take(desk, do="percent", value=10.0)
    (answer,) = take(desk, do="export", what=what)
    data = base64.b64decode(str(answer["data"]))
    assert len(data) > 100
    if what == "python":
        compile(data, "sheet.py", "exec")
    if what == "result":
        assert json.loads(data)["at_rest"]


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ({"do": "nothing"}, "cannot be asked"),
        ({"do": "fold", "crease": "crease"}, "angle"),
        ({"do": "fold", "crease": "crease", "angle": 1e999}, "cannot be asked"),
        ({"do": "fold", "crease": "no such", "angle": 1.0}, "no crease 'no such'"),
        ({"do": "fold", "crease": "crease", "angle": 1.0, "more": 1}, "more"),
        ({"do": "pull", "node": 10**6, "to": [0, 0, 0]}, "no node"),
        ({"do": "pull", "node": 0, "to": [0, 0]}, "cannot be asked"),
        ({"do": "pull", "node": 0, "to": [1e9, 0, 0]}, "1e\\+09 mm away"),
        ({"do": "pinch", "a": 0, "b": 7, "gap": 1e9}, "jaws are opened"),
        ({"do": "pinch", "a": 0, "b": 10**6}, "no node"),
        ({"do": "pinch", "a": 7, "b": 7}, "at one point"),
        ({"do": "pinch", "a": 0, "b": 7, "gap": -1}, "cannot be asked"),
        ({"do": "pattern", "name": "x"}, "no pattern 'x'"),
        ({"do": "pattern", "name": "arc", "values": {"kind": 1.0}}, "no 'kind' to choose"),
        ({"do": "pattern", "name": "arc", "values": {"radius": [1.0, 2.0]}}, "takes one number"),
        ({"do": "pattern", "name": "pleats", "values": {"radius": [60.0]}}, "takes 3 numbers"),
        ({"do": "pattern", "name": "arc", "values": {"radius": -1.0}}, "radius"),
        ({"do": "pattern", "name": "arc", "values": {"width": 1e9}}, "width"),
        ({"do": "spring", "crease": "no such", "Lstar": 1.0}, "no crease 'no such'"),
        ({"do": "spring", "crease": "all", "Lstar": 0.0}, "cannot be asked"),
        ({"do": "film", "pictures": ["aGVsbG8="]}, "cannot be read"),
        ({"do": "film", "pictures": []}, "cannot be asked"),
        ({"do": "material", "name": "cheese"}, "no material 'cheese'"),
        ({"do": "material", "t": 0}, "cannot be asked"),
        ({"do": "hold", "node": 10**6, "on": True}, "no node"),
        ({"do": "export", "what": "flat.exe"}, "no format"),
        ({"do": "open", "name": "x.svg", "data": "%%%"}, "base64"),
        ({"do": "open", "name": "x.svg", "data": ""}, "x.svg"),
        ({"do": "open", "name": "x.exe", "data": base64.b64encode(b"MZ").decode()}, "x.exe"),
        ({"do": "open", "name": "x.fold", "data": base64.b64encode(b"[1, 2]").decode()}, "x.fold"),
    ],
)
def test_what_cannot_be_done_is_one_line_and_the_sheet_stays(
    desk: Desk, message: dict[str, object], words: str
) -> None:
    take(desk, do="percent", value=20.0)
    settled(desk)
    before = desk.frame.points.copy()
    with pytest.raises(InputError, match=words) as told:
        take(desk, **message)
    assert "\n" not in str(told.value)
    settled(desk)
    np.testing.assert_array_equal(desk.frame.points, before)


@pytest.mark.parametrize(
    "name",
    [
        'x"""\nimport os; os.system("touch it-ran")\n"""miura.svg',
        "x\n[pattern]\nkind = 'os:system'\n#.svg",
        "\x1b[2J\u202egvs.svg",
        "n" * 195 + ".svg",
        "../../.x.svg",
        "a\0b.svg",
        "%2e%2e%2fetc.svg",
    ],
)
def test_names_of_files_mean_nothing_in_what_comes_out(name: str) -> None:
    """A name that would end a text of Python, a comment of TOML or a path is a name still."""
    desk = Desk()
    data = base64.b64encode((DATA / "miura.svg").read_bytes()).decode()
    take(desk, do="open", name=name, data=data)
    files = {}
    for what in ("scene", "python"):
        (answer,) = take(desk, do="export", what=what)
        assert "/" not in str(answer["name"])
        files[what] = base64.b64decode(str(answer["data"]))
    tree = ast.parse(files["python"])
    imported = [
        node.module if isinstance(node, ast.ImportFrom) else node.names[0].name
        for node in tree.body
        if isinstance(node, ast.Import | ast.ImportFrom)
    ]
    assert imported == ["bh", "bh.live"]
    assert "os" not in {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    with zipfile.ZipFile(io.BytesIO(files["scene"])) as archive:
        text = next(archive.read(each).decode() for each in archive.namelist() if each.endswith(".toml"))
    assert tomllib.loads(text)["pattern"]["file"] == desk.sheet.name
    assert desk.sheet.name.isprintable()


def test_a_file_that_is_too_long_is_refused_before_it_is_read() -> None:
    with pytest.raises(InputError, match="longer than"):
        of_file("x.svg", b" " * (LONGEST + 1))


def test_where_bars_cannot_go_on_their_faces_may_bend(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same faces by the other formulation, at the same controls; the window is told, and the scene says so."""
    desk = Desk(of_file("fan.svg", (DATA / "fan.svg").read_bytes()))
    assert desk.sheet.model.formulation == "bars-and-hinges"
    take(desk, do="percent", value=30.0)
    stuck = replace(desk.frame, note="iteration limit", wanted=desk.session.wanted)
    with monkeypatch.context() as patch:
        patch.setattr(type(desk.session), "update", lambda *_: stuck)
        patch.setattr(desk, "put", lambda *given: put.append(given))
        put: list[tuple[Any, ...]] = []
        desk.work()
    Desk.put(desk, *put[0])
    sheet, said = desk.news()
    assert sheet["kind"] == "sheet"
    assert "its faces may bend" in str(said["text"])
    assert desk.news() == []
    assert settled(desk)["rest"]
    assert desk.sheet.model.formulation == "consistent"
    assert desk.sheet.model.sheet.nu > 0.0
    assert 'formulation = "consistent"' in scene_text(desk.sheet, desk.session)


def test_material_and_holds_change_under_the_hand(desk: Desk) -> None:
    """Twice the thickness is eight times the energy of a sheet that only bends; the fold stays as it was."""
    take(desk, do="percent", value=20.0)
    thin = settled(desk)["energy"]["bending"]
    take(desk, do="material", t=2.0 * desk.sheet.model.sheet.t)
    head = settled(desk)
    assert head["asked"]["crease"] == pytest.approx(0.2 * np.pi)
    assert 5.0 < head["energy"]["bending"] / thin < 8.5
    held = len(desk.sheet.model.supports)
    take(desk, do="hold", node=0, on=True)
    assert len(desk.sheet.model.supports) == held + 1
    take(desk, do="hold", node=0, on=False)
    assert len(desk.sheet.model.supports) == held


def test_it_is_checked_against_a_run_from_flat(desk: Desk) -> None:
    (nothing,) = take(desk, do="check")
    assert nothing["kind"] == "line"
    take(desk, do="percent", value=30.0)
    (line,) = take(desk, do="check")
    assert "ends as reached, at most" in str(line["text"])


def test_a_model_of_ones_own_is_handled_and_has_no_scene() -> None:
    desk = Desk(of_model(of_library("arc").model))
    take(desk, do="percent", value=10.0)
    assert settled(desk)["rest"]
    with pytest.raises(InputError, match="Python lines"):
        take(desk, do="export", what="scene")


# ---------------------------------------------------------------------------------------------- the server

Talk = Callable[[Studio, str], Awaitable[None]]


def talk(with_studio: Talk) -> None:
    async def run() -> None:
        studio = Studio()
        site, address = studio.serve()
        try:
            await asyncio.wait_for(with_studio(studio, address), 60.0)
        finally:
            await studio.close(site)

    asyncio.run(run())


async def status(address: str, **headers: str) -> int:
    client = tornado.httpclient.AsyncHTTPClient(force_instance=True)
    answer = await client.fetch(address, raise_error=False, headers=headers)
    return int(answer.code)


def test_only_who_has_the_token_and_comes_from_the_page_is_served() -> None:
    async def visit(studio: Studio, address: str) -> None:
        bare = address.split("?")[0]
        assert await status(address) == 200
        assert await status(bare) == 403
        assert await status(f"{bare}?token=x{studio.token}") == 403
        assert await status(address, Host="evil.example") == 403
        socket = address.replace("http", "ws").replace("/?", "/socket?")
        for url, origin in (
            (socket.split("?")[0], bare.rstrip("/")),
            (socket, "http://evil.example"),
        ):
            request = tornado.httpclient.HTTPRequest(url, headers={"Origin": origin})
            with pytest.raises(tornado.httpclient.HTTPClientError, match="403"):
                await tornado.websocket.websocket_connect(request)
        assert await status(f"{bare}static/../server.py?token={studio.token}") in (403, 404)

    talk(visit)


def test_windows_have_sheets_of_their_own_and_give_them_back() -> None:
    async def visit(studio: Studio, address: str) -> None:
        socket = address.replace("http", "ws").replace("/?", "/socket?")
        one, two = [await tornado.websocket.websocket_connect(socket) for _ in range(2)]
        for window in (one, two):
            assert json.loads(await window.read_message() or "")["kind"] == "sheet"
        await one.write_message(json.dumps({"do": "percent", "value": 20}))
        await two.write_message("no message at all")
        energies = []
        while True:
            message = await one.read_message()
            assert isinstance(message, bytes)
            (length,) = struct.unpack("<I", message[:4])
            head = json.loads(message[4 : 4 + length])
            energies.append(head["energy"]["total"])
            await one.write_message("drawn")
            if head["rest"] and head["asked"]["crease"] > 0.0:
                break
        assert energies[-1] > 0.0
        lines: list[dict[str, str]] = []
        while not lines:
            message = await two.read_message()
            lines += [json.loads(message)] if isinstance(message, str) else []
        assert "cannot be asked" in lines[0]["text"]
        assert len(studio.windows) == 2
        desks = [weakref.ref(window.desk) for window in studio.windows if window.desk is not None]
        assert len(desks) == 2
        one.close()
        two.close()
        while studio.windows or any(desk() for desk in desks):
            await asyncio.sleep(0.01)
            gc.collect()

    talk(visit)


def test_a_server_that_ends_waits_for_what_its_windows_are_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """Finer meshes are waited for by two tasks when the server ends: none is left behind, cancelled or not."""
    monkeypatch.setattr(server, "QUIET", 60.0)
    left: list[asyncio.Task[Any]] = []

    async def visit() -> None:
        studio = Studio()
        site, address = studio.serve()
        window = await tornado.websocket.websocket_connect(
            address.replace("http", "ws").replace("/?", "/socket?")
        )
        for count in (2, 3):  # the work, and one more each time that waits to refine
            await window.write_message(json.dumps({"do": "colour", "by": "none"}))
            while len(studio.tasks) < count:
                await window.write_message("drawn")
                await asyncio.sleep(0.02)
        began = set(studio.tasks)
        await studio.close(site)
        left.extend(task for task in began if not task.done())
        assert not studio.tasks
        window.close()

    asyncio.run(asyncio.wait_for(visit(), 30.0))
    assert left == []


def test_a_sheet_that_breaks_takes_its_own_session_down_only(monkeypatch: pytest.MonkeyPatch) -> None:
    async def visit(_studio: Studio, address: str) -> None:
        window = await tornado.websocket.websocket_connect(
            address.replace("http", "ws").replace("/?", "/socket?")
        )
        await window.read_message()
        monkeypatch.setattr(Desk, "take", lambda *_: 1 / 0)
        await window.write_message(json.dumps({"do": "undo"}))
        while True:
            message = await window.read_message()
            assert message is not None
            if isinstance(message, str) and "a fault of the program (ZeroDivisionError" in message:
                break
        assert await status(address) == 200

    talk(visit)


def test_a_port_that_is_taken_is_one_line() -> None:
    async def visit(_studio: Studio, address: str) -> None:
        port = int(address.split(":")[2].split("/")[0])
        with pytest.raises(InputError, match=f"port {port} cannot be used"):
            Studio().serve(port)

    talk(visit)


def test_only_the_last_of_many_moves_is_done() -> None:
    moves = [json.dumps({"do": "percent", "value": k}) for k in range(5)]
    other = json.dumps({"do": "undo"})
    assert server.newest([*moves, other, moves[1]]) == [moves[-1], other, moves[1]]
    assert server.newest(["nonsense", "nonsense"]) == ["nonsense", "nonsense"]
    odd = ["[" * 100_000, json.dumps({"do": "fold", "crease": [1]}), json.dumps({"do": ["fold"]})]
    assert server.newest(odd) == odd
