"""docs/scenes.md lists every key that a scene can have, with what its schema says of it."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from bh.scene import bodies as scene_bodies
from bh.scene import crease_tables, loads, moving, wide_creases
from bh.scene import patterns as scene_patterns
from bh.scene import reading as scene_tables
from bh.scene import sheets as scene_sheets
from bh.scene import tables as schema
from bh.scene.load import SECTIONS

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "scenes.md").read_text(encoding="utf-8")
TABLES: dict[str, type[scene_tables.Table]] = {
    'pattern, kind = "strip"': scene_patterns.StripPattern,
    'pattern, kind = "annulus_sector"': scene_patterns.AnnulusSectorPattern,
    'pattern, kind = "full_annulus"': scene_patterns.FullAnnulusPattern,
    'pattern, kind = "parallel_creases"': scene_patterns.ParallelPattern,
    "pattern, corrugations": scene_patterns.CorrugationPattern,
    'pattern, kind = "curved-corrugation"': scene_patterns.CurvedCorrugationPattern,
    'pattern, kind = "two_arcs"': scene_patterns.TwoArcsPattern,
    'pattern, kind = "sine_tessellation"': scene_patterns.SineTessellationPattern,
    'pattern, kind = "parabolic_canopy"': scene_patterns.ParabolicCanopyPattern,
    'pattern, kind = "opposite_parabolas"': scene_patterns.OppositeParabolasPattern,
    "pattern, drawing": scene_patterns.DrawingPattern,
    "sheet": schema.SheetTable,
    "zones": scene_sheets.ZoneTable,
    "mesh": schema.MeshTable,
    "mesh by gmsh": schema.GmshTable,
    "mesh as drawn": schema.DrawnTable,
    "model": schema.ModelTable,
    "supports": schema.SupportTable,
    "creases.NAME": schema.CreaseTable,
    "creases.NAME, wide": wide_creases.WideCreaseTable,
    "steps: fold": schema.FoldTable,
    "steps: pinch": schema.PinchTable,
    "steps: moment": schema.MomentTable,
    "steps: force": schema.ForceTable,
    "steps: displace": schema.DisplaceTable,
    "steps: move": moving.MoveTable,
    "steps: pull": schema.PullTable,
    "steps: weight": schema.WeightTable,
    "steps: pressure": loads.PressureTable,
    "steps: line_force": loads.LineForceTable,
    "steps: area_force": loads.AreaForceTable,
    "steps: edge_moment": loads.EdgeMomentTable,
    "steps: couple": loads.CoupleTable,
    "springs": loads.SpringTable,
    "steps: expand": schema.ExpandTable,
    "imperfection": loads.ImperfectionTable,
    "steps: press": scene_bodies.PressTable,
    "steps: press, file": scene_bodies.MouldTable,
    "steps: tether": scene_bodies.TetherTable,
    "steps: until": schema.UntilTable,
    "outputs": schema.OutputsTable,
    "accuracy": schema.AccuracyTable,
}


def rows(table: type[scene_tables.Table]) -> list[str]:
    """The lines that the page has for a table of the scene."""
    found = ["| Key | Default | Give |", "|---|---|---|"]
    for key, field in table.model_fields.items():
        value = "pi" if field.default == math.pi else scene_tables.shown(field.default)
        default = (
            "needed" if field.is_required() else {"None": "", "[]": "none", "{}": "none"}.get(value, value)
        )
        about = field.description or f'"{key_of(field)}"'
        found.append(f"| `{key}` | {default} | {about} |")
    return found


def key_of(field: object) -> str:
    """The one word that a `kind` can be."""
    (word,) = field.annotation.__args__  # type: ignore[attr-defined]
    return str(word)


@pytest.mark.parametrize("title", TABLES)
def test_tables_are_those_of_the_schema(title: str) -> None:
    section = PAGE.split(f"\n### {title}\n")[1].split("\n#")[0]
    assert [line for line in section.splitlines() if line.startswith("|")] == rows(TABLES[title])


def test_nothing_is_left_out() -> None:
    every = {
        kind
        for kind in (
            vars(schema)
            | vars(scene_patterns)
            | vars(scene_bodies)
            | vars(scene_sheets)
            | vars(loads)
            | vars(moving)
            | vars(wide_creases)
        ).values()
        if isinstance(kind, type) and issubclass(kind, scene_tables.Table)
    }
    assert set(TABLES.values()) == every - {
        scene_tables.Table,
        scene_patterns.PatternTable,
        scene_sheets.OtherSheetTable,
    }
    named = {title.split(",")[0].split(":")[0].split(".")[0] for title in TABLES}
    assert {name.split(" by ")[0].split(" as ")[0] for name in named} == set(SECTIONS) - {
        "symmetry",
        "contact",
        "friction",
    }
    assert "`symmetry = " in PAGE
    assert "`contact = " in PAGE
    assert "`friction = " in PAGE
    assert PAGE.count("\n### ") == len(TABLES)


def test_places_of_the_page_are_places() -> None:
    import re

    import meshes

    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.5), along=4)
    places = re.findall(r"^\| `([^`]+)` \|", PAGE.split("\n## Places\n")[1].split("\n## ")[0], re.MULTILINE)
    assert {"all", "crease:NAME", "node:N", "edge:inner", "corner:inner-start"} <= set(places)
    for place in places:
        assert (
            len(mesh.nodes(place.replace("NAME", "crease").replace(":N", ":3").replace("X,Y", "100,1"))) >= 1
        )
    assert set(mesh.corners) <= set(places)


@pytest.mark.parametrize("kind", crease_tables.TABLES)
def test_laws_of_creases(kind: str) -> None:
    section = PAGE.split(f'\n#### law, kind = "{kind}"\n')[1].split("\n#")[0]
    assert [line for line in section.splitlines() if line.startswith("|")] == rows(crease_tables.TABLES[kind])
