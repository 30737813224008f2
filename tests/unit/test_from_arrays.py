"""`Model.from_arrays`: problems that other codes hand over as plain arrays."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh.formulations.registry import formulation
from bh.loading.builder import load_steps
from bh.mechanics.bars_and_hinges.system import BarsAndHingesSystem

# columns of cells; total, bending and folding energy (N mm) on which six independent codes agree (Green's strain)
PUBLISHED = {
    30: (3.270962320, 2.944622668, 0.322118961),
    60: (2.773577732, 2.524949397, 0.245239472),
}


def creased_annulus(columns: int) -> dict[str, Any]:
    """The array problem of the published energies, by its formulas alone: nothing here comes from the project.

    R0 = 100, half width 20 mm, 120 degrees, four rows of cells with diagonals mirrored at the crease, E = 4000 MPa,
    t = 0.27 mm, L* = 25 mm, stiffness by the source's Eq. 3.3, 3.4 (one aspect ratio for all cells), 3.11 and 3.12.
    """
    modulus, thickness, rows, across = 4000.0, 0.27, 4, 10.0
    angles = np.radians(150.0 - np.linspace(0.0, 120.0, columns + 1))
    points = [
        (r * math.cos(a), r * math.sin(a), 0.0) for r in (80.0, 90.0, 100.0, 110.0, 120.0) for a in angles
    ]
    n, triangles = columns + 1, []
    for row in range(rows):
        for a in range(row * n, row * n + columns):
            b, c, d = a + 1, a + n, a + n + 1
            triangles += [(a, b, d), (a, d, c)] if row < rows // 2 else [(a, b, c), (b, d, c)]
    xyz = np.array(points)
    wings: dict[tuple[int, int], list[tuple[int, float]]] = {}
    for corners in triangles:
        one, two = xyz[list(corners[1:])] - xyz[corners[0]]
        area = 0.5 * abs(one[0] * two[1] - one[1] * two[0])
        for k in range(3):
            edge = sorted((corners[k], corners[(k + 1) % 3]))
            wings.setdefault((edge[0], edge[1]), []).append((corners[(k + 2) % 3], area))
    alpha = across / (math.radians(120.0) * 100.0 / columns)
    arrays: dict[str, Any] = {
        key: [] for key in ("bars", "bar_stiffness", "bending_hinges", "bending_stiffness")
    } | {"folding_hinges": [], "folding_stiffness": [], "points": xyz, "triangles": triangles}
    for (a, b), sides in wings.items():
        length, area = float(np.linalg.norm(xyz[b] - xyz[a])), sum(side[1] for side in sides)
        diagonal = (b - a) not in (1, n)
        arrays["bars"].append((a, b))
        factor = 0.5 * alpha**2 + 1.25 if diagonal else 1.0
        arrays["bar_stiffness"].append(factor * modulus * thickness * area / length**2)
        if len(sides) == 1:
            continue
        kind = "folding" if b - a == 1 and a // n == rows // 2 else "bending"
        plate = modulus * thickness**3
        stiffness = plate / 6.0 * length**2 / area if kind == "bending" else plate / 12.0 / 25.0 * length
        arrays[f"{kind}_hinges"].append((a, b, sides[0][0], sides[1][0]))
        arrays[f"{kind}_stiffness"].append(stiffness)
    middle, start = columns // 2, 2 * n  # of the crease
    arrays["supports"] = [
        (start + middle, 1, 1, 1), (start, 0, 0, 1), (start + columns, 0, 0, 1), (4 * n + middle, 1, 0, 0),
    ]  # fmt: skip
    return arrays


@pytest.mark.parametrize("columns", PUBLISHED)
def test_published_energies(columns: int) -> None:
    """The creased annulus of the array problems from flat to a rest angle of 90 degrees."""
    model = bh.Model.from_arrays(**creased_annulus(columns), green=True)
    path = bh.trace(model.fold("fold", rest=0.5 * math.pi))
    assert path.outcome == "reached"
    assert path.iterations <= 30
    energy = path[-1].energy
    for value, published in zip(
        (energy.total, energy.bending, energy.folding), PUBLISHED[columns], strict=True
    ):
        assert value == pytest.approx(published, rel=2e-9)


def own_arrays() -> tuple[bh.Model, dict[str, Any]]:
    """A model of this project, and the same as arrays."""
    mesh = meshes.structured(meshes.annulus_sector(50.0, 8.0, 0.7), along=8)
    model = (
        bh.Model(mesh, bh.Sheet(E=4000.0, t=0.2), formulation="bars-and-hinges")
        .support("edge:start", "xyz")
        .support("edge:end", "z")
    )
    model = model.fold("crease", rest=2.0, Lstar=10.0)
    system = formulation(model.formulation).system(model, load_steps(model)[0], None)
    assert isinstance(system, BarsAndHingesSystem)
    elements = system.elements
    bend = slice(0, elements.bending)
    fold = slice(elements.bending, None)
    held = np.zeros((len(mesh.points), 4), dtype=int)
    held[:, 0] = np.arange(len(mesh.points))
    held[mesh.nodes("edge:start"), 1:] = 1
    held[mesh.nodes("edge:end"), 3] = 1
    rows = np.roll(elements.hinges, -1, axis=1)[:, [0, 1, 3, 2]]
    return model, {
        "points": mesh.points, "triangles": mesh.triangles, "bars": elements.bars,
        "bar_stiffness": elements.bar_stiffness, "bending_hinges": rows[bend],
        "bending_stiffness": elements.hinge_stiffness[bend], "folding_hinges": rows[fold],
        "folding_stiffness": elements.hinge_stiffness[fold], "supports": held,
    }  # fmt: skip


def test_the_same_sheet_as_arrays() -> None:
    model, arrays = own_arrays()
    path = bh.trace(model)
    other = bh.trace(bh.Model.from_arrays(**arrays).fold("fold", rest=2.0))
    for kind in ("stretching", "bending", "folding"):
        assert getattr(other[-1].energy, kind) == pytest.approx(getattr(path[-1].energy, kind), rel=1e-8)


def test_greens_strain_differs_by_the_square_of_the_strain() -> None:
    """Energies of the two bar laws differ by about the strain, which is small here, and are not equal."""
    _, arrays = own_arrays()
    plain, green = (
        bh.trace(bh.Model.from_arrays(**arrays, green=on).fold("fold", rest=2.0))[-1].energy.stretching
        for on in (False, True)
    )
    assert 0.0 < abs(green / plain - 1.0) < 1e-2


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"bars": lambda a: a["bars"][1:], "bar_stiffness": lambda a: a["bar_stiffness"][1:]}, "has no bar"),
        ({"bar_stiffness": lambda a: a["bar_stiffness"][1:]}, "do not fit"),
        ({"bar_stiffness": lambda a: -a["bar_stiffness"]}, "not negative"),
        ({"bending_stiffness": lambda a: a["bending_stiffness"] * math.nan}, "stiffness"),
        ({"folding_hinges": lambda a: a["folding_hinges"][[0] * len(a["folding_hinges"])]}, "twice"),
        ({"bending_hinges": lambda a: a["bending_hinges"] * 0 + [0, len(a["points"]) - 1, 0, 0]}, "not joined"),
        ({"triangles": lambda a: a["triangles"] + 1}, "outside"),
    ],
)  # fmt: skip
def test_arrays_that_do_not_fit(change: dict[str, Any], words: str) -> None:
    _, arrays = own_arrays()
    wrong = {**arrays, **{key: make(arrays) for key, make in change.items()}}
    with pytest.raises(bh.InputError, match=words) as refused:
        bh.Model.from_arrays(**wrong)
    assert "\n" not in str(refused.value)


def test_no_folding_hinges_make_no_crease() -> None:
    """An empty crease could be neither folded nor drawn."""
    _, arrays = own_arrays()
    hinges = np.vstack((arrays["bending_hinges"], arrays["folding_hinges"]))
    stiffness = np.concatenate((arrays["bending_stiffness"], arrays["folding_stiffness"]))
    bare = {
        "bending_hinges": hinges,
        "bending_stiffness": stiffness,
        "folding_hinges": [],
        "folding_stiffness": [],
    }
    model = bh.Model.from_arrays(**{**arrays, **bare})
    assert model.mesh.creases == ()
    assert not model.mesh.folds
