"""A crease that is folded without stretching: frames, development, its two panels and what they make of a sheet."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.analysis import relations
from bh.analysis.differences import Differentiation, InterpolatingSpline
from bh.analysis.isometric_mesh import Placed, ruled_mesh, strip_mesh
from bh.analysis.ruled import ALONG, TRIMMED, Panel
from bh.errors import ModelError
from bh.model.sheet import Sheet
from bh.runtime.one_line import OneLine
from meshes import SheetMesh

Array = NDArray[np.float64]
NONE = 1e-9  # turns in rad over the whole length that are rounding


@dataclass(frozen=True, eq=False, repr=False)
class FoldedCrease(OneLine):
    """A crease that is folded isometrically, sampled at k parameters u.

    Attributes:
        u: (k,) parameters.
        points: (k, 3) c, mm.
        speed: (k,) s = |c'|, mm a unit of u (A.3).
        tangent: (k, 3) unit vectors t (A.4).
        normal: (k, 3) unit vectors n (A.4 but for the sign).
        binormal: (k, 3) unit vectors b (A.4 but for the sign).
        curvature: (k,) signed kappa, 1/mm (A.6).
        torsion: (k,) tau, 1/mm (A.7).
        dihedral: (k,) phi, rad.
        fold_rate: (k,) phi', rad a unit of u.
        start: place (x, y) of the flat crease at its first point, mm.
        heading: its direction there, rad.
        method: how derivatives of what is sampled are taken.
    """

    u: Array
    points: Array
    speed: Array
    tangent: Array
    normal: Array
    binormal: Array
    curvature: Array
    torsion: Array
    dihedral: Array
    fold_rate: Array
    start: tuple[float, float] = (0.0, 0.0)
    heading: float = 0.0
    method: Differentiation = field(default_factory=InterpolatingSpline)

    @cached_property
    def arc_length(self) -> Array:
        """(k,) length along the crease, flat and folded, mm."""
        return self._integral(self.speed)

    @property
    def geodesic_curvature(self) -> Array:
        """(k,) kappa_g = kappa sin(phi / 2) on either panel, and of the flat crease, 1/mm."""
        return relations.flat_curvature(self.curvature, self.dihedral)

    @cached_property
    def flat_heading(self) -> Array:
        """(k,) direction of the flat crease, rad."""
        return self.heading + self._integral(self.geodesic_curvature * self.speed)

    @cached_property
    def flat_points(self) -> Array:
        """(k, 2) the flat crease, mm: the plane curve with the same length and geodesic curvature."""
        theta = self.flat_heading
        steps = np.column_stack((np.cos(theta), np.sin(theta))) * self.speed[:, None]
        return np.asarray(self.start) + self._integral(steps)

    @property
    def normals(self) -> tuple[Array, Array]:
        """(N_L, N_R), (k, 3) each: upper unit normals of the panels (A.10; A.11 with N_L turned to the upper side)."""
        cosine, sine = self._half
        return (
            cosine * self.normal + sine * self.binormal,
            -cosine * self.normal + sine * self.binormal,
        )

    @property
    def conormals(self) -> tuple[Array, Array]:
        """(B_L, B_R), (k, 3) each: unit vectors across the crease into the panels."""
        cosine, sine = self._half
        return (sine * self.normal - cosine * self.binormal, -sine * self.normal - cosine * self.binormal)

    @property
    def _half(self) -> tuple[Array, Array]:
        half = 0.5 * self.dihedral[:, None]
        return np.cos(half), np.sin(half)

    @cached_property
    def generator_angles(self) -> tuple[Array, Array]:
        """(gamma_L, gamma_R), (k,) each, rad (A.12); see `bh.isometric.generator_angles` for the limits."""
        return relations.generator_angles(
            self.curvature,
            self.torsion,
            self.dihedral,
            self.fold_rate,
            self.speed,
            NONE / self.arc_length[-1],
        )

    @cached_property
    def left(self) -> Panel:
        """The panel on the left of the crease, seen from above."""
        return self._panel("left")

    @cached_property
    def right(self) -> Panel:
        """The panel on the right of the crease, seen from above."""
        return self._panel("right")

    @property
    def panels(self) -> tuple[Panel, Panel]:
        """The panels on the left and on the right."""
        return self.left, self.right

    def _panel(self, side: str) -> Panel:
        which, sign = (0, 1.0) if side == "left" else (1, -1.0)
        angle = self.generator_angles[which]
        cosine, sine = np.cos(angle), np.sin(angle)
        theta = self.flat_heading + sign * angle
        turn = self._derivative(angle) + sign * self.geodesic_curvature * self.speed
        along = sine < ALONG
        safe = np.where(along, 1.0, sine)
        bend = sign * self.curvature * np.cos(0.5 * self.dihedral)
        twist = self.torsion + sign * 0.5 * self.fold_rate / self.speed
        # II(t, t) = kappa_2 sin^2 gamma and II(t, B) = -kappa_2 sin gamma cos gamma, so no 0 / 0 where both vanish
        kappa = np.where(bend < 0.0, -1.0, 1.0) * np.hypot(bend, twist) / safe
        return Panel(
            side=side,
            u=self.u,
            speed=self.speed,
            crease=self.points,
            flat_crease=self.flat_points,
            normal=self.normals[which],
            angle=angle,
            generator=cosine[:, None] * self.tangent + sine[:, None] * self.conormals[which],
            flat_generator=np.column_stack((np.cos(theta), np.sin(theta))),
            convergence=np.where(along, np.inf, turn / (self.speed * safe)),
            kappa=kappa,
        )

    # ------------------------------------------------------------------------------- sheets

    @property
    def largest_width(self) -> float:
        """Distance from the crease to the nearest point of a regression curve of either panel, mm."""
        return min(self.left.largest_width, self.right.largest_width)

    def reach(self, width: float | tuple[float, float], trim: bool = False) -> tuple[Array, Array]:
        """Distances along the generators to the edges of a strip, (k,) each; see `Panel.reach`.

        Args:
            width: of the strip on either side, or (left, right), mm.
            trim: end before the regression curve; see `Panel.reach`.

        Raises:
            ModelError: the strip reaches a regression curve (unless `trim`).
        """
        left, right = width if isinstance(width, tuple) else (width, width)
        return self.left.reach(left, trim), self.right.reach(right, trim)

    def bending_energy(
        self, sheet: Sheet, width: float | tuple[float, float], nu: float | None = None, trim: bool = False
    ) -> float:
        """Bending energy of a strip, N mm.

        What no generator of the crease covers at the ends goes on flat and stores nothing.

        Args:
            sheet: material and thickness.
            width: of the strip on either side, or (left, right), mm.
            nu: Poisson's ratio in place of the sheet's.
            trim: end before the regression curve; see `Panel.reach`.

        Raises:
            ModelError: the strip reaches a regression curve (unless `trim`), or the sheet has a grain.
        """
        if sheet.directed:
            raise ModelError("the bending energy of a ruled strip is that of a sheet without a grain")
        D = sheet.bending_stiffness(nu)
        return sum(
            panel.bending_energy(D, v) for panel, v in zip(self.panels, self.reach(width, trim), strict=True)
        )

    def mesh(
        self, width: float | tuple[float, float], along: int = 64, rows: int = 4
    ) -> tuple[SheetMesh, Array]:
        """A strip in columns across the flat crease: flat mesh and folded nodes (n, 3), mm.

        Args:
            width: of the strip on either side, or (left, right), mm.
            along: cells along the crease.
            rows: of cells on either side.

        Raises:
            ModelError: the strip reaches a regression curve.
        """
        self.reach(width)
        _check_cells(along, rows)
        widths = width if isinstance(width, tuple) else (width, width)
        mesh = strip_mesh(self.left, widths, along, rows)
        return mesh, self.place(mesh.points)

    def ruled_mesh(
        self, length: float, along: int = 64, rows: int = 4, trim: bool = False
    ) -> tuple[SheetMesh, Array]:
        """Both panels meshed along generators of one length, as in the source's Fig. A.7: flat mesh and folded nodes.

        Args:
            length: of the generators, mm; with `trim` they end just before the regression curve where it lies
                within.
            along: cells along the crease.
            rows: of cells on either side.
            trim: end generators before the regression curve.

        Returns:
            the flat mesh, and its nodes (n, 3) as they are folded, mm.

        Raises:
            ModelError: a generator reaches the regression curve.
        """
        _check_cells(along, rows)
        if not (np.isfinite(length) and length > 0.0):
            raise ModelError(f"length = {length} of generators cannot be; give a positive length in mm")
        limits = [TRIMMED * panel.regression for panel in self.panels]
        if not trim:
            for panel in self.panels:
                panel.curvature(np.full(len(self.u), length))
        left, right = (np.minimum(length, limit) for limit in limits)
        return ruled_mesh(self.panels, (left, right), along, rows)

    @cached_property
    def placed(self) -> Placed:
        """Where points of the flat sheet lie after the fold."""
        return Placed(self.panels)

    def place(self, points: ArrayLike) -> Array:
        """(n, 3) folded places of flat points (n, 2), mm. Beyond the last generators the sheet goes on flat.

        Raises:
            ModelError: a point lies beyond a regression curve.
        """
        return self.placed(np.asarray(points, dtype=float))

    def _derivative(self, values: Array) -> Array:
        return self.method.derivatives(self.u, values[:, None], self.u, 1)[1, :, 0]

    def _integral(self, values: Array) -> Array:
        made = InterpolatingSpline(7).through(self.u, values).antiderivative()
        return np.asarray(made(self.u) - made(self.u[0]))


def _check_cells(along: int, rows: int) -> None:
    if along < 1 or rows < 1:
        raise ModelError(f"a mesh of {along} x {rows} cells cannot be; give whole numbers from 1")
