"""`bh design`: files that it writes, and one line for what cannot be."""

from __future__ import annotations

import json
import math
import re
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bh.applications.inverse.judge import judge
from bh.applications.inverse.segments import DesignError

pytest.importorskip("xarray")
import bh.commands.design
from bh.applications.inverse.models import model
from bh.applications.inverse.problems import Design
from bh.commands.cli import main
from bh.paths.path import Path as Trace

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "design" / "reach.toml"


def test_example(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Pattern, picture and path of the strip that reaches a point, and what a (here coarse) shell says."""
    folder = tmp_path / "out"
    monkeypatch.setattr(bh.commands.design, "judge", partial(judge, meshes=((10.0, 1), (5.0, 1))))
    assert main(["design", str(EXAMPLE), "--judge", "-o", str(folder)]) == 0
    told = capsys.readouterr().out
    assert "distance of the simulated strip: 0." in told
    assert re.search(r"distance of the strip by the shell: \d+\.\d+ mm", told)
    names = ["design.json", "design.png", "path.bh", "pattern.dxf", "pattern.svg"]
    assert sorted(file.name for file in folder.iterdir()) == names
    about = json.loads((folder / "design.json").read_text())
    assert math.dist(about["end_mm"], (-80.0, 100.0, -5.0)) < 1.0
    measured = {name: row["value"] for name, row in about["measures"].items()}
    assert measured["distance of the simulated strip"] == pytest.approx(
        math.dist(about["end_mm"], (-80.0, 100.0, -5.0))
    )
    assert 0.0 < about["error_bar_mm"] == measured["its error bar"] < 1.0
    assert 0.0 < measured["distance of the strip by the shell"] < 10.0
    assert measured["change of that end with the mesh of the shell"] > 0.0
    assert "95% of strips end in an ellipsoid of semi-axes" in told
    assert len(about["tolerance"]["semi_axes_mm"]) == 3
    assert about["tolerance"]["spreads"]["fold"] == 0.02
    path = Trace.load(folder / "path.bh")
    assert path.outcome == "reached"
    # the outline that is cut is that of the mesh that was simulated
    from meshes.io import read_pattern

    drawn = read_pattern(folder / "pattern.svg")
    size = np.ptp(np.vstack(drawn.rings), axis=0)
    np.testing.assert_allclose(size, np.ptp(path.model.mesh.points[:, :2], axis=0), atol=0.1)


def test_the_sources_model_has_no_limit_in_the_picture() -> None:
    """It is of one mesh."""
    surrogate = model("source")
    design = Design(np.array([0.01]), np.array([60.0]), np.array([False]))
    landing = surrogate.land(*design.lists())
    answer = bh.commands.design.Answer(design, landing, {}, landing.end[None], surrogate)
    labels = {line.get_label() for ax in bh.commands.design.picture(answer).axes for line in ax.lines}
    assert "target" in labels
    assert not any("limit" in str(label) for label in labels)


def test_a_strip_that_meets_itself_is_told(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is taken only where no other was found."""
    command = bh.commands.design
    design = Design(np.array([0.01]), np.array([200.0]), np.array([True]))
    measure = {command.CLEARS: (0.0, command.YES_OR_NO)}
    answer = SimpleNamespace(design=design, measure=measure, tolerance=None, region=None)
    monkeypatch.setattr(command, "solve", lambda file: answer)
    monkeypatch.setattr(command, "write", lambda *_: [])
    assert main(["design", "target.toml"]) == 0
    told = capsys.readouterr().out
    assert "clears itself in space: no" in told
    assert "panels of this strip pass through each other" in told


def test_a_curve_from_points(tmp_path: Path) -> None:
    """A quarter of a circle is one segment."""
    turn = np.linspace(0.0, 0.5 * math.pi, 60)
    rows = [f"{100.0 * math.sin(a)},{100.0 * (1.0 - math.cos(a))}" for a in turn]
    (tmp_path / "quarter.csv").write_text("x,y\n" + "\n".join(rows))
    (tmp_path / "fit.toml").write_text('[target]\ncurve = "quarter.csv"\n[search]\nsegments = 1\n')
    answer = bh.commands.design.solve(tmp_path / "fit.toml")
    assert answer.design.k0[0] == pytest.approx(math.sin(math.pi / 4) / 100.0, rel=1e-3)
    assert answer.measure["mean distance of the simulated strip"][0] < 1.0


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "empty"),
        ("[search]\nsegments = 2", "target is missing"),
        ("[target]", "exactly one"),
        ('[target]\npoint = [1.0, 2.0, 3.0]\ncurve = "spiral"', "exactly one"),
        ("[target]\npoint = [1.0, 2.0]", "target.point"),
        ('[target]\ncurve = "none.csv"', "cannot be read"),
        ("[target]\npoint = [900.0, 0.0, 0.0]\n[search]\nsegments = 2", "no crease of up to 2 segments"),
        ("[target]\npoint = [90.0, 0.0, 0.0]\n[search]\nsegment = 2", "segment"),
        ('[target]\npoint = [90.0, 0.0, 0.0]\n[search]\ndata = "none.nc"', "there is no data set"),
        ("[target]\nmove_tip = true\nup = [0, 0, 1]", "with a point only"),
        ("[target]\npoint = [90.0, 0.0, 0.0]\nup = [0, 0, 1]", "needs a tangent"),
        ("[target]\npoint = [90.0, 0.0, 0.0]\nkeep_out = [[1, 2, 3]]", "target.keep_out"),
        ('[target]\npoint = [90.0, 0.0, 0.0]\n[search]\nangle = "-1deg"', "a positive angle"),
    ],
)
def test_bad_targets(tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, told: str) -> None:
    file = tmp_path / "target.toml"
    file.write_text(text)
    assert main(["design", str(file), "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_curves_begin_at_the_origin(tmp_path: Path) -> None:
    (tmp_path / "off.csv").write_text("10,10\n20,20\n")
    with pytest.raises(DesignError, match="begin at the origin"):
        bh.commands.design.read_curve(tmp_path / "off.csv")
