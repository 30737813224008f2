"""read_fold on damaged files: a valid sheet or one line that says what is wrong, never anything else."""

from __future__ import annotations

import copy
import json
import math
import pathlib
import tempfile
from typing import Any

import numpy as np
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from meshes import FileFormatError, SheetMesh
from meshes.io import read_fold

FUZZ = settings(
    deadline=None, derandomize=True, max_examples=250, suppress_health_check=[HealthCheck.too_slow]
)


def _crossed_square() -> dict[str, Any]:
    """Four triangles round a vertex, two creases, drawn fold angles, a folded state that inherits."""
    return {
        "file_spec": 1.2,
        "frame_unit": "cm",
        "vertices_coords": [[0, 0], [2, 0], [2, 2], [0, 2], [1, 1]],
        "edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [4, 2], [1, 4], [4, 3]],
        "edges_assignment": ["B", "B", "B", "B", "M", "M", "V", "F"],
        "edges_foldAngle": [0, 0, 0, 0, -90, -90, 30.5, 0],
        "faces_vertices": [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
        "file_frames": [
            {
                "frame_inherit": True,
                "frame_parent": 0,
                "vertices_coords": [[0, 0, 0], [2, 0, 0.1], [2, 2, 0], [0, 2, 0.3], [1, 1, 0.5]],
            },
            {"frame_inherit": True, "frame_parent": 1, "frame_unit": "in"},
        ],
    }


def _ring() -> dict[str, Any]:
    """An annulus without faces: holes, curved sides, faces with inner rings."""
    count = 8
    rings = [
        [[r * math.cos(2 * math.pi * i / count), r * math.sin(2 * math.pi * i / count)] for i in range(count)]
        for r in (1.0, 2.0, 3.0)
    ]
    edges = [[k * count + i, k * count + (i + 1) % count] for k in range(3) for i in range(count)]
    letters = ["B"] * count + ["V"] * count + ["B"] * count
    points = [point for ring in rings for point in ring]
    return {"vertices_coords": points, "edges_vertices": edges, "edges_assignment": letters}


def _polygons() -> dict[str, Any]:
    """A concave face, a quadrilateral and vertices on straight sides."""
    return {
        "vertices_coords": [[0, 0], [1, 0], [2, 0], [3, 0], [3, 2], [2, 1], [0, 2], [0, 1], [3, -1], [0, -1]],
        "edges_vertices": [[0, 1], [1, 2], [2, 3]],
        "edges_assignment": ["V", "V", "U"],
        "faces_vertices": [[0, 1, 2, 3, 4, 5, 6, 7], [9, 8, 3, 2, 1, 0]],
    }


SEEDS = [_crossed_square(), _ring(), _polygons()]
NUMBERS = st.one_of(
    st.integers(-3, 30),
    st.sampled_from([10**400, -(10**30), 1e308, -1e308, 1e-320, 5e-324, 1e12, 180.0, 181, 0.5, -0.0, 1e-9]),
    st.floats(-4.0, 4.0),
)
VALUES = st.one_of(
    st.none(),
    st.booleans(),
    NUMBERS,
    st.sampled_from(
        ["", "M", "V", "B", "F", "U", "C", "J", "MV", "x\ny", "\ud800", "mm", "furlong", "0" * 99]
    ),
    st.lists(st.integers(-1, 10), max_size=4),
    st.lists(NUMBERS, min_size=2, max_size=3),
    st.just({}),
    st.just({"a": [1]}),
    st.sampled_from([[[]], [[[]]], [None], [[0, 1, 2]], [[0, 1]], [[0.0, 1.0]]]),
)


def _places(value: object, place: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The path of keys and indices to everything inside `value`."""
    found = [place] if place else []
    if isinstance(value, dict):
        items = list(value.items())
    else:
        items = list(enumerate(value)) if isinstance(value, list) else []
    for key, inside in items:
        found += _places(inside, (*place, key))
    return found


@st.composite
def damaged(draw: st.DrawFn) -> dict[str, Any]:
    """A seed with a few entries deleted, doubled, exchanged or replaced."""
    data: dict[str, Any] = copy.deepcopy(draw(st.sampled_from(SEEDS)))
    for _ in range(draw(st.integers(1, 3))):
        places = _places(data)
        if not places:
            break
        *way, key = draw(st.sampled_from(places))
        inside: Any = data
        for step in way:
            inside = inside[step]
        action = draw(st.sampled_from(["replace", "replace", "delete", "double", "swap"]))
        if action == "delete":
            del inside[key]
        elif action == "double" and isinstance(inside, list):
            inside.insert(key, copy.deepcopy(inside[key]))
        elif action == "swap" and isinstance(inside, list):
            inside[key], inside[-1] = inside[-1], inside[key]
        else:
            inside[key] = copy.deepcopy(draw(VALUES))  # a strategy may hand out one object twice
    return data


def _survives(data: bytes, frame: int | None = None) -> SheetMesh | None:
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "sheet.fold"
        path.write_bytes(data)
        try:
            mesh = read_fold(path, frame)
        except FileFormatError as error:
            text = str(error)
            assert text.isprintable()
            assert str(path) in text
            assert len(text) < len(str(path)) + 300
            return None
    assert isinstance(mesh, SheetMesh)
    _is_sheet(mesh)
    return mesh


def _is_sheet(mesh: SheetMesh) -> None:
    topology = mesh.topology
    assert (mesh.areas > 0.0).all()
    rim = topology.edge_triangles[:, 1] < 0
    for name, pairs in mesh.edge_sets.items():
        on_rim = rim[topology.find_edges(pairs)]
        assert on_rim.all() if name == "edge:boundary" else not on_rim.any()
    named = np.concatenate([topology.find_edges(pairs) for pairs in mesh.edge_sets.values()])
    assert len(np.unique(named)) == len(topology.edges)
    if mesh.flat:
        a, b, c = (mesh.points[mesh.triangles[:, k], :2] for k in range(3))
        assert ((b - a)[:, 0] * (c - a)[:, 1] > (b - a)[:, 1] * (c - a)[:, 0]).all()


def test_seeds_are_valid() -> None:
    for seed in SEEDS:
        mesh = _survives(json.dumps(seed).encode())
        assert mesh is not None
        assert "crease:valley" in mesh.edge_sets
    for frame in (0, 1, 2):
        assert _survives(json.dumps(SEEDS[0]).encode(), frame) is not None


@FUZZ
@given(damaged(), st.sampled_from([None, None, 0, 1, 2, 3, -1]))
@example({**SEEDS[0], "faces_vertices": [[0, 1, 4]] * 3}, None)
@example({**SEEDS[0], "edges_assignment": ["\ud800"] * 8}, None)
@example({**SEEDS[0], "file_frames": [{"frame_inherit": True, "frame_parent": 1}]}, 1)
def test_damaged_values(data: Any, frame: Any) -> None:
    _survives(json.dumps(data).encode(), frame)


@FUZZ
@given(st.sampled_from(SEEDS), st.data())
def test_damaged_bytes(seed: Any, data: Any) -> None:
    text = bytearray(json.dumps(seed).encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, max(len(text) - 1, 0)))
        size = data.draw(st.integers(0, 3))
        text[at : at + size] = data.draw(
            st.binary(max_size=3) | st.sampled_from([b"-", b"e9", b"]", b"0", b"1,"])
        )
    if data.draw(st.booleans()):
        del text[data.draw(st.integers(0, len(text))) :]
    _survives(bytes(text))


@FUZZ
@given(st.binary(max_size=60))
@example(b"")
@example(b" \n")
@example(b"\xef\xbb\xbf{}")
@example(b"[" * 200_000)
@example(b'{"a":' * 200_000)
@example(b'{"vertices_coords": ' + b"[" * 700 + b"]" * 700 + b"}")
@example(b'{"vertices_coords": [[NaN, 0]]}')
@example(b'{"vertices_coords": [[1e999, 0]], "edges_vertices": [[0, 0]]}')
@example(b'{"vertices_coords": [[' + b"9" * 5000 + b", 0]]}")
def test_random_bytes(data: Any) -> None:
    assert _survives(data) is None


@settings(FUZZ, max_examples=60)
@given(
    st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4)), min_size=3, max_size=12),
    st.lists(st.tuples(st.integers(0, 11), st.integers(0, 11), st.sampled_from("BMVFUCJ")), max_size=25),
)
def test_random_graphs(points: Any, edges: Any) -> None:
    edges = [(a % len(points), b % len(points), letter) for a, b, letter in edges]
    data = {
        "vertices_coords": points,
        "edges_vertices": [[a, b] for a, b, _ in edges],
        "edges_assignment": [letter for _, _, letter in edges],
    }
    _survives(json.dumps(data).encode())


@settings(FUZZ, max_examples=60)
@given(
    st.lists(st.tuples(*[st.integers(0, 3)] * 3), min_size=3, max_size=8),
    st.lists(st.lists(st.integers(0, 7), min_size=3, max_size=5), min_size=1, max_size=5),
)
def test_random_faces(points: Any, faces: Any) -> None:
    faces = [[v % len(points) for v in face] for face in faces]
    _survives(json.dumps({"vertices_coords": points, "faces_vertices": faces}).encode())
