"""A segment of the crease: its domain, and its shape where it is folded without a pinch (source 6.2.3, 6.2.4)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.applications.inverse.transforms import matrix
from bh.errors import InputError

Array = NDArray[np.float64]


class DesignError(InputError):
    """A design, a target or a data set that cannot be used."""


@dataclass(frozen=True)
class Domain:
    """Which segments there are (Eq. 6.21, 6.22).

    Attributes:
        k0: largest curvature before folding, 1/mm.
        length: shortest and longest, mm.
        sector: largest sector angle |k| l after folding, rad.
        fold: dihedral angle phi_R of the folded crease, rad.
    """

    k0: float = 0.02
    length: tuple[float, float] = (100.0, 300.0)
    sector: float = math.pi
    fold: float = 0.5 * math.pi

    def curvature(self, k0: ArrayLike) -> Array:
        """Curvature after folding, 1/mm (Eq. 6.6).

        Returns:
            of the shape of `k0`.
        """
        return np.asarray(k0, dtype=float) / math.sin(0.5 * self.fold)

    def holds(self, k0: ArrayLike, length: ArrayLike, slack: float = 1e-9) -> NDArray[np.bool_]:
        """Whether segments are inside. The source prints the sector's bound without the modulus that it means.

        Args:
            k0: curvatures before folding, 1/mm.
            length: mm.
            slack: relative, on every bound.

        Returns:
            broadcast from `k0` and `length`.
        """
        k0, length = np.asarray(k0, dtype=float), np.asarray(length, dtype=float)
        low, high = self.length
        return np.asarray(
            (np.abs(k0) <= self.k0 * (1.0 + slack))
            & (length >= low * (1.0 - slack))
            & (length <= high * (1.0 + slack))
            & (np.abs(self.curvature(k0)) * length <= self.sector * (1.0 + slack))
        )

    def largest_curvature(self, length: ArrayLike) -> Array:
        """Largest |k0| of segments of some lengths, 1/mm.

        Returns:
            of the shape of `length`.
        """
        bound = self.sector * math.sin(0.5 * self.fold) / np.asarray(length, dtype=float)
        return np.minimum(self.k0, bound)


def folded(k0: ArrayLike, length: ArrayLike, fold: float = 0.5 * math.pi) -> tuple[Array, Array]:
    """Shape of segments folded to the dihedral angle `fold` and not pinched: plane arcs (Eq. 6.6 to 6.8).

    With theta = k l, sin(theta) / k = l sinc(theta) and (1 - cos(theta)) / k = l (theta / 2) sinc(theta / 2)^2: one
    expression for all curvatures, zero included.

    Args:
        k0: (...) curvatures before folding, 1/mm.
        length: (...), mm.
        fold: dihedral angle, rad.

    Returns:
        (..., 3) translations and (..., 3) Tait-Bryan angles (0, 0, k l).
    """
    k0, length = np.broadcast_arrays(np.asarray(k0, dtype=float), np.asarray(length, dtype=float))
    theta = k0 / math.sin(0.5 * fold) * length
    x = length * np.sinc(theta / np.pi)
    y = length * 0.5 * theta * np.sinc(0.5 * theta / np.pi) ** 2
    zero = np.zeros_like(theta)
    return np.stack((x, y, zero), axis=-1), np.stack((zero, zero, theta), axis=-1)


def folded_transforms(k0: ArrayLike, length: ArrayLike, fold: float = 0.5 * math.pi) -> tuple[Array, Array]:
    """Local translations (..., 3), mm, and rotations (..., 3, 3) of segments that are not pinched.

    The arguments are those of `folded`.

    Args:
        k0: (...) curvatures before folding, 1/mm.
        length: (...), mm.
        fold: dihedral angle, rad.

    Returns:
        the translations and the rotations.
    """
    t, uvw = folded(k0, length, fold)
    return t, matrix(uvw)


def grid(
    domain: Domain | None = None, step_k0: float = 5e-4, step_length: float = 4.0
) -> tuple[Array, Array]:
    """(m,) curvatures and lengths of the source's grid that lie in the domain; 2,487 by default.

    Args:
        domain: None for the source's.
        step_k0: between curvatures, 1/mm.
        step_length: between lengths, mm.
    """
    domain = domain or Domain()
    steps = round(domain.k0 / step_k0)
    k0 = np.arange(-steps, steps + 1) * step_k0
    low, high = domain.length
    lengths = low + step_length * np.arange(round((high - low) / step_length) + 1)
    k, l = (x.ravel() for x in np.meshgrid(k0, lengths, indexing="ij"))  # noqa: E741
    inside = domain.holds(k, l)
    return k[inside], l[inside]


def beyond(
    domain: Domain | None = None, step_k0: float = 5e-4, step_length: float = 4.0
) -> tuple[Array, Array]:
    """(m,) curvatures and lengths that continue the grid to the sector's bound, and one step past it.

    Interpolation runs over parts of the largest sector angle; without these its edge would be extrapolated.

    Args:
        domain: None for the source's.
        step_k0: between curvatures, 1/mm.
        step_length: between lengths, mm.
    """
    domain = domain or Domain()
    steps = round(domain.k0 / step_k0)
    low, high = domain.length
    lengths = low + step_length * np.arange(round((high - low) / step_length) + 1)
    bound = domain.sector * math.sin(0.5 * domain.fold) / lengths
    last = np.floor(bound / step_k0 * (1.0 + 1e-9)).astype(int)
    k0: list[float] = []
    at: list[float] = []
    for length, inside in zip(lengths, last, strict=True):
        more = np.arange(min(steps, inside) + 1, inside + 2) * step_k0
        k0 += [*(-more[::-1]), *more]
        at += [length] * (2 * len(more))
    return np.array(k0), np.array(at)
