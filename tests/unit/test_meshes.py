"""Topology, structured meshes and the mesh container."""

from __future__ import annotations

import itertools
import math
from typing import Any, get_args

import numpy as np
import pytest

import meshes
from meshes import (
    Arc,
    Crease,
    CreasePattern,
    InputError,
    Line,
    MeshError,
    SheetMesh,
    annulus_sector,
    full_annulus,
    strip,
    structured,
)
from meshes.cells import Kind
from meshes.topology import boundary_loops, build
from tests.unit.asked import one_line, winding

KINDS = get_args(Kind)
SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])


class TestTopology:
    def test_two_triangles(self) -> None:
        """The hinge of two triangles: row, order and turning sense are those of the docstring."""
        topology = build(np.array([[0, 1, 2], [1, 3, 2]]), 4)
        assert topology.edges.tolist() == [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]]
        assert topology.edge_triangles.tolist() == [[0, -1], [0, -1], [0, 1], [1, -1], [1, -1]]
        assert topology.hinge_edges.tolist() == [2]
        assert topology.hinges.tolist() == [[0, 1, 2, 3]]  # 0, 1, 2 runs counter-clockwise
        assert topology.triangle_edges.tolist() == [[2, 1, 0], [4, 2, 3]]
        assert {tuple(sorted(pair)) for pair in topology.boundary.tolist()} == {
            (0, 1),
            (0, 2),
            (1, 3),
            (2, 3),
        }

    @pytest.mark.parametrize("order", [(0, 1), (1, 0)])
    @pytest.mark.parametrize("turns", [(0, 0), (1, 0), (2, 1)])
    def test_the_first_triangle_directs_the_hinge(self, order: Any, turns: Any) -> None:
        triangles = np.array([np.roll(t, k) for t, k in zip([[0, 1, 2], [1, 3, 2]], turns, strict=True)])
        (hinge,) = build(triangles[list(order)], 4).hinges.tolist()
        assert hinge == ([0, 1, 2, 3] if order == (0, 1) else [3, 2, 1, 0])

    @pytest.mark.parametrize("kind", KINDS)
    def test_hinges_of_a_mesh(self, kind: Any) -> None:
        mesh = structured(annulus_sector(50, 8, 1.3), along=7, rows=2, kind=kind)
        topology = mesh.topology
        p, q, r, s = (mesh.points[topology.hinges[:, k], :2] for k in range(4))

        def side(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
            return np.asarray((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])

        assert (side(q, r, p) > 0).all()  # the first wing lies left of the edge
        assert (side(q, r, s) < 0).all()
        ends = np.sort(topology.hinges[:, 1:3], axis=1)
        np.testing.assert_array_equal(ends, topology.edges[topology.hinge_edges])
        for wing, triangle in ((0, 0), (3, 1)):
            corners = mesh.triangles[topology.edge_triangles[topology.hinge_edges, triangle]]
            assert (corners == topology.hinges[:, wing : wing + 1]).any(axis=1).all()
        opposite = np.take_along_axis(mesh.triangles, np.zeros((len(mesh.triangles), 1), dtype=int), axis=1)
        assert not (topology.edges[topology.triangle_edges[:, 0]] == opposite).any()

    def test_find_edges(self) -> None:
        topology = build(np.array([[0, 1, 2], [1, 3, 2]]), 4)
        assert topology.find_edges(np.array([[2, 1], [0, 1], [3, 2]])).tolist() == [2, 0, 4]
        assert topology.find_edges(np.zeros((0, 2), dtype=int)).tolist() == []
        for pair in ([0, 3], [0, 0], [0, 7], [-1, 2], [3, 9]):
            with pytest.raises(MeshError, match="not joined by an edge"):
                topology.find_edges(np.array([[0, 1], pair]))

    @pytest.mark.parametrize(
        ("triangles", "words"),
        [
            ([[0, 1, 2], [1, 2, 3]], "oriented against each other"),
            ([[0, 1, 2], [2, 1, 3], [1, 2, 4]], "edge 1-2 has 3 triangles (non-manifold)"),
            ([[0, 1, 1]], "triangle 0 uses a node twice"),
            ([[0, 1, 2], [0, 5, 1]], "triangle 1 names a node outside 0..4"),
            ([[0, 1, -1]], "triangle 0 names a node outside 0..4"),
            ([], "no triangles"),
            ([[0, 1]], "no triangles"),
        ],
    )
    def test_errors(self, triangles: Any, words: str) -> None:
        with pytest.raises(MeshError) as caught:
            build(np.array(triangles, dtype=np.int64), 5)
        assert words in one_line(caught.value)

    def test_boundary_loops(self) -> None:
        mesh = structured(full_annulus(50, 10), along=20, kind="one-way")
        loops = boundary_loops(mesh.topology)
        assert sorted(map(len, loops)) == [20, 20]
        for name in ("edge:inner", "edge:outer"):
            assert set(mesh.nodes(name).tolist()) in [set(loop.tolist()) for loop in loops]
        (loop,) = boundary_loops(structured(strip(10, 5), along=4, kind="one-way").topology)
        pairs = np.column_stack((loop, np.roll(loop, -1)))
        mesh = structured(strip(10, 5), along=4, kind="one-way")
        assert (mesh.topology.edge_triangles[mesh.topology.find_edges(pairs), 1] < 0).all()
        assert len(pairs) == len(mesh.topology.boundary) == 10

    def test_boundary_that_touches_itself(self) -> None:
        topology = build(np.array([[0, 1, 2], [0, 3, 4]]), 5)
        with pytest.raises(MeshError, match="touches itself at node 0; split"):
            boundary_loops(topology)

    @pytest.mark.parametrize("kind", KINDS)
    @pytest.mark.parametrize("rows", [1, 2, 3, 4])
    def test_euler_characteristic(self, kind: Any, rows: int) -> None:
        sheets = {
            1: [
                annulus_sector(50, 10, 2.0),
                annulus_sector([50, 60], 10, 2.0),
                strip(20, 4),
                strip(20, 4, [1, 2, 3]),
            ],
            0: [full_annulus(50, 10), full_annulus([50, 60, 70], 10)],
        }
        for expected, patterns in sheets.items():
            for pattern, along in itertools.product(patterns, (24, 25)):
                mesh = structured(pattern, along=along, rows=rows, kind=kind)
                topology = mesh.topology
                assert len(mesh.points) - len(topology.edges) + len(mesh.triangles) == expected
                assert len(boundary_loops(topology)) == 2 - expected
                assert len(topology.hinges) + len(topology.boundary) == len(topology.edges)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("rows", [1, 2, 3])
class TestStructured:
    def test_area_converges(self, kind: Any, rows: Any) -> None:
        """Chords of arcs: the area is second order, and exact for a strip."""
        for pattern, exact in (
            (annulus_sector([60, 75], 10, 1.5), 0.75 * (85**2 - 50**2)),
            (full_annulus([60, 75], 10), math.pi * (85**2 - 50**2)),
        ):
            meshes_ = [structured(pattern, along=along, rows=rows, kind=kind) for along in (20, 40, 80)]
            errors = np.array([abs(mesh.areas.sum() - exact) for mesh in meshes_]) / exact
            np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 2.0, atol=0.06)
            assert errors[-1] < 2e-3
        assert structured(strip(7, 3, [1]), along=5, rows=rows, kind=kind).areas.sum() == pytest.approx(
            21, rel=1e-14
        )

    def test_named_sets_lie_on_their_curves(self, kind: Any, rows: Any) -> None:
        for pattern in (annulus_sector([60, 75], 10, 1.5), full_annulus(60, 10), strip(20, 5, [2, 3])):
            mesh = structured(pattern, along=30, rows=rows, kind=kind)
            assert set(mesh.edge_sets) == set(mesh.curves)
            for name, pairs in mesh.edge_sets.items():
                curve = mesh.curves[name]
                assert isinstance(curve, (Line, Arc))
                points = mesh.points[mesh.nodes(name), :2]
                assert _distance(curve, points).max() < 1e-12
                assert (pairs[1:, 0] == pairs[:-1, 1]).all()  # a chain in order
                if curve.closed:
                    assert pairs[0, 0] == pairs[-1, 1]
                else:
                    ends = curve.point(np.array([0.0, 1.0]))
                    np.testing.assert_allclose(mesh.points[[pairs[0, 0], pairs[-1, 1]], :2], ends, atol=1e-12)
                lengths = np.linalg.norm(np.diff(mesh.points[pairs], axis=1)[:, 0], axis=1)
                assert lengths.sum() == pytest.approx(curve.length, rel=2e-3)

    def test_edges_make_up_the_boundary_and_creases_lie_inside(self, kind: Any, rows: Any) -> None:
        for pattern in (annulus_sector([60, 75], 10, 1.5), full_annulus(60, 10)):
            mesh = structured(pattern, along=30, rows=rows, kind=kind)
            rim = mesh.topology.edge_triangles[:, 1] < 0
            named = [
                mesh.topology.find_edges(p) for name, p in mesh.edge_sets.items() if name.startswith("edge:")
            ]
            assert sorted(np.concatenate(named).tolist()) == np.flatnonzero(rim).tolist()
            for crease in mesh.creases:
                assert not rim[mesh.topology.find_edges(mesh.crease_edges(crease))].any()

    def test_triangles_are_counter_clockwise(self, kind: Any, rows: Any) -> None:
        for pattern in (annulus_sector([60, 75], 10, 1.5), full_annulus(60, 10), strip(20, 5, [2])):
            mesh = structured(pattern, along=30, rows=rows, kind=kind)
            assert mesh.flat
            assert (winding(mesh) > 0).all()

    def test_corners(self, kind: Any, rows: Any) -> None:
        mesh = structured(annulus_sector(60, 10, 1.5), along=9, rows=rows, kind=kind)
        end = np.array([math.cos(1.5), math.sin(1.5)])
        for name, point in {
            "inner-start": np.array([50, 0]),
            "outer-start": np.array([70, 0]),
            "inner-end": 50 * end,
            "outer-end": 70 * end,
        }.items():
            (node,) = mesh.nodes(f"corner:{name}")
            np.testing.assert_allclose(mesh.points[node, :2], point, atol=1e-12)
        assert not structured(full_annulus(60, 10), along=30, rows=rows, kind=kind).corners

    def test_spans(self, kind: Any, rows: Any) -> None:
        """On a strip the spans are |dx| and |dy|; on an annulus they make up the edge's length."""
        mesh = structured(strip(20, 5, [2]), along=7, rows=rows, kind=kind)
        a, b = (mesh.points[mesh.topology.edges[:, k], :2] for k in range(2))
        np.testing.assert_allclose(spans(mesh), np.abs(b - a), atol=1e-12)
        for pattern in (annulus_sector([60, 75], 10, 1.5), full_annulus(60, 10)):
            mesh = structured(pattern, along=40, rows=rows, kind=kind)
            a, b = (mesh.points[mesh.topology.edges[:, k]] for k in range(2))
            length = np.linalg.norm(b - a, axis=1)
            radial = np.abs(np.linalg.norm(a, axis=1) - np.linalg.norm(b, axis=1))
            np.testing.assert_allclose(np.hypot(*spans(mesh).T), length, rtol=1e-12)
            np.testing.assert_allclose(spans(mesh)[:, 1], radial, atol=0.06)

    def test_across_edges(self, kind: Any, rows: Any) -> None:
        """A staggered mesh joins no two nodes straight across, save at its ends; the others do everywhere."""
        for pattern in (annulus_sector([60, 75], 10, 1.5), full_annulus(60, 10)):
            mesh = structured(pattern, along=30, rows=rows, kind=kind)
            across = set(np.flatnonzero(spans(mesh)[:, 0] < 1e-9).tolist())
            ends = [mesh.edge_sets[name] for name in ("edge:start", "edge:end") if name in mesh.edge_sets]
            at_ends = set(mesh.topology.find_edges(np.vstack(ends)).tolist()) if ends else set()
            if kind == "staggered":
                assert across == at_ends
            else:
                lines = (len(pattern.rails) - 1) * rows
                assert len(across) == lines * (30 if pattern.closed else 31)

    def test_aspect_ratio(self, kind: Any, rows: Any) -> None:
        """The number of cells is whole, so alpha comes out within half a cell."""
        for alpha in (0.7, 3.0, 8.0, 12.5):
            mesh = structured(strip(100, 12, [6]), aspect_ratio=alpha, rows=rows, kind=kind)
            along = 100 * alpha / (6 / rows)
            assert mesh.aspect_ratio == pytest.approx(alpha, rel=0.5 / along + 1e-12)
            widths = 100 * mesh.aspect_ratio / (6 / rows)
            assert widths == pytest.approx(round(along), abs=1e-9)
            sector = structured(annulus_sector(100, 10, 1.0), aspect_ratio=alpha, rows=rows, kind=kind)
            assert sector.aspect_ratio == pytest.approx(alpha, rel=0.5 / (10 * alpha * rows) + 0.005)


def spans(mesh: SheetMesh) -> np.ndarray:
    assert mesh.spans is not None
    return mesh.spans


def _distance(curve: Line | Arc, points: np.ndarray) -> np.ndarray:
    if isinstance(curve, Arc):
        return np.asarray(abs(np.linalg.norm(points - np.asarray(curve.centre), axis=1) - curve.radius))
    start, end = np.asarray(curve.start), np.asarray(curve.end)
    along = (end - start) / np.linalg.norm(end - start)
    return np.asarray(abs((points - start) @ np.array([-along[1], along[0]])))


class TestDiagonals:
    """How the four kinds cut the cells of a strip: +1 where the diagonal rises along x, in order of its middle."""

    def slopes(self, kind: Kind, rows: int = 1) -> dict[float, list[int]]:
        mesh = structured(strip(4, 2, [1]), along=4, rows=rows, kind=kind)
        edges = mesh.topology.edges[(spans(mesh) > 1e-9).all(axis=1)]
        found: dict[float, list[tuple[float, int]]] = {}
        for a, b in mesh.points[edges]:
            x, y = 0.5 * (a + b)[:2]
            found.setdefault(round(float(y), 6), []).append((x, int(np.sign((b - a)[0] * (b - a)[1]))))
        return {y: [slope for _, slope in sorted(row)] for y, row in sorted(found.items())}

    def test_one_way(self) -> None:
        assert self.slopes("one-way") == {0.5: [1, 1, 1, 1], 1.5: [1, 1, 1, 1]}

    def test_mirrored(self) -> None:
        assert self.slopes("mirrored") == {0.5: [1, 1, 1, 1], 1.5: [-1, -1, -1, -1]}
        assert self.slopes("mirrored", 2) == {0.25: [1] * 4, 0.75: [1] * 4, 1.25: [-1] * 4, 1.75: [-1] * 4}

    def test_alternating(self) -> None:
        assert self.slopes("alternating") == {0.5: [1, -1, 1, -1], 1.5: [-1, 1, -1, 1]}

    def test_staggered(self) -> None:
        slopes = self.slopes("staggered")
        assert slopes == {0.5: [1, -1] * 4, 1.5: [-1, 1] * 4} or slopes == {
            0.5: [-1, 1] * 4,
            1.5: [1, -1] * 4,
        }

    def test_staggered_crease_has_whole_cells(self) -> None:
        mesh = structured(strip(4, 2, [1]), along=4)
        assert mesh.points[mesh.nodes("crease:crease"), 0].tolist() == [0, 1, 2, 3, 4]
        assert mesh.points[mesh.nodes("edge:inner"), 0].tolist() == [0, 0.5, 1.5, 2.5, 3.5, 4]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({}, "give either aspect_ratio or along"),
        ({"aspect_ratio": 8, "along": 4}, "give either aspect_ratio or along"),
        ({"aspect_ratio": 0}, "aspect_ratio = 0 cannot be"),
        ({"aspect_ratio": math.nan}, "aspect_ratio = nan cannot be"),
        ({"along": 0}, "along = 0 cells cannot be"),
        ({"along": 2.5}, "along = 2.5 cells cannot be"),
        ({"along": 4, "rows": 0}, "rows = 0 cannot be"),
        ({"along": 4, "rows": 1.5}, "rows = 1.5 cannot be"),
        ({"along": 4, "kind": "zigzag"}, "mesh kind 'zigzag' is not known"),
    ],
)
def test_structured_errors(arguments: Any, words: str) -> None:
    with pytest.raises(MeshError) as caught:
        structured(strip(20, 5, [2]), **arguments)
    assert words in str(caught.value)
    assert str(caught.value).isprintable()


def test_structured_needs_rails_and_a_ring_of_three() -> None:
    with pytest.raises(MeshError, match="no rails"):
        structured(CreasePattern(rings=(SQUARE,)), along=3)
    with pytest.raises(MeshError, match="along = 2 cells cannot be; use a whole number from 3"):
        structured(full_annulus(50, 45), along=2)


def test_rails_that_run_clockwise_give_counter_clockwise_triangles() -> None:
    """The turning sense comes from the positions, not from the order of the rails."""
    rails = tuple(Line((0, y), (5, y)) for y in (2.0, 1.0, 0.0))
    pattern = CreasePattern(
        rings=(np.array([[0.0, 0], [5, 0], [5, 2], [0, 2]]),),
        creases=(Crease("crease", rails[1]),),
        rails=rails,
    )
    for kind in KINDS:
        mesh = structured(pattern, along=4, kind=kind)
        assert (winding(mesh) > 0).all()


class TestSheetMesh:
    def mesh(self) -> SheetMesh:
        return structured(annulus_sector(50, 10, 1.0, "valley"), along=4)

    def test_arrays_are_read_only(self) -> None:
        mesh = SheetMesh(
            np.array([[0, 0], [1, 0], [1, 1], [0, 1]]),
            np.array([[0, 1, 2], [0, 2, 3]]),
            edge_sets={"crease:a": np.array([[0, 2]])},
            fold_angles={"a": np.array([0.5])},
            spans=np.ones((5, 2)),
        )
        arrays: list[Any] = [mesh.points, mesh.triangles, mesh.spans]
        arrays += [mesh.edge_sets["crease:a"], mesh.fold_angles["a"]]
        for array in arrays:
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 0
        with pytest.raises(AttributeError):
            mesh.points = np.zeros((4, 3))  # type: ignore[misc]
        for mapping in (mesh.edge_sets, mesh.corners, mesh.folds, mesh.fold_angles, mesh.curves):
            with pytest.raises(TypeError):
                mapping["x"] = 0  # type: ignore[index]

    def test_inputs_are_copied(self) -> None:
        points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
        triangles, edges = np.array([[0, 1, 2]]), np.array([[0, 1]])
        mesh = SheetMesh(points, triangles, edge_sets={"edge:x": edges})
        points[:], triangles[:], edges[:] = 7.0, 0, 2
        assert mesh.points[1].tolist() == [1, 0, 0]
        assert mesh.triangles.tolist() == [[0, 1, 2]]
        assert mesh.edge_sets["edge:x"].tolist() == [[0, 1]]

    def test_two_dimensional_points_lie_in_z_0(self) -> None:
        mesh = SheetMesh(np.array([[0, 0], [3, 0], [0, 4]]), np.array([[0, 1, 2]]))
        assert mesh.points.shape == (3, 3)
        assert mesh.areas.tolist() == [6.0]
        assert mesh.size == 5.0
        assert mesh.flat
        assert not SheetMesh(np.array([[0, 0, 0], [3, 0, 0], [0, 4, 1]]), mesh.triangles).flat

    @pytest.mark.parametrize(
        ("points", "triangles", "more", "words"),
        [
            ([[0, 0], [1, 0], [2, 0]], [[0, 1, 2]], {}, "triangle 0 (nodes [0, 1, 2]) is degenerate"),
            ([[0, 0], [1, 0], [0, 1], [1, 0]], [[0, 1, 2], [1, 3, 2]], {}, "triangle 1"),
            ([[0, 0], [1, 0], [0, 1], [5, 5]], [[0, 1, 2]], {}, "node 3 belongs to no triangle"),
            ([[0, 0], [1, 0], [0, math.nan]], [[0, 1, 2]], {}, "node 2 is not finite"),
            ([0, 1, 2], [[0, 1, 2]], {}, "points must be an array (n, 3)"),
            ([[0, 0], [1, 0], [0, 1]], [[0, 1, 3]], {}, "triangle 0 names a node outside"),
            (
                [[0, 0], [1, 0], [0, 1]],
                [[0, 1, 2]],
                {"edge_sets": {"edge:x": [[0, 3]]}},
                "not joined by an edge",
            ),
            (
                [[0, 0], [1, 0], [0, 1]],
                [[0, 1, 2]],
                {"spans": np.zeros((2, 2))},
                "spans must have one row an edge",
            ),
        ],
    )
    def test_errors(self, points: Any, triangles: Any, more: Any, words: str) -> None:
        with pytest.raises(MeshError) as caught:
            SheetMesh(points, triangles, **more)
        assert words in str(caught.value)
        assert str(caught.value).isprintable()

    def test_places(self) -> None:
        mesh = self.mesh()
        assert mesh.creases == ("crease",)
        assert mesh.folds["crease"] == "valley"
        crease = mesh.nodes("crease:crease")
        np.testing.assert_allclose(np.linalg.norm(mesh.points[crease], axis=1), 50)
        angles = np.arctan2(mesh.points[crease, 1], mesh.points[crease, 0])
        np.testing.assert_allclose(angles, np.linspace(0, 1, 5), atol=1e-14)  # in order along the crease
        assert mesh.nodes("all").tolist() == list(range(len(mesh.points)))
        assert mesh.nodes("node:3").tolist() == [3]
        assert mesh.crease_edges("crease").shape == (4, 2)

    @pytest.mark.parametrize(
        "place", ["", "node:", "node:99", "node:-1", "node:1.5", "node:²", "edge:left", "crease"]
    )
    def test_unknown_places(self, place: str) -> None:
        with pytest.raises(MeshError) as caught:
            self.mesh().nodes(place)
        assert f"'{place}'" in one_line(caught.value)

    def test_unknown_creases(self) -> None:
        with pytest.raises(MeshError, match="no crease 'x'; its creases: crease"):
            self.mesh().crease_edges("x")
        with pytest.raises(MeshError, match="none"):
            structured(strip(4, 2), along=2).crease_edges("x")


def test_errors_are_value_errors_of_one_family() -> None:
    for name in ("PatternError", "MeshError", "FileFormatError"):
        assert issubclass(getattr(meshes, name), InputError)
    assert issubclass(InputError, ValueError)
