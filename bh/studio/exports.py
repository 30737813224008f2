"""What leaves the window: the scene and its Python lines, the folded sheet, the flat pattern, and the numbers."""

from __future__ import annotations

import base64
import importlib
import io
import json
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bh.errors import InputError
from bh.live import Frame, Session
from bh.paths.export import FLAT, FOLDED, write_flat, write_state
from bh.studio.scenes import scene_files
from bh.studio.sheets import LiveSheet, quoted

if TYPE_CHECKING:
    from PIL import Image

MOST_PIXELS = 1_000_000  # of a picture of a film
FORMATS = (
    "scene",
    "python",
    "result",
    *(f"folded{each}" for each in FOLDED),
    *(f"flat{each}" for each in FLAT),
)


def export(what: str, sheet: LiveSheet, session: Session, frame: Frame) -> tuple[str, bytes]:
    """One file of what is in the window.

    Args:
        what: one of `FORMATS`.
        sheet: what was opened.
        session: its handling.
        frame: the newest state.

    Returns:
        the name that the file should have, and its bytes. A scene of a drawing comes with it, as .zip; one that a run
        from flat may miss with the state, too.

    Raises:
        InputError: there is no such format, or the sheet has no scene.
    """
    stem = Path(sheet.name).stem or "sheet"
    if what == "scene":
        files = scene_files(stem, sheet, session)
        if len(files) == 1:
            return f"{stem}.toml", files[f"{stem}.toml"]
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in files.items():
                archive.writestr(name, data)
        return f"{stem}.zip", packed.getvalue()
    if what == "python":
        return f"{stem}.py", python_text(sheet, session).encode()
    if what == "result":
        return f"{stem}.json", (json.dumps(result(frame), indent=2) + "\n").encode()
    kind, dot, suffix = what.partition(".")
    with tempfile.TemporaryDirectory(prefix="bh-studio-") as place:
        file = Path(place) / f"{stem}{dot}{suffix}"
        if kind == "folded" and dot + suffix in FOLDED:
            write_state(file, [frame.state], stem)
        elif kind == "flat" and dot + suffix in FLAT:
            write_flat(file, session.mesh)
        else:
            raise InputError(f"there is no format '{what}'; choose one of {', '.join(FORMATS)}")
        return f"{stem}-{kind}{dot}{suffix}", file.read_bytes()


def beside(what: str, name: str, session: Session, frame: Frame) -> list[str]:
    """What to know of a file that a run repeats: that the sheet is not where it is asked to be, or another branch.

    Args:
        what: one of `FORMATS`.
        name: of the file.
        session: the handling of the sheet.
        frame: the newest state.

    Returns:
        one line; none where there is nothing to know.
    """
    if what not in ("scene", "python") or not (session.left or not frame.at_rest):
        return []
    stem = Path(name).stem
    how = (
        f"`bh run {stem}.toml --resume` begins in the state that is saved with it"
        if what == "scene"
        else "the lines begin flat and may end elsewhere; the scene has the state"
    )
    why = "a run from flat may end elsewhere, as by way of a snap"
    if not frame.at_rest:
        why = f"the sheet {f'cannot go on ({frame.note})' if frame.note else 'is on its way'}: it is saved as it lies"
    return [f"{name} is saved; {why}: {how}"]


def film(pictures: Sequence[str], ms: int) -> bytes:
    """A GIF of pictures.

    Args:
        pictures: JPEG or PNG in base64, of one size, at most `MOST_PIXELS` each.
        ms: between two of them.

    Raises:
        InputError: one is no picture, too large, or of another size.
    """
    frames = [picture.quantize(128) for picture in _decoded(pictures)]
    out = io.BytesIO()
    frames[0].save(out, "GIF", save_all=True, append_images=frames[1:], duration=ms, loop=0)
    return out.getvalue()


def moving(pictures: Sequence[str], ms: int) -> bytes:
    """An MP4 (H.264) of pictures, by the ffmpeg that comes with imageio-ffmpeg.

    Args:
        pictures: as of `film`.
        ms: between two of them.

    Raises:
        InputError: as of `film`, or imageio-ffmpeg is not installed.
    """
    try:
        ffmpeg = importlib.import_module("imageio_ffmpeg")
    except ImportError as error:
        raise InputError(
            "an MP4 needs imageio-ffmpeg: `pip install imageio-ffmpeg`; or save the GIF"
        ) from error
    frames = _decoded(pictures)
    with tempfile.TemporaryDirectory(prefix="bh-studio-") as place:
        file = Path(place) / "film.mp4"
        writer = ffmpeg.write_frames(str(file), frames[0].size, fps=1000.0 / ms)
        writer.send(None)  # it starts there
        for frame in frames:
            writer.send(frame.tobytes())
        writer.close()
        return file.read_bytes()


def _decoded(pictures: Sequence[str]) -> list[Image.Image]:
    """Pictures in RGB, of one size."""
    from PIL import Image  # of matplotlib's own needs

    frames: list[Image.Image] = []
    for text in pictures:
        try:
            found = Image.open(io.BytesIO(base64.b64decode(text, validate=True)), formats=("PNG", "JPEG"))
            if found.width * found.height > MOST_PIXELS or (frames and found.size != frames[0].size):
                raise InputError(f"pictures of a film are of one size, at most {MOST_PIXELS:,} pixels")
            frames.append(found.convert("RGB"))
        except (ValueError, OSError, Image.DecompressionBombError) as error:
            raise InputError("a picture of the film cannot be read; record it anew") from error
    return frames


def python_text(sheet: LiveSheet, session: Session) -> str:
    """The same in Python: reads the scene and traces it.

    Args:
        sheet: what was opened.
        session: its handling.
    """
    stem = Path(sheet.name).stem or "sheet"
    folds = ", ".join(f"{quoted(name)}: {angle!r}" for name, angle in session.controls.folds.items())
    begin = (
        f'scene = bh.load_scene("{stem}.toml")  # exported beside this file\nmodel = scene.model\n'
        if sheet.tables
        else "model = ...  # the model that was given to the window\n"
    )
    first = ""
    turned = {name: session.mesh.folds[name] for name in sheet.drawn} if sheet.tables else {}
    if turned:
        first = "from dataclasses import replace\n\n"
        kinds = ", ".join(f"{quoted(name)}: {quoted(kind)}" for name, kind in turned.items())
        begin += (
            f"folds = {{**model.mesh.folds, {kinds}}}  # other kinds of creases than in the drawing\n"
            "model = replace(model, mesh=replace(model.mesh, folds=folds))\n"
        )
    pulls = "".join(
        f"session.pull({node}, {grip.to!r}, {grip.stiffness!r})\n"
        for node, grip in session.controls.grips.items()
    )
    said = (
        " These lines begin flat and may end elsewhere, as by way of a snap; the scene has the state."
        * session.left
    )
    return (
        f'"""{sheet.name} as it stood in bh studio.{said}"""\n\n'
        f"{first}import bh\nfrom bh.live import Session\n\n{begin}"
        f"session = Session(model)\nfor crease, angle in {{{folds}}}.items():\n    session.fold(crease, angle)\n"
        f"{pulls}frame = session.rest()\nprint(frame.state, frame.fold_angles(), frame.forces)\n"
    )


def result(frame: Frame) -> dict[str, object]:
    """Numbers of a frame as JSON holds them.

    Args:
        frame: the newest state.

    Returns:
        energies, N mm, fold angles, rad, forces, N, points, mm, and what is known of the state.
    """
    state = frame.state
    return {
        "energy": state.energy.as_dict(),
        "fold_angles": frame.fold_angles(),
        "asked": dict(frame.wanted.folds),
        "forces": {str(node): list(force) for node, force in frame.forces.items()},
        "at_rest": frame.at_rest,
        "stable": state.stable,
        "note": frame.note,
        "largest_strain": float(np.abs(state.strain).max()),
        "points": state.points.tolist(),
    }
