"""The scene of what is in the window, which `bh run` repeats: from flat, or from the state where that may miss it."""

from __future__ import annotations

import json
import math
import re
import tempfile
from dataclasses import fields
from pathlib import Path

from bh.errors import InputError
from bh.live import Session
from bh.live.controls import fold_of
from bh.model.hinge_laws import LAWS, HingeLaw
from bh.model.serialise import law_data
from bh.model.sheet import Sheet
from bh.model.supports import RigidBody, Support
from bh.paths.path import Path as Trace
from bh.paths.record import Record, StepOutcome
from bh.scene.load import parse_scene
from bh.scene.toml_text import key_of, written
from bh.solvers.outcome import Outcome
from bh.studio.sheets import LiveSheet

BALANCED = (
    1e-6  # of forces over the typical one of an element; a state with more is not saved as an equilibrium
)
NOTHING = ["force = { at = [0], each = [0.0, 0.0, 0.0] }"]  # of a step in which nothing acts
SETTLING = re.compile(r'^strategy = "settling".*\n', re.MULTILINE)


def scene_files(stem: str, sheet: LiveSheet, session: Session) -> dict[str, bytes]:
    """The scene and the files that it needs.

    A sheet that has kept to its branch is where a run from flat ends. Another one may lie elsewhere: its scene comes
    with the state as a path that was stopped after the first of two steps, from which `bh run SCENE --resume` goes on;
    the second step holds everything where it is, and solves it anew.

    Args:
        stem: name of the scene without its suffix.
        sheet: what was opened.
        session: its handling; of one that is not at rest the newest state is saved.

    Returns:
        bytes by name, the scene first.

    Raises:
        InputError: the sheet was given as a model, which no scene describes; or the state cannot be saved.
    """
    text = scene_text(sheet, session)
    files = {f"{stem}.toml": text.encode()}
    if sheet.drawing is not None:
        files[sheet.drawing[0]] = sheet.drawing[1]
    if session.left:
        files[f"{stem}-out/path.bh"] = _begun(stem, text, sheet, session)
    return files


def scene_text(sheet: LiveSheet, session: Session) -> str:
    """The scene that `bh run` repeats: the same mesh and supports, one step that folds and one that pulls.

    Where that may end elsewhere both are one step, and the same once more, as `scene_files` says.

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
    stem = Path(sheet.name).stem or "sheet"
    lines = [f"# {sheet.name} as it stood in bh studio; mm, N, rad."]
    lines += (
        [
            "# A run from flat may end elsewhere, as by way of a snap. The state is kept beside:",
            f"#     bh run {stem}.toml --resume",
            "# begins there, and its second step solves it anew. `bh run --force` begins flat.",
        ]
        if session.left
        else ["# `bh run` ends in it: it was reached along one branch, without a snap."]
    )
    passing = [
        "contact = false                  # as in the window, where panels pass through each other",
    ]
    stopping = ["contact = " + json.dumps(session.model.contact)]
    lines += ["", *(stopping if session.model.stops_itself else passing), ""]
    lines += [SETTLING.sub("", sheet.tables)]  # a window keeps to its branch while there is one
    lines += [*_sheet_lines(session), *_support_lines(session), *_crease_lines(session)]
    folds, pulls = _fold_lines(sheet, session), _pull_lines(session)
    if session.left:
        held = _pull_lines(session, still=True)
        lines += ["[[steps]]", *(folds + pulls or NOTHING), "", "[[steps]]", *(folds + held or NOTHING), ""]
    else:
        for step in [each for each in (folds, pulls) if each] or [NOTHING]:
            lines += ["[[steps]]", *step, ""]
    return "\n".join([*lines, "[outputs]", "pictures = true", ""])


def _sheet_lines(session: Session) -> list[str]:
    values = _sheet_values(session.model.sheet)
    return ["[sheet]", *(f"{key} = {written(value)}" for key, value in values.items()), ""]


def _sheet_values(sheet: Sheet) -> dict[str, object]:
    """Values by key; of a laminate its plies alone, which all of them come from."""
    if sheet.plies is not None:
        return {"plies": [_sheet_values(ply) for ply in sheet.plies]}
    values = {item.name: getattr(sheet, item.name) for item in fields(sheet)}
    return {key: value for key, value in values.items() if value is not None}


def _support_lines(session: Session) -> list[str]:
    lines = []
    for support in session.model.supports:
        if isinstance(support, RigidBody):
            lines += ["[[supports]]", 'at = "rigid-body"', ""]
            continue
        if not isinstance(support, Support):
            raise InputError(
                f"{type(support).__name__} is a support of your own, which the window cannot write; take its scene"
            )
        at = support.at if isinstance(support.at, str) else list(support.at)
        fix = (
            support.fix if isinstance(support.fix, str) else [list(map(float, axis)) for axis in support.fix]
        )
        clamp = ["clamp = true"] if support.clamp else []
        lines += ["[[supports]]", f"at = {json.dumps(at)}", f"fix = {json.dumps(fix)}", *clamp, ""]
    return lines


def _stiffness(session: Session, crease: str) -> str:
    """The key of a crease that is a spring; an empty string where its angle is imposed, or its law has a stiffness."""
    law = session.model.creases.get(crease)
    if law is None or (law.Lstar is None and law.stiffness is None):
        return ""
    return f"Lstar = {law.Lstar!r}" if law.Lstar is not None else f"stiffness = {law.stiffness!r}"


def _crease_lines(session: Session) -> list[str]:
    lines = []
    for name, law in session.model.creases.items():
        lines += [f"[creases.{key_of(name)}]", _stiffness(session, name)]
        lines += [f"rest = {law.rest!r}"] if law.rest != math.pi else []
        lines += [f"law = {written(_law_values(name, law.law))}", ""] if law.law is not None else [""]
    return lines


def _law_values(crease: str, law: HingeLaw) -> dict[str, object]:
    """The table of a law that is no straight line."""
    if type(law) not in LAWS.values():
        raise InputError(
            f"the law of crease '{crease}' is one of your own, which the window cannot write; take the scene it is from"
        )
    return law_data(law)


def _fold_lines(sheet: LiveSheet, session: Session) -> list[str]:
    rows = []
    for name, angle in session.controls.folds.items():
        rest = fold_of(session.model, name, angle).rest
        if rest is not None:
            rows.append(f"  {{ crease = {written(name)}, rest = {rest!r} }},")
            continue
        angle = sheet.sense(name) * angle + 0.0  # without -0.0
        spring = _stiffness(session, name)
        rows.append(f"  {{ crease = {written(name)}, by = {angle!r}{', ' if spring else ''}{spring} }},")
    return ["fold = [", *rows, "]"] if rows else []


def _pull_lines(session: Session, still: bool = False) -> list[str]:
    """What pulls, from where its node is, or all the step long at its end: `still`."""
    rows = [
        f"  {{ node = {node}, to = {list(grip.to)}, stiffness = {grip.stiffness!r}"
        f"{f', start = {list(grip.to)}' if still else ''} }},"
        for node, grip in session.controls.grips.items()
    ]
    return ["pull = [", *rows, "]"] if rows else []


def _begun(stem: str, text: str, sheet: LiveSheet, session: Session) -> bytes:
    """The path file of the scene, as of a run that was stopped when its first step had ended in the state.

    Raises:
        InputError: the state is no equilibrium of the scene.
    """
    with tempfile.TemporaryDirectory(prefix="bh-studio-") as place:
        folder = Path(place)
        if sheet.drawing is not None:
            (folder / sheet.drawing[0]).write_bytes(sheet.drawing[1])
        path = Trace(parse_scene(text, folder, stem).model)
        system, here = path.system(0), session.newest
        flat = system.start()
        off = system.evaluate(here.q, 1.0).imbalance if here.q.shape == flat.shape else float("inf")
        if not off <= BALANCED:
            raise InputError(
                f"the state cannot be saved (forces out of balance by {off:.1g}); let go, and save it again"
            )
        path.records = [
            Record(0, 0.0, flat, 0, system.evaluate(flat, 0.0).imbalance, 0.0, 1.0),
            Record(0, 1.0, here.q, 0, off, 0.0, 1.0, negative=here.negative, note="snapped", jumped=True),
        ]
        path.steps = [StepOutcome(Outcome.REACHED)]
        path.save(folder / "path.bh")
        return (folder / "path.bh").read_bytes()
