"""Matrices that factorise themselves, each against dense linear algebra."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.typing import NDArray

from bh.mechanics.shared import sparsity
from bh.mechanics.shared.sparsity import build_pattern
from bh.solvers.matrices import (
    BandMatrix,
    FreeBodyMatrix,
    IndefiniteError,
    SparseMatrix,
    reverse_cuthill_mckee,
)
from bh.solvers.saddle import ConstraintRows, MultiplierFactor, MultiplierMatrix
from bh.solvers.sparse import band_is_cheaper

Array = NDArray[np.float64]
N, BAND = 12, 3


def symmetric(seed: int = 0, lift: float = 8.0) -> Array:
    """A banded symmetric matrix (N, N), positive definite for a large `lift`."""
    A = np.random.default_rng(seed).normal(size=(N, N))
    A = A + A.T + lift * np.eye(N)
    i = np.arange(N)
    A[np.abs(i[:, None] - i) > BAND] = 0.0
    return A


def band(A: Array, order: NDArray[np.int64]) -> BandMatrix:
    """A in the user's numbering, stored with row k holding the unknown order[k]."""
    P = A[np.ix_(order, order)]
    ab = np.zeros((BAND + 1, N), order="F")
    for d in range(BAND + 1):
        ab[d, : N - d] = np.diag(P, -d)
    return BandMatrix(ab, order)


def sparse(A: Array, order: NDArray[np.int64]) -> SparseMatrix:
    return SparseMatrix.of(sp.csc_array(A))


def shuffled(A: Array, seed: int = 1) -> tuple[Array, NDArray[np.int64]]:
    """The same matrix in a scrambled numbering, and the order that brings its band back."""
    order = np.random.default_rng(seed).permutation(N)
    scrambled = np.empty_like(A)
    scrambled[np.ix_(order, order)] = A
    return scrambled, order


STORAGE = [pytest.param(band, id="band"), pytest.param(sparse, id="sparse")]


@pytest.mark.parametrize("store", STORAGE)
def test_product_and_solution_in_the_users_numbering(store: Any) -> None:
    A, order = shuffled(symmetric())
    matrix = store(A, order)
    rng = np.random.default_rng(2)
    x = rng.normal(size=N)
    assert np.allclose(matrix @ x, A @ x, rtol=1e-14, atol=1e-13)
    assert np.array_equal(matrix.diagonal(), np.diag(A))
    factor = matrix.factorise()
    assert np.allclose(factor.solve(A @ x), x, rtol=1e-12, atol=1e-12)
    direction, slope = factor.descend(A @ x)
    assert np.allclose(direction, -x, rtol=1e-12, atol=1e-12)
    assert slope == pytest.approx(-x @ A @ x)


@pytest.mark.parametrize("store", STORAGE)
def test_factorising_leaves_the_matrix_alone(store: Any) -> None:
    A, order = shuffled(symmetric())
    matrix = store(A, order)
    x = np.arange(N, dtype=float)
    before = matrix @ x
    matrix.factorise(0.5)
    matrix.factorise()
    assert np.array_equal(matrix @ x, before)


@pytest.mark.parametrize("store", STORAGE)
def test_shift_is_relative_to_the_diagonal(store: Any) -> None:
    A, order = shuffled(symmetric())
    A = A + np.diag(np.linspace(0.0, 50.0, N))
    b = np.random.default_rng(3).normal(size=N)
    for shift in (0.3, 1e-13):
        expected = np.linalg.solve(A + shift * np.diag(np.abs(np.diag(A))), b)
        assert np.allclose(store(A, order).factorise(shift).solve(b), expected, rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("store", STORAGE)
def test_shift_reaches_empty_rows(store: Any) -> None:
    """An unknown without any stiffness gets a part of the mean diagonal."""
    A, order = shuffled(symmetric())
    A[4, :] = A[:, 4] = 0.0
    matrix = store(A, order)
    with pytest.raises(IndefiniteError):
        matrix.factorise()
    x = matrix.factorise(1e-3).solve(np.eye(N)[4])
    assert np.isfinite(x).all()
    assert x[4] > 0.0


@pytest.mark.parametrize("store", STORAGE)
@pytest.mark.parametrize("negative", [1, 2, 5])
def test_indefinite_is_refused(store: Any, negative: int) -> None:
    A, order = shuffled(symmetric(4, lift=30.0))
    values = np.linalg.eigvalsh(A)
    shift = 0.5 * (values[negative - 1] + values[negative])
    A = A - shift * np.eye(N)
    assert (np.linalg.eigvalsh(A) < 0.0).sum() == negative
    with pytest.raises(IndefiniteError) as caught:
        store(A, order).factorise()
    # the sparse factor counts them (Sylvester), the band only knows that there are some
    assert caught.value.negative == (negative if store is sparse else 1)
    assert str(caught.value).startswith(str(caught.value.negative))
    ratio = -np.linalg.eigvalsh(A)[0] / np.abs(np.diag(A)).min()
    store(A, order).factorise(2.0 * ratio)  # a large enough shift mends it


@pytest.mark.parametrize("store", STORAGE)
def test_singular_is_refused(store: Any) -> None:
    with pytest.raises(IndefiniteError):
        store(np.zeros((N, N)), np.arange(N)).factorise()


def test_reverse_cuthill_mckee() -> None:
    """A scrambled chain of 60 nodes gets back a bandwidth of one; the order is a permutation."""
    rng = np.random.default_rng(0)
    label = rng.permutation(60)
    rows, columns = label[:-1], label[1:]
    order, bandwidth = reverse_cuthill_mckee(rows, columns, 60)
    assert np.array_equal(np.sort(order), np.arange(60))
    assert bandwidth == 1
    position = np.argsort(order)
    assert np.abs(position[rows] - position[columns]).max() == 1


@pytest.mark.parametrize(("n", "width"), [(1, 0), (7, 9), (50, 3), (83, 40)])
def test_factor_of_a_ragged_band(n: int, width: int) -> None:
    """Columns that end early, blocks that do not divide n, bands wider than the matrix: as dense, and nothing is read
    of a column behind its end."""
    rng = np.random.default_rng(n)
    reach = np.minimum(np.arange(n) + rng.integers(0, width + 1, n), n - 1)
    reach = np.maximum.accumulate(reach)
    i, j = np.indices((n, n))
    A = np.where((i >= j) & (i <= reach[j]), rng.normal(size=(n, n)), 0.0)
    A = A + A.T + 4.0 * (width + 2) * np.eye(n)
    ab = np.zeros((width + 1, n), order="F")
    for d in range(min(width + 1, n)):
        ab[d, : n - d] = np.where(np.arange(d, n) <= reach[: n - d], np.diag(A, -d), np.nan)
    factor = BandMatrix(ab, np.arange(n), reach).factorise()
    b = rng.normal(size=(n, 3))
    expected = np.linalg.solve(A, b)
    assert np.allclose(factor.solve(b), expected, rtol=0.0, atol=1e-13)
    assert np.allclose(factor.solve(b[:, 1]), expected[:, 1], rtol=0.0, atol=1e-13)
    A[-1, -1] = -1.0
    ab[0, -1] = -1.0
    with pytest.raises(IndefiniteError):
        BandMatrix(ab, np.arange(n), reach).factorise()


# --------------------------------------------------------------------------------------- assembled patterns


@pytest.mark.parametrize("banded", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_pattern_assembles_random_elements(banded: bool, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Random elements with some unknowns prescribed: the matrix is the sum of all element matrices."""
    monkeypatch.setattr(sparsity, "band_is_cheaper", lambda n, bandwidth: banded)
    rng = np.random.default_rng(seed)
    nodes = 9
    number = np.full((nodes, 3), -1)
    free = rng.random((nodes, 3)) < 0.8
    number[free] = rng.permutation(int(free.sum()))  # any numbering will do
    chain = np.column_stack((np.arange(nodes - 1), np.arange(1, nodes)))  # every node has an element
    groups = (chain, np.array([rng.choice(nodes, 4, replace=False) for _ in range(7)]))
    pattern = build_pattern(number, groups)
    n = int(free.sum())
    assert pattern.banded is banded
    assert np.array_equal(np.sort(pattern.order), np.arange(n))
    data, expected = np.zeros(pattern.size), np.zeros((n, n))
    for group, slots in zip(groups, pattern.slots, strict=True):
        for element, at in zip(group, slots, strict=True):
            size = 3 * len(element)
            block = rng.normal(size=(size, size))
            block = block @ block.T
            lower = block[np.tril_indices(size)]
            np.add.at(data, at[at >= 0], lower[at >= 0])
            ids = number[element].ravel()
            keep = np.flatnonzero(ids >= 0)
            expected[np.ix_(ids[keep], ids[keep])] += block[np.ix_(keep, keep)]
    matrix = pattern.matrix(data)
    assert isinstance(matrix, BandMatrix if banded else SparseMatrix)
    dense = np.column_stack([matrix @ e for e in np.eye(n)])
    assert np.allclose(dense, expected, rtol=1e-13, atol=1e-13)
    assert np.allclose(matrix.diagonal(), np.diag(expected))
    b = rng.normal(size=n)
    assert np.allclose(expected @ matrix.factorise().solve(b), b, atol=1e-8)


def test_choice_of_storage_grows_with_bandwidth() -> None:
    assert band_is_cheaper(500, 20)
    assert not band_is_cheaper(30_000, 900)


# --------------------------------------------------------------------------------------- free bodies


def free_body(seed: int = 5, motions: int = 2) -> tuple[FreeBodyMatrix, Array, Array]:
    """A positive semidefinite matrix with a null space Z, grounded at four unknowns; (matrix, K, Z)."""
    rng = np.random.default_rng(seed)
    Z = np.linalg.qr(rng.normal(size=(N, motions)))[0]
    P = np.eye(N) - Z @ Z.T
    M = rng.normal(size=(N, N))
    K = P @ (M @ M.T + np.eye(N)) @ P
    rows = np.array([2, 3, 7, 9])
    Q = np.linalg.qr(Z[rows])[0]
    ground = 5.0 * Q @ Q.T
    grounded = K.copy()
    grounded[np.ix_(rows, rows)] += ground
    return FreeBodyMatrix(sparse(grounded, np.arange(N)), Z, rows, ground), K, Z


def test_free_body() -> None:
    matrix, K, Z = free_body()
    x = np.random.default_rng(6).normal(size=N)
    assert np.allclose(matrix @ x, K @ x, atol=1e-12)
    load = K @ x  # in equilibrium
    y = matrix.factorise().solve(load)
    assert np.abs(Z.T @ y).max() < 1e-13
    assert np.allclose(K @ y, load, atol=1e-10)
    assert np.allclose(y, np.linalg.pinv(K) @ load, atol=1e-9)
    # what does not depend on the ground: a tenfold one gives the same
    stiffer = FreeBodyMatrix(
        sparse(K + 10.0 * matrix_of_ground(matrix), np.arange(N)), Z, matrix.ground_rows, 10.0 * matrix.ground
    )
    assert np.allclose(stiffer.factorise().solve(load), y, atol=1e-9)


def matrix_of_ground(matrix: FreeBodyMatrix) -> Array:
    out = np.zeros((N, N))
    out[np.ix_(matrix.ground_rows, matrix.ground_rows)] = matrix.ground
    return out


def test_free_body_without_motions_is_the_matrix() -> None:
    A, order = shuffled(symmetric())
    matrix = FreeBodyMatrix(band(A, order), np.zeros((N, 0)), np.arange(4), np.zeros((4, 4)))
    b = np.random.default_rng(7).normal(size=N)
    assert np.allclose(matrix.factorise().solve(b), np.linalg.solve(A, b))


# --------------------------------------------------------------------------------------- multipliers


def constrained(seed: int = 8, count: int = 3, gamma: float = 50.0) -> tuple[MultiplierMatrix, Array]:
    """A few constraint rows on a matrix K, and the dense saddle matrix [[K, G^T], [G, 0]]; gamma is not in it."""
    rng = np.random.default_rng(seed)
    columns = np.array([rng.choice(N, 4, replace=False) for _ in range(count)])
    values = rng.normal(size=(count, 4))
    columns[0, 2] = -1  # an entry at a prescribed unknown
    G = np.zeros((count, N))
    for i in range(count):
        for j in range(4):
            if columns[i, j] >= 0:
                G[i, columns[i, j]] += values[i, j]
    weights = np.full(count, gamma)
    K = symmetric(9, lift=12.0)
    A = K + G.T @ (weights[:, None] * G)
    matrix = MultiplierMatrix(
        sparse(A, np.arange(N)), ConstraintRows(values, columns, N), weights, 0.0 * weights
    )
    return matrix, np.block([[K, G.T], [G, np.zeros((count, count))]])


@pytest.mark.parametrize("gap", [0.0, 1e-6, 1.0])
@pytest.mark.parametrize("gamma", [1.0, 50.0, 1e6])
def test_multipliers_against_a_dense_saddle(gap: float, gamma: float) -> None:
    matrix, saddle = constrained(gamma=gamma)
    rng = np.random.default_rng(10)
    x = rng.normal(size=N + 3)
    assert np.allclose(matrix @ x, saddle @ x, rtol=1e-12, atol=1e-14 * gamma)
    b = np.concatenate((rng.normal(size=N), gap * rng.normal(size=3)))
    y = matrix.factorise().solve(b)
    expected = np.linalg.solve(saddle, b)
    assert np.isfinite(y).all()
    assert np.allclose(saddle[:N] @ y, b[:N], atol=1e-12 * gamma + 1e-10)  # the first row exactly
    assert np.abs(y[N:] - expected[N:]).max() <= 1e-3 * np.abs(expected[N:]).max()  # the promised tolerance
    assert np.abs(y[:N] - expected[:N]).max() <= 1e-3 * np.abs(expected[:N]).max()
    # as tight as it is asked for
    factor = matrix.factorise()
    assert isinstance(factor, MultiplierFactor)
    tight = MultiplierFactor(
        factor.factor, factor.G, factor.gamma, factor.compliance, most=200, tolerance=1e-12
    ).solve(b)
    assert np.allclose(tight, expected, rtol=1e-7, atol=1e-8)


def test_indefinite_but_positive_on_the_constraints() -> None:
    """K with a negative direction that the constraint holds is definite there, whatever gamma is."""
    rng = np.random.default_rng(11)
    g = np.zeros(N)
    g[:4] = rng.normal(size=4)
    K = symmetric(12, lift=12.0) - 60.0 * np.outer(g, g) / (g @ g)
    assert (np.linalg.eigvalsh(K) < 0.0).sum() == 1
    G = ConstraintRows(g[None, :4].copy(), np.arange(4)[None], N)
    for gamma in (100.0, 1e-3):
        matrix = MultiplierMatrix(
            sparse(K + gamma * np.outer(g, g), np.arange(N)), G, np.array([gamma]), np.zeros(1)
        )
        y = matrix.factorise().solve(np.ones(N + 1))
        assert g @ y[:N] == pytest.approx(1.0, abs=1e-7)
        assert matrix.factorise_any()[1] == 0
    other = np.roll(g, 7)
    K = K - 60.0 * np.outer(other, other) / (other @ other)
    matrix = MultiplierMatrix(
        sparse(K + 100.0 * np.outer(g, g), np.arange(N)), G, np.array([100.0]), np.zeros(1)
    )
    assert matrix.factorise_any()[1] == 1
    with pytest.raises(IndefiniteError):
        matrix.factorise()


def test_constraint_that_no_unknown_can_meet() -> None:
    """All unknowns of a constraint are prescribed: an error that says so, or the least-squares answer; no crash."""
    A, order = shuffled(symmetric())
    G = ConstraintRows(np.ones((1, 4)), np.full((1, 4), -1), N)
    matrix = MultiplierMatrix(sparse(A, order), G, np.array([1.0]), np.zeros(1))
    try:
        y = matrix.factorise().solve(np.ones(N + 1))
    except IndefiniteError:
        return
    assert np.isfinite(y).all()
