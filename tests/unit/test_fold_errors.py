"""FOLD files that are refused, in words that name the place."""

from __future__ import annotations

import math
import pathlib
from typing import Any

import numpy as np
import pytest

from meshes import FileFormatError
from meshes.io import read_fold
from tests.unit.fold_objects import SQUARE, Read

TWO_D = SQUARE["vertices_coords"]
BAD: dict[str, tuple[dict[str, Any], str]] = {
    "no vertices": ({"vertices_coords": None}, "no frame has vertices_coords"),
    "empty vertices": ({"vertices_coords": []}, "vertices_coords"),
    "vertices no list": ({"vertices_coords": "abc"}, 'vertices_coords is "abc"'),
    "vertex no list": ({"vertices_coords": [*TWO_D[:4], 5]}, "vertices_coords[4] is 5"),
    "one coordinate": ({"vertices_coords": [[0], *TWO_D[1:]]}, "vertices_coords[0] is a list of 1"),
    "four coordinates": ({"vertices_coords": [[0] * 4, *TWO_D[1:]]}, "vertices_coords[0] is a list of 4"),
    "text": ({"vertices_coords": [[0, "1"], *TWO_D[1:]]}, 'vertices_coords[0] holds "1"'),
    "true": ({"vertices_coords": [[0, True], *TWO_D[1:]]}, "vertices_coords[0] holds true"),
    "null": ({"vertices_coords": [[0, None], *TWO_D[1:]]}, "vertices_coords[0] holds null"),
    "huge": ({"vertices_coords": [[0, 1e300], *TWO_D[1:]]}, "vertices_coords[0] holds 1e+300"),
    "huge integer": ({"vertices_coords": [[0, 10**400], *TWO_D[1:]]}, "vertices_coords[0] holds 1000"),
    "huge unit": ({"vertices_coords": [[0, 1e11], *TWO_D[1:]], "frame_unit": "m"}, "vertices_coords[0] holds"),
    "unit": ({"frame_unit": "furlong"}, 'frame_unit "furlong" is not known; use one of unit, mm'),
    "unit number": ({"frame_unit": 3}, "frame_unit 3"),
    "edge range": ({"edges_vertices": [*SQUARE["edges_vertices"][:7], [4, 5]]}, "edges_vertices[7] is 5; use"),
    "edge negative": ({"edges_vertices": [*SQUARE["edges_vertices"][:7], [4, -1]]}, "edges_vertices[7] is -1"),
    "edge bool": ({"edges_vertices": [*SQUARE["edges_vertices"][:7], [4, True]]}, "edges_vertices[7] is true"),
    "edge float": ({"edges_vertices": [*SQUARE["edges_vertices"][:7], [4, 3.0]]}, "edges_vertices[7] is 3.0"),
    "edge loop": ({"edges_vertices": [*SQUARE["edges_vertices"][:7], [4, 4]]}, "joins vertex 4 to itself"),
    "edge twice": ({"edges_vertices": [*SQUARE["edges_vertices"][:7], [4, 0]]}, "repeats edge 4"),
    "edge of three": ({"edges_vertices": [*SQUARE["edges_vertices"][:7], [4, 0, 1]]}, "is a list of 3"),
    "edge of no face": ({"edges_vertices": [*SQUARE["edges_vertices"][:7], [1, 3]]}, "edge 7 (1-3) is not a side"),
    "assignments short": ({"edges_assignment": ["B"] * 7}, "edges_assignment has 7 entries for 8"),
    "assignment letter": ({"edges_assignment": [*"BBBBMMV", "X"]}, 'edges_assignment[7] is "X"; use one of'),
    "assignment word": ({"edges_assignment": [*"BBBBMMV", "MV"]}, 'edges_assignment[7] is "MV"'),
    "assignment number": ({"edges_assignment": [*"BBBBMMV", 1]}, "edges_assignment[7] is 1"),
    "assignment lines": ({"edges_assignment": [*"BBBBMMV", "a\nb\ud800"]}, r'is "a\nb\ud800"'),
    "border inside": ({"edges_assignment": list("BBBBMMVB")}, "edge 7 (4-3) is assigned B but has a face on both"),
    "crease outside": ({"edges_assignment": list("MBBBMMVF")}, "edge 0 (0-1) is assigned M but has a face on one"),
    "angles short": ({"edges_foldAngle": [0]}, "edges_foldAngle has 1 entries for 8"),
    "angle text": ({"edges_foldAngle": [0] * 7 + ["x"]}, 'edges_foldAngle[7] is "x"'),
    "angle large": ({"edges_foldAngle": [0] * 7 + [181]}, "edges_foldAngle[7] is 181; give degrees"),
    "face of two": ({"faces_vertices": [[0, 1]]}, "faces_vertices[0] is a list of 2"),
    "face no list": ({"faces_vertices": [[0, 1, 4], {}]}, "faces_vertices[1] is an object"),
    "face range": ({"faces_vertices": [[0, 1, 9]]}, "a vertex of faces_vertices[0] is 9; use a whole number from 0"),
    "face slit": ({"faces_vertices": [[0, 1, 4, 1]]}, "faces_vertices[0] uses a vertex twice"),
    "non-manifold": (
        {"vertices_coords": [*TWO_D, [1, 1, 1]], "faces_vertices": [*SQUARE["faces_vertices"], [0, 4, 5]]},
        "edge 4-0 belongs to 3 faces",
    ),
    "no faces or edges": (
        {"edges_vertices": None, "edges_assignment": None, "edges_foldAngle": None, "faces_vertices": None},
        "no faces_vertices and no edges_vertices",
    ),
    "assignments alone": ({"edges_vertices": None}, "for 0 edges_vertices"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_values(read: Read, case: str) -> None:
    changes, words = BAD[case]
    with pytest.raises(FileFormatError) as caught:
        read(SQUARE, **changes)
    assert words in str(caught.value).replace("edge 0-4 belongs", "edge 4-0 belongs")
    assert "sheet.fold" in str(caught.value)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    ("coords", "faces", "words"),
    [
        ([[0, 0], [1, 1], [2, 2]], [[0, 1, 2]], "face 0 (vertices 0, 1, 2) has no area"),
        ([[0, 0, 0], [1, 1, 1], [2, 2, 2], [0, 0, 1]], [[0, 1, 3], [2, 1, 0]], "face 1 (vertices 2, 1, 0) has no area"),
        ([[0, 0], [0, 0], [2, 2], [0, 2]], [[0, 1, 2, 3]], "face 0 (vertices 0, 1, 2, 3) has no area"),
        ([[0, 0], [0, 0], [0, 0]], [[0, 1, 2]], "no area"),
        ([[0, 0], [2, 0], [0, 2], [2, 2.5]], [[0, 1, 2, 3]], "not a simple polygon"),
        ([[0, 0], [2, 0], [2, 1], [1, 1], [1, 1], [0, 1]], [[0, 1, 2, 3, 4, 5]], "merge vertices"),
        ([[0, 0], [2, 0], [2, 2], [0, 1.5]], [[0, 1, 2], [0, 3, 1]], "turned over (folded flat)"),
        ([[0, 0], [1, 0], [0, 1], [5, 0], [6, 0], [5, 1]], [[0, 1, 2], [3, 4, 5]], "one sheet"),
        ([[0, 0], [1, 0], [0, 1], [-1, 0], [0, -1]], [[0, 1, 2], [0, 3, 4]], "one sheet"),
        (  # a fan that turns twice round vertex 0
            [[0, 0], *([math.cos(a), math.sin(a)] for a in np.arange(9) * 1.5)],
            [[0, i, i + 1] for i in range(1, 9)],
            "over each other",
        ),
        (  # a ring of triangles whose first and last touch in vertex 0 only
            [[0, 0], [2, 0], [1, 1], [1, 3], [-1, 3], [-1, 1], [-2, 0], [-3, 5], [3, 5]],
            [[0, 1, 2], [2, 1, 8], [2, 8, 3], [3, 8, 7], [3, 7, 4], [4, 7, 5], [5, 7, 6], [5, 6, 0]],
            "at vertex 0 parts of the sheet touch",
        ),
        (  # a Moebius band of five triangles
            [[math.cos(a), math.sin(a), 0.1 * i] for i, a in enumerate(np.arange(5) * 2 * math.pi / 5)],
            [[i, (i + 1) % 5, (i + 2) % 5] for i in range(5)],
            "one-sided band",
        ),
    ],
)  # fmt: skip
def test_bad_sheets(read: Read, coords: list[list[float]], faces: list[Any], words: str) -> None:
    with pytest.raises(FileFormatError) as caught:
        read(vertices_coords=coords, faces_vertices=faces)
    assert words in str(caught.value)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "the file is empty"),
        (b" \n\t", "the file is empty"),
        (b"{", "this is not JSON"),
        (b"\x89PNG\r\n", "a picture in PNG, not FOLD"),
        (b'{"a": "\xff"}', "byte 7 is not UTF-8"),
        (b"[1, 2]", "the top of the file is a list of 2"),
        (b"null", "the top of the file is null"),
        (b"[" * 100_000, "nested too deeply"),
        (b'{"vertices_coords": ' * 50_000, "nested too deeply"),
        (b'{"vertices_coords": [[NaN, 0]]}', "NaN is not JSON"),
        (b'{"vertices_coords": [[-Infinity, 0]]}', "-Infinity is not JSON"),
        (b'{"vertices_coords": [[1e999, 0]]}', "holds Infinity"),
        (b'{"vertices_coords": [[' + b"1" * 5000 + b", 0]]}", "this is not JSON"),
        (b'{"file_spec": 1.2}', "no frame has vertices_coords"),
    ],
    ids=range(14),
)
def test_bad_files(tmp_path: pathlib.Path, content: bytes, words: str) -> None:
    path = tmp_path / "bad.fold"
    path.write_bytes(content)
    with pytest.raises(FileFormatError) as caught:
        read_fold(path)
    assert words in str(caught.value)
    assert str(caught.value).startswith(f"{path}: ")
    assert str(caught.value).isprintable()


def test_no_file(tmp_path: pathlib.Path) -> None:
    with pytest.raises(FileFormatError, match="folder"):
        read_fold(tmp_path)
    with pytest.raises(FileFormatError, match="No such file"):
        read_fold(tmp_path / "absent.fold")
    with pytest.raises(FileFormatError):
        read_fold(tmp_path / "nul\0.fold")
    odd = tmp_path / "two\nlines.fold"
    odd.write_text("")
    with pytest.raises(FileFormatError) as caught:
        read_fold(odd)
    assert str(caught.value).isprintable()
