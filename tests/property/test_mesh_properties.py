"""Any library pattern, meshed in any way, is a valid sheet; and a FOLD file brings it back."""

from __future__ import annotations

import json
import math
import pathlib
import tempfile
from typing import Any, get_args

import numpy as np
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from meshes import CreasePattern, SheetMesh, annulus_sector, full_annulus, strip, structured
from meshes.cells import Kind
from meshes.curves import Arc
from meshes.io import read_fold, write_fold
from meshes.pattern import FoldKind
from meshes.topology import boundary_loops

PROPERTY = settings(
    deadline=None, derandomize=True, max_examples=120, suppress_health_check=[HealthCheck.too_slow]
)
SIZES = st.floats(0.1, 1e3)
KINDS = st.sampled_from(get_args(Kind))


@st.composite
def patterns(draw: st.DrawFn) -> CreasePattern:
    """A strip, sector or annulus with up to four creases, panels of unlike widths, any size."""
    scale = draw(SIZES)
    steps = draw(st.lists(st.floats(0.1, 1.0), min_size=0, max_size=4))
    name = draw(st.sampled_from(["strip", "sector", "annulus"]))
    creases = len(steps) if name == "strip" else len(steps[:3]) + 1
    folds: list[FoldKind] = [draw(st.sampled_from(get_args(FoldKind)[:2])) for _ in range(creases)]
    if name == "strip":
        heights = [scale * h for h in np.cumsum(steps)]
        width = (heights[-1] if heights else 0.0) + scale * draw(st.floats(0.1, 1.0))
        return strip(scale * draw(st.floats(0.5, 20.0)), width, heights, folds)
    width = draw(st.floats(0.1, 0.9))
    radii = [scale * r for r in np.cumsum([1.0, *steps[:3]])]
    if name == "annulus":
        return full_annulus(radii, scale * width, folds)
    return annulus_sector(radii, scale * width, draw(st.floats(0.05, 6.2)), folds)


def exact_area(pattern: CreasePattern) -> float:
    inner, outer = pattern.rails[0], pattern.rails[-1]
    if isinstance(inner, Arc) and isinstance(outer, Arc):
        return 0.5 * inner.sweep * (outer.radius**2 - inner.radius**2)
    return inner.length * float(outer.point(np.zeros(1))[0, 1])


def least_cells(pattern: CreasePattern, rows: int) -> int:
    """Cells along so that no chord of a node line reaches the next line inside (triangles would turn over)."""
    least = 3 if pattern.closed else 1
    for below, above in zip(pattern.rails[:-1], pattern.rails[1:], strict=True):
        if isinstance(below, Arc) and isinstance(above, Arc):
            height = (above.radius - below.radius) / rows
            half_cell = math.acos(max(1.0 - height / above.radius, 0.0))
            least = max(least, math.ceil(0.5 * above.sweep / half_cell * 1.1) + 1)
    return least


@PROPERTY
@given(patterns(), KINDS, st.integers(1, 4), st.integers(0, 20))
def test_meshes_are_valid_sheets(pattern: Any, kind: Any, rows: Any, more: Any) -> None:
    along = least_cells(pattern, rows) + more
    mesh = structured(pattern, along=along, rows=rows, kind=kind)
    topology = mesh.topology

    a, b, c = (mesh.points[mesh.triangles[:, k], :2] for k in range(3))
    signed = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    assert (signed > 0.0).all()  # with the right total, no triangle lies over another
    np.testing.assert_allclose(signed, mesh.areas, rtol=1e-9)

    assert len(mesh.points) - len(topology.edges) + len(mesh.triangles) == (0 if pattern.closed else 1)
    assert len(boundary_loops(topology)) == (2 if pattern.closed else 1)
    assert len(topology.hinges) == int((topology.edge_triangles[:, 1] >= 0).sum())
    uses = np.bincount(topology.triangle_edges.ravel())
    np.testing.assert_array_equal(uses, 1 + (topology.edge_triangles[:, 1] >= 0))

    rim = topology.edge_triangles[:, 1] < 0
    edges = [topology.find_edges(p) for name, p in mesh.edge_sets.items() if name.startswith("edge:")]
    assert sorted(np.concatenate(edges).tolist()) == np.flatnonzero(rim).tolist()
    assert mesh.creases == tuple(crease.name for crease in pattern.creases)
    cells = [len(mesh.crease_edges(crease)) for crease in mesh.creases]
    assert set(cells) <= ({along} if kind != "staggered" or pattern.closed else {along, along + 1})
    for crease in mesh.creases:
        assert not rim[topology.find_edges(mesh.crease_edges(crease))].any()
    assert mesh.spans is not None
    assert np.isfinite(mesh.spans).all()
    assert (mesh.spans >= 0.0).all()


@PROPERTY
@given(patterns(), KINDS, st.integers(1, 3), st.integers(0, 6))
def test_area_converges(pattern: Any, kind: Any, rows: Any, more: Any) -> None:
    along = 2 * least_cells(pattern, rows) + more
    exact = exact_area(pattern)
    errors = [
        abs(structured(pattern, along=n, rows=rows, kind=kind).areas.sum() / exact - 1)
        for n in (along, 2 * along)
    ]
    rail = pattern.rails[0]
    if not isinstance(rail, Arc):
        assert max(errors) < 1e-12
        return
    # chords that span an angle a lose the part a^2 / 6 of their sectors; the hole's chords gain as much, but where its
    # ends are staggered two halves of a chord gain a quarter of one
    angle = rail.sweep / along
    outer = pattern.rails[-1]
    assert isinstance(outer, Arc)
    hole = (1.0 - 0.75 / along if kind == "staggered" else 1.0) * rail.radius**2
    most = angle**2 / 6 * (outer.radius**2 - hole) / (outer.radius**2 - rail.radius**2)
    assert errors[0] <= most * 1.001 + 1e-12
    if errors[0] > 1e-8:
        assert 3.0 <= errors[0] / errors[1] <= 5.0


@PROPERTY
@given(patterns(), KINDS, st.floats(0.2, 20.0), st.integers(1, 3))
def test_aspect_ratio_comes_out(pattern: Any, kind: Any, alpha: Any, rows: Any) -> None:
    """The count of cells is the nearest whole number, and alpha lies between those of the panels."""
    lengths = np.array([rail.length for rail in pattern.rails])
    starts = np.vstack([rail.point(np.zeros(1)) for rail in pattern.rails])
    heights = np.linalg.norm(np.diff(starts, axis=0), axis=1)
    widths = 0.5 * (lengths[:-1] + lengths[1:])
    wanted = alpha / np.mean(heights / rows / widths)
    assume(least_cells(pattern, rows) <= wanted <= 1000)
    mesh = structured(pattern, aspect_ratio=alpha, rows=rows, kind=kind)
    cells = (
        len(mesh.triangles) // ((len(pattern.rails) - 1) * rows) // 2
    )  # staggered rows have one triangle more
    assert abs(cells - wanted) <= 0.5 + 1e-9
    panels = (heights / rows) / (widths / cells)
    assert panels.min() * 0.999 <= mesh.aspect_ratio <= panels.max() * 1.001


@PROPERTY
@given(patterns(), KINDS, st.integers(1, 3), st.integers(0, 8))
def test_the_same_input_gives_the_same_mesh(pattern: Any, kind: Any, rows: Any, more: Any) -> None:
    along = least_cells(pattern, rows) + more
    one, two = (structured(pattern, along=along, rows=rows, kind=kind) for _ in range(2))
    assert one.points.tobytes() == two.points.tobytes()
    assert one.triangles.tobytes() == two.triangles.tobytes()


def round_trip(mesh: SheetMesh, **more: object) -> SheetMesh:
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "sheet.fold"
        write_fold(path, mesh, **more)  # type: ignore[arg-type]
        return read_fold(path)


def edges_of(mesh: SheetMesh, *names: str) -> set[int]:
    found = [mesh.topology.find_edges(mesh.edge_sets[name]) for name in names if name in mesh.edge_sets]
    return set(np.concatenate(found).tolist()) if found else set()


@PROPERTY
@given(patterns(), KINDS, st.integers(1, 3), st.integers(0, 8), st.booleans())
def test_fold_round_trip(pattern: Any, kind: Any, rows: Any, more: Any, angles: Any) -> None:
    mesh = structured(pattern, along=least_cells(pattern, rows) + more, rows=rows, kind=kind)
    if angles:
        drawn = {name: np.linspace(-3.0, 3.0, len(mesh.crease_edges(name))) for name in mesh.creases}
        mesh = SheetMesh(mesh.points, mesh.triangles, mesh.edge_sets, folds=mesh.folds, fold_angles=drawn)
    back = round_trip(mesh)
    np.testing.assert_array_equal(back.points, mesh.points)
    np.testing.assert_array_equal(back.triangles, mesh.triangles)
    np.testing.assert_array_equal(back.topology.edges, mesh.topology.edges)
    for fold in ("mountain", "valley"):
        as_drawn = [f"crease:{name}" for name, kind_ in mesh.folds.items() if kind_ == fold]
        assert edges_of(back, f"crease:{fold}") == edges_of(mesh, *as_drawn)
        # creases that do not touch come back one by one
        chains = {
            frozenset(edges_of(back, f"crease:{c}")) for c in back.creases if c[0] == fold[0] and c != fold
        }
        assert chains == {frozenset(edges_of(mesh, name)) for name in as_drawn}
    rim = set(np.flatnonzero(mesh.topology.edge_triangles[:, 1] < 0).tolist())
    assert edges_of(back, "edge:boundary") == rim
    creases = edges_of(mesh, *(f"crease:{name}" for name in mesh.creases))
    assert edges_of(back, "edge:flat") == set(range(len(mesh.topology.edges))) - rim - creases
    assert "edge:facet" not in back.edge_sets
    for name in mesh.fold_angles:
        at = mesh.topology.find_edges(mesh.crease_edges(name)).tolist()
        drawn = dict(zip(at, mesh.fold_angles[name].tolist(), strict=True))
        fold = mesh.folds[name]
        at = back.topology.find_edges(back.crease_edges(fold)).tolist()
        again = dict(zip(at, back.fold_angles[fold].tolist(), strict=True))
        np.testing.assert_allclose(
            [again[edge] for edge in drawn], list(drawn.values()), rtol=1e-14, atol=1e-15
        )
    twice = round_trip(back)
    assert dict(twice.folds) == dict(back.folds)
    for name, pairs in back.edge_sets.items():
        np.testing.assert_array_equal(twice.edge_sets[name], pairs)


@PROPERTY
@given(patterns(), st.integers(0, 6), st.randoms(use_true_random=False))
def test_edges_alone_bring_back_the_sheet(pattern: Any, more: Any, random: Any) -> None:
    """Panels as polygons: only rim and creases are given, the importer finds faces, holes and triangles."""
    mesh = structured(pattern, along=least_cells(pattern, 1) + 4 + more, kind="one-way")
    names = list(mesh.edge_sets)
    edges = [pair for name in names for pair in mesh.edge_sets[name].tolist()]
    letters = [_letter(mesh, name) for name in names for _ in mesh.edge_sets[name]]
    order = list(range(len(edges)))
    random.shuffle(order)
    data = {
        "vertices_coords": mesh.points[:, :2].tolist(),
        "edges_vertices": [edges[i] for i in order],
        "edges_assignment": [letters[i] for i in order],
    }
    back = _read(data)
    np.testing.assert_array_equal(back.points, mesh.points)
    assert len(back.triangles) == len(mesh.triangles)
    assert math.isclose(back.areas.sum(), mesh.areas.sum(), rel_tol=1e-9)
    for fold in ("mountain", "valley"):
        lines = [mesh.nodes(f"crease:{name}") for name, kind in mesh.folds.items() if kind == fold]
        chains = [name for name in back.creases if name[0] == fold[0] and name != fold]
        assert len(chains) == len(lines)
        assert {frozenset(back.nodes(f"crease:{c}").tolist()) for c in chains} == {
            frozenset(line.tolist()) for line in lines
        }


def _letter(mesh: SheetMesh, name: str) -> str:
    return "B" if name.startswith("edge:") else mesh.folds[name.removeprefix("crease:")][0].upper()


def _read(data: dict[str, Any]) -> SheetMesh:
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "sheet.fold"
        path.write_text(json.dumps(data))
        return read_fold(path)
