"""Random scenes of case `contact`: sheets that are folded or pulled until their panels meet, and what becomes of them.

Every scene is solved with default settings and with increments of a quarter. That nothing passes through anything is
looked at in every accepted state by the predicate of `bh.contact`, which shares nothing with the barrier.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

import bh
import meshes
from bh.analysis.contact import first_contact
from bh.errors import InputError
from meshes.library import alternating
from verification.framework.random_scenes import Clock, OutOfTimeError
from verification.studies.solver.branches import FINE, telling

SEED = 7919
KINDS = ("letter", "pleats", "sector", "pulled")
NAMES = ("consistent", "bars-and-hinges")
LEAST = 1e-6  # E t^3: smaller energies are none
COARSE_S, FINE_S = 60.0, 240.0  # processor time


@dataclass(frozen=True)
class Row:
    """What became of a scene.

    Attributes:
        number: of the scene.
        words: the scene.
        outcome: of the default run, "refused", or "out of time".
        reason: of a run that did not reach.
        pressed: do panels press on each other in a state?
        crossing: the first state that meets itself by the independent predicate; empty where none does.
        fine: outcome with finer increments; empty where it was not tried.
        apart: difference of the total energies, in parts of the larger; nan without both.
        told: remarks of the default run that tell of branches and jumps.
        iterations: of the default run.
        seconds: its processor time.
    """

    number: int
    words: str
    outcome: str
    reason: str = ""
    pressed: bool = False
    crossing: str = ""
    fine: str = ""
    apart: float = math.nan
    told: tuple[str, ...] = ()
    iterations: int = 0
    seconds: float = 0.0


def drawn(number: int, seed: int = SEED) -> tuple[str, bh.Model]:
    """Scene `number` of a seed in words, and its model.

    Args:
        number: from 0.
        seed: of all scenes.
    """
    random = np.random.default_rng([seed, number])
    kind = KINDS[number % len(KINDS)]
    name = NAMES[int(random.integers(len(NAMES)))]
    t = float(random.uniform(0.08, 0.3))
    gap = float(random.choice([0.05, 0.1, 0.2]))
    wide = float(random.uniform(10.0, 20.0))  # of a panel
    lstar = float(random.choice([5.0, 20.0]))
    degrees = float(random.uniform(130.0, 165.0))
    folds = alternating(3)
    if kind in ("letter", "pulled"):
        pattern = meshes.strip(wide, 3.0 * wide, [wide, 2.0 * wide], ["mountain"] * 2)
    elif kind == "pleats":
        shares = np.sort(random.uniform(0.2, 0.8, 3)) + np.arange(3)
        pattern = meshes.strip(1.5 * wide, 4.0 * wide, (wide * shares).tolist(), folds)
    else:
        radius = float(random.uniform(60.0, 120.0))
        width = 0.5 * wide
        pattern = meshes.annulus_sector(
            [radius + width * k for k in range(3)], width, float(random.uniform(0.6, 1.5)), folds
        )
    along = int(random.integers(4, 9)) * (2 if kind == "sector" else 1)
    mesh = meshes.structured(pattern, along=along, rows=4 if kind in ("letter", "pulled") else 2)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, nu=0.3, t=t), formulation=name, contact=gap)
    for crease in mesh.creases:
        model = model.crease(crease, Lstar=lstar)
    first = 100.0 if kind == "pulled" else degrees
    signs = [1.0, 1.0] if kind in ("letter", "pulled") else [1.0, -1.0, 1.0]
    model = model.step(
        *(
            bh.Fold(crease, by=sign * math.radians(first))
            for crease, sign in zip(mesh.creases, signs, strict=True)
        )
    )
    if kind == "pulled":  # one of the outer panels is folded on against the other
        model = model.step(bh.Fold(mesh.creases[0], by=math.radians(degrees)))
    words = f"{kind}, panels of {wide:.1f} mm, t = {t:.2f}, gap {gap:g}, {name}, {degrees:.0f} degrees"
    return words, model


def play(number: int) -> Row:
    """Solve a scene twice and look at every state.

    Args:
        number: of the scene.
    """
    words, model = drawn(number)
    began = time.process_time()
    try:
        path = bh.trace(model, progress=Clock(COARSE_S), warn=False, estimate=False)
    except InputError as error:
        return Row(number, words, "refused", str(error))
    except OutOfTimeError:
        return Row(number, words, "out of time")
    seconds = time.process_time() - began
    met = first_contact(path)
    pressed = any(state.energy.contact > 0.0 for state in path)
    found = Row(
        number,
        words,
        str(path.outcome),
        path.reason,
        pressed,
        "" if met is None else str(met),
        told=telling(path),
        iterations=sum(step.iterations for step in path.steps) + sum(r.iterations for r in path.records),
        seconds=seconds,
    )
    if not path.reached:
        return found
    try:
        fine = bh.trace(
            model, strategy=bh.Automatic(load=FINE), progress=Clock(FINE_S), warn=False, estimate=False
        )
    except OutOfTimeError:
        return Row(**{**vars(found), "fine": "out of time"})
    apart = math.nan
    if fine.reached:
        one, other = path[-1].energy.total, fine[-1].energy.total
        apart = abs(one - other) / max(abs(one), abs(other), LEAST * model.sheet.E * model.sheet.t**3)
    return Row(**{**vars(found), "fine": str(fine.outcome), "apart": apart})
