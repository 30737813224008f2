"""Point clouds and rigid motions: reading, checking, and aligning picked points. Lengths in mm."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path as FilePath

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bh.errors import InputError
from meshes.errors import FileFormatError

Array = NDArray[np.float64]
SUFFIXES = (".ply", ".xyz", ".txt", ".csv", ".stl")


class ScanError(InputError):
    """A scan that cannot be read, registered or compared."""


# ------------------------------------------------------------------------------------------------- reading


def read_cloud(file: str | os.PathLike[str], unit: float = 1.0, every: int = 1) -> Array:
    """The points (k, 3) of a scan, mm.

    Args:
        file: .ply or .stl (their vertices), or text with x y z first in every line (.xyz, .txt, .csv).
        unit: length of the file's unit, mm: 25.4 for inches.
        every: keep every so many points; the source keeps every fifth.

    Raises:
        FileFormatError: no such file, another suffix, or not what the suffix says.
        ScanError: no points, or some that are not finite.
    """
    place = FilePath(file)
    suffix = place.suffix.lower()
    if suffix not in SUFFIXES:
        raise FileFormatError(
            f"scan '{place}': suffix '{suffix}' is not known; use one of {', '.join(SUFFIXES)}"
        )
    if not (math.isfinite(unit) and unit > 0.0):
        raise ScanError(
            f"unit = {unit} cannot be; give the length of the file's unit in mm, such as 25.4 for inches"
        )
    if int(every) != every or every < 1:
        raise ScanError(f"every = {every} cannot be; give a whole number from 1")
    try:
        if place.stat().st_size == 0:
            raise FileFormatError(f"scan '{place}' is empty; export it anew")
        points = _text(place) if suffix in (".xyz", ".txt", ".csv") else _binary(place, suffix)
    except OSError as error:
        raise FileFormatError(
            f"scan '{place}' cannot be read ({error.strerror or error}); name a file"
        ) from error
    return checked(points, f"scan '{place}'")[:: int(every)] * unit


def _text(place: FilePath) -> Array:
    rows = []
    for number, line in enumerate(place.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
        words = line.split("#")[0].replace(",", " ").replace(";", " ").split()
        if not words:
            continue
        try:
            rows.append([float(word) for word in words[:3]])
        except ValueError:
            if not rows:
                continue  # a heading
            raise FileFormatError(
                f"scan '{place}', line {number} is not numbers; give x y z in every line"
            ) from None
        if len(words) < 3:
            raise FileFormatError(
                f"scan '{place}', line {number} has {len(words)} numbers; give x y z in every line"
            )
    return np.array(rows, dtype=float).reshape(-1, 3)


def _binary(place: FilePath, suffix: str) -> Array:
    import meshio

    what = suffix[1:].upper()
    try:
        reader = meshio.ply.read if suffix == ".ply" else meshio.stl.read
        with np.errstate(all="ignore"):
            points = np.asarray(reader(str(place)).points, dtype=float).reshape(-1, 3)
    except OSError:
        raise
    except Exception as error:  # meshio raises many kinds on broken files
        raise FileFormatError(f"scan '{place}' is not a whole {what} file; export it anew") from error
    if suffix == ".ply":
        with place.open("rb") as file:
            head = file.read(10_000).split(b"end_header")[0].split(b"element vertex ")[1]
        promised = int(head.split()[0])
        if promised != len(points):
            raise FileFormatError(
                f"scan '{place}' ends after {len(points)} of {promised} points; export it anew"
            )
    return points


def checked(points: ArrayLike, name: str, least: int = 1) -> Array:
    """Finite points (k, 3), at least so many.

    Args:
        points: (k, 3), mm.
        name: of them, for messages.
        least: how many there have to be.

    Raises:
        ScanError: another shape, too few, or not finite.
    """
    try:
        found = np.array(points, dtype=float)
    except (TypeError, ValueError):
        raise ScanError(f"{name} is not an array of numbers; give (k, 3) points in mm") from None
    if found.ndim != 2 or found.shape[1:] != (3,) or len(found) < least:
        if found.size == 0:
            raise ScanError(f"{name} holds no points; give at least {least}")
        raise ScanError(f"{name} has shape {found.shape}; give (k, 3) points in mm, at least {least}")
    if not np.isfinite(found).all():
        row = int(np.argmin(np.isfinite(found).all(axis=1)))
        raise ScanError(f"{name}: point {row} is not finite; remove it")
    return found


# ------------------------------------------------------------------------------------------------- motions


@dataclass(frozen=True, eq=False)
class Motion:
    """A proper rigid motion x -> rotation x + translation.

    Attributes:
        rotation: (3, 3).
        translation: (3,), mm.
    """

    rotation: Array
    translation: Array

    def apply(self, points: ArrayLike) -> Array:
        """(k, 3) moved points."""
        moved: Array = np.asarray(points, dtype=float) @ self.rotation.T + self.translation
        return moved

    def after(self, first: Motion) -> Motion:
        """The motion `first`, then this one."""
        return Motion(self.rotation @ first.rotation, self.apply(first.translation))

    def inverse(self) -> Motion:
        """The motion back."""
        return Motion(self.rotation.T, -self.rotation.T @ self.translation)

    @property
    def angle(self) -> float:
        """Angle of the rotation, rad in [0, pi]."""
        from scipy.spatial.transform import Rotation

        return float(Rotation.from_matrix(self.rotation).magnitude())

    @classmethod
    def about(cls, centre: ArrayLike, rotation_vector: ArrayLike, translation: ArrayLike) -> Motion:
        """Rotation about a centre, then a translation.

        Args:
            centre: (3,), mm.
            rotation_vector: (3,) axis times angle, rad.
            translation: (3,), mm.
        """
        from scipy.spatial.transform import Rotation

        R = Rotation.from_rotvec(np.asarray(rotation_vector, dtype=float)).as_matrix()
        c = np.asarray(centre, dtype=float)
        return cls(R, c - R @ c + np.asarray(translation, dtype=float))


IDENTITY = Motion(np.eye(3), np.zeros(3))


def align(points: ArrayLike, targets: ArrayLike, names: tuple[str, str] = ("points", "targets")) -> Motion:
    """The rigid motion that brings points nearest to targets, row by row (Kabsch 1976).

    Args:
        points: (k, 3), mm.
        targets: (k, 3), mm.
        names: of both, for messages.

    Raises:
        ScanError: fewer than three, not as many, not finite, or on one line.
    """
    from scipy.spatial.transform import Rotation

    a, b = (checked(rows, name, 3) for rows, name in zip((points, targets), names, strict=True))
    if len(a) != len(b):
        raise ScanError(f"{len(a)} {names[0]} for {len(b)} {names[1]}; give as many")
    for rows, name in ((a, names[0]), (b, names[1])):
        extents = np.linalg.svd(rows - rows.mean(axis=0), compute_uv=False)
        if extents[1] <= 1e-3 * extents[0]:
            raise ScanError(f"the {name} lie on one line; pick points that span a triangle")
    R = Rotation.align_vectors(b - b.mean(axis=0), a - a.mean(axis=0))[0].as_matrix()
    return Motion(R, b.mean(axis=0) - R @ a.mean(axis=0))


def picked(on_cloud: ArrayLike, on_sheet: ArrayLike) -> Motion:
    """Initial guess from three or more points picked on the scan (k, 3) and the same ones of the sheet (k, 3).

    Corners and ends of creases serve best: `state.points[state.mesh.corners["corner:inner-start"]]`.

    Args:
        on_cloud: (k, 3) on the scan, mm.
        on_sheet: (k, 3) the same places of the sheet, mm.

    Raises:
        ScanError: fewer than three, not finite, or on one line.
    """
    return align(on_cloud, on_sheet, ("points picked on the scan", "points picked on the sheet"))
