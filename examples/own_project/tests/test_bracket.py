"""What must hold of the bracket whenever its drawing, its card or the solver changes."""

import pytest
from bracket import bracket

from bh.testing import assert_energy_converges, assert_reached, assert_same_shape, assert_stable


@pytest.mark.levels(2, 4, 8)
def test_energy_has_converged():
    """To 10 % at least, at first order at least, and to what it was when this was written."""
    assert_energy_converges(bracket, order=1.0, within=0.1, frozen=0.13781, frozen_within=1e-3)


def test_it_stays_folded():
    path = assert_reached(bracket(4))
    assert_stable(path)


def test_the_shell_says_the_same_shape():
    assert_same_shape(bracket(4), bracket(4, "shell"), within=0.1)  # mm
