"""JSON schema of a scene, for editors that check and complete TOML while it is written (`bh schema`)."""

from __future__ import annotations

from collections.abc import Iterable

from bh.scene import tables
from bh.scene.bodies import BODIES, OTHERS
from bh.scene.loads import ImperfectionTable, SpringTable
from bh.scene.moving import MoveTable
from bh.scene.patterns import LIBRARY, DrawingPattern
from bh.scene.reading import Table
from bh.scene.sheets import ZoneTable
from bh.scene.wide_creases import WideCreaseTable

Schema = dict[str, object]

SINGLE: dict[str, type[Table]] = {
    "sheet": tables.SheetTable,
    "model": tables.ModelTable,
    "outputs": tables.OutputsTable,
}
NAMED = "^[^:]+:[^:]+$"  # module:name, of the user's own
VECTOR = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
NODES = {"type": "array", "items": {"type": "integer", "minimum": 0}, "minItems": 1}
PLACES: Schema = {
    "anyOf": [
        {"type": "string"},
        NODES,
        {"type": "array", "items": {"anyOf": [{"type": "string"}, NODES]}, "minItems": 1},
    ]
}
OWN = {
    "type": "object",
    "properties": {"kind": {"type": "string", "pattern": NAMED}},
    "required": ["kind"],
}
MESHES: tuple[type[Table], ...] = (tables.MeshTable, tables.GmshTable, tables.DrawnTable)


def schema() -> Schema:
    """The schema (draft 2020-12) of every table and key of a scene.

    What only fits together with other values (places, widths and radii, one of two keys) is told by `bh check`.
    """
    found: Schema = {}
    patterns: list[type[Table]] = [*LIBRARY.values(), DrawingPattern]
    acting = {**tables.ACTUATIONS, **BODIES}
    steps = {key: _one_or_more(_table(found, kind)) for key, kind in acting.items()}
    for key, other in OTHERS.items():
        steps[key] = _one_or_more({"anyOf": [_table(found, BODIES[key]), _table(found, other)]})
    steps["until"] = _table(found, tables.UntilTable)
    steps["move"] = _table(found, MoveTable)
    support: Schema = {"anyOf": [_table(found, tables.SupportTable), OWN]}
    steps |= {"support": _one_or_more(support), "hold": PLACES, "release": PLACES}
    crease = {"anyOf": _tables(found, (tables.CreaseTable, WideCreaseTable))}
    scene = {
        "pattern": {"anyOf": [*_tables(found, patterns), OWN]},
        **{name: _table(found, kind) for name, kind in SINGLE.items()},
        "zones": {"type": "array", "items": _table(found, ZoneTable)},
        "mesh": {"anyOf": _tables(found, MESHES)},
        "supports": {"type": "array", "items": support},
        "springs": {"type": "array", "items": _table(found, SpringTable)},
        "imperfection": _table(found, ImperfectionTable),
        "accuracy": {"anyOf": [{"type": "number"}, _table(found, tables.AccuracyTable)]},
        "contact": {
            "anyOf": [{"enum": ["thickness", "auto", False]}, {"type": "number", "exclusiveMinimum": 0}]
        },
        "friction": {"type": "number", "minimum": 0},
        "symmetry": {"anyOf": [{"enum": ["x", "y"]}, VECTOR]},
        "creases": {"type": "object", "additionalProperties": crease},
        "steps": {
            "type": "array",
            "minItems": 1,
            "items": {
                "type": "object",
                "properties": steps,
                "patternProperties": {NAMED: {"type": ["object", "array"]}},
                "additionalProperties": False,
                "minProperties": 1,
            },
        },
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A scene of the bar-and-hinge workbench",
        "type": "object",
        "properties": scene,
        "required": ["pattern", "sheet", "steps"],
        "additionalProperties": False,
        "$defs": dict(sorted(found.items())),
    }


def _table(found: Schema, kind: type[Table]) -> Schema:
    """A reference to the schema of a table, which is put into `found`."""
    if kind.__name__ not in found:
        own = kind.model_json_schema(ref_template="#/$defs/{model}")
        found.update(own.pop("$defs", {}))
        found[kind.__name__] = own
    return {"$ref": f"#/$defs/{kind.__name__}"}


def _tables(found: Schema, kinds: Iterable[type[Table]]) -> list[Schema]:
    return [_table(found, kind) for kind in kinds]


def _one_or_more(item: Schema) -> Schema:
    return {"anyOf": [item, {"type": "array", "items": item, "minItems": 1}]}
