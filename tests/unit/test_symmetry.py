"""Mirror-symmetric models by halves: the same answers as by the whole, and what is not symmetric is named."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh.analysis.alignment import aligned
from bh.errors import ModelError, SceneError
from bh.loading.symmetry import mirror
from bh.mechanics.consistent.system import ConsistentSystem
from bh.paths.path import Path
from bh.scene.load import parse_scene
from meshes.cells import Kind

SHEET = bh.Sheet(E=4000.0, nu=0.3, t=0.127)
SECTOR = meshes.annulus_sector(100.0, 10.0, math.pi / 2)
STRIP = meshes.strip(60.0, 10.0, [5.0])
BOTH = ("bars-and-hinges", "consistent")
MESHES: list[tuple[Kind, int, int]] = [
    ("staggered", 8, 1),
    ("staggered", 9, 2),
    ("alternating", 8, 2),
    ("alternating", 8, 1),
]


def compare(model: bh.Model, plane: str, free: bool = False, straight: bool = False) -> None:
    """Both ways, the last state (on the way increments may differ).

    Not compared: the place of a `free` sheet, and the moments of a `straight` crease; nothing determines them.
    """
    whole, half = bh.trace(model), bh.trace(model, symmetry=plane)
    assert (whole.outcome, half.outcome) == ("reached", "reached")
    assert half.unknowns == whole.unknowns
    a, b = whole[-1], half[-1]
    assert b.energy.total == pytest.approx(a.energy.total, rel=1e-8, abs=1e-12)
    np.testing.assert_allclose(b.dihedral_angles, a.dihedral_angles, atol=1e-8)
    if not straight:
        scale = np.nanmax(np.abs(a.crease_moments), initial=1e-9)
        np.testing.assert_allclose(b.crease_moments, a.crease_moments, atol=1e-6 * scale)
    np.testing.assert_allclose(
        b.reactions, a.reactions, atol=1e-8 * max(float(np.abs(a.reactions).max()), 1e-3)
    )
    points = aligned(b.points, a.points)[0] if free else b.points
    np.testing.assert_allclose(points, a.points, atol=1e-8)
    assert half.stable == whole.stable


def sector(kind: Kind = "staggered", along: int = 8, rows: int = 1, name: str = BOTH[0]) -> bh.Model:
    return bh.Model(meshes.structured(SECTOR, along=along, rows=rows, kind=kind), SHEET, formulation=name)


def strip(kind: Kind = "staggered", along: int = 8, rows: int = 1, name: str = BOTH[0]) -> bh.Model:
    return bh.Model(meshes.structured(STRIP, along=along, rows=rows, kind=kind), SHEET, formulation=name)


# --- the same answers ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", BOTH)
@pytest.mark.parametrize(("kind", "along", "rows"), MESHES)
@pytest.mark.parametrize("how", [{"to": 1.8}, {"rest": 1.8, "Lstar": 25.0}])
def test_free_sector(name: str, kind: Kind, along: int, rows: int, how: dict[str, Any]) -> None:
    compare(sector(kind, along, rows, name).fold("crease", **how), "y", free=True)


@pytest.mark.parametrize("name", BOTH)
@pytest.mark.parametrize(("kind", "along", "rows"), MESHES)
def test_supported_strip_in_two_steps(name: str, kind: Kind, along: int, rows: int) -> None:
    """Held ends, a spring crease that crosses the plane, forces and then displacements."""
    model = strip(kind, along, rows, name).support("edge:start", "xyz").support("edge:end", "xyz")
    model = model.crease("crease", Lstar=25.0).force("crease:crease", total=(0.0, 0.0, 0.3))
    compare(model.moment("crease", to=1e-3), "x")


@pytest.mark.parametrize("name", BOTH)
@pytest.mark.parametrize("how", [{"to": 2.2}, {"rest": 2.2, "Lstar": 20.0}])
def test_crease_in_the_plane(name: str, how: dict[str, Any]) -> None:
    """The strip folds along its middle line, which is the plane."""
    model = strip("alternating", 8, 2, name).fold("crease", **how)
    compare(model, "y", free=True, straight=True)


def between_oblique_supports(along: int, name: str) -> bh.Model:
    """Both straight edges of a sector are held across themselves: local axes of nodes, of images too."""
    model = sector(name=name, along=along, rows=2)
    for place, normal in (("edge:start", (0.0, 1.0, 0.0)), ("edge:end", (1.0, 0.0, 0.0))):
        model = model.support(place, (normal, (0.0, 0.0, 1.0)))
    model = model.support("corner:inner-start", ((1.0, 0.0, 0.0),))
    model = model.support("corner:inner-end", ((0.0, 1.0, 0.0),))
    # at 16 degrees the consistent sheet buckles out of its symmetry, which the half does not follow
    return model.fold("crease", rest=2.9, Lstar=25.0)


@pytest.mark.parametrize("name", BOTH)
def test_oblique_supports(name: str) -> None:
    compare(between_oblique_supports(16, name), "y")


def test_a_sheet_that_leaves_the_symmetry() -> None:
    """On a coarser mesh it buckles to one side; the half cannot, and says that it is not stable."""
    model = between_oblique_supports(9, "consistent")
    whole, half = bh.trace(model), bh.trace(model, symmetry="y")
    assert (whole.stable, half.stable) == (True, False)
    assert whole[-1].energy.total < half[-1].energy.total


def test_full_ring_and_a_given_normal() -> None:
    mesh = meshes.structured(meshes.full_annulus(100.0, 10.0), along=16)
    model = bh.Model(mesh, SHEET, formulation="bars-and-hinges").fold("crease", to=math.pi - 0.02)
    compare(model, "x", free=True)
    compare(sector().fold("crease", to=2.5), "y", free=True)
    half = bh.trace(sector().fold("crease", to=2.5), symmetry=(-1.0, 1.0, 0.0))
    assert half.outcome == "reached"


@pytest.mark.parametrize("name", BOTH)
def test_half_the_unknowns(name: str) -> None:
    path = Path(sector(along=32, rows=2, name=name).fold("crease", to=2.0), symmetry="y")
    half = path.half(0)
    assert half is not None
    assert half.system.size < 0.53 * half.sheet.size


@pytest.mark.parametrize("name", BOTH)
@pytest.mark.parametrize(("kind", "along", "rows"), MESHES[:3])
def test_derivatives_of_a_half(name: str, kind: Kind, along: int, rows: int) -> None:
    """Gradient and tangent of the half against differences, and its energy against half of the whole's."""
    path = Path(strip(kind, along, rows, name).support("edge:start", "xyz").support("edge:end", "xyz")
                .fold("crease", rest=2.0, Lstar=10.0), symmetry="x")  # fmt: skip
    half = path.half(0)
    assert half is not None
    system = half.system
    rng, lam = np.random.default_rng(3), 0.4
    q = system.start() + 0.05 * rng.normal(size=system.size)
    x = system.positions(q, lam)
    if name == "consistent":
        assert isinstance(system, ConsistentSystem)
        q[system.moving :] = system.rotations_at(x, lam)
    now = system.evaluate(q, lam)
    whole = half.sheet.evaluate(half.unknowns(q, lam), lam)
    assert 2.0 * now.energy == pytest.approx(whole.energy, rel=1e-10)
    tangent = system.tangent(q, lam, now.forces).matrix
    for _ in range(4):
        d, h = rng.normal(size=system.size), 1e-6
        ahead, behind = (system.evaluate(q + s * h * d, lam) for s in (1.0, -1.0))
        assert now.residual @ d == pytest.approx((ahead.energy - behind.energy) / (2.0 * h), rel=1e-5)
        slope = (ahead.residual - behind.residual) / (2.0 * h)
        np.testing.assert_allclose(tangent @ d, slope, atol=1e-5 * np.abs(slope).max())
    back = half.formulation.part(half.sheet, system, half.plane, half.unknowns(q, lam), lam)
    np.testing.assert_allclose(back, q, atol=1e-9)


def test_a_stopped_run_goes_on(tmp_path: FilePath) -> None:
    """The file holds the whole sheet; a run by halves goes on from it and ends where an unbroken one does."""
    model = (
        strip().support("edge:start", "xyz").support("edge:end", "xyz").fold("crease", rest=2.0, Lstar=10.0)
    )
    model = model.force("crease:crease", total=(0.0, 0.0, 0.1))
    unbroken = bh.trace(model, symmetry="x")
    file = tmp_path / "path.bh"

    class StopError(Exception): ...

    class Meter:
        count = 0

        def update(self, *args: object) -> None:
            self.count += 1
            if self.count == 3:
                raise StopError

        def close(self, outcome: str) -> None: ...

    with pytest.raises(StopError):
        bh.trace(model, symmetry="x", file=file, progress=Meter())
    path = bh.trace(model, symmetry="x", file=file, resume=True)
    assert path.outcome == "reached"
    np.testing.assert_allclose(path[-1].points, unbroken[-1].points, atol=1e-9)


def test_stability_is_that_of_the_whole() -> None:
    """A compressed strip that is held in the middle buckles to two opposite waves: nothing that a half can see."""
    mesh = meshes.structured(meshes.strip(60.0, 6.0), along=32, kind="alternating")
    middle = np.flatnonzero(np.abs(mesh.points[:, 0] - 30.0) < 1e-9).tolist()
    model = (
        bh.Model(mesh, bh.Sheet(E=4000.0, t=0.5), formulation="bars-and-hinges")
        .support("edge:start", "yz")
        .support("edge:end", "yz")
    )
    model = model.support(middle, "z")

    def squeezed(by: float) -> bh.Path:
        return bh.trace(
            model.step(bh.Displace("edge:start", "x", by), bh.Displace("edge:end", "x", -by)), symmetry="x"
        )

    assert squeezed(0.003).stable
    buckled = squeezed(0.0095)
    assert buckled.outcome == "unstable"
    assert "leave the symmetry" in buckled.reason
    assert not buckled.stable
    assert any("not stable" in remark for remark in buckled.remarks)


def test_accuracy_by_halves() -> None:
    path = bh.trace(sector().fold("crease", rest=2.0, Lstar=25.0), accuracy=0.05, symmetry="y")
    assert path.accuracy is not None
    assert path.accuracy.met
    assert path.accuracy.formulation == "consistent"


# --- what is not symmetric ------------------------------------------------------------------------------------


def unlike(model: bh.Model) -> bh.Model:
    return replace(model, mesh=meshes.structured(SECTOR, along=8, kind="one-way"))


@pytest.mark.parametrize(
    ("changed", "plane", "words"),
    [
        (lambda m: m, "z", 'symmetry = "z" is not known'),
        (lambda m: m, (0.0, 0.0, 1.0), "cannot be"),
        (lambda m: m, "x", "has no image"),
        (unlike, "y", "not its own image; take staggered"),
        (lambda m: m.support("corner:inner-start", "xyz").support("rigid-body"), "y", "supports are not"),
        (
            lambda m: m.support("edge:start").support("edge:end").force("corner:outer-end", each=(0, 0, 1)),
            "y",
            "step 2: the forces are not",
        ),
        (
            lambda m: m.support("edge:start").support("edge:end").fold("crease", to=[2.0] * 7 + [2.1]),
            "y",
            "step 2: the creases are not",
        ),
        (lambda m: replace(m, formulation="shell"), "y", "take one of: bars-and-hinges, consistent"),
    ],
)
def test_what_is_not_symmetric_is_named(
    changed: Callable[[bh.Model], bh.Model], plane: str, words: str
) -> None:
    with pytest.raises(ModelError, match=words):
        bh.trace(changed(sector().fold("crease", to=2.0)), symmetry=plane)


def test_mirror_of_a_sector() -> None:
    """y is the direction of the crease in the middle: the ends change places, corners are images of each other."""
    plane = mirror(sector().mesh, "y")
    corner = sector().mesh.corners
    assert plane.node[corner["corner:outer-start"]] == corner["corner:outer-end"]
    np.testing.assert_allclose(plane.normal, [-math.sqrt(0.5), math.sqrt(0.5), 0.0], atol=1e-12)
    assert plane.triangle_weight.sum() == 0.5 * len(plane.triangle)


SCENE = """
symmetry = {symmetry}
[pattern]
kind = "annulus_sector"
radius = 100.0
width = 10.0
angle = 0.8
[sheet]
E = 4000.0
t = 0.127
[mesh]
along = 8
[[supports]]
at = "edge:start"
fix = "z"
{more}
[[supports]]
at = "rigid-body"
[[steps]]
fold = {{ crease = "crease", to = 2.5 }}
"""


def test_scenes() -> None:
    both = '[[supports]]\nat = "edge:end"\nfix = "z"'
    assert parse_scene(SCENE.format(symmetry='"y"', more=both)).symmetry == "y"
    for symmetry, more, words in (
        ('"y"', "", "symmetry: step 1: the supports are not mirror-symmetric"),
        ('"q"', both, 'symmetry: symmetry = "q" is not known'),
        ("3", both, "symmetry = 3 cannot be"),
        ('["a"]', both, "cannot be"),
    ):
        with pytest.raises(SceneError, match=words):
            parse_scene(SCENE.format(symmetry=symmetry, more=more))
