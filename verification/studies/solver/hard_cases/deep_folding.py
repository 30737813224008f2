"""Deep folding (source Fig. 5.3): isometric at first, then a peak of the curvature, then flattening."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from bh import Model, trace
from bh.loading.program import program
from bh.mechanics.bars_and_hinges.elements import sheet_elements
from bh.model.model import ElementStiffness
from verification.framework.checks import CaseResult, line, plot
from verification.studies.ch3.cone import circle_radius
from verification.studies.solver.campaign import FINE
from verification.studies.solver.hard_cases.common import Found, annulus, check

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
                yield check("deep folding: kappa / kappa_0", ratio, "", 1.0 / math.sin(angle / 2), source, 0.02,
                             path, dihedral_deg=round(math.degrees(angle), 3))  # fmt: skip
        yield check("deep folding: kappa / kappa_0 at 1 degree over the peak", ratios[-1] / max(ratios), "", None,
                     "source Fig. 5.3 (b): falls after about 3.6 degrees", None, path)  # fmt: skip
        usual = trace(deep_model(1.0).fold("crease", to=math.radians(1.0)))
        yield check("deep folding: total energy at 1 degree", usual[-1].energy.total, "N mm",
                     path[-1].energy.total, "four times finer increments", 1e-6, usual)  # fmt: skip
    for stretching, (ratio, degrees) in peaks.items():
        yield check("deep folding: peak of kappa / kappa_0", ratio, "", None, "source Fig. 5.3 (b)", None,
                     c_s=stretching, at_deg=round(degrees, 2))  # fmt: skip
    order = peaks[0.5][0] < peaks[1.0][0] < peaks[1.5][0]
    yield check("deep folding: stiffer sheets peak higher", float(order), "", 1.0, "source 5.3", 0.0)
    exact = np.linspace(6.0, 170.0, 83)
    series.append(
        line("isometric", exact.tolist(), (1.0 / np.sin(np.radians(exact) / 2)).tolist(), "reference")
    )
    result.plots.append(
        plot("hard-deep", "Deep folding", "dihedral angle, degrees", "kappa / kappa_0", series,
             "Curvature of the crease from flat to 1 degree; bars c_s times as stiff (Fig. 5.3).", log="xy")
    )  # fmt: skip
