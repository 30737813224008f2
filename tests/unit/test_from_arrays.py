"""`Model.from_arrays`: problems that other codes hand over as plain arrays."""

from __future__ import annotations

import json
import math
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh.formulations.registry import formulation
from bh.loading.program import program

PEERS = FilePath(__file__).parents[3] / "shared" / "peer_problems"
# total, bending and folding energy (N mm) on which six independent codes agree; bars with Green's strain
PUBLISHED = {
    "annulus_5x31": (3.270962320, 2.944622668, 0.322118961),
    "annulus_5x61": (2.773577732, 2.524949397, 0.245239472),
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_energies(name: str) -> None:
    """The creased annulus of the array problems from flat to a rest angle of 90 degrees."""
    file = PEERS / f"{name}.json"
    if not file.is_file():
        pytest.skip("the array problems are not here")
    data = json.loads(file.read_text())
    model = bh.Model.from_arrays(
        data["nodes"], data["triangles"], data["bars"], data["bar_k"], data["bend_hinges"], data["bend_k"],
        data["fold_hinges"], data["fold_k"], data["supports"], green=True,
    )  # fmt: skip
    path = bh.trace(model.fold("fold", rest=data["fold_rest_end"]))
    assert path.outcome == "reached"
    assert path.iterations <= 30
    energy = path[-1].energy
    for value, published in zip((energy.total, energy.bending, energy.folding), PUBLISHED[name], strict=True):
        assert value == pytest.approx(published, rel=2e-9)


def own_arrays() -> tuple[bh.Model, dict[str, Any]]:
    """A model of this project, and the same as arrays."""
    mesh = meshes.structured(meshes.annulus_sector(50.0, 8.0, 0.7), along=8)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.2)).support("edge:start", "xyz").support("edge:end", "z")
    model = model.fold("crease", rest=2.0, Lstar=10.0)
    elements = formulation(model.formulation).system(model, program(model)[0], None).elements
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
