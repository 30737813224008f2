"""Workers end with their parent, interrupts end at once, what is finished is kept, and nobody writes a file twice."""

from __future__ import annotations

import contextlib
import http.client
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import bh
import meshes
from bh.commands.cli import main
from bh.errors import InputError, PathFileError
from bh.runtime.lock import only_writer
from bh.sweep.journal import Journal, Meta
from bh.sweep.pools import reach
from verification.framework import run as runner
from verification.framework.checks import CaseResult
from verification.studies.solver.attack.programs import members

ROOT = Path(__file__).resolve().parents[2]
linux = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")
SCENE = """
[pattern]
kind = "annulus_sector"
radius = 100.0
width = 10.0
angle = 0.7
[sheet]
E = 4000.0
t = 0.127
[mesh]
along = 6
[model]
formulation = "bars-and-hinges"
[[steps]]
fold = { crease = "crease", by = 0.2 }
"""
# two workers that would sleep for minutes; the parent says when they do
SLEEPERS = """
import sys, time
from bh.runtime.workers import Workers
def sleep(folder, number):
    open(f"{folder}/{number}", "w").close()
    time.sleep(600)
if __name__ == "__main__":
    with Workers(2) as pool:
        futures = [pool.submit(sleep, sys.argv[1], n) for n in range(2)]
        futures[0].result()
"""


def until(done: Callable[[], bool], seconds: float) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if done():
            return True
        time.sleep(0.05)
    return False


def started(words: list[str], ready: Callable[[], bool], **options: Any) -> subprocess.Popen[str]:
    """A program in a session of its own, as soon as it is ready."""
    program = subprocess.Popen(
        words, start_new_session=True, stderr=subprocess.PIPE, text=True, preexec_fn=heeding, **options
    )
    assert until(lambda: ready() or program.poll() is not None, 60.0), "it never began"
    assert program.poll() is None, program.stderr.read() if program.stderr else ""
    return program


def heeding() -> None:
    """Interrupts count in a child, also where the tests run in the background of a shell, which ignores them there."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@linux
@pytest.mark.parametrize("name", ["SIGKILL", "SIGTERM", "SIGINT"])
def test_workers_end_with_their_parent(name: str, tmp_path: Path) -> None:
    script = tmp_path / "sleepers.py"
    script.write_text(SLEEPERS)
    (tmp_path / "on").mkdir()
    words = [sys.executable, str(script), str(tmp_path / "on")]
    program = started(words, lambda: len(os.listdir(tmp_path / "on")) == 2, cwd=ROOT)
    try:
        assert len(members(program.pid)) >= 3
        send = os.killpg if name == "SIGINT" else os.kill  # Ctrl-C goes to all of them
        send(program.pid, getattr(signal, name))
        program.wait(10.0)
        assert until(lambda: not members(program.pid), 5.0), "workers are left behind"
        said = program.stderr.read() if program.stderr else ""
        assert said.count("Traceback") == (name == "SIGINT")  # of the parent, which is no command
    finally:
        for process in members(program.pid):
            os.kill(process, signal.SIGKILL)


@linux
def test_an_interrupt_ends_verify(tmp_path: Path) -> None:
    """Workers are busy or only starting: exit code 130, one line, nobody left behind."""
    words = [sys.executable, "-m", "bh.commands.cli", "verify", "fig5_9", "fig5_10", "--jobs", "2"]
    words += ["--results", str(tmp_path / "results")]
    program = subprocess.Popen(
        words, start_new_session=True, stderr=subprocess.PIPE, text=True, cwd=ROOT, preexec_fn=heeding
    )
    try:
        assert until(lambda: len(members(program.pid)) >= 3, 60.0)
        time.sleep(0.3)
        os.killpg(program.pid, signal.SIGINT)
        assert program.wait(10.0) == 130
        assert until(lambda: not members(program.pid), 5.0)
        assert program.stderr is not None
        assert "Traceback" not in program.stderr.read()
    finally:
        for process in members(program.pid):
            os.kill(process, signal.SIGKILL)


# Ctrl-C in the moment in which a module is imported, and a program that imports it
START = """
import sys
import _signal  # `signal` itself is imported by the program
moment = sys.argv.pop(1)
class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == moment:
            _signal.raise_signal(_signal.SIGINT)
sys.modules.pop("signal", None)
sys.meta_path.insert(0, Interrupt())
"""
COMMAND = START + "from bh_command import main\nsys.exit(main())\n"


@pytest.mark.parametrize(
    "moment", ["signal", "bh", "bh.runtime.viewer", "typer", "bh.commands.compare", "bh.runtime.kernel_cache"]
)
def test_an_interrupt_in_the_moment_of_starting(moment: str) -> None:
    """One line and 130, from the first import of the program on."""
    words = [sys.executable, "-c", COMMAND, moment, "--version"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (130, "bh: interrupted\n")


@linux
def test_ignored_interrupts_stay_ignored() -> None:
    """As behind `nohup`, or in the background of a shell."""
    words = [sys.executable, "-c", COMMAND, "typer", "--version"]
    done = subprocess.run(
        words, cwd=ROOT, capture_output=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN)
    )
    assert (done.returncode, done.stderr) == (0, b"")


def test_an_interrupt_when_all_is_told_changes_nothing() -> None:
    late = "import _signal, atexit\natexit.register(_signal.raise_signal, _signal.SIGINT)\n"
    words = [sys.executable, "-c", late + COMMAND, "nothing", "--version"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True)
    assert (done.returncode, done.stderr) == (0, b"")


def test_an_interrupt_that_became_another_error(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Python 3.11 makes a RuntimeError of what is raised in `__set_name__` while a class is made."""

    def interrupted(*_: Any, **__: Any) -> int:
        raise RuntimeError("Error calling __set_name__") from KeyboardInterrupt()

    monkeypatch.setattr("bh.commands.cli.app", interrupted)
    assert main(["check", "there-is-none.toml"]) == 130
    assert capsys.readouterr().err == "bh: interrupted\n"


def test_a_program_of_the_users_own_has_its_own_interrupts() -> None:
    """Neither `import bh` nor the module that the command begins in touches them."""
    program = START + "import bh_command\nimport bh.commands.cli\n"
    words = [sys.executable, "-c", program, "bh.runtime.viewer"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert "KeyboardInterrupt" in done.stderr
    assert "bh: interrupted" not in done.stderr


def test_an_interrupt_while_another_end_is_told_of(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: Any) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr("bh.commands.cli._explain", interrupted)
    assert main(["check", "there-is-none.toml"]) == 130
    assert capsys.readouterr().err == "bh: interrupted\n"


INSIDE_EXEC = """
import sys
import bh.scene.load
from bh.commands.cli import main
def load_scene(*_):
    exec("raise KeyboardInterrupt")
bh.scene.load.load_scene = load_scene
sys.argv[1:] = ["check", "scene.toml"]
sys.exit(main())
"""


def test_an_interrupt_within_exec_keeps_its_exit_code(tmp_path: Path) -> None:
    """Python itself would end a module by SIGINT: it remembers the interrupt of a string, though it was caught."""
    (tmp_path / "inside.py").write_text(INSIDE_EXEC)
    words = [sys.executable, "-m", "inside"]
    env = {**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}"}
    done = subprocess.run(words, cwd=tmp_path, env=env, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (130, "bh: interrupted\n")


def test_finished_cases_outlive_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Interrupted in the second case: the first is stored, and what was there before is `previous.json`."""

    def results(*_: Any) -> Iterator[CaseResult]:
        yield CaseResult("strips", "t", "q", "s")
        raise KeyboardInterrupt

    (tmp_path / "checks.json").write_text('{"old": true}')
    monkeypatch.setattr(runner, "_results", results)
    with pytest.raises(KeyboardInterrupt):
        runner.run(["strips", "cone"], tmp_path)
    stored = json.loads((tmp_path / "checks.json").read_text())
    assert "strips" in [info["name"] for info in stored["cases"]]
    assert json.loads((tmp_path / "previous.json").read_text()) == {"old": True}


# ------------------------------------------------------------------------------------------ one writer


def test_one_writer_at_a_time(tmp_path: Path) -> None:
    file = tmp_path / "a"
    with only_writer(file):
        with pytest.raises(PathFileError, match="another process"), only_writer(file):
            pass
        with only_writer(tmp_path / "b"), only_writer(tmp_path):
            pass
    with only_writer(file):
        pass
    assert not list(tmp_path.iterdir())


def test_a_killed_writer_holds_nothing(tmp_path: Path) -> None:
    program = (
        "import os, signal, sys, pathlib\nfrom bh.runtime.lock import only_writer\n"
        "with only_writer(pathlib.Path(sys.argv[1])):\n    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", program, str(tmp_path / "a")], cwd=ROOT)
    assert done.returncode == -signal.SIGKILL
    assert (tmp_path / ".a.lock").exists()
    with only_writer(tmp_path / "a"):
        pass
    assert not list(tmp_path.iterdir())


def test_a_path_is_written_by_one(tmp_path: Path) -> None:
    """The second of two that resume is refused; the states are there once."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.7), along=6)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127), formulation="bars-and-hinges")
    model = model.fold("crease", by=0.2).fold("crease", by=0.2)
    file = tmp_path / "path.bh"
    count = len(bh.trace(model, file=file))
    with only_writer(file), pytest.raises(PathFileError, match="another process"):
        bh.trace(model, file=file, resume=True)
    assert len(bh.Path.load(file)) == count
    assert [place.name for place in tmp_path.iterdir()] == ["path.bh"]


def test_a_folder_is_run_into_by_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE)
    out = tmp_path / "out"
    words = ["run", str(scene), "-o", str(out), "-q", "--no-estimate"]
    out.mkdir()
    with only_writer(out):
        assert main(words) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "another process" in said
    assert out.is_dir()  # it is the other's
    assert main(words) == 0
    assert sorted(place.name for place in out.iterdir()) == ["path.bh", "result.json"]


def test_a_folder_in_place_of_the_result(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE)
    (tmp_path / "out" / "result.json").mkdir(parents=True)
    assert main(["run", str(scene), "-o", str(tmp_path / "out"), "-q"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "result.json' is a folder" in said


# ------------------------------------------------------------------------------------------ sweeps


@pytest.mark.parametrize(
    "name", ["a/b", "outcome", "", "worker", "point", "energy_total", "iterations", "node"]
)
def test_names_of_axes_are_checked_before_solving(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    sweep = tmp_path / "sweep.toml"
    sweep.write_text(f'scene = "scene.toml"\n[axes."{name}"]\nkey = "sheet.t"\nvalues = [0.1, 0.2]\n')
    assert main(["sweep", str(sweep), "-o", str(tmp_path / "a.nc"), "--workers", "0"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert repr(name) in said
    assert not (tmp_path / "a.nc.points").exists()


def test_a_sweep_is_written_by_one(tmp_path: Path) -> None:
    points = bh.sweep.grid({"a": [1.0]})
    with only_writer(tmp_path / "a.nc.points"), pytest.raises(InputError, match="another process"):
        bh.sweep.run(dict, points, tmp_path / "a.nc", pool=0)


def told_by_web_servers() -> list[str]:
    """What the web servers of this process and its children tell of Dask to who has no key."""
    psutil = pytest.importorskip("psutil")
    me, told = psutil.Process(), []
    ports = {
        connection.laddr.port
        for process in (me, *me.children(recursive=True))
        for connection in process.net_connections("inet")
        if connection.status == "LISTEN"
    }
    assert ports
    for port in sorted(ports):
        for page in ("health", "info/main/workers.html", "json/counts.json", "json/identity.json", "metrics"):
            with contextlib.suppress(OSError, http.client.HTTPException):
                connection = http.client.HTTPConnection("127.0.0.1", port, timeout=2.0)
                connection.request("GET", f"/{page}")
                if connection.getresponse().status != 404:
                    told.append(f"{port}/{page}")
    return told


def test_a_cluster_of_ones_own_is_not_open_to_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the keys of this process nobody is let in."""
    pytest.importorskip("distributed")
    pool = bh.sweep.Dask(None, 1)
    monkeypatch.setattr("bh.sweep.pools.ANSWER_S", 2.0)
    try:
        assert pool.address.startswith("tls://")
        assert pool.submit(abs, -3).result(30.0) == 3
        for address in (pool.address, pool.address.replace("tls://", "tcp://")):
            with pytest.raises((OSError, TypeError)):
                reach(address)
        assert told_by_web_servers() == []
    finally:
        pool.close()


def test_a_journal_is_there_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A sweep that was killed while its journal was made could not go on: "has format 0"."""
    file = tmp_path / "sweep.nc.points"
    meta = Meta(identity="a", names=[], values=[], grid=True, labels={}, attributes={})
    seen: list[bool] = []

    def look(value: object) -> str:
        seen.append(file.exists())
        return json_text(value)

    json_text = json.dumps
    monkeypatch.setattr("bh.sweep.journal.json.dumps", look)
    journal = Journal.create(file, meta)
    assert (seen, journal.meta["identity"]) == ([False] * len(meta), "a")
    journal.close()
    assert [place.name for place in tmp_path.iterdir()] == [file.name]
