"""Stretching of a sheet: what a membrane measures (`membrane`) and the law of its material, as one energy.

Where the moduli are constant so are the stiffnesses of the cells, and everything is compiled. Another law is
evaluated on the strains of all cells at once, between two compiled passes over bars.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bh.materials import Constant, Law
from bh.mechanics.consistent import membrane_kernels as kernels
from bh.mechanics.consistent.membrane import Cells, Membrane
from bh.mechanics.consistent.sections import SheetLaws
from bh.mechanics.shared.sparsity import Slots
from meshes.topology import Ints

Array = NDArray[np.float64]
Pair = tuple[Array, Array]  # of both kinds of cells


class Grown(NamedTuple):
    """What strains at rest do to a membrane of constant moduli: energy 1/2 gamma.K.gamma + forces.gamma + energy.

    Attributes:
        forces: (b,) of the bars, N / mm.
        energy: of the drawn sheet, N mm.
    """

    forces: Array
    energy: float


class Stretching:
    """Energy of the membrane at positions x (n, 3), mm. Its element forces are N (b,), N / mm: d energy / d gamma."""

    def __init__(self, membrane: Membrane, laws: SheetLaws, points: Array) -> None:
        """A membrane and the laws of the strains that it measures.

        Args:
            membrane: bars and cells.
            laws: in the axes of the drawing.
            points: (n, 3) of the stress-free sheet, mm.
        """
        self.membrane, self.laws, self.points = membrane, laws, points
        self.constant = isinstance(self.law, Constant)
        self._at: Array | None = None
        self._last: tuple[Array, ...] = ()
        self._laws = tuple(laws.of_cells(cells, points) for cells in membrane.cells)
        self._K: tuple[Array, ...] = tuple(
            cells.stiffness(own.matrix)
            for cells, own in zip(membrane.cells, self._laws, strict=True)
            if isinstance(own, Constant)
        )

    @property
    def law(self) -> Law:
        """Of the sheet outside of zones."""
        return self.laws.stretching[0]

    def gamma(self, x: Array) -> Array:
        """(b,) half changes of the bars' squares, mm^2."""
        out = np.empty(len(self.membrane.bars))
        kernels.bar_strains(x, self.membrane.bars, self.membrane.rest_square, out)
        return out

    def stiffness(self, x: Array) -> tuple[Array, ...]:
        """(c, k, k) of both kinds of cells at x: derivatives of the bars' N by gamma, N / mm^3."""
        if self._K:
            return self._K
        if self._at is not x:  # the tangent and the forces that it predicts ask at the same positions
            gamma = self.gamma(x)
            self._last = tuple(
                cells.stiffness(law.moduli(cells.strains(gamma)))
                for cells, law in zip(self.membrane.cells, self._laws, strict=True)
            )
            self._at = x
        return self._last

    def forces(self, x: Array, f: Array, N: Array, grown: Grown | None = None) -> tuple[float, float]:
        """Energy (N mm) and the sum of squared bar forces (N^2); adds the gradient to f (n, 3) and writes N.

        Args:
            x: (nodes, 3) positions, mm.
            f: (nodes, 3) N; the gradient is added.
            N: bar forces, N; written.
            grown: what the sheet at rest takes off, where it is not at rest as it is drawn.
        """
        m, gamma = self.membrane, self.gamma(x)
        if self._K:
            self._by_stiffness(self._K, gamma, N)
            energy = 0.5 * float(N @ gamma)
            if grown is not None:
                N += grown.forces
                energy += float(grown.forces @ gamma) + grown.energy
        else:
            N[:] = 0.0
            energy = sum(_by_law(*of, gamma, N) for of in zip(m.cells, self._laws, strict=True))
        return energy, kernels.bar_forces(x, m.bars, m.rest_square, N, f)

    def _by_stiffness(self, K: tuple[Array, ...], gamma: Array, N: Array) -> None:
        three, five = self.membrane.cells
        kernels.cell_forces(three.bars, K[0], five.bars, K[1], gamma, N)

    def tangent(
        self, x: Array, N: Array, frame_of: Ints, frames: Array, triangles: Slots, hinges: Slots, data: Array
    ) -> None:
        """Add the tangent with bar forces N to `data`; slots are those of all triangles and hinges.

        Args:
            x: (nodes, 3) positions, mm.
            N: bar forces of the geometric part, N.
            frame_of: (nodes,) row of `frames` of each node, -1 where axes are global.
            frames: (k, 3, 3) axes of oblique supports.
            triangles: slots of all triangles.
            hinges: slots of all hinges.
            data: values of the matrix, N / mm; added to.
        """
        three, five = self.membrane.cells
        K = self.stiffness(x)
        kernels.triangle_tangent(
            x, three.nodes, three.bars, three.owned, K[0], N, frame_of, frames, three.source, triangles, data
        )
        kernels.edge_tangent(
            x, five.nodes, five.bars, five.owned, K[1], N, frame_of, frames, five.source, hinges, data
        )

    def gamma_rates(self, x: Array, v: Array) -> Array:
        """(b,) rates of gamma for velocities v (n, 3).

        Args:
            x: (nodes, 3) positions, mm.
            v: (nodes, 3) velocities.
        """
        rate = np.empty(len(self.membrane.bars))
        kernels.bar_rates(x, v, self.membrane.bars, rate)
        return rate

    def rates(self, x: Array, v: Array, dN: Array) -> None:
        """Writes the rates of N for velocities v (n, 3).

        Args:
            x: (nodes, 3) positions, mm.
            v: (nodes, 3) velocities.
            dN: rates of the bar forces; written.
        """
        self._by_stiffness(self.stiffness(x), self.gamma_rates(x, v), dN)

    def force_rates(self, x: Array, v: Array, N: Array, dN: Array, f: Array) -> None:
        """Add the rate of the gradient to f (n, 3).

        Args:
            x: (nodes, 3) positions, mm.
            v: (nodes, 3) velocities.
            N: bar forces, N.
            dN: their rates.
            f: (nodes, 3); the rate is added.
        """
        kernels.bar_force_rates(x, v, self.membrane.bars, N, dN, f)

    def by_triangle(self, x: Array, triangles: int, beside: Ints, at_rest: Pair | None = None) -> Array:
        """(triangles,) energies, N mm; that of an edge is shared by area with `beside` (m, 2), the sides of hinges.

        Args:
            x: (nodes, 3) positions, mm.
            triangles: how many there are.
            beside: (m, 2) triangles on both sides of every hinge.
            at_rest: strains of the cells at rest.
        """
        three, five = (
            cells.area * law.energy(strain)
            for cells, law, strain in zip(
                self.membrane.cells, self._laws, self._elastic(x, at_rest), strict=True
            )
        )
        out = np.zeros(triangles)
        np.add.at(out, self.membrane.triangles.source, three)
        sides, share = beside[self.membrane.edges.source], self.membrane.edges.share
        np.add.at(out, sides[:, 0], share * five)
        np.add.at(out, sides[:, 1], (1.0 - share) * five)
        return out

    def _elastic(self, x: Array, at_rest: Pair | None) -> tuple[Array, ...]:
        """Strains (c, 3) of both kinds of cells, less those at rest."""
        gamma = self.gamma(x)
        strains = tuple(cells.strains(gamma) for cells in self.membrane.cells)
        return strains if at_rest is None else tuple(e - e0 for e, e0 in zip(strains, at_rest, strict=True))

    def strains_and_forces(
        self, x: Array, at_rest: Pair | None = None
    ) -> tuple[tuple[Cells, Array, Array], ...]:
        """Of both kinds of cells these, their strains (c, 3) and membrane forces (c, 3), N / mm, in their own axes.

        Args:
            x: (nodes, 3) positions, mm.
            at_rest: strains of the cells at rest.
        """
        whole, elastic = self._elastic(x, None), self._elastic(x, at_rest)
        each = zip(self.membrane.cells, self._laws, whole, elastic, strict=True)
        return tuple((cells, strain, law.stress(part)) for cells, law, strain, part in each)

    def at_rest(self, one: Pair, other: Pair) -> tuple[Array, float]:
        """What strains at rest (of both kinds of cells) take off.

        Args:
            one: strains at rest.
            other: others, or the same.

        Returns:
            bar forces (b,) of the first, N / mm, and the energy of both together, 1/2 e.C.e if they are one, N mm.
        """
        N, energy = np.zeros(len(self.membrane.bars)), 0.0
        for cells, law, e0, e1 in zip(self.membrane.cells, self._laws, one, other, strict=True):
            force = cells.area[:, None] * law.stress(e0)
            np.add.at(N, cells.bars, -np.einsum("cik,ci->ck", cells.strain, force))
            energy += 0.5 * float(np.vdot(force, e1))
        return N, energy

    @property
    def largest(self) -> float:
        """Largest stiffness of a bar in the stress-free sheet, N / mm."""
        m = self.membrane
        total = np.zeros(len(m.bars))
        for cells, law in zip(m.cells, self._laws, strict=True):
            K = cells.stiffness(law.moduli(np.zeros((len(cells.area), 3))))
            np.add.at(total, cells.bars, np.einsum("ckk->ck", K))
        return float((total * m.rest_square).max())


def _by_law(cells: Cells, law: Law, gamma: Array, N: Array) -> float:
    """Energy of cells, N mm; adds their forces to those of the bars."""
    strain = cells.strains(gamma)
    np.add.at(N, cells.bars, cells.area[:, None] * np.einsum("cik,ci->ck", cells.strain, law.stress(strain)))
    return float(cells.area @ law.energy(strain))
