"""Saddle matrices of constraints with multipliers, in augmented form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bh.runtime.kernel_options import KERNEL
from bh.solvers.factor import Descent, Factor, IndefiniteError
from bh.solvers.matrices import BandMatrix, FreeBodyMatrix, SparseMatrix

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
NOISE = 2e-14  # error of a constraint that is rounding (angles in rad)
ROUNDING = 4.0 * np.finfo(float).eps  # of a sum, in parts of the sum of its sizes
TINY_SHIFT = 1e-12  # shifts up to this only take rounding off
MOST_BRISK = (
    300  # constraints up to which an indefinite augmented matrix is looked at closely in every iteration
)
MOST_DENSE = 1500  # constraints whose Schur complement is still formed as a dense matrix


@njit(**KERNEL)
def _times(values, columns, x, out):  # type: ignore[no-untyped-def]
    for i in range(len(values)):
        total = 0.0
        for j in range(values.shape[1]):
            if columns[i, j] >= 0:
                total += values[i, j] * x[columns[i, j]]
        out[i] = total


@njit(**KERNEL)
def _transpose_times(values, columns, y, out):  # type: ignore[no-untyped-def]
    for i in range(len(values)):
        for j in range(values.shape[1]):
            if columns[i, j] >= 0:
                out[columns[i, j]] += values[i, j] * y[i]


@dataclass(frozen=True)
class ConstraintRows:
    """Gradients G (c, n) of constraints, each with a few entries: `values` and `columns` (c, w), column -1 unused."""

    values: Array
    columns: Ints
    n: int

    def times(self, x: Array) -> Array:
        """(c,) G x for x (n,)."""
        out = np.empty(len(self.values))
        _times(self.values, self.columns, x, out)
        return out

    def sizes(self, x: Array) -> Array:
        """Sums of |G_ij x_j|: rounding errors of `times` go with them.

        Returns:
            (c,) sums, one a constraint.
        """
        out = np.empty(len(self.values))
        _times(np.abs(self.values), self.columns, np.abs(x), out)
        return out

    def dense(self) -> Array:
        """G as an array (c, n)."""
        out = np.zeros((len(self.values), self.n))
        for entry in range(self.columns.shape[1]):
            used = np.flatnonzero(self.columns[:, entry] >= 0)
            out[used, self.columns[used, entry]] += self.values[used, entry]
        return out

    def transpose_times(self, y: Array) -> Array:
        """(n,) G^T y for y (c,)."""
        out = np.zeros(self.n)
        _transpose_times(self.values, self.columns, y, out)
        return out


@dataclass(frozen=True)
class MultiplierMatrix:
    """The saddle matrix [[K, G^T], [G, -compliance]] of constraints, stored as A = K + gamma G^T G.

    A is positive definite just where K is so on the null space of G (Finsler 1937; for gamma large enough) and has the
    sparsity of ordinary hinges. gamma is only a means to solve: it is in neither the residual nor the solution.
    Right-hand sides and solutions are (n + c,), multipliers last.
    """

    augmented: BandMatrix | SparseMatrix | FreeBodyMatrix
    G: ConstraintRows
    gamma: Array  # (c,) one for each constraint
    compliance: Array  # (c,) of the constraints, tiny: it decides between multipliers that do the same

    def factorise(self, shift: float = 0.0) -> MultiplierFactor | DenseSchurFactor:
        """Factor of the saddle, with A + shift * diag(|A|); raises `IndefiniteError` where K is so on G x = 0."""
        try:
            return MultiplierFactor(self.augmented.factorise(shift), self.G, self.gamma, self.compliance)
        except IndefiniteError:
            if shift > TINY_SHIFT or len(self.gamma) > MOST_BRISK:
                raise
        # large moments in the constraints can outweigh gamma: A is indefinite, the state on the constraints is not
        factor, negative = self.factorise_any()
        if negative > 0 or isinstance(factor, MultiplierFactor):
            raise IndefiniteError(max(negative, 1))
        return factor  # type: ignore[return-value]

    def factorise_any(self) -> tuple[Factor, int]:
        """Factor of the saddle, and the number of negative eigenvalues of K on the null space of G."""
        factor, negative = self.augmented.factorise_any()
        if negative == 0:
            return MultiplierFactor(factor, self.G, self.gamma, self.compliance), 0
        if len(self.gamma) > MOST_DENSE:
            raise IndefiniteError(negative)
        whole = DenseSchurFactor.of(factor, self.G, self.gamma, self.compliance)
        # inertia of the saddle is that of A and of -S; its c constraints take c of the negative ones (Gould 1985)
        return whole, negative - int((whole.schur_values < 0.0).sum())

    def __matmul__(self, x: Array) -> Array:
        """Saddle matrix times x (n + c,)."""
        n = self.G.n
        turn = self.G.times(x[:n])
        top = self.augmented @ x[:n] + self.G.transpose_times(x[n:] - self.gamma * turn)
        return np.concatenate((top, turn - self.compliance * x[n:]))

    def diagonal(self) -> Array:
        """(n,) diagonal of the augmented matrix, without multipliers."""
        return self.augmented.diagonal()


@dataclass(frozen=True)
class MultiplierFactor(Factor):
    """Solves by conjugate gradients on the Schur complement S = G A^-1 G^T, preconditioned by gamma.

    S is 1 / gamma up to the stiffness of the structure against the constraints, so few steps suffice; x and y meet
    the first row exactly after each of them. The tolerance is relative to the multipliers: Newton's method corrects
    the rest (an inexact Newton, Dembo, Eisenstat and Steihaug 1982).
    """

    factor: Factor
    G: ConstraintRows
    gamma: Array
    compliance: Array
    most: int = 40
    tolerance: float = 1e-3

    def solve(self, b: Array) -> Array:
        """Solution x (n + c,) of the saddle times x = b (n + c,)."""
        # second row times gamma G^T added to the first: A x + (1 - gamma c) G^T y = b_1 + gamma G^T b_2
        G, n = self.G, self.G.n
        # constraints that say the same (a straight crease between rigid panels) leave a rounding error that no
        # multiplier can remove; chasing it would pump up moments that mean nothing
        gap = np.where(np.abs(b[n:]) <= NOISE, 0.0, b[n:])
        scale = 1.0 - self.gamma * self.compliance
        compliance = self.compliance / scale
        y = np.zeros(len(gap))  # scale times the multipliers until the end
        x = self.factor.solve(b[:n] + G.transpose_times(self.gamma * gap))
        miss = G.times(x) - gap
        noise = ROUNDING * float(G.sizes(x).max(initial=0.0))
        goal = 1e-7 * float(np.abs(gap).max(initial=0.0))
        p = z = self.gamma * miss
        rho = float(miss @ z)
        for _ in range(self.most):
            error = float(np.abs(miss).max(initial=0.0))
            if error <= noise or (error <= goal and np.abs(z).max() <= self.tolerance * np.abs(y).max()):
                break
            v = self.factor.solve(G.transpose_times(p))
            Sp = G.times(v) + compliance * p
            curvature = float(p @ Sp)
            if curvature <= 0.0:  # no unknown can change these constraints
                break
            step = rho / curvature
            y += step * p
            x -= step * v
            miss -= step * Sp
            z = self.gamma * miss
            rho, before = float(miss @ z), rho
            p = z + (rho / before) * p
        # with what the constraints still miss as a moment the first row is met exactly
        return np.concatenate((x, y / scale + self.gamma * miss))

    def descend(self, residual: Array) -> Descent:
        """Newton's direction of the saddle. Its displacements go downhill once its multipliers are set.

        With those the gradient of the augmented Lagrangian is -(K + gamma G^T G) x, as G x = -gap; so its slope along x
        is negative wherever the (shifted) augmented matrix is definite. Updating the multipliers to first order only
        (gamma times what is missed) crawls where the sheet is stiffer against the constraint than gamma.
        """
        n = self.G.n
        direction = -self.solve(residual)
        moments = direction[n:] + self.gamma * residual[n:]
        gradient = residual[:n] + self.G.transpose_times(moments)
        return Descent(direction, float(gradient @ direction[:n]))


@dataclass(frozen=True)
class DenseSchurFactor(Factor):
    """Factor of a saddle matrix whose first block is indefinite; its Schur complement G A^-1 G^T is dense."""

    factor: Factor
    G: ConstraintRows
    gamma: Array
    scale: Array  # 1 - gamma * compliance, see `MultiplierFactor.solve`
    influence: Array  # (n, c) A^-1 G^T
    schur: Array
    schur_values: Array

    @classmethod
    def of(cls, factor: Factor, G: ConstraintRows, gamma: Array, compliance: Array) -> DenseSchurFactor:
        """The factor of a saddle, from one of its augmented block A.

        Args:
            factor: of the augmented block A.
            G: rows of the constraints.
            gamma: (c,) weights of the augmentation.
            compliance: (c,) of the constraints.
        """
        scale = 1.0 - gamma * compliance
        rows = G.dense()
        influence = factor.solve(np.ascontiguousarray(rows.T))
        schur = rows @ influence
        schur = 0.5 * (schur + schur.T) + np.diag(compliance / scale)
        return cls(
            factor, G, gamma, scale, influence, schur, np.asarray(np.linalg.eigvalsh(schur), dtype=float)
        )

    def solve(self, b: Array) -> Array:
        """Solution x (n + c,) of the saddle times x = b (n + c,)."""
        n = self.G.n
        x = self.factor.solve(b[:n] + self.G.transpose_times(self.gamma * b[n:]))
        y = np.linalg.solve(self.schur, self.G.times(x) - b[n:])
        return np.concatenate((x - self.influence @ y, y / self.scale))
