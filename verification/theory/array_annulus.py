"""A creased annulus sector of bars and hinges as plain arrays, as codes for origami exchange their problems.

Radius of the crease 100 mm, 20 mm wide on either side, 120 degrees, E = 4000 MPa, t = 0.27 mm, nu = 0, L* = 25 mm; one
diagonal a cell, mirrored in the crease. Stiffness by Eq. 3.3, 3.4, 3.11 and 3.12 of the source; the rest angle of the
crease goes from flat to 90 degrees. Six independent codes agree on the energies to ten digits, with Green's strain in
the bars.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bh import Model
from bh.mechanics.bars_and_hinges.stiffness import diagonal_factor

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
RADIUS, WIDTH, SECTOR, ROWS = 100.0, 20.0, 2.0 * math.pi / 3.0, 5  # mm, mm, rad, rows of nodes
E, T, LSTAR = 4000.0, 0.27, 25.0  # MPa, mm, mm
REST = 0.5 * math.pi  # rad
# columns of nodes: total, bending and folding energy, N mm
ENERGIES = {
    31: (3.270962320, 2.944622668, 0.322118961),
    61: (2.773577732, 2.524949397, 0.245239472),
}


@dataclass(frozen=True, eq=False)
class ArrayAnnulus:
    """The arrays; hinges are rows (edge, edge, wing, wing), supports rows (node, x, y, z).

    Attributes:
        points: (n, 3) nodes, mm.
        triangles: (m, 3).
        bars: (b, 2); bar_stiffness: (b,), N/mm.
        bending_hinges: (h, 4); bending_stiffness: (h,), N mm/rad.
        folding_hinges: (c, 4); folding_stiffness: (c,), N mm/rad.
        supports: (s, 4), 1 where a displacement is zero.
    """

    points: Array
    triangles: Ints
    bars: Ints
    bar_stiffness: Array
    bending_hinges: Ints
    bending_stiffness: Array
    folding_hinges: Ints
    folding_stiffness: Array
    supports: Ints

    def model(self) -> Model:
        """The model of the arrays, its crease folded to `REST`."""
        model = Model.from_arrays(
            self.points,
            self.triangles,
            self.bars,
            self.bar_stiffness,
            self.bending_hinges,
            self.bending_stiffness,
            self.folding_hinges,
            self.folding_stiffness,
            self.supports,
            green=True,
        )
        return model.fold("fold", rest=REST)


def array_annulus(columns: int) -> ArrayAnnulus:
    """The sector with an odd number of columns of nodes along the crease."""
    radii = np.linspace(RADIUS - WIDTH, RADIUS + WIDTH, ROWS)
    azimuths = 0.5 * math.pi + SECTOR * np.linspace(0.5, -0.5, columns)
    r, phi = (grid.ravel() for grid in np.meshgrid(radii, azimuths, indexing="ij"))
    points = np.column_stack((r * np.cos(phi), r * np.sin(phi), np.zeros(r.size)))
    node = np.arange(r.size).reshape(ROWS, columns)
    a, b, c, d = (part.ravel() for part in (node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]))
    inner = (a < columns * (ROWS // 2))[
        :, None
    ]  # panels are mirror images: diagonals a-c inside, b-d outside
    one = np.where(inner, np.column_stack((a, b, c)), np.column_stack((a, b, d)))
    two = np.where(inner, np.column_stack((a, c, d)), np.column_stack((b, c, d)))
    triangles = np.stack((one, two), axis=1).reshape(-1, 3)
    wings: dict[tuple[int, int], list[int]] = {}  # an edge, lower node first, and the nodes opposite to it
    for triangle in triangles.tolist():
        for k in range(3):
            low, high = sorted((triangle[k], triangle[(k + 1) % 3]))
            wings.setdefault((low, high), []).append(triangle[(k + 2) % 3])
    ends = np.where(inner, np.column_stack((a, c)), np.column_stack((b, d)))
    diagonals = {(i, j) for i, j in ends.tolist()}
    crease = set(zip(node[ROWS // 2, :-1].tolist(), node[ROWS // 2, 1:].tolist(), strict=True))
    bars, bar_k, hinges, hinge_k, folds, fold_k = [], [], [], [], [], []
    factor = float(diagonal_factor(np.diff(radii)[0] / (RADIUS * SECTOR / (columns - 1))))
    for (i, j), opposite in wings.items():
        length = float(np.linalg.norm(points[j] - points[i]))
        area = sum(_area(points[[i, j, k]]) for k in opposite)
        bars.append((i, j))
        bar_k.append(E * T * area / length**2 * (factor if (i, j) in diagonals else 1.0))
        if (i, j) in crease:
            folds.append((i, j, *opposite))
            fold_k.append(E * T**3 / 12.0 * length / LSTAR)
        elif len(opposite) == 2:
            hinges.append((i, j, *opposite))
            hinge_k.append(E * T**3 * length**2 / (6.0 * area))
    middle = columns // 2
    held = [
        (node[ROWS // 2, middle], 1, 1, 1),
        (node[ROWS // 2, 0], 0, 0, 1),
        (node[ROWS // 2, -1], 0, 0, 1),
        (node[-1, middle], 1, 0, 0),
    ]
    return ArrayAnnulus(
        points,
        triangles,
        np.array(bars),
        np.array(bar_k),
        np.array(hinges),
        np.array(hinge_k),
        np.array(folds),
        np.array(fold_k),
        np.array(held, dtype=np.int64),
    )


def _area(corners: Array) -> float:
    """Area of a triangle (3, 3), mm^2."""
    return 0.5 * float(np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0])))
