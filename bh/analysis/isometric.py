"""Sheets folded along one curved crease without any stretching (source App. A, 5.2.2; docs/isometric.md derives it).

`of_crease` begins with the folded crease c(u) and the dihedral angle phi(u), as the source does; `of_flat` and
`of_mesh` with the flat crease, as an engineer does. All give a `FoldedCrease`: frames, generators, the two
developable panels, their development to the flat sheet, widths, curvatures and bending energy. Signs are those of
`bh.creases`: seen from above (mountain creases push up) n points to the left of t, b up, and the signed curvature is
positive where the crease turns to the left. The frame is Frenet's but for its sign, so it goes smoothly through
inflections, where Frenet's turns over.
"""

from __future__ import annotations

from typing import TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.analysis import relations
from bh.analysis.crease_input import Given, derivatives, parameters
from bh.analysis.differences import Differentiation, InterpolatingSpline, SmoothingSpline
from bh.analysis.folded_crease import FoldedCrease
from bh.analysis.initial_guess import Relaxed, relax
from bh.analysis.isometric_mesh import Placed
from bh.analysis.relations import (
    dihedral_of,
    flat_curvature,
    fold_rate_of,
    folded_curvature,
    generator_angles,
    torsion_from_fold_rate,
    torsion_of,
)
from bh.analysis.ruled import Panel
from bh.errors import ModelError
from meshes import SheetMesh
from meshes.curves import Arc, Line, arc_lengths
from meshes.topology import chain_nodes

Array = NDArray[np.float64]
SAMPLES = 401
# of the largest curvature, or rad over the whole length: below it torsion has no value of its own
STRAIGHT = 1e-5
TURN = 1e-12  # of an integrated frame, relative

__all__ = [
    "FoldedCrease",
    "InterpolatingSpline",
    "Panel",
    "Placed",
    "Relaxed",
    "SmoothingSpline",
    "dihedral_of",
    "flat_curvature",
    "fold_rate_of",
    "folded_curvature",
    "generator_angles",
    "of_crease",
    "of_flat",
    "of_mesh",
    "relax",
    "torsion_from_fold_rate",
    "torsion_of",
]


class FlatStart(TypedDict, total=False):
    """Where the flat crease begins.

    Attributes:
        start: place (x, y) of its first point, mm; the origin by default.
        heading: its direction there, rad; along x by default.
    """

    start: tuple[float, float]
    heading: float


def of_crease(
    crease: Given,
    dihedral: Given,
    *,
    interval: tuple[float, float] | None = None,
    u: ArrayLike | None = None,
    samples: int = SAMPLES,
    up: ArrayLike | None = None,
    method: Differentiation | None = None,
    **flat: Unpack[FlatStart],
) -> FoldedCrease:
    """From the already-deformed crease c(u) and the dihedral angle phi(u) (source A.1).

    Args:
        crease: function of u (k,) that gives (k, 3), three expressions of one symbol (sympy), or samples (k,
            3) at `u`; mm.
        dihedral: a number, function, expression or samples (k,), rad in (0, 2 pi), below the sheet.
        interval: first and last u.
        u: (k,) parameters themselves, in place of an interval.
        samples: how many parameters are taken evenly on the interval.
        up: direction that the upper side of the sheet faces on the whole; by default such that the crease
            turns to the left on the whole.
        method: derivatives of functions and samples; by default splines of degree 7 through them. Samples
            with noise need `SmoothingSpline()`.
        **flat: start and heading of the flat crease, see `FlatStart`.

    Raises:
        ModelError: input that does not fit, a crease that stops (c' = 0), dihedral angles outside (0, 2 pi).
    """
    method = method or InterpolatingSpline()
    at = parameters(u, interval, samples)
    c, c1, c2, c3 = derivatives("the crease", crease, at, 3, method, 3)
    phi, rate = derivatives("the dihedral angle", dihedral, at, 1, method, 1)[:, :, 0]
    _check_dihedral(phi, at)
    speed = np.linalg.norm(c1, axis=1)
    if speed.min() <= 1e-9 * speed.max():
        raise ModelError(
            f"the crease stops (c' = 0) at u = {at[int(np.argmin(speed))]:g}; give it a regular parameter"
        )
    tangent = c1 / speed[:, None]
    cross = np.cross(c1, c2)
    size = np.linalg.norm(cross, axis=1)
    length = float(np.trapezoid(speed, at))
    kappa = size / speed**3
    curved = (kappa > STRAIGHT * kappa.max()) & (kappa * length > STRAIGHT)
    binormal, sign = _smooth_binormal(tangent, cross, curved, up)
    torsion = np.zeros(len(at))
    if curved.any():
        torsion[curved] = np.einsum("kc,kc->k", cross, c3)[curved] / size[curved] ** 2
        torsion = np.interp(at, at[curved], torsion[curved])
    if up is None and float(np.trapezoid(sign * kappa * speed, at)) < 0.0:
        binormal, sign = -binormal, -sign
    return FoldedCrease(
        u=at,
        points=c,
        speed=speed,
        tangent=tangent,
        normal=np.cross(binormal, tangent),
        binormal=binormal,
        curvature=sign * kappa,
        torsion=torsion,
        dihedral=phi,
        fold_rate=rate,
        method=method,
        **flat,
    )


def _smooth_binormal(
    tangent: Array, cross: Array, curved: NDArray[np.bool_], up: ArrayLike | None
) -> tuple[Array, Array]:
    """(k, 3) binormals without the jumps of Frenet's at inflections, and (k,) the sign of the curvature for them."""
    if not curved.any():
        guess = (
            np.eye(3)[np.argmin(np.abs(tangent).mean(axis=0))] if up is None else np.asarray(up, dtype=float)
        )
        return _across(np.tile(guess, (len(tangent), 1)), tangent), np.ones(len(tangent))
    places = np.arange(len(tangent))
    known = places[curved]
    b = cross[known] / np.linalg.norm(cross[known], axis=1, keepdims=True)
    flips = np.concatenate(([1.0], np.where(np.einsum("kc,kc->k", b[:-1], b[1:]) < 0.0, -1.0, 1.0)))
    signs = np.cumprod(flips)
    b = b * signs[:, None]
    if up is not None and float((b @ np.asarray(up, dtype=float)).sum()) < 0.0:
        b, signs = -b, -signs
    everywhere = np.column_stack([np.interp(places, known, b[:, i]) for i in range(3)])
    nearest = np.argmin(np.abs(places[:, None] - known[None, :]), axis=1)
    return _across(everywhere, tangent), signs[nearest]


def _across(vectors: Array, tangent: Array) -> Array:
    """Unit vectors of what is left of `vectors` across the tangent."""
    out = vectors - np.einsum("kc,kc->k", vectors, tangent)[:, None] * tangent
    return np.asarray(out / np.linalg.norm(out, axis=1, keepdims=True))


def of_flat(
    curvature: Given,
    dihedral: Given,
    length: float,
    *,
    torsion: Given = 0.0,
    samples: int = SAMPLES,
    start: tuple[float, float] = (0.0, 0.0),
    heading: float = 0.0,
    method: Differentiation | None = None,
) -> FoldedCrease:
    """From the flat crease: its curvature, the dihedral angle and the torsion that the folded crease is to have.

    The folded crease has kappa = kappa_0 / sin(phi / 2) (Eq. 5.3) and begins where the flat one does, in the same
    direction, with its binormal along z. Torsion is free in isometric theory; a plane crease (zero) bends the panels of
    a single crease the least, but for the free ends.

    Args:
        curvature: kappa_0 of the flat crease over its length, 1/mm, positive to the left: a number, function
            of the length (k,), expression, or `samples` values.
        dihedral: likewise, rad in (0, 2 pi).
        length: of the crease, mm.
        torsion: likewise, 1/mm.
        samples: how many points the crease is computed at.
        start: place (x, y) of the flat crease at its first point, mm.
        heading: its direction there, rad.
        method: differentiates the dihedral angle; by default splines of degree 7.

    Raises:
        ModelError: input that does not fit.
    """
    if not (np.isfinite(length) and length > 0.0):
        raise ModelError(f"length = {length} of a crease cannot be; give a positive length in mm")
    method = method or InterpolatingSpline()
    at = parameters(None, (0.0, length), samples)
    flat = derivatives("the curvature of the flat crease", curvature, at, 1, method, 0)[0, :, 0]
    phi, rate = derivatives("the dihedral angle", dihedral, at, 1, method, 1)[:, :, 0]
    tau = derivatives("the torsion", torsion, at, 1, method, 0)[0, :, 0]
    _check_dihedral(phi, at)
    kappa = relations.folded_curvature(flat, phi)
    frame = np.array(
        [[np.cos(heading), np.sin(heading), 0.0], [-np.sin(heading), np.cos(heading), 0.0], [0.0, 0.0, 1.0]]
    )
    points, frames = _integrate_frame(at, kappa, tau, np.array([*start, 0.0]), frame)
    return FoldedCrease(
        u=at,
        points=points,
        speed=np.ones_like(at),
        tangent=frames[:, 0],
        normal=frames[:, 1],
        binormal=frames[:, 2],
        curvature=kappa,
        torsion=tau,
        dihedral=phi,
        fold_rate=rate,
        start=start,
        heading=heading,
        method=method,
    )


def _integrate_frame(s: Array, kappa: Array, tau: Array, start: Array, frame: Array) -> tuple[Array, Array]:
    """Points (k, 3) and frames (k, 3, 3) with rows t, n, b of a curve with given curvature and torsion (A.5)."""
    from scipy.integrate import solve_ivp

    made = InterpolatingSpline(7).through(s, np.column_stack((kappa, tau)))

    def rate(at: float, y: Array) -> Array:
        k, w = made(at)
        t, n, b = y[3:].reshape(3, 3)
        return np.concatenate((t, k * n, -k * t + w * b, -w * n))

    first = np.concatenate((start, frame.ravel()))
    done = solve_ivp(rate, (s[0], s[-1]), first, method="DOP853", t_eval=s, rtol=TURN, atol=TURN)
    frames = done.y[3:].T.reshape(-1, 3, 3)
    left, _, right = np.linalg.svd(frames)
    return done.y[:3].T, left @ right


def of_mesh(
    mesh: SheetMesh, crease: str, dihedral: Given, torsion: Given = 0.0, samples: int = SAMPLES
) -> FoldedCrease:
    """Fold the crease of a flat mesh: `place(mesh.points[:, :2])` of the result puts its nodes on the folded sheet.

    The crease's exact curve is taken where it is an arc or a line, else splines through its nodes.

    Args:
        mesh: flat.
        crease: its name.
        dihedral: as for `of_flat`, over the length of the flat crease, rad.
        torsion: as for `of_flat`, over the length of the flat crease, 1/mm.
        samples: how many points the crease is computed at.

    Raises:
        ModelError: the mesh is not flat, or the crease is closed: an isometric fold of one needs a curve that
            closes.
    """
    if not mesh.flat:
        raise ModelError("isometric folding begins with a flat sheet; this mesh is not flat")
    pairs = mesh.crease_edges(crease)
    nodes = mesh.points[chain_nodes(pairs), :2]
    curve = mesh.curves.get(f"crease:{crease}")
    ends = nodes[0], nodes[-1]
    if np.linalg.norm(ends[1] - ends[0]) < 1e-9 * mesh.size:
        raise ModelError(f"crease '{crease}' is closed; isometric theory folds open creases, so cut it")
    if isinstance(curve, Arc):
        sense = np.sign(curve.sweep) * _same_way(curve, nodes)
        out = ends[0] - np.asarray(curve.centre)
        heading = float(np.arctan2(sense * out[0], -sense * out[1]))
        start = (float(ends[0][0]), float(ends[0][1]))
        return of_flat(
            sense / curve.radius,
            dihedral,
            curve.length,
            torsion=torsion,
            samples=samples,
            start=start,
            heading=heading,
        )
    if isinstance(curve, Line):
        way = ends[1] - ends[0]
        start = (float(ends[0][0]), float(ends[0][1]))
        return of_flat(
            0.0,
            dihedral,
            curve.length,
            torsion=torsion,
            samples=samples,
            start=start,
            heading=float(np.arctan2(way[1], way[0])),
        )
    drawn = of_crease(
        np.column_stack((nodes, np.zeros(len(nodes)))), np.pi, u=arc_lengths(nodes), up=(0.0, 0.0, 1.0)
    )
    arc = InterpolatingSpline(7).through(drawn.arc_length, drawn.curvature)
    first = drawn.tangent[0]
    return of_flat(
        lambda s: arc(s),
        dihedral,
        float(drawn.arc_length[-1]),
        torsion=torsion,
        samples=samples,
        start=(float(nodes[0, 0]), float(nodes[0, 1])),
        heading=float(np.arctan2(first[1], first[0])),
    )


def _same_way(curve: Arc, nodes: Array) -> float:
    """+1 if the nodes run as the curve does, -1 if against it."""
    first = curve.point(np.array([0.0]))[0]
    return 1.0 if np.linalg.norm(nodes[0] - first) < np.linalg.norm(nodes[-1] - first) else -1.0


def _check_dihedral(phi: Array, u: Array) -> None:
    wrong = ~((phi > 0.0) & (phi < 2.0 * np.pi))
    if wrong.any():
        worst = int(np.argmax(wrong))
        raise ModelError(
            f"dihedral angle {phi[worst]:.4g} rad at u = {u[worst]:.4g} cannot be folded without stretching; "
            "give angles between 0 and 2 pi"
            + ("; angles are radians, not degrees" if np.abs(phi).max() > 7.0 else "")
        )
