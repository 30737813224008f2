"""Where a drawing cannot be read or meshed: its lines, with the places that the error names marked, as a picture."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bh.errors import InputError, SceneError
from bh.scene.reading import inside
from bh.scene.toml_text import read_toml, toml_bytes
from meshes.io.drawing import PATTERNS, read_lines
from meshes.io.export import replacing

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bh.scene.load import Scene
    from meshes.planar import DrawnLine

NUMBER = r"(-?[0-9][0-9.]*(?:e[-+]?[0-9]+)?)"
PLACE = re.compile(rf"\({NUMBER}, {NUMBER}\)")  # as errors of readers and meshers write them, mm
NEAR = 0.06  # of the drawing's diagonal on each side of the first place, in the closer view
MARGIN = 0.25  # of its size around the drawing: a place farther off is no place in it
COLOURS = {
    "boundary": "black",
    "cut": "#009e73",
    "mountain": "#d55e00",
    "valley": "#0072b2",
    "facet": "#e0b000",
}
READING = ("fit", "scale", "gap", "tolerance", "lines", "outline", "frame")  # keys of [pattern] that say how


def marked(error: InputError, drawing: Path, options: Mapping[str, object], folder: Path) -> InputError:
    """The error, which names the picture of its places where there is one to draw.

    Args:
        error: of reading or meshing a drawing.
        drawing: its file.
        options: with which it was read.
        folder: for the picture, DRAWING-place.png.
    """
    places = np.array([[float(x), float(y)] for x, y in PLACE.findall(str(error))]).reshape(-1, 2)
    if not len(places) or "sheet" in options or drawing.suffix.lower() not in PATTERNS:
        return error  # a sheet of several is moved to its own origin
    try:
        how = {key: options[key] for key in READING if key in options}
        lines = read_lines(drawing, **how)  # type: ignore[arg-type]
    except InputError:
        return error
    every = np.vstack([line.points for line in lines])
    low, size = every.min(axis=0), np.ptp(every, axis=0)
    around = MARGIN * float(size.max())
    places = places[((places >= low - around) & (places <= low + size + around)).all(axis=1)]
    if not len(places):
        return error
    target = folder / f"{drawing.stem}-place.png"
    try:
        _draw(lines, places, str(error), target)
    except (InputError, OSError):  # the folder is not there, or full
        return error
    return type(error)(f"{error}; the place is marked in '{target}'")


@contextmanager
def marking(file: Path, folder: Path, options: Mapping[str, object] | None = None) -> Iterator[None]:
    """Errors within name the picture of their places, if the drawing has them.

    Args:
        file: the drawing, or a scene of one.
        folder: for the picture.
        options: with which the drawing is read; None for those of the scene, or none.
    """
    try:
        yield
    except InputError as error:
        if not PLACE.search(str(error)):
            raise
        told = marked(error, *_drawing(file, options or {}), folder)
        if told is error:
            raise
        raise told from error


def load_marking(scene: Path, changes: Sequence[str], folder: Path) -> Scene:
    """A scene, as `bh.load_scene`; its errors name the picture of their places.

    Args:
        scene: its file.
        changes: KEY=VALUE.
        folder: for the picture.
    """
    from bh.scene.load import load_scene

    with marking(scene, folder):
        return load_scene(scene, changes)


def _drawing(file: Path, options: Mapping[str, object]) -> tuple[Path, Mapping[str, object]]:
    """The file itself, or the drawing that a scene is of, and how that is read."""
    if file.suffix.lower() != ".toml":
        return file, options
    try:
        table = read_toml(toml_bytes(file).decode()).get("pattern", {})
        if isinstance(table, dict) and isinstance(table.get("file"), str):
            return inside(file.parent, table["file"], "pattern.file"), table
    except (OSError, ValueError, SceneError):
        pass  # what is wrong with the scene has been said
    return file, options


def _draw(lines: Sequence[DrawnLine], places: NDArray[np.float64], words: str, target: Path) -> None:
    """The whole drawing on the left, what is around the first place on the right."""
    from textwrap import fill

    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 6.2), layout="constrained")
    whole, close = figure.subplots(1, 2)
    for axes, width, size in ((whole, 0.8, 16.0), (close, 1.6, 40.0)):
        for line in lines:
            axes.plot(*line.points.T, color=COLOURS.get(line.kind, "0.5"), linewidth=width)
        axes.plot(
            *places.T,
            "o",
            markersize=size,
            markerfacecolor="none",
            markeredgecolor="#cc79a7",
            markeredgewidth=2.5,
        )
        axes.set_aspect("equal")
        axes.set(xlabel="x, mm", ylabel="y, mm")
    every = np.vstack([line.points for line in lines])
    reach = NEAR * float(np.linalg.norm(np.ptp(every, axis=0)))
    x, y = places[0].tolist()
    close.set(xlim=(x - reach, x + reach), ylim=(y - reach, y + reach), title=f"near ({x:.6g}, {y:.6g})")
    figure.suptitle(fill(words, 120), fontsize=9)
    with replacing(target) as draft:
        figure.savefig(draft, format="png", dpi=110)
