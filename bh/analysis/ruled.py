"""One panel of a sheet that is folded without stretching: a developable surface of generators that leave the crease.

With the generator g at the angle gamma from the tangent, q = 1 / v_r the inverse of the distance v_r along it at which
it touches its neighbours (the regression curve), and kappa_2 the curvature across it, both from the flat pattern,

    q = (gamma' +- theta') / (s sin gamma)        (+ left, - right; theta the heading of the flat crease)
    kappa_2(v) = kappa_2(0) / (1 - q v),          area element dA = s sin gamma (1 - q v) du dv

and kappa_1 = 0, so the bending energy is 1/2 D kappa_2^2 an area with D = E t^3 / (12 (1 - nu^2)) for any nu.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.errors import ModelError
from bh.runtime.one_line import OneLine

Array = NDArray[np.float64]
ALONG = 1e-9  # sines of generator angles below: generators along the crease
TRIMMED = 0.999  # of the way to the regression curve, where a panel is trimmed
NEAR = 1e-12  # 1 - q v below: on the regression curve


@dataclass(frozen=True, eq=False, repr=False)
class Panel(OneLine):
    """The sheet on one side of a crease, along which it is sampled at k parameters.

    Attributes:
        side: "left" or "right" of the crease, seen from above.
        u: (k,) parameters.
        speed: (k,) s = |c'|, mm a unit of u.
        crease: (k, 3) the folded crease c, mm.
        flat_crease: (k, 2) the same in the flat sheet, mm.
        normal: (k, 3) unit normals N on the upper side (A.11).
        angle: (k,) generator angles gamma from the tangent, rad in [0, pi] (A.12).
        generator: (k, 3) unit vectors g (A.13).
        flat_generator: (k, 2) the same in the flat sheet.
        convergence: (k,) q, 1/mm: positive where generators come together on this side, inf where they run
            along the crease.
        kappa: (k,) kappa_2 at the crease, 1/mm; positive where the panel is hollow on its upper side.
    """

    side: str
    u: Array
    speed: Array
    crease: Array
    flat_crease: Array
    normal: Array
    angle: Array
    generator: Array
    flat_generator: Array
    convergence: Array
    kappa: Array

    @property
    def sign(self) -> float:
        """+1 for the left panel, -1 for the right one."""
        return 1.0 if self.side == "left" else -1.0

    @property
    def regression(self) -> Array:
        """(k,) distances v_r along the generators at which they touch their neighbours, mm; inf where they never do."""
        with np.errstate(divide="ignore"):
            return np.where(self.convergence > 0.0, 1.0 / np.maximum(self.convergence, 1e-300), np.inf)

    @property
    def largest_width(self) -> float:
        """Distance from the crease to the nearest point of the regression curve, mm (inf: there is none)."""
        v = self.regression
        some = np.isfinite(v)
        if not some.any():
            return np.inf
        points = self.flat_crease[some] + v[some, None] * self.flat_generator[some]
        return float(min(distances(points, self.flat_crease)))

    def curvature(self, v: ArrayLike) -> Array:
        """kappa_2 at distances v along the generators (k,) or (k, m), 1/mm.

        Raises:
            ModelError: a distance reaches the regression curve.
        """
        v = np.asarray(v, dtype=float)
        q, kappa = (a.reshape(-1, *[1] * (v.ndim - 1)) for a in (self.convergence, self.kappa))
        self._check(v)
        return np.asarray(kappa / (1.0 - q * v))

    def surface(self, v: ArrayLike) -> Array:
        """(k, ..., 3) points c + v g of the folded panel at distances v (k, ...), mm (A.9).

        Returns:
            broadcast to (k, ..., 3).
        """
        v = np.asarray(v, dtype=float)
        shape = (len(self.u), *[1] * (v.ndim - 1), 3)
        return self.crease.reshape(shape) + v[..., None] * self.generator.reshape(shape)

    def development(self, v: ArrayLike) -> Array:
        """(k, ..., 2) the same points in the flat sheet, mm.

        Returns:
            broadcast to (k, ..., 2).
        """
        v = np.asarray(v, dtype=float)
        shape = (len(self.u), *[1] * (v.ndim - 1), 2)
        return self.flat_crease.reshape(shape) + v[..., None] * self.flat_generator.reshape(shape)

    def reach(self, width: float, trim: bool = False) -> Array:
        """(k,) distances along the generators to the edge of a strip of that width, mm.

        The strip is bounded by the line at the distance `width` from the flat crease and by the lines across its two
        ends. A generator that meets one of these ends there.

        Args:
            width: of the strip, mm.
            trim: end just before the regression curve where it lies inside; otherwise that is an error.

        Raises:
            ModelError: the strip reaches the regression curve; the message gives the largest width.
        """
        if not (np.isfinite(width) and width > 0.0):
            raise ModelError(f"width = {width} of a panel cannot be; give a positive length in mm")
        v = self._to_offset(width, width / np.maximum(np.sin(self.angle), ALONG))
        v = np.minimum(v, self._to_ends())
        limit = self.regression
        if trim:
            return np.minimum(v, TRIMMED * limit)
        met = v >= limit
        if met.any():
            worst = int(np.argmin(np.where(met, limit, np.inf)))
            how = "run along the crease" if self.convergence[worst] == np.inf else "meet"
            raise ModelError(
                f"generators of the {self.side} panel {how} at u = {self.u[worst]:.4g}, within its width of {width:g} "
                f"mm; make it narrower than {self.largest_width:.4g} mm, or trim it"
            )
        return v

    def bending_energy(self, stiffness: float, reach: ArrayLike) -> float:
        """Bending energy 1/2 D int kappa_2^2 dA of the panel, N mm.

        Args:
            stiffness: D, N mm.
            reach: (k,) distances along the generators up to which it counts, mm.

        Raises:
            ModelError: a generator reaches the regression curve, where the energy has no bound.
        """
        from scipy.integrate import simpson

        v = np.broadcast_to(np.asarray(reach, dtype=float), self.u.shape)
        self._check(v)
        q = np.where(np.isfinite(self.convergence), self.convergence, 0.0)
        qv = q * v
        small = np.abs(qv) < 1e-8
        # int dv / (1 - q v) = -ln(1 - q v) / q
        inner = np.where(small, v * (1.0 + 0.5 * qv), -np.log1p(-qv) / np.where(small, 1.0, q))
        density = 0.5 * stiffness * self.kappa**2 * self.speed * np.sin(self.angle) * inner
        return float(simpson(density, x=self.u))

    def _check(self, v: Array) -> None:
        q = self.convergence.reshape(-1, *[1] * (v.ndim - 1))
        with np.errstate(invalid="ignore"):
            beyond = 1.0 - np.where(v == 0.0, 0.0, q * v) <= NEAR
        if beyond.any():
            row = int(np.argmax(beyond.reshape(len(self.u), -1).any(axis=1)))
            raise ModelError(
                f"the {self.side} panel at u = {self.u[row]:.4g} reaches its regression curve, "
                f"{self.regression[row]:.4g} mm along the generator; keep it shorter"
            )

    def _to_offset(self, width: float, start: Array) -> Array:
        """(k,) distances at which the generators are `width` from the flat crease, by Newton's method.

        The derivative of the distance along a generator is its component along the normal at the foot.
        """
        v = start.copy()
        for _ in range(60):
            foot, normal = feet(self.development(v), self.flat_crease, self.u)
            gap = self.sign * np.einsum("kc,kc->k", self.development(v) - foot, normal) - width
            rate = self.sign * np.einsum("kc,kc->k", self.flat_generator, normal)
            step = np.where(np.abs(rate) > 0.05, gap / np.where(np.abs(rate) > 0.05, rate, 1.0), 0.0)
            v = np.clip(v - step, 0.0, 4.0 * start)
            if np.abs(step).max() <= 1e-12 * width:
                break
        return v

    def _to_ends(self) -> Array:
        """(k,) distances at which generators meet the lines across the ends of the crease; inf where they do not."""
        out = np.full(len(self.u), np.inf)
        if np.linalg.norm(self.flat_crease[0] - self.flat_crease[-1]) < 1e-9 * np.abs(self.flat_crease).max():
            return out
        for end, inwards in ((0, 1.0), (-1, -1.0)):
            heading = self.flat_generator[end]
            turn = -self.sign * self.angle[end]
            tangent = inwards * np.array(
                [
                    heading[0] * np.cos(turn) - heading[1] * np.sin(turn),
                    heading[0] * np.sin(turn) + heading[1] * np.cos(turn),
                ]
            )
            gap = (self.flat_crease - self.flat_crease[end]) @ tangent
            rate = self.flat_generator @ tangent
            meets = (rate < -ALONG) & (gap >= 0.0)
            out[meets] = np.minimum(out[meets], gap[meets] / -rate[meets])
        return out


def feet(points: Array, line: Array, u: Array) -> tuple[Array, Array]:
    """Nearest points on a sampled plane curve, continued straight, and its left normals there, (p, 2) each.

    Args:
        points: (p, 2), mm.
        line: (k, 2) samples of the curve, mm.
        u: (k,) their parameters.
    """
    from scipy.interpolate import make_interp_spline

    made = make_interp_spline(u, line, k=5)
    near = np.argmin(((points[:, None, :] - line[None, :, :]) ** 2).sum(axis=2), axis=1)
    at = u[near].copy()
    for _ in range(20):
        c, c1, c2 = made(at), made(at, 1), made(at, 2)
        f = np.einsum("pc,pc->p", points - c, c1)
        slope = np.einsum("pc,pc->p", points - c, c2) - np.einsum("pc,pc->p", c1, c1)
        step = np.where(slope < 0.0, f / np.where(slope < 0.0, slope, 1.0), 0.0)
        at = np.clip(at - step, u[0], u[-1])
        if np.abs(step).max(initial=0.0) <= 1e-13 * (u[-1] - u[0]):
            break
    tangent = made(at, 1)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    foot = made(at)
    beyond = np.einsum("pc,pc->p", points - foot, tangent)
    beyond = np.where((at <= u[0]) & (beyond < 0.0) | (at >= u[-1]) & (beyond > 0.0), beyond, 0.0)
    return foot + beyond[:, None] * tangent, np.column_stack((-tangent[:, 1], tangent[:, 0]))


def distances(points: Array, line: Array) -> Array:
    """(p,) distances of points from a polyline's vertices, mm.

    Args:
        points: (p, 2), mm.
        line: (k, 2) vertices, mm.
    """
    from scipy.spatial import KDTree

    return np.asarray(KDTree(line).query(points)[0])
