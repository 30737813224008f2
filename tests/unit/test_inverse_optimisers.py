"""The genetic algorithm leaves out the candidates that pymoo itself leaves out."""

from __future__ import annotations

import numpy as np
import pytest

from bh.applications.inverse import optimisers


@pytest.mark.parametrize("seed", range(5))
def test_equal_candidates_are_those_of_pymoo(seed: int) -> None:
    mixed = pytest.importorskip("pymoo.core.mixed")
    from pymoo.core.population import Population

    random = np.random.default_rng(seed)

    def some(count: int) -> Population:
        """Candidates of which many are equal; their variables stand in two orders, as pymoo leaves them."""
        rows = [{"x000": float(v), "on000": bool(on)} for v, on in random.integers(0, 2, (count, 2))]
        return Population.new(X=[dict(reversed(row.items())) if i % 2 else row for i, row in enumerate(rows)])

    these, others = some(6), some(2)
    mine, own = optimisers._alike(optimisers._pymoo()), mixed.MixedVariableDuplicateElimination()
    for against in ((), (others,), (others, some(1))):
        left = own.do(these, *against)
        assert [id(each) for each in mine.do(these, *against)] == [id(each) for each in left]
        assert len(left) < len(these)
