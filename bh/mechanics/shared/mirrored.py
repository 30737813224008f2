"""Half of a mirror-symmetric sheet: images share their unknowns, elements count for the part that lies in the half.

All nodes keep their numbers and places; only who is an unknown changes. With the reflection R an image has the local
axes of its original turned by R, and so the same local components. The energy of the half is half of the energy, forces
on nodes in the plane count half, and so do multipliers of creases that are their own image.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bh.loading.load_step import LoadStep
from bh.loading.symmetry import Mirror
from bh.mechanics.bars_and_hinges.elements import Elements
from bh.mechanics.shared.displacements import Displacements
from bh.model.ramp import Ramp
from bh.model.supports import Constraints
from meshes import SheetMesh
from meshes.topology import Ints

Array = NDArray[np.float64]


class MirroredDisplacements(Displacements):
    """Displacements of a sheet whose images move alike: the unknowns are those of the kept half."""

    def __init__(self, mesh: SheetMesh, constraints: Constraints, start_points: Array, plane: Mirror) -> None:
        """Number the unknowns of the kept half.

        Args:
            mesh: the whole sheet.
            constraints: of the whole sheet.
            start_points: (n, 3) positions of the whole sheet that the step begins with, mm.
            plane: the mirror.
        """
        super().__init__(mesh, _reflected(constraints, plane), start_points)
        self.plane = plane
        kept = (plane.side <= 0)[:, None] & ~self.constraints.fixed
        self.number = np.full(kept.shape, -1, dtype=np.int64)
        self.number[kept] = np.arange(kept.sum())
        self.free = np.flatnonzero(kept.ravel())
        image = plane.side > 0
        self.own = np.where(image[:, None], -1, self.number)
        self.original = np.where(image, plane.node, np.arange(len(image)))
        self.number[image] = self.number[plane.node[image]]
        self._images = np.flatnonzero((image[:, None] & (self.number >= 0)).ravel())
        self._of = self.number.ravel()[self._images]
        self.weight = np.asarray(1.0 + np.bincount(self._of, minlength=len(self.free)), dtype=np.float64)
        self._weights = self.weight
        self._kept = np.flatnonzero(~image)
        self._fixed_kept = self.constraints.fixed[self._kept]
        self._supported = bool(self._fixed_kept.sum() > (plane.side == 0).sum())
        self._turned_kept = np.flatnonzero(self.constraints.frame_of[self._kept] >= 0)
        self._axes_kept = self.constraints.frames[self.constraints.frame_of[self._kept[self._turned_kept]]]

    def pattern_nodes(self, groups: tuple[Ints, ...]) -> tuple[Ints, tuple[Ints, ...]]:
        """Images stand for their originals; beyond the nodes of the mesh there may be more, all their own.

        Returns:
            (nodes,) original of every node, and the groups in terms of originals.
        """
        n = len(self.original)
        return self.own, tuple(
            np.where(group < n, self.original[np.minimum(group, n - 1)], group) for group in groups
        )

    def positions(self, u: Array, lam: float) -> Array:
        """(n, 3) positions of all nodes, images too, mm, for unknowns u (k,).

        Args:
            u: (k,) displacements of the half, mm.
            lam: load parameter of the step, 0 to 1.
        """
        local = (1.0 - lam) * self.constraints.start + lam * self.constraints.end
        local.ravel()[self.free] = u
        local.ravel()[self._images] = u[self._of]
        return np.asarray(self.reference + self.to_global(local))

    def vectors(self, u: Array) -> Array:
        """(n, 3) changes of positions for changes u (k,) of the unknowns, in the axes of each side."""
        local = np.zeros_like(self.reference)
        local.ravel()[self.free] = u
        local.ravel()[self._images] = u[self._of]
        return self.to_global(local)

    def components(self, vectors: Array) -> Array:
        """(k,) sums of the components of nodal vectors (n, 3) over images, along the unknowns."""
        local = self.to_local(vectors).ravel()
        images = np.bincount(self._of, weights=local[self._images], minlength=len(self.free))
        return np.asarray(local[self.free] + images)

    def rigid(self, x: Array) -> Array:
        """Those of the rigid motions that are symmetric, along the plane and the turn in it, orthonormal by weight.

        Returns:
            (n, r) columns in the unknowns.
        """
        n, kept = self.plane.normal, self._kept
        arm = x[kept] - x.mean(axis=0)
        motions = np.empty((len(kept), 3, 3))
        motions[:, :, 0], motions[:, :, 1], motions[:, :, 2] = (
            (-n[1], n[0], 0.0),
            (0.0, 0.0, 1.0),
            np.cross(n, arm),
        )
        motions[:, :, 2] /= max(float(np.abs(arm).max()), 1e-300)
        motions[self._turned_kept] = self._axes_kept @ motions[self._turned_kept]
        if self._supported:  # what the supports leave of them; all obey those across the plane
            rows = motions[self._fixed_kept]
            _, size, right = np.linalg.svd(np.linalg.qr(rows, mode="r"), full_matrices=True)
            rank = int((size > 1e-7 * np.sqrt(len(rows))).sum())
            motions = motions @ right[rank:].T
        moving = motions[~self._fixed_kept]
        if moving.shape[1] == 0:
            return moving
        # Gram-Schmidt by the factor of the Gram matrix, which three columns of like size do not spoil
        gram = np.linalg.cholesky((moving * self._weights[:, None]).T @ moving)
        return np.asarray(np.linalg.solve(gram, moving.T).T)

    @cached_property
    def ground_triangle(self) -> int:
        """The triangle against rigid motions: of those that lie in the half, as in a whole sheet."""
        centres = self.reference[self.mesh.triangles].mean(axis=1)
        distance = np.linalg.norm(centres - self.reference.mean(axis=0), axis=1)
        supported = (self.number[self.mesh.triangles] < 0).sum(axis=(1, 2))
        return int(np.lexsort((distance, supported, self.plane.triangle_weight < 1.0))[0])


def _reflected(c: Constraints, plane: Mirror) -> Constraints:
    """The constraints with those of images made the reflections of their originals."""
    image = np.flatnonzero(plane.side > 0)
    of = plane.node[image]
    fixed, start, end, frame_of = c.fixed.copy(), c.start.copy(), c.end.copy(), c.frame_of.copy()
    fixed[image], start[image], end[image] = fixed[of], start[of], end[of]
    axes = np.broadcast_to(np.eye(3), (len(image), 3, 3)).copy()
    turned = np.flatnonzero(c.frame_of[of] >= 0)
    axes[turned] = c.frames[c.frame_of[of[turned]]]
    frame_of[image] = len(c.frames) + np.arange(len(image))
    return replace(
        c,
        fixed=fixed,
        start=start,
        end=end,
        frame_of=frame_of,
        frames=np.concatenate((c.frames, axes @ plane.matrix)),
    )


def half_load_step(load_step: LoadStep, plane: Mirror) -> LoadStep:
    """The step with the forces on the half.

    Args:
        load_step: of the whole sheet.
        plane: of the mirror symmetry.
    """
    weight = np.where(plane.side < 0, 1.0, np.where(plane.side == 0, 0.5, 0.0))[:, None]
    return replace(load_step, force=Ramp(weight * load_step.force.start, weight * load_step.force.end))


def half_elements(e: Elements, plane: Mirror) -> Elements:
    """Bars and hinges of the half, with the stiffness that belongs to it.

    Args:
        e: bars and hinges of the whole sheet.
        plane: of the mirror symmetry.
    """
    bars = plane.edge_weight > 0.0
    weight = plane.hinge_weight[e.source]
    keep = weight > 0.0
    w = weight[keep]
    prescribed = keep[len(e.source) - e.prescribed :]

    def some(ramp: Ramp, factor: Array | float = 1.0) -> Ramp:
        return Ramp(factor * ramp.start[keep], factor * ramp.end[keep])

    return replace(
        e, bars=np.ascontiguousarray(e.bars[bars]), bar_length=e.bar_length[bars],
        bar_stiffness=(plane.edge_weight * e.bar_stiffness)[bars], hinges=np.ascontiguousarray(e.hinges[keep]),
        source=e.source[keep], hinge_stiffness=w * e.hinge_stiffness[keep], lock=w * e.lock[keep],
        rest=some(e.rest), couple=some(e.couple, w), bending=int(keep[: e.bending].sum()),
        spring=int(keep[e.bending : e.bending + e.spring].sum()), prescribed=int(prescribed.sum()),
        penalty=(weight[len(e.source) - e.prescribed :] * e.penalty)[prescribed],
    )  # fmt: skip
