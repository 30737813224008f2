"""Calibration: true values in their intervals, what data do not tell, a crease from a noisy curve, bad input."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

import bh
import meshes
from bh import Displace, Model, ModelError, Sheet
from bh.applications.calibration import Calibration, Measured, calibrate, fit

Array = NDArray[np.float64]
ANGLES = np.linspace(0.2, 1.5, 12)
FREE = {"stiffness": (1.0, 0.01, 10.0), "rest": (0.5, 0.0, 1.0)}
TRUE = np.array([0.37, 0.21])


def spring(values: Array) -> Array:
    """Moments of a crease at the angles."""
    return np.asarray(values[0] * np.sin(ANGLES - values[1]))


@pytest.mark.parametrize("known", [True, False])
def test_true_values_lie_in_their_intervals(known: bool) -> None:
    """Of 100 noisy repeats about 95 in 100, whether the noise is known or read from the residuals."""
    rng = np.random.default_rng(3)
    inside = np.zeros(2)
    for _ in range(100):
        measured = spring(TRUE) + 0.004 * rng.normal(size=len(ANGLES))
        found = fit(spring, measured, np.full(len(ANGLES), 0.004) if known else None, FREE)
        inside += (found.intervals[:, 0] <= TRUE) & (found.intervals[:, 1] >= TRUE)
    assert (inside >= 0.90 * 100).all()
    assert (inside <= 1.0 * 100).all()


def test_exact_data_give_exact_values_and_the_covariance_of_the_line() -> None:
    """Without noise the truth; errors are those of linear least squares by hand."""
    sigma = np.full(len(ANGLES), 0.01)
    found = fit(spring, spring(TRUE), sigma, FREE)
    assert np.allclose(found.values, TRUE, rtol=1e-7)
    J = np.column_stack((np.sin(ANGLES - TRUE[1]), -TRUE[0] * np.cos(ANGLES - TRUE[1])))
    assert np.allclose(found.covariance, 1e-4 * np.linalg.inv(J.T @ J), rtol=1e-4)
    assert np.allclose(found.errors, np.sqrt(np.diag(found.covariance)))
    assert found.unknown == ()


def test_what_the_data_do_not_tell_is_named() -> None:
    """Of E t^3 and a rest angle the product is known, E and t are not: E grows as t^-3 falls."""

    def bent(values: Array) -> Array:
        return np.asarray(values[0] * values[1] ** 3 * np.sin(ANGLES - values[2]))

    free = {"E": (2.0, 0.1, 10.0), "t": (1.0, 0.1, 10.0), "rest": (0.2, 0.0, 1.0)}
    found = fit(bent, bent(np.array([2.1, 1.02, 0.25])), np.full(len(ANGLES), 0.01), free)
    assert np.isinf(found.errors[:2]).all()
    assert found.errors[2] < 0.05
    assert found.unknown == ("E^0.95 t^-0.32 at all",)
    assert "not told by the data: E^0.95 t^-0.32 at all" in str(found)
    assert found.values[0] * found.values[1] ** 3 == pytest.approx(2.1 * 1.02**3, rel=1e-6)


def opened(formulation: str, Lstar: float, along: int = 6, rows: int = 2) -> Model:
    """A curved crease that is lifted in three steps while the edges stay in the plane."""
    pattern = meshes.annulus_sector(radius=60.0, width=12.0, angle=0.8)
    mesh = meshes.structured(pattern, along=along, rows=rows)
    model = Model(mesh, Sheet(E=4000.0, nu=0.38, t=0.2), formulation=formulation)
    model = model.crease("crease", Lstar=Lstar).support("corner:inner-start", "xyz")
    model = model.support("corner:outer-start", "yz").support("edge:inner", "z").support("edge:outer", "z")
    for lift in (0.8, 1.6, 2.4):
        model = model.step(Displace("crease:crease", "z", by=lift))
    return model


def curve(model: Model) -> Array:
    ends = {state.step: state for state in bh.trace(model, estimate=False).require()}
    return np.array([ends[k].reaction("crease:crease")[2] for k in sorted(ends)])


def test_a_crease_from_a_noisy_curve() -> None:
    """L* = 20 mm comes back from forces with 1 % of noise, within its interval."""
    truth = curve(opened("consistent", 20.0))
    noise = 0.01 * truth.max()
    measured = truth + noise * np.random.default_rng(5).normal(size=3)
    data = Measured("reaction_z", measured.tolist(), of="crease:crease", sigma=noise)
    found: Calibration = calibrate(
        opened("consistent", 50.0), data, {"creases.crease.Lstar": (50.0, 2.0, 200.0)}
    )
    low, high = found.intervals[0]
    assert low <= 20.0 <= high
    assert high - low < 3.0
    assert found.model is not None
    assert found.model.creases["crease"].Lstar == found.values[0]
    assert np.allclose(curve(found.model) - measured, found.residuals, atol=1e-6)


def test_bad_input() -> None:
    """One line each, before anything is solved."""
    model = opened("consistent", 20.0)
    data = Measured("reaction_z", [1.0, 2.0, 3.0], of="crease:crease")
    with pytest.raises(ModelError, match="3 parameters cannot be found from 3 values of unknown noise"):
        calibrate(model, data, {f"sheet.{k}": (0.2, 0.1, 0.4) for k in ("E", "t", "nu")})
    with pytest.raises(ModelError, match=r"free 'creases\.fold\.Lstar' is no value of the model"):
        calibrate(model, data, {"creases.fold.Lstar": (1.0, 0.5, 2.0)})
    with pytest.raises(ModelError, match="no value of the model"):
        calibrate(model, data, {"sheet.G12": (1.0, 0.5, 2.0)})
    with pytest.raises(ModelError, match="begin between them"):
        calibrate(model, data, {"sheet.E": (1.0, 2.0, 3.0)})
    with pytest.raises(ModelError, match="2 values of moment are no match for 3 steps"):
        calibrate(model, Measured("moment", [1.0, 2.0], of="crease"), {"sheet.E": (1.0, 0.5, 3.0)})
    with pytest.raises(ModelError, match="data of step 7"):
        calibrate(model, Measured("moment", [1.0], "crease", [7]), {"sheet.E": (1.0, 0.5, 3.0)})
    with pytest.raises(ModelError, match="give each a sigma"):
        calibrate(model, [data, data], {"sheet.E": (1.0, 0.5, 3.0)})
    with pytest.raises(ModelError, match="observable 'force' is not known"):
        Measured("force", [1.0])
    with pytest.raises(ModelError, match="finite numbers"):
        Measured("moment", [math.nan])
    with pytest.raises(ModelError, match="sigma = 0"):
        Measured("moment", [1.0], sigma=0.0)
