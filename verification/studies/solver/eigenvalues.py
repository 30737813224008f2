"""Case `eigenvalues`: natural frequencies and buckling loads, by the consistent formulation and the shell.

Flat sheets are compared with closed forms. For a strip that is folded along its middle there is none: it is compared
with the shell.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import bh
import meshes
from bh.analysis.buckling import buckling_modes
from bh.analysis.stiffness_probe import Probe
from bh.paths.path import Path
from verification.framework.checks import CaseResult, Context, Cost, line, plot

CASE = "eigenvalues"
E, T, DENSITY = 4000.0, 0.3, 1400.0  # MPa, mm, kg/m^3
LONG, WIDE, SIDE = 60.0, 10.0, 30.0  # of the strip and the square, mm
PRESSED = 0.01  # mm
TOLERANCE, QUICK_TOLERANCE = 0.01, 0.04
TONNE = 1e-12  # kg / m^3 in t / mm^3
LEVELS = {"consistent": (16, 32, 64), "shell": (8, 16)}  # cells along
ROOT = 1.875104068711961  # cos b cosh b = -1
EULER = "Euler's column between hinges: 1, 4, 9 pi^2 E I / L^2"
RATE = 0.3  # of an order: what the press shortens stays while the mesh's error goes
BRYAN = "Bryan (1891), a simply supported square pressed along one side: 4 and 6.25 pi^2 D / b^2"
BEAM = "a clamped beam: cos b cosh b = -1, omega = b^2 sqrt(E I / m L^4)"
NAVIER = "Navier's simply supported square: omega = 2 and 5 pi^2 / b^2 sqrt(D / rho t)"
SHELL = "the shell on its finest mesh"


@dataclass(frozen=True)
class Problem:
    """A sheet, its eigenvalues and what they should be.

    Attributes:
        name: of the sheet.
        source: of the closed form.
        unit: "N", "N/mm" or "Hz".
        exact: eigenvalues in order.
        found: the same by a formulation with a number of cells along the sheet.
    """

    name: str
    source: str
    unit: str
    exact: tuple[float, ...]
    found: Callable[[str, int], list[float]]


def problems() -> tuple[Problem, ...]:
    """The four with a closed form."""
    inertia, mass = WIDE * T**3 / 12.0, TONNE * DENSITY * WIDE * T
    rigidity = E * T**3 / (12.0 * (1.0 - 0.3**2))
    column = math.pi**2 * E * inertia / LONG**2
    bulge = math.pi**2 * rigidity / SIDE**2
    bending = ROOT**2 * math.sqrt(E * inertia / (mass * LONG**4)) / (2.0 * math.pi)
    tone = 0.5 * math.pi / SIDE**2 * math.sqrt(rigidity / (TONNE * DENSITY * T))
    return (
        Problem("column", EULER, "N", (column, 4.0 * column, 9.0 * column), _column),
        Problem("pressed square", BRYAN, "N/mm", (4.0 * bulge, 6.25 * bulge), _pressed_square),
        Problem("clamped strip", BEAM, "Hz", (bending,), _clamped_strip),
        Problem("square that rings", NAVIER, "Hz", (2.0 * tone, 5.0 * tone), _ringing_square),
    )


def _strip(formulation: str, along: int) -> bh.Model:
    pattern = meshes.strip(LONG, WIDE, [0.5 * WIDE], "flat")
    mesh = meshes.structured(pattern, along=along, rows=max(along // 16, 1))
    return bh.Model(mesh, bh.Sheet(E=E, nu=0.0, t=T), formulation=formulation, contact=False)


def _square(formulation: str, along: int) -> bh.Model:
    """Simply supported: its edges stay in their plane and move freely in it."""
    pattern = meshes.strip(SIDE, SIDE, [0.5 * SIDE], "flat")
    mesh = meshes.structured(pattern, along=along, rows=max(along // 2, 1))
    model = bh.Model(mesh, bh.Sheet(E=E, nu=0.3, t=T), formulation=formulation, contact=False)
    for edge in ("start", "end", "inner", "outer"):
        model = model.support(f"edge:{edge}", "z")
    return model.support("edge:start", "x").support("corner:inner-start", "y")


def _factors(path: Path, count: int) -> list[float]:
    """Buckling loads in parts of the one that presses the end by `PRESSED`."""
    return [mode.factor for mode in buckling_modes(path, bh.Displace("edge:end", "x", -PRESSED), count=count)]


def _column(formulation: str, along: int) -> list[float]:
    model = _strip(formulation, along).support("edge:start", "xyz").support("edge:end", "yz")
    return [E * WIDE * T * PRESSED / LONG * factor for factor in _factors(Path(model), 3)]


def _pressed_square(formulation: str, along: int) -> list[float]:
    model = _square(formulation, along)
    return [E * T * PRESSED / SIDE * factor for factor in _factors(Path(model), 2)]


def _frequencies(path: Path, count: int) -> list[float]:
    """Of the modes that cost energy, Hz."""
    modes = Probe(path).modes(count + 6, density=DENSITY)
    return [mode.frequency for mode in modes if not mode.free][:count]


def _at_rest(model: bh.Model) -> Path:
    return bh.trace(model.force("corner:outer-end", total=(0.0, 0.0, 0.0)))


def _clamped_strip(formulation: str, along: int) -> list[float]:
    return _frequencies(_at_rest(_strip(formulation, along).support("edge:start", "xyz", clamp=True)), 1)


def _ringing_square(formulation: str, along: int) -> list[float]:
    return _frequencies(_at_rest(_square(formulation, along)), 2)


def _folded(formulation: str, along: int) -> bh.Model:
    """A strip twice as wide, folded by its spring to a trough: one flap stays on the table, the other comes up."""
    # masses at nodes give a flap that turns with n rows of cells 1 + 1 / (2 n^2) of its moment of inertia
    rows = along // 8 if formulation == "consistent" else along // 4
    mesh = meshes.structured(meshes.strip(LONG, 2.0 * WIDE, [WIDE], "valley"), along=along, rows=rows)
    model = bh.Model(mesh, bh.Sheet(E=E, nu=0.0, t=T), formulation=formulation, contact=False).support(
        "edge:start", "x"
    )
    ends = [int(model.mesh.nodes("crease:crease")[k]) for k in (0, -1)]
    model = model.support(ends, "yz").support("corner:inner-start", "z")
    return model.fold("crease", by=math.radians(60.0), Lstar=20.0)


def _trough(formulation: str, along: int) -> list[float]:
    """Two buckling loads (multiples of the press by `PRESSED`) and two frequencies of the folded strip."""
    path = bh.trace(_folded(formulation, along))
    return [*_factors(path, 2), *_frequencies(path, 2)]


def run(context: Context) -> CaseResult:
    """Five sheets."""
    result = CaseResult(
        CASE,
        "Natural frequencies and buckling loads",
        "Are the lowest eigenvalues of a state, which no path shows, right?",
        "closed forms; the shell",
    )
    # quick is without the finest meshes, so of a coarser one more error is allowed
    levels = {name: each[:-1] if context.quick else each for name, each in LEVELS.items()}
    tolerance = QUICK_TOLERANCE if context.quick else TOLERANCE
    for problem in problems():
        _against(
            result,
            problem.name,
            problem.source,
            problem.unit,
            problem.exact,
            problem.found,
            levels,
            tolerance,
        )
    finest = levels["shell"][-1]
    exact = _trough("shell", 4 * finest)
    shown = {"consistent": levels["consistent"]} | ({} if context.quick else {"shell": (finest, 2 * finest)})
    _against(result, "folded strip", SHELL, "presses and Hz", exact, _trough, shown, tolerance)
    result.notes.append(
        "Masses are lumped at the nodes, and Green's strain lets a pressed sheet shorten before it buckles (2e-5 of "
        "its length for the column). Of the folded strip the buckling loads are multiples of a press by 0.01 mm, its "
        "frequencies are those with the supports that it was folded with; lumped masses leave 0.3 % on 32 cells."
    )
    return result


def _against(
    result: CaseResult,
    name: str,
    source: str,
    unit: str,
    exact: Sequence[float],
    found: Callable[[str, int], list[float]],
    levels: dict[str, tuple[int, ...]],
    tolerance: float,
) -> None:
    """Relative errors by formulation and mesh; the finest mesh of each is judged."""
    series = []
    for formulation, cells in levels.items():
        worst = []
        for along in cells:
            began = time.perf_counter()
            values = found(formulation, along)
            cost = Cost(wall_time_s=time.perf_counter() - began)
            judged = tolerance if along == cells[-1] else None
            check = partial(result.check, unit=unit, source=source, tolerance=judged, path=cost)
            for number, (value, right) in enumerate(zip(values, exact, strict=True), 1):
                params = {"formulation": formulation, "along": along, "number": number}
                check(f"{name}: eigenvalue", value, reference=right, params=params)
            worst.append(max(abs(value / right - 1.0) for value, right in zip(values, exact, strict=True)))
        if formulation == "consistent" and source != SHELL:  # the shell's errors are down to the press's own
            result.check(
                f"{name}: order of convergence of the largest error",
                math.log2(worst[-2] / worst[-1]),
                unit="1",
                reference=2.0,
                source="constant curvatures and lumped masses",
                tolerance=RATE,
                params={"formulation": formulation, "along": cells[-1]},
            )
        series.append(line(formulation, [float(each) for each in cells], [100.0 * each for each in worst]))
    result.plots.append(
        plot(
            f"eigenvalues-{name.replace(' ', '-')}",
            name,
            "cells along",
            "largest error, %",
            series,
            f"Eigenvalues of the {name} against {source}.",
            log="xy",
        )
    )
