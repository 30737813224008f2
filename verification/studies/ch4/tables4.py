"""Case `tables4` (source 4.3): parameters of the five corrugations from W, H and n_s against Tables 4.1-4.5."""

from __future__ import annotations

import numpy as np

import meshes
from meshes.corrugations import KINDS
from meshes.curves import Array, sample
from meshes.tapered import smallest_angles
from verification.framework.checks import CaseResult, Check, Context, line, plot

SOURCE = "source 4.3, Tables 4.1-4.5"
FIFTHS = ("20.0", "40.0", "60.0", "80.0", "100")
HALF = ("50.0",) * 5
PRINTED: dict[str, dict[str, tuple[str, ...]]] = {  # as printed, curves 1 to 5
    "straight": {"a": FIFTHS, "r": HALF},
    "parabolic-point": {"b": ("-0.008", "-0.016", "-0.024", "-0.032", "-0.040"), "c": FIFTHS, "r": HALF},
    "parabolic-edge": {"b": ("-0.040",) * 5, "c": FIFTHS, "r": ("22.4", "31.6", "38.7", "44.7", "50.0")},
    "elliptical-point": {"d": HALF, "e": FIFTHS, "f": ("0.00",) * 5, "r": HALF},
    "elliptical-edge": {
        "d": HALF, "e": ("100",) * 5, "f": ("-80.0", "-60.0", "-40.0", "-20.0", "0.00"),
        "r": ("30.0", "40.0", "45.8", "49.0", "50.0"),
    },
}  # fmt: skip


def run(context: Context) -> CaseResult:
    """All columns of the tables, and the curves of the patterns against the equations."""
    result = CaseResult(
        name="tables4",
        title="The five corrugations: crease curves",
        question="Do W = H = 100 mm and five panels give the parameters that the source prints?",
        source=SOURCE,
    )
    for kind in KINDS:
        context.tell(f"tables4: {kind}")
        table = meshes.corrugation_table(kind)
        for name, printed in PRINTED[kind].items():
            worst = max(
                _digits(value, text) for value, text in zip(table.columns[name], printed, strict=True)
            )
            result.checks.append(
                Check("tables4", f"column {name}: distance from print, in units of the last digit",
                      {"kind": kind, "form": table.form}, worst, "", 0.0, SOURCE, 0.5)
            )  # fmt: skip
        pattern = meshes.corrugation(kind)
        off = max(
            float(np.abs(formula(kind, i, sample(rail)[:, 0]) - sample(rail)[:, 1]).max())
            for i, rail in enumerate(pattern.rails[1:])
        )
        result.checks.append(
            Check("tables4", "largest distance of the drawn curves from their equations", {"kind": kind}, off, "mm",
                  0.0, "Eq. 4.7-4.16", 1e-9)
        )  # fmt: skip
        result.plots.append(_drawing(kind, pattern))
        _mesh(result, kind, pattern)
    result.notes.append(
        "Angles below 10 degrees remain where curves meet in a point: at the corners of the parabolic-point pattern "
        "they enclose 3.4 degrees; those of the elliptical-point pattern touch, and are taken as one where they are "
        "closer than 0.04 of a cell's length; and a few where rows end. Staggered cells of the straight pattern with "
        "an aspect ratio of 6 are 9.5 degrees at their tips, and half of that at the ends of the sheet."
    )
    return result


def formula(kind: str, i: int, x: Array) -> Array:
    """y of curve i (from 0) by Eq. 4.7-4.16 at x, mm; zero beyond its ends."""
    c = {name: float(column[i]) for name, column in meshes.corrugation_table(kind).columns.items()}
    if "a" in c:
        return np.full_like(x, c["a"])
    if "b" in c:
        return np.maximum(c["b"] * x**2 + c["c"], 0.0)
    inside = np.maximum(1.0 - (x / c["d"]) ** 2, 0.0)
    return np.maximum(c["e"] * np.sqrt(inside) + c["f"], 0.0)


def _digits(value: float, printed: str) -> float:
    """|value - printed| in units of the last printed digit."""
    decimals = len(printed.partition(".")[2])
    return float(abs(value - float(printed)) * 10.0**decimals)


def _mesh(result: CaseResult, kind: str, pattern: meshes.CreasePattern) -> None:
    """Smallest angles of the mesh with one row and with four."""
    for along, rows in ((36, 1), (44, 4)):
        mesh = meshes.structured(pattern, along=along, rows=rows)
        angles = np.degrees(smallest_angles(mesh.points, mesh.triangles))
        params = {"kind": kind, "along": along, "rows": rows, "triangles": len(angles)}
        result.checks.append(
            Check("tables4", "smallest angle of the mesh", params, float(angles.min()), "deg", None, SOURCE)
        )
        share = float(np.mean(angles < 10.0))
        result.checks.append(
            Check(
                "tables4",
                "share of triangles with an angle below 10 degrees",
                params,
                share,
                "",
                None,
                SOURCE,
            )
        )


def _drawing(kind: str, pattern: meshes.CreasePattern) -> dict[str, object]:
    rails = [sample(rail)[:: 64 if len(sample(rail)) > 64 else 1] for rail in pattern.rails]
    series = [
        line(
            f"y{k}", xy[:, 0].tolist(), xy[:, 1].tolist(), "reference" if k in (0, len(rails) - 1) else "line"
        )
        for k, xy in enumerate(rails)
    ]
    return plot(f"pattern-{kind}", kind, "x (mm)", "y (mm)", series, f"Crease pattern, {kind} (Fig. 4.3).")
