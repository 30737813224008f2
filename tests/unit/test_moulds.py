"""Moulds from files: what is read and refused, the force of a faceted cylinder, and that nothing passes through."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh.errors import ModelError, SceneError
from bh.model.serialise import describe, fingerprint, rebuild
from bh.scene.load import parse_scene
from meshes.errors import FileFormatError
from meshes.io.solids import encloses, read_solid
from meshes.topology import Ints

Array = NDArray[np.float64]
SHEET = bh.Sheet(E=4000.0, nu=0.0, t=0.381)
STRIP = meshes.structured(meshes.strip(40.0, 5.0, [2.5], ["flat"]), along=32, rows=1)
SCENE = """
[pattern]
kind = "strip"
length = 40.0
width = 5.0
creases = [2.5]
fold = "flat"
[sheet]
E = 4000.0
t = 0.381
[mesh]
along = 8
[[steps]]
press = { file = "box.stl", unit = "mm", at = [10, 2.5, 0.1], travel = [0, 0, -1] }
"""


def cylinder(radius: float, length: float, facets: int) -> tuple[Array, Ints]:
    """A closed cylinder along y, its middle in the origin."""
    angle = 2.0 * np.pi * (np.arange(facets) + 0.5) / facets
    ring = np.column_stack((radius * np.cos(angle), np.zeros(facets), radius * np.sin(angle)))
    half = np.array([0.0, 0.5 * length, 0.0])
    triangles = []
    for i in range(facets):
        j, far = (i + 1) % facets, facets + i
        triangles += [
            (i, far, j),
            (j, far, facets + j),
            (2 * facets, i, j),
            (2 * facets + 1, facets + j, far),
        ]
    return np.vstack((ring - half, ring + half, -half, half)), np.array(triangles)


def box(size: tuple[float, float, float], at: tuple[float, float, float]) -> tuple[Array, Ints]:
    """A box from a corner."""
    points = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * np.array(size) + at
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return points, np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))])


def write(file: Path, points: Array, triangles: Ints, text: bool = False) -> Path:
    """An STL file, or an OBJ file by its name."""
    if file.suffix == ".obj":
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
        file.write_text(
            "\n".join([*lines, *(f"f {a + 1}//1 {b + 1} {c + 1}" for a, b, c in triangles.tolist())])
        )
    elif text:
        corners = [
            "\n".join(f"vertex {x!r} {y!r} {z!r}" for x, y, z in points[t].tolist()) for t in triangles
        ]
        file.write_text(
            "solid s\n" + "\n".join(f"facet\nouter loop\n{c}\nendloop\nendfacet" for c in corners)
        )
    else:
        facets = b"".join(struct.pack("<12fH", 0, 0, 0, *points[t].ravel(), 0) for t in triangles)
        file.write_bytes(b"solid binary".ljust(80) + struct.pack("<I", len(triangles)) + facets)
    return file


@pytest.mark.parametrize(("name", "text"), [("a.stl", False), ("a.stl", True), ("a.obj", False)])
def test_kinds_of_files(tmp_path: Path, name: str, text: bool) -> None:
    points, triangles = cylinder(2.0, 5.0, 12)
    found, corners = read_solid(write(tmp_path / name, points, triangles[:, ::-1], text))
    assert (len(found), len(corners)) == (len(points), len(triangles))
    assert np.sort(found, axis=0) == pytest.approx(np.sort(points, axis=0), abs=1e-6)
    a, b, c = found[corners].transpose(1, 0, 2)
    volume = np.einsum("tc,tc->", a, np.cross(b, c)) / 6.0  # turned outwards
    assert volume == pytest.approx(5.0 * 6.0 * 4.0 * math.sin(math.pi / 6.0), rel=1e-6)
    assert encloses(
        found, corners, np.array([[0.0, 0, 0], [1.8, 2.4, 0], [1.9, 0, 1.9], [0, 2.6, 0]])
    ).tolist() == [
        True,
        True,
        False,
        False,
    ]


def test_what_meshio_writes_is_read(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    points, triangles = cylinder(2.0, 5.0, 12)
    for name in ("a.stl", "a.obj"):
        meshio.write_points_cells(tmp_path / name, points, [("triangle", triangles)])
        found, corners = read_solid(tmp_path / name)
        assert len(corners) == len(triangles)
        assert found[corners].mean(axis=1).std() == pytest.approx(
            points[triangles].mean(axis=1).std(), rel=1e-6
        )


def test_files_that_cannot_be_are_told_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    points, triangles = box((1.0, 1.0, 1.0), (0.0, 0.0, 0.0))
    cases: dict[str, tuple[Callable[[Path], object], str]] = {
        "open.stl": (lambda f: write(f, points, triangles[1:]), "is not closed: 3 edges"),
        "twisted.stl": (
            lambda f: write(f, points, np.vstack((triangles[1:], triangles[:1, ::-1]))),
            "face the same",
        ),
        "none.stl": (lambda f: f.write_text("solid s\nendsolid s"), "has no triangles with an area"),
        "nothing.stl": (lambda f: f.write_bytes(b""), "is empty or no STL"),
        "cut.stl": (
            lambda f: f.write_bytes(write(f, points, triangles).read_bytes()[:-60]),
            "cut short or no STL",
        ),
        "odd.stl": (
            lambda f: f.write_text("solid s\nvertex 1 2 3\nvertex 1 2 x\nvertex 0 0 0"),
            "no three numbers",
        ),
        "nan.stl": (
            lambda f: f.write_text("solid s\n" + "vertex nan 1 2\n" * 3),
            "no numbers of a bearable size",
        ),
        "odd.obj": (lambda f: f.write_text("v 0 0 0\nf 1 2 3"), "a corner that it does not have"),
        "flat.stl": (
            lambda f: write(f, points[:4], np.array([[0, 1, 2], [0, 2, 1]])),
            "has no inside: its volume is zero",
        ),
        "a.step": (lambda f: f.write_text("x"), "'.step' is no file of a body; give a .stl or an .obj"),
    }
    for name, (make, message) in cases.items():
        make(tmp_path / name)
        with pytest.raises(FileFormatError, match=message) as told:
            read_solid(tmp_path / name)
        assert "\n" not in str(told.value)
    monkeypatch.setenv("BH_LIMIT_SOLID_TRIANGLES", "10")
    for text in (False, True):
        with pytest.raises(
            FileFormatError, match=r"12 solid triangles, more than 10.*BH_LIMIT_SOLID_TRIANGLES"
        ):
            read_solid(write(tmp_path / "many.stl", points, triangles, text))


def test_place_unit_and_turn(tmp_path: Path) -> None:
    file = write(tmp_path / "box.stl", *box((1.0, 2.0, 3.0), (0.0, 0.0, 0.0)))
    mould = bh.Mould.read(file, "cm", at=("1cm", 0.0, 5.0), axis=(0, 0, 2), angle="90deg", by=(0, 0, "-1mm"))
    assert mould.points.min(axis=0) == pytest.approx([-10.0, 0.0, 5.0])
    assert mould.points.max(axis=0) == pytest.approx([10.0, 10.0, 35.0])
    assert mould.by == (0.0, 0.0, -1.0)
    model = bh.Model(STRIP, SHEET).step(mould)
    data, arrays = describe(model)
    again = rebuild(data, arrays)
    assert again.steps[0].actuations[0] == mould
    assert fingerprint(again) == fingerprint(model)
    assert "friction" not in data["steps"][0]["actuations"][0]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('unit = "mm", ', "", r"steps\[0\]\.press\.unit is missing; give the unit of length in the file"),
        ('"mm"', '"kg"', r'steps\[0\]\.press: mould .*"1kg"'),
        ("box.stl", "none.stl", r"steps\[0\]\.press\.file = \"none.stl\" is not there; check the name"),
        ("box.stl", "../box.stl", r"lies outside the folder"),
        ("box.stl", "open.stl", r"steps\[0\]\.press: mould 'mould': open.stl is not closed: 3 edges"),
        ("travel", "radius = 1.0, travel", r"unknown key steps\[0\]\.press\.radius"),
        (
            "travel",
            "axis = [0, 0, 0], travel",
            r"axis = .* cannot be; give three numbers that are not all zero",
        ),
        ("travel", "gap = 0, travel", r"steps\[0\]\.press\.gap = 0 cannot be; give the distance"),
        (
            "travel",
            "friction = -0.1, travel",
            r"steps\[0\]\.press\.friction = -0.1 cannot be; give the coefficient",
        ),
    ],
)
def test_scenes_that_cannot_be(tmp_path: Path, old: str, new: str, message: str) -> None:
    points, triangles = box((1.0, 1.0, 1.0), (0.0, 0.0, 0.0))
    write(tmp_path / "box.stl", points, triangles)
    write(tmp_path / "open.stl", points, triangles[1:])
    assert isinstance(parse_scene(SCENE, tmp_path).model.steps[0].actuations[0], bh.Mould)
    with pytest.raises(SceneError, match=message) as told:
        parse_scene(SCENE.replace(old, new), tmp_path)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("z", "message"),
    [
        (-0.5, "mould 'm' crosses the sheet where the step begins .*; move it away"),
        (0.03, r"a mould starts 0.03 mm from the sheet, nearer than its gap of 0.05 mm; move it away"),
    ],
)
def test_a_mould_that_starts_in_the_sheet_is_refused(z: float, message: str) -> None:
    mould = bh.Mould("m", *box((1.5, 0.2, 1.0), (20.6, 1.0, z)))
    with pytest.raises(ModelError, match=message):
        bh.trace(bh.Model(STRIP, SHEET).step(mould))
    all_of_it = bh.Mould("m", *box((60.0, 10.0, 2.0), (-10.0, -2.0, -1.0)))
    with pytest.raises(ModelError, match=r"mould 'm' starts inside the sheet: \d+ nodes lie in it"):
        bh.trace(bh.Model(STRIP, SHEET).step(all_of_it))


def three_point(facets: int, formulation: str = "consistent", travel: float = 1.5) -> bh.Path:
    """A strip between three cylinders: exact ones where facets is 0."""

    def bar(name: str, x: float, z: float, by: float = 0.0) -> bh.Indenter | bh.Mould:
        if not facets:
            return bh.Indenter(name, (x, 2.5, z), 0.5 * math.pi, 4.0, 4.0, 2.0, by=(0.0, 0.0, by), gap=0.005)
        points, triangles = cylinder(2.0, 12.0, facets)
        return bh.Mould(name, points + np.array([x, 2.5, z]), triangles, by=(0.0, 0.0, by), gap=0.005)

    bars = bar("left", 5.0, -2.00501), bar("right", 35.0, -2.00501), bar("top", 20.0, 2.00501, -travel)
    model = bh.Model(STRIP, SHEET, contact=False, formulation=formulation)
    return bh.trace(model.step(*bars, bh.Tether("all", (1e-3, 1e-3, 1e-6))))


def test_a_faceted_cylinder_presses_like_the_exact_one() -> None:
    exact = three_point(0)[-1].contact_forces["top"][2]
    found = [three_point(facets) for facets in (12, 96)]
    for path in found:
        assert path.reached, path.steps[-1].reason
        balance = sum(path[-1].contact_forces.values())
        assert balance == pytest.approx(np.zeros(3), abs=1e-3)  # tethers have the rest
        pairs = list(zip(list(path)[:-1], list(path)[1:], strict=True))
        work = sum(
            -0.5 * 1.5 * (a.contact_forces["top"][2] + b.contact_forces["top"][2]) * (b.lam - a.lam)
            for a, b in pairs
        )
        assert path[-1].energy.total + path[-1].energy.contact == pytest.approx(work, rel=0.02)
    errors = [path[-1].contact_forces["top"][2] / exact - 1.0 for path in found]
    assert abs(errors[0]) < 0.03
    assert abs(errors[1]) < 0.015
    assert abs(errors[1]) < abs(errors[0])


def test_bars_and_hinges_feel_a_mould() -> None:
    path = three_point(24, "bars-and-hinges", travel=0.5)
    assert path.reached
    exact = three_point(0, "bars-and-hinges", travel=0.5)
    assert path[-1].contact_forces["top"][2] == pytest.approx(exact[-1].contact_forces["top"][2], rel=0.05)


def test_derivatives_with_a_moving_mould() -> None:
    """Energy, gradient, tangent, rates with lambda: differences agree."""
    path = three_point(24)
    system, record = path.solved(-1)
    q, lam = record.q, record.lam
    h = 1e-7
    rate = (system.evaluate(q, lam + h).residual - system.evaluate(q, lam - h).residual) / (2.0 * h)
    assert system.control_rate(q, lam) == pytest.approx(rate, rel=1e-4, abs=1e-5 * np.abs(rate).max())
    power = (system.evaluate(q, lam + h).energy - system.evaluate(q, lam - h).energy) / (2.0 * h)
    assert system.power(q, lam) == pytest.approx(power, rel=1e-5)
    second = (system.power(q, lam + h) - system.power(q, lam - h)) / (2.0 * h)
    assert system.control_stiffness(q, lam) == pytest.approx(second, rel=1e-4)
    v = np.random.default_rng(1).normal(size=len(q))
    d = 1e-7 / np.abs(v).max()
    along = (system.evaluate(q + d * v, lam).residual - system.evaluate(q - d * v, lam).residual) / (2.0 * d)
    tangent = system.tangent(q, lam, system.evaluate(q, lam).forces).matrix
    assert tangent @ v == pytest.approx(along, rel=1e-4, abs=1e-4 * np.abs(along).max())


def test_nothing_passes_through_a_narrow_punch() -> None:
    """Its point meets the middle of a triangle, where bars have no points to be felt by."""
    top = np.array([[18.0, 2.0, 5.0], [22.0, 2.0, 5.0], [20.0, 5.0, 5.0], [20.9, 1.6, 0.06]])
    sides = np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])
    punch = bh.Mould("punch", top, sides, by=(0.0, 0.0, -3.0))
    model = bh.Model(STRIP, SHEET, contact=False).support("edge:start").support("edge:end").step(punch)
    path = bh.trace(model)
    assert path.reached, path.steps[-1].reason
    tip = top[3, 2] - 3.0
    under = path[-1].points[:, 2].min()
    assert under < tip
    force = path[-1].contact_forces["punch"]
    held = path[-1].reactions.sum(axis=0)
    assert held + force == pytest.approx(np.zeros(3), abs=1e-5 * float(np.abs(held).max()))
