"""Curves, patterns, topology, structured meshes and the mesh container."""

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
    PatternError,
    Polyline,
    SheetMesh,
    annulus_sector,
    full_annulus,
    strip,
    structured,
)
from meshes.cells import Kind
from meshes.curves import sample
from meshes.topology import boundary_loops, build

KINDS = get_args(Kind)
SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])


def winding(mesh: SheetMesh) -> np.ndarray:
    """Doubled signed area of every triangle as seen from +z."""
    a, b, c = (mesh.points[mesh.triangles[:, k], :2] for k in range(3))
    return (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]


def one_line(error: BaseException) -> str:
    text = str(error)
    assert text.isprintable()
    assert ";" in text  # the thing; the mend
    return text


class TestCurves:
    CURVES = (
        (Line((1, 2), (4, 6)), 5.0, False),
        (Arc((1, 2), 3.0, 0.5, 2.0), 6.0, False),
        (Arc((1, 2), 3.0, 0.5, -2.0), 6.0, False),
        (Arc((0, 0), 2.0, 0.0, 2 * math.pi), 4 * math.pi, True),
        (Polyline(np.array([[0.0, 0], [3, 0], [3, 4], [3, 4.5]])), 7.5, False),
        (Polyline(np.vstack((SQUARE, SQUARE[:1]))), 40.0, True),
    )

    @pytest.mark.parametrize(("curve", "length", "closed"), CURVES)
    def test_length_and_closing(self, curve: Any, length: Any, closed: Any) -> None:
        assert curve.length == pytest.approx(length, rel=1e-14)
        assert curve.closed is closed
        first, last = curve.point(np.array([0.0, 1.0]))
        assert np.allclose(first, last) is closed

    @pytest.mark.parametrize("curve", [curve for curve, *_ in CURVES])
    def test_constant_speed(self, curve: Any) -> None:
        """60000 steps are 1 / 60000 of the length each (chords shorter by less than 1e-9 of it, save at corners)."""
        steps = np.linalg.norm(np.diff(curve.point(np.linspace(0, 1, 60001)), axis=0), axis=1) * 60000
        assert np.quantile(np.abs(steps / curve.length - 1), 0.99) < 1e-8

    def test_points(self) -> None:
        np.testing.assert_allclose(
            Line((1, 2), (4, 6)).point(np.array([0, 0.5, 1])), np.array([[1, 2], [2.5, 4], [4, 6]])
        )
        arc = Arc((1, 2), 3.0, math.pi / 2, math.pi)
        np.testing.assert_allclose(arc.point(np.array([0, 0.5, 1])), [[1, 5], [-2, 2], [1, -1]], atol=1e-15)
        line = Polyline(np.array([[0.0, 0], [3, 0], [3, 1]]))
        np.testing.assert_allclose(line.point(np.array([0.0, 0.75, 1.0])), [[0, 0], [3, 0], [3, 1]])

    @pytest.mark.parametrize("tolerance", [1e-1, 1e-3])
    @pytest.mark.parametrize("radius", [0.05, 5.0, 5000.0])
    def test_samples_keep_the_tolerance(self, radius: float, tolerance: float) -> None:
        arc = Arc((3, 4), radius, 0.3, 5.0)
        points = sample(arc, tolerance)
        middles = 0.5 * (points[1:] + points[:-1]) - [3, 4]
        sagitta = radius - np.linalg.norm(middles, axis=1)
        assert sagitta.max() <= 1.05 * min(tolerance, radius)
        if tolerance < 0.01 * radius:  # and waste no points
            assert sagitta.max() > 0.5 * tolerance
        np.testing.assert_allclose(points[[0, -1]], arc.point(np.array([0.0, 1.0])))

    def test_samples_of_straight_curves(self) -> None:
        assert sample(Line((0, 0), (1, 1))).tolist() == [[0, 0], [1, 1]]
        assert len(sample(Arc((0, 0), 1e-4, 0.0, 2 * math.pi))) >= 9


class TestLibrary:
    def test_strip(self) -> None:
        pattern = strip(30, 10, [2, 5], ["mountain", "valley"])
        assert [rail.point(np.zeros(1))[0].tolist() for rail in pattern.rails] == [
            [0, 0],
            [0, 2],
            [0, 5],
            [0, 10],
        ]
        assert pattern.folds == {"crease-1": "mountain", "crease-2": "valley"}
        assert [name for name, _ in pattern.edges] == ["inner", "outer", "start", "end"]
        assert not pattern.closed
        assert strip(30, 10, [2]).folds == {"crease": "mountain"}
        assert strip(30, 10).creases == ()

    def test_annulus_sector(self) -> None:
        pattern = annulus_sector([80, 90, 110], 5, 1.0, "valley")
        assert [rail.radius for rail in pattern.rails if isinstance(rail, Arc)] == [75, 80, 90, 110, 115]
        assert set(pattern.folds.values()) == {"valley"}
        np.testing.assert_allclose(pattern.rails[0].point(np.zeros(1)), [[75, 0]])  # starts on the x axis
        edges = dict(pattern.edges)
        np.testing.assert_allclose(edges["start"].point(np.array([0.0, 1.0])), [[75, 0], [115, 0]])
        end = [math.cos(1), math.sin(1)] * np.array([[75], [115]])
        np.testing.assert_allclose(edges["end"].point(np.array([0.0, 1.0])), end)

    def test_full_annulus(self) -> None:
        pattern = full_annulus(100, 10)
        assert pattern.closed
        assert len(pattern.rings) == 2
        assert [name for name, _ in pattern.edges] == ["inner", "outer"]

    @pytest.mark.parametrize(
        ("make", "words"),
        [
            (lambda: strip(-1, 10), "length = -1"),
            (lambda: strip(10, 0), "width = 0"),
            (lambda: strip(10, math.nan), "width = nan"),
            (lambda: strip(10, 10, [12]), "strip creases [12.0]"),
            (lambda: strip(10, 10, [6, 3]), "not in order"),
            (lambda: strip(10, 10, [3, 3]), "not in order"),
            (lambda: strip(10, 10, [3, 6], ["mountain"]), "1 folds for 2 creases"),
            (lambda: strip(10, 10, [3], "up"), "crease 'crease': fold 'up'"),  # type: ignore[arg-type]
            (lambda: annulus_sector(-5, 1, 1), "radius = -5"),
            (lambda: annulus_sector(5, -1, 1), "width = -1"),
            (lambda: annulus_sector(5, 1, 0), "angle = 0"),
            (lambda: annulus_sector(5, 1, 7), "angle 7 rad closes"),
            (lambda: annulus_sector(5, 6, 1), "width 6 mm reaches the centre"),
            (lambda: annulus_sector([5, 4], 1, 1), "radii [5.0, 4.0] do not rise"),
            (lambda: annulus_sector([], 1, 1), "radii [] do not rise"),
            (lambda: full_annulus(math.inf, 1), "radius = inf"),
        ],
    )
    def test_errors(self, make: Any, words: str) -> None:
        with pytest.raises(PatternError) as caught:
            make()
        assert words in one_line(caught.value)


class TestPattern:
    @pytest.mark.parametrize(
        ("creases", "words"),
        [
            ([Crease("far", Line((5, 5), (15, 5)))], "crease 'far' leaves the sheet"),
            (
                [Crease("a", Line((0, 0), (10, 10))), Crease("b", Line((0, 10), (10, 0)))],
                "creases 'a' and 'b' cross",
            ),
            (
                [Crease("a", Line((0, 5), (10, 5))), Crease("b", Line((2, 5), (8, 5)))],
                "creases 'a' and 'b' cross",
            ),
            (
                [Crease("a", Line((0, 5), (10, 5))), Crease("a", Line((0, 6), (9, 6)))],
                "crease name 'a' is used twice",
            ),
            (
                [Crease("loop", Polyline(np.array([[0.0, 0], [6, 6], [6, 0], [0, 6]])))],
                "crease 'loop' crosses itself",
            ),
            ([Crease("dot", Line((5, 5), (5, 5)))], "crease 'dot' has no length"),
            ([Crease("lost", Line((5, 5), (5, math.nan)))], "crease 'lost' has no length"),
            ([Crease("void", Arc((5, 5), math.nan, 0.0, 1.0))], "crease 'void' has no length"),
            ([Crease("null", Arc((5, 5), 0.0, 0.0, 1.0))], "crease 'null' has no length"),
        ],
    )
    def test_creases(self, creases: Any, words: str) -> None:
        with pytest.raises(PatternError) as caught:
            CreasePattern(rings=(SQUARE,), creases=tuple(creases))
        assert words in one_line(caught.value)

    @pytest.mark.parametrize(
        ("rings", "words"),
        [
            ((), "no outline"),
            ((SQUARE[:2],), "at least three finite points"),
            ((SQUARE * math.nan,), "at least three finite points"),
            ((SQUARE[[0, 2, 1, 3]],), "not a simple polygon"),
            ((SQUARE[[0, 1, 1, 0]],), "not a simple polygon"),
            ((SQUARE, SQUARE + 20.0), "not a simple polygon"),  # a hole outside
        ],
    )
    def test_outlines(self, rings: Any, words: str) -> None:
        with pytest.raises(PatternError) as caught:
            CreasePattern(rings=rings)
        assert words in str(caught.value)
        assert str(caught.value).isprintable()

    def test_crease_in_a_hole(self) -> None:
        hole = SQUARE * 0.4 + 3.0
        with pytest.raises(PatternError, match="leaves the sheet"):
            CreasePattern(rings=(SQUARE, hole), creases=(Crease("a", Line((0, 5), (10, 5))),))

    def test_what_is_allowed(self) -> None:
        """Creases along the edge of curved sheets, that meet in end points, and closed ones."""
        meeting = (Crease("a", Line((0, 0), (5, 5))), Crease("b", Line((5, 5), (10, 0)), "valley"))
        assert CreasePattern(rings=(SQUARE,), creases=meeting).folds == {"a": "mountain", "b": "valley"}
        round_ = Crease("round", Arc((5, 5), 3.0, 0.0, 2 * math.pi))
        assert not CreasePattern(rings=(SQUARE,), creases=(round_,)).closed

    def test_units_and_folds(self) -> None:
        with pytest.raises(PatternError, match="units 'm' are not known"):
            CreasePattern(rings=(SQUARE,), units="m")  # type: ignore[arg-type]
        with pytest.raises(
            PatternError, match="fold 'Mountain' is not known; use one of mountain, valley, flat"
        ):
            Crease("a", Line((0, 0), (1, 1)), "Mountain")  # type: ignore[arg-type]


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


# --------------------------------------------------------------------------------------- patterns of Fig. 3.7

FIG_3_7 = {
    "sine tessellation": (meshes.sine_tessellation, 5),
    "two arcs": (meshes.two_arcs, 2),
    "canopy": (meshes.parabolic_canopy, 3),
    "opposite parabolas": (meshes.opposite_parabolas, 2),
}


@pytest.mark.parametrize("name", FIG_3_7)
def test_patterns_of_fig_3_7(name: str) -> None:
    """Squares of 100 mm whose creases run from side to side; both kinds of mesh cover them, nodes on the curves."""
    make, count = FIG_3_7[name]
    pattern = make()  # type: ignore[operator]
    assert len(pattern.creases) == count
    for mesh in (meshes.structured(pattern, along=24), meshes.unstructured(pattern, size=6.0)):
        assert mesh.areas.sum() == pytest.approx(1e4)
        assert len(mesh.creases) == count
        assert {f"corner:{a}-{b}" for a in ("inner", "outer") for b in ("start", "end")} <= set(mesh.corners)
        for crease in pattern.creases:
            nodes = mesh.points[mesh.nodes(f"crease:{crease.name}")]
            assert sorted(nodes[[0, -1], 0]) == pytest.approx([0.0, 100.0])


def test_curves_of_fig_3_7() -> None:
    """The equations of the creases, and the senses of the folds."""
    sine = meshes.structured(meshes.sine_tessellation(creases=3, amplitude=5.0, waves=1.5), along=30)
    parabola = meshes.structured(meshes.parabolic_canopy(creases=3, sag=12.0), along=30)
    opposite = meshes.structured(meshes.opposite_parabolas(gap=24.0, sag=10.0), along=30)
    for k in (1, 2, 3):
        x, y, _ = sine.points[sine.nodes(f"crease:crease-{k}")].T
        np.testing.assert_allclose(y, 25.0 * k + 5.0 * np.sin(2.0 * np.pi * 1.5 * x / 100.0), atol=1e-4)
        x, y, _ = parabola.points[parabola.nodes(f"crease:crease-{k}")].T
        np.testing.assert_allclose(y, 25.0 * k + 6.0 - 12.0 * (x / 50.0 - 1.0) ** 2, atol=1e-4)
    for k, sign in ((1, -1.0), (2, 1.0)):
        x, y, _ = opposite.points[opposite.nodes(f"crease:crease-{k}")].T
        np.testing.assert_allclose(y, 50.0 + sign * (12.0 + 10.0 * (x / 50.0 - 1.0) ** 2), atol=1e-4)
    assert list(sine.folds.values()) == ["mountain", "valley", "mountain"]
    assert list(meshes.two_arcs(folds="valley").folds.values()) == ["valley", "valley"]
    assert list(meshes.opposite_parabolas().folds.values()) == ["mountain", "mountain"]


@pytest.mark.parametrize(
    ("words", "make"),
    [
        ("creases = 0", lambda: meshes.sine_tessellation(creases=0)),
        ("creases = 2.5", lambda: meshes.parabolic_canopy(creases=2.5)),  # type: ignore[arg-type]
        ("amplitude = -1", lambda: meshes.sine_tessellation(amplitude=-1.0)),
        ("leaves the sheet", lambda: meshes.sine_tessellation(amplitude=40.0)),
        ("not on a side of the sheet", lambda: meshes.parabolic_canopy(sag=200.0)),
        ("not on a side of the sheet", lambda: meshes.opposite_parabolas(sag=40.0)),
        ("radius 30 mm cannot cross", lambda: meshes.two_arcs(radii=(30.0, 250.0))),
        ("1 radii for 2 arcs", lambda: meshes.two_arcs(radii=(80.0,))),
        ("3 folds for 2 creases", lambda: meshes.two_arcs(folds=["mountain"] * 3)),
        ("cross", lambda: meshes.two_arcs(radii=(250.0, 60.0), at=(40.0, 45.0))),
    ],
)
def test_bad_patterns_of_fig_3_7(words: str, make: object) -> None:
    with pytest.raises(PatternError) as caught:
        make()  # type: ignore[operator]
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
