"""Self-contact: where a sheet passes through itself. It is found and reported, the solver does not prevent it.

Panels that meet at a hinge are kept apart by `Model.hinge_lock`; all others can pass through each other without the
solver's notice, and states beyond that are no longer those of a real sheet. The sheet is taken as its middle surface,
without thickness. A state is looked at in three stages, each of which only sees what the one before could not rule out:

1. if all triangles face the same way from some direction and the boundary, seen from there, is that of one region
   covered once, then so is every point inside, and the sheet cannot meet itself (`bh.analysis.projection`);
2. triangles whose boxes meet are intersected until a pair is found, in one compiled sweep (`meets_itself` there);
3. all pairs: by an STR tree of shapely.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bh.formulations.state import State
from bh.loading.load_step import crease_hinges
from bh.paths.path import Path
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]
TOLERANCE = 1e-9  # of the sheet's size: distances and overlaps up to this are touching


@dataclass(frozen=True, eq=False)
class Panels:
    """The parts of a sheet between its creases.

    Attributes:
        of_triangle: (t,) number of the panel of each triangle, from 0 in the order of the triangles.
        creases: of each panel the creases that bound it, in the mesh's order; wide ones by their own name.
        strips: numbers of those that are the strip of a wide crease.
    """

    of_triangle: Ints
    creases: tuple[tuple[str, ...], ...]
    strips: frozenset[int] = frozenset()

    @classmethod
    def of(cls, mesh: SheetMesh) -> Panels:
        """Connected parts of the triangles after cutting along all creases.

        An edge with several names counts for the shortest of those creases (FOLD files name all mountains, and each
        chain of them).
        """
        import scipy.sparse as sp
        from scipy.sparse.csgraph import connected_components

        topology, count = mesh.topology, len(mesh.triangles)
        names = mesh.creases
        owner = np.full(len(topology.edges), -1)
        for k in sorted(range(len(names)), key=lambda k: -len(mesh.crease_edges(names[k]))):
            owner[topology.find_edges(mesh.crease_edges(names[k]))] = k
        one, two = topology.edge_triangles.T
        joined = (two >= 0) & (owner < 0)
        graph = sp.coo_array((np.ones(joined.sum()), (one[joined], two[joined])), shape=(count, count))
        labels = connected_components(graph, directed=False)[1].astype(np.int64)
        # number them in the order of their first triangles
        rank = np.argsort(np.argsort(np.unique(labels, return_index=True)[1]))
        labels = rank[labels]
        bounding: list[set[int]] = [set() for _ in range(labels.max() + 1)]
        for side in (one, two):
            at = (owner >= 0) & (side >= 0)
            for panel, crease in np.unique(np.column_stack((labels[side[at]], owner[at])), axis=0).tolist():
                bounding[panel].add(crease)
        drawn = [mesh.side_of.get(name, name) for name in names]
        found = tuple(tuple(dict.fromkeys(drawn[k] for k in sorted(each))) for each in bounding)
        both = (i for i, each in enumerate(bounding) if len(each) == 2 and len(found[i]) == 1)
        return cls(labels, found, frozenset(both))

    def name(self, panel: int) -> str:
        """A panel in words: "panel 2 (between crease-1 and crease-2)", "panel 1 (strip of crease)", "panel 0"."""
        creases = self.creases[panel]
        if not creases:
            return f"panel {panel}"
        where = (
            f"{'strip of' if panel in self.strips else 'at'} {creases[0]}"
            if len(creases) == 1
            else f"between {', '.join(creases[:-1])} and {creases[-1]}"
        )
        return f"panel {panel} ({where})"


@dataclass(frozen=True, eq=False)
class Contact:
    """Self-contact in a state of a path.

    Attributes:
        state: index of the state.
        step: number of its step.
        lam: lambda of the state.
        triangles: (k, 2) pairs of triangles that intersect, the lower one first.
        panels: pairs of panels that they belong to, in words, without repetition.
    """

    state: int
    step: int
    lam: float
    triangles: Ints
    panels: tuple[tuple[str, str], ...]

    def __str__(self) -> str:
        """One line: "state 4 (step 0, lambda 0.61), panel 0 (at crease-1) and panel 2 (at crease-2)"."""
        shown = "; ".join(f"{a} and {b}" if a != b else f"{a} and itself" for a, b in self.panels[:3])
        more = f"; and {len(self.panels) - 3} more pairs" if len(self.panels) > 3 else ""
        return f"state {self.state} (step {self.step}, lambda {self.lam:.4g}), {shown}{more}"


def least_angle(mesh: SheetMesh, crease: str, t: float) -> Array:
    """How far a crease closes where panels stop each other by their thickness: angle between its triangles, rad.

    It is 2 asin(t / (2 h)) with h the height of the triangles beside it, the width of the panels where they have one
    row of cells: there their corners come to rest t apart. A panel of several rows bends beyond and lies on the other
    one. Without that (`contact=False`, or a gap in its place) a hinge stops within its lock, the last 2 degrees
    (`Model.hinge_lock`), at an angle that depends on what closes it.

    Args:
        mesh: of the sheet.
        crease: its name.
        t: thickness, mm.

    Returns:
        (edges,) in order along the crease; pi where triangles are no wider than half the thickness.
    """
    topology = mesh.topology
    hinges = crease_hinges(mesh, crease)
    ends = mesh.points[topology.hinges[hinges, 1:3]]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    areas = mesh.areas[topology.edge_triangles[topology.hinge_edges[hinges]]].min(axis=1)
    return np.asarray(2.0 * np.arcsin(np.minimum(1.0, 0.5 * t * lengths / (2.0 * areas))))


def self_contact(state: State) -> Ints:
    """(k, 2) pairs of triangles of a state that intersect, the lower one first, sorted; empty without self-contact.

    Neighbours count where they meet beyond the node or edge that they share: those of a closed hinge lie in one plane.
    """
    return _Detector(state.mesh).pairs(state.points)


def first_contact(path: Path | Iterable[State]) -> Contact | None:
    """The first state of a path in which the sheet meets itself, or None.

    Looks at the accepted states only: what happens between two of them is not seen.
    """
    detector: _Detector | None = None
    for index, (mesh, points, step, lam) in enumerate(_shapes(path)):
        if detector is None or detector.mesh is not mesh:
            detector = _Detector(mesh)
        pairs = detector.pairs(points)
        if len(pairs):
            panels = Panels.of(mesh)
            met = np.unique(np.sort(panels.of_triangle[pairs], axis=1), axis=0).tolist()
            words = tuple((panels.name(a), panels.name(b)) for a, b in met)
            return Contact(index, step, lam, pairs, words)
    return None


def _shapes(path: Path | Iterable[State]) -> Iterator[tuple[SheetMesh, Array, int, float]]:
    """Mesh, positions (n, 3), step and lambda of every state; those of a path without what else a state knows."""
    if isinstance(path, Path):
        for record in path.records:
            points = path.system(record.step).positions(record.q, record.lam)
            yield path.model.mesh, points, record.step, record.lam
    else:
        for state in path:
            yield state.mesh, state.points, state.step, state.lam


def candidates(points: Array, triangles: Ints, margin: float = 0.0) -> Ints:
    """(k, 2) pairs of triangles whose boxes, wider by `margin` (mm), meet; the lower one first.

    Args:
        points: (n, 3), mm.
        triangles: (t, 3).
        margin: mm.

    Returns:
        (k, 2) pairs of triangles whose boxes, wider by the margin, meet; the lower one first.
    """
    import shapely

    corners = points[triangles]
    low, high = corners.min(axis=1) - 0.5 * margin, corners.max(axis=1) + 0.5 * margin
    # the two axes of largest extent tell boxes apart best; the third one is checked afterwards
    z, x, y = np.argsort(np.ptp(points, axis=0))
    boxes = shapely.box(low[:, x], low[:, y], high[:, x], high[:, y])
    one, two = shapely.STRtree(boxes).query(boxes)
    keep = one < two
    one, two = one[keep], two[keep]
    keep = (low[one, z] <= high[two, z]) & (low[two, z] <= high[one, z])
    return np.column_stack((one[keep], two[keep])).astype(np.int64)


@dataclass(frozen=True, eq=False)
class _Detector:
    """What can be known of a mesh before its states are looked at."""

    mesh: SheetMesh

    @cached_property
    def edges(self) -> Ints:
        """(b, 2) of the boundary."""
        from bh.analysis.projection import outline

        edges: Ints = outline(self.mesh.triangles)
        return edges

    def pairs(self, points: Array) -> Ints:
        from bh.analysis.projection import meets_itself, seen_once
        from bh.analysis.triangles import intersecting

        triangles = self.mesh.triangles
        points = np.array(
            points
        )  # those of states are read-only, for which kernels would be compiled once more
        if seen_once(points, triangles, self.edges):
            return np.empty((0, 2), dtype=np.int64)
        tolerance = TOLERANCE * float(np.linalg.norm(np.ptp(points, axis=0)))
        if not meets_itself(points, triangles, self.edges, tolerance):
            return np.empty((0, 2), dtype=np.int64)
        found = candidates(points, triangles, tolerance)
        found = found[intersecting(points, triangles, found, tolerance)]
        return np.asarray(found[np.lexsort((found[:, 1], found[:, 0]))])
