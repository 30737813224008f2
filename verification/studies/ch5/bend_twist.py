"""Case `bend_twist` (source Ch. 5): bend and twist by a pinch against what the source varies, with error bars.

One thing at a time is varied about a sheet of two creases. Values are those of the consistent formulation on eight rows
a panel, error bars what they change by from four rows to eight; the shell judges eight of the sheets. The source's own
model (bars and hinges, one row, a grip) and the consistent formulation with its grip tell what differs: the mesh, the
formulation or the profile of the pinch. Some three minutes of processor time; every sheet is stored when it is done.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import bh
import bh.sweep
from bh.solvers.outcome import Outcome
from verification.framework.checks import CaseResult, Context, line, plot
from verification.studies.ch5.pinching import AS_SOURCE, CONVERGED, NEARLY, Stiffness, Way, pinched

BASE: dict[str, float] = {"creases": 2, "spacing": 5.0, "kappa_0": 0.01, "t": 0.5, "Lstar": 2.0}  # mm, 1/mm
VARIED: dict[str, tuple[float, ...]] = {
    "creases": (1, 2, 3, 4),
    "spacing": (3.0, 5.0, 7.0),
    "kappa_0": (0.005, 0.01, 0.015),
    "t": (0.25, 0.5, 0.75),
    "Lstar": (1.0, 2.0, 4.0),
}
UNITS = {"creases": "", "spacing": "mm", "kappa_0": "1/mm", "t": "mm", "Lstar": "mm"}
JUDGED: tuple[dict[str, float], ...] = (  # sheets that the shell has, too
    {},
    {"creases": 1},
    {"creases": 3},
    {"spacing": 3.0},
    {"spacing": 7.0},
    {"kappa_0": 0.005},
    {"kappa_0": 0.015},
    {"t": 0.25},
)
GRIPPED = Way("consistent, grip", "consistent", AS_SOURCE.profile, AS_SOURCE.zone, ((80, 4),))
JUDGE = Way("shell", "shell", "cosine", CONVERGED.zone, ((50, 2), (100, 2)))
ROWS = Way("consistent", "consistent", "cosine", CONVERGED.zone, ((40, 2), (80, 4), (160, 8)))
EVERY = {way.name: way for way in (ROWS, AS_SOURCE, GRIPPED, JUDGE)}
SURE = 2.0  # error bars and changes of the shell that both may be apart


@dataclass(frozen=True)
class PinchTask:
    """A sheet that is folded and pinched until it is nearly closed."""

    @property
    def identity(self) -> str:
        """Of the task and what it does not read from a point."""
        return f"bend and twist {EVERY!r} {NEARLY}"

    def __call__(self, point: Mapping[str, Any]) -> dict[str, float]:
        """Changes of both angles, degrees, of the sheet {"way", "along", "rows", and all of `BASE`}."""
        way = EVERY[str(point["way"])]
        stiffness = Stiffness(bh.Sheet(E=4000.0, t=float(point["t"])), float(point["Lstar"]))
        mesh = int(point["along"]), int(point["rows"])
        found = pinched(
            way,
            mesh,
            float(point["kappa_0"]),
            int(point["creases"]),
            float(point["spacing"]),
            stiffness,
            NEARLY,
        )
        found.path.require()
        return {"bend": found.bend, "twist": found.twist}


def sheets(quick: bool) -> list[dict[str, float]]:
    """All sheets, the one in the middle first."""
    every = [dict(BASE)]
    for name, values in VARIED.items():
        every += [{**BASE, name: value} for value in values if value != BASE[name]]
    return every[:2] if quick else every


def table(quick: bool) -> list[dict[str, Any]]:
    """Points of the sweep, cheap ones first."""
    judged = [{**BASE, **other} for other in JUDGED]
    rows = []
    for sheet in sheets(quick):
        for way in EVERY.values():
            if way is JUDGE and sheet not in judged:
                continue
            rows += [
                {"way": way.name, "along": along, "rows": number, **sheet}
                for along, number in (way.meshes[:2] if quick else way.meshes)
            ]
    return sorted(rows, key=lambda row: row["along"] * row["rows"] * (20 if row["way"] == JUDGE.name else 1))


def run(context: Context) -> CaseResult:
    """Bend and twist of all sheets."""
    result = CaseResult(
        name="bend_twist",
        title="Bend and twist by a pinch, with error bars",
        question="How do bend and twist depend on creases, spacing, curvature, thickness and L*?",
        source="shell of the same pinch, 100 x 2 quadratic cells",
    )
    context.folder.mkdir(parents=True, exist_ok=True)
    rows = table(context.quick)
    context.tell(f"bend_twist: {len(rows)} sheets and meshes")
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    file = context.folder / f"bend_twist_{len(rows)}.nc"
    resume = file.is_file() or Path(f"{file}.points").is_file()
    data = bh.sweep.run(PinchTask(), bh.sweep.table(columns), file, pool=0, resume=resume)
    good = data["outcome"].values == Outcome.REACHED
    result.check("sheets that were folded and pinched", good.sum(), reference=float(len(good)), tolerance=0.0)
    found = Found(data)
    meshes = ROWS.meshes[:2] if context.quick else ROWS.meshes
    for sheet in sheets(context.quick):
        for angle in ("bend", "twist"):
            _compare(result, found, sheet, angle, meshes[-2:])
    if not context.quick:
        for angle in ("bend", "twist"):
            _plots(result, found, angle, meshes[-2:])
        _notes(result, found, meshes[-2:])
    return result


class Found:
    """Values of the sweep by way, mesh and sheet; nan where a sheet was not reached."""

    def __init__(self, data: Any) -> None:
        """Take the data set of the sweep."""
        names = ("way", "along", "rows", *BASE)
        columns = [data[name].values.tolist() for name in names]
        keys = list(zip(*columns, strict=True))
        self.values = {
            angle: dict(zip(keys, data[angle].values.tolist(), strict=True)) for angle in ("bend", "twist")
        }

    def of(self, way: Way, mesh: tuple[int, int], sheet: Mapping[str, float], angle: str) -> float:
        """One value, degrees.

        Args:
            way: how it was pinched.
            mesh: cells along, rows.
            sheet: as of `sheets`.
            angle: "bend" or "twist".
        """
        return float(self.values[angle].get((way.name, *mesh, *sheet.values()), np.nan))


def _compare(
    result: CaseResult,
    found: Found,
    sheet: Mapping[str, float],
    angle: str,
    meshes: tuple[tuple[int, int], ...],
) -> None:
    """One angle of one sheet: value, error bar, shell, and what the source's model says."""
    coarse, fine = (found.of(ROWS, mesh, sheet, angle) for mesh in meshes)
    bar = abs(fine - coarse)
    params = {"angle": angle, "rows": meshes[-1][1], **sheet}
    shells = [found.of(JUDGE, mesh, sheet, angle) for mesh in JUDGE.meshes]
    judged = bool(np.isfinite(shells).all())
    result.check(
        f"change of the {angle} angle",
        fine,
        unit="deg",
        reference=shells[-1] if judged else None,
        params=params,
    )
    result.check("its error bar, 4 to 8 rows", bar, unit="deg", params=params)
    if judged:
        result.check(
            "distance from the shell over both error bars",
            abs(fine - shells[-1]) / (bar + abs(shells[1] - shells[0])),
            reference=0.0,
            tolerance=SURE if meshes[-1] == ROWS.meshes[-1] else None,
            params=params,
        )
    source = found.of(AS_SOURCE, AS_SOURCE.meshes[0], sheet, angle)
    result.check(
        f"change of the {angle} angle by the source's model",
        source,
        unit="deg",
        reference=fine,
        source="consistent formulation",
        params=params,
    )


def _plots(result: CaseResult, found: Found, angle: str, meshes: tuple[tuple[int, int], ...]) -> None:
    for name, values in VARIED.items():
        every = [{**BASE, name: value} for value in values]
        series = [
            line(f"consistent, {mesh[1]} rows", list(values), [found.of(ROWS, mesh, s, angle) for s in every])
            for mesh in meshes
        ]
        series.append(
            line(
                "source's model",
                list(values),
                [found.of(AS_SOURCE, AS_SOURCE.meshes[0], s, angle) for s in every],
                "points",
            )
        )
        shells = [
            (v, a)
            for v, s in zip(values, every, strict=True)
            if np.isfinite(a := found.of(JUDGE, JUDGE.meshes[-1], s, angle))
        ]
        series.append(line("shell", [v for v, _ in shells], [a for _, a in shells], "reference"))
        result.plots.append(
            plot(
                f"bend-twist-{angle}-{name}",
                f"Change of the {angle} angle against {name}",
                f"{name}, {UNITS[name]}" if UNITS[name] else name,
                "degrees",
                series,
                "Two creases of 0.01 /mm, 100 mm, 5 mm apart, t = 0.5 mm, L* = 2 mm, and one thing varied; closed to "
                "pi / 18. The line's distance of 4 and 8 rows is the error bar.",
            )
        )


def _notes(result: CaseResult, found: Found, meshes: tuple[tuple[int, int], ...]) -> None:
    """Where the source's model differs: by its mesh, its profile or its formulation."""
    for angle in ("bend", "twist"):
        share: dict[str, list[float]] = {"mesh": [], "profile": [], "formulation": []}
        for sheet in sheets(False):
            fine = found.of(ROWS, meshes[-1], sheet, angle)
            one, two = (found.of(AS_SOURCE, mesh, sheet, angle) for mesh in AS_SOURCE.meshes)
            grip = found.of(GRIPPED, GRIPPED.meshes[0], sheet, angle)
            share["mesh"].append(abs(two - one))
            share["profile"].append(abs(grip - fine))
            share["formulation"].append(abs(two - grip))
        text = ", ".join(f"{name} {np.nanmedian(values):.2g}" for name, values in share.items())
        result.notes.append(
            f"What makes the source's model differ in the {angle} angle, medians over all sheets, degrees: {text} (the "
            "mesh is one row against two, the profile a grip against a raised cosine by the consistent formulation, "
            "the formulation bars and hinges on two rows against the consistent one, both with a grip)."
        )
