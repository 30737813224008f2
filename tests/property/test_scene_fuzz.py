"""Scenes that are changed at random: a scene or one line of complaint, and nothing else."""

import datetime
import json
from collections.abc import Iterator
from copy import deepcopy
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bh.errors import InputError
from bh.scene.load import Scene, parse_scene

SCENES = [
    {
        "pattern": {
            "kind": "annulus_sector",
            "radius": [100.0, 112.0],
            "width": 10.0,
            "angle": 0.4,
            "fold": "valley",
        },
        "sheet": {"E": 4000.0, "nu": 0.38, "t": 0.127},
        "mesh": {"kind": "alternating", "aspect_ratio": 4.0, "rows": 1},
        "model": {"formulation": "bars-and-hinges"},
        "supports": [
            {"at": "edge:inner", "fix": "xyz"},
            {"at": "node:12", "fix": [[0.0, 0.0, 1.0]]},
            {"at": "rigid-body"},
        ],
        "creases": {"crease-1": {"Lstar": 25.0, "rest": 3.0}},
        "steps": [
            {"fold": [{"crease": "crease-1", "rest": 2.5}, {"crease": "crease-2", "to": 2.5}]},
            {"force": {"at": "edge:outer", "total": [0.0, 0.0, 0.1]}, "moment": {"crease": "all", "to": 0.1}},
            {"displace": {"at": "corner:outer-end", "direction": [0, 0, 1.0], "by": 0.1}},
        ],
        "outputs": {"pictures": False, "vtu": True},
    },
    {
        "pattern": {
            "kind": "strip",
            "length": 50,
            "width": 20,
            "creases": [5, 10.0],
            "fold": ["mountain", "valley"],
        },
        "sheet": {"E": 1, "t": 0.1},
        "mesh": {"along": 5},
        "steps": [{"fold": {"crease": "all", "by": 0.5, "stiffness": 2.0}}],
    },
    {
        "pattern": {"kind": "full_annulus", "radius": 50.0, "width": 5},
        "sheet": {"E": 4000.0, "t": 0.1},
        "mesh": {"kind": "mirrored", "along": 12, "rows": 2},
        "steps": [{"fold": {"crease": "crease", "to": [3.0] * 12}}],
    },
    {
        "pattern": {"file": "sheet.fold", "frame": 0},
        "sheet": {"E": 4000.0, "t": 0.1},
        "steps": [{"fold": {"crease": "m1", "by": "drawn"}}],
    },
]
SQUARE = {
    "vertices_coords": [[0, 0], [10, 0], [10, 10], [0, 10]],
    "faces_vertices": [[0, 1, 2], [0, 2, 3]],
    "edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [0, 2]],
    "edges_assignment": ["B", "B", "B", "B", "M"],
    "edges_foldAngle": [0, 0, 0, 0, -60],
}
WORDS = [
    "", "x", "all", "crease", "crease-1", "edge:inner", "edge:", "node:0", "node:-1", "node:٣", "node:²", "corner:",
    "rigid-body", "drawn", "strip", "full_annulus", "gmsh", "mountain", "one-way", "sheet.fold", "..",
    "a\nb\0", "é\u2028",
]  # fmt: skip
NUMBERS = [
    0, 1, -1, 2, 3, 7, 90, 10**7, -(10**30), 2**63, 0.0, -0.0, 0.5, 1e-300, 5e-324, 1e-9, 1e5, 1e9, 1e308, -1e308,
    3.14, 6.2831853, float("nan"), float("inf"), float("-inf"),
]  # fmt: skip
JUNK = st.one_of(
    st.sampled_from(NUMBERS),
    st.sampled_from(WORDS),
    st.booleans(),
    st.floats(-1e3, 1e3),
    st.text(max_size=8),
    st.lists(st.sampled_from([0, 1.0, -2, "x", 1e300, [0, 0, 1], {}]), max_size=4),
    st.dictionaries(
        st.sampled_from(["kind", "at", "crease", "to", "x"]), st.sampled_from([1, "x", "crease"]), max_size=2
    ),
    st.just(datetime.date(1979, 5, 27)),
)
KEYS = [
    "at",
    "fix",
    "kind",
    "file",
    "fold",
    "force",
    "pinch",
    "crease",
    "to",
    "by",
    "rest",
    "Lstar",
    "each",
    "along",
    "x y",
]


def written(value: Any) -> Any:
    """TOML, all on one line below the top level."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {written(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(written, value)) + "]"
    if isinstance(value, str):
        return (
            '"' + "".join(f"\\U{ord(c):08x}" if c in '"\\' or not c.isprintable() else c for c in value) + '"'
        )
    if isinstance(value, bool):
        return str(value).lower()
    return value.isoformat() if isinstance(value, datetime.date) else repr(value)


def text_of(scene: Any) -> Any:
    return "".join(f"{json.dumps(key)} = {written(value)}\n" for key, value in scene.items())


def places(value: Any, above: Any = ()) -> Iterator[Any]:
    """Paths to everything in nested tables and lists."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, each in items:
        yield (*above, key)
        yield from places(each, (*above, key))


@st.composite
def changed_scenes(draw: Any) -> Any:
    scene = deepcopy(draw(st.sampled_from(SCENES)))
    for _ in range(draw(st.integers(1, 3))):
        found = list(places(scene))
        if not found:
            break
        *above, key = draw(st.sampled_from(found))
        home = scene
        for each in above:
            home = home[each]
        what = draw(st.sampled_from(["put", "put", "put", "remove", "rename", "wrap", "add"]))
        if what == "put":
            home[key] = deepcopy(draw(JUNK))
        elif what == "wrap":
            home[key] = [deepcopy(home[key]) for _ in range(draw(st.integers(0, 3)))]
        elif what == "rename" and isinstance(home, dict):
            home[draw(st.sampled_from(KEYS))] = home.pop(key)
        elif what == "add" and isinstance(home[key], dict):
            home[key][draw(st.sampled_from(KEYS))] = deepcopy(draw(JUNK))
        else:
            del home[key]
    return scene


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Any:
    place = tmp_path_factory.mktemp("scenes")
    (place / "sheet.fold").write_text(json.dumps(SQUARE))
    return place


def scene_or_one_line(text: Any, folder: Any) -> None:
    try:
        assert isinstance(parse_scene(text, folder), Scene)
    except InputError as error:
        message = str(error)
        assert message.startswith("scene: ")
        assert message.isprintable()
        assert len(message) < 700
        message.encode()


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene["pattern"].get("kind", "file"))
def test_the_scenes_are_right(scene: Any, folder: Any) -> None:
    assert isinstance(parse_scene(text_of(scene), folder), Scene)


COMMON: dict[str, Any] = {
    "deadline": None,
    "suppress_health_check": [HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
}


@given(changed_scenes())
@settings(max_examples=300, **COMMON)
def test_changed_values(folder: Any, scene: Any) -> None:
    scene_or_one_line(text_of(scene), folder)


@given(st.sampled_from(SCENES), st.data())
@settings(max_examples=150, **COMMON)
def test_changed_characters(folder: Any, scene: Any, data: Any) -> None:
    text = text_of(scene)
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text)))
        gone = data.draw(st.integers(0, 3))
        text = (
            text[:at]
            + data.draw(st.text(st.sampled_from('[]{}=",.#\n\\-e0 x\0\u00e9'), max_size=3))
            + text[at + gone :]
        )
    scene_or_one_line(text, folder)


@given(st.text(max_size=60))
@settings(max_examples=50, **COMMON)
def test_any_text(folder: Any, text: Any) -> None:
    scene_or_one_line(text, folder)
