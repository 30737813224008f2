"""Strains and stresses of the plies of a laminate, by classical lamination theory (Jones 1999, 4.2 and 4.5).

Membrane forces N and moments M of a state strain the stack by e and bend it by k, [N, M] = [[A, -B], [-B, D]] [e, k];
a change of temperature or moisture strains a free stack by e1, k1 and would strain its ply alone by a. So a ply has at
the height z the elastic strain e - z k + change (e1 - z k1 - a), and Q times that is its stress.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh.errors import ModelError
from bh.formulations import yield_criteria
from bh.model.laminate import free_strain, heights, matrices, plane_stress
from bh.model.sheet import Sheet
from bh.runtime.one_line import OneLine
from meshes.topology import Ints

Array = NDArray[np.float64]
PART = {"top": 1.0, "middle": 0.5, "bottom": 0.0}  # of a ply's thickness above its lower face


@dataclass(frozen=True, eq=False, repr=False)
class PlyStress(OneLine):
    """Of one ply; arrays (t, ...) of triangles or (t, 3, ...) of their corners, nan where the sheet has no such ply.

    Attributes:
        number: from 0 at the bottom.
        sheets: of each part of the whole, what the ply is made of; None where it has none.
        of: (t,) which of them a triangle has.
        strain: (2, ..., 3) on the lower and the upper face, components xx, yy, 2 xy in the axes of the drawing.
        elastic: (2, ..., 3) what of it is stressed, likewise.
    """

    number: int
    sheets: tuple[Sheet | None, ...]
    of: Ints
    strain: Array
    elastic: Array

    def strain_at(self, side: str = "top") -> Array:
        """(..., 3) strains xx, yy, 2 xy in the axes of the drawing.

        Args:
            side: "top", "middle" or "bottom" of the ply.
        """
        return _between(self.strain, side)

    def at(self, side: str = "top") -> Array:
        """(..., 3) stresses xx, yy, xy in the axes of the drawing, MPa.

        Args:
            side: "top", "middle" or "bottom" of the ply.
        """
        elastic = _between(self.elastic, side)
        return self._each(elastic.shape, lambda ply, here: elastic[here] @ plane_stress(ply))

    def along_fibres(self, side: str = "top") -> Array:
        """(..., 3) stresses along and across the fibres and in shear, 11, 22, 12, MPa; without a grain those of `at`.

        Args:
            side: "top", "middle" or "bottom" of the ply.
        """
        stress = self.at(side)
        return self._each(
            stress.shape, lambda ply, here: yield_criteria.along_grain(stress[here], ply.grain or 0.0)
        )

    def utilisation(self, side: str = "top", by: str = "tsai-hill") -> Array:
        """(...,) part of the strength of the ply that is used; the first ply fails where it is 1.

        Args:
            side: "top", "middle" or "bottom" of the ply.
            by: "tsai-hill" (without a grain von Mises), or "largest": of the components along, across and in shear over
                their own strengths (without a grain of the principal stresses).

        Raises:
            ModelError: the ply has no strength, or there is no such criterion.
        """
        if by not in ("tsai-hill", "largest"):
            raise ModelError(f"criterion '{by}' is not known; use tsai-hill or largest")
        stress = self.at(side)

        def used(ply: Sheet, here: NDArray[np.bool_]) -> Array:
            along, across, shear = ply.strengths()
            if by == "tsai-hill":
                return yield_criteria.equivalent(stress[here], ply) / along
            if ply.grain is None:
                return np.asarray(np.abs(yield_criteria.principal(stress[here])).max(axis=-1) / along)
            parts = yield_criteria.along_grain(stress[here], ply.grain) / [along, across, shear]
            return np.asarray(np.abs(parts).max(axis=-1))

        return self._each(stress.shape[:-1], used)

    def reserve(self, side: str = "top", by: str = "tsai-hill") -> Array:
        """(...,) by what all stresses of the ply could grow; inf where there is none.

        Args:
            side: "top", "middle" or "bottom" of the ply.
            by: as for `utilisation`.

        Raises:
            ModelError: the ply has no strength, or there is no such criterion.
        """
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / self.utilisation(side, by))

    def _each(self, shape: tuple[int, ...], read: Callable[[Sheet, NDArray[np.bool_]], Array]) -> Array:
        """What is read of the triangles of every part, in one array of a shape."""
        out = np.full(shape, np.nan)
        for row, ply in enumerate(self.sheets):
            here = self.of == row
            if ply is not None and here.any():
                out[here] = read(ply, here)
        return out


def ply_stress(
    number: int, sheets: tuple[Sheet, ...], of: Ints, strains: Array, loads: Array, changed: Array | None
) -> PlyStress:
    """One ply of a state.

    Args:
        number: from 0 at the bottom.
        sheets: that the whole is made of.
        of: (t,) which of them a triangle has.
        strains: (2, ..., 3) strain of the middle surface and curvature (1 / mm), xx, yy, 2 xy.
        loads: (2, ..., 3) membrane forces (N / mm) and moments (N), xx, yy, xy.
        changed: (t,) change of temperature or moisture; None for none.
    """
    stacks = [(sheet,) if sheet.plies is None else sheet.plies for sheet in sheets]
    whole, elastic = np.full((2, *strains.shape), np.nan)
    for row, (sheet, stack) in enumerate(zip(sheets, stacks, strict=True)):
        here = of == row
        if number >= len(stack) or not here.any():
            continue
        A, B, D = matrices(stack)
        B = np.zeros((3, 3)) if B is None else B
        both = np.concatenate((loads[0, here], loads[1, here]), axis=-1)
        found = both @ np.linalg.inv(np.block([[A, -B], [-B, D]]))
        e, k = found[..., :3], found[..., 3:]
        if changed is not None and changed[here].any():
            ply = stack[number]
            change = changed[here].reshape((-1,) + (1,) * (e.ndim - 1))
            one, bent = free_strain(sheet, 1.0)
            e, k = e + change * (one - free_strain(ply, 1.0)[0]), k + change * bent
        for face, z in enumerate(heights(stack)[number : number + 2]):
            whole[face, here] = strains[0, here] - z * strains[1, here]
            elastic[face, here] = e - z * k
    plies = tuple(stack[number] if number < len(stack) else None for stack in stacks)
    return PlyStress(number, plies, of, whole, elastic)


def _between(faces: Array, side: str) -> Array:
    if side not in PART:
        raise ModelError(f"side '{side}' is not known; use one of {', '.join(PART)}")
    return np.asarray(faces[0] + PART[side] * (faces[1] - faces[0]))
