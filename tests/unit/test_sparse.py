"""Sparse factors on real tangents: against SuperLU, their inertia and order, and PARDISO where it is installed."""

from __future__ import annotations

import gc
import math
import weakref
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

import bh
import meshes
from bh.mechanics.bars_and_hinges.system import BarsAndHingesSystem
from bh.mechanics.shared import sparsity as patterns
from bh.solvers import multifrontal, pardiso
from bh.solvers.dissection import dissect
from bh.solvers.factor import IndefiniteError
from bh.solvers.sparse import SparseMatrix, SparsePattern

Array = NDArray[np.float64]


def full(matrix: SparseMatrix) -> sp.csc_array:
    """Both triangles, in the order of elimination."""
    p = matrix.pattern
    n = len(p.order)
    lower = sp.csc_array((matrix.data, p.indices, p.indptr), shape=(n, n))
    return sp.csc_array(lower + sp.tril(lower, -1).T)


def sheet(kind: str, along: int = 24, rows: int = 6) -> bh.Model:
    mesh = meshes.structured(meshes.annulus_sector(100.0, 20.0, 1.5), along=along, rows=rows, kind=kind)  # type: ignore[arg-type]
    return (
        bh.Model(mesh, bh.Sheet(E=4000.0, t=0.3), formulation="bars-and-hinges")
        .support("corner:inner-start", "xyz")
        .support("corner:outer-start", "yz")
        .support("edge:inner", "z")
        .support("edge:outer", "z")
    )


@pytest.fixture(scope="module", params=["staggered", "alternating"])
def tangents(request: pytest.FixtureRequest) -> dict[str, SparseMatrix]:
    """Tangents of a wide sheet: flat, folded to 120 degrees, and with forces that make it indefinite."""
    patch = pytest.MonkeyPatch()
    patch.setattr(patterns, "band_is_cheaper", lambda n, bandwidth: False)
    try:
        path = bh.trace(sheet(request.param).fold("crease", rest=2.0 * math.pi / 3.0, Lstar=25.0))
        assert path.outcome == "reached"
        system, q = path.system(0), path.records[-1].q
        forces = system.evaluate(q, 1.0).forces
        assert isinstance(system, BarsAndHingesSystem)
        pressed = forces.copy()
        pressed[: len(system.elements.bars)] -= 2.0  # N in every bar
        made = {
            "flat": system.tangent(system.start(), 0.0, 0.0 * forces).matrix,
            "folded": system.tangent(q, 1.0, forces).matrix,
            "pressed": system.tangent(q, 1.0, pressed).matrix,
        }
    finally:
        patch.undo()
    sparse = {name: matrix for name, matrix in made.items() if isinstance(matrix, SparseMatrix)}
    assert sparse.keys() == made.keys()
    return sparse


@pytest.fixture(params=["own", "pardiso"])
def backend(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    if request.param == "pardiso":
        pytest.importorskip("pypardiso")
        assert pardiso.available()
    monkeypatch.setattr(pardiso, "FEWEST", 0 if request.param == "pardiso" else 10**9)
    return str(request.param)


@pytest.mark.parametrize("state", ["flat", "folded", "pressed"])
def test_answers_and_inertia(tangents: dict[str, SparseMatrix], state: str, backend: str) -> None:
    """As SuperLU to what the condition number allows; as many negative eigenvalues as the dense matrix has."""
    matrix = tangents[state]
    A = full(matrix)
    values = np.linalg.eigvalsh(A.toarray())
    negative = int((values < 0.0).sum())
    assert (negative > 0) == (state == "pressed")
    b = np.random.default_rng(0).normal(size=(len(values), 2))
    factor, found = matrix.factorise_any()
    assert found == negative
    if negative:
        with pytest.raises(IndefiniteError) as caught:
            matrix.factorise()
        assert caught.value.negative == negative
        with pytest.raises(IndefiniteError):
            factor.descend(b[:, 0])
        x = factor.solve(b)
    else:
        x = matrix.factorise().solve(b)
    order = matrix.pattern.order
    expected = np.empty_like(b)
    expected[order] = splu(A).solve(b[order])
    rounding = 4.0 * np.finfo(float).eps * np.abs(values).max() / np.abs(values).min()
    assert rounding < 1e-7
    assert np.abs(x - expected).max() < rounding * np.abs(expected).max()
    assert np.array_equal(factor.solve(b[:, 0]), x[:, 0]) or np.allclose(
        factor.solve(b[:, 0]), x[:, 0], rtol=1e-9
    )
    assert np.allclose(matrix @ x[:, 0], b[:, 0], atol=1e-8 * np.abs(values).max() * np.abs(x).max() / len(x))


def test_paths_agree_with_those_of_the_band(backend: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Energies of a folded sheet to 1e-10, prescribed crease and spring crease, whoever factorises."""
    for model in (
        sheet("staggered", 12, 3).fold("crease", to=2.2),
        sheet("alternating", 12, 3).fold("crease", rest=2.0, Lstar=25.0),
    ):
        banded = bh.trace(model)
        with monkeypatch.context() as patch:
            patch.setattr(patterns, "band_is_cheaper", lambda n, bandwidth: False)
            other = bh.trace(model)
            system = other.system(0)
            assert isinstance(system, BarsAndHingesSystem)
            assert isinstance(system._pattern.matrix(np.zeros(system._pattern.size)), SparseMatrix)
        assert banded.outcome == other.outcome == "reached"
        assert banded.iterations == other.iterations
        assert other[-1].energy.total == pytest.approx(banded[-1].energy.total, rel=1e-10)
        assert other[-1].energy.stretching == pytest.approx(banded[-1].energy.stretching, rel=1e-8)


def test_many_factors_at_once(tangents: dict[str, SparseMatrix], backend: str) -> None:
    """Factors of one pattern do not disturb each other, in one thread or in several."""
    flat, folded = tangents["flat"], tangents["folded"]
    assert flat.pattern is folded.pattern
    b = np.random.default_rng(1).normal(size=len(flat.pattern.order))
    expected = [matrix.factorise().solve(b) for matrix in (flat, folded)]
    factors = [matrix.factorise() for matrix in (flat, folded) * 3]
    with ThreadPoolExecutor(4) as pool:
        for _ in range(3):
            for i, x in enumerate(pool.map(lambda factor: factor.solve(b), factors)):
                assert np.array_equal(x, expected[i % 2])
        again = pool.map(lambda matrix: matrix.factorise().solve(b), (flat, folded) * 6)
        for i, x in enumerate(again):
            assert np.array_equal(x, expected[i % 2])


def test_shift_and_repeats(tangents: dict[str, SparseMatrix], backend: str) -> None:
    """The same matrix gives the same numbers; the shift is on the diagonal and leaves the matrix alone."""
    matrix = tangents["folded"]
    before = matrix.data.copy()
    b = np.ones(len(matrix.pattern.order))
    first = matrix.factorise().solve(b)
    shifted = matrix.factorise(0.5).solve(b)
    assert np.array_equal(matrix.data, before)
    assert np.array_equal(matrix.factorise().solve(b), first)
    A = full(matrix)
    order = matrix.pattern.order
    expected = np.empty_like(b)
    diagonal = A.diagonal()
    more = sp.diags_array(0.5 * np.maximum(diagonal, 1e-3 * diagonal.mean()))
    expected[order] = splu(sp.csc_array(A + more)).solve(b[order])
    assert np.allclose(shifted, expected, rtol=1e-10, atol=1e-13)


def test_singular_is_refused(backend: str) -> None:
    K = sp.csc_array(
        np.diag([2.0, 3.0, 0.0, 1.0]) + np.diag([1.0, 0.0, 0.0], 1) + np.diag([1.0, 0.0, 0.0], -1)
    )
    matrix = SparseMatrix.of(K)
    with pytest.raises(IndefiniteError):
        matrix.factorise()
    with pytest.raises(IndefiniteError):
        matrix.factorise_any()


def test_pattern_of_an_earlier_matrix() -> None:
    """A matrix with the same entries reuses the analysis; one with other entries is refused."""
    rng = np.random.default_rng(3)
    structure = sp.random_array((40, 40), density=0.06, rng=rng)
    structure = sp.csc_array(structure + structure.T + sp.eye_array(40))
    first = SparseMatrix.of(20.0 * sp.eye_array(40) + structure)
    other = sp.csc_array(structure, copy=True)
    other.data = other.data**2
    other = other + 30.0 * sp.eye_array(40)
    second = SparseMatrix.of(other, first.pattern)
    assert second.pattern is first.pattern
    b = rng.normal(size=40)
    assert np.allclose(other @ second.factorise().solve(b), b, atol=1e-12)
    with pytest.raises(ValueError, match="other entries"):
        SparseMatrix.of(sp.eye_array(40), first.pattern)


# --------------------------------------------------------------------------------------- PARDISO alone


def test_handles_are_freed(tangents: dict[str, SparseMatrix], monkeypatch: pytest.MonkeyPatch) -> None:
    """Every handle is released once: those beyond the spare ones with their factor, the others with the pattern."""
    pytest.importorskip("pypardiso")
    released: list[int] = []
    release = pardiso._release

    def count(memory: Any, n: int, options: Any) -> None:
        released.append(id(memory))
        release(memory, n, options)

    monkeypatch.setattr(pardiso, "_release", count)
    made = []
    original = pardiso.Handle.__init__

    def remember(self: pardiso.Handle, *arguments: Any) -> None:
        original(self, *arguments)
        made.append(weakref.ref(self))

    monkeypatch.setattr(pardiso.Handle, "__init__", remember)
    matrix = tangents["folded"]
    analysis = pardiso.Analysis(matrix.pattern.indptr, matrix.pattern.indices)
    order = matrix.pattern.order
    factors = [analysis.factorise(matrix.data, order)[0] for _ in range(5)]
    assert len(made) == 5
    del factors
    gc.collect()
    assert len(released) == 5 - pardiso.SPARE
    for _ in range(10):
        analysis.factorise(matrix.data, order)
    assert len(made) == 5  # the symbolic phase is not done again
    del analysis
    gc.collect()
    assert len(released) == 5
    assert not any(handle() for handle in made)


def test_large_matrices_go_to_pardiso(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pardiso, "available", lambda: True)
    assert pardiso.pays(pardiso.FEWEST)
    assert not pardiso.pays(pardiso.FEWEST - 1)
    monkeypatch.setattr(pardiso, "available", lambda: False)
    assert not pardiso.pays(10 * pardiso.FEWEST)


def test_without_pypardiso(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    """Not installed: silently our own; installed but unusable: that is said."""
    pardiso.available.cache_clear()
    monkeypatch.setattr(pardiso, "find_spec", lambda name: None)
    assert not pardiso.available()
    assert not caplog.records
    pardiso.available.cache_clear()
    monkeypatch.setattr(pardiso, "find_spec", lambda name: object())

    def broken() -> None:
        raise ImportError("no mkl_rt")

    monkeypatch.setattr(pardiso, "_library", broken)
    assert not pardiso.available()
    assert "no mkl_rt" in caplog.text
    pardiso.available.cache_clear()


# --------------------------------------------------------------------------------------- order and fronts


def grid(width: int, height: int) -> tuple[Any, Any, Array]:
    """Graph of a square grid with diagonals, and its places."""
    x, y = np.meshgrid(np.arange(width), np.arange(height), indexing="ij")
    places = np.column_stack((x.ravel(), y.ravel())).astype(float)
    pairs = [
        (i, j)
        for i in range(len(places))
        for j in range(len(places))
        if i != j and np.abs(places[i] - places[j]).max() == 1.0
    ]
    rows, columns = np.array(pairs).T
    graph = sp.csr_array((np.ones(len(rows)), (rows, columns)), shape=(len(places),) * 2)
    return graph.indptr.astype(np.int64), graph.indices.astype(np.int64), places


@pytest.mark.parametrize("with_places", [True, False])
def test_dissection(with_places: bool) -> None:
    """A permutation whose tree is a postorder; no edge joins two subtrees that neither contains the other."""
    indptr, indices, places = grid(17, 23)
    tree = dissect(indptr, indices, places if with_places else None)
    assert np.array_equal(np.sort(tree.order), np.arange(len(places)))
    fronts = len(tree.parent)
    assert (tree.parent[:-1] > np.arange(fronts - 1)).all()
    assert tree.parent[-1] == -1
    front = np.empty(len(places), dtype=int)
    front[tree.order] = np.repeat(np.arange(fronts), np.diff(tree.start))
    ancestors = [{k} for k in range(fronts)]
    for k in range(fronts - 2, -1, -1):
        ancestors[k] |= ancestors[tree.parent[k]]
    for v in range(len(places)):
        for w in indices[indptr[v] : indptr[v + 1]]:
            assert front[w] in ancestors[front[v]] or front[v] in ancestors[front[w]]
    # the shortest cut of the rectangle, or a line of equal distance from one of its corners
    assert tree.start[-1] - tree.start[-2] == 17 if with_places else tree.start[-1] - tree.start[-2] < 40


def test_dissection_of_odd_graphs() -> None:
    """One vertex, vertices without neighbours, two separate parts, a chain."""
    for count, pairs in ((1, []), (40, []), (60, [(i, i + 1) for i in range(59) if i != 30])):
        dense = np.zeros((count, count))
        for i, j in pairs:
            dense[i, j] = dense[j, i] = -1.0
        matrix = SparseMatrix.of(sp.csc_array(dense + 3.0 * np.eye(count)))
        b = np.arange(count, dtype=float)
        x = matrix.factorise().solve(b)
        assert np.allclose(matrix @ x, b, atol=1e-12)


def test_fill_grows_as_nested_dissection_promises() -> None:
    """On squares entries of the factor grow like n log n, operations like n^1.5 (George 1973): measured exponents."""
    sizes, entries, operations = [], [], []
    for side in (24, 48, 96):
        x, y = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
        index = x * side + y
        pairs = [(index[1:], index[:-1]), (index[:, 1:], index[:, :-1]), (index[1:, 1:], index[:-1, :-1])]
        high = np.concatenate([a.ravel() for a, _ in pairs])
        low = np.concatenate([b.ravel() for _, b in pairs])
        ones = np.ones(side * side, dtype=np.int64)
        places = np.column_stack((x.ravel(), y.ravel())).astype(float)
        pattern, _ = SparsePattern.dissected(high, low, ones, places, lambda order: order)
        sizes.append(side * side)
        entries.append(pattern.fronts.panel[-1])
        operations.append(pattern.fronts.operations)
    assert np.polyfit(np.log(sizes), np.log(entries), 1)[0] < 1.2
    assert np.polyfit(np.log(sizes), np.log(operations), 1)[0] < 1.6


def test_operations_are_those_of_a_dense_factor() -> None:
    """One front of n columns takes n^3 / 6 multiplications, to leading order."""
    n = multifrontal.BLOCK
    matrix = SparseMatrix.of(sp.csc_array(np.eye(12) * 12.0 - np.ones((12, 12)) / 2.0))
    assert len(matrix.pattern.fronts.children) == 1
    assert matrix.pattern.fronts.operations == pytest.approx(12**3 / 6)
    assert n > 12
