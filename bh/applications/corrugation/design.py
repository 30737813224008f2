"""Inverse design of a corrugation: stiff in its weakest direction, or with a wanted ratio of stiffness, by simulation.

Every candidate is a member of `meshes.curved_corrugation` of the same flat area and depth. It is folded, and its
bending stiffness in all directions is read from the tangent (`bh.applications.corrugation.tangent`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import differential_evolution
from scipy.stats import qmc

from bh.applications.corrugation.folded import Folded
from bh.applications.corrugation.folding import LSTAR, POLYESTER, fold
from bh.applications.corrugation.tangent import Directional, tangent_bending
from bh.errors import InputError, ModelError
from bh.model.sheet import Sheet
from meshes import CreasePattern, curved_corrugation
from meshes.unstructured import sheet_area

Array = NDArray[np.float64]
BOUNDS = {"exponent": (1.5, 4.0), "root": (1.0, 2.5), "spread": (0.0, 1.0)}


@dataclass(frozen=True)
class Design:
    """Crease parameters of a corrugation (`meshes.curved_corrugation`)."""

    exponent: float
    root: float
    spread: float
    panels: int

    def pattern(self, area: float, aspect: float = 1.0) -> CreasePattern:
        """The pattern with a flat area (mm^2) and H / W = `aspect`.

        Args:
            area: of the flat sheet, mm^2.
            aspect: height over width, H / W.
        """
        unit = curved_corrugation(self.exponent, self.root, self.spread, 100.0, 100.0 * aspect, self.panels)
        scale = math.sqrt(area / sheet_area(unit))
        size = 100.0 * scale
        return curved_corrugation(self.exponent, self.root, self.spread, size, size * aspect, self.panels)


@dataclass(frozen=True, eq=False)
class Candidate:
    """A design and what its simulation says; `bending` is None where it cannot be folded so deep, `why` then tells."""

    design: Design
    bending: Directional | None
    why: str = ""

    @property
    def weakest(self) -> float:
        """Least stiffness over all directions, N/mm; 0 where there is none."""
        return 0.0 if self.bending is None else self.bending.weakest

    @property
    def isotropy(self) -> float:
        """Least over largest stiffness; 0 where there is none."""
        return 0.0 if self.bending is None else self.bending.isotropy

    @property
    def ratio(self) -> float:
        """k_x / k_y, nan where there is none."""
        if self.bending is None:
            return math.nan
        return self.bending.about(0.0) / self.bending.about(0.5 * math.pi)


@dataclass(frozen=True)
class Task:
    """What all candidates have in common.

    Attributes:
        area: of the flat sheet, mm^2 (that of the parabolic patterns of the source by default).
        depth: of the folded sheet, mm.
        panels: numbers of panels to choose from.
        sheet: material and thickness.
        Lstar: length scale of the creases, mm.
        span: of the bending, mm.
        along: cells along the creases.
        rows: of cells in a panel.
        formulation: of the simulation.
        directions: that stiffness is looked at in.
    """

    area: float = 2e4 / 3.0
    depth: float = 6.0
    panels: tuple[int, ...] = (4, 5, 6)
    sheet: Sheet = POLYESTER
    Lstar: float = LSTAR
    span: float = 50.0
    along: int = 28
    rows: int = 2
    formulation: str = "consistent"
    directions: int = 12

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name in ("area", "depth", "span"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ModelError(f"{name} = {value} of a design cannot be; give a positive number")
        if not self.panels:
            raise ModelError("a design needs at least one number of panels to choose from")

    def folded(self, design: Design) -> Folded:
        """The design, folded and laid down.

        Raises:
            ModelError: it cannot be folded so deep.
        """
        return fold(
            design.pattern(self.area),
            self.depth,
            sheet=self.sheet,
            Lstar=self.Lstar,
            along=self.along,
            rows=self.rows,
            formulation=self.formulation,
        )

    def simulate(self, design: Design) -> Candidate:
        """Fold a design and probe it; what cannot be folded or does not reach the supports says so."""
        try:
            return Candidate(design, tangent_bending(self.folded(design), self.directions, self.span))
        except InputError as refused:
            return Candidate(design, None, str(refused))


@dataclass(frozen=True, eq=False)
class Front:
    """All candidates of a search, and those that no other one beats in both stiffness and isotropy."""

    task: Task
    candidates: tuple[Candidate, ...] = field(repr=False)

    @property
    def best(self) -> tuple[Candidate, ...]:
        """The Pareto front of largest weakest-direction stiffness against isotropy, by rising isotropy."""
        solved = sorted(
            (c for c in self.candidates if c.bending is not None), key=lambda c: (c.isotropy, c.weakest)
        )
        kept: list[Candidate] = []
        for item in reversed(solved):
            if not kept or item.weakest > kept[-1].weakest:
                kept.append(item)
        return tuple(reversed(kept))


def pareto(
    task: Task | None = None,
    *,
    population: int = 24,
    generations: int = 6,
    seed: int = 1,
    known: Sequence[Design] = (),
) -> Front:
    """Front of weakest-direction stiffness against isotropy by NSGA-II (pymoo).

    Begins with a Sobol sample, some of which are replaced by `known` designs.

    Args:
        task: what all candidates have in common.
        population: candidates a generation.
        generations: how many.
        seed: the same seed gives the same front.
        known: designs to begin with.

    Raises:
        ModelError: pymoo is missing; add the extra "design".
    """
    job = task or Task()
    pymoo = _pymoo()
    found: list[Candidate] = []

    class Problem(pymoo.Problem):  # type: ignore[misc, name-defined]
        def __init__(self) -> None:
            super().__init__(n_var=4, n_obj=2, xl=np.zeros(4), xu=np.ones(4))

        def _evaluate(self, x: Array, out: dict[str, Array], *_: object, **__: object) -> None:
            here = [job.simulate(_design(row, job)) for row in x]
            found.extend(here)
            out["F"] = np.array([[-c.weakest, -c.isotropy] for c in here])

    if len(known) > population:
        raise ModelError(f"a population of {population} has no room for {len(known)} known designs")
    start = qmc.Sobol(4, seed=seed).random(population)
    for k, design in enumerate(known):
        start[k] = _numbers(design, job)
    method = pymoo.NSGA2(pop_size=population, sampling=start)
    pymoo.minimize(Problem(), method, ("n_gen", generations), seed=seed, verbose=False)
    return Front(job, tuple(found))


def with_ratio(
    wanted: float, task: Task | None = None, *, iterations: int = 6, population: int = 6, seed: int = 1
) -> Candidate:
    """The stiffest design whose k_x / k_y is as wanted, by differential evolution (SciPy).

    Minimises (ln of the ratio over the wanted one)^2, less a hundredth of the ln of the weakest stiffness.

    Args:
        wanted: k_x / k_y.
        task: what all candidates have in common.
        iterations: generations of the search.
        population: candidates for each of the four variables.
        seed: the same seed gives the same design.

    Raises:
        ModelError: a ratio that cannot be, or nothing that folds was found.
    """
    if not (math.isfinite(wanted) and wanted > 0.0):
        raise ModelError(f"k_x / k_y = {wanted} cannot be; give a positive number")
    task = task or Task()
    task = replace(task, directions=max(2, task.directions + task.directions % 2))
    found: list[tuple[float, Candidate]] = []

    def missed(x: Array) -> float:
        item = task.simulate(_design(x, task))
        cost = 1e3
        if item.bending is not None and item.ratio > 0.0 and item.weakest > 0.0:
            cost = math.log(item.ratio / wanted) ** 2 - 0.01 * math.log(item.weakest)
        found.append((cost, item))
        return cost

    differential_evolution(
        missed,
        [(0.0, 1.0)] * 4,
        maxiter=iterations,
        popsize=population,
        seed=seed,
        polish=False,
        init="sobol",
    )
    cost, best = min(found, key=lambda each: each[0])
    if cost >= 1e3:
        raise ModelError("no design that folds so deep was found; allow other panels, depths or areas")
    return best


def _design(x: Sequence[float] | Array, task: Task) -> Design:
    """A design from four numbers in [0, 1]."""
    values = {
        name: low + float(part) * (high - low)
        for part, (name, (low, high)) in zip(x, BOUNDS.items(), strict=False)
    }
    index = min(int(float(x[3]) * len(task.panels)), len(task.panels) - 1)
    return Design(panels=task.panels[index], **values)


def _numbers(design: Design, task: Task) -> Array:
    """The four numbers in [0, 1] of a design within the bounds."""
    if design.panels not in task.panels:
        raise ModelError(f"a known design has {design.panels} panels, which are not among {task.panels}")
    parts = [(getattr(design, name) - low) / (high - low) for name, (low, high) in BOUNDS.items()]
    return np.asarray(
        np.clip([*parts, (task.panels.index(design.panels) + 0.5) / len(task.panels)], 0.0, 1.0)
    )


def _pymoo() -> SimpleNamespace:
    """The parts of pymoo that are used, in one name space."""
    try:
        from pymoo.algorithms.moo.nsga2 import NSGA2
        from pymoo.config import Config
        from pymoo.core.problem import Problem
        from pymoo.optimize import minimize
    except ImportError as missing:
        raise ModelError(
            f"the Pareto front needs pymoo ({missing}); add the extra: pip install 'curved-crease-workbench[design]'"
        ) from missing
    Config.warnings["not_compiled"] = False
    return SimpleNamespace(NSGA2=NSGA2, Problem=Problem, minimize=minimize)
