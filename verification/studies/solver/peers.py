"""Case `peers`: other codes of bars and hinges on the same arrays, error against time.

What other codes need cannot be measured here: the published ones are in MATLAB, none is on PyPI as a package that takes
this problem. Their times (`PEERS`) came with the problem in November 2026, one thread, on a machine that is not known;
this program's are measured in the same run as its errors.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import meshes
from bh import Model, Sheet, trace
from bh.paths.path import Path
from meshes.cells import Kind
from verification.framework.checks import CaseResult, Context, line, plot
from verification.framework.measuring import Cost, measure
from verification.theory.array_annulus import (
    ENERGIES,
    LSTAR,
    RADIUS,
    REST,
    SECTOR,
    WIDTH,
    E,
    T,
    array_annulus,
)

COLUMNS = 61  # of the problem that others were timed with: 305 nodes
STEPS = (114, 126)  # iterations of the other codes for their 20 equal steps
SOURCE = "six independent codes of bars and hinges"


@dataclass(frozen=True)
class Peer:
    """Another code on the arrays of 305 nodes.

    Attributes:
        name: for the plot.
        iteration_ms: least and most time of a Newton iteration, ms.
    """

    name: str
    iteration_ms: tuple[float, float]

    @property
    def fold_ms(self) -> tuple[float, float]:
        """Least and most time of the whole fold, ms."""
        return self.iteration_ms[0] * STEPS[0], self.iteration_ms[1] * STEPS[1]


PEERS = (
    Peer("the fastest other code (vectorised SciPy)", (4.4, 7.0)),
    Peer("the published MATLAB code, in Octave", (27.0, 27.0)),
    Peer("ports of it to Python", (121.0, 386.0)),
)


@dataclass(frozen=True)
class Own:
    """One way to solve the sheet here: a formulation on staggered cells, or mirrored ones for the shell."""

    formulation: str
    along: int
    rows: int

    @property
    def name(self) -> str:
        """For plot and checks."""
        return f"{self.formulation}, {self.along} x {self.rows}"

    def path(self) -> Path:
        """The sheet of the arrays, free, folded by its spring crease."""
        pattern = meshes.annulus_sector(RADIUS, WIDTH, SECTOR)
        kind: Kind = "mirrored" if self.formulation == "shell" else "staggered"
        mesh = meshes.structured(pattern, along=self.along, rows=self.rows, kind=kind)
        model = Model(mesh, Sheet(E=E, nu=0.0, t=T), formulation=self.formulation)
        return trace(model.fold("crease", rest=REST, Lstar=LSTAR))


OWN = (
    Own("consistent", 32, 2),
    Own("consistent", 64, 4),
    Own("consistent", 128, 8),
    Own("shell", 16, 1),
    Own("shell", 32, 2),
)
JUDGES = (Own("shell", 64, 4), Own("shell", 96, 6))
QUICK_JUDGES = (Own("shell", 16, 1), Own("shell", 32, 2))


def run(context: Context) -> CaseResult:
    """Energies of the arrays, then the error of every model against the shell."""
    result = CaseResult(
        name="peers",
        title="Side by side with other codes",
        question="What do other codes of bars and hinges give for the same sheet, and how long do they take?",
        source=SOURCE,
    )
    context.tell("peers: the arrays")
    arrays = {columns: _arrays(result, columns, context.quick) for columns in ENERGIES}
    context.tell("peers: the shell")
    coarse, truth = (own.path()[-1].energy.total for own in (QUICK_JUDGES if context.quick else JUDGES))
    bar = abs(truth - coarse)
    result.check("energy by the shell", truth, unit="N mm", params={"model": JUDGES[-1].name, "bar": bar})
    error = partial(_error, truth, bar)
    energy, cost = arrays[COLUMNS]
    points = [("these arrays, here", 1e3 * cost.wall_time_s, error(energy))]
    for own in OWN[:2] if context.quick else OWN:
        context.tell(f"peers: {own.name}")
        path, spent = measure(own.path, context.quick)
        points.append((own.name, 1e3 * spent.wall_time_s, error(path[-1].energy.total)))
    for name, ms, off in points:
        result.check("error of the energy", off, params={"model": name, "time_ms": ms, "bar": bar / truth})
    fastest = PEERS[0].fold_ms[0]
    result.check(
        "times that the fastest other code takes for the same arrays",
        fastest / (1e3 * cost.wall_time_s),
        params={"other_ms": fastest, "here_ms": 1e3 * cost.wall_time_s},
        source="measured; the time of the other code came with the problem",
    )
    result.plots.append(_plot(points, error(energy)))
    result.notes.append(
        f"Other codes solve the arrays in 20 equal steps of the rest angle, {STEPS[0]} to {STEPS[1]} iterations; here "
        "the increments are chosen. Their times came with the problem in November 2026, one thread, on a machine that "
        "is not known. All codes give the same energy for the arrays, so the error is that of one diagonal a cell."
    )
    return result


def _arrays(result: CaseResult, columns: int, quick: bool) -> tuple[float, Cost]:
    """Total energy of the array problem, which six codes agree on, and what it costs here."""
    model = array_annulus(columns).model()
    path, cost = measure(lambda: trace(model), quick)
    found = path[-1].energy
    for name, value, reference in zip(
        ("total", "bending", "folding"),
        (found.total, found.bending, found.folding),
        ENERGIES[columns],
        strict=True,
    ):
        result.check(
            f"{name} energy of the arrays",
            value,
            unit="N mm",
            reference=reference,
            tolerance=1e-8,
            params={"columns": columns, "iterations": path.iterations},
        )
    return found.total, cost


def _error(truth: float, bar: float, energy: float) -> float:
    """Relative; not below what is known of the truth."""
    return max(abs(energy - truth), bar) / truth


def _plot(points: list[tuple[str, float, float]], of_arrays: float) -> dict[str, object]:
    others = [line(peer.name, list(peer.fold_ms), [100.0 * of_arrays] * 2) for peer in PEERS]
    own = [line(name, [ms], [100.0 * off], "points") for name, ms, off in points]
    return plot(
        "peers-energy-time",
        "A sector of 120 degrees folded to 90 degrees: error of the energy",
        "time of the fold, ms",
        "error, %",
        [*own, *others],
        "Lines: what other codes take for the arrays of 305 nodes, from their least to their most. The truth is the "
        "shell; errors below what is known of it are drawn there.",
        log="xy",
    )
