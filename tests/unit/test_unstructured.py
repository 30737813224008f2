"""Meshes by gmsh: they conform to creases, know their curves, and refuse what cannot be meshed."""

from __future__ import annotations

import math
import signal
import subprocess
import sys

import numpy as np
import pytest

import meshes
from bh import Model, Sheet, trace
from meshes import Arc, Crease, CreasePattern, Line, MeshError

PATTERNS = {
    "sector": meshes.annulus_sector(100.0, 10.0, math.pi / 4),
    "two creases": meshes.annulus_sector((90.0, 100.0), 8.0, 1.0, ("mountain", "valley")),
    "annulus": meshes.full_annulus(40.0, 10.0),
    "strip": meshes.strip(30.0, 10.0, creases=(3.0, 6.0)),
    "no crease": meshes.strip(30.0, 10.0),
}
SIZE = 3.0


def inner_end() -> CreasePattern:
    """A square with a crease that ends inside it."""
    square = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
    sides = [Line(tuple(a), tuple(b)) for a, b in zip(square, np.roll(square, -1, axis=0), strict=True)]
    names = ("inner", "end", "outer", "start")
    return CreasePattern(
        rings=(square,),
        creases=(Crease("cut", Line((0.0, 4.0), (6.0, 5.0))),),
        edges=tuple(zip(names, sides, strict=True)),
    )


@pytest.mark.parametrize("name", PATTERNS)
def test_mesh_is_the_sheet(name: str) -> None:
    pattern = PATTERNS[name]
    mesh = meshes.unstructured(pattern, size=SIZE)
    assert mesh.kind == "gmsh"
    assert mesh.flat
    exact = {
        "sector": 0.5 * math.pi / 4 * (110.0**2 - 90.0**2),
        "two creases": 0.5 * (108.0**2 - 82.0**2),
        "annulus": math.pi * (50.0**2 - 30.0**2),
        "strip": 300.0,
        "no crease": 300.0,
    }[name]
    assert float(mesh.areas.sum()) == pytest.approx(exact, rel=2e-3)
    a, b, c = (mesh.points[mesh.triangles[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0.0).all()  # counter-clockwise from +z
    ends = mesh.points[mesh.topology.edges]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    assert lengths.min() > 0.4 * SIZE
    assert lengths.max() < 1.8 * SIZE
    # the boundary is just the named edges
    named = [mesh.edge_sets[key] for key in mesh.edge_sets if key.startswith("edge:")]
    found = mesh.topology.find_edges(np.vstack(named))
    assert set(found.tolist()) == set(np.flatnonzero(mesh.topology.edge_triangles[:, 1] < 0).tolist())


@pytest.mark.parametrize("name", ["sector", "two creases", "annulus"])
def test_nodes_lie_on_their_curves(name: str) -> None:
    mesh = meshes.unstructured(PATTERNS[name], size=SIZE)
    arcs = {key: curve for key, curve in mesh.curves.items() if isinstance(curve, Arc)}
    assert len(arcs) >= 3
    for key, arc in arcs.items():
        nodes = mesh.nodes(key)
        assert np.linalg.norm(mesh.points[nodes, :2] - arc.centre, axis=1) == pytest.approx(
            arc.radius, rel=1e-12
        )
        pairs = mesh.edge_sets[key]
        assert (pairs[1:, 0] == pairs[:-1, 1]).all()  # in order


def test_crease_that_ends_inside() -> None:
    mesh = meshes.unstructured(inner_end(), size=1.0)
    on = mesh.points[mesh.nodes("crease:cut"), :2]
    assert on[-1] == pytest.approx((6.0, 5.0))
    assert on[:, 1] == pytest.approx(4.0 + on[:, 0] / 6.0, abs=1e-12)
    assert (mesh.topology.edge_hinges[mesh.topology.find_edges(mesh.crease_edges("cut"))] >= 0).all()


def test_corners_are_those_of_structured_meshes() -> None:
    pattern = PATTERNS["sector"]
    one, two = meshes.structured(pattern, along=8), meshes.unstructured(pattern, size=SIZE)
    assert set(two.corners) == set(one.corners)
    for name, node in one.corners.items():
        assert two.points[two.corners[name]] == pytest.approx(one.points[node], abs=1e-12)


def test_same_mesh_again() -> None:
    one, two = (meshes.unstructured(PATTERNS["sector"], size=SIZE) for _ in range(2))
    assert np.array_equal(one.points, two.points)
    assert np.array_equal(one.triangles, two.triangles)


@pytest.mark.parametrize("formulation", ["bars-and-hinges", "consistent"])
def test_it_folds(formulation: str) -> None:
    mesh = meshes.unstructured(PATTERNS["sector"], size=5.0)
    path = trace(Model(mesh, Sheet(E=4000.0, t=0.127), formulation=formulation).fold("crease", to=2.0))
    assert path.outcome == "reached"


@pytest.mark.parametrize("size", [0.0, -1.0, math.nan, math.inf, 1e-3])
def test_bad_sizes(size: float) -> None:
    with pytest.raises(MeshError, match="size"):
        meshes.unstructured(PATTERNS["sector"], size=size)


def test_bad_patterns() -> None:
    with pytest.raises(MeshError, match="cannot be meshed"):
        meshes.unstructured("sector", size=1.0)  # type: ignore[arg-type]
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    with pytest.raises(MeshError, match="names no boundary"):
        meshes.unstructured(CreasePattern(rings=(square,)), size=0.3)
    half = CreasePattern(rings=(square,), edges=(("inner", Line((0.0, 0.0), (1.0, 0.0))),))
    with pytest.raises(MeshError, match="do not enclose"):
        meshes.unstructured(half, size=0.3)


def test_graded_mesh() -> None:
    """Edges have the wanted length at the named lines, and grow no faster than told away from them."""
    near, growth = {"crease:crease": 0.5, "edge:start": 0.8}, 0.3
    mesh = meshes.unstructured(PATTERNS["sector"], size=4.0, near=near, growth=growth)
    topology = mesh.topology
    ends = mesh.points[topology.edges]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    for name, size in near.items():
        along = lengths[topology.find_edges(mesh.edge_sets[name])]
        assert along.max() < 1.15 * size
    middle = ends.mean(axis=1)
    from_crease = np.abs(np.linalg.norm(middle[:, :2], axis=1) - 100.0)
    wanted = np.minimum(np.minimum(0.5 + growth * from_crease, 0.8 + growth * np.abs(middle[:, 1])), 4.0)
    assert (lengths < 1.8 * wanted).all()
    assert 0.8 < np.median(lengths / wanted) < 1.2
    even = meshes.unstructured(PATTERNS["sector"], size=0.5)
    assert len(mesh.triangles) < 0.35 * len(even.triangles)


@pytest.mark.parametrize(
    ("near", "growth", "words"),
    [
        ({"crease:fold": 1.0}, 0.3, ["crease:fold", "crease:crease"]),
        ({"crease:crease": 9.0}, 0.3, ["9.0", "up to size"]),
        ({"crease:crease": 0.0}, 0.3, ["0.0", "up to size"]),
        ({"crease:crease": 1.0}, 0.0, ["growth"]),
    ],
)
def test_gradings_that_cannot_be(near: dict[str, float], growth: float, words: list[str]) -> None:
    with pytest.raises(MeshError) as caught:
        meshes.unstructured(PATTERNS["sector"], size=3.0, near=near, growth=growth)
    assert all(word in str(caught.value) for word in words)


@pytest.mark.skipif(not hasattr(signal, "SIGPIPE"), reason="this system has no SIGPIPE")
@pytest.mark.parametrize("where", ["main thread", "another thread"])
def test_a_broken_pipe_stays_an_error(where: str) -> None:
    """gmsh makes SIGPIPE end the process; a mesh must not change what the process around it does."""
    code = (
        "import os, threading, meshes\n"
        "def mesh():\n"
        "    meshes.unstructured(meshes.strip(30.0, 10.0), size=5.0)\n"
        "thread = threading.Thread(target=mesh)\n"
        f"{'mesh()' if where == 'main thread' else 'thread.start(); thread.join()'}\n"
        "read, write = os.pipe()\n"
        "os.close(read)\n"
        "try:\n"
        "    os.write(write, b'lost')\n"
        "except BrokenPipeError:\n"
        "    print('told')\n"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (ran.returncode, ran.stdout) == (0, "told\n"), ran.stderr
