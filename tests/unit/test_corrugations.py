"""Corrugation patterns (source 4.3), their meshes of tapering panels, and folding them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import meshes
from bh import Model, Sheet, trace
from bh.errors import SceneError
from bh.scene.load import parse_scene
from meshes import PatternError
from meshes.cells import Kind
from meshes.corrugations import KINDS
from meshes.curved import edge_middles
from meshes.curves import sample
from meshes.tapered import smallest_angles
from verification.studies.ch4.tables4 import PRINTED, formula

CURVED = KINDS[1:]


@pytest.mark.parametrize("kind", KINDS)
def test_tables_as_printed(kind: str) -> None:
    """Tables 4.1-4.5 to their last digit."""
    columns = meshes.corrugation_table(kind).columns
    assert set(columns) == set(PRINTED[kind])
    for name, printed in PRINTED[kind].items():
        decimals = np.array([len(text.partition(".")[2]) for text in printed])
        values = np.array([float(text) for text in printed])
        assert (np.abs(columns[name] - values) <= 0.5 * 10.0**-decimals + 1e-12).all(), name


@pytest.mark.parametrize("kind", KINDS)
def test_curves_are_those_of_the_equations(kind: str) -> None:
    """Eq. 4.7-4.16 at other sizes than the tables' would differ if W, H or n entered wrongly."""
    pattern = meshes.corrugation(kind, width=80.0, height=50.0, panels=4)
    table = meshes.corrugation_table(kind, 80.0, 50.0, 4).columns
    for i, rail in enumerate(pattern.rails[1:]):
        points = sample(rail)
        assert points[-1, 0] == pytest.approx(table["r"][i], rel=1e-12)
        assert np.interp(0.0, points[:, 0], points[:, 1]) == pytest.approx(50.0 * (i + 1) / 4, rel=1e-6)
    assert [crease.fold for crease in pattern.creases] == ["mountain", "valley", "mountain"]
    assert formula(kind, 0, np.zeros(1))[0] == pytest.approx(20.0)  # of the tables' sizes


@pytest.mark.parametrize("kind", CURVED)
@pytest.mark.parametrize("mesh_kind", ["staggered", "alternating"])
@pytest.mark.parametrize(("along", "rows"), [(24, 1), (40, 3), (64, 6)])
def test_meshes_of_tapering_panels(kind: str, mesh_kind: Kind, along: int, rows: int) -> None:
    """They cover the sheet, nodes lie on the curves, and slivers are only next to the corners."""
    pattern = meshes.corrugation(kind)
    mesh = meshes.structured(pattern, along=along, rows=rows, kind=mesh_kind)
    rim = sample(pattern.rails[-1])
    area = float(np.trapezoid(rim[:, 1], rim[:, 0]))
    assert 1.0 - 5.0 / along**2 < mesh.areas.sum() / area < 1.0
    for i, name in enumerate(mesh.creases):
        nodes = mesh.points[mesh.nodes(f"crease:{name}")][:, :2]
        gap = np.linalg.norm(nodes[:, None] - sample(pattern.rails[i + 1])[None], axis=2).min(axis=1)
        # where curves are taken as one a node lies on the other curve, sideways next to its own
        assert gap.max() < (0.6 if kind == "elliptical-point" else 0.1)
        assert nodes[0, 0] == pytest.approx(-nodes[-1, 0], abs=1e-9)
    angles = np.degrees(smallest_angles(mesh.points, mesh.triangles))
    centres = mesh.points[mesh.triangles].mean(axis=1)
    thin = angles < 5.0  # where rows end a few have 5 to 10 degrees
    near_corner = np.abs(centres[:, 0]) > 50.0 * (0.85 if kind.endswith("point") else 0.99)
    assert near_corner[thin].all()
    assert thin.mean() < 0.12


def test_symmetric_about_y() -> None:
    mesh = meshes.structured(meshes.corrugation("elliptical-edge"), along=31)
    mirrored = mesh.points * [-1.0, 1.0, 1.0]
    gap = np.linalg.norm(mesh.points[:, None] - mirrored[None], axis=2).min(axis=1)
    assert gap.max() < 1e-9


@pytest.mark.parametrize("kind", CURVED)
@pytest.mark.parametrize(("along", "rows"), [(24, 1), (36, 3), (48, 4)])
def test_middles_of_edges_are_on_the_curves_of_a_mesh(kind: str, along: int, rows: int) -> None:
    """Also where curves touch and nodes lie between them: edges are straight there, elsewhere they bow."""
    pattern = meshes.corrugation(kind)
    mesh = meshes.structured(pattern, along=along, rows=rows)
    middles, chords = edge_middles(mesh), mesh.points[mesh.topology.edges].mean(axis=1)
    bow = np.linalg.norm(middles - chords, axis=1)
    off = 0
    for rail, name in zip(
        pattern.rails[1:], [*(f"crease:{name}" for name in mesh.creases), "edge:outer"], strict=True
    ):
        edges = mesh.topology.find_edges(mesh.edge_sets[name])
        ends = mesh.points[mesh.edge_sets[name], :2]
        x, y = sample(rail).T
        apart = np.abs(ends[..., 1] - np.interp(ends[..., 0], x, y)).max(axis=1) > 1e-6
        assert bow[edges[apart]].max(initial=0.0) < 1e-12
        assert bow[edges[~apart]].max() > 1e-3
        off += int(apart.sum())
        if not apart.any():
            assert mesh.curves[name] is rail
    assert (off > 0) == (kind == "elliptical-point")


def test_creases_that_touch_join() -> None:
    """Ellipses of one axis touch in the corner: near it they are one curve, and an edge belongs to one set at most."""
    mesh = meshes.structured(meshes.corrugation("elliptical-point"), along=36)
    edges = [tuple(sorted(pair)) for name in mesh.creases for pair in mesh.crease_edges(name).tolist()]
    assert len(edges) == len(set(edges))
    starts = [mesh.points[mesh.nodes(f"crease:{name}")[0]] for name in mesh.creases]
    assert starts[0][1] < starts[3][1]
    assert starts[3][1] > 1.0


def test_family_holds_the_four_curved_ones() -> None:
    for p, q, s, kind in (
        (2, 1, 1, "parabolic-point"),
        (2, 1, 0, "parabolic-edge"),
        (2, 2, 1, "elliptical-point"),
        (2, 2, 0, "elliptical-edge"),
    ):
        x = np.linspace(-49.0, 49.0, 99)
        for i, rail in enumerate(meshes.curved_corrugation(p, q, s).rails[1:]):
            y = np.interp(x, sample(rail)[:, 0], sample(rail)[:, 1], left=0.0, right=0.0)
            assert np.abs(y - formula(kind, i, x)).max() < 2e-3


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent"])
@pytest.mark.parametrize("kind", KINDS)
def test_they_fold(kind: str, formulation: str) -> None:
    """Every pattern folds with spring creases, mountains up and valleys down, in both formulations."""
    mesh = meshes.structured(meshes.corrugation(kind), along=24)
    model = Model(mesh, Sheet(E=4000.0, t=0.381), formulation=formulation)
    path = trace(model.fold("all", by=0.4, Lstar=25.0))
    assert path.outcome == "reached"
    for name in mesh.creases:
        sense = 1.0 if mesh.folds[name] == "mountain" else -1.0
        assert (sense * path[-1].fold_angle(name)).mean() > 0.25


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"kind": "parabolic"}, "use one of straight"),
        ({"kind": "straight", "panels": 1}, "whole number from 2"),
        ({"kind": "straight", "panels": 2.5}, "whole number from 2"),
        ({"kind": "elliptical-edge", "width": -1.0}, "positive length"),
        ({"kind": "elliptical-edge", "height": float("nan")}, "positive length"),
        ({"kind": "parabolic-edge", "folds": ["mountain"]}, "1 folds for 4 creases"),
    ],
)
def test_impossible_parameters_are_one_line(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(PatternError, match=message) as caught:
        meshes.corrugation(**arguments)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "bad", [{"exponent": 0.5}, {"root": 0.0}, {"spread": 1.5}, {"spread": float("nan")}, {"exponent": 1e4}]
)
def test_impossible_family_members(bad: dict[str, Any]) -> None:
    with pytest.raises(PatternError, match="cannot be; give a number"):
        meshes.curved_corrugation(**bad)


SCENE = """
[pattern]
kind = "{kind}"
{more}
[sheet]
E = 4000.0
t = 0.381
[mesh]
along = 12
[[steps]]
fold = {{ crease = "all", by = 0.5, Lstar = 25.0 }}
"""


@pytest.mark.parametrize("kind", [*KINDS, "curved-corrugation"])
def test_scene_kinds(kind: str) -> None:
    scene = parse_scene(SCENE.format(kind=kind, more="panels = 3\nheight = 60.0"))
    assert scene.model.mesh.creases == ("crease-1", "crease-2")
    assert scene.model.mesh.points[:, 1].max() == pytest.approx(60.0, rel=0.06)


def test_scene_errors_name_the_key() -> None:
    with pytest.raises(SceneError, match=r"pattern\.panels = 1 cannot be"):
        parse_scene(SCENE.format(kind="straight", more="panels = 1"))
    with pytest.raises(SceneError, match=r"pattern\.spread = 2"):
        parse_scene(SCENE.format(kind="curved-corrugation", more="spread = 2.0"))
