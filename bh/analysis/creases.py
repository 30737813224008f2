"""Creases of a solved sheet as space curves: curvature, torsion, frames, fold angle and rate (source 5.2.1, App. A).

The parameter u is the length along the crease in the flat sheet, mm. Frames, seen from above (mountain creases push
up): the tangent t runs along the crease as drawn, `up` halves the angle between the upper normals of the two
panels, the left panel lies to the left of t. Curvature and torsion are those of Eq. A.6 and A.7; `signed_curvature`
is positive where the crease turns to the left as seen from above, and then n and b of Frenet's frame are `left` and
nearly `up`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.analysis import relations
from bh.analysis.differences import Differentiation, FiniteDifferences, SmoothingSpline, one_sided
from bh.analysis.generators import Generators, panel_generators
from bh.errors import ModelError
from bh.formulations.state import State
from bh.loading.load_step import crease_hinges
from bh.runtime.one_line import OneLine
from meshes import SheetMesh
from meshes.curves import arc_lengths
from meshes.topology import chain_nodes

Array = NDArray[np.float64]
STRAIGHT = (
    1e-6  # turns by less than this, rad over its whole length, count as straight: there torsion has no value
)
PADDING = 4  # samples that a closed crease is continued by at its seam

__all__ = [
    "CreaseCurve",
    "CreaseProfile",
    "FiniteDifferences",
    "Generators",
    "SmoothingSpline",
    "along",
    "curve_of",
    "panel_generators",
]


@dataclass(frozen=True, eq=False, repr=False)
class CreaseCurve(OneLine):
    """A sampled space curve and its Frenet frame.

    Attributes:
        u: (k,) parameters, mm.
        points: (k, 3), mm.
        speed: (k,) s = |c'| (A.3): 1 + strain where u is the flat length.
        tangent: (k, 3) unit vectors t (A.4).
        normal: (k, 3) unit vectors n. Where the curve is straight n and b are those of the nearest curved
            place, turned into the plane across t.
        binormal: (k, 3) unit vectors b.
        curvature: (k,) kappa >= 0, 1/mm (A.6).
        torsion: (k,) tau, 1/mm (A.7), positive for a right-handed helix. Where the curve is straight torsion
            has no value of its own and is interpolated (0 if it is straight throughout).
        one_sided: (k,) True where no centred stencil fits: three nodes at either end, where the end error of
            finite differences is to be expected.
    """

    u: Array
    points: Array
    speed: Array
    tangent: Array
    normal: Array
    binormal: Array
    curvature: Array
    torsion: Array
    one_sided: NDArray[np.bool_]


@dataclass(frozen=True, eq=False, repr=False)
class CreaseProfile(OneLine):
    """A crease of a solved sheet, at its nodes.

    Attributes:
        crease: its name.
        curve: the folded crease with u measured in the flat sheet.
        up: (k, 3) unit vectors between the upper normals of both panels.
        left: (k, 3) unit vectors across the crease to the left.
        signed_curvature: (k,) curvature, negative where the crease turns to the right, 1/mm.
        flat_curvature: (k,) kappa_0 of the crease in the flat sheet, signed alike, 1/mm.
        dihedral: (k,) phi, rad, from its values on the edges by the same differentiation.
        fold_rate: (k,) phi' = d phi / du, rad/mm.
    """

    crease: str
    curve: CreaseCurve
    up: Array
    left: Array
    signed_curvature: Array
    flat_curvature: Array
    dihedral: Array
    fold_rate: Array

    @property
    def u(self) -> Array:
        """(k,) length along the crease in the flat sheet, mm."""
        return self.curve.u

    @property
    def curvature(self) -> Array:
        """(k,) kappa, 1/mm (A.6)."""
        return self.curve.curvature

    @property
    def torsion(self) -> Array:
        """(k,) tau, 1/mm (A.7)."""
        return self.curve.torsion

    @property
    def isometric_curvature(self) -> Array:
        """(k,) kappa_0 / sin(phi / 2), signed, 1/mm (Eq. 5.3): what the curvature were if nothing stretched."""
        return relations.folded_curvature(self.flat_curvature, self.dihedral)

    @property
    def generator_angles(self) -> tuple[Array, Array]:
        """(gamma_L, gamma_R) that isometric theory expects from the crease alone (A.12), (k,) each, rad."""
        return relations.generator_angles(
            self.signed_curvature,
            self.torsion,
            self.dihedral,
            self.fold_rate,
            self.curve.speed,
            STRAIGHT / self.u[-1],
        )


def along(state: State, crease: str, method: Differentiation | None = None) -> CreaseProfile:
    """Curvature, torsion, frames, fold angle and fold rate along a crease of a solved state.

    Args:
        state: of a path, or of the shell.
        crease: its name.
        method: `FiniteDifferences()` of fourth order, as the source, or a `SmoothingSpline()`.

    Raises:
        MeshError: no such crease.
        InputError: it has too few nodes (7).
        ModelError: it branches.
    """
    method = method or FiniteDifferences()
    mesh = state.mesh
    nodes, closed = _chain(mesh, crease)
    flat = mesh.points[nodes]
    u = arc_lengths(flat)
    curve = curve_of(state.points[nodes], u, method, closed)
    up = _up(state, crease, closed)
    up = _unit(up - _dot(up, curve.tangent)[:, None] * curve.tangent)
    left = np.cross(up, curve.tangent)
    drawn = curve_of(flat, u, method, closed)
    flat_up = _unit(_mean_at_nodes(_edge_normals(mesh, mesh.points, crease)[0], closed))
    middle = 0.5 * (u[1:] + u[:-1])
    angles = np.unwrap(state.dihedral(crease))[:, None]
    samples, values = _continued(middle, angles, u[-1], closed)
    phi = method.derivatives(samples, values, u, 1)[:, :, 0]
    return CreaseProfile(
        crease=crease,
        curve=curve,
        up=up,
        left=left,
        signed_curvature=curve.curvature * _sign(_dot(curve.normal, left)),
        flat_curvature=drawn.curvature * _sign(_dot(drawn.normal, np.cross(flat_up, drawn.tangent))),
        dihedral=phi[0],
        fold_rate=phi[1],
    )


def curve_of(
    points: ArrayLike,
    u: ArrayLike | None = None,
    method: Differentiation | None = None,
    closed: bool = False,
) -> CreaseCurve:
    """Curvature, torsion and frame of any polyline.

    Args:
        points: (k, 3) or (k, 2), mm; of a closed one the last is the first again.
        u: (k,) rising parameters; by default the length of the chords.
        method: `FiniteDifferences()` of fourth order, as the source, or a `SmoothingSpline()`.
        closed: the curve closes smoothly at its ends.

    Raises:
        InputError: fewer than 7 points.
        ModelError: arrays that do not fit.
    """
    method = method or FiniteDifferences()
    x = np.asarray(points, dtype=float)
    if x.ndim != 2 or x.shape[1] not in (2, 3) or not np.isfinite(x).all():
        raise ModelError("the points of a curve must be a finite array (k, 3) or (k, 2) in mm")
    x = np.column_stack((x, np.zeros((len(x), 3 - x.shape[1]))))
    if u is None:
        u = arc_lengths(x)
    at = np.asarray(u, dtype=float)
    if at.shape != (len(x),) or not (np.diff(at) > 0.0).all():
        raise ModelError(
            f"the {len(x)} points of a curve need as many parameters u that rise from one to the next"
        )
    cut = slice(0, len(x) - 1) if closed else slice(None)
    samples, values = _continued(at[cut], x[cut], at[-1], closed)
    _, c1, c2, c3 = method.derivatives(samples, values, at, 3)
    speed = np.linalg.norm(c1, axis=1)
    cross = np.cross(c1, c2)
    size = np.linalg.norm(cross, axis=1)
    curvature = size / speed**3
    length = float(np.trapezoid(speed, at))
    curved = curvature * length > STRAIGHT
    tangent = c1 / speed[:, None]
    torsion = np.zeros(len(x))
    torsion[curved] = _dot(cross, c3)[curved] / size[curved] ** 2
    binormal = _fill_binormal(tangent, cross, curved)
    if curved.any():
        torsion = np.interp(at, at[curved], torsion[curved])
    ends = one_sided(samples, at) if len(samples) >= 7 else np.ones(len(x), dtype=bool)
    return CreaseCurve(at, x, speed, tangent, np.cross(binormal, tangent), binormal, curvature, torsion, ends)


def _fill_binormal(tangent: Array, cross: Array, curved: NDArray[np.bool_]) -> Array:
    """Unit binormals; straight places take that of the nearest curved one, or any direction across."""
    places = np.arange(len(tangent))
    if curved.any():
        known = places[curved]
        nearest = known[np.argmin(np.abs(places[:, None] - known[None, :]), axis=1)]
        guess = cross[nearest]
    else:
        guess = np.tile(np.eye(3)[np.argmin(np.abs(tangent).mean(axis=0))], (len(tangent), 1))
    return _unit(guess - _dot(guess, tangent)[:, None] * tangent)


def _chain(mesh: SheetMesh, crease: str) -> tuple[NDArray[np.int64], bool]:
    """(k,) nodes of a crease in order, and whether it closes (the first node is then repeated last)."""
    pairs = mesh.crease_edges(crease)
    if len(pairs) > 1 and not (pairs[:-1, 1] == pairs[1:, 0]).all():
        raise ModelError(
            f"crease '{crease}' is not one chain of edges in order; split it where it branches or is interrupted"
        )
    nodes = chain_nodes(pairs)
    return nodes, bool(nodes[0] == nodes[-1])


def _continued(u: Array, values: Array, period: float, closed: bool) -> tuple[Array, Array]:
    """Samples of a closed curve continued beyond its seam; of an open one as they are."""
    if not closed:
        return u, values
    n = min(PADDING, len(u))
    u = np.concatenate((u[-n:] - period, u, u[:n] + period))
    return u, np.concatenate((values[-n:], values, values[:n]))


def _edge_normals(mesh: SheetMesh, points: Array, crease: str) -> tuple[Array, Array]:
    """Sums of both panels' upper normals, and of their directions away from the crease, (k, 3) each, at its edges."""
    hinge = mesh.topology.hinges[crease_hinges(mesh, crease)]
    wing_a, j, k, wing_b = (points[hinge[:, column]] for column in range(4))
    e = _unit(k - j)
    away = [_unit((w - j) - _dot(w - j, e)[:, None] * e) for w in (wing_a, wing_b)]
    return np.cross(e, away[0]) - np.cross(e, away[1]), away[0] + away[1]


def _up(state: State, crease: str, closed: bool) -> Array:
    """(k, 3) directions between the upper normals, also where they are opposite (a crease that is closed)."""
    normals, away = _edge_normals(state.mesh, state.points, crease)
    half = 0.5 * state.dihedral_angles[crease_hinges(state.mesh, crease)][:, None]
    # normals sum to 2 sin(phi / 2) up, and directions away from the crease to -2 cos(phi / 2) up
    return _mean_at_nodes(normals * np.sin(half) - away * np.cos(half), closed)


def _mean_at_nodes(edges: Array, closed: bool) -> Array:
    first, last = (edges[-1:], edges[:1]) if closed else (edges[:1], edges[-1:])
    return 0.5 * (np.concatenate((first, edges)) + np.concatenate((edges, last)))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("kc,kc->k", a, b))


def _sign(values: Array) -> Array:
    return np.where(values < 0.0, -1.0, 1.0)


def _unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True))
