"""Case `drawings`: every drawing is folded with one command, at its right size, within a minute.

The project's own drawings (`tests/data`) are checked, and what the readers make of mutations of them by a seed; with
BH_DRAWINGS=FOLDER in the environment every drawing below that folder is folded too and reported, so that a gallery can
be counted. A row of figures is kept in `drawings_runs.json` beside the results as each is done; a run that was stopped
goes on.
"""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from meshes.errors import InputError
from meshes.io.drawing import PATTERNS
from verification.framework.checks import CaseResult, Context, Cost
from verification.framework.store import Store
from verification.studies.solver.drawings_folding import LIMIT, Row, fold_apart
from verification.studies.solver.drawings_mutations import mutant, read, seeds

CASE, RUNS, FOLDER = "drawings", "drawings_runs.json", "BH_DRAWINGS"
OWN = Path(__file__).parents[3] / "tests" / "data"
QUICK = 2
MUTATIONS, QUICK_MUTATIONS, BLOCK = 5000, 40, 250
SLOW = 20.0  # s of processor time that a reader may take for a mutation
WHERE = "the project's own", FOLDER
PX = 25.4 / 96.0  # mm
# longer and shorter side of the sheets, mm, as they were written (tests/data/README.md)
RIGHT = {
    "pleats.svg": (400.0 * PX, 320.0 * PX),
    "miura.svg": ((6 * 90.0 + 18.0) * PX, 5 * 70.0 * PX),
    "ring_pleats.svg": (2 * 145.0 * PX, 2 * 145.0 * PX),
    "fan.svg": (3600.0 * PX, 1400.0 * PX),
    "cones.svg": (
        2.0 * 170.0 * math.sin(math.radians(70.0)) * PX,
        (170.0 - 60.0 * math.cos(math.radians(70.0))) * PX,
    ),
    "cone_pleat.svg": (200.0 * PX, 160.0 * PX),
    "four_sheets.svg": (60.0, 40.0),
    "no_outline.svg": (100.0, 60.0),
    "steps_popup.svg": (100.0, 80.0),
}
SIZE = 1e-3  # how far a side may be off: they were written with two decimals


def run(context: Context) -> CaseResult:
    """Fold every drawing in a process of its own."""
    result = CaseResult(
        name=CASE,
        title="Any drawing",
        question="Does every drawing fold with one command, at its right size, within a minute?",
        source="bh fold, with its default: the drawn angles, or 80 % of 180 degrees",
    )
    store = Store.open(context.folder, RUNS, context.quick)
    own = _drawings(OWN)
    if not own:
        raise InputError(
            f"there are no drawings in '{OWN}'; they come with the project's repository, not its package"
        )
    folders = [(WHERE[0], OWN, own[:QUICK] if context.quick else own)]
    if given := os.environ.get(FOLDER, "").strip():
        folders.append((WHERE[1], Path(given), _given(Path(given))))
    _mutated(result, context, store)
    for where, folder, files in folders:
        rows = [_kept(context, store, where, folder, file) for file in files]
        _report(result, where, rows)
    return result


def _mutated(result: CaseResult, context: Context, store: Store) -> None:
    """Readers make of every mutation of the own drawings a sheet or one clear line."""
    wanted = QUICK_MUTATIONS if context.quick else MUTATIONS
    files: list[tuple[str, bytes]] = []
    for first in range(0, wanted, BLOCK):
        key = f"mutations from {first}"
        if key in store.runs:
            continue
        if not files:
            with tempfile.TemporaryDirectory() as scratch:
                files = seeds(OWN, Path(scratch))
        rows = [(number, read(*mutant(files, number))) for number in range(first, min(first + BLOCK, wanted))]
        faults = [f"{number} ({row.file}): {row.fault}" for number, row in rows if row.fault]
        kept = {
            "count": len(rows),
            "sheets": sum(row.sheet for _, row in rows),
            "slow": [f"{number} ({row.file})" for number, row in rows if row.seconds > SLOW],
            "longest": max(row.seconds for _, row in rows),
            "faults": faults,
        }
        context.tell(f"{CASE}: {len(rows)} {key}: {len(faults)} faults")
        store.keep(key, kept)
    blocks = [store.runs[f"mutations from {first}"] for first in range(0, wanted, BLOCK)]
    counted = {"mutations": sum(block["count"] for block in blocks)}
    result.check("mutations that are read as a sheet", sum(b["sheets"] for b in blocks), params=counted)
    for key, words in (
        ("faults", "mutations that end neither in a sheet nor in one clear line"),
        ("slow", f"mutations that keep a reader busy for more than {SLOW:g} s"),
    ):
        found = [line for block in blocks for line in block[key]]
        params = counted | ({"first": found[0]} if found else {})
        result.check(words, len(found), reference=0.0, tolerance=0.5, params=params)
    result.check(
        "longest processor time of a mutation", max(b["longest"] for b in blocks), unit="s", params=counted
    )


def _given(folder: Path) -> list[Path]:
    found = _drawings(folder) if folder.is_dir() else []
    if not found:
        raise InputError(
            f"{FOLDER} = '{folder}' has no drawings; name a folder with {', '.join(PATTERNS)} files"
        )
    return found


def _drawings(folder: Path) -> list[Path]:
    return sorted(file for file in folder.rglob("*") if file.suffix.lower() in PATTERNS and file.is_file())


def _kept(context: Context, store: Store, where: str, folder: Path, file: Path) -> Row:
    """A row of the store, or the file folded now."""
    name = file.relative_to(folder).as_posix()
    key = f"{where}: {name}"
    if key not in store.runs:
        with tempfile.TemporaryDirectory() as scratch:
            row = fold_apart(file, name, Path(scratch))
        context.tell(f"{CASE}: {name}: {row.why or f'{row.angle or 0.0:.0f} degrees'}, {row.seconds:.1f} s")
        store.keep(key, asdict(row))
    known = dict(store.runs[key])
    return Row(**{**known, "size": tuple(known["size"]) if known["size"] else None})


def _report(result: CaseResult, where: str, rows: Sequence[Row]) -> None:
    """The table, a line a drawing, and what it comes to; drawings of others are only counted."""
    judged = where == WHERE[0]
    for row in rows:
        if judged:
            _size(result, row)
        result.check(
            "part of the wanted angles that is reached",
            row.way,
            reference=1.0,
            tolerance=1e-9 if judged else None,
            params={
                "of": where,
                "drawing": row.file,
                "read": row.read,
                "size": "" if row.size is None else f"{row.size[0]:.5g} x {row.size[1]:.5g} mm",
                "creases": row.creases,
                "mean fold, degrees": None if row.angle is None else round(row.angle, 1),
                "mesh": row.mesh,
                "processor, s": round(row.seconds, 1),
                "remarks": row.remarks,
                "why not": row.why,
            },
            path=Cost(row.unknowns, row.iterations, row.seconds),
        )
    folded = sum(row.way == 1.0 for row in rows)
    times = sorted(row.seconds for row in rows)
    counted = {"of": where, "drawings": len(rows)}
    result.check("drawings that are read", sum(row.read for row in rows), params=counted)
    result.check(f"drawings folded within {LIMIT:g} s each", folded, params=counted)
    result.check("median of the processor times", times[len(times) // 2], unit="s", params=counted)
    if judged:
        result.check("longest processor time", times[-1], unit="s", params=counted)


def _size(result: CaseResult, row: Row) -> None:
    if row.file not in RIGHT or row.size is None:
        return
    for side, value, right in zip(("longer", "shorter"), row.size, RIGHT[row.file], strict=True):
        result.check(
            f"{side} side of the sheet",
            value,
            unit="mm",
            reference=right,
            source="tests/data/README.md",
            tolerance=SIZE,
            params={"drawing": row.file},
        )
