"""Case `hard_cases`: what breaks other solvers, each with a reference of its own, all with default settings."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

import meshes
from bh import ArcLength, Model, ModelError, Path, Sheet, trace
from bh.formulations import formulation
from bh.mechanics.elements import sheet_elements
from bh.model import ElementStiffness
from bh.program import program
from bh.solvers.arc_length import Cylindrical, Generalised
from bh.solvers.increments import point
from bh.solvers.linear import linear_response
from verification.campaign import FINE
from verification.checks import CaseResult, Check, Context, cost_of, line, plot
from verification.cone import circle_radius
from verification.theory import cone
from verification.toys import VonMisesTruss

Found = Iterator[Check]


def _check(
    quantity: str, value: float, unit: str, reference: float | None, source: str, tolerance: float | None,
    path: Path | None = None, **params: Any,
) -> Check:  # fmt: skip
    cost = {} if path is None else cost_of(path)
    outcome = "reached" if path is None else path.outcome
    return Check(
        "hard_cases", quantity, params, value, unit, reference, source, tolerance, outcome=outcome, **cost
    )


def annulus(along: int = 48, t: float = 0.127, kind: Any = "staggered", **sector: float) -> Model:
    """A free creased sector: radius 100, width 10 each side, 45 degrees unless said otherwise."""
    size: dict[str, Any] = {"radius": 100.0, "width": 10.0, "angle": math.pi / 4, **sector}
    return Model(
        meshes.structured(meshes.annulus_sector(**size), along=along, kind=kind), Sheet(E=4000.0, t=t)
    )


# ------------------------------------------------------------------------------------ deep folding (Fig. 5.3)

KAPPA_0 = 0.005


def deep_model(stretching: float) -> Model:
    """The sector of Fig. 5.3: kappa_0 = 0.005 /mm, L = 100, w = 5, t = 0.5 mm, bars `stretching` times as stiff."""
    model = annulus(along=160, t=0.5, radius=1.0 / KAPPA_0, width=5.0, angle=100.0 * KAPPA_0)
    flat = model.fold("crease", to=math.pi - 1e-3)
    angles = np.full(len(model.mesh.topology.hinges), math.pi)
    bare = sheet_elements(model, program(flat)[0], angles, 0.0 * angles)
    hinges = np.zeros(len(angles))
    hinges[bare.source] = np.where(np.arange(len(bare.source)) < bare.bending, bare.hinge_stiffness, 0.0)
    return replace(model, stiffness=ElementStiffness(stretching * bare.bar_stiffness, hinges))


def deep_folding(result: CaseResult) -> Found:
    """From flat to 1 degree: the isometric curvature first, then a peak, then flattening."""
    series = []
    peaks = {}
    for stretching in (0.5, 1.0, 1.5):
        path = trace(deep_model(stretching).fold("crease", to=math.radians(1.0)), strategy=FINE)
        ratios, angles = [], []
        for state in path[1:]:
            middle = state.crease_points("crease")[40:-40]
            ratios.append(1.0 / (circle_radius(middle) * KAPPA_0))
            angles.append(float(state.dihedral("crease").mean()))
        series.append(line(f"c_s = {stretching:g}", np.degrees(angles).tolist(), ratios))
        peaks[stretching] = (max(ratios), math.degrees(angles[int(np.argmax(ratios))]))
        if stretching != 1.0:
            continue
        source = "Fuchs and Tabachnikov 1999: 1 / sin(phi / 2)"
        for angle, ratio in zip(angles, ratios, strict=True):
            if angle >= math.pi / 3:
                yield _check("deep folding: kappa / kappa_0", ratio, "", 1.0 / math.sin(angle / 2), source, 0.02,
                             path, dihedral_deg=round(math.degrees(angle), 3))  # fmt: skip
        yield _check("deep folding: kappa / kappa_0 at 1 degree over the peak", ratios[-1] / max(ratios), "", None,
                     "source Fig. 5.3 (b): falls after about 3.6 degrees", None, path)  # fmt: skip
        usual = trace(deep_model(1.0).fold("crease", to=math.radians(1.0)))
        yield _check("deep folding: total energy at 1 degree", usual[-1].energy.total, "N mm",
                     path[-1].energy.total, "four times finer increments", 1e-6, usual)  # fmt: skip
    for stretching, (ratio, degrees) in peaks.items():
        yield _check("deep folding: peak of kappa / kappa_0", ratio, "", None, "source Fig. 5.3 (b)", None,
                     c_s=stretching, at_deg=round(degrees, 2))  # fmt: skip
    order = peaks[0.5][0] < peaks[1.0][0] < peaks[1.5][0]
    yield _check("deep folding: stiffer sheets peak higher", float(order), "", 1.0, "source 5.3", 0.0)
    exact = np.linspace(6.0, 170.0, 83)
    series.append(
        line("isometric", exact.tolist(), (1.0 / np.sin(np.radians(exact) / 2)).tolist(), "reference")
    )
    result.plots.append(
        plot("hard-deep", "Deep folding", "dihedral angle, degrees", "kappa / kappa_0", series,
             "Curvature of the crease from flat to 1 degree; bars c_s times as stiff (Fig. 5.3).", log="xy")
    )  # fmt: skip


# ------------------------------------------------------------------------------------ extreme parameters


def crease_stiffness(result: CaseResult) -> Found:
    """L* over five decades: a stiff crease reaches its rest angle, a soft one lets the sheet win."""
    reached = []
    for Lstar in (0.01, 0.1, 1.0, 10.0, 100.0, 700.0):
        path = trace(annulus().fold("crease", rest=math.pi / 2, Lstar=Lstar))
        fine = trace(annulus().fold("crease", rest=math.pi / 2, Lstar=Lstar), strategy=FINE)
        reached.append(float(path[-1].dihedral("crease").mean()))
        yield _check("L*: total energy", path[-1].energy.total, "N mm", fine[-1].energy.total,
                     "four times finer increments", 1e-7, path, Lstar_mm=Lstar)  # fmt: skip
    ordered = all(a < b for a, b in pairwise(reached))
    yield _check("L*: softer creases stay more open", float(ordered), "", 1.0, "energy", 0.0)
    yield _check("L* = 0.01: dihedral angle", reached[0], "rad", math.pi / 2, "rigid crease", 1e-3)


def thickness(result: CaseResult) -> Found:
    """t over two decades at fixed size: bending energy goes with t^3."""
    unit = None
    for t in (0.01, 0.03, 0.1, 0.3, 1.0, 2.0):
        path = trace(annulus(t=t).fold("crease", to=math.pi / 2))
        D = Sheet(E=4000.0, t=t).bending_stiffness()
        ratio = path[-1].energy.total / cone.bending_energy(D, math.pi / 4, 90.0, 110.0, math.pi / 2)
        unit = ratio if unit is None else unit
        yield _check("thickness: energy over the cone's", ratio, "", 1.0, "Eq. 3.13 integrated",
                     0.03 if t <= 0.3 else None, path, t_mm=t)  # fmt: skip


def slenderness(result: CaseResult) -> Found:
    """alpha from 0.5 to 30: iterations do not grow."""
    for alpha in (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0):
        mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, math.pi / 4), aspect_ratio=alpha)
        path = trace(Model(mesh, Sheet(E=4000.0, t=0.127)).fold("crease", to=math.pi / 2))
        yield _check("slender cells: iterations from flat to 90 degrees", float(path.iterations), "", None,
                     "at most 60", None, path, alpha=alpha)  # fmt: skip
        yield _check("slender cells: at most 60 iterations", float(path.iterations <= 60), "", 1.0, "target", 0.0,
                     path, alpha=alpha)  # fmt: skip


def flat_start(result: CaseResult) -> Found:
    """Exactly flat: mountain goes up, valley down, mirror images of each other."""
    up = trace(annulus().fold("crease", to=2.0))
    down = trace(annulus().fold("crease", to=2.0 * math.pi - 2.0))
    rise = [float(p[-1].crease_points("crease")[:, 2].mean() - p[-1].points[:, 2].mean()) for p in (up, down)]
    yield _check("flat start: mountain crease rises", float(rise[0] > 0.0), "", 1.0, "convention", 0.0, up)
    yield _check("flat start: valley over mountain energy", down[-1].energy.total / up[-1].energy.total, "", 1.0,
                 "mirror symmetry", 1e-9, down)  # fmt: skip
    yield _check("flat start: rise of the valley over that of the mountain", rise[1] / rise[0], "", -1.0,
                 "mirror symmetry", 1e-7, down)  # fmt: skip


def ring(result: CaseResult) -> Found:
    """A full annulus buckles out of its plane; both mirror images have one energy."""
    mesh = meshes.structured(meshes.full_annulus(100.0, 10.0), along=64)
    energies = []
    for to in (2.2, 2.0 * math.pi - 2.2):
        path = trace(Model(mesh, Sheet(E=4000.0, t=0.127)).fold("crease", to=to))
        crease = path[-1].crease_points("crease")
        plane = np.linalg.svd(crease - crease.mean(axis=0), compute_uv=False)[2] / math.sqrt(len(crease))
        energies.append(path[-1].energy.total)
        yield _check("ring: rms distance of the crease from its plane", float(plane), "mm", None,
                     "planar before it buckles", None, path, dihedral=round(to, 4))  # fmt: skip
        yield _check("ring: out of plane", float(plane > 1.0), "", 1.0, "must buckle", 0.0, path)
    yield _check(
        "ring: energy of the mirror image", energies[1], "N mm", energies[0], "mirror symmetry", 1e-6
    )


def back_to_flat(result: CaseResult) -> Found:
    """Fold to 60 degrees and unfold: nothing is left."""
    path = trace(annulus().fold("crease", to=math.pi / 3).fold("crease", to=math.pi))
    peak = max(state.energy.total for state in path)
    left = path[-1].energy.total / peak
    yield _check("fold and unfold: energy left over its peak", left, "", 0.0, "elastic", 1e-10, path)


# ------------------------------------------------------------------------------------ limit points and buckling


def trusses(result: CaseResult) -> Found:
    """Von Mises truss through snap-through and snap-back by arc length, against the exact curve."""
    series = []
    for spring in (None, 0.5, 0.05):
        toy = VonMisesTruss(spring=spring)
        start = point(toy, np.zeros(toy.size), 0.0)
        for generalised in (False, True):
            found = list(
                ArcLength(control=Generalised() if generalised else Cylindrical()).follow(toy, [start])
            )
            lam = np.array([item.point.lam for item in found])
            w = np.array([item.point.q[0] for item in found])
            off = float(np.abs(toy.load(w) - lam).max()) if found[-1].outcome == "reached" else math.nan
            params: dict[str, Any] = {
                "spring": "none" if spring is None else spring,
                "control": "MGDCM" if generalised else "arc",
            }
            yield _check("truss: distance from the exact path", off, "", 0.0, "closed form", 1e-7, **params)
            unstable = {item.negative for item in found if toy.limit() < 1.0}
            yield _check("truss: unstable states counted", float(unstable == {0, 1}), "", 1.0, "one negative mode",
                         0.0, **params)  # fmt: skip
            if not generalised:
                top = np.array([item.point.q[-1] for item in found])
                series.append(line(f"spring {params['spring']}", top.tolist(), lam.tolist()))
    w = np.linspace(0.0, 2.7, 200)
    series.append(line("exact, no spring", w.tolist(), VonMisesTruss().load(w).tolist(), "reference"))
    result.plots.append(
        plot("hard-truss", "Von Mises truss", "displacement of the load, mm", "lambda", series,
             "Through limit points and snap-back by arc length.")
    )  # fmt: skip


def euler_buckling(result: CaseResult) -> Found:
    """Critical load of a simply supported strip, from the inertia of the flat state by bisection."""
    length, width, t, E = 100.0, 10.0, 0.5, 4000.0
    exact = math.pi**2 * E * width * t**3 / 12.0 / length**2
    for alpha in (2.0, 4.0, 8.0, 16.0):
        mesh = meshes.structured(meshes.strip(length, width), aspect_ratio=alpha)
        model = Model(mesh, Sheet(E=E, t=t)).support("edge:start", "xz").support("edge:end", "z")
        model = model.support("corner:inner-start", "y").support("corner:inner-end", "y")
        squeeze = 3.0 * exact * length / (E * width * t)
        model = model.displace("edge:end", "x", -squeeze)
        form = formulation(model.formulation)
        system = form.system(model, program(model)[0], None)
        in_plane = linear_response(system, system.start()).dq  # the strip stays flat, and strains are 1e-4
        low, high, force = 0.0, 1.0, math.nan
        for _ in range(30):
            lam = 0.5 * (low + high)
            q = lam * in_plane
            _, negative = system.tangent(q, lam, system.evaluate(q, lam).forces).factorise_any()
            state = form.observe(model, system, q, lam)
            force = -float(state.reaction("edge:end")[0])
            low, high = (lam, high) if negative == 0 else (low, lam)
        yield _check("Euler buckling: critical load", force, "N", exact, "pi^2 E I / L^2",
                     0.02 if alpha >= 8.0 else None, alpha=alpha, mesh="staggered")  # fmt: skip


def mechanism(result: CaseResult) -> Found:
    """Missing supports are named with the motions that they leave."""
    said = ""
    try:
        trace(annulus().support("corner:inner-start", "xyz").fold("crease", to=2.0))
    except ModelError as error:
        said = str(error)
    named = "rotation about z" in said and "\n" not in said
    yield _check("mechanism: named with its motions", float(named), "", 1.0, "one-line error", 0.0)


STUDIES: dict[str, Callable[[CaseResult], Found]] = {
    "deep folding": deep_folding,
    "L*": crease_stiffness,
    "thickness": thickness,
    "slender cells": slenderness,
    "flat start": flat_start,
    "ring": ring,
    "fold and unfold": back_to_flat,
    "trusses": trusses,
    "Euler buckling": euler_buckling,
    "mechanism": mechanism,
}


def run(context: Context) -> CaseResult:
    """Every study, one after another."""
    result = CaseResult(
        name="hard_cases",
        title="Hard cases",
        question="Does the solver get through what breaks others, with default settings?",
        source="closed forms, finer increments, published curves; each record names its own",
    )
    for name, study in STUDIES.items():
        context.tell(f"hard_cases: {name}")
        result.checks.extend(study(result))
    return result
