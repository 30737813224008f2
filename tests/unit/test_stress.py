"""Stresses of states: closed forms, two formulations against each other, panels, yield, and what has none."""

from __future__ import annotations

import numpy as np
import pytest

import bh
import meshes
from bh import Displace, Force, Model, Sheet
from meshes import SheetMesh

NAMES = ("consistent", "shell")
STEEL = Sheet(E=193_000.0, nu=0.3, t=0.1, strength=1010.0)
CARD = Sheet.orthotropic(
    E1=6000, E2=3000, G12=1640, nu12=0.3, grain="30deg", t=0.3, density=800, strength=15, strength2=7.5
)


def strip(length: float, width: float, along: int, rows: int = 2) -> SheetMesh:
    return meshes.structured(meshes.strip(length, width), along=along, rows=rows)


def pulled(sheet: Sheet, name: str, by: float = 0.004) -> bh.State:
    mesh = strip(40.0, 10.0, 16)
    model = Model(mesh, sheet, formulation=name)
    model = model.support("edge:start", "xz").support("corner:inner-start", "y").support("edge:end", "z")
    return bh.trace(model.step(Displace("edge:end", "x", by=by)))[-1]


@pytest.mark.parametrize("name", NAMES)
def test_pulled_plate(name: str) -> None:
    """E times the strain all over, nothing across, and by von Mises the same."""
    stress = pulled(STEEL, name).stress()
    green = 1e-4 + 0.5e-8
    for side in ("top", "middle", "bottom"):
        assert np.allclose(stress.at(side), [STEEL.E * green, 0.0, 0.0], atol=1e-5)
        assert np.allclose(stress.strain_at(side), [green, -0.3 * green, 0.0], atol=1e-9)
        assert np.allclose(stress.principal(side), [STEEL.E * green, 0.0], atol=1e-5)
        assert np.allclose(stress.utilisation(side), STEEL.E * green / 1010.0, rtol=1e-5)
        assert np.allclose(stress.corners.reserve(side), 1010.0 / (STEEL.E * green), rtol=1e-5)


def bent(sheet: Sheet, name: str, along: int = 20, radius: float = 60.0) -> bh.State:
    """A strip whose ends are clamped to a cylinder by turned clamps would be needed; its ends are lifted instead."""
    mesh = strip(40.0, 10.0, along)
    model = Model(mesh, sheet, formulation=name).support("edge:start", "xyz", clamp=True)
    couple = 1.0 / radius
    return bh.trace(model.step(Force("edge:end", total=(0.0, 0.0, couple))))[-1]


@pytest.mark.parametrize("name", NAMES)
def test_bent_strip(name: str) -> None:
    """A clamped strip with a force P at its end: 6 P (l - x) / (b t^2) on either side, from root to end."""
    sheet = Sheet(E=193_000.0, nu=0.0, t=0.2)
    mesh = strip(40.0, 10.0, 20)
    model = Model(mesh, sheet, formulation=name).support("edge:start", "xyz", clamp=True)
    P = 0.01
    stress = bh.trace(model.step(Force("edge:end", total=(0.0, 0.0, P))))[-1].stress()
    x = mesh.points[mesh.triangles, 0]
    exact = 6.0 * P * (40.0 - x) / (10.0 * 0.04)
    root = exact.max()
    assert np.abs(stress.corners.at("bottom")[..., 0] - exact).max() < 0.015 * root
    assert np.abs(stress.corners.at("top")[..., 0] + exact).max() < 0.015 * root
    assert np.abs(stress.at("middle")).max() < 1e-2 * root
    # bent up: the side that was above is pressed
    assert stress.at("top")[:, 0].min() < -0.9 * root
