"""Plane stress against yield: principal stresses, von Mises's stress, and Hill's of a sheet with a grain.

Stresses are (..., 3) components (xx, yy, xy), MPa.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bh.model.sheet import Sheet

Array = NDArray[np.float64]


def principal(stress: Array) -> Array:
    """(..., 2) principal stresses, the larger one first, MPa.

    Args:
        stress: (..., 3), MPa.
    """
    xx, yy, xy = np.moveaxis(stress, -1, 0)
    mean, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    return np.stack((mean + radius, mean - radius), axis=-1)


def along_grain(stress: Array, angle: float) -> Array:
    """(..., 3) components (11, 22, 12) in axes that stand at an angle to those of `stress`.

    Args:
        stress: (..., 3), MPa.
        angle: from the x axis to the first of the new ones, rad.
    """
    c, s = np.cos(angle), np.sin(angle)
    xx, yy, xy = np.moveaxis(stress, -1, 0)
    return np.stack(
        (
            c * c * xx + s * s * yy + 2.0 * c * s * xy,
            s * s * xx + c * c * yy - 2.0 * c * s * xy,
            c * s * (yy - xx) + (c * c - s * s) * xy,
        ),
        axis=-1,
    )


def von_mises(stress: Array) -> Array:
    """(...,) von Mises's stress, MPa.

    Args:
        stress: (..., 3), MPa.
    """
    xx, yy, xy = np.moveaxis(stress, -1, 0)
    return np.asarray(np.sqrt(np.maximum(xx * xx - xx * yy + yy * yy + 3.0 * xy * xy, 0.0)))


def hill(stress: Array, ratio: float, shear: float) -> Array:
    """(...,) Hill's stress: the pull along the grain that is as near to yield, MPa.

    In plane stress, with equal strengths across the grain and through the thickness (Hill 1948; Tsai-Hill),
    s^2 = s11^2 - s11 s22 + s22^2 / ratio^2 + s12^2 / shear^2. With ratio = 1 and shear = 1 / sqrt(3) it is von Mises's.

    Args:
        stress: (..., 3) in the axes of the grain, MPa.
        ratio: strength across the grain over that along it.
        shear: strength in shear over that along the grain.
    """
    s11, s22, s12 = np.moveaxis(stress, -1, 0)
    square = s11 * s11 - s11 * s22 + (s22 / ratio) ** 2 + (s12 / shear) ** 2
    return np.asarray(np.sqrt(np.maximum(square, 0.0)))


def equivalent(stress: Array, sheet: Sheet) -> Array:
    """(...,) stress that is compared with the sheet's strength: von Mises's, with a grain Hill's, MPa.

    Args:
        stress: (..., 3) in the axes of the drawing, MPa.
        sheet: of which it is; with a grain its strengths are needed.

    Raises:
        ModelError: a sheet with a grain, and no strengths along and across it.
    """
    if sheet.grain is None:
        return von_mises(stress)
    along, across, shear = sheet.strengths()
    return hill(along_grain(stress, sheet.grain), across / along, shear / along)
