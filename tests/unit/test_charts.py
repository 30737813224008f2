"""Charts and animations of paths in one line each: what is drawn is what was solved."""

from __future__ import annotations

import dataclasses
import itertools
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh import plotting
from bh.model.actuations import Displace
from bh.plotting import frames, moving, offscreen
from meshes.errors import InputError
from tests.unit.test_plotting import needs_opengl


@pytest.fixture(scope="module")
def path() -> bh.Path:
    """A sector held at one end, folded softly, then pushed at the tip of its crease."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.6), along=8)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127), formulation="bars-and-hinges")
    model = model.support("edge:start", "xyz").support("edge:end", "z")
    tip = int(mesh.nodes("crease:crease")[-1])
    return bh.trace(model.fold("crease", rest=2.2, Lstar=25.0).step(Displace([tip], "x", -3.0)))


def tip(path: bh.Path) -> str:
    return f"node:{path.model.mesh.nodes('crease:crease')[-1]}"


def lines(figure: Any) -> list[Any]:
    return list(figure.axes[0].get_lines())


def test_fold_angles_are_those_of_the_states(path: bh.Path) -> None:
    figure = plotting.fold_angles(path, "crease", count=3)
    assert len(lines(figure)) == 3
    last = lines(figure)[-1]
    assert last.get_ydata() == pytest.approx(np.degrees(path[-1].fold_angle("crease")))
    points = path.model.mesh.points[path.model.mesh.nodes("crease:crease")]
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert last.get_xdata() == pytest.approx(np.cumsum(steps) - 0.5 * steps)
    assert len(lines(plotting.fold_angles(path, "crease", count=1))) == 1
    with pytest.raises(InputError, match="nonsense"):
        plotting.fold_angles(path, "nonsense")


def test_response_is_force_against_displacement(path: bh.Path) -> None:
    place = tip(path)
    (dots,) = [line for line in lines(plotting.response(path, place, "x")) if line.get_label() == "stable"]
    assert dots.get_xdata() == pytest.approx([state.displacement(place)[0, 0] for state in path])
    assert dots.get_ydata() == pytest.approx([state.reaction(place)[0] for state in path])
    assert dots.get_xdata()[-1] == pytest.approx(-3.0)
    assert abs(dots.get_ydata()[-1]) > 1e-6
    slanted = plotting.response(path, place, (0.0, 3.0, 4.0), force="lambda")
    (dots,) = [line for line in lines(slanted) if line.get_label() == "stable"]
    assert dots.get_ydata() == pytest.approx(path.lambdas)
    assert dots.get_xdata() == pytest.approx(
        [state.displacement(place)[0] @ (0.0, 0.6, 0.8) for state in path]
    )
    energies = plotting.response(path, force=lambda state: 1.0)
    assert energies.axes[0].get_ylabel() == "energy, N mm"


def test_unstable_states_and_jumps_are_shown(path: bh.Path) -> None:
    """Two states made unstable by hand, one reached by a jump: dashes, rings, and a gap in the line."""
    changed = bh.Path(path.model)
    changed.records = [
        dataclasses.replace(record, negative=int(index in (2, 3)), jumped=index == 4)
        for index, record in enumerate(path.records)
    ]
    found = lines(plotting.response(changed))
    rings = next(line for line in found if line.get_label() == "not stable")
    assert rings.get_xdata() == pytest.approx(path.lambdas[[2, 3]])
    pieces = [line for line in found if line.get_marker() in ("None", "")]
    assert len(pieces) == len(path) - 2
    dashed = [line for line in pieces if line.get_linestyle() == "--"]
    assert len(dashed) == 2  # 1 to 2 and 2 to 3; 3 to 4 is a jump


def test_pattern_shows_creases_and_supports() -> None:
    mesh = meshes.structured(
        meshes.annulus_sector([90.0, 100.0], 10.0, 0.6, folds=("mountain", "valley")), along=6
    )
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127)).support("edge:start", "xyz").support("node:3", "z")
    figure = plotting.pattern(model)
    legend = figure.axes[0].get_legend()
    assert legend is not None
    words = [text.get_text() for text in legend.get_texts()]
    assert words == ["mountain crease", "valley crease", "edge:start: xyz", "node:3: z"]
    held = next(line for line in lines(figure) if line.get_label() == "edge:start: xyz")
    assert np.column_stack(held.get_data()) == pytest.approx(mesh.points[mesh.nodes("edge:start")][:, :2])


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        (lambda path: plotting.response(path, "all", "w"), "direction 'w' is not known"),
        (lambda path: plotting.response(path, "all", (0.0, 0.0, 0.0)), "cannot be; give three numbers"),
        (lambda path: plotting.response(path, "all", force="weight"), "force 'weight' is not known"),
        (lambda path: plotting.response(path, "nowhere"), "nowhere"),
        (lambda path: plotting.response(bh.Path(path.model)), "no states to plot"),
        (lambda path: plotting.fold_angles(bh.Path(path.model), "crease"), "no states to plot"),
        (lambda path: plotting.animation(path, "a.avi"), "neither .gif nor .mp4"),
        (lambda path: plotting.animation(path, "a.gif", fps=0), "fps = 0 cannot be"),
        (lambda path: plotting.animation(bh.Path(path.model), "a.gif"), "no states to show"),
        (lambda path: plotting.animation(path, "a.gif", size=(10, 10), frames=2), "size 10 x 10 cannot be"),
        (lambda path: plotting.animation(path, "a.gif", frames=1), "frames = 1 cannot be; give 2 to 5000"),
        (lambda path: plotting.animation(path, "a.gif", frames=9, states=[0]), "and no states beside them"),
        (lambda path: plotting.animation(path, "a.gif", states=[]), "no states to show"),
    ],
)
def test_bad_requests_are_refused_in_one_line(path: bh.Path, draw: Any, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        draw(path)
    assert "\n" not in str(caught.value)


@needs_opengl
def test_animation_moves_and_stays_in_the_picture(path: bh.Path, tmp_path: Path) -> None:
    from PIL import Image, ImageSequence

    file = plotting.animation(path, tmp_path / "lift.gif", size=(301, 240), fps=10, states=[0, 2, -1])
    with Image.open(file) as image:
        assert image.size == (300, 240)
        frames = [np.asarray(one.convert("RGB"), dtype=int) for one in ImageSequence.Iterator(image)]
        assert len(frames) >= 3
    inside = [frame[40:160] for frame in frames[:3]]  # below the line of text, above the colour bar
    for one, two in itertools.pairwise(inside):
        assert (np.abs(one - two) > 30).any(axis=2).sum() > 100
    for frame in inside:
        assert (frame[:, 0] > 245).all()  # nothing touches the sides
        assert (frame[:, -1] > 245).all()


def test_mp4_needs_ffmpeg(path: bh.Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    with pytest.raises(offscreen.PlotError, match="needs ffmpeg"):
        plotting.animation(path, tmp_path / "lift.mp4")


@needs_opengl
def test_mp4_is_written(path: bh.Path, tmp_path: Path) -> None:
    try:
        moving._ffmpeg()
    except offscreen.PlotError as error:
        pytest.skip(str(error))
    file = plotting.animation(path, tmp_path / "lift.mp4", size=(320, 240), states=[0, -1])
    assert file.read_bytes()[4:8] == b"ftyp"


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent"])
def test_frames_are_even_and_in_balance(formulation: str) -> None:
    """Two states 90 degrees apart and back by 60: what is between them is solved, and moves on by equal steps."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.785), along=12, rows=1)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, nu=0.3, t=0.2), formulation=formulation)
    path = bh.trace(model.fold("crease", by=1.57).fold("crease", by=0.5), estimate=False)
    assert len(path) < 12
    shown = frames.evenly(path, 25)
    assert len(shown) == 25
    assert shown[0].energy.total == path[0].energy.total
    assert shown[-1].energy.total == path[-1].energy.total
    moved = [float(np.sqrt(np.mean((b.points - a.points) ** 2))) for a, b in itertools.pairwise(shown)]
    assert max(moved) < 3.0 * float(np.median(moved))
    energies = [state.energy.total for state in shown]
    turn = energies.index(max(energies))
    assert energies[: turn + 1] == sorted(energies[: turn + 1])  # no frame is stretched by blending
    assert energies[turn:] == sorted(energies[turn:], reverse=True)
    assert max(energies) <= max(state.energy.total for state in path) * (1.0 + 1e-9)


def test_frames_where_nothing_can_be_solved_between() -> None:
    """A path that goes on to another state at a snap shows its states, as often as there are frames."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.785), along=6, rows=1)
    path = bh.trace(bh.Model(mesh, bh.Sheet(E=4000.0, t=0.2)).fold("crease", by=0.5), estimate=False)
    path.records[1:] = [dataclasses.replace(record, jumped=True) for record in path.records[1:]]
    shown = frames.evenly(path, 9)
    assert len(shown) == 9
    assert {state.lam for state in shown} <= {state.lam for state in path}


@pytest.mark.parametrize("fps", [10, 24, 30, 40])
def test_a_gif_keeps_its_rate(tmp_path: Path, fps: int) -> None:
    """It counts in hundredths of a second, which 24 a second do not fit into."""
    from PIL import Image, ImageSequence

    shades = [np.full((8, 8, 3), 40 + 5 * at, dtype=np.uint8) for at in range(36)]
    moving._gif(shades, tmp_path / "a.gif", fps)
    with Image.open(tmp_path / "a.gif") as image:
        lasting = [float(one.info["duration"]) for one in ImageSequence.Iterator(image)]
    assert len(lasting) == 36
    assert sum(lasting) == pytest.approx(36_000.0 / fps, abs=5.0)
    assert max(lasting) - min(lasting) <= 10.0
