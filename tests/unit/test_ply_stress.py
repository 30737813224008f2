"""Stresses of plies: closed forms of lamination theory, both formulations, strengths, files, runs, bad input."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh import Expand, Model, ModelError, Sheet
from bh.analysis.yielding import yielding
from bh.commands.run import solve
from bh.paths.export import cell_data
from bh.plotting.colouring import colouring_of
from bh.scene.load import parse_scene
from bh.studio.colours import offered

NAMES = ("consistent", "shell")
KINDS: dict[str, Any] = {"consistent": "staggered", "shell": "mirrored"}
E1, E2, NU, G, A1, A2 = 130000.0, 9000.0, 0.3, 5000.0, -1e-7, 3e-5
X, Y, S = 1500.0, 40.0, 68.0
T = 0.125


def ply(degrees: float, t: float = T) -> Sheet:
    return Sheet.orthotropic(
        E1=E1, E2=E2, G12=G, nu12=NU, grain=f"{degrees}deg", t=t, expansion=[A1, A2],
        strength=X, strength2=Y, shear_strength=S,
    )  # fmt: skip


def moduli() -> tuple[float, float, float]:
    scale = 1.0 - NU**2 * E2 / E1
    return E1 / scale, E2 / scale, NU * E2 / scale


def square(name: str, cells: int = 4) -> meshes.SheetMesh:
    return meshes.structured(meshes.strip(10.0, 10.0), along=cells, rows=cells, kind=KINDS[name])


def heated(name: str, sheet: Sheet, change: float) -> bh.Stress:
    return bh.trace(Model(square(name), sheet, formulation=name).step(Expand(change=change)))[-1].stress()


@pytest.mark.parametrize("name", NAMES)
def test_cooled_symmetric_cross_ply(name: str) -> None:
    """[0/90/90/0]: all plies strain by e = ((Q11 + Q12) a1 + (Q22 + Q12) a2) / (Q11 + 2 Q12 + Q22) in any direction.

    What they carry along the fibres they carry across them with the other sign (Jones 1999, 4.5).
    """
    Q11, Q22, Q12 = moduli()
    change = -120.0
    e = change * ((Q11 + Q12) * A1 + (Q22 + Q12) * A2) / (Q11 + 2.0 * Q12 + Q22)
    along = Q11 * (e - A1 * change) + Q12 * (e - A2 * change)
    across = Q22 * (e - A2 * change) + Q12 * (e - A1 * change)
    assert across == pytest.approx(-along)
    assert across > 25.0  # MPa: what cracks such plates
    stress = heated(name, bh.laminate([ply(0), ply(90), ply(90), ply(0)]), change)
    assert stress.plies == 4
    used = np.sqrt((along / X) ** 2 - along * across / X**2 + (across / Y) ** 2)
    for number in range(4):
        one = stress.ply(number)
        for side in ("bottom", "middle", "top"):
            np.testing.assert_allclose(one.strain_at(side)[:, :2], e, rtol=2e-4)
            np.testing.assert_allclose(
                one.along_fibres(side), [[along, across, 0.0]] * len(one.of), atol=2e-3 * across
            )
            np.testing.assert_allclose(one.utilisation(side), used, rtol=1e-3)
            np.testing.assert_allclose(one.utilisation(side, "largest"), across / Y, rtol=1e-3)
            np.testing.assert_allclose(one.reserve(side), 1.0 / used, rtol=1e-3)
    np.testing.assert_allclose(stress.ply(1).at()[:, 0], across, rtol=1e-3)  # fibres along y
    np.testing.assert_allclose(stress.corners.ply(1).at()[..., 0], across, rtol=1e-3)


@pytest.mark.parametrize("name", NAMES)
def test_heated_bimetal(name: str) -> None:
    """Two metals of one nu: E / (1 - nu) (e - z k - a change), e and k such that nothing pulls and nothing turns."""
    metals = [(200000.0, 0.1, 1.2e-5), (100000.0, 0.2, 1.9e-5)]
    change, nu = 1.0, 0.3
    z = np.array([-0.15, -0.05, 0.15])
    rows, right = np.zeros((2, 2)), np.zeros(2)
    for (E, _, a), low, high in zip(metals, z[:-1], z[1:], strict=True):
        one, two, three = (E / (1.0 - nu) * (high**n - low**n) / n for n in (1, 2, 3))
        rows += [[one, -two], [-two, three]]
        right += [one * a * change, -two * a * change]
    e, k = np.linalg.solve(rows, right)
    sheet = bh.laminate([Sheet(E=E, nu=nu, t=t, expansion=a, strength=100.0) for E, t, a in metals])
    stress = heated(name, sheet, change)
    for number, (E, _, a) in enumerate(metals):
        for side, height in (("bottom", z[number]), ("top", z[number + 1])):
            exact = E / (1.0 - nu) * (e - height * k - a * change)
            np.testing.assert_allclose(stress.ply(number).at(side)[:, :2], exact, rtol=5e-3, atol=1e-3)
            np.testing.assert_allclose(
                stress.ply(number).utilisation(side, "largest"), abs(exact) / 100.0, rtol=5e-3, atol=1e-5
            )
    assert stress.worst().side == "top of ply 1"


@pytest.mark.parametrize("name", NAMES)
def test_pulled_at_an_angle(name: str) -> None:
    """[45/-45/-45/45] pulled along x: s12 of every ply is half of the pull (the shear test of ASTM D 3518)."""
    sheet = bh.laminate([ply(45), ply(-45), ply(-45), ply(45)])
    model = Model(square(name, 6), sheet, formulation=name).support("edge:start", "x")
    model = model.support("corner:inner-start", "yz").support("corner:outer-start", "z")
    model = model.support("corner:inner-end", "z")
    state = bh.trace(model.displace("edge:end", "x", by=1e-4))[-1]
    stress, pull = state.stress(), abs(state.reaction("edge:end")[0]) / (10.0 * 4 * T)
    for number, sign in enumerate((-1.0, 1.0, 1.0, -1.0)):
        found = stress.ply(number).along_fibres("middle")[:, 2]
        np.testing.assert_allclose(found, sign * 0.5 * pull, rtol=2e-3)


def test_one_sheet_is_one_ply() -> None:
    """Of a sheet of one material the only ply has the stress that the sheet tells."""
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.6), along=12, rows=2)
    sheet = Sheet(E=4000.0, nu=0.3, t=0.3, strength=20.0, expansion=1e-4)
    state = bh.trace(Model(mesh, sheet).step(bh.Fold("crease", by=0.7), Expand(change=5.0)))[-1]
    stress = state.stress()
    for side in ("bottom", "middle", "top"):
        np.testing.assert_allclose(stress.ply(0).at(side), stress.at(side), atol=1e-9)
        np.testing.assert_allclose(stress.ply(0).strain_at(side), stress.strain_at(side), atol=1e-15)
        np.testing.assert_allclose(stress.ply(0).utilisation(side), stress.utilisation(side), rtol=1e-9)
    assert stress.worst().side in ("top", "bottom")


def test_both_formulations() -> None:
    """A folded and heated sector of an unsymmetric laminate: root mean square of every ply's part of its strength."""
    found = []
    sheet = bh.laminate([ply(10, 0.05), ply(-60, 0.05)])
    for name, along, rows in (("consistent", 32, 5), ("shell", 12, 2)):
        mesh = meshes.structured(
            meshes.annulus_sector(100.0, 10.0, 0.6), along=along, rows=rows, kind=KINDS[name]
        )
        model = Model(mesh, sheet, formulation=name).step(bh.Fold("crease", by=0.8), Expand(change=-40.0))
        stress = bh.trace(model)[-1].stress()
        middle = mesh.points[mesh.triangles].mean(axis=1)
        weight = mesh.areas * (np.abs(np.arctan2(middle[:, 1], middle[:, 0]) - 0.3) < 0.2)
        plies = [stress.ply(number) for number in (0, 1)]
        used = [one.utilisation(side) for one in plies for side in ("bottom", "top")]
        found.append([float(np.sqrt(weight @ each**2 / weight.sum())) for each in used])
    np.testing.assert_allclose(found[0], found[1], rtol=0.02)


SCENE = """
[pattern]
kind = "strip"
length = 20.0
width = 20.0
[mesh]
along = 4
rows = 4
[sheet]
plies = [{0}, {90}, {90}, {0}]
[[steps]]
expand = { change = -200 }
"""


def test_runs_files_and_pictures_tell_it(tmp_path: Path) -> None:
    """`bh run` says in which ply and when; VTU files have every ply; the picture has the worst of all."""
    text = SCENE
    for angle in ("0", "90"):
        made = f'{{ E1 = "130GPa", E2 = "9GPa", G12 = "5GPa", nu12 = 0.3, grain = "{angle}deg", t = 0.125, '
        made += "expansion = [-1e-7, 3e-5], strength = 1500, strength2 = 40, shear_strength = 68 }"
        text = text.replace(f"{{{angle}}}", made)
    solved = solve(parse_scene(text), tmp_path / "out", estimate=False)
    told = json.loads((tmp_path / "out" / "result.json").read_text())["yield"]
    assert told["found"] is True
    assert "of ply" in told["first"]["side"]
    assert "of ply" in str(yielding(solved.path))
    last = solved.path[-1]
    cells = cell_data(last)
    one = last.stress().ply(0)
    np.testing.assert_array_equal(cells["ply1_stress_top"], one.along_fibres("top"))
    assert "ply4_stress_bottom" in cells
    np.testing.assert_allclose(cells["reserve"], 1.0 / last.stress().largest())
    colours = colouring_of(last, "utilisation", None)
    assert colours is not None
    assert colours.top == pytest.approx(told["largest"]["utilisation"], rel=1e-6)
    assert "utilisation" in offered(last)


def test_zones_have_plies_of_their_own() -> None:
    """A part without a second ply has no stress there, and its own in the first."""
    sheet = bh.laminate([ply(0), ply(90)])
    model = Model(square("consistent"), sheet).zone(
        [[-1.0, -1.0], [5.0, -1.0], [5.0, 11.0], [-1.0, 11.0]],
        Sheet(E=4000.0, nu=0.3, t=0.2, strength=30.0, expansion=1e-4),
    )
    stress = bh.trace(model.step(Expand(change=10.0)))[-1].stress()
    second = stress.ply(1).at()
    left = stress.mesh.points[stress.mesh.triangles, 0].mean(axis=1) < 5.0
    assert np.isnan(second[left]).all()
    assert np.isfinite(second[~left]).all()
    assert np.isfinite(stress.ply(0).at()).all()
    assert np.isfinite(stress.largest()).all()
    assert stress.worst().utilisation > 0.0


def test_bad_input() -> None:
    stress = heated("consistent", bh.laminate([ply(0), ply(90)]), 1.0)
    with pytest.raises(ModelError, match="ply 2 is none of the 2"):
        stress.ply(2)
    with pytest.raises(ModelError, match=r"read stress\.ply\(0\)"):
        stress.at()
    with pytest.raises(ModelError, match="side 'above' is not known"):
        stress.ply(0).at("above")
    with pytest.raises(ModelError, match="criterion 'tsai-wu' is not known"):
        stress.ply(0).utilisation(by="tsai-wu")
    bare = Sheet(E=4000.0, nu=0.3, t=0.2, expansion=1e-4)
    with pytest.raises(ModelError, match="no strength to compare"):
        heated("consistent", bh.laminate([ply(0), bare]), 1.0).worst()
