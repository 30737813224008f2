"""The meshed sheet that every solver takes."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from types import MappingProxyType

import numpy as np

from meshes.cells import Cells
from meshes.curves import Array, Curve
from meshes.errors import MeshError
from meshes.fans import pieces
from meshes.pattern import FOLD_KINDS, CreasePattern, FoldKind
from meshes.topology import Ints, Topology, build
from meshes.wide import SIDES, STRIP


def count(number: int, what: str) -> str:
    """A number and its noun, as in "1 crease" and "2 creases".

    Args:
        number: how many.
        what: noun in the singular.
    """
    return f"{number} {what}" + ("" if number == 1 else "s")


@dataclass(frozen=True, eq=False)
class Origin:
    """What a mesh was made of, and the `mark` of what came out: a copy that was changed is told by it."""

    pattern: CreasePattern
    mark: int
    cells: Cells

    @classmethod
    def of(cls, pattern: CreasePattern, cells: Cells, points: Array, triangles: Ints) -> Origin:
        """The origin of a mesh with points (n, 2 or 3) and triangles (t, 3): `pattern`, cut into `cells`.

        Args:
            pattern: that was cut.
            cells: into which.
            points: (n, 2) or (n, 3), mm.
            triangles: (t, 3) node indices.
        """
        return cls(pattern, _mark(points, triangles), cells)


@dataclass(frozen=True, eq=False, repr=False)
class SheetMesh:
    """A triangulated sheet in its stress-free state, with named sets (frozen: arrays are read-only).

    Attributes:
        points: (n, 3) node positions, mm; a flat sheet lies in z = 0 with triangles counter-clockwise from +z.
        triangles: (t, 3) node indices.
        edge_sets: named sets of edges as (k, 2) node pairs in order: "crease:NAME", "edge:inner", ...
        corners: named single nodes: "corner:inner-start", ...
        folds: how each crease was drawn.
        fold_angles: drawn fold angles by crease, one an edge of its set, rad, mountain positive; may be empty.
        curves: the exact curve that a named edge set lies on, where there is one.
        spans: (e, 2) for every edge of `topology.edges` how far it goes along and across the crease (mm), or
            None where the mesh has no such directions.
        kind: how it was meshed ("staggered", "alternating", "one-way", "mirrored", "gmsh", "imported", ...).
        aspect_ratio: mean panel height across the crease over width along it (alpha = H / W), or nan.
        remarks: what was taken for granted when the pattern was read, one line each.
        origin: the pattern that it was made of, where there is one; see `pattern`.
        drawn: (n, 3) where the nodes were when the mesh was made, mm, and where its curves are; a copy with other
            points keeps them, so that a mesh that was moved still knows its curves. None: here.

    Raises:
        MeshError: indices out of range, degenerate triangles, non-manifold edges, sets that are no edges.
    """

    points: Array
    triangles: Ints
    edge_sets: Mapping[str, Ints] = field(default_factory=dict)
    corners: Mapping[str, int] = field(default_factory=dict)
    folds: Mapping[str, FoldKind] = field(default_factory=dict)
    fold_angles: Mapping[str, Array] = field(default_factory=dict)
    curves: Mapping[str, Curve] = field(default_factory=dict)
    spans: Array | None = None
    kind: str = "imported"
    aspect_ratio: float = float("nan")
    remarks: tuple[str, ...] = ()
    origin: Origin | None = None
    drawn: Array | None = None

    def __post_init__(self) -> None:
        """Check everything against everything else, and freeze the arrays."""
        points = np.array(self.points, dtype=float)
        if points.ndim == 2 and points.shape[1] == 2:
            points = np.column_stack((points, np.zeros(len(points))))
        if points.ndim != 2 or points.shape[1] != 3:
            raise MeshError("points must be an array (n, 3) in mm")
        if not np.isfinite(points).all():
            node = int(np.argmax(~np.isfinite(points).all(axis=1)))
            raise MeshError(f"node {node} is not finite; give three numbers in mm")
        set_ = object.__setattr__
        set_(self, "points", _frozen(points))
        if self.drawn is None or np.shape(self.drawn) != points.shape:  # of a copy with other nodes
            set_(self, "drawn", points)
        set_(self, "triangles", _frozen(_indices("triangles", self.triangles)))
        for name in ("edge_sets", "fold_angles"):
            whole = name == "edge_sets"
            frozen = {
                key: _frozen(_indices(key, value) if whole else np.array(value, dtype=float))
                for key, value in getattr(self, name).items()
            }
            set_(self, name, MappingProxyType(frozen))
        # plain integers, also of NumPy's, which JSON does not know
        corners = {name: int(node) for name, node in self.corners.items()}
        set_(self, "corners", MappingProxyType(corners))
        for name in ("folds", "curves"):
            set_(self, name, MappingProxyType(dict(getattr(self, name))))
        topology = self.topology
        _check_triangles(points, self.triangles)
        used = np.zeros(len(points), dtype=bool)
        used[self.triangles] = True
        if not used.all():
            raise MeshError(f"node {int(np.argmin(used))} belongs to no triangle; remove it")
        self._check_names(topology)
        if self.spans is not None:
            if np.shape(self.spans) != topology.edges.shape:
                raise MeshError(f"spans must have one row an edge, shape {topology.edges.shape}")
            set_(self, "spans", _frozen(np.array(self.spans, dtype=float)))

    def __repr__(self) -> str:
        """One line: "SheetMesh(451 nodes, 640 triangles, 1 crease, staggered, aspect ratio 8.1)"."""
        words = [count(len(self.points), "node"), count(len(self.triangles), "triangle")]
        words += [count(len(self.drawn_creases), "crease"), self.kind]
        if self.aspect_ratio == self.aspect_ratio:
            words.append(f"aspect ratio {self.aspect_ratio:.3g}")
        return f"SheetMesh({', '.join(words)})"

    def __reduce__(self) -> tuple[type[SheetMesh], tuple[object, ...]]:
        """Pickled as what it was made of: other processes check it anew and find its topology again."""
        values = (getattr(self, item.name) for item in fields(self))
        return SheetMesh, tuple(dict(v) if isinstance(v, MappingProxyType) else v for v in values)

    def _check_names(self, topology: Topology) -> None:
        """Named sets, corners, folds and angles belong to the mesh and to each other."""
        for name, pairs in self.edge_sets.items():
            if pairs.ndim != 2 or pairs.shape[1] != 2:
                raise MeshError(f"edge set '{name}' must be an array (k, 2) of node pairs")
            try:
                topology.find_edges(pairs)
            except MeshError as error:
                raise MeshError(f"'{name}' is not along the mesh: {error}") from None
        for name, node in self.corners.items():
            if not 0 <= node < len(self.points):
                raise MeshError(f"corner '{name}' names node {node} of {len(self.points)}; mend its index")
        for name, fold in self.folds.items():
            if fold not in FOLD_KINDS:
                raise MeshError(
                    f"crease '{name}': fold '{fold}' is not known; use one of {', '.join(FOLD_KINDS)}"
                )
        for name, angles in self.fold_angles.items():
            if angles.shape != (len(self.crease_edges(name)),):
                raise MeshError(f"crease '{name}' has {angles.size} fold angles; give one an edge")

    @property
    def pattern(self) -> CreasePattern | None:
        """The pattern that this mesh was made of, so that it can be meshed anew; None for others and changed copies."""
        origin = self._own_origin()
        return None if origin is None else origin.pattern

    @property
    def cells(self) -> Cells | None:
        """The cells of the pattern, so that they can be halved or doubled; None where there is no `pattern`."""
        origin = self._own_origin()
        return None if origin is None else origin.cells

    def _own_origin(self) -> Origin | None:
        if self.origin is None or self.origin.mark != _mark(self.points, self.triangles):
            return None
        return self.origin

    @cached_property
    def topology(self) -> Topology:
        """Edges, hinges and boundary, found when they are first asked for."""
        return build(self.triangles, len(self.points))

    @cached_property
    def areas(self) -> Array:
        """(t,) triangle areas, mm^2."""
        a, b, c = (self.points[self.triangles[:, k]] for k in range(3))
        return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))

    @cached_property
    def pieces(self) -> Ints:
        """(t,) number of the piece that each triangle belongs to; a sheet is one piece unless cuts part it."""
        return pieces(self.triangles, self.topology)

    @property
    def flat(self) -> bool:
        """True if every node lies in z = 0 (to 1e-9 of the size)."""
        return bool(np.abs(self.points[:, 2]).max() <= 1e-9 * self.size)

    @property
    def size(self) -> float:
        """Diagonal of the bounding box, mm."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @property
    def creases(self) -> tuple[str, ...]:
        """Names of the creases, without "crease:"."""
        return tuple(name.removeprefix("crease:") for name in self.edge_sets if name.startswith("crease:"))

    @property
    def wide_creases(self) -> tuple[str, ...]:
        """Names of the wide creases (`meshes.wide_creases`), without "strip:"."""
        return tuple(name.removeprefix(STRIP) for name in self.edge_sets if name.startswith(STRIP))

    @property
    def side_of(self) -> dict[str, str]:
        """The two lines of every wide crease, and the crease that they are of."""
        return {f"{name}-{side}": name for name in self.wide_creases for side in SIDES}

    @property
    def drawn_creases(self) -> tuple[str, ...]:
        """Names of the creases as they were drawn: wide ones by their own name in place of their two lines."""
        sides = self.side_of
        return tuple(dict.fromkeys(sides.get(name, name) for name in self.creases))

    def sense(self, crease: str) -> float:
        """-1 of a crease that is drawn as a valley, else 1: times a fold angle, mountain positive.

        Args:
            crease: its name.
        """
        return -1.0 if self.folds.get(crease) == "valley" else 1.0

    def nodes(self, at: str) -> Ints:
        """Nodes of a place: "corner:inner-start", "edge:inner", "crease:NAME", "node:N", "near:X,Y" or "all".

        "near:X,Y" is the node nearest to that place of the stress-free sheet, mm, seen from +z. Where cuts doubled the
        node of a corner, or the nearest one, all nodes at that place are meant; "node:N" is one of them.

        Returns:
            (k,) node numbers, in the order of the place.

        Raises:
            MeshError: there is no such place; the message lists those there are.
        """
        if at == "all":
            return np.arange(len(self.points))
        if at in self.corners:
            return self._there(self.corners[at])
        if at in self.edge_sets:
            pairs = self.edge_sets[at].ravel()
            return pairs[np.sort(np.unique(pairs, return_index=True)[1])]
        if at.startswith("node:"):
            text = at.removeprefix("node:")
            if text.isdecimal() and len(text) < 19 and int(text) < len(self.points):
                return np.array([int(text)])
            raise MeshError(f"'{at}' is not a node of the mesh; use node:0 to node:{len(self.points) - 1}")
        if at.startswith("near:"):
            return self._there(self._nearest(at))
        places = [*self.corners, *self.edge_sets, "node:N", "near:X,Y", "all"]
        raise MeshError(f"the sheet has no place '{at}'; use one of {', '.join(places)}")

    def _there(self, node: int) -> Ints:
        """A node and its copies at cuts."""
        return np.flatnonzero((self.points == self.points[node]).all(axis=1))

    def _nearest(self, at: str) -> int:
        try:
            x, y = (float(word) for word in at.removeprefix("near:").split(","))
        except ValueError:
            raise MeshError(f"'{at}' is no place; write two lengths in mm: near:10.5,20") from None
        away = np.hypot(self.points[:, 0] - x, self.points[:, 1] - y)
        nearest = int(away.argmin()) if np.isfinite(away).all() else 0
        if not away[nearest] <= 0.1 * self.size:
            raise MeshError(f"'{at}' is {away[nearest]:.4g} mm from the sheet; name a place on it")
        return nearest

    def crease_edges(self, crease: str) -> Ints:
        """(k, 2) node pairs along a crease, in order.

        Raises:
            MeshError: there is no such crease; the message lists those there are.
        """
        pairs = self.edge_sets.get(f"crease:{crease}")
        if pairs is None and f"strip:{crease}" in self.edge_sets:
            raise MeshError(
                f"crease '{crease}' has a width, so it is a strip, not a line: fold it by rest alone, say how stiff it "
                "is where its width is told, and hold or push the panels beside it"
            )
        if pairs is None:
            names = ", ".join(self.drawn_creases) or "none (the sheet has no crease)"
            raise MeshError(f"the sheet has no crease '{crease}'; its creases: {names}")
        return pairs


def _mark(points: Array, triangles: Ints) -> int:
    """Checksum of nodes and triangles; a flat sheet has the same in two and in three columns."""
    used = points if points[:, 2:].any() else points[:, :2]
    return zlib.crc32(
        np.ascontiguousarray(triangles).tobytes(), zlib.crc32(np.ascontiguousarray(used).tobytes())
    )


def _check_triangles(points: Array, triangles: Ints) -> None:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    doubled = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = np.max([np.sum(e * e, axis=1) for e in (b - a, c - b, a - c)], axis=0)
    thin = doubled <= 1e-10 * longest
    if thin.any():
        row = int(np.argmax(thin))
        raise MeshError(f"triangle {row} (nodes {triangles[row].tolist()}) is degenerate; it has no area")


def _indices(name: str, values: object) -> Ints:
    """Whole numbers as an index array; anything else is refused rather than cut off."""
    try:
        array = np.asarray(values)
    except ValueError as ragged:
        raise MeshError(
            f"{name}: rows of different length; give every row the same number of nodes"
        ) from ragged
    if array.size and array.dtype.kind not in "iu":
        raise MeshError(f"{name} must hold whole numbers (node indices)")
    return np.array(array, dtype=np.int64)


def _frozen(array: Array | Ints) -> Array | Ints:
    array.setflags(write=False)
    return array
