"""Any edges of a sheet can be cut: what is left is a manifold sheet of the same triangles, open just there."""

from __future__ import annotations

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from meshes import full_annulus, strip, structured
from meshes.cuts import open_cuts
from meshes.fans import lips, pieces, take_apart
from meshes.topology import boundary_loops, build

PROPERTY = settings(
    deadline=None, derandomize=True, max_examples=150, suppress_health_check=[HealthCheck.too_slow]
)
MESHES = (
    structured(strip(60, 20, [10.0]), along=6, rows=2, kind="alternating"),
    structured(strip(60, 20, [10.0]), along=6, rows=2),
    structured(full_annulus(20.0, 8.0), along=9, rows=2),
)


@PROPERTY
@given(st.integers(0, len(MESHES) - 1), st.integers(0, 2**31), st.floats(0.02, 0.9))
def test_any_edges(which: int, seed: int, share: float) -> None:
    mesh = MESHES[which]
    chosen = np.random.default_rng(seed).random(len(mesh.topology.edges)) < share
    if not chosen.any():
        return
    opened = take_apart(mesh.points, mesh.triangles, mesh.topology.edges[chosen])
    topology = build(opened.triangles, len(opened.points))

    a, b, c = (opened.points[opened.triangles[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    assert abs(area + sum(opened.fallen) - mesh.areas.sum()) < 1e-9 * mesh.areas.sum()
    if not opened.fallen:
        assert len(opened.triangles) == len(mesh.triangles) + 2 * len(opened.middles)
    # a plane piece with k rims has the Euler characteristic 2 - k; rims that touch themselves would be told
    count = int(pieces(opened.triangles, topology).max()) + 1
    euler = len(opened.points) - len(topology.edges) + len(opened.triangles)
    assert euler == 2 * count - len(boundary_loops(topology))
    # lips are just the edges that were cut inside what is left
    inner = opened.cut & (opened.closed.edge_triangles[:, 1] >= 0)
    assert len(lips(opened.points, topology)) == inner.sum()
    assert pieces(opened.triangles, opened.closed, opened.cut).max() + 1 == count


@PROPERTY
@given(st.integers(1, 12), st.integers(1, 3), st.sampled_from(["staggered", "alternating"]))
def test_a_cut_along_a_crease_of_symmetry_leaves_two_alike(along: int, rows: int, kind: str) -> None:
    mesh = structured(strip(60, 20, [10.0]), along=along, rows=rows, kind=kind)  # type: ignore[arg-type]
    cut = open_cuts(
        mesh, ["crease:crease"] if "crease:crease" in mesh.edge_sets else [f"crease:{mesh.creases[0]}"]
    )
    assert cut.pieces.max() == 1
    first = cut.areas[cut.pieces == 0].sum()
    assert abs(first - 600.0) < 1e-9 * 600.0
    assert len(cut.points) == len(mesh.points) + along + 1
