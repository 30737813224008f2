"""What the case `two_models` asks both models of Chapter 6."""

from __future__ import annotations

import numpy as np
import pytest

from bh.applications.inverse.models import model
from verification.studies.ch6.two_models import _least_apart
from verification.studies.ch6.two_models_maps import segments
from verification.studies.ch6.two_models_targets import CONVERGING, SOURCE, off_plane, without


def test_distances_from_planes_and_between_points() -> None:
    corners = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]])
    assert off_plane(corners) == pytest.approx(0.0, abs=1e-12)
    bent = corners + np.array([[0.0, 0.0, 0.1], [0.0] * 3, [0.0, 0.0, 0.1], [0.0] * 3])
    assert off_plane(bent) == pytest.approx(0.05)
    assert _least_apart(np.vstack((corners, [[0.0, 0.25, 1.0]]))) == pytest.approx(0.25)


def test_a_target_off_the_plane_needs_a_pinch_by_the_source_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """By its closed form folded creases are plane; sheets have ends that bow."""
    monkeypatch.setattr("verification.studies.ch6.two_models_targets.MOST", 3)
    target = (-20.0, 100.0, -5.0)
    assert without(SOURCE, target) is None
    design = without(CONVERGING, target)
    assert design is not None
    assert not design.pinched.any()
    end = model().forward(design.k0, design.length, design.pinched)[0][-1]
    assert np.linalg.norm(end - np.array(target)) < 1.0


def test_maps_are_of_the_domain_and_symmetric() -> None:
    maps = segments(model())
    assert np.isfinite(maps.pinched[maps.inside]).all()
    assert np.isnan(maps.pinched[~maps.inside]).all()
    np.testing.assert_allclose(maps.pinched[..., 2], maps.pinched[::-1, :, 2], atol=1e-9)
    np.testing.assert_allclose(maps.pinched[..., 1], -maps.pinched[::-1, :, 1], atol=1e-9)
