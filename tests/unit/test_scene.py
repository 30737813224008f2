"""Scene files that are right: every key ends where it belongs."""

import json
import math
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bh
from bh.errors import SceneError
from bh.loading.builder import load_steps
from bh.model.actuations import Displace, Fold, Force, Moment
from bh.model.crease_law import CreaseLaw
from bh.model.serialise import ACTUATIONS as KINDS
from bh.model.step import Step
from bh.model.supports import RigidBody, Support
from bh.scene.load import Outputs, load_scene, parse_scene
from bh.scene.tables import ACTUATIONS, CreaseTable

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENES = sorted(EXAMPLES.glob("*.toml"))
SHEET = "[sheet]\nE = 4000\nt = 0.1\n"
SECTOR = '[pattern]\nkind = "annulus_sector"\nradius = 100\nwidth = 10\nangle = 0.3\n'
MESH = "[mesh]\nalong = 4\n"
STEP = '[[steps]]\nfold = { crease = "crease", to = 2.5 }\n'


def scene(
    pattern: Any = SECTOR,
    sheet: Any = SHEET,
    mesh: Any = MESH,
    more: Any = "",
    steps: Any = STEP,
    folder: Any = ".",
) -> Any:
    return parse_scene(pattern + sheet + mesh + more + steps, folder)


@pytest.mark.parametrize("file", SCENES, ids=lambda file: file.stem)
def test_every_example_is_a_scene(file: Any) -> None:
    loaded = load_scene(file)
    assert loaded.name == file.stem
    assert loaded.source == file
    assert loaded.model.steps


def test_there_are_the_examples_of_the_issue() -> None:
    names = {file.stem for file in SCENES}
    assert names >= {"appendix_b_a", "appendix_b_d", "free_annulus", "full_annulus", "miura"}


@pytest.mark.parametrize("file", [f for f in SCENES if f.stem != "full_annulus"], ids=lambda file: file.stem)
def test_examples_reach_their_end(file: Any) -> None:
    loaded = load_scene(file)
    path = bh.trace(loaded.model, accuracy=loaded.accuracy)
    assert path.outcome == "reached"
    assert path[-1].energy.total == pytest.approx(energy_in_readme(file), rel=1e-3)


def energy_in_readme(file: Any) -> Any:
    rows = (EXAMPLES / "README.md").read_text(encoding="utf-8").splitlines()
    return next(float(row.split("|")[3]) for row in rows if row.startswith(f"| `{file.name}`"))


@pytest.mark.slow
def test_full_annulus_buckles_out_of_plane() -> None:
    path = bh.trace(load_scene(EXAMPLES / "full_annulus.toml").model)
    assert path.outcome == "reached"
    # a folded crease that stayed round would stay plane; the saddle leaves that plane by centimetres
    crease = path[-1].crease_points("crease")
    offset = np.linalg.svd(crease - crease.mean(axis=0))[1][-1] / math.sqrt(len(crease))
    assert offset > 5.0
    assert path[-1].stable
    assert path[-1].energy.total == pytest.approx(0.857, rel=0.05)  # 128 x 4; the shell, 124 x 4: 0.85
    assert path[-1].energy.total == pytest.approx(energy_in_readme(EXAMPLES / "full_annulus.toml"), rel=1e-3)


def test_miura_example_is_drawn_right() -> None:
    data = json.loads((EXAMPLES / "miura.fold").read_text())
    letters = dict(zip(map(tuple, data["edges_vertices"]), data["edges_assignment"], strict=True))
    for vertex in range(len(data["vertices_coords"])):
        here = [letter for edge, letter in letters.items() if vertex in edge]
        if "B" not in here:  # Maekawa
            assert abs(here.count("M") - here.count("V")) == 2
    path = bh.trace(load_scene(EXAMPLES / "miura.toml").model)
    # all creases go the way that they are drawn, and the facets hardly bend: so the assignment folds as a mechanism
    assert path[-1].fold_angle("mountain").min() > 0.3
    assert path[-1].fold_angle("valley").max() < -0.3
    assert path[-1].energy.bending < 0.05 * path[-1].energy.folding


def test_appendix_b_says_what_the_api_says() -> None:
    from bh.model.serialise import fingerprint
    from meshes import annulus_sector, structured

    mesh = structured(annulus_sector(100.0, 10.0, 0.7853981633974483), along=32, rows=4)
    model = (
        bh.Model(mesh, bh.Sheet(E=4000.0, nu=0.38, t=0.127))
        .support("corner:inner-start", "xyz")
        .support("corner:outer-start", "yz")
        .support("edge:inner", "z")
        .support("edge:outer", "z")
        .fold("crease", to=1.5707963267948966)
    )
    assert fingerprint(load_scene(EXAMPLES / "appendix_b_a.toml").model) == fingerprint(model)


def test_defaults() -> None:
    model = scene().model
    assert model.sheet.nu == 0.0
    assert model.mesh.kind == "staggered"
    assert model.formulation == "consistent"
    assert model.supports == ()
    assert scene().outputs == Outputs()
    assert scene().source is None


def test_whole_numbers_are_numbers() -> None:
    assert scene(sheet="[sheet]\nE = 4000\nnu = 0\nt = 1\n").model.sheet == bh.Sheet(E=4000.0, nu=0.0, t=1.0)


def test_patterns() -> None:
    strip = scene(
        '[pattern]\nkind = "strip"\nlength = 50\nwidth = 20\ncreases = [5, 12.5]\nfold = ["mountain", "valley"]\n',
        steps='[[steps]]\nfold = { crease = "all", by = 0.2 }\n',
    ).model.mesh
    assert strip.creases == ("crease-1", "crease-2")
    assert dict(strip.folds) == {"crease-1": "mountain", "crease-2": "valley"}
    assert np.allclose(np.ptp(strip.points, axis=0), (50.0, 20.0, 0.0))
    sector = scene(
        SECTOR.replace("radius = 100", 'radius = [100, 110]\nfold = "valley"'),
        steps='[[steps]]\nfold = { crease = "all", by = 0.2 }\n',
    )
    assert set(sector.model.mesh.folds.values()) == {"valley"}
    full = scene('[pattern]\nkind = "full_annulus"\nradius = 100\nwidth = 10\n', mesh="[mesh]\nalong = 16\n")
    assert "edge:start" not in full.model.mesh.edge_sets


def test_mesh_by_gmsh(tmp_path: Path) -> None:
    """An unstructured mesh of the library's pattern, solved by the formulation that converges on any mesh."""
    text = """
[pattern]
kind = "annulus_sector"
radius = 100
width = 10
angle = 0.5
[sheet]
E = 4000
nu = 0.3
t = 0.2
[mesh]
kind = "gmsh"
size = 4
[model]
formulation = "consistent"
[[steps]]
fold = { crease = "crease", by = 0.8 }
"""
    file = tmp_path / "scene.toml"
    file.write_text(text)
    model = bh.load_scene(file).model
    assert model.mesh.kind == "gmsh"
    assert 60 < len(model.mesh.triangles) < 300
    assert bh.trace(model).outcome == "reached"


@pytest.mark.parametrize("kind", ["staggered", "alternating", "one-way", "mirrored"])
def test_mesh_kinds_and_density(kind: str) -> None:
    mesh = scene(mesh=f'[mesh]\nkind = "{kind}"\naspect_ratio = 3.0\nrows = 2\n').model.mesh
    assert mesh.kind == kind
    assert mesh.aspect_ratio == pytest.approx(3.0, rel=0.05)


def test_supports() -> None:
    model = scene(
        more="""
        [[supports]]
        at = "corner:inner-start"
        [[supports]]
        at = "edge:outer"
        fix = [0, 0, 2.0]
        [[supports]]
        at = [1, 2]
        fix = [[1, 1, 0], [0, 0, 1]]
        [[supports]]
        at = "rigid-body"
        """
    ).model
    assert model.supports == (
        Support("corner:inner-start", "xyz"),
        Support("edge:outer", ((0.0, 0.0, 1.0),)),
        Support((1, 2), ((1.0, 1.0, 0.0), (0.0, 0.0, 1.0))),
        RigidBody(),
    )


def test_steps_act_together_and_one_after_another() -> None:
    model = scene(
        more="[creases.crease]\nLstar = 25.0\nrest = 3.0\n",
        steps="""
        [[supports]]
        at = "edge:inner"
        fix = "xyz"
        [[steps]]
        moment = { crease = "crease", to = 0.01 }
        force = [{ at = "corner:outer-end", each = [0, 0, 1e-3] }, { at = "edge:outer", total = [0, 1e-4, 0] }]
        [[steps]]
        displace = { at = "node:12", direction = "z", by = 0.1 }
        fold = { crease = "crease", rest = 2.0 }
        [[steps]]
        displace = { at = [12], direction = [0, 0, 0.5], by = 0.2 }
        """,
    ).model
    assert model.creases == {"crease": CreaseLaw(Lstar=25.0, rest=3.0)}
    assert model.steps == (
        Step(
            (
                Moment("crease", 0.01),
                Force("corner:outer-end", each=(0.0, 0.0, 1e-3)),
                Force("edge:outer", total=(0.0, 1e-4, 0.0)),
            )
        ),
        Step((Displace("node:12", "z", 0.1), Fold("crease", rest=2.0))),
        Step((Displace((12,), (0.0, 0.0, 1.0), 0.2),)),
    )


def test_angles_an_edge_and_drawn(tmp_path: Path) -> None:
    listed = scene(steps='[[steps]]\nfold = { crease = "crease", to = [3.0, 2.9, 2.9, 3.0] }\n').model
    assert listed.steps[0].actuations[0] == Fold("crease", to=(3.0, 2.9, 2.9, 3.0))
    sheet = {
        "vertices_coords": [[0, 0], [10, 0], [10, 10], [0, 10]],
        "faces_vertices": [[0, 1, 2], [0, 2, 3]],
        "edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [0, 2]],
        "edges_assignment": ["B", "B", "B", "B", "V"],
        "edges_foldAngle": [0, 0, 0, 0, 45],
    }
    (tmp_path / "drawn.fold").write_text(json.dumps({"file_spec": 1.2, **sheet}))
    drawn = scene(
        '[pattern]\nfile = "drawn.fold"\nframe = 0\n',
        mesh="",
        steps='[[steps]]\nfold = { crease = "all", by = "drawn" }\n',
        folder=tmp_path,
    )
    assert load_steps(drawn.model)[0].prescribed.end.tolist() == pytest.approx([1.25 * math.pi])


def test_outputs() -> None:
    assert scene(more="[outputs]\npictures = true\nvtu = false\nfold = true\n").outputs == Outputs(
        True, False, True
    )


def test_schema_knows_every_key_of_the_actuations() -> None:
    assert list(ACTUATIONS) == list(KINDS)
    for name, table in ACTUATIONS.items():
        assert set(table.model_fields) == {field.name for field in fields(KINDS[name])}  # type: ignore[arg-type]
        assert all(field.description for field in table.model_fields.values())
    assert set(CreaseTable.model_fields) == {field.name for field in fields(CreaseLaw)}


def test_byte_order_mark_and_windows_line_ends(tmp_path: Path) -> None:
    text = (SECTOR + SHEET + MESH + STEP).replace("\n", "\r\n")
    (tmp_path / "windows.toml").write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert load_scene(tmp_path / "windows.toml").name == "windows"


def test_a_modulus_in_pascal_is_told_its_unit() -> None:
    with pytest.raises(
        SceneError, match=r"sheet\.E = 4000000000\.0 cannot be; .* up to 1e9 MPa \(1 GPa is 1000 MPa\)"
    ):
        scene(sheet="[sheet]\nE = 4e9\nt = 1\n")
