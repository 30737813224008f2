"""Meshes that the program chooses: any sheet has one, cells are halved and doubled, and what was taken is said."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import bh
import meshes
from bh.paths.path import Path as Solved
from bh.solving.mesh_choice import Ladder
from meshes.cells import GmshCells, RuledCells
from meshes.choices import choices, cut, first_mesh
from meshes.curved import lift
from meshes.io import read_pattern

EXAMPLES = Path(__file__).parents[2] / "examples"
SHEET = bh.Sheet(E=4000.0, nu=0.3, t=0.2)
SECTOR = meshes.annulus_sector(100.0, 10.0, 0.4)

# the sheets whose first mesh of the shell was turned inside out, the patterns of the library, a drawing
SHEETS: dict[str, Callable[[], meshes.CreasePattern]] = {
    "strip": lambda: meshes.strip(80.0, 30.0, [12.0]),
    "sector, narrow": lambda: SECTOR,
    "sector, wide": lambda: meshes.annulus_sector(150.0, 60.0, 0.9),
    "sector, wide and small": lambda: meshes.annulus_sector(80.0, 40.0, 1.0),
    "sector of bh init": lambda: meshes.annulus_sector(
        [60.0, 75.0, 90.0], 15.0, 1.2, ["mountain", "valley", "mountain"]
    ),
    "ring": lambda: meshes.full_annulus(40.0, 20.0),
    "parallel": lambda: meshes.parallel_creases(0.005, 100.0, 5.0, 2),
    "two arcs": meshes.two_arcs,
    "sines": lambda: meshes.sine_tessellation(100.0, 100.0, 2, 12.0, 2.0),
    "canopy": lambda: meshes.parabolic_canopy(creases=1, sag=30.0),
    "opposite parabolas": meshes.opposite_parabolas,
    **{kind: lambda kind=kind: meshes.corrugation(kind) for kind in meshes.corrugations.KINDS},  # type: ignore[misc]
    "wave.svg": lambda: read_pattern(EXAMPLES / "wave.svg"),
}
FAST = ("sector, narrow", "sector, wide", "sector, wide and small", "canopy", "parabolic-edge", "wave.svg")


def folded(pattern: meshes.CreasePattern) -> bh.Model:
    return bh.Model(first_mesh(pattern), SHEET).fold("all", by=0.5, Lstar=25.0)


# --- cells ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SHEETS)
def test_every_pattern_has_a_mesh_to_begin_with(name: str) -> None:
    """Of the consistent formulation and, but for creases that leave their curve, of the shell: and it is refined."""
    pattern = SHEETS[name]()
    first_mesh(pattern)
    for kind, level in (("staggered", 1.0), ("mirrored", 0.5)):
        tried = []
        for cells in choices(pattern, kind, level):  # type: ignore[arg-type]
            tried.append(cells)
            try:
                mesh = cut(pattern, cells)
                if kind == "mirrored" and name != "elliptical-point":
                    lift(mesh)
            except meshes.MeshError:
                continue
            assert mesh.cells == cells
            finer = cut(pattern, cells.refined())
            # some triangles are lost or won at the tips of tapered panels
            assert len(finer.triangles) == pytest.approx(4 * len(mesh.triangles), rel=0.35)
            break
        else:
            pytest.fail(f"{name}: none of {len(tried)} choices can be made")


def test_cells_are_halved_and_doubled() -> None:
    cells = RuledCells("staggered", 12, 4)
    assert cells.refined() == RuledCells("staggered", 24, 8)
    assert cells.refined().coarsened() == cells
    assert RuledCells("staggered", 12, 3).coarsened() == RuledCells("staggered", 4, 1)
    assert RuledCells("staggered", 12, 1).coarsened() is None
    graded = GmshCells(8.0, {"crease:crease": 2.0})
    assert graded.refined() == GmshCells(4.0, {"crease:crease": 1.0})
    assert graded.refined().coarsened() == graded


def test_meshes_remember_their_cells() -> None:
    """Until they are changed by hand."""
    mesh = meshes.structured(SECTOR, along=8, rows=2, kind="mirrored")
    assert mesh.cells == RuledCells("mirrored", 8, 2)
    assert meshes.structured(SECTOR, aspect_ratio=2.0).cells == RuledCells("staggered", 8, 1)
    assert meshes.unstructured(SECTOR, size=5.0, growth=0.2).cells == GmshCells(5.0, {}, 0.2)
    assert meshes.SheetMesh(mesh.points, mesh.triangles).cells is None


def test_wide_panels_follow_their_curves() -> None:
    """Cells as wide as high would have one edge for 77 degrees of a wide sector."""
    wide = next(choices(meshes.annulus_sector(60.0, 55.0, 1.35), "staggered", 1.0))
    assert isinstance(wide, RuledCells)
    assert wide.along == math.ceil(1.35 / 0.4)


# --- the ladder ---------------------------------------------------------------------------------------------------


def test_what_was_taken_is_noted() -> None:
    """The first choice that can be solved on; all later meshes are its cells, halved."""
    seen = []

    def solve(mesh: meshes.SheetMesh, cells: object) -> Solved:
        seen.append(str(cells))
        if len(seen) < 3:
            raise meshes.MeshError("triangle 2 is turned inside out; use a finer mesh there")
        return bh.trace(bh.Model(mesh, SHEET).fold("crease", by=0.1))

    ladder = Ladder(SECTOR, "mirrored", 1.0)
    path, cells = ladder.solve(0, solve)
    assert seen == ["4 x 1 mirrored cells", "8 x 1 mirrored cells", "16 x 1 mirrored cells"]
    assert (path.outcome, str(cells)) == ("reached", seen[-1])
    assert ladder.notes == [
        "the mesh to begin with could not be made (triangle 2 is turned inside out); took 16 x 1 mirrored cells"
    ]
    assert str(ladder.solve(2, solve)[1]) == "64 x 4 mirrored cells"


def test_where_nothing_can_be_made_the_first_reason_is_told() -> None:
    def solve(mesh: meshes.SheetMesh, cells: object) -> Solved:
        raise meshes.MeshError(f"not {len(mesh.triangles)}")

    with pytest.raises(meshes.MeshError, match="not 16"):
        Ladder(SECTOR, "mirrored", 1.0).solve(0, solve)


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=() if n in FAST else pytest.mark.slow) for n in SHEETS]
)
def test_every_sheet_is_solved_to_an_accuracy(name: str) -> None:
    """Nothing is chosen but a coarse accuracy of 10 %."""
    path = bh.trace(folded(SHEETS[name]()), accuracy=0.1)
    told = path.accuracy
    assert told is not None
    assert path.outcome == "reached"
    assert told.met
    assert told.estimate <= 0.1
    assert np.isfinite(path[-1].points).all()


@pytest.mark.parametrize(
    ("name", "why"), [("wave.svg", "turned inside out"), ("parabolic-edge", "have no 'mirrored' mesh")]
)
def test_the_shell_begins_on_a_mesh_that_can_be_made(name: str, why: str) -> None:
    """Curved edges turn triangles of its first mesh inside out, or there is none of that kind; the next is taken."""
    pattern = SHEETS[name]()

    def solve(mesh: meshes.SheetMesh, cells: object) -> Solved:
        return bh.trace(bh.Model(mesh, SHEET, formulation="shell").fold("all", by=0.1, Lstar=25.0))

    ladder = Ladder(pattern, "mirrored", 0.5)
    path, cells = ladder.solve(0, solve)
    assert path.outcome == "reached"
    assert why in ladder.notes[0]
    assert ladder.notes[0].endswith(f"took {cells}")
