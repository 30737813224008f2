"""Crease-conforming meshes of any pattern by gmsh, graded toward what needs it.

Boundary curves and creases are cut into edges of about the wanted size there, whose nodes lie exactly on them; between
them the sheet is filled with nearly equilateral triangles. Named edge sets know the curve that they lie on.
"""

from __future__ import annotations

import ctypes
import math
import signal
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from meshes.cells import GmshCells
from meshes.curves import Array, Curve
from meshes.cuts import open_cuts
from meshes.errors import MeshError
from meshes.limits import check_limit
from meshes.meetings import breaks
from meshes.mesh import Origin, SheetMesh
from meshes.pattern import CreasePattern, drawn_angles, sheet_polygon, with_groups
from meshes.quantities import Typed, number
from meshes.topology import Ints

# of every face: its loops of nodes, and edges inside
Faces = list[tuple[list[list[int]], list[tuple[int, int]]]]

EQUILATERAL = math.sqrt(3.0) / 4.0  # area of such a triangle over the square of its edge

# gmsh is silent, gives the same mesh on every machine, and meshes fronts by the algorithm Frontal-Delaunay
OPTIONS = (("General.Terminal", 0), ("General.NumThreads", 1), ("Mesh.Algorithm", 6))


@dataclass(frozen=True, eq=False)
class Sizes:
    """Wanted edge length at any point: the smallest of `largest` and, for every line, its own plus growth x distance.

    Attributes:
        largest: edge length away from all lines, mm.
        near: names of lines and the edge lengths on them, mm.
        lines: shapely geometries of these, by name.
        growth: of the edge length away from a line, mm a mm.
    """

    largest: float
    near: dict[str, float]
    lines: dict[str, Any]
    growth: float

    def at(self, points: Array) -> Array:
        """(n,) wanted edge lengths, mm, at (n, 2) points."""
        import shapely

        out = np.full(len(points), self.largest)
        places = shapely.points(points)
        for name, size in self.near.items():
            out = np.minimum(out, size + self.growth * shapely.distance(places, self.lines[name]))
        return out

    def divide(self, curve: Curve, a: float, b: float, least: int = 1) -> list[float]:
        """Parameters after `a` up to `b` that cut this part of a curve into edges of the wanted lengths.

        Args:
            curve: the curve.
            a: parameter in [0, 1] where the part begins.
            b: parameter in [0, 1] where it ends.
            least: number of edges at least.

        Returns:
            the parameters, rising; the last one is `b`.
        """
        u = np.linspace(a, b, 257 if self.near else 2)
        density = curve.length / self.at(curve.point(u))
        count = np.concatenate(([0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(u))))
        cells = max(least, round(float(count[-1])))
        inner = np.interp(count[-1] * np.arange(1, cells) / cells, count, u)
        return [*inner.tolist(), b]


def unstructured(
    pattern: CreasePattern,
    *,
    size: Typed,
    near: Mapping[str, Typed] | None = None,
    growth: float = 0.3,
    seed: int = 1,
) -> SheetMesh:
    """Mesh a pattern with triangles of edge length about `size` (mm).

    Args:
        pattern: with named boundary curves that enclose the sheet.
        size: wanted edge length; shorter where curves meet.
        near: shorter edge lengths at named creases and edges, mm: {"crease:crease": 1.0, "edge:start": 2.0}.
        growth: how fast the edge length grows away from these, mm a mm.
        seed: of gmsh's own small random shifts; the same seed gives the same mesh.

    Returns:
        The mesh, of kind "gmsh", with nodes exactly on creases and edges.

    Raises:
        MeshError: a size that cannot be, a name that the pattern has not, an outline that its named edges do
            not make up, or gmsh failed.
    """
    if not isinstance(pattern, CreasePattern):
        raise MeshError(
            f"a {type(pattern).__name__} cannot be meshed; give a pattern, such as meshes.strip(100, 10)"
        )
    size = number(size, "length")
    finer = {name: float(number(edge, "length")) for name, edge in (near or {}).items()}
    if not math.isfinite(size) or size <= 0.0:
        raise MeshError(f"size = {size} cannot be; use a positive edge length in mm")
    check_limit(
        "triangles", sheet_area(pattern) / (EQUILATERAL * size**2), f"this mesh of size = {size:g}", MeshError
    )
    curves = {f"edge:{name}": curve for name, curve in pattern.edges}
    if not curves:
        raise MeshError("this pattern names no boundary curves; an unstructured mesh needs them")
    curves |= {f"crease:{crease.name}": crease.curve for crease in pattern.creases}
    cuts = {f"edge:{name}": curve for name, curve in pattern.cuts}
    curves |= cuts
    sizes = _sizes(curves, size, finer, growth)
    check_limit("triangles", _expected(pattern, curves, sizes), "this mesh", MeshError)
    facets = {f"facet:{i}": curve for i, curve in enumerate(pattern.facets)}
    points, chains = _chains(curves | facets, sizes, cuts)
    segments = np.vstack(list(chains.values()))
    points, triangles = _fill(points, _faces(pattern, points, segments), sizes, chains, seed)
    drawn = [chains.pop(name) for name in facets]
    if drawn:
        chains["edge:facet"] = np.vstack(drawn)
    mesh = SheetMesh(
        points=points,
        triangles=triangles,
        edge_sets=(edge_sets := with_groups(pattern, chains)),
        corners=_corners({name: pairs for name, pairs in chains.items() if name not in cuts}),
        folds=pattern.folds,
        fold_angles=drawn_angles(pattern, edge_sets),
        curves=curves,
        kind="gmsh",
        remarks=pattern.remarks,
        origin=Origin.of(pattern, GmshCells(size, finer, growth, seed), points, triangles),
    )
    return open_cuts(mesh, list(cuts))


def _sizes(curves: dict[str, Curve], size: float, near: dict[str, float], growth: float) -> Sizes:
    import shapely

    for name, wanted in near.items():
        if name not in curves:
            raise MeshError(f"near: the pattern has no '{name}'; use one of {', '.join(curves)}")
        if not math.isfinite(wanted) or not 0.0 < wanted <= size:
            raise MeshError(
                f"near: {wanted} at '{name}' cannot be; use an edge length in mm up to size = {size:g}"
            )
    if not math.isfinite(growth) or growth <= 0.0:
        raise MeshError(f"growth = {growth} cannot be; use how fast edges grow, 0.1 to 0.5 mm a mm")
    u = np.linspace(0.0, 1.0, 513)
    return Sizes(size, near, {name: shapely.LineString(curves[name].point(u)) for name in near}, growth)


def _expected(pattern: CreasePattern, curves: Mapping[str, Curve], sizes: Sizes) -> float:
    """How many triangles to expect: those of the even mesh, and at every line of shorter edges those that it adds.

    Edges of the length s + g x at the distance x from a line of the length L make 2 L dx / (0.433 (s + g x)^2)
    triangles each side together, down to where they are as long as everywhere; never more than edges of the
    length s all over the sheet.
    """
    area = sheet_area(pattern)
    total = area / (EQUILATERAL * sizes.largest**2)
    for name, short in sizes.near.items():
        graded = (
            2.0 * curves[name].length / (EQUILATERAL * sizes.growth) * (1.0 / short - 1.0 / sizes.largest)
        )
        total += min(graded, area / (EQUILATERAL * short**2))
    return total


def sheet_area(pattern: CreasePattern) -> float:
    """Area of the flat sheet inside its outline, without its holes, mm^2."""
    return float(sheet_polygon(pattern.rings).area)


def _chains(
    curves: dict[str, Curve], sizes: Sizes, cuts: Collection[str] = ()
) -> tuple[Array, dict[str, Ints]]:
    """Points (k, 2) on all curves, and each curve as a chain of node pairs; curves that meet share nodes.

    A curve of `cuts` has two edges at least, without which it could not open.
    """
    ends = np.vstack([curve.point(np.array([0.0, 1.0])) for curve in curves.values()])
    ends = np.unique(ends, axis=0)
    near = 1e-6 * float(np.ptp(ends, axis=0).max() + sizes.largest)
    points: list[Array] = []
    joints: Joints = {}
    chains: dict[str, Ints] = {}
    for name, curve in curves.items():
        cuts_at = breaks(curve, ends, near)
        u = [cuts_at[0]]
        for a, b in pairwise(cuts_at):
            whole = len(cuts_at) == 2
            least = 3 if curve.closed and whole else 2 if name in cuts and whole else 1
            u += sizes.divide(curve, a, b, least=least)
        fixed = set(cuts_at)
        nodes = [
            _node(points, joints, at, near) if value in fixed else _new(points, at)
            for value, at in zip(u, curve.point(np.array(u)), strict=True)
        ]
        # a crease shorter than two nodes can be apart has no edge
        chains[name] = np.array([nodes[:-1], nodes[1:]], dtype=np.int64).T
    return np.array(points), chains


Joints = dict[tuple[int, int], int]  # where curves may meet: the node in each square of a grid


def _node(points: list[Array], joints: Joints, at: Array, near: float) -> int:
    """Index of the joint at that place, made if there is none."""
    x, y = (math.floor(value / near) for value in at)
    for square in ((x + i, y + j) for i in (-1, 0, 1) for j in (-1, 0, 1)):
        if square in joints and math.dist(points[joints[square]], at) < near:
            return joints[square]
    joints[x, y] = _new(points, at)
    return joints[x, y]


def _new(points: list[Array], at: Array) -> int:
    points.append(at)
    return len(points) - 1


def _faces(pattern: CreasePattern, points: Array, segments: Ints) -> Faces:
    """Regions that the segments cut the sheet into."""
    import shapely

    sheet = sheet_polygon(pattern.rings)

    lines = shapely.linestrings(points[segments])
    _check_apart(points, segments, lines)
    polygons, bridges, dangles, _ = shapely.polygonize_full(lines)
    where = {tuple(point): k for k, point in enumerate(points.tolist())}

    def loop(ring: Any) -> list[int]:
        return [where[tuple(at)] for at in np.asarray(ring.coords)[:-1].tolist()]

    ends = [
        *shapely.get_parts(dangles),
        *shapely.get_parts(bridges),
    ]  # bridges lead to a hole or a closed crease
    loose = [tuple(where[tuple(at)] for at in line.coords) for line in ends]
    found: Faces = []
    for polygon in shapely.get_parts(polygons):
        if not sheet.covers(polygon.representative_point()):
            continue  # a hole
        loops = [loop(polygon.exterior), *(loop(ring) for ring in polygon.interiors)]
        inside = [
            pair for pair in loose if polygon.covers(shapely.Point(points[list(pair)].mean(axis=0)))
        ]  # creases that end inside the sheet
        found.append((loops, [(int(a), int(b)) for a, b in inside]))
    covered = sum(
        shapely.Polygon(points[loops[0]], [points[loop] for loop in loops[1:]]).area for loops, _ in found
    )
    if abs(covered - sheet.area) > 0.05 * sheet.area:
        raise MeshError("the named boundary curves do not enclose the sheet; name all of its edges")
    return found


def _check_apart(points: Array, segments: Ints, lines: Any) -> None:
    """No two segments cross, or lie over each other."""
    import shapely

    one, two = shapely.STRtree(lines).query(lines, predicate="intersects")
    one, two = one[one < two], two[one < two]
    apart = (segments[one][:, :, None] != segments[two][:, None, :]).all(axis=(1, 2))
    if apart.any():
        x, y = points[segments[one[apart][0]]].mean(axis=0)
        raise MeshError(
            f"chords of two curves cross near ({x:.6g}, {y:.6g}); use a smaller size, or part the curves there"
        )


def _fill(
    points: Array, faces: Faces, sizes: Sizes, chains: dict[str, Ints], seed: int
) -> tuple[Array, Ints]:
    """Nodes (n, 2), the given points first, and counter-clockwise triangles (t, 3) by gmsh."""
    import gmsh

    broken_pipe = _BrokenPipe()
    gmsh.initialize(argv=["", "-v", "0"], readConfigFiles=False, interruptible=False)
    try:
        for name, value in (*OPTIONS, ("Mesh.RandomSeed", seed), ("Mesh.MeshSizeMax", 1.15 * sizes.largest)):
            gmsh.option.setNumber(name, value)
        gmsh.model.add("sheet")
        wanted = sizes.at(points)
        for k, (x, y) in enumerate(points):
            gmsh.model.geo.addPoint(x, y, 0.0, wanted[k], k + 1)
        lines: dict[tuple[int, int], int] = {}

        def line(a: int, b: int) -> int:
            if (b, a) in lines:
                return -lines[b, a]
            if (a, b) not in lines:
                lines[a, b] = gmsh.model.geo.addLine(a + 1, b + 1)
                gmsh.model.geo.mesh.setTransfiniteCurve(lines[a, b], 2)
            return lines[a, b]

        embedded = []
        for loops, inside in faces:
            tags = [
                gmsh.model.geo.addCurveLoop(
                    [line(a, b) for a, b in zip(loop, loop[1:] + loop[:1], strict=True)]
                )
                for loop in loops
            ]
            embedded.append((gmsh.model.geo.addPlaneSurface(tags), [abs(line(a, b)) for a, b in inside]))
        gmsh.model.geo.synchronize()
        for surface, inner in embedded:
            if inner:
                gmsh.model.mesh.embed(1, inner, 2, surface)
        _grade(
            gmsh, sizes, {name: [abs(line(a, b)) for a, b in chains[name].tolist()] for name in sizes.near}
        )
        gmsh.model.mesh.generate(2)
        return _read(gmsh, len(points))
    except MeshError:
        raise
    except Exception as failed:  # gmsh raises plain exceptions
        raise MeshError(f"gmsh could not mesh the pattern ({failed}); try another size") from failed
    finally:
        gmsh.finalize()
        broken_pipe.restore()


class _BrokenPipe:
    """How this process takes a broken pipe, kept from gmsh.

    gmsh has SIGPIPE end the process without a word: a sweep of which one worker dies would go down with it. Python's
    `signal` would do in the main thread only.
    """

    def __init__(self) -> None:
        self.handler: int | None = None
        if hasattr(signal, "SIGPIPE"):
            ask = ctypes.pythonapi.PyOS_getsig
            ask.argtypes, ask.restype = [ctypes.c_int], ctypes.c_void_p
            self.handler = ask(signal.SIGPIPE)

    def restore(self) -> None:
        if hasattr(signal, "SIGPIPE"):
            tell = ctypes.pythonapi.PyOS_setsig
            tell.argtypes, tell.restype = [ctypes.c_int, ctypes.c_void_p], ctypes.c_void_p
            tell(signal.SIGPIPE, self.handler)


def _grade(gmsh: Any, sizes: Sizes, lines: dict[str, list[int]]) -> None:
    """The wanted edge lengths inside the sheet as gmsh's background field."""
    if not lines:
        return
    field = gmsh.model.mesh.field
    grown = []
    for name, tags in lines.items():
        distance = field.add("Distance")
        field.setNumbers(distance, "CurvesList", tags)
        field.setNumber(distance, "Sampling", 5)
        grown.append(field.add("MathEval"))
        field.setString(grown[-1], "F", f"{sizes.near[name]} + {sizes.growth} * F{distance}")
    least = field.add("Min")
    field.setNumbers(least, "FieldsList", grown)
    field.setAsBackgroundMesh(least)


def _read(gmsh: Any, fixed: int) -> tuple[Array, Ints]:
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    _, corners = gmsh.model.mesh.getElementsByType(2)
    triangles = np.asarray(corners, dtype=np.int64).reshape(-1, 3)
    tags = np.asarray(tags, dtype=np.int64)
    order = np.argsort(tags)
    # nodes on geometric points have the tags of these points
    used = np.isin(tags[order], triangles) | (tags[order] <= fixed)
    order = order[used]
    points = np.asarray(coordinates).reshape(-1, 3)[order, :2]
    triangles = np.searchsorted(tags[order], triangles)
    p, q, r = (points[triangles[:, k]] for k in range(3))
    turn = (q - p)[:, 0] * (r - p)[:, 1] - (q - p)[:, 1] * (r - p)[:, 0]
    triangles[turn < 0.0] = triangles[turn < 0.0][:, ::-1]
    return points, triangles


def _corners(chains: dict[str, Ints]) -> dict[str, int]:
    """Nodes where two boundary curves end together, as "corner:inner-start"; first the long edges' names."""
    edges = {name.removeprefix("edge:"): pairs for name, pairs in chains.items() if name.startswith("edge:")}
    found: dict[str, int] = {}
    names: Sequence[str] = list(edges)
    for i, one in enumerate(names):
        for two in names[i + 1 :]:
            shared = {int(edges[one][0, 0]), int(edges[one][-1, 1])} & {
                int(edges[two][0, 0]),
                int(edges[two][-1, 1]),
            }
            if len(shared) == 1:
                found[f"corner:{one}-{two}"] = shared.pop()
    return found
