"""Drawings written and read back are the same pattern; gaps below the tolerance heal, wherever they are."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import get_args

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

import meshes
from meshes import CreasePattern
from meshes.curves import sample
from meshes.drawn_pattern import pattern_of
from meshes.io import read_pattern, write_pattern
from meshes.io.flat_lines import flat_lines
from meshes.pattern import FoldKind
from meshes.planar import DrawnLine, heal
from meshes.unstructured import sheet_area

FOLDS: st.SearchStrategy[FoldKind] = st.sampled_from(get_args(FoldKind))
SLOW = settings(max_examples=15, deadline=None)


@st.composite
def patterns(draw: st.DrawFn) -> CreasePattern:
    kind = draw(st.sampled_from(["strip", "sector", "ring", "sine", "arcs", "parabolas"]))
    count = draw(st.integers(1, 4))
    folds = [draw(FOLDS) for _ in range(count)]
    size = draw(st.floats(5.0, 500.0))
    steps = np.cumsum([draw(st.floats(0.1, 1.0)) for _ in range(count + 1)])
    if kind == "strip":
        return meshes.strip(size, size, (size * steps[:-1] / steps[-1]).tolist(), folds)
    if kind in ("sector", "ring"):
        radii = (size * (1.0 + steps[:-1])).tolist()
        if kind == "ring":
            return meshes.full_annulus(radii, 0.3 * size, folds)
        return meshes.annulus_sector(radii, 0.3 * size, draw(st.floats(0.2, 6.0)), folds)
    if kind == "sine":
        waves = draw(st.floats(0.5, 3.0))
        return meshes.sine_tessellation(size, size, count, 0.1 * size / count, waves, folds)
    if kind == "arcs":
        return meshes.two_arcs(
            size, size, [0.8 * size, 2.5 * size], [0.35 * size, 0.7 * size], (folds * 2)[:2]
        )
    return meshes.opposite_parabolas(size, 0.3 * size, 0.2 * size, draw(FOLDS))


def drawn(pattern: CreasePattern) -> list[tuple[str, np.ndarray]]:
    return [(line.layer, sample(line.curve, 1e-4)) for line in flat_lines(pattern)]


@settings(max_examples=10, deadline=None)
@given(patterns(), st.sampled_from([".svg", ".dxf"]))
def test_round_trip(pattern: CreasePattern, suffix: str) -> None:
    """Same creases (kind, length, place), same outline; the only freedom of an SVG file is where its origin lies."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"sheet{suffix}"
        write_pattern(file, pattern)
        back = read_pattern(file, tolerance=1e-3)
    low = [np.min([points.min(axis=0) for _, points in drawn(p)], axis=0) for p in (pattern, back)]
    shift = low[0] - low[1] if suffix == ".svg" else np.zeros(2)
    assert abs(sheet_area(back) / sheet_area(pattern) - 1.0) < 1e-3
    theirs = [
        (kind, shapely.LineString(points + shift)) for kind, points in drawn(back) if kind != "boundary"
    ]
    ours = [(kind, shapely.LineString(points)) for kind, points in drawn(pattern) if kind != "boundary"]
    assert len(ours) == len(theirs)
    reach = 5e-3 + 1e-4 * max(line.length for _, line in ours)
    for kind, line in ours:
        near = [
            other
            for word, other in theirs
            if word == kind and shapely.hausdorff_distance(line, other) < reach
        ]
        assert len(near) == 1
    # a second trip changes nothing any more
    assert len(back.rails) == len(pattern.rails)


@SLOW
@given(st.integers(0, 2**32 - 1), st.integers(4, 12), st.floats(1e-3, 0.2))
def test_gaps_below_the_tolerance_heal(seed: int, count: int, gap: float) -> None:
    """A triangulated square whose lines all miss each other by less than the gap has its vertices and faces back."""
    random = np.random.default_rng(seed)
    inside: list[np.ndarray] = []
    while len(inside) < count:  # at least 8 mm apart
        point = random.uniform(8.0, 92.0, 2)
        if all(np.linalg.norm(point - other) > 8.0 for other in inside):
            inside.append(point)
    points = np.vstack(([(0, 0), (100, 0), (100, 100), (0, 100)], inside))
    triangles = Delaunay(points).simplices
    pairs = {tuple(sorted((int(t[i]), int(t[i - 1])))) for t in triangles for i in range(3)}
    heights = [
        2.0
        * abs(np.linalg.det(np.column_stack((points[t], np.ones(3)))))
        / 2.0
        / max(np.linalg.norm(points[t[i]] - points[t[i - 1]]) for i in range(3))
        for t in triangles
    ]
    if min(heights) < 3.0 * gap:  # a sliver is a line drawn twice
        return
    kinds = {
        pair: "boundary"
        if max(pair) < 4 and abs(pair[0] - pair[1]) != 2
        else str(random.choice(["mountain", "valley", "facet"]))
        for pair in pairs
    }

    def jitter() -> np.ndarray:
        angle = random.uniform(0.0, 2.0 * np.pi)
        return 0.49 * gap * random.uniform() * np.array((np.cos(angle), np.sin(angle)))

    lines = []
    for a, b in sorted(pairs):
        ends = [points[a] + jitter(), points[b] + jitter()]
        lines.append(DrawnLine(np.array(ends[:: int(random.choice([1, -1]))]), kinds[a, b], f"{a}-{b}"))
    random.shuffle(lines)
    graph = heal(lines, gap)
    assert (len(graph.points), len(graph.edges)) == (len(points), len(pairs))
    away = np.linalg.norm(graph.points[:, None] - points, axis=2)
    assert away.min(axis=1).max() <= gap
    old = away.argmin(axis=1)
    found = {
        tuple(sorted(old[edge].tolist())): kind for edge, kind in zip(graph.edges, graph.kinds, strict=True)
    }
    assert found == kinds
    pattern = pattern_of(graph, lines)
    assert sum(crease.fold == "valley" for crease in pattern.creases) <= list(kinds.values()).count("valley")


@SLOW
@given(st.integers(0, 2**32 - 1), st.floats(1e-3, 0.5))
def test_t_junctions_heal(seed: int, gap: float) -> None:
    """Lines that stop short of another one, or go beyond it, by less than the gap end on it."""
    random = np.random.default_rng(seed)
    frame = np.array([(0.0, 0.0), (100.0, 0.0), (100.0, 60.0), (0.0, 60.0), (0.0, 0.0)])
    at = np.sort(random.uniform(5.0, 95.0, 3))
    if np.diff(at).min() < 5.0:
        return
    off = 0.95 * gap * random.uniform(-1.0, 1.0, (3, 2))
    lines = [DrawnLine(frame, "boundary", "frame")]
    lines += [
        DrawnLine(np.array([(x, low), (x, 60.0 + high)]), "mountain", f"line {k}")
        for k, (x, (low, high)) in enumerate(zip(at, off, strict=True))
    ]
    pattern = pattern_of(heal(lines, gap), lines)
    assert [crease.fold for crease in pattern.creases] == ["mountain"] * 3
    assert len(pattern.rails) == 5
    # the lines move, not the outline that they meet
    rim = shapely.LinearRing(frame)
    assert max(shapely.distance(rim, shapely.points(pattern.rings[0]))) < 1e-9
    mesh = meshes.unstructured(pattern, size=20.0)
    rim = set(mesh.topology.boundary.ravel().tolist())
    for crease in ("m1", "m2", "m3"):
        edges = mesh.crease_edges(crease)
        assert {int(edges[0, 0]), int(edges[-1, 1])} <= rim
