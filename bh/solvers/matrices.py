"""Symmetric matrices that factorise themselves: banded, sparse, with multipliers, and of a free body.

A matrix knows how to solve with itself; the driver does not care how. `factorise` either returns a factor or raises
`Indefinite`, which says how many eigenvalues are negative, so that the driver can shift or turn back.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import lapack

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class Indefinite(ArithmeticError):
    """The matrix is not positive definite (for multipliers: not so on the constraint's null space).

    `negative` is the number of negative eigenvalues, or 1 where only their presence is known.
    """

    def __init__(self, negative: int) -> None:
        super().__init__(f"{negative} negative eigenvalue(s)")
        self.negative = negative


class Factor(Protocol):
    def solve(self, b: Array) -> Array:
        """x with A x = b; b (n,) or (n, k)."""
        ...


class Matrix(Protocol):
    def factorise(self, shift: float = 0.0) -> Factor:
        """Factor of A + shift * diag(|A|); raises `Indefinite`."""
        ...

    def __matmul__(self, x: Array) -> Array: ...


# ---------------------------------------------------------------------------------------------- banded


@dataclass(frozen=True)
class BandMatrix:
    """Symmetric band, lower part in LAPACK form `ab` (b + 1, n) Fortran order, rows permuted by `order`."""

    ab: Array
    order: Ints

    def factorise(self, shift: float = 0.0) -> BandFactor:
        ab = self.ab.copy(order="F")
        if shift:
            ab[0] += shift * np.maximum(np.abs(ab[0]), 1e-3 * np.abs(ab[0]).mean())
        factor, info = lapack.dpbtrf(ab, lower=1, overwrite_ab=1)
        if info != 0:
            raise Indefinite(1)
        return BandFactor(factor, self.order)

    def __matmul__(self, x: Array) -> Array:
        y = x[self.order]
        out = self.ab[0] * y
        n = len(y)
        for d in range(1, len(self.ab)):
            row = self.ab[d, : n - d]
            out[d:] += row * y[: n - d]
            out[: n - d] += row * y[d:]
        result = np.empty_like(out)
        result[self.order] = out
        return result

    def diagonal(self) -> Array:
        out = np.empty(self.ab.shape[1])
        out[self.order] = self.ab[0]
        return out


@dataclass(frozen=True)
class BandFactor:
    ab: Array
    order: Ints

    def solve(self, b: Array) -> Array:
        x, info = lapack.dpbtrs(self.ab, b[self.order], lower=1)
        if info != 0:
            raise ArithmeticError(f"LAPACK dpbtrs refused argument {-info}")
        out = np.empty_like(b)
        out[self.order] = x
        return out


# ---------------------------------------------------------------------------------------------- sparse


@dataclass(frozen=True)
class SparseMatrix:
    """Symmetric sparse matrix, both triangles in CSC form, rows already in a fill-reducing order `order`."""

    csc: sp.csc_matrix
    order: Ints

    def factorise(self, shift: float = 0.0) -> SparseFactor:
        from scipy.sparse.linalg import splu

        A = self.csc
        if shift:
            diagonal = np.abs(A.diagonal())
            A = A + sp.diags_array(shift * np.maximum(diagonal, 1e-3 * diagonal.mean()), format="csc")
        try:
            factor = splu(
                A, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True, "Equil": False}
            )
        except RuntimeError as singular:
            raise Indefinite(1) from singular
        # with diagonal pivots U = D L^T, so the signs on the diagonal of U are the inertia (Sylvester)
        negative = int((factor.U.diagonal() <= 0.0).sum())
        if negative:
            raise Indefinite(negative)
        return SparseFactor(factor, self.order)

    def __matmul__(self, x: Array) -> Array:
        out = np.empty_like(x)
        out[self.order] = self.csc @ x[self.order]
        return out

    def diagonal(self) -> Array:
        out = np.empty(self.csc.shape[0])
        out[self.order] = self.csc.diagonal()
        return out


@dataclass(frozen=True)
class SparseFactor:
    superlu: Any
    order: Ints

    def solve(self, b: Array) -> Array:
        out = np.empty_like(b)
        out[self.order] = self.superlu.solve(np.ascontiguousarray(b[self.order]))
        return out


# ---------------------------------------------------------------------------------------------- composed


@dataclass(frozen=True)
class FreeBodyMatrix:
    """Tangent of a body with free rigid motions, of which `grounded` is the tangent plus a stiffness against them.

    Loads that are in equilibrium do no work on the rigid motions Z (n, r), so the stiffness that holds them carries
    no force: the solution is the exact one plus some rigid motion, and the rigid part is then taken out. What is left
    is the solution of least displacement; the rigid-body support is r conditions Z^T dq = 0 and nothing else.
    """

    grounded: BandMatrix | SparseMatrix
    Z: Array

    def factorise(self, shift: float = 0.0) -> FreeBodyFactor:
        return FreeBodyFactor(self.grounded.factorise(shift), self.Z)

    def __matmul__(self, x: Array) -> Array:
        return self.grounded @ x

    def diagonal(self) -> Array:
        return self.grounded.diagonal()


@dataclass(frozen=True)
class FreeBodyFactor:
    factor: Factor
    Z: Array  # orthonormal columns

    def solve(self, b: Array) -> Array:
        x = self.factor.solve(b - self.Z @ (self.Z.T @ b))
        return x - self.Z @ (self.Z.T @ x)


@dataclass(frozen=True)
class MultiplierMatrix:
    """The saddle matrix [[K, G^T], [G, 0]] of constraints, held in augmented form.

    `augmented` is K + gamma G^T G, which is positive definite just where K is so on the null space of G (for gamma
    large enough), has the sparsity of ordinary hinges, and makes solving cheap: the multipliers are eliminated by a
    few corrections, each of which shrinks the constraint error by about (constraint stiffness / gamma).
    The right-hand side and the solution are (n + c,), multipliers last, those of the saddle with K = augmented.
    """

    augmented: BandMatrix | SparseMatrix | FreeBodyMatrix
    G: sp.csr_array
    gamma: Array  # (c,) one for each constraint

    def factorise(self, shift: float = 0.0) -> MultiplierFactor:
        return MultiplierFactor(self.augmented.factorise(shift), self.G, self.gamma)

    def __matmul__(self, x: Array) -> Array:
        n = self.G.shape[1]
        return np.concatenate((self.augmented @ x[:n] + self.G.T @ x[n:], self.G @ x[:n]))

    def diagonal(self) -> Array:
        return np.concatenate((self.augmented.diagonal(), np.zeros(self.G.shape[0])))


@dataclass(frozen=True)
class MultiplierFactor:
    factor: Factor
    G: sp.csr_array
    gamma: Array
    most: int = 40
    tolerance: float = 1e-5

    def solve(self, b: Array) -> Array:
        """Conjugate gradients on the Schur complement S = G A^-1 G^T, preconditioned by gamma.

        S is 1 / gamma up to the stiffness of the structure against the constraints, so few steps suffice; x and y
        meet the first row exactly after each of them.
        """
        n = self.G.shape[1]
        force, gap = b[:n], b[n:]
        transpose = self.G.T.tocsr()
        y = np.zeros(len(gap))
        x = self.factor.solve(force)
        miss = self.G @ x - gap
        goal = 1e-9 * float(np.abs(gap).max(initial=0.0))
        z = self.gamma * miss
        p, rho = z, float(miss @ z)
        for _ in range(self.most):
            if rho == 0.0 or (
                np.abs(miss).max() <= goal and np.abs(z).max() <= self.tolerance * np.abs(y).max()
            ):
                break
            v = self.factor.solve(transpose @ p)
            Sp = self.G @ v
            step = rho / float(p @ Sp)
            y = y + step * p
            x = x - step * v
            miss = miss - step * Sp
            z = self.gamma * miss
            rho, before = float(miss @ z), rho
            p = z + (rho / before) * p
        return np.concatenate((x, y))


def reverse_cuthill_mckee(rows: Ints, columns: Ints, n: int) -> tuple[Ints, int]:
    """Order (n,) of small bandwidth for a symmetric pattern, and that bandwidth (order[k] is the old index)."""
    from scipy.sparse.csgraph import reverse_cuthill_mckee as rcm

    pattern = sp.coo_array((np.ones(len(rows)), (rows, columns)), shape=(n, n)).tocsr()
    order = rcm(sp.csr_matrix(pattern + pattern.T), symmetric_mode=True).astype(np.int64)
    position = np.empty(n, dtype=np.int64)
    position[order] = np.arange(n)
    bandwidth = int(np.abs(position[rows] - position[columns]).max(initial=0))
    return order, bandwidth
