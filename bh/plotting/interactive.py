"""Folded sheets to turn with the mouse in a browser or a notebook: all states, one beside another, without a network.

    bh.interactive.view(path)                                   # in a notebook: shows itself
    bh.interactive.view({"bars": path, "shell": other}).save("sheets.html")

What is drawn are *frames*: plain JSON data with the shapes and energy densities of one model or of several at the
same values of lambda. The report embeds the same data and the same script (`viewer/viewer.js`, on plotly.js).
"""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from bh.plotting.camera import best_view, viewing_axes
from bh.plotting.offscreen import PlotError
from bh.plotting.panels import cut_open
from meshes.io.export import replacing

if TYPE_CHECKING:
    from bh.formulations.state import State
    from bh.paths.path import Path

KINDS = ("stretching", "bending", "folding")
BRIGHT = 99.0  # percentile of energy density where colours end; a few hot corners would leave the rest dark
FORMAT = 1
FOLDER = FilePath(__file__).with_name("viewer")


class ModelFrames(TypedDict):
    """One model in all frames; arrays are little-endian float32 or int32 in base64.

    Attributes:
        name: of the model.
        nodes: (m,) of the points that are corners of the sheet cut open along its creases.
        triangles: (t, 3) of those corners.
        outline: (k, 2) pairs of nodes along boundary and creases.
        points: (f, n, 3), mm.
        density: by kind (f, n), N mm / mm^2.
        energy: by kind, one a frame, N mm.
    """

    name: str
    nodes: str
    triangles: str
    outline: str
    points: str
    density: dict[str, str]
    energy: dict[str, list[float]]


class Frames(TypedDict):
    """What the viewer draws.

    Attributes:
        format: of this data.
        label: the name of what the slider reads.
        lambdas: what it reads, one a frame.
        tops: by kind the energy density where colours end, N mm / mm^2.
        eye: [x, y, z] that the sheets are looked at from.
        models: side by side.
    """

    format: int
    label: str
    lambdas: list[float]
    tops: dict[str, float]
    eye: list[float]
    models: list[ModelFrames]


def frames(
    models: Mapping[str, Sequence[State]],
    lambdas: Sequence[float],
    label: str = "\N{GREEK SMALL LETTER LAMDA}",
) -> Frames:
    """The states of one or several models as JSON data that the viewer draws.

    Args:
        models: by name, as many states each as there are `lambdas`, in their order and of one mesh a model.
        lambdas: what the slider reads.
        label: the name of what the slider reads.

    Returns:
        The frames, as plain JSON data.

    Raises:
        PlotError: no models, no states, or not as many states as lambdas.
    """
    if not models or not lambdas:
        raise PlotError("there are no states to show; trace the model first")
    for name, states in models.items():
        if len(states) != len(lambdas):
            raise PlotError(
                f"'{name}' has {len(states)} states for {len(lambdas)} lambdas; give one for each"
            )
    last = [states[-1] for states in models.values()]
    kinds = [k for k in KINDS if any(float(np.max(s.energy_density[k], initial=0.0)) > 0.0 for s in last)]
    return {
        "format": FORMAT,
        "label": label,
        "lambdas": [float(value) for value in lambdas],
        "tops": {
            kind: float(np.percentile(np.concatenate([s.nodal_energy_density(kind) for s in last]), BRIGHT))
            for kind in kinds
        },
        "eye": viewing_axes(*best_view(last[0], 4.0 / 3.0))[2].tolist(),
        "models": [_model(name, states, kinds) for name, states in models.items()],
    }


def _model(name: str, states: Sequence[State], kinds: Sequence[str]) -> ModelFrames:
    mesh = states[0].mesh
    nodes, triangles = cut_open(mesh)
    creases = [mesh.crease_edges(crease) for crease in mesh.creases]
    return {
        "name": name,
        "nodes": packed(nodes, "<i4"),
        "triangles": packed(triangles, "<i4"),
        "outline": packed(np.vstack((mesh.topology.boundary, *creases)), "<i4"),
        "points": packed(np.stack([state.points for state in states]), "<f4"),
        "density": {
            kind: packed(np.stack([state.nodal_energy_density(kind) for state in states]), "<f4")
            for kind in kinds
        },
        "energy": {kind: [float(getattr(s.energy, kind)) for s in states] for kind in (*kinds, "total")},
    }


def packed(values: ArrayLike, kind: str) -> str:
    """An array as base64 text of its values in C order; `kind` is "<f4" or "<i4".

    Args:
        values: of any shape.
        kind: "<f4" or "<i4".
    """
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


@dataclass(frozen=True, repr=False)
class View:
    """Frames that show themselves in a notebook, or as a page of their own.

    Attributes:
        data: what is drawn, see `frames`.
        title: of the page.
        height: of the frame in a notebook, CSS pixels.
    """

    data: Frames
    title: str = "Folded sheet"
    height: int = 520  # of the frame in a notebook, CSS pixels

    def __repr__(self) -> str:
        """One line: "View(2 models, 9 frames)"."""
        return f"View({len(self.data['models'])} models, {len(self.data['lambdas'])} frames)"

    def html(self) -> str:
        """A whole page with all that it needs in it (5 MB, most of which is plotly.js)."""
        return (
            '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            f"<title>{escape(self.title)}</title><style>{style()}</style></head><body>"
            f"{figure(self.data, 'sheet', self.title)}"
            f"<script>{library()}</script><script>{script()}</script></body></html>\n"
        )

    def save(self, file: str | FilePath) -> FilePath:
        """Write the page; returns its absolute path.

        Raises:
            FileFormatError: the file cannot be written.
        """
        target = FilePath(file)
        with replacing(target) as temporary:
            temporary.write_text(self.html(), encoding="utf-8")
        return target.resolve()

    def _repr_html_(self) -> str:
        # a frame of its own keeps the script and the style of the notebook apart
        return (
            f'<iframe title="{escape(self.title)}" srcdoc="{escape(self.html())}" '
            f'style="width:100%;height:{self.height}px;border:0"></iframe>'
        )


def view(paths: Path | Mapping[str, Path], title: str = "Folded sheet") -> View:
    """All states of a path to turn with the mouse, or of several paths side by side.

    Args:
        paths: a path; or paths by name, of which the states at every step + lambda that all of them have are
            shown.
        title: of the page.

    Raises:
        PlotError: a path has no states, the paths have none in common, or plotly is not installed.
    """
    library()
    named = paths if isinstance(paths, Mapping) else {paths.model.formulation: paths}
    found = [{round(float(at), 9) for at in path.lambdas} for path in named.values()]
    common = sorted(set.intersection(*found)) if found else []
    if not common:
        raise PlotError(
            "the paths have no states at the same lambda; trace them in steps of the same lengths"
        )
    states = {}
    for name, path in named.items():
        where = {round(float(at), 9): index for index, at in enumerate(path.lambdas)}
        states[name] = [path[where[at]] for at in common]
    return View(frames(states, common, "step + \N{GREEK SMALL LETTER LAMDA}"), title)


# --- what a page is made of ------------------------------------------------------------------------------------


def figure(data: Frames, name: str, title: str, still: str = "") -> str:
    """The HTML of a viewer with its data; `name` begins its ids, `still` is shown until it draws (an <img>).

    Args:
        data: see `frames`.
        name: begins the ids of its elements; each once a page.
        title: for readers who do not see it.
        still: HTML shown until it draws (an <img>).
    """
    name = re.sub(r"[^\w-]", "-", name)  # from files of results
    kinds = [*data["tops"], *(["total"] if len(data["tops"]) > 1 else [])]
    shown = "bending" if "bending" in kinds else (kinds or ["none"])[0]
    options = "".join(
        f'<option value="{escape(kind)}"{" selected" if kind == shown else ""}>{escape(kind)}</option>'
        for kind in kinds
    )
    last, label = len(data["lambdas"]) - 1, escape(data["label"])
    text = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    return (
        f'<div class="sheet3d" id="{name}" role="group" aria-label="{escape(title)}">'
        f'<div class="still">{still}</div><div class="canvas" id="{name}-canvas" role="img" '
        f'aria-label="{escape(title)}, to be turned with the mouse"></div>'
        f'<div class="controls" hidden><label for="{name}-slider">{label}</label>'
        f'<input type="range" id="{name}-slider" min="0" max="{last}" step="1" value="{last}">'
        f'<output for="{name}-slider" id="{name}-value"></output>'
        f'<button type="button" id="{name}-play">Play</button>'
        f'<label for="{name}-kind">colour</label><select id="{name}-kind">{options}</select></div>'
        f'<p class="energies" id="{name}-energies" aria-live="off"></p>'
        f'<script type="application/json" class="frames">{text}</script></div>'
    )


@cache
def script() -> str:
    """The viewer's own script."""
    return (FOLDER / "viewer.js").read_text(encoding="utf-8")


@cache
def style() -> str:
    """The viewer's style sheet; on a page of its own it stands alone."""
    return (FOLDER / "viewer.css").read_text(encoding="utf-8")


@cache
def library() -> str:
    """plotly.js as the package of that name brings it.

    Raises:
        PlotError: plotly is not installed.
    """
    from importlib.util import find_spec

    found = find_spec("plotly")
    if found is None or found.origin is None:
        raise PlotError("sheets to turn in a browser need plotly; pip install plotly")
    return (FilePath(found.origin).parent / "package_data" / "plotly.min.js").read_text(encoding="utf-8")
