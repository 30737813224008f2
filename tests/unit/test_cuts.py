"""Cuts that open: meshes with doubled nodes, and where they come from and go to."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bh
from bh.errors import ModelError
from bh.loading.symmetry import mirror
from meshes import (
    Arc,
    Crease,
    CreasePattern,
    Line,
    MeshError,
    PatternError,
    SheetMesh,
    ruled,
    strip,
    structured,
    unstructured,
)
from meshes.curves import Curve
from meshes.cuts import CUTS
from meshes.fans import lips, places, take_apart
from meshes.io import read_fold, read_pattern, write_fold, write_pattern
from meshes.io.drawing import read_drawn

CORNERS = ((0.0, 0.0), (100.0, 0.0), (100.0, 60.0), (0.0, 60.0))
SHEET = '<rect x="0" y="0" width="100" height="60" stroke="black" fill="none"/>'


def sheet(*cuts: Curve, creases: tuple[Crease, ...] = ()) -> CreasePattern:
    """A sheet of 100 x 60 mm with these cuts."""
    sides = tuple((f"side-{k + 1}", Line(CORNERS[k], CORNERS[(k + 1) % 4])) for k in range(4))
    named = tuple((f"cut-{k + 1}", cut) for k, cut in enumerate(cuts))
    group = ((CUTS, tuple(f"edge:{name}" for name, _ in named)),)
    return CreasePattern((np.array(CORNERS),), creases, edges=sides, groups=group, cuts=named)


def cut(x1: float, y1: float, x2: float, y2: float) -> Line:
    return Line((x1, y1), (x2, y2))


def euler(mesh: SheetMesh) -> int:
    return len(mesh.points) - len(mesh.topology.edges) + len(mesh.triangles)


def drawn(tmp_path: Path, body: str) -> Path:
    file = tmp_path / "sheet.svg"
    head = 'xmlns="http://www.w3.org/2000/svg" width="100mm" height="60mm" viewBox="0 0 100 60"'
    file.write_text(f"<svg {head}>{SHEET}{body}</svg>", encoding="utf-8")
    return file


def green(x1: float, y1: float, x2: float, y2: float) -> str:
    return f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" stroke="#00ff00"/>'


def red(x1: float, y1: float, x2: float, y2: float) -> str:
    return f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" stroke="#ff0000"/>'


Spots = tuple[tuple[float, float, int], ...]
KINDS: dict[str, tuple[tuple[Curve, ...], int, int, Spots]] = {
    # cuts, Euler characteristic, pieces, copies of the nodes at some place: (x, y, how many nodes)
    "inside": ((cut(20, 30, 80, 30),), 0, 1, ((20, 30, 1), (80, 30, 1))),
    "from the rim": ((cut(0, 30, 80, 30),), 1, 1, ((0, 30, 2), (80, 30, 1))),
    "from a corner": ((cut(0, 0, 50, 30),), 1, 1, ((0, 0, 2), (50, 30, 1))),
    "across": ((cut(0, 30, 100, 30),), 2, 2, ((0, 30, 2), (100, 30, 2))),
    "T": ((cut(20, 30, 80, 30), cut(50, 30, 50, 10)), 0, 1, ((50, 30, 3), (50, 10, 1))),
    "X": (
        (cut(20, 30, 50, 30), cut(50, 30, 80, 30), cut(50, 30, 50, 10), cut(50, 50, 50, 30)),
        0,
        1,
        ((50, 30, 4), (20, 30, 1)),
    ),
    "corner of two": ((cut(20, 30, 50, 30), cut(50, 30, 50, 10)), 0, 1, ((50, 30, 2),)),
    "T at the rim": ((cut(0, 30, 50, 30), cut(50, 0, 50, 60)), 3, 3, ((50, 30, 3), (50, 0, 2))),
    "an arc": ((Arc((50.0, 30.0), 15.0, 0.0, math.pi),), 0, 1, ((35, 30, 1), (50, 45, 2))),
    "short": ((cut(48, 30, 52, 30),), 0, 1, ((48, 30, 1), (52, 30, 1), (50, 30, 2))),
}


class TestMeshes:
    @pytest.mark.parametrize("name", KINDS)
    def test_kinds(self, name: str) -> None:
        cuts, characteristic, pieces, spots = KINDS[name]
        mesh = unstructured(sheet(*cuts), size=8.0)
        assert mesh.areas.sum() == pytest.approx(6000.0)
        assert euler(mesh) == characteristic
        assert mesh.pieces.max() + 1 == pieces
        for x, y, count in spots:
            here = mesh.nodes(f"near:{x},{y}")
            assert len(here) == count, (x, y)
            assert mesh.points[here, :2] == pytest.approx(np.tile([x, y], (count, 1)), abs=1e-9)
        every = mesh.edge_sets[CUTS]
        length = np.linalg.norm(np.diff(mesh.points[every], axis=1)[:, 0], axis=1).sum()
        assert length == pytest.approx(2.0 * sum(curve.length for curve in cuts), rel=0.02)
        rim = mesh.topology.edge_triangles[mesh.topology.find_edges(every), 1]
        assert (rim < 0).all()
        assert len(lips(mesh.points, mesh.topology)) == len(every) / 2

    def test_left_lip_first(self) -> None:
        mesh = unstructured(sheet(cut(20, 30, 80, 30)), size=8.0)
        pairs = mesh.edge_sets["edge:cut-1"]
        edges = mesh.topology.find_edges(pairs)
        side = mesh.points[mesh.triangles[mesh.topology.edge_triangles[edges, 0]]].mean(axis=1)[:, 1] - 30.0
        half = len(pairs) // 2
        assert (side[:half] > 0.0).all()
        assert (side[half:] < 0.0).all()
        assert (mesh.points[pairs[:, 0], 0] < mesh.points[pairs[:, 1], 0]).all()

    def test_closed_cuts_leave_holes(self) -> None:
        mesh = unstructured(sheet(Arc((50.0, 30.0), 15.0, 0.0, 2.0 * math.pi)), size=5.0)
        assert euler(mesh) == 0
        assert mesh.areas.sum() == pytest.approx(6000.0 - math.pi * 15.0**2, rel=5e-3)
        assert len(mesh.nodes("edge:cut-1")) == len(mesh.edge_sets["edge:cut-1"])
        (remark,) = mesh.remarks
        assert "1 piece within closed cuts" in remark

    def test_a_crease_on_a_piece_that_falls_out_goes_with_it(self) -> None:
        lines = [cut(30, 20, 70, 20), cut(70, 20, 70, 40), cut(70, 40, 30, 40), cut(30, 40, 30, 20)]
        creases = (Crease("in", cut(30, 20, 70, 40)), Crease("out", cut(70, 40, 100, 60)))
        mesh = unstructured(sheet(*lines, creases=creases), size=40.0)
        assert mesh.creases == ("out",)
        assert mesh.areas.sum() == pytest.approx(6000.0 - 800.0)

    def test_creases_end_at_cuts(self) -> None:
        creases = (Crease("a", cut(0, 30, 20, 30)), Crease("b", cut(50, 0, 50, 30)))
        mesh = unstructured(sheet(cut(20, 30, 80, 30), creases=creases), size=8.0)
        assert len(mesh.nodes("near:50,30")) == 2
        for crease in "ab":
            assert (mesh.topology.edge_hinges[mesh.topology.find_edges(mesh.crease_edges(crease))] >= 0).all()
        end = mesh.crease_edges("b")[-1, 1]
        below = mesh.triangles[(mesh.triangles == end).any(axis=1)]
        assert (mesh.points[below][..., 1] <= 30.0 + 1e-9).all()

    def test_corners_are_all_nodes_there(self) -> None:
        mesh = unstructured(sheet(cut(0, 0, 50, 30)), size=8.0)
        at = mesh.nodes("corner:side-1-side-4")
        assert len(at) == 2
        assert not mesh.points[at].any()
        assert len(mesh.nodes(f"node:{at[1]}")) == 1

    def test_structured_where_cuts_follow_cells(self) -> None:
        pattern = replace(strip(100, 20, [10.0]), cuts=(("cut-1", cut(50, 0, 50, 10)),))
        mesh = structured(pattern, along=20, rows=2, kind="alternating")
        whole = structured(strip(100, 20, [10.0]), along=20, rows=2, kind="alternating")
        assert len(mesh.points) == len(whole.points) + 2
        assert len(mesh.triangles) == len(whole.triangles)
        assert mesh.pattern is pattern
        assert mesh.spans is not None
        assert mesh.spans.shape == mesh.topology.edges.shape
        with pytest.raises(MeshError, match="does not run along the edges"):
            structured(pattern, along=19, rows=2, kind="alternating")

    def test_structured_rings(self) -> None:
        from meshes import full_annulus

        pattern = full_annulus([20.0, 30.0], 8.0)
        inner = replace(pattern, creases=pattern.creases[1:], cuts=(("cut-1", pattern.creases[0].curve),))
        rails = (pattern.rails[0], *pattern.rails[2:])
        with pytest.raises(MeshError, match="does not run along"):
            structured(replace(inner, rails=rails), along=24, kind="alternating")
        mesh = unstructured(inner, size=3.0)
        assert mesh.pieces.max() == 0
        assert "fell out" in mesh.remarks[0]

    def test_shell_nodes_are_doubled_too(self) -> None:
        from meshes.curved import lift

        mesh = unstructured(sheet(Arc((50.0, 30.0), 15.0, 0.0, math.pi)), size=8.0)
        lifted = lift(mesh)
        pairs = mesh.edge_sets["edge:cut-1"]
        middle = lifted.nodes[len(mesh.points) + mesh.topology.find_edges(pairs)]
        assert np.hypot(*(middle[:, :2] - (50.0, 30.0)).T) == pytest.approx(np.full(len(pairs), 15.0))
        half = len(pairs) // 2
        assert (middle[:half] == middle[half:]).all()
        assert len(lips(lifted.nodes, lifted.linear.topology)) == len(pairs)

    def test_ruled(self) -> None:
        pattern = sheet(cut(50, 0, 50, 30), creases=(Crease("m1", cut(0, 30, 100, 30)),))
        mesh = ruled(pattern, [np.array([[50.0, 30.0], [50.0, 60.0]])], spacing=20.0)
        assert mesh.areas.sum() == pytest.approx(6000.0)
        assert len(lips(mesh.points, mesh.topology)) == 2

    def test_what_cannot_be(self) -> None:
        with pytest.raises(PatternError, match="cut 'cut-1' and cut 'cut-2' cross"):
            sheet(cut(20, 30, 80, 30), cut(50, 10, 50, 50))
        with pytest.raises(PatternError, match="crease 'm' and cut 'cut-1' cross"):
            sheet(cut(20, 30, 80, 30), creases=(Crease("m", cut(50, 10, 50, 50)),))
        with pytest.raises(PatternError, match="cut 'cut-1' leaves the sheet"):
            sheet(cut(20, 30, 120, 30))
        with pytest.raises(PatternError, match="name 'a' of a cut is used twice"):
            replace(sheet(), cuts=(("a", cut(20, 30, 80, 30)), ("a", cut(20, 40, 80, 40))))

    def test_a_cut_of_one_edge_gets_a_node(self) -> None:
        points = np.array([[0, 0], [6, 0], [3, 5], [2, 2], [4, 2.0]])
        triangles = np.array([[0, 1, 4], [0, 4, 3], [3, 4, 2], [1, 2, 4], [0, 3, 2]])
        opened = take_apart(points, triangles, np.array([[3, 4]]))
        assert len(opened.points) == 7
        assert len(opened.triangles) == 7
        assert (opened.points[5:] == [3.0, 2.0]).all()
        assert (
            opened.pairs(np.array([[3, 4]])).tolist() == [[3, 5], [5, 4], [3, 6], [6, 4]]
            or len(opened.pairs(np.array([[3, 4]]))) == 4
        )


class TestFiles:
    def test_drawn_cuts(self, tmp_path: Path) -> None:
        body = green(20, 20, 80, 20) + green(50, 10, 50, 30) + red(0, 40, 100, 40) + green(30, 40, 30, 60)
        pattern = read_pattern(drawn(tmp_path, body))
        assert len(pattern.cuts) == 5  # the crossing parts both
        assert [c.name for c in pattern.creases] == ["m1", "m2"]  # the third cut ends on the crease
        assert pattern.remarks == ()
        mesh = unstructured(pattern, size=10.0)
        assert mesh.areas.sum() == pytest.approx(6000.0)
        assert len(mesh.nodes("near:50,40")) == 4  # drawings have y downwards
        assert len(mesh.nodes("near:30,20")) == 1
        assert len(mesh.nodes("near:30,0")) == 2
        facets = read_drawn(drawn(tmp_path, body))
        assert facets.areas.sum() == pytest.approx(6000.0)
        assert len(lips(facets.points, facets.topology)) >= 5

    def test_pieces_within_closed_cuts_fall_out(self, tmp_path: Path) -> None:
        square = '<rect x="30" y="20" width="40" height="20" stroke="#00ff00" fill="none"/>'
        pattern = read_pattern(drawn(tmp_path, square + red(0, 30, 100, 30)))
        assert len(pattern.rings) == 2
        assert not pattern.cuts
        assert [crease.curve.length for crease in pattern.creases] == pytest.approx([30.0, 30.0])
        assert any("1 piece within closed cuts" in remark for remark in pattern.remarks)

    def test_an_outline_of_cut_lines_must_close(self, tmp_path: Path) -> None:
        file = tmp_path / "open.svg"
        head = 'xmlns="http://www.w3.org/2000/svg" width="100mm" height="60mm" viewBox="0 0 100 60"'
        lines = green(0, 0, 100, 0) + green(100, 0, 100, 60) + green(100, 60, 0, 60) + green(0, 60, 0, 9)
        file.write_text(f"<svg {head}>{lines}</svg>", encoding="utf-8")
        with pytest.raises(Exception, match="ends loosely at"):
            read_pattern(file)

    @pytest.mark.parametrize("suffix", [".svg", ".dxf"])
    @pytest.mark.parametrize("of", ["pattern", "mesh"])
    def test_written_and_read(self, tmp_path: Path, suffix: str, of: str) -> None:
        cuts = (cut(0, 30, 50, 30), cut(50, 30, 70, 45), cut(50, 30, 50, 10), cut(80, 20, 90, 20))
        pattern = sheet(*cuts, creases=(Crease("m1", cut(90, 20, 100, 20)),))
        file = tmp_path / f"again{suffix}"
        write_pattern(file, pattern if of == "pattern" else unstructured(pattern, size=9.0))
        again = read_pattern(file)
        assert len(again.cuts) == 4
        assert len(again.rings) == 1
        assert sum(curve.length for _, curve in again.cuts) == pytest.approx(
            sum(curve.length for curve in cuts), rel=1e-6
        )
        assert [crease.fold for crease in again.creases] == ["mountain"]

    def test_fold_cuts_in(self, tmp_path: Path) -> None:
        data = {
            "vertices_coords": [[0, 0], [2, 0], [4, 0], [4, 3], [2, 3], [0, 3], [2, 1.5]],
            "edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 0], [1, 6], [6, 4]],
            "edges_assignment": list("BBBBBBCM"),
        }
        file = tmp_path / "slit.fold"
        file.write_text(json.dumps(data), encoding="utf-8")
        mesh = read_fold(file)
        assert len(mesh.points) == 8
        assert len(mesh.edge_sets[CUTS]) == 2
        assert len(mesh.edge_sets["edge:boundary"]) == 6
        assert euler(mesh) == 1
        write_fold(tmp_path / "again.fold", mesh)
        again = read_fold(tmp_path / "again.fold")
        assert (again.points == mesh.points).all()
        assert (again.triangles == mesh.triangles).all()

    @pytest.mark.parametrize("faces", [True, False])
    def test_fold_loose_cuts(self, tmp_path: Path, faces: bool) -> None:
        """A slit that touches nothing: with faces its one edge gets a node, without faces it is tied first."""
        data = {
            "vertices_coords": [[0, 0], [9, 0], [9, 9], [0, 9], [3, 4], [6, 4]],
            "edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5]],
            "edges_assignment": list("BBBBC"),
        }
        if faces:
            data["faces_vertices"] = [[0, 1, 5, 4], [1, 2, 5], [2, 3, 4, 5], [3, 0, 4]]
        file = tmp_path / "slit.fold"
        file.write_text(json.dumps(data), encoding="utf-8")
        mesh = read_fold(file)
        assert mesh.areas.sum() == pytest.approx(81.0)
        assert euler(mesh) == 0
        assert len(mesh.nodes("near:4.5,4")) == 2


class TestModels:
    def test_nodes_in_one_place_keep_apart_in_symmetry(self) -> None:
        pattern = replace(strip(80, 20, [10.0]), cuts=(("a", cut(20, 0, 20, 10)), ("b", cut(60, 0, 60, 10))))
        mesh = structured(pattern, along=16, rows=2, kind="alternating")
        plane = mirror(mesh, "x")
        assert (plane.node[plane.node] == np.arange(len(mesh.points))).all()
        twice = np.flatnonzero(places(mesh.points) != np.arange(len(mesh.points)))
        assert len(twice) == 4

    def test_pieces_that_nothing_holds_are_refused(self) -> None:
        mesh = unstructured(sheet(cut(0, 30, 100, 30)), size=15.0)
        model = bh.Model(mesh, bh.Sheet(E=4000, t=0.2)).force("near:50,60", each=(0.0, 0.0, 1e-3))
        with pytest.raises(ModelError, match="cuts part the sheet into 2 pieces"):
            bh.trace(model)
        with pytest.raises(ModelError, match=r"rigid motions of the piece at \(50\..* supports there$"):
            bh.trace(model.support("edge:side-1", "xyz", clamp=True))
