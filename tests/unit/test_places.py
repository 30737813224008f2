"""A drawing that cannot be read or meshed is shown, with the place that is in the way marked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from bh.commands.cli import app
from bh.commands.place import marked
from bh.errors import InputError
from meshes import PatternError

PAGE = '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="80mm" viewBox="0 0 100 80" fill="none">{}</svg>'
# an outline that is open by 10 mm at its right side
OPEN = '<path d="M100,30 V0 H0 V80 H100 V40" stroke="black"/><path d="M0,40 H50" stroke="red"/>'
SCENE = '[pattern]\nfile = "open.svg"\n[sheet]\nE = 4000.0\nnu = 0.3\nt = 0.2\n'
SCENE += '[[steps]]\nfold = { crease = "all", by = 0.5 }\n'


@pytest.fixture
def drawing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "open.svg"
    file.write_text(PAGE.format(OPEN), encoding="utf-8")
    (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
    return file


@pytest.mark.parametrize(
    "command",
    [
        ("check", "open.svg"),
        ("check", "scene.toml"),
        ("run", "scene.toml", "-o", "out"),
        ("fold", "open.svg", "-o", "out"),
    ],
    ids=" ".join,
)
def test_the_place_is_marked_beside_the_output(drawing: Path, command: tuple[str, ...]) -> None:
    ended = CliRunner().invoke(app, command)
    assert isinstance(ended.exception, InputError)
    assert str(ended.exception).endswith("; the place is marked in 'open-place.png'")
    picture = drawing.parent / "open-place.png"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert not (drawing.parent / "out").exists()


def test_the_mark_is_at_the_place(drawing: Path) -> None:
    """Pixels of the mark's colour lie around the place, in the view of the whole drawing and in the closer one."""
    from matplotlib.image import imread

    error = marked(PatternError("the outline ends loosely at (100, 40)"), drawing, {}, drawing.parent)
    assert type(error) is PatternError
    picture = imread(drawing.parent / "open-place.png")[..., :3]
    ring = np.abs(picture - np.array([0.8, 0.475, 0.655])).max(axis=2) < 0.02
    _, x = np.nonzero(ring)
    wide = picture.shape[1]
    assert ring.sum() > 100
    assert 0.35 < x[x < wide / 2].mean() / wide < 0.5  # at the right end of the left view
    assert 0.7 < x[x > wide / 2].mean() / wide < 0.8  # in the middle of the right one


@pytest.mark.parametrize(
    ("words", "options"),
    [
        ("no crease is drawn", {}),
        ("the point (4000, 20) is elsewhere", {}),
        ("at (10, 20)", {"sheet": 2}),
        ("at (10, 20)", {"scale": -1.0}),
    ],
)
def test_what_has_no_place_has_no_picture(drawing: Path, words: str, options: dict[str, object]) -> None:
    error = InputError(words)
    assert marked(error, drawing, options, drawing.parent) is error
    assert marked(InputError("at (10, 20)"), drawing, {}, drawing.parent / "not there").args == (
        "at (10, 20)",
    )
    assert not list(drawing.parent.glob("*.png"))
