"""What leaves the window: the scene and its Python lines, the folded sheet, the flat pattern, and the numbers."""

from __future__ import annotations

import base64
import io
import json
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

import numpy as np

from bh.errors import InputError
from bh.live import Frame, Session
from bh.model.actuations import Pull
from bh.model.supports import Support
from bh.paths.export import FLAT, FOLDED, write_flat, write_state
from bh.studio.sheets import LiveSheet, quoted

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
        the name that the file should have, and its bytes. A scene of a drawing comes with it, as .zip.

    Raises:
        InputError: there is no such format, or the sheet has no scene.
    """
    stem = Path(sheet.name).stem or "sheet"
    if what == "scene":
        text = scene_text(sheet, session)
        if sheet.drawing is None:
            return f"{stem}.toml", text.encode()
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr(f"{stem}.toml", text)
            archive.writestr(*sheet.drawing)
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


def film(pictures: Sequence[str], ms: int) -> bytes:
    """A GIF of pictures.

    Args:
        pictures: JPEG or PNG in base64, of one size, at most `MOST_PIXELS` each.
        ms: between two of them.

    Raises:
        InputError: one is no picture, too large, or of another size.
    """
    from PIL import Image  # of matplotlib's own needs

    frames: list[Image.Image] = []
    for text in pictures:
        try:
            found = Image.open(io.BytesIO(base64.b64decode(text, validate=True)), formats=("PNG", "JPEG"))
            if found.width * found.height > MOST_PIXELS or (frames and found.size != frames[0].size):
                raise InputError(f"pictures of a film are of one size, at most {MOST_PIXELS:,} pixels")
            frames.append(found.convert("RGB").quantize(128))
        except (ValueError, OSError, Image.DecompressionBombError) as error:
            raise InputError("a picture of the film cannot be read; record it anew") from error
    out = io.BytesIO()
    frames[0].save(out, "GIF", save_all=True, append_images=frames[1:], duration=ms, loop=0)
    return out.getvalue()


def scene_text(sheet: LiveSheet, session: Session) -> str:
    """The scene that `bh run` repeats: the same mesh and supports, one step that folds and one that pulls.

    Args:
        sheet: what was opened.
        session: its handling.

    Raises:
        InputError: the sheet was given as a model, which no scene describes.
    """
    if not sheet.tables:
        raise InputError(
            "this sheet was given as a model of Python, which no scene describes; take the Python lines"
        )
    model = session.scene()
    lines = [f"# {sheet.name} as it stood in bh studio; run it by `bh run`. mm, N, rad.", "", sheet.tables]
    values = {item.name: getattr(model.sheet, item.name) for item in fields(model.sheet)}
    lines += ["[sheet]", *(f"{key} = {value!r}" for key, value in values.items() if value is not None), ""]
    for support in model.supports:
        assert isinstance(support, Support)
        at = support.at if isinstance(support.at, str) else list(support.at)
        fix = (
            support.fix if isinstance(support.fix, str) else [list(map(float, axis)) for axis in support.fix]
        )
        lines += ["[[supports]]", f"at = {json.dumps(at)}", f"fix = {json.dumps(fix)}", ""]
    for name, law in model.creases.items():
        value = f"Lstar = {law.Lstar!r}" if law.Lstar is not None else f"stiffness = {law.stiffness!r}"
        lines += [f"[creases.{quoted(name)}]", value, ""]
    folds = []
    for name, angle in session.wanted.folds.items():
        law_of = model.creases.get(name)
        spring = (
            "" if law_of is None
            else f", Lstar = {law_of.Lstar!r}" if law_of.Lstar is not None
            else f", stiffness = {law_of.stiffness!r}"
        )  # fmt: skip
        folds.append(f"  {{ crease = {quoted(name)}, by = {angle!r}{spring} }},")
    lines += ["[[steps]]", "fold = [", *folds, "]", ""]
    pulls = [item for step in model.steps for item in step.actuations if isinstance(item, Pull)]
    if pulls:
        rows = [f"  {{ node = {p.node}, to = {list(p.to)}, stiffness = {p.stiffness!r} }}," for p in pulls]
        lines += ["[[steps]]", "pull = [", *rows, "]", ""]
    return "\n".join([*lines, "[outputs]", "pictures = true", ""])


def python_text(sheet: LiveSheet, session: Session) -> str:
    """The same in Python: reads the scene and traces it.

    Args:
        sheet: what was opened.
        session: its handling.
    """
    stem = Path(sheet.name).stem or "sheet"
    folds = ", ".join(f"{quoted(name)}: {angle!r}" for name, angle in session.wanted.folds.items())
    begin = (
        f'scene = bh.load_scene("{stem}.toml")  # exported beside this file\nmodel = scene.model\n'
        if sheet.tables
        else "model = ...  # the model that was given to the window\n"
    )
    pulls = "".join(
        f"session.pull({node}, {grip.to!r}, {grip.stiffness!r})\n"
        for node, grip in session.wanted.grips.items()
    )
    return (
        f'"""{sheet.name} as it stood in bh studio."""\n\nimport bh\nfrom bh.live import Session\n\n{begin}'
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
