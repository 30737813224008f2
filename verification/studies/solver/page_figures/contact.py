"""Moulds of few and of many facets, and a corrugation that is crushed on a coarse mesh (docs/contact.md)."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import bh
from bh.scene.load import load_scene
from verification.framework.checks import CaseResult
from verification.studies.solver.contact_layers import crush
from verification.studies.solver.contact_more import three_point, written

CRUSHED = Path(__file__).resolve().parents[4] / "examples" / "crushed_corrugation.toml"
COARSE = ("mesh.along=16", "mesh.rows=2")
FACETS = (12, 24, 48, 96)


def touches(result: CaseResult, quick: bool) -> None:
    """Force of moulds by their facets; load and friction of a crushed corrugation, half as many cells each way.

    Args:
        result: gets the checks.
        quick: with the coarsest mould, without the corrugation.
    """
    exact = -float(three_point(None)[-1].contact_forces["top"][2])
    for facets in FACETS[: 1 if quick else 4]:
        with TemporaryDirectory() as folder:
            path = three_point(written(Path(folder) / "cylinder.stl", facets)).require()
        force = -float(path[-1].contact_forces["top"][2])
        result.check(
            "force of a mould over that of exact cylinders, less 1",
            force / exact - 1.0,
            reference=0.0,
            source="exact cylinders",
            params={"facets": facets},
            path=path,
        )
    for friction in () if quick else (0.0, 0.3):
        changes = (*COARSE, f"friction={friction}") if friction else COARSE
        path = bh.trace(load_scene(CRUSHED, changes).model, neighbours=False)
        load, _, work = crush(path)
        for quantity, unit, value in (
            ("load that crushes a coarse corrugation", "N", load),
            ("work of the plate that crushes a coarse corrugation", "N mm", work),
            ("what friction uses up in a coarse corrugation", "N mm", path[-1].energy.friction),
        ):
            result.check(quantity, value, unit=unit, params={"friction": friction}, path=path)
