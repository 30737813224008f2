"""Random scenes of case `branches`: small meshes, soft sheets, several steps, all kinds of loads."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import meshes
from bh import Displace, Fold, Force, Model, Moment, Pinch, Sheet, Step, Until
from meshes.library import alternating

SEED = 1729
SOFT, STIFF = (0.02, 0.2), (0.2, 0.5)  # thickness, mm
KINDS = ("sector", "sector", "wide", "strip", "ring", "sector", "pleats", "sines")
STRAIGHT = ("strip", "sines")  # outer corners lie above inner ones, along y
NAMES = ("bars-and-hinges", "consistent")
FOLDS = (10.0, 120.0)  # degrees
LSTAR = (5.0, 20.0, 60.0, 200.0)  # mm
ENERGY = 1e-4  # N mm, of a step that ends at an energy: times E t^3 / (1000 N mm)


@dataclass(frozen=True)
class Drawn:
    """A scene: what it is in words, and its model."""

    words: str
    model: Model


def drawn(number: int, seed: int = SEED) -> Drawn:
    """Scene `number` of a seed: a sheet, how it is held, and one to four steps.

    Args:
        number: from 0.
        seed: of all scenes.
    """
    random = np.random.default_rng([seed, number])
    kind = KINDS[int(random.integers(len(KINDS)))]
    mesh, words = _sheet(kind, random)
    name = NAMES[int(random.integers(len(NAMES)))]
    soft = bool(random.random() < 0.6)
    low, high = SOFT if soft else STIFF
    t = 10.0 ** float(random.uniform(math.log10(low), math.log10(high)))
    nu = float(random.choice([0.0, 0.3]))
    model = Model(mesh, Sheet(E=4000.0, nu=nu, t=t), formulation=name, contact=False)
    held = kind != "ring" and bool(random.random() < 0.4)
    if held:
        model = model.support("corner:inner-start", "xyz").support(
            "corner:outer-start", "xz" if kind in STRAIGHT else "yz"
        )
        model = model.support("corner:inner-end", "z")
    told = [f"{words}, t = {t:.3f}", name, "held at three corners" if held else "free"]
    steps = int(random.choice([1, 1, 2, 2, 3, 4]))
    spring = bool(random.random() < 0.6)
    lstar = float(random.choice(LSTAR))
    if spring:
        for crease in mesh.creases:
            model = model.crease(crease, Lstar=lstar)
    for _ in range(steps):
        step, what = _step(model, random, spring, held, _folded(model))
        model = model.step(*step.actuations, until=step.until)
        told.append(what)
    return Drawn("; ".join(told), model)


def _sheet(kind: str, random: np.random.Generator) -> tuple[meshes.SheetMesh, str]:
    along = int(random.integers(6, 15))
    rows = int(random.choice([1, 1, 2]))
    radius = float(random.uniform(50.0, 150.0))
    width = radius * float(random.uniform(0.06, 0.15) if kind != "wide" else random.uniform(0.25, 0.5))
    if kind in ("sector", "wide"):
        creases = int(random.choice([1, 1, 2])) if kind == "sector" else 1
        angle = float(random.uniform(0.3, 1.5 if kind == "wide" else 3.0))
        radii = [radius + 1.2 * width * k for k in range(creases)]
        pattern = meshes.annulus_sector(radii, width, angle, alternating(creases))
        words = f"{kind} of {creases}, R = {radius:.0f}, w = {width:.0f}, {angle:.2f} rad"
    elif kind == "strip":
        length = float(random.uniform(40.0, 120.0))
        pattern = meshes.strip(length, 2.0 * width, [width], ["mountain"])
        words = f"strip {length:.0f} x {2.0 * width:.0f}"
    elif kind == "ring":
        along = 4 * int(random.integers(4, 8))
        pattern = meshes.full_annulus([radius], width)
        words = f"ring, R = {radius:.0f}, w = {width:.0f}"
    elif kind == "pleats":
        pattern = meshes.annulus_sector(
            [radius + width * k for k in range(3)], width, float(random.uniform(0.4, 1.2)), alternating(3)
        )
        words = f"three pleats, R = {radius:.0f}, w = {width:.0f}"
    else:
        pattern = meshes.sine_tessellation(100.0, 80.0, 2, float(random.uniform(3.0, 10.0)), 1.5)
        words = "two sines"
    return meshes.structured(pattern, along=along, rows=rows), words


def _step(
    model: Model, random: np.random.Generator, spring: bool, held: bool, folded: bool
) -> tuple[Step, str]:
    """A step, and what it is in words; a free sheet is only folded."""
    ways: list[Callable[[], tuple[Step, str]]] = [lambda: _fold(model, random, spring)]
    if spring:
        ways.append(lambda: _couple(model, random))
    if held:
        ways += [lambda: _moved(model, random), lambda: _pulled(model, random)]
    if folded and not spring:
        ways.append(lambda: _pinched(model, random))
    return ways[int(random.integers(len(ways)))]()


def _folded(model: Model) -> bool:
    """Whether the first crease is held at a fold that a pinch can sharpen."""
    folds = [item for step in model.steps for item in step.actuations if isinstance(item, Fold)]
    angles = [item.by for item in folds if item.crease in ("all", model.mesh.creases[0])]
    return bool(angles) and isinstance(angles[-1], float) and 0.0 < angles[-1] < 1.0


def _fold(model: Model, random: np.random.Generator, spring: bool) -> tuple[Step, str]:
    by = float(random.uniform(*FOLDS)) * float(random.choice([1.0, 1.0, 1.0, -1.0]))
    crease = "all" if random.random() < 0.7 else model.mesh.creases[0]
    sense = "" if by > 0.0 else ", the other way"
    until, end = None, ""
    if spring and random.random() < 0.25:
        value = ENERGY * float(10.0 ** random.uniform(0.0, 2.0)) * 4000.0 * model.sheet.t**3
        until, end = Until("energy", value), f" until energy = {value:.3g}"
    return Step(
        (Fold(crease, by=math.radians(by)),), until
    ), f"fold {crease} {abs(by):.0f} degrees{sense}{end}"


def _couple(model: Model, random: np.random.Generator) -> tuple[Step, str]:
    size = 4000.0 * model.sheet.t**3 / 12.0 * float(10.0 ** random.uniform(-3.0, -0.7))
    return Step((Moment("all", to=size),)), f"couple {size:.2g} N"


def _moved(model: Model, random: np.random.Generator) -> tuple[Step, str]:
    by = model.mesh.size * float(random.uniform(-0.3, 0.3))
    return Step((Displace("corner:outer-end", (0.0, 0.0, 1.0), by),)), f"corner by {by:.1f} mm"


def _pulled(model: Model, random: np.random.Generator) -> tuple[Step, str]:
    size = model.mesh.size
    force = 4000.0 * model.sheet.t**3 / size * float(10.0 ** random.uniform(-1.5, 1.0))
    direction = random.normal(size=3)
    total = tuple(float(x) for x in force * direction / np.linalg.norm(direction))
    return Step((Force("corner:outer-end", total),)), f"pull of {force:.2g} N"


def _pinched(model: Model, random: np.random.Generator) -> tuple[Step, str]:
    at = float(random.uniform(0.2, 0.8))
    fold = math.radians(float(random.uniform(60.0, 140.0)))
    crease = model.mesh.creases[0]  # folded by less than a radian
    return Step(
        (Pinch(crease, at=at, by=fold, length=0.4 * _length(model, crease)),)
    ), f"pinch at {at:.2f} to {math.degrees(fold):.0f} degrees"


def _length(model: Model, crease: str) -> float:
    """Of a crease along the mesh, mm."""
    ends = model.mesh.points[model.mesh.crease_edges(crease)]
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())
