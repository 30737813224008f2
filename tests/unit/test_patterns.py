"""Curves, patterns and the library of patterns."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import meshes
from meshes import (
    Arc,
    Crease,
    CreasePattern,
    Line,
    PatternError,
    Polyline,
    annulus_sector,
    full_annulus,
    strip,
)
from meshes.curves import sample
from tests.unit.asked import one_line

SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])


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
