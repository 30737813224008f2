"""The linear plate: Timoshenko and Woinowsky-Krieger's square plates with rates, and the shell at small load."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import skfem

from bh.loading.builder import load_steps
from bh.model.model import Model
from bh.model.sheet import Sheet
from bh.solvers.linear import linear_response
from bh.testing import assert_values_converge
from fem.kirchhoff_love import Shell
from fem.plate import Deflection, Plate, hhj, morley
from meshes import SheetMesh
from verification.theory.shell_benchmarks import rectangle

# deflection of the middle of a unit square under unit pressure over a^4 / D, and under a unit force over a^2 / D:
# Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells, tables 8, 35 and 23, 37
# (more digits: Taylor and Govindjee 2004)
PRESSURE = {True: 1.26532e-3, False: 4.06235e-3}
FORCE = {True: 5.6120e-3, False: 1.16008e-2}


def square(cells: int) -> skfem.MeshTri:
    x = np.linspace(-0.5, 0.5, cells + 1)
    return skfem.MeshTri.init_tensor(x, x)


def middle(mesh: skfem.MeshTri, deflection: Deflection) -> float:
    return float(deflection.w[np.argmin((mesh.p**2).sum(axis=0))])


@pytest.mark.parametrize("clamped", [True, False])
@pytest.mark.parametrize(
    ("element", "rate", "error"), [(morley, 1.8, 0.1), (hhj, 3.5, 2e-4)], ids=["morley", "hhj"]
)
def test_square_under_pressure(
    element: Callable[..., Deflection], rate: float, error: float, clamped: bool
) -> None:
    found = []
    for cells in (4, 8, 16):
        mesh = square(cells)
        w = middle(mesh, element(mesh, Plate(D=2.0, nu=0.3, clamped=clamped, pressure=3.0)))
        found.append(2.0 * w / 3.0)
    assert_values_converge(
        found, (1 / 4, 1 / 8, 1 / 16), expected=PRESSURE[clamped], order=rate, within=error
    )


@pytest.mark.parametrize("clamped", [True, False])
def test_square_under_a_force(clamped: bool) -> None:
    """The curvature is singular under the force: second order is the most there is."""
    found = []
    for cells in (8, 16, 32):
        mesh = square(cells)
        found.append(middle(mesh, hhj(mesh, Plate(D=1.0, nu=0.3, clamped=clamped, force=1.0))))
    sizes = (1 / 8, 1 / 16, 1 / 32)
    assert_values_converge(found, sizes, expected=FORCE[clamped], order=1.8, within=2.5e-3)


def test_energy_is_half_the_work_of_the_load() -> None:
    mesh = square(8)
    for element in (morley, hhj):
        solved = element(mesh, Plate(D=1.0, nu=0.3, clamped=True, force=2.0))
        assert solved.energy == pytest.approx(0.5 * 2.0 * middle(mesh, solved), rel=1e-12)


def triangles_of(sheet: SheetMesh) -> skfem.MeshTri:
    return skfem.MeshTri(np.ascontiguousarray(sheet.points[:, :2].T), np.ascontiguousarray(sheet.triangles.T))


@pytest.mark.parametrize("clamped", [True, False])
def test_the_shell_at_small_load_is_the_plate(clamped: bool) -> None:
    """Its linear response to a force is that of the HHJ plate on the same mesh: hybridised or not is the same."""
    sheet = Sheet(E=12.0 * (1.0 - 0.09) / 0.1**3, nu=0.3, t=0.1)  # D = 1
    mesh = rectangle(1.0, 1.0, 6, 6)
    edges = ("edge:start", "edge:end", "edge:rail-0", "edge:rail-6")
    centre = int(np.argmin(((mesh.points[:, :2] - 0.5) ** 2).sum(axis=1)))
    model = Model(mesh, sheet, formulation="shell").support("all", "xy")
    for edge in edges:
        model = model.support(edge, "z", clamp=clamped)
    model = model.force([centre], each=(0.0, 0.0, 1e-3))
    system = Shell().system(model, load_steps(model)[0], None)
    response = linear_response(system, system.start())
    w = system.positions(response.dq, 1.0)[:, 2]
    plate = hhj(triangles_of(mesh), Plate(D=1.0, nu=0.3, clamped=clamped, force=1e-3, at=(0.5, 0.5)))
    np.testing.assert_allclose(w, plate.w, atol=1e-9 * np.abs(plate.w).max())
    assert response.energy == pytest.approx(-plate.energy, rel=1e-9)
