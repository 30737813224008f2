"""What a user of the library meets: slips are told in one line with the mend, and objects show what they hold."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bh
import meshes
from bh.scene.load import load_scene
from meshes import InputError

SHEET = bh.Sheet(E=4000.0, t=0.127)
PATTERN = meshes.annulus_sector(100.0, 10.0, 0.5)
MESH = meshes.structured(PATTERN, along=4)
EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "appendix_b_a.toml"


@pytest.mark.parametrize(
    ("slip", "told"),
    [
        (lambda: bh.trace(load_scene(EXAMPLE)), "trace takes a model, not a Scene; give scene.model"),  # type: ignore[arg-type]
        (lambda: bh.trace("scene.toml"), "trace takes a model, not a str"),  # type: ignore[arg-type]
        (lambda: bh.Model(PATTERN, SHEET), "mesh of a model is a CreasePattern; give bh.Model(mesh, sheet)"),  # type: ignore[arg-type]
        (lambda: bh.Model(SHEET, MESH), "mesh of a model is a Sheet; give bh.Model(mesh, sheet)"),  # type: ignore[arg-type]
        (lambda: bh.Model(MESH, 0.1), "sheet of a model is a float; give bh.Model(mesh, sheet)"),  # type: ignore[arg-type]
        (lambda: bh.Model(MESH, bh.Sheet), "sheet of a model is the class Sheet; give"),  # type: ignore[arg-type]
        (lambda: bh.Sheet(E=4000.0, t="0.1"), 'sheet: t = "0.1" has no unit: write 0.1mm'),
        (lambda: bh.Sheet(E=4000.0, t=0.1, nu="0.3"), "sheet nu = '0.3' cannot be"),  # type: ignore[arg-type]
        (lambda: meshes.annulus_sector(100, 10, 45), "angles are radians, not degrees"),
        (lambda: meshes.annulus_sector(100, 10, "45"), 'angle = "45" has no unit: write 45deg'),
        (lambda: meshes.annulus_sector("wide", 10, 0.5), 'radius = "wide" is no length: write one such as'),
        (lambda: meshes.strip(None, 10), "length = None is not a number"),  # type: ignore[arg-type]
        (lambda: meshes.structured(MESH, along=3), "a SheetMesh cannot be meshed; give a pattern"),  # type: ignore[arg-type]
    ],
)
def test_slips_are_told_in_one_line(slip: Callable[[], Any], told: str) -> None:
    with pytest.raises(InputError) as caught:
        slip()
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


def test_values_of_a_sheet_are_given_by_name() -> None:
    """`Sheet(4000, 0.38, 0.127)` would read as a thickness of 0.38 mm."""
    with pytest.raises(TypeError):
        bh.Sheet(4000.0, 0.38, 0.127)  # type: ignore[call-arg]
    with pytest.raises(TypeError):
        meshes.structured(PATTERN, 8)  # type: ignore[call-arg]


def test_objects_show_what_they_hold_in_one_line() -> None:
    model = bh.Model(MESH, SHEET).fold("crease", to=3.0)
    assert repr(MESH) == (
        f"SheetMesh({len(MESH.points)} nodes, {len(MESH.triangles)} triangles, 1 crease, staggered, "
        f"aspect ratio {MESH.aspect_ratio:.3g})"
    )
    triangles = f"{len(MESH.triangles)} triangles"
    assert repr(model) == f"Model({triangles}, 1 crease, rigid-body support, 1 step, consistent)"
    assert repr(model.support("node:0")) == f"Model({triangles}, 1 crease, 1 support, 1 step, consistent)"
    path = bh.trace(model)
    assert repr(path) == f"Path(reached, {len(path)} states, {path.iterations} iterations, 1 of 1 step)"
    shown = repr(path[-1])
    assert shown.startswith("State(step 0, lambda 1, energy ")
    assert "N mm" in shown
    assert repr(path[-1].stress()).startswith("Stress(mesh=SheetMesh(")
    assert f"strain=<{len(MESH.triangles)} x 3>" in repr(path[-1].stress())
    for told in (path[-1].stress(), bh.stiffness_probe.Probe(path).modes(1)[0]):
        assert "\n" not in repr(told)
        assert len(repr(told)) < 600
    assert repr(SHEET) == "Sheet(E=4000, t=0.127, nu=0)"
    assert repr(bh.Path(model)) == "Path(unfinished, 0 states, 0 iterations, 0 of 1 step)"


def test_models_and_paths_can_be_pickled() -> None:
    """Other processes get meshes, models, states and paths as they are; frozen ones stay frozen."""
    import pickle

    mesh = meshes.structured(meshes.annulus_sector(50.0, 8.0, 0.7), along=8)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.2)).fold("crease", to=2.4)
    path = bh.trace(model)
    again = pickle.loads(pickle.dumps(path))
    assert repr(again) == repr(path)
    assert np.array_equal(again[-1].points, path[-1].points)
    assert pickle.loads(pickle.dumps(path[-1])).energy == path[-1].energy
    other = pickle.loads(pickle.dumps(model))
    assert bh.trace(other)[-1].energy == path[-1].energy
    assert other.mesh.creases == mesh.creases
    assert other.mesh.aspect_ratio == mesh.aspect_ratio
    with pytest.raises(TypeError):
        other.mesh.corners["corner:inner-start"] = 3
    assert not other.mesh.points.flags.writeable
