"""The `bh` command: what it writes, prints and returns."""

import json
import math
import os
import shlex
import signal
import subprocess
import sys
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bh
import bh.runtime.progress
import meshes
from bh.commands.cli import ABOUT, app, main
from bh.paths.path import Path as Trace

BIN = Path(sys.executable).parent / "bh"
SECTOR = """
[pattern]
kind = "annulus_sector"
radius = 100.0
width = 10.0
angle = 0.5
[sheet]
E = 4000.0
t = 0.1
[mesh]
along = 6
"""
GOOD = SECTOR + '[[steps]]\nfold = { crease = "crease", to = 2.0 }\n'
BARS = '[model]\nformulation = "bars-and-hinges"\n'
# both steps are loads, whose increments are short: several states
TWO_STEPS = (
    SECTOR
    + '[creases.crease]\nLstar = 25.0\n[[steps]]\nmoment = { crease = "crease", to = 0.01 }\n'
    + '[[steps]]\nmoment = { crease = "crease", to = 0.03 }\n'
)
# a dead couple that ten turns of the soft crease could not balance; nothing stops it from closing
EARLY = (
    SECTOR
    + """
[model]
formulation = "bars-and-hinges"
hinge_lock = false
[creases.crease]
stiffness = 0.1
[[steps]]
fold = { crease = "crease", rest = 3.0 }
[[steps]]
moment = { crease = "crease", to = 5.0 }
[[steps]]
moment = { crease = "crease", to = 0.0 }
"""
)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "good.toml").write_text(GOOD)
    (tmp_path / "two.toml").write_text(TWO_STEPS)
    (tmp_path / "early.toml").write_text(EARLY)
    return tmp_path


def result(file: Any) -> Any:
    return json.loads(Path(file).read_text(encoding="utf-8"))


def test_run_writes_path_and_result(here: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "good.toml", "-o", "deep/out"]) == 0
    assert sorted(os.listdir("deep/out")) == ["path.bh", "result.json"]
    data = result("deep/out/result.json")
    assert data["outcome"] == "reached"
    assert data["reason"] == ""
    assert set(data["energy"]) == {"stretching", "bending", "folding", "total"}
    assert data["lock_energy"] == 0.0
    assert data["energy"]["total"] == pytest.approx(
        sum(data["energy"][k] for k in ("stretching", "bending", "folding"))
    )
    assert data["fold_angle"]["crease"] == pytest.approx(dict.fromkeys(("mean", "min", "max"), np.pi - 2.0))
    path = Trace.load("deep/out/path.bh")
    assert data["steps"] == [
        {"outcome": "reached", "reason": "", "states": len(path), "iterations": path.iterations}
    ]
    assert data["iterations"] == path.iterations > 0
    assert data["wall_time_s"] == path.wall_time_s > 0.0
    assert data["unknowns"] == path.unknowns > 0
    mesh = path.model.mesh
    assert data["mesh"] == {
        "nodes": len(mesh.points),
        "triangles": len(mesh.triangles),
        "aspect_ratio": mesh.aspect_ratio,
    }
    assert {"python", "numpy", "scipy", "curved-crease-workbench"} <= set(data["versions"])
    assert data["input"] == path.provenance["input"]
    assert data["scene"] == "good.toml"
    assert data["energy"] == path[-1].energy.as_dict()
    out, err = capsys.readouterr()
    assert err == ""
    for word in (
        "reached",
        "N mm",
        "fold angle of crease: 1.1416 rad",
        "deep/out/result.json",
        "deep/out/path.bh",
    ):
        assert word in out


def test_default_folder_and_quiet(here: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "good.toml", "--quiet"]) == 0
    assert (here / "good-out" / "result.json").is_file()
    assert capsys.readouterr() == ("", "")


def test_no_aspect_ratio_is_null(here: Any) -> None:
    text = Path(__file__).parents[2].joinpath("examples", "miura.toml").read_text()
    (here / "miura.toml").write_text(text)
    (here / "miura.fold").write_bytes(
        Path(__file__).parents[2].joinpath("examples", "miura.fold").read_bytes()
    )
    assert main(["run", "miura.toml", "-q"]) == 0
    data = result("miura-out/result.json")
    assert data["mesh"]["aspect_ratio"] is None
    assert {"mountain", "valley"} <= set(data["fold_angle"])


def test_path_that_ends_early(here: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "early.toml", "-o", "out", "--quiet"]) == 1
    data = result("out/result.json")
    assert data["outcome"] == data["steps"][1]["outcome"] != "reached"
    assert data["reason"] == data["steps"][1]["reason"] != ""
    assert [step["outcome"] for step in data["steps"]] == ["reached", data["outcome"], "not tried"]
    assert len(Trace.load("out/path.bh")) == sum(step["states"] for step in data["steps"])
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert f"early.toml: step 2 of 3 ended early: {data['outcome']} ({data['reason']})" in err
    assert "out/result.json" in err


def test_an_unstable_end_is_no_result(here: Any, capsys: pytest.CaptureFixture[str]) -> None:
    """A strip held in the middle buckles to opposite waves, which its half cannot: told everywhere."""
    scene = """
    symmetry = "x"
    [pattern]
    kind = "strip"
    length = 60.0
    width = 6.0
    [sheet]
    E = 4000.0
    t = 0.5
    [mesh]
    kind = "alternating"
    along = 32
    [model]
    formulation = "bars-and-hinges"
    [[supports]]
    at = "edge:start"
    fix = "yz"
    [[supports]]
    at = "edge:end"
    fix = "yz"
    [[supports]]
    at = MIDDLE
    fix = "z"
    [[steps]]
    displace = [
        { at = "edge:start", direction = "x", by = 0.0095 },
        { at = "edge:end", direction = "x", by = -0.0095 },
    ]
    """
    mesh = meshes.structured(meshes.strip(60.0, 6.0), along=32, kind="alternating")
    middle = np.flatnonzero(np.abs(mesh.points[:, 0] - 30.0) < 1e-9).tolist()
    (here / "squeezed.toml").write_text(scene.replace("MIDDLE", str(middle)))
    assert main(["run", "squeezed.toml", "-o", "out", "--quiet", "--no-estimate"]) == 1
    data = result("out/result.json")
    assert data["outcome"] == data["steps"][0]["outcome"] == "unstable"
    assert data["stable"] is False
    assert "leave the symmetry" in data["reason"]
    assert "ended early: unstable" in capsys.readouterr().err
    assert Trace.load("out/path.bh").outcome == "unstable"


def test_locked_hinges_let_it_reach_its_end(here: Any, capsys: pytest.CaptureFixture[str]) -> None:
    """The same couple with the default: the panels are pressed against each other."""
    (here / "locked.toml").write_text(EARLY.replace("hinge_lock = false", "hinge_lock = true"))
    assert main(["run", "locked.toml", "-o", "out", "--quiet"]) == 0
    path = Trace.load("out/path.bh")
    assert max(state.energy.lock for state in path) > 0.0


def test_a_finished_result_is_never_lost(here: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "good.toml", "-o", "out", "-q"]) == 0
    kept = {name: (here / "out" / name).read_bytes() for name in ("path.bh", "result.json")}

    def still_kept() -> Any:
        return all((here / "out" / name).read_bytes() == content for name, content in kept.items())

    assert main(["run", "early.toml", "-o", "out", "-q"]) == 2
    assert "holds a run of another scene (it differs in " in capsys.readouterr().err
    assert still_kept()
    assert main(["run", "early.toml", "-o", "out", "-q", "--force"]) == 1
    assert still_kept()
    assert "earlier run is kept" in capsys.readouterr().err
    assert result("out/result-unfinished.json")["steps"][0]["outcome"] == "reached"
    (here / "bad.toml").write_text(GOOD + "typo = 1\n")
    assert main(["run", "bad.toml", "-o", "out"]) == 2
    assert still_kept()
    # the next run that reaches its end takes the place
    assert main(["run", "two.toml", "-o", "out", "-q", "--force"]) == 0
    assert sorted(os.listdir("out")) == ["path.bh", "result.json"]
    assert result("out/result.json")["scene"] == "two.toml"
    assert len(Trace.load("out/path.bh").steps) == 2


def test_an_early_end_is_replaced(here: Any) -> None:
    assert main(["run", "early.toml", "-o", "out", "-q"]) == 1
    assert main(["run", "good.toml", "-o", "out", "-q", "--force"]) == 0
    assert result("out/result.json")["outcome"] == "reached"
    assert sorted(os.listdir("out")) == ["path.bh", "result.json"]


# --- killed and resumed ------------------------------------------------------------------------------------------

KILLED = """
import os, signal, sys
from pathlib import Path
import bh
from bh.commands.run import solve

class Kill:
    states = 0
    def update(self, *_):
        self.states += 1
        if self.states == int(sys.argv[2]):
            os.kill(os.getpid(), signal.SIGKILL)
    def close(self, outcome):
        pass

solve(bh.load_scene("two.toml"), Path("out"), resume=sys.argv[1] == "resume", progress=Kill())
"""


def killed(how: Any, states: Any) -> Any:
    done = subprocess.run([sys.executable, "-c", KILLED, how, str(states)], capture_output=True, timeout=120)
    assert done.returncode == -signal.SIGKILL, done.stderr
    return len(Trace.load("out/path.bh"))


def test_killed_run_resumes_with_nothing_lost(here: Any) -> None:
    assert main(["run", "two.toml", "-o", "whole", "-q"]) == 0
    assert killed("new", 2) == 3  # the start, and two increments
    assert not (here / "out" / "result.json").exists()
    steps = result("whole/result.json")["steps"]
    assert killed("resume", steps[0]["states"] - 1) > steps[0]["states"]  # now in the second step
    assert main(["run", "two.toml", "-o", "out", "--resume", "-q"]) == 0
    whole, resumed = result("whole/result.json"), result("out/result.json")
    assert resumed["energy"] == pytest.approx(whole["energy"], rel=1e-12, abs=0.0)
    assert resumed["fold_angle"]["crease"] == pytest.approx(whole["fold_angle"]["crease"], rel=1e-12)
    assert resumed["steps"] == whole["steps"]
    assert np.array_equal(Trace.load("out/path.bh")[-1].points, Trace.load("whole/path.bh")[-1].points)
    assert sorted(os.listdir("out")) == ["path.bh", "result.json"]


def test_resume_of_a_complete_run_rewrites_its_result(here: Any) -> None:
    assert main(["run", "good.toml", "-o", "out", "-q"]) == 0
    first = result("out/result.json")
    (here / "out" / "result.json").unlink()
    assert main(["run", "good.toml", "-o", "out", "--resume", "-q"]) == 0
    assert result("out/result.json") == first


def test_resume_finds_the_run_that_was_begun_beside_a_finished_one(
    here: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", "good.toml", "-o", "out", "-q"]) == 0
    interrupt_after(2, monkeypatch)
    assert main(["run", "two.toml", "-o", "out", "--force"]) == 130
    assert "bh run two.toml -o out --resume" in capsys.readouterr().err
    monkeypatch.undo()
    monkeypatch.chdir(here)
    assert result("out/result.json")["scene"] == "good.toml"
    assert main(["run", "good.toml", "-o", "out", "--resume", "-q"]) == 0
    assert main(["run", "two.toml", "-o", "out", "--resume", "-q"]) == 0
    assert result("out/result.json")["scene"] == "two.toml"
    assert sorted(os.listdir("out")) == ["path.bh", "result.json"]


@pytest.mark.parametrize(
    ("prepare", "told"),
    [
        (lambda out: None, "no path.bh in 'out'"),
        (lambda out: out.mkdir(), "no path.bh in 'out'"),
        (lambda out: (out.mkdir(), (out / "path.bh").write_text("?" * 5000)), "not a path file"),
        (lambda out: main(["run", "two.toml", "-o", "out", "-q"]), "another model"),
    ],
    ids=["no folder", "no path", "garbage", "another scene"],
)
def test_resume_of_what_cannot_be_resumed(
    here: Any, capsys: pytest.CaptureFixture[str], prepare: Any, told: str
) -> None:
    prepare(here / "out")
    before = sorted(here.rglob("*"))
    assert main(["run", "good.toml", "-o", "out", "--resume"]) == 2
    err = capsys.readouterr().err
    assert told in err
    assert err.count("\n") == 1
    assert sorted(here.rglob("*")) == before


def interrupt_after(states: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    class Interrupting:
        seen = 0

        def update(self, *_: Any) -> None:
            self.seen += 1
            if self.seen == states:
                raise KeyboardInterrupt

        def close(self, outcome: Any) -> None:
            pass

    monkeypatch.setattr(bh.runtime.progress, "Bar", Interrupting)


def test_interrupt_says_how_to_go_on(
    here: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    interrupt_after(1, monkeypatch)
    assert main(["run", "good.toml", "-o", "out"]) == 130
    err = capsys.readouterr().err
    assert err == "bh: interrupted; go on with: bh run good.toml -o out --resume\n"
    assert main(["run", "good.toml", "-o", "out", "--resume", "-q"]) == 0
    assert result("out/result.json")["outcome"] == "reached"


@pytest.mark.parametrize(
    ("module", "name"),
    [("bh.scene.load", "load_scene"), ("bh.commands.run", "extras"), ("bh.commands.run", "result")],
)
def test_interrupt_anywhere_is_one_line(
    here: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], module: str, name: str
) -> None:
    def stop(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(f"{module}.{name}", stop)
    assert main(["run", "good.toml", "-o", "out"]) == 130
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("bh: interrupted")
    assert err.count("\n") == 1


def test_interrupt_of_another_packages_command(
    here: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stop(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("verification.framework.run.run", stop)
    assert main(["verify", "cone"]) == 130
    assert capsys.readouterr() == ("", "bh: interrupted\n")


def test_hints_can_be_pasted(
    here: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "my scene.toml").write_text(GOOD)
    interrupt_after(1, monkeypatch)
    assert main(["run", "my scene.toml", "-o", "it's out"]) == 130
    err = capsys.readouterr().err
    words = shlex.split(err.partition("go on with: ")[2])
    assert words == ["bh", "run", "my scene.toml", "-o", "it's out", "--resume"]
    monkeypatch.undo()
    monkeypatch.chdir(here)
    assert main([*words[1:], "-q"]) == 0


def test_resume_of_a_finished_run_says_so(here: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "good.toml", "-o", "out"]) == 0
    assert "nothing was left to solve" not in capsys.readouterr().out
    assert main(["run", "good.toml", "-o", "out", "--resume"]) == 0
    assert "this run had reached its end before; nothing was left to solve" in capsys.readouterr().out


def test_extras_of_an_older_run_do_not_stay(here: Any) -> None:
    """A picture beside a result is of that result; what others have put there stays."""
    asked = "[outputs]\nfold = true\n"
    (here / "asks.toml").write_text(GOOD + asked)
    old = ("folded.png", "path.pvd", "path/0000.vtu", "path/notes.txt")
    ours = ["folded.fold", "path.bh", "result.json"]

    def litter() -> None:
        (here / "out" / "path").mkdir(exist_ok=True)
        for name in old:
            (here / "out" / name).touch()

    assert main(["run", "asks.toml", "-o", "out", "-q"]) == 0
    litter()
    assert (
        main(["run", "asks.toml", "-o", "out", "-q", "--resume"]) == 0
    )  # nothing new: they are of this result
    assert set(os.listdir("out")) == {*ours, "folded.png", "path.pvd", "path"}
    assert (
        main(["run", "early.toml", "-o", "out", "-q", "--force"]) == 1
    )  # nor does a run that is not kept touch them
    assert {"folded.png", "path.pvd", "folded.fold"} <= set(os.listdir("out"))
    (here / "out" / "folded-unfinished.png").touch()
    assert main(["run", "two.toml", "-o", "out", "-q", "--force"]) == 0
    assert sorted(os.listdir("out")) == ["path", "path.bh", "result.json"]
    assert os.listdir("out/path") == ["notes.txt"]
    assert main(["run", "asks.toml", "-o", "out", "-q", "--force"]) == 0
    assert sorted(os.listdir("out")) == [ours[0], "path", *ours[1:]]


def test_plain_progress_where_there_is_no_terminal(
    here: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bh.runtime.progress.Bar, "first", 0.0)
    monkeypatch.setattr(bh.runtime.progress.Bar, "every", 0.0)
    assert main(["run", "two.toml", "-o", "out"]) == 0
    out, err = capsys.readouterr()
    assert "lambda" not in out
    lines = err.splitlines()
    assert len(lines) > 2
    assert all(line.startswith(("step 1/2  lambda ", "step 2/2  lambda ")) for line in lines)
    assert main(["run", "two.toml", "-o", "out", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_poissons_ratio_that_is_not_used_is_told(here: Any, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "nu.toml").write_text(GOOD.replace("t = 0.1", "t = 0.1\nnu = 0.3") + BARS)
    assert main(["run", "nu.toml"]) == 0
    assert "bars-and-hinges take Poisson's ratio as 0, not as nu = 0.3" in capsys.readouterr().out
    assert main(["run", "good.toml"]) == 0
    assert "Poisson" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["run"], "see 'bh run --help'"),
        (["view", "--nothing"], "see 'bh view --help'"),
        (["verify", "--nothing"], "see 'bh verify --help'"),
        (["nothing"], "see 'bh --help'"),
        (["run", "sheet.fold"], 'name it in a scene file: [pattern] file = "sheet.fold"'),
        (["run", "out/path.bh"], "`bh view`"),
    ],
)
def test_where_a_wrong_command_line_is_sent(
    here: Any, capsys: pytest.CaptureFixture[str], words: Any, told: str
) -> None:
    assert main(words) == 2
    err = capsys.readouterr().err
    assert told in err
    assert err.count("\n") == 1


# --- requests ----------------------------------------------------------------------------------------------------


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Pictures and series are told of, not made; `tests` of plotting make them."""
    import bh.plotting

    calls: list[tuple[Any, ...]] = []
    monkeypatch.setattr(
        bh.plotting, "picture", lambda state, file, **_: calls.append(("picture", state.lam, file))
    )
    monkeypatch.setattr(
        bh.plotting,
        "export_series",
        lambda path, folder, *name: calls.append(("series", str(folder))),
    )
    monkeypatch.setattr(bh.plotting, "show", lambda state, **_: calls.append(("show", state.lam)))
    monkeypatch.setattr(bh.plotting, "has_display", lambda: True)
    return calls


def test_pictures_and_series_on_request(here: Any, drawn: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "good.toml", "-o", "out"]) == 0
    assert drawn == []
    assert main(["run", "good.toml", "-o", "out", "--pictures", "--vtu"]) == 0
    assert drawn == [("picture", 1.0, Path("out/folded.png")), ("series", "out")]
    assert "out/folded.png out/path.pvd" in capsys.readouterr().out
    drawn.clear()
    (here / "asks.toml").write_text(GOOD + "[outputs]\npictures = true\nfold = true\n")
    assert main(["run", "asks.toml", "-o", "out", "-q"]) == 0
    assert drawn == [("picture", 1.0, Path("out/folded.png"))]
    folded = result("out/folded.fold")["file_frames"][0]
    angles = [angle for angle in folded["edges_foldAngle"] if angle and angle < -60.0]
    assert np.degrees(2.0 - np.pi) == pytest.approx(np.array(angles))  # mountain folds are negative in FOLD


def test_picture_that_fails_leaves_the_result(
    here: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import bh.plotting

    def fail(*_: Any, **__: Any) -> None:
        raise ImportError("libGL is missing")

    monkeypatch.setattr(bh.plotting, "picture", fail)
    assert main(["run", "good.toml", "-o", "out", "--pictures"]) == 2
    assert "the result is in 'out', but folded.png could not be written: libGL" in capsys.readouterr().err
    assert result("out/result.json")["outcome"] == "reached"


def test_view(here: Any, drawn: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "good.toml", "-o", "out", "-q"]) == 0
    assert main(["view", "out"]) == 0
    assert main(["view", "out/path.bh", "--state", "0", "--picture", "flat.png"]) == 0
    assert main(["view", "out", "--vtu", "series"]) == 0
    assert drawn == [("show", 1.0), ("picture", 0.0, Path("flat.png")), ("series", "series")]
    assert main(["view", "out", "--state", "99"]) == 2
    assert "--state 99: 'out/path.bh' has the states 0 to" in capsys.readouterr().err
    assert main(["view", "out", "--html", "sheet.html"]) == 0
    assert f"wrote {Path('sheet.html').resolve()}" in capsys.readouterr().out.replace("\n", "")
    assert '<div class="sheet3d"' in Path("sheet.html").read_text(encoding="utf-8")
    assert main(["view", "out", "--animation", "folding.avi"]) == 2
    assert "neither .gif nor .mp4" in capsys.readouterr().err
    assert len(drawn) == 3  # no window was opened for these


def test_view_without_a_display_is_a_page(here: Any, capsys: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    import webbrowser

    import bh.plotting

    opened: list[str] = []
    monkeypatch.setattr(bh.plotting, "has_display", lambda: False)
    monkeypatch.setattr(webbrowser, "open", opened.append)
    assert main(["run", "good.toml", "-o", "out", "-q"]) == 0
    for browser, times in (("", 0), ("some-browser", 1)):
        monkeypatch.setenv("BROWSER", browser)
        assert main(["view", "out"]) == 0
        assert "no display for a window; wrote" in capsys.readouterr().out
        assert opened == [Path("out/view.html").resolve().as_uri()] * times
    assert '<div class="sheet3d"' in Path("out/view.html").read_text(encoding="utf-8")
    assert main(["view", "out", "--animation", "a.gif", "--frames", "1"]) == 2
    assert "frames = 1 cannot be; give 2 to 5000" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["matplotlib", "pyvista"])
def test_what_a_light_installation_leaves_out_is_one_line(
    name: str, here: Any, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And a module of our own that is missing stays a fault of the program."""
    import bh.plotting

    def missing(*_: object, **__: object) -> None:
        raise ModuleNotFoundError(f"No module named '{name}'", name=name)

    assert main(["run", "good.toml", "-o", "out", "-q"]) == 0
    monkeypatch.setattr(bh.plotting, "picture", missing)
    assert main(["view", "out", "--picture", "a.png"]) == 2
    told = capsys.readouterr().err
    assert told == f"bh: this needs {name}, which is not installed; pip install {name}\n"
    monkeypatch.setattr(bh.plotting, "picture", lambda *_: __import__("bh.nothing"))
    assert main(["view", "out", "--picture", "a.png"]) == 3


# --- the command itself ------------------------------------------------------------------------------------------


def test_version_formulations_and_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("bh 0.")
    assert main(["formulations"]) == 0
    assert "bars-and-hinges\n" in capsys.readouterr().out
    for words in (["--help"], []):
        assert main(words) == 0
        out = capsys.readouterr().out
        assert all(f"\n  {name} " in out for name in ("run", "view", "formulations", "verify", "report"))
        assert "..." not in out.replace("[ARGS]...", "")
        assert all(about in out for about in ABOUT.values())


def test_short_help_is_that_of_the_commands() -> None:
    for entry in entry_points(group="bh.commands"):
        assert entry.load().__doc__.splitlines()[0] == ABOUT[entry.name]


def test_starts_light() -> None:
    """Nothing is loaded that a command line alone does not need."""
    heavy = "numpy", "numba", "pydantic", "pyvista", "scipy", "matplotlib", "shapely"
    check = f"import sys, bh.commands.cli; sys.exit(' '.join(m for m in {heavy} if m in sys.modules))"
    assert subprocess.run([sys.executable, "-c", check], capture_output=True, text=True).stderr.strip() == ""
    done = subprocess.run([BIN, "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("bh ")


def test_commands_of_other_packages(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from bh.commands.cli import _proxy

    def check(cases: list[str], fast: bool = False, level: int = 3) -> None:
        """Check the cases."""
        print(cases, fast, level)
        if level == 7:
            raise bh.errors.InputError("level 7 cannot be; use 3")

    working = EntryPoint("check", "package.command:check", "bh.commands")
    monkeypatch.setattr(EntryPoint, "load", lambda self: check)
    settings = {"ignore_unknown_options": True, "allow_extra_args": True, "allow_interspersed_args": False}
    commands = list(app.registered_commands)
    app.command("check", add_help_option=False, context_settings=settings)(_proxy(working))
    try:
        assert main(["check", "one", "--fast", "two", "--level", "4"]) == 0
        assert capsys.readouterr().out == "['one', 'two'] True 4\n"
        assert main(["check", "--help"]) == 0
        assert "Check the cases." in capsys.readouterr().out
        assert main(["check", "one", "--level", "7"]) == 2
        assert capsys.readouterr().err == "bh: level 7 cannot be; use 3\n"
        assert main(["check", "one", "--slow"]) == 2
        assert "--slow" in capsys.readouterr().err

        def broken(self: Any) -> None:
            raise ImportError("no module of that name")

        monkeypatch.setattr(EntryPoint, "load", broken)
        assert main(["--version"]) == 0
        capsys.readouterr()
        assert main(["check", "one"]) == 2
        assert "command 'check' is not available (no module of that name)" in capsys.readouterr().err
    finally:
        app.registered_commands[:] = commands


def test_a_fault_of_the_program_is_told_as_such(
    here: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import bh.commands.run

    def fail(*_: Any, **__: Any) -> None:
        raise RuntimeError("a\nfault")

    monkeypatch.setattr(bh.commands.run, "solve", fail)
    assert main(["run", "good.toml"]) == 3
    err = capsys.readouterr().err
    assert err.startswith("bh: RuntimeError: a fault (a fault of the program")
    assert err.count("\n") == 1


def test_resume_of_a_finished_run_whose_last_step_changed_does_not_say_that_nothing_was_left(
    here: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    two = GOOD + '[[steps]]\nfold = { crease = "crease", to = 2.7 }\n'
    (here / "two.toml").write_text(two)
    (here / "other.toml").write_text(two.replace("to = 2.7", "to = 2.6"))
    assert main(["run", "two.toml", "-o", "out", "-q"]) == 0
    assert main(["run", "other.toml", "-o", "out", "--resume"]) == 0
    told = capsys.readouterr().out
    assert "nothing was left" not in told
    assert bh.read("out").path[-1].fold_angle("crease").mean() == pytest.approx(math.pi - 2.6)
