"""`bh response`: force against displacement from where the steps of a scene have brought the sheet."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import meshes
from bh import Displace, Model, ModelError, Sheet, Until
from bh.applications.response import Peak, lines, picture, response
from bh.commands.cli import main

STRIP = meshes.structured(meshes.strip(60.0, 10.0, [5.0]), along=6)
SCENE = """
[pattern]
kind = "annulus_sector"
radius = 100.0
width = 10.0
angle = 0.5
[sheet]
E = 4000.0
t = 0.2
[mesh]
along = 4
[model]
formulation = "bars-and-hinges"
{supports}
[[steps]]
fold = {{ crease = "crease", to = 2.4 }}
"""


def arch() -> Model:
    """A strip that is buckled by 1 mm, with its middle free."""
    model = Model(STRIP, Sheet(E=4000.0, t=0.3)).support("edge:start").support("edge:end", "yz")
    middle = "near:30,5"
    model = model.force(middle, each=(0.0, 0.0, 0.05)).displace("edge:end", "x", -1.0)
    return model.force(middle, each=(0.0, 0.0, 0.0))


@pytest.mark.parametrize("formulation", ["consistent", "shell"])
def test_of_a_cantilever(formulation: str) -> None:
    """Its force is its stiffness times the way, which is 3 E I / L^3, and what the supports read."""
    model = Model(STRIP, Sheet(E=4000.0, t=0.3), formulation=formulation).support("edge:start", clamp=True)
    found = response(model.displace("edge:end", "z", 0.0), "edge:end", (0.0, 0.0, 2.0), 0.5, points=4)
    assert found.reached
    assert found.direction == (0.0, 0.0, 1.0)
    first, last = found.points[0], found.points[-1]
    assert first.displacement == 0.0
    assert last.displacement == pytest.approx(0.5)
    assert first.stiffness == pytest.approx(3.0 * 4000.0 * 10.0 * 0.3**3 / 12.0 / 60.0**3, rel=0.1)
    assert last.force == pytest.approx(0.5 * first.stiffness, rel=0.01)
    assert last.force == pytest.approx(found.path[-1].reaction("edge:end")[2], rel=1e-6)
    assert last.energy == pytest.approx(0.5 * last.force * 0.5, rel=0.01)
    assert found.peaks == ()
    assert all(point.stable and point.stable_under_force for point in found.points)


def test_of_an_arch_that_snaps() -> None:
    """Up to its peak it carries a force; behind it only what moves it; stiffnesses are the slopes of the curve."""
    found = response(arch(), "near:30,5", (0.0, 0.0, 1.0), -8.0, points=16)
    assert found.reached
    u, force, stiffness = (
        np.array([getattr(p, key) for p in found.points]) for key in ("displacement", "force", "stiffness")
    )
    assert abs(force[0]) < 1e-8  # the steps before the curve are not in it
    assert u[0] == 0.0
    assert u[-1] == pytest.approx(-8.0)
    (peak,) = found.peaks
    assert (peak.kind, peak.within) == ("minimum", 0.0)
    assert found.critical == (f"bifurcation point at {peak.displacement:.5g} mm",)
    assert peak.force < force.min() + 1e-12
    behind = u < peak.displacement - 0.5
    assert not any(p.stable_under_force for p, at in zip(found.points, behind, strict=True) if at)
    assert all(p.stable for p in found.points)
    slopes = np.diff(force) / np.diff(u)
    means = 0.5 * (stiffness[1:] + stiffness[:-1])
    np.testing.assert_allclose(slopes[behind[:-1]], means[behind[:-1]], rtol=1e-3)
    told = lines(found)
    assert " ".join(told[0].split()) == "u / mm force / N stiffness / N/mm energy / N mm stable under force"
    assert f"minimum of {peak.force:.5g} N at {peak.displacement:.5g} mm" in told
    loose = lines(replace(found, peaks=(Peak("maximum", 1.5, 2.0, 0.0125),)))
    assert "maximum of 2 N (within 0.013 N; more points make it smaller) at 1.5 mm" in loose
    assert len(picture(found).axes[0].lines) > len(found.points)


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "a.toml"
    scene.write_text(SCENE.format(supports=""))
    words = ["response", str(scene), "--at", "corner:outer-end", "--to", "2mm", "--points", "4"]
    held = ["--hold", "node:0", "--hold", "node:1", "--hold", "node:2"]
    files = ["--json", str(tmp_path / "r.json"), "--picture", str(tmp_path / "r.png")]
    assert main([*words, *held, *files]) == 0
    assert "no peak" in capsys.readouterr().out
    data = json.loads((tmp_path / "r.json").read_text())
    assert data["outcome"] == "reached"
    assert data["points"][-1]["displacement"] == pytest.approx(2.0)
    assert data["points"][-1]["force"] > 0.0
    assert (tmp_path / "r.png").stat().st_size > 1000
    for more, says in (
        (["--at", "edge:nowhere", *held], "the sheet has no place 'edge:nowhere'"),
        (["--to", "0", *held], "give a displacement other than zero"),
        (["--axis", "w", *held], "--axis w is no direction"),
        (["--axis", "0,0,0", *held], "not all zero"),
        (["--points", "1", *held], "give 2 or more"),
        (["--hold", "corner:outer-end"], "is fixed and displaced along the same direction"),
        (["--picture", "r.gif", *held], "is no .png, .svg or .pdf"),
        ([], "the supports leave"),
    ):
        assert main([*words, *more]) == 2, more
        error = capsys.readouterr().err.splitlines()[-1]
        assert says in error


def test_what_cannot_be() -> None:
    model = Model(STRIP, Sheet(E=4000.0, t=0.3)).support("edge:start", clamp=True)
    with pytest.raises(ModelError, match="three numbers that are not all zero"):
        response(model.displace("edge:end", "z", 0.0), "edge:end", (0.0, 1.0), 0.5)
    missed = model.displace("edge:end", "z", 0.1)
    missed = missed.step(Displace("edge:end", "z", 0.2), until=Until("energy", 1e3))
    with pytest.raises(ModelError, match="the curve cannot begin: the path ended early, target-missed"):
        response(missed, "edge:end", (0.0, 0.0, 1.0), 0.5)
