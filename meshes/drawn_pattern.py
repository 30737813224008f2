"""From the plane graph of a drawing to a crease pattern: outline, holes, creases and facet lines. mm.

The outline is the rim of what the lines enclose; a closed boundary that touches it nowhere is a hole. Creases are
chains of edges of one kind (and one fold angle) from vertex to vertex, named m1, m2, ..., v1, ... and f1, ... (flat)
in the order of the drawing. Cuts inside the sheet are its cuts cut-1, ...; what they cut out falls out.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from meshes.curves import Array, Curve, Polyline
from meshes.cuts import CUTS
from meshes.errors import PatternError
from meshes.mesh import count
from meshes.pattern import Crease, CreasePattern, FoldKind
from meshes.planar import RIM, DrawnLine, Graph, corners
from meshes.rails import curve_through, find_rails
from meshes.separate import several
from meshes.topology import Ints

CREASES: dict[str, tuple[str, FoldKind]] = {
    "mountain": ("m", "mountain"),
    "valley": ("v", "valley"),
    "flat": ("f", "flat"),
}
SIDES = 12  # with more corners than that the sides of an outline get no names
NEARLY = 20.0  # times the gap: a crease that ends so near another line was perhaps meant to meet it
NEARLY_CUT = 4.0  # the same of a cut


@dataclass(frozen=True)
class Region:
    """The sheet within a graph.

    Attributes:
        polygon: shapely's, mm.
        rings: nodes round the outside, counter-clockwise, then round every hole.
        inside: numbers of the edges inside the sheet.
        remarks: what was taken for granted, one line each.
        stubs: numbers of the edges that stick out of the sheet a little, and were cut off.
    """

    polygon: Any
    rings: list[list[int]]
    inside: Ints
    remarks: list[str]
    stubs: Ints


def pattern_of(graph: Graph, lines: Sequence[DrawnLine]) -> CreasePattern:
    """The crease pattern of a drawing.

    Args:
        graph: healed, see `meshes.planar.heal`.
        lines: that its edges belong to.

    Raises:
        PatternError: the outline is open, or there are two; a line leaves the sheet. One line, with the name of the
            line and the place.
    """
    region = region_of(graph, lines)
    creases: list[Crease] = []
    layers: dict[str, list[str]] = {}
    drawn_in = {
        frozenset(graph.edges[e].tolist()): lines[graph.lines[e]].layer
        for e in region.inside.tolist()
        if graph.kinds[e] == "flat"
    }
    for kind, (letter, fold) in CREASES.items():
        numbers = [e for e in region.inside.tolist() if graph.kinds[e] == kind]
        for i, chain in enumerate(_chains(graph, lines, numbers, _joints(graph, region))):
            creases.append(Crease(f"{letter}{i + 1}", curve_through(graph.points[chain[0]]), fold, chain[1]))
            layer = _layer(drawn_in, chain[0]) if fold == "flat" else ""
            if layer:  # regions are named by the layer that they are drawn in
                layers.setdefault(f"layer:{layer}", []).append(f"crease:{letter}{i + 1}")
    facets = [e for e in region.inside.tolist() if graph.kinds[e] in ("facet", "boundary")]
    facet_chains = _chains(graph, lines, facets, _met(graph, region.inside.tolist()))
    numbers = [e for e in region.inside.tolist() if graph.kinds[e] == "cut"]
    slits = _chains(graph, lines, numbers, _met(graph, numbers) | {n for ring in region.rings for n in ring})
    cuts = tuple((f"cut-{i + 1}", curve_through(graph.points[chain])) for i, (chain, _) in enumerate(slits))
    edges, sides = _edges(graph.points, region.rings)
    groups = [
        ("crease:" + fold, tuple("crease:" + c.name for c in creases if c.fold == fold))
        for _, fold in CREASES.values()
    ]
    if sides:
        groups.append(("edge:boundary", sides))
    groups.append((CUTS, tuple(f"edge:{name}" for name, _ in cuts)))
    groups += [(name, tuple(members)) for name, members in layers.items()]
    pattern = CreasePattern(
        rings=tuple(graph.points[ring] for ring in region.rings),
        creases=tuple(creases),
        edges=edges,
        facets=tuple(curve_through(graph.points[chain]) for chain, _ in facet_chains),
        groups=tuple((name, members) for name, members in groups if members),
        remarks=tuple(region.remarks),
        cuts=cuts,
    )
    return pattern if cuts else find_rails(pattern)


# --- the sheet ----------------------------------------------------------------------------------------------


def region_of(graph: Graph, lines: Sequence[DrawnLine]) -> Region:
    """What the lines enclose; arguments and errors as for `pattern_of`.

    Args:
        graph: healed lines.
        lines: as they are drawn.

    Raises:
        PatternError: as for `pattern_of`.
    """
    import shapely

    segments = shapely.linestrings(graph.points[graph.edges])
    where = {tuple(point): k for k, point in enumerate(graph.points.tolist())}
    faces = [
        [
            [where[tuple(at)] for at in np.asarray(ring.coords)[:-1].tolist()]
            for ring in (f.exterior, *f.interiors)
        ]
        for f in shapely.get_parts(shapely.polygonize_full(segments)[0])
    ]
    _check_ends(graph, lines, segments, ("boundary",) if faces else RIM)
    if not faces:
        raise PatternError(
            "the drawing has no closed outline; draw one as a boundary (black) line, or take the hull of what is "
            'drawn: outline = "hull"'
        )
    number = {tuple(pair): e for e, pair in enumerate(np.sort(graph.edges, axis=1).tolist())}
    around = [[number[min(a, b), max(a, b)] for ring in face for a, b in _sides(ring)] for face in faces]
    solid = _without_holes(graph, around)
    keep, fallen = _without_pieces(graph, around, solid)
    sheet_faces = [face for face, kept in zip(faces, keep, strict=True) if kept]
    polygon = shapely.union_all(
        [shapely.Polygon(graph.points[face[0]], [graph.points[r] for r in face[1:]]) for face in sheet_faces]
    )
    sides = [e for at, kept in zip(around, keep, strict=True) if kept for e in at]
    used = np.bincount(sides, minlength=len(graph.edges))
    if polygon.geom_type != "Polygon":
        raise PatternError(several(list(polygon.geoms)))
    rim = np.flatnonzero(used == 1)
    inside = np.setdiff1d(np.arange(len(graph.edges)), rim)
    lost = [face for face, was, kept in zip(faces, solid, keep, strict=True) if was and not kept]
    if lost:  # what is drawn on pieces that fell out goes with them
        gone = shapely.union_all([shapely.Polygon(graph.points[face[0]]) for face in lost])
        inside = inside[~shapely.contains_xy(gone, graph.points[graph.edges[inside]].mean(axis=1))]
    inside, stubs, cut_off = _check_inside(graph, lines, polygon, inside)
    remarks = fallen + cut_off + _rim_remarks(graph, lines, rim, inside) + _remarks(graph, lines, inside)
    return Region(polygon, _rings(graph, rim), inside, remarks, stubs)


def _without_holes(graph: Graph, around: list[list[int]]) -> list[bool]:
    """Which faces are sheet: not those within boundary lines that touch the outline nowhere."""
    count = np.bincount([e for at in around for e in at], minlength=len(graph.edges))
    outline = set(graph.edges[count == 1].ravel().tolist())
    keep = []
    for at in around:
        nodes = set(graph.edges[at].ravel().tolist())
        hole = all(graph.kinds[e] in RIM and count[e] == 2 for e in at) and not nodes & outline
        keep.append(not hole)
    return keep


def _without_pieces(graph: Graph, around: list[list[int]], keep: list[bool]) -> tuple[list[bool], list[str]]:
    """Which faces are sheet without those that closed cuts cut out of it, and a remark on these."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    beside: dict[int, list[int]] = {}
    for face, at in enumerate(around):
        for e in at:
            beside.setdefault(e, []).append(face)
    pairs = [
        at
        for e, at in beside.items()
        if len(at) == 2 and graph.kinds[e] != "cut" and all(keep[f] for f in at)
    ]
    one, two = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    joined = coo_array((np.ones(len(one)), (one, two)), shape=(len(around),) * 2)
    piece = connected_components(joined, directed=False)[1].tolist()
    outside = {piece[at[0]] for at in beside.values() if len(at) == 1}
    lost = {p for face, p in enumerate(piece) if keep[face]} - outside
    if not lost:
        return keep, []
    first = next(face for face, p in enumerate(piece) if p in lost)
    remark = (
        f"{count(len(lost), 'piece')} within closed cuts (first at {_middle(graph, around[first][0])}) "
        "fell out, leaving holes"
    )
    return [kept and p not in lost for kept, p in zip(keep, piece, strict=True)], [remark]


def _check_ends(graph: Graph, lines: Sequence[DrawnLine], segments: Any, kinds: Sequence[str]) -> None:
    """No line of these kinds, that make up the outline, ends loosely."""
    import shapely

    degree = np.bincount(graph.edges.ravel(), minlength=len(graph.points))
    for e in graph.select(kinds).tolist():
        for node in graph.edges[e].tolist():
            if degree[node] > 1:
                continue
            point = shapely.Point(graph.points[node])
            own = np.array([line == graph.lines[e] for line in graph.lines])
            loose = [n for n in np.flatnonzero(degree == 1).tolist() if n != node]
            away = [float(shapely.distance(point, segments[~own]).min())] if not own.all() else []
            away += [float(np.linalg.norm(graph.points[n] - graph.points[node])) for n in loose]
            hint = (
                f"{min(away):.3g} mm from the nearest other end or line" if away else "and nothing is near it"
            )
            mend = f", heal it with gap = {1.05 * min(away):.2g}" if away else ""
            raise PatternError(
                f"{_name(graph, lines, e)} (boundary) ends loosely at {_at(graph.points[node])}, {hint}; close the "
                f"outline{mend}, or draw a line that is no boundary in another colour"
            )


def _check_inside(
    graph: Graph, lines: Sequence[DrawnLine], polygon: Any, inside: Ints
) -> tuple[Ints, Ints, list[str]]:
    """The edges in the sheet, loose ends that stick out a little, and a remark on these; others are refused."""
    import shapely

    middle = graph.points[graph.edges[inside]].mean(axis=1)
    shapely.prepare(polygon)
    within = shapely.contains_xy(polygon, middle)
    degree = np.bincount(graph.edges.ravel(), minlength=len(graph.points))
    stubs, longest = [], 0.0
    for e in inside[~within].tolist():
        out = max(float(polygon.distance(shapely.Point(point))) for point in graph.points[graph.edges[e]])
        if out <= NEARLY * graph.gap and degree[graph.edges[e]].min() == 1:
            stubs.append(e)
            longest = max(longest, out)
            continue
        mend = (
            f", or cut off what stands out by gap = {1.05 * out:.2g}" if out < 0.05 * polygon.length else ""
        )
        if not len(graph.select(RIM)):
            mend += '; no line is drawn as one: outline = "hull" takes the hull of what is drawn'
        raise PatternError(
            f"{_name(graph, lines, e)} ({graph.kinds[e]}) leaves the sheet at {_middle(graph, e)}; "
            f"end it at the outline{mend}"
        )
    cut_off = []
    if stubs:
        cut_off.append(
            f"{len(stubs)} lines stick out of the sheet by up to {longest:.2g} mm (first "
            f"{_name(graph, lines, stubs[0])} at {_middle(graph, stubs[0])}): cut off at the outline"
        )
    return inside[within], np.array(stubs, dtype=np.int64), cut_off


def _rim_remarks(graph: Graph, lines: Sequence[DrawnLine], rim: Ints, inside: Ints) -> list[str]:
    """A crease along the rim cannot fold: it is taken as the boundary."""
    wrong = [e for e in rim.tolist() if graph.kinds[e] not in RIM]
    if not wrong:
        return []
    kind = graph.kinds[wrong[0]]
    remark = (
        f"{_name(graph, lines, wrong[0])} is drawn as {kind} but is the rim of the sheet at "
        f"{_middle(graph, wrong[0])}: taken as boundary"
    )
    whole = len(wrong) == len(rim) and {graph.kinds[e] for e in wrong} == {"mountain"}
    others = {graph.kinds[e] for e in inside.tolist()} & set(CREASES)
    if whole and "valley" in others:
        remark += '; if red is cut and blue is score, as laser shops have it: lines = { "#ff0000" = "cut" }'
    return [remark]


def _remarks(graph: Graph, lines: Sequence[DrawnLine], inside: Ints) -> list[str]:
    """What was taken for granted, one line each."""
    found = []
    black = sorted({graph.lines[e] for e in inside.tolist() if graph.kinds[e] == "boundary"})
    if black:
        found.append(
            f"{len(black)} boundary lines lie inside the sheet (first {lines[black[0]].name}) and bound no hole: "
            "taken as facet lines, along which the sheet neither ends nor folds"
        )
    degree = np.bincount(graph.edges.ravel(), minlength=len(graph.points))
    telling = [e for e in inside.tolist() if graph.kinds[e] in ("cut", *CREASES)]
    ends = [(e, n) for e in telling for n in graph.edges[e].tolist() if degree[n] == 1]
    if ends:
        import shapely

        tree = shapely.STRtree(shapely.linestrings(graph.points[graph.edges]))
        for e, n in ends:
            point = shapely.Point(graph.points[n])
            # slits leave narrow bridges on purpose
            reach = graph.gap * (NEARLY_CUT if graph.kinds[e] == "cut" else NEARLY)
            near = tree.query(point, predicate="dwithin", distance=reach)
            others = [k for k in near.tolist() if graph.lines[k] != graph.lines[e]]
            if others:
                away = float(shapely.distance(point, tree.geometries[others]).min())
                found.append(
                    f"{_name(graph, lines, e)} ends inside the sheet at {_at(graph.points[n])}, only {away:.3g} mm "
                    f"from another line; to join them: gap = {1.05 * away:.2g}"
                )
    return found


# --- chains -------------------------------------------------------------------------------------------------


def _sides(ring: Sequence[int]) -> Iterable[tuple[int, int]]:
    return zip(ring, [*ring[1:], ring[0]], strict=True)


def _rings(graph: Graph, rim: Ints) -> list[list[int]]:
    """The boundary as rings of nodes, counter-clockwise, the outside first; each from its lower left corner."""
    import shapely

    parts = shapely.get_parts(shapely.polygonize(shapely.linestrings(graph.points[graph.edges[rim]])))
    where = {tuple(point): k for k, point in enumerate(graph.points.tolist())}
    outside = max(parts, key=lambda part: shapely.Polygon(part.exterior).area)
    rings = []
    for ring in (outside.exterior, *outside.interiors):
        points = np.asarray(ring.coords)[:-1]
        if not ring.is_ccw:
            points = points[::-1]
        first = int(np.argmin(points @ (1.0, 1.0)))
        rings.append([where[tuple(point)] for point in np.roll(points, -first, axis=0).tolist()])
    return rings


def _joints(graph: Graph, region: Region) -> set[int]:
    """Nodes where creases end: at rim and cuts, and where other than two of them meet (facet lines end no crease)."""
    telling = [e for e in region.inside.tolist() if graph.kinds[e] in CREASES]
    cuts = [e for e in region.inside.tolist() if graph.kinds[e] == "cut"]
    ends = {node for ring in region.rings for node in ring} | set(graph.edges[cuts].ravel().tolist())
    return _met(graph, telling) | ends


def _met(graph: Graph, numbers: Sequence[int]) -> set[int]:
    degree = np.bincount(graph.edges[list(numbers)].ravel(), minlength=len(graph.points))
    return set(np.flatnonzero(degree != 2).tolist())


def _chains(
    graph: Graph, lines: Sequence[DrawnLine], numbers: list[int], joints: set[int]
) -> list[tuple[list[int], float | None]]:
    """Nodes of the chains that edges make up, with their fold angle; closed ones name their first node twice."""
    at: dict[int, list[int]] = {}
    for e in numbers:
        for node in graph.edges[e].tolist():
            at.setdefault(node, []).append(e)
    free = set(numbers)

    def angle(e: int) -> float | None:
        value = lines[graph.lines[e]].angle
        return None if np.isnan(value) else value

    def walk(e: int, node: int) -> list[int]:
        found = []
        while True:
            node = int(graph.edges[e].sum()) - node
            found.append(node)
            ahead = [k for k in at[node] if k in free and angle(k) == angle(e)]
            if node in joints or len(at[node]) != 2 or not ahead:
                return found
            e = ahead[0]
            free.discard(e)

    chains = []
    for e in numbers:
        if e in free:
            free.discard(e)
            a, b = graph.edges[e].tolist()
            ahead = walk(e, a)
            back = walk(e, b)[::-1] if ahead[-1] != a else [a]
            chains.append(([*back, *ahead], angle(e)))
    return chains


def _layer(drawn_in: Mapping[frozenset[int], str], chain: list[int]) -> str:
    """The layer that all edges of a chain of nodes are drawn in; "" where there are several, or none."""
    names = {drawn_in[frozenset(pair)] for pair in pairwise(chain)}
    return names.pop() if len(names) == 1 else ""


def _edges(
    points: Array, rings: Sequence[Sequence[int]]
) -> tuple[tuple[tuple[str, Curve], ...], tuple[str, ...]]:
    """The named boundary curves, and the names of the outline's sides if it has sides.

    The sides are side-1, ... counter-clockwise from the lower left corner; without corners, or with very many of
    them, the outline is one curve, "boundary". Holes are hole-1, ...
    """
    outline = points[[*rings[0], rings[0][0]]]
    sharp = np.flatnonzero(corners(outline, closed=True)[:-1])
    edges: list[tuple[str, Curve]] = []
    if 2 <= len(sharp) <= SIDES:
        turned = np.roll(outline[:-1], -int(sharp[0]), axis=0)
        at = [*(sharp - sharp[0]).tolist(), len(turned)]
        turned = np.vstack((turned, turned[:1]))
        edges = [(f"side-{i + 1}", curve_through(turned[at[i] : at[i + 1] + 1])) for i in range(len(sharp))]
    sides = tuple(f"edge:{name}" for name, _ in edges)
    if not sides:
        edges = [("boundary", Polyline(outline))]
    edges += [(f"hole-{i + 1}", Polyline(points[[*ring, ring[0]]])) for i, ring in enumerate(rings[1:])]
    return tuple(edges), sides


# --- words --------------------------------------------------------------------------------------------------


def _name(graph: Graph, lines: Sequence[DrawnLine], edge: int) -> str:
    return lines[graph.lines[edge]].name


def _at(point: Sequence[float] | Array) -> str:
    return f"({point[0]:.6g}, {point[1]:.6g})"


def _middle(graph: Graph, edge: int) -> str:
    return _at(graph.points[graph.edges[edge]].mean(axis=0))
