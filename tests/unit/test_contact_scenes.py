"""The key `contact` of scenes, what results say of it, and ways on which nothing passes through anything."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import bh
import meshes
from bh.commands.cli import main
from bh.commands.result import result
from bh.errors import SceneError
from bh.mechanics.contact.barrier import SheetBarrier
from bh.model.serialise import describe
from bh.scene.json_schema import schema
from bh.scene.load import load_scene, parse_scene

SCENE = """
[pattern]
kind = "strip"
length = 10.0
width = 60.0
creases = [20.0, 40.0]
[sheet]
E = 4000.0
t = 0.127
[mesh]
along = 3
rows = 2
[[steps]]
fold = { crease = "all", by = 1.0 }
"""


def stacked(distance: float) -> tuple[meshes.SheetMesh, np.ndarray]:
    """Two triangles, one above the other."""
    flat = [[0, 0, 0], [10, 0, 0], [0, 10, 0], [21, 1, 0], [31, 2, 0], [22, 11, 0]]
    mesh = meshes.SheetMesh(np.array(flat, float), np.array([[0, 1, 2], [3, 4, 5]]))
    x = mesh.points.copy()
    x[3:] += [-20.0, 0.0, distance]
    return mesh, x


@pytest.mark.parametrize(
    ("value", "model"),
    [('"thickness"', "thickness"), ('"auto"', "auto"), ("0.1", 0.1), ('"0.2 mm"', 0.2), ("false", False)],
)
def test_values_of_the_key(value: str, model: object) -> None:
    assert parse_scene(f"contact = {value}\n{SCENE}").model.contact == model


@pytest.mark.parametrize("value", ["true", "-1.0", "0", '"yes"', "[1.0]"])
def test_values_that_cannot_be_say_what_can(value: str) -> None:
    with pytest.raises(
        SceneError, match=r'contact = .* cannot be; give "thickness", "auto", false, or a gap'
    ):
        parse_scene(f"contact = {value}\n{SCENE}")


def test_a_run_sets_it(tmp_path: object) -> None:
    file = tmp_path / "scene.toml"  # type: ignore[operator]
    file.write_text(SCENE)
    assert load_scene(file).model.contact == "auto"
    assert load_scene(file, ["contact=false"]).model.contact is False
    assert load_scene(file, ["contact=0.3"]).model.contact == 0.3
    assert load_scene(file, ["contact=thickness"]).model.contact == "thickness"
    assert "contact" in schema()["properties"]  # type: ignore[operator]


def test_auto_describes_the_same_model_as_none_until_panels_meet() -> None:
    plain, auto, default = (
        parse_scene(f"{line}\n{SCENE}").model for line in ("contact = false", 'contact = "auto"', "")
    )
    assert describe(plain)[0] == describe(auto)[0]
    assert default.contact == auto.contact == bh.Model(auto.mesh, auto.sheet).contact


def test_energy_of_contact_stands_beside_the_others() -> None:
    scene = parse_scene(f"contact = 0.1\n{SCENE}")
    path = bh.trace(scene.model)
    found = result(path, scene, None)
    assert found["contact_energy"] == 0.0
    assert "contact" not in found["energy"]  # type: ignore[operator]


def test_forces_of_every_pair_are_in_balance_and_sum_to_the_gradient() -> None:
    mesh, x = stacked(0.05)
    x[3:, 2] += [0.0, 0.01, 0.02]
    barrier = SheetBarrier(mesh, 0.0, 0.1, 2.0)
    pairs = barrier.pair_forces(x)
    total, gradient = np.zeros_like(x), np.zeros_like(x)
    barrier.forces(x, gradient)
    size = np.abs(gradient).max()
    assert len(pairs) > 1
    for nodes, forces in pairs:
        assert np.abs(forces.sum(axis=0)).max() < 1e-12 * size
        assert np.abs(np.cross(x[nodes], forces).sum(axis=0)).max() < 1e-11 * size
        np.add.at(total, nodes, forces)
    assert -total == pytest.approx(gradient, rel=1e-9, abs=1e-12 * size)


def test_states_are_linked_by_motions_not_by_straight_ways() -> None:
    """Round the edge of the lower triangle and back below it: the straight way is blocked, the motion is known."""
    mesh, x = stacked(1.0)
    barrier = SheetBarrier(mesh, 0.0, 0.1, 2.0)
    assert barrier.begin(x)
    top = np.arange(6) > 2
    below = x - 2.0 * np.array([0.0, 0.0, 1.0]) * top[:, None]
    assert barrier.passed(x, below)
    stops = ([6, 6, 0], [12, 12, 0], [12, 12, -2], [6, 6, -2])
    for y in (*(x + np.array(stop) * top[:, None] for stop in stops), below):
        barrier.forces(y, np.zeros_like(y))
    assert not barrier.passed(x, below)


def test_ways_end_where_pairs_begin_to_press() -> None:
    mesh, x = stacked(3.0)
    barrier = SheetBarrier(mesh, 0.0, 0.1, 2.0)
    down = x - 6.0 * np.array([0.0, 0.0, 1.0]) * (np.arange(6) > 2)[:, None]
    part = barrier.approach(x, down)
    assert 0.05 <= 3.0 - 6.0 * part <= 0.095
    assert not barrier.presses(x)
    assert barrier.presses(x + part * (down - x))


def test_pairs_that_are_kept_are_those_that_are_found_anew() -> None:
    mesh, x = stacked(2.0)
    kept = SheetBarrier(mesh, 0.0, 0.1, 2.0)
    kept.forces(x, np.zeros_like(x))
    x[3:, 2] -= 1.92  # farther than pairs are kept for
    rng = np.random.default_rng(2)
    for _ in range(5):
        x = x + 0.02 * rng.uniform(-1.0, 0.5, x.shape) * (np.arange(6) > 2)[:, None]
        anew = SheetBarrier(mesh, 0.0, 0.1, 2.0)
        assert anew.forces(x, np.zeros_like(x)) > 0.0
        assert kept.forces(x, np.zeros_like(x)) == pytest.approx(anew.forces(x, np.zeros_like(x)), rel=1e-12)


def letter(contact: object, by: float) -> bh.Model:
    """Three panels whose outer ones meet beyond 120 degrees."""
    mesh = meshes.structured(meshes.strip(10.0, 60.0, creases=[20.0, 40.0]), along=3, rows=2)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.5), contact=contact)  # type: ignore[arg-type]
    return model.step(*(bh.Fold(crease, by=by, Lstar=5.0) for crease in mesh.creases))


def test_auto_is_the_path_without_contact_where_nothing_meets() -> None:
    free, auto = (bh.trace(letter(contact, 1.0)) for contact in (False, "auto"))
    assert np.array_equal(free[-1].points, auto[-1].points)
    assert auto.iterations == free.iterations
    assert not auto.model.stops_itself


def test_auto_goes_on_with_contact_from_the_last_clear_state(tmp_path: object) -> None:
    file = tmp_path / "path.bh"  # type: ignore[operator]
    path = bh.trace(letter("auto", 2.4), file=file)
    assert path.outcome == "reached"
    assert path.model.contact == "thickness"
    assert bh.contact.first_contact(path) is None
    said = [line for line in path.remarks if "panels met without contact" in line]
    assert len(said) == 1
    assert "solved again from lambda" in said[0]
    stored = bh.Path.load(file)
    assert stored.remarks == path.remarks
    assert len(stored) == len(path)
    again = bh.trace(letter("auto", 2.4), file=file, resume=True)
    assert np.array_equal(again[-1].points, path[-1].points)
    later = letter("auto", 2.4).step(*(bh.Fold(crease, by=-0.1) for crease in path.model.mesh.creases))
    longer = bh.trace(later, after=path)
    assert longer.outcome == "reached"
    assert longer.model.contact == "thickness"
    assert len(longer) > len(path)


def test_auto_goes_on_from_the_mesh_that_an_accuracy_has_chosen(tmp_path: Path) -> None:
    file = tmp_path / "path.bh"
    path = bh.trace(letter("auto", 2.4), accuracy=0.5, file=file)
    assert path.model.contact == "thickness"
    assert bh.contact.first_contact(path) is None
    assert path.accuracy is not None
    assert "the estimate is that of the path without contact" in path.remarks
    assert bh.Path.load(file).remarks == path.remarks


def test_what_cannot_be_prevented_is_told(tmp_path: Path) -> None:
    """Layers that are thicker than a triangle is high; the path is the one without contact."""
    file = tmp_path / "path.bh"
    thick = dataclasses.replace(letter("auto", 2.4), sheet=bh.Sheet(E=4000.0, t=5.0))
    path = bh.trace(thick, file=file)
    assert path.outcome == "reached"
    assert bh.contact.first_contact(path) is not None
    said = [line for line in path.remarks if "not prevented: contact = thickness: layers" in line]
    assert len(said) == 1
    assert bh.Path.load(file).remarks == path.remarks
    again = bh.trace(thick, file=file, resume=True)
    assert [line for line in again.remarks if "not prevented" in line] == said


def test_a_run_that_met_itself_goes_on_with_later_steps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    text = SCENE.replace("by = 1.0", "by = 2.4, Lstar = 5.0").replace("t = 0.127", "t = 0.5")
    Path("letter.toml").write_text(text)
    assert main(["run", "letter.toml"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "panels met without contact" in said
    assert said.index("panels met") < said.index("point passed at")
    assert "self-contact: none" in said
    assert main(["run", "letter.toml", "--resume"]) == 0  # it is whole
    Path("letter.toml").write_text(f'{text}[[steps]]\nfold = {{ crease = "all", by = 2.3, Lstar = 5.0 }}\n')
    assert main(["run", "letter.toml", "--resume"]) == 0
    path = bh.Path.load("letter-out/path.bh")
    assert path.outcome == "reached"
    assert len(path.steps) == 2
    assert path.model.contact == "thickness"
