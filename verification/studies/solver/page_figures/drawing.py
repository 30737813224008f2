"""A drawn sheet on several meshes, bars and hinges along rulings, a kirigami strip (docs/drawing.md)."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import bh
import meshes
from bh.mechanics.consistent.formulation import ConstantStrain
from meshes.io import read_pattern
from verification.framework.checks import CaseResult, Solved

EXAMPLES = Path(__file__).resolve().parents[4] / "examples"
BARS = "bars-and-hinges"
LENS = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="100mm" viewBox="0 0 100 100" fill="none">'
    '<rect width="100" height="100" stroke="black"/><path d="M0,50 C30,20 70,20 100,50" stroke="red"/>'
    '<path d="M0,50 C30,80 70,80 100,50" stroke="red"/></svg>'
)
KIRIGAMI = (
    ("shell", 2.0),
    ("consistent", 1.2),
    ("consistent", 0.8),
    (ConstantStrain.name, 1.2),
    (ConstantStrain.name, 0.8),
)


def drawings(result: CaseResult, quick: bool) -> None:
    """Energies of the waves on meshes of several kinds; energy and force of the pulled kirigami strip.

    Args:
        result: gets the checks.
        quick: with the coarsest meshes, without the kirigami strip.
    """
    pattern = read_pattern(EXAMPLES / "wave.svg")
    rows = meshes.structured(pattern, along=24, rows=2)
    wide = meshes.unstructured(pattern, size=10.0)
    near = wide if quick else meshes.unstructured(pattern, size=5.0)
    judge = _waves(result, "shell", wide, "gmsh, 10 mm", None)
    coarse = _waves(result, "consistent", near, "gmsh, 5 mm", judge)
    _waves(result, "consistent", rows, "staggered", judge)
    _waves(result, BARS, rows, "staggered", judge)
    _waves(result, BARS, near, "gmsh, 5 mm", judge)
    lines = bh.rulings.rulings(coarse[-1], spacing=5)
    _waves(result, BARS, meshes.ruled(pattern, lines, spacing=5), "along rulings", judge)
    _lens(result)
    slits = read_pattern(EXAMPLES / "kirigami.svg")
    for formulation, size in () if quick else KIRIGAMI:
        state, path = pulled(slits, formulation, size)
        force = float(state.reactions[state.mesh.nodes("edge:side-2"), 0].sum())
        params = {"formulation": formulation.split(":")[-1], "size": size}
        energy = state.energy.total
        result.check("energy of the pulled kirigami strip", energy, unit="N mm", params=params, path=path)
        result.check("force on the pulled kirigami strip", force, unit="N", params=params)


def _waves(
    result: CaseResult, formulation: str, mesh: meshes.SheetMesh, name: str, judge: bh.Path | None
) -> bh.Path:
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.2), formulation=formulation)
    path = bh.trace(model.fold("all", by=0.8, Lstar=25), estimate=False, neighbours=False).require()
    result.check(
        "energy of examples/wave.svg",
        path[-1].energy.total,
        unit="N mm",
        reference=None if judge is None else judge[-1].energy.total,
        source="the shell, gmsh, 10 mm",
        params={"formulation": formulation, "mesh": name},
        path=path,
    )
    return path


def _lens(result: CaseResult) -> None:
    """A square with two arcs between its sides: by gmsh, and with bars and hinges along its rulings too."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "lens.svg"
        file.write_text(LENS)
        pattern = read_pattern(file)
    mesh = meshes.unstructured(pattern, size=4.0)

    def folded(on: meshes.SheetMesh, formulation: str, name: str) -> bh.Path:
        model = bh.Model(on, bh.Sheet(E=4000.0, nu=0.0, t=0.2), formulation=formulation)
        path = bh.trace(model.fold("all", by=0.8, Lstar=25.0), estimate=False, neighbours=False).require()
        params = {"formulation": formulation, "mesh": name}
        result.check("energy of a lens", path[-1].energy.total, unit="N mm", params=params, path=path)
        return path

    judge = folded(mesh, "consistent", "gmsh")
    folded(mesh, BARS, "gmsh")
    folded(meshes.ruled(pattern, bh.rulings.rulings(judge[-1], 4.0), 4.0), BARS, "along rulings")


def pulled(pattern: meshes.CreasePattern, formulation: str, size: float) -> tuple[bh.State, Solved]:
    """The kirigami strip, pulled by 4 mm.

    Args:
        pattern: with its slits.
        formulation: name.
        size: of triangles, mm.
    """
    mesh = meshes.unstructured(pattern, size=size)
    model = bh.Model(mesh, bh.Sheet(E=4000, nu=0.3, t=0.2), formulation=formulation)
    model = model.support("edge:side-4", "xyz").support("edge:side-2", "yz")
    touch = bh.Force("near:25,2", each=(0.0, 0.0, 0.02))
    model = model.step(touch, bh.Displace("edge:side-2", "x", 0.0)).displace("edge:side-2", "x", 4.0)
    path = bh.trace(model).require()
    return path[-1], path
