"""Sheets for the window: what a drawing, a pattern of the library or a model is when it is folded live."""

from __future__ import annotations

import json
import math
import os
import re
import tempfile
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from bh.errors import InputError
from bh.formulations.registry import remarks
from bh.model.actuations import Fold
from bh.model.crease_law import CreaseLaw
from bh.model.model import Model
from bh.model.sheet import Sheet
from bh.scene.folding import MATERIALS, PERCENT, Proposal, Wish, proposals
from bh.scene.load import Outputs, Scene, parse_scene
from bh.solvers.settling import Settling
from bh.studio.library import LIBRARY as LIBRARY
from meshes import SheetMesh
from meshes.pattern import FoldKind

LONGEST = 5_000_000  # bytes of a drawing
MOST_TRIANGLES = 8000  # of a sheet that is to answer at once
BARS, BENT = "bars-and-hinges", "consistent"
ODD = re.compile(r"[^\w .()+,=@~-]")
ALONG, ROWS = 24, 3  # cells of the library's patterns


@dataclass(frozen=True, eq=False)
class LiveSheet:
    """A sheet that can be put into the window.

    Attributes:
        name: of the file or the pattern.
        model: without steps.
        full: fold angle of every crease at 100 percent, rad.
        tables: pattern, mesh and model as TOML, for the scene that comes out again; empty for a model of one's own.
        remarks: one line each: what was assumed, and what to know of the sheet.
        drawing: name and bytes of the file that `tables` speak of; None for a pattern of the library.
        percent: of the way that is shown first.
        values: numbers of a pattern of the library that can be chosen, by key.
        drawn: what creases were drawn as that are folded otherwise, by name.
        settles: its springs move it downhill to rest where a branch ends, as in its scene.
    """

    name: str
    model: Model
    full: Mapping[str, float]
    tables: str
    remarks: tuple[str, ...] = ()
    drawing: tuple[str, bytes] | None = None
    percent: float = PERCENT
    settles: bool = False
    drawn: Mapping[str, FoldKind] = field(default_factory=dict)
    values: Mapping[str, float | Sequence[float]] = field(default_factory=dict)

    def of(self, sheet: Sheet) -> LiveSheet:
        """The same pattern of another material.

        Raises:
            InputError: it has wide creases, whose strips were made of the sheet that it is.
        """
        strips = self.model.mesh.wide_creases
        if strips:
            raise InputError(
                f"the strip of crease '{strips[0]}' was made for this sheet; give the material in the scene"
            )
        return replace(self, model=replace(self.model, sheet=sheet))

    def sprung(self, crease: str, Lstar: float | None) -> LiveSheet:
        """With a crease that is a spring, or one whose angle is imposed.

        Args:
            crease: its name, or "all".
            Lstar: length scale of its stiffness E t^3 / (12 Lstar), mm; None for an imposed angle.

        Raises:
            InputError: there is no such crease.
        """
        folded = [name for name, kind in self.model.mesh.folds.items() if kind != "flat"]
        if self.model.mesh.folds.get(crease) == "flat":
            raise InputError(f"crease '{crease}' is flat; make it a mountain or a valley first")
        if crease not in (*folded, "all"):
            raise InputError(f"there is no crease '{crease}'; choose one of {', '.join(folded)}, or all")
        names = folded if crease == "all" else [crease]
        laws = {name: law for name, law in self.model.creases.items() if name not in names}
        if Lstar is not None:
            laws.update({name: CreaseLaw(Lstar) for name in names})
        return replace(self, model=replace(self.model, creases=laws))

    def turned(self, crease: str, kind: FoldKind) -> LiveSheet:
        """With a crease that is folded the other way, or not at all; its new angle counts the way it is then drawn.

        One that was flat is a spring, as the others are, where the first of them is one.

        Args:
            crease: its name.
            kind: "mountain", "valley" or "flat".

        Raises:
            InputError: there is no such crease.
        """
        mesh = self.model.mesh
        if crease not in mesh.creases:
            raise InputError(f"there is no crease '{crease}'; choose one of {', '.join(mesh.creases)}")
        before = mesh.folds.get(crease, "flat")
        drawn = dict(self.drawn)
        was = drawn.pop(crease, before)
        if was != kind:
            drawn[crease] = was
        laws, full = dict(self.model.creases), dict(self.full)
        if kind == "flat":
            laws.pop(crease, None)
        elif before == "flat" and laws:
            laws[crease] = next(iter(laws.values()))
        full[crease] = full.get(crease) or math.pi
        mesh = replace(mesh, folds={**mesh.folds, crease: kind})
        return replace(self, model=replace(self.model, mesh=mesh, creases=laws), drawn=drawn, full=full)

    def sense(self, crease: str) -> float:
        """-1 where a crease is folded against the way that its file has it, which counts in a scene; else 1."""
        was, now = self.drawn.get(crease), self.model.mesh.folds.get(crease)
        return -1.0 if was is not None and was != now and (was, now) != ("flat", "mountain") else 1.0

    def stopping(self, on: bool) -> LiveSheet:
        """With panels that stop each other by their thickness, or pass through each other."""
        return replace(self, model=replace(self.model, contact="thickness" if on else False))

    def bent(self, nu: float) -> LiveSheet:
        """The same faces as panels that bend, in place of bars and hinges.

        Args:
            nu: Poisson's ratio, which bars and hinges do not know.
        """
        model = replace(self.model, formulation=BENT, sheet=replace(self.model.sheet, nu=nu))
        tables = self.tables.replace(f'formulation = "{BARS}"', f'formulation = "{BENT}"')
        return replace(self, model=model, tables=tables)


def of_library(
    name: str, material: str = "card", values: Mapping[str, float | Sequence[float]] | None = None
) -> LiveSheet:
    """A pattern of the library.

    Args:
        name: one of `LIBRARY`.
        material: one of `MATERIALS`.
        values: numbers in place of those of the library, mm and rad, by key; lists keep their length.

    Raises:
        InputError: there is no such pattern, key or material, or the pattern cannot be.
    """
    if name not in LIBRARY:
        raise InputError(f"there is no pattern '{name}'; choose one of {', '.join(LIBRARY)}")
    table = tomllib.loads(LIBRARY[name])
    known = parameters(name)
    for key, value in (values or {}).items():
        if key not in known:
            raise InputError(f"pattern '{name}' has no '{key}' to choose; it has {', '.join(known)}")
        old = known[key]
        if isinstance(old, list) != isinstance(value, Sequence) or (
            isinstance(old, list) and isinstance(value, Sequence) and len(old) != len(value)
        ):
            wanted = f"{len(old)} numbers" if isinstance(old, list) else "one number"
            raise InputError(f"'{key}' of pattern '{name}' takes {wanted}")
        table[key] = list(value) if isinstance(value, Sequence) else value
    text = "\n".join(f"{key} = {json.dumps(value)}" for key, value in table.items())
    tables = f'[pattern]\n{text}\n\n[mesh]\nkind = "staggered"\nalong = {ALONG}\nrows = {ROWS}\n'
    young, nu, t, _ = material_of(material)
    step = '[[steps]]\nfold = { crease = "all", by = 0.5 }\n'
    scene = parse_scene(f"{tables}\n[sheet]\nE = {young}\nnu = {nu}\nt = {t}\n\n{step}", name=name)
    return replace(live(name, scene, tables, ()), values={**known, **(values or {})})


def parameters(name: str) -> dict[str, float | list[float]]:
    """Numbers of a pattern of the library that can be chosen.

    Args:
        name: of the pattern.

    Returns:
        mm and rad, by key.
    """
    table = tomllib.loads(LIBRARY[name])
    return {key: value for key, value in table.items() if key not in ("kind", "fold")}


def of_file(name: str, data: bytes, material: str = "card") -> LiveSheet:
    """A drawing as it was dropped.

    Args:
        name: of the file; its suffix says what it is.
        data: its bytes.
        material: one of `MATERIALS`.

    Raises:
        InputError: it is too long, cannot be read, has no crease, or no mesh for the window can be made of it.
    """
    if len(data) > LONGEST:
        raise InputError(f"'{name}' is longer than {LONGEST // 10**6} MB; fold it by `bh fold`")
    plain = plain_name(name)
    material_of(material)
    if plain.lower().endswith(".toml"):  # it may name Python to be run, so that nobody but a command opens it
        raise InputError(f"'{plain}' is a scene: open it by `bh studio {plain}`")
    with tempfile.TemporaryDirectory(prefix="bh-studio-") as place:
        file = Path(place) / plain
        file.write_bytes(data)
        failed: InputError | None = None
        for offer in _proposals(file, Wish(material=material)):
            if offer.text.splitlines().count("[mesh]") == 0:
                continue  # a run to an accuracy is for `bh fold`
            try:
                scene = parse_scene(offer.text, file.parent, file.stem)
            except InputError as error:
                failed = failed or error
                continue
            if len(scene.model.mesh.triangles) > MOST_TRIANGLES:
                failed = failed or InputError(
                    f"'{plain}' has {len(scene.model.mesh.triangles)} triangles on the mesh of {offer.mesh}, "
                    f"the window takes {MOST_TRIANGLES}; fold it by `bh fold`"
                )
                continue
            tables = _tables(offer.text)
            return replace(live(plain, scene, tables, offer.assumed), drawing=(plain, data))
    raise failed or InputError(f"'{plain}': no mesh of it can be made; see `bh check`")


def _proposals(file: Path, wish: Wish) -> list[Proposal]:
    """`proposals`, whose refusals name the file and not the place where it lies meanwhile."""
    try:
        return proposals(file, wish)
    except InputError as error:
        raise InputError(str(error).replace(f"{file.parent}{os.sep}", "")) from error


def plain_name(name: str) -> str:
    """A file's name that means nothing in a path, in Python or in TOML: it stands in the files that come out.

    Args:
        name: as it was given.

    Returns:
        its letters, digits and some signs, other characters as "_"; at most a hundred.
    """
    last = ODD.sub("_", Path(name.replace("\\", "/")).name).strip(". ")
    stem, dot, suffix = last.rpartition(".")
    return f"{(stem or 'drawing')[:80]}{dot}{suffix[:19]}" if dot else (last[:80] or "drawing")


def of_model(model: Model, name: str = "model") -> LiveSheet:
    """A model of one's own; what comes out again is Python, since no scene may describe its mesh.

    Args:
        model: its steps are left out.
        name: to be shown.
    """
    return live(name, Scene(model, Outputs()), "", ())


def material_of(name: str) -> tuple[float, float, float, str]:
    """E (MPa), nu, t (mm) and a description.

    Raises:
        InputError: there is no such material.
    """
    if name not in MATERIALS:
        raise InputError(f"there is no material '{name}'; choose one of {', '.join(MATERIALS)}")
    return MATERIALS[name]


def live(name: str, scene: Scene, tables: str, assumed: tuple[str, ...]) -> LiveSheet:
    """The scene's model with the springs of its steps as crease laws, and how far each crease goes.

    Args:
        name: to be shown.
        scene: of the sheet.
        tables: that it comes out with.
        assumed: what to tell first, one line each.
    """
    model = scene.model
    laws = dict(model.creases)
    for step in model.steps:
        for item in step.actuations:
            if isinstance(item, Fold) and (item.Lstar is not None or item.stiffness is not None):
                names = model.mesh.creases if item.crease == "all" else (item.crease,)
                for crease in names:
                    if model.mesh.folds.get(crease) != "flat":
                        laws.setdefault(crease, CreaseLaw(item.Lstar, item.stiffness))
    model = replace(model, creases=laws, steps=())
    said = (*map(_strip_said, model.mesh.wide_creases), *(str(remark) for remark in remarks(model)))
    settles = isinstance(scene.strategy, Settling)
    return LiveSheet(name, model, _full(model.mesh), tables, (*assumed, *said), settles=settles)


def _strip_said(name: str) -> str:
    """A wide crease, told."""
    return f"crease '{name}' is a strip: its slider turns the angle at which it is at rest, mountain positive"


def _full(mesh: SheetMesh) -> dict[str, float]:
    """Mean drawn fold angle of every crease, rad; half a turn where none is drawn, or the sheet is drawn flat."""
    found = {}
    for name in mesh.creases:
        drawn = np.abs(np.asarray(mesh.fold_angles.get(name, [math.nan])))
        known = drawn[~np.isnan(drawn)]
        found[name] = float(known.mean()) if len(known) else math.pi
    if not any(found.values()):  # a file may give the angles of the flat sheet
        found = dict.fromkeys(found, math.pi)
    return {**found, **dict.fromkeys(mesh.wide_creases, math.pi)}


def _tables(text: str) -> str:
    """The tables of a scene that say what the sheet is: pattern, mesh and model."""
    kept, on = [], False
    for line in text.splitlines():
        if line.startswith("["):
            on = line.split("]")[0].strip("[") in ("pattern", "mesh", "model")
        if on:
            kept.append(line)
    return "\n".join(kept).strip() + "\n"


def quoted(text: str) -> str:
    """Text as TOML and Python write it."""
    return json.dumps(text)
