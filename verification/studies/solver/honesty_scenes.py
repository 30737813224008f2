"""Random scenes of case `honesty`: narrow sheets, wide panels, closed rings, several creases and drawn networks."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import meshes
from bh import Goal, Model, Sheet
from meshes.choices import first_mesh
from meshes.io import read_pattern
from meshes.library import alternating
from meshes.pattern import CreasePattern

WITHIN = (0.1, 0.05, 0.02, 0.01)
SPRINGS = (10.0, 25.0, 60.0)  # L*, mm
KINDS = ("narrow", "wide", "several", "narrow", "network", "narrow", "wide", "ring", "narrow", "several")


@dataclass(frozen=True)
class Draw:
    """One scene: what it is in words, its model on some mesh, and what is asked for."""

    words: str
    model: Model
    goal: Goal


def kind_of(number: int) -> str:
    """The kind of a scene; kinds take turns, six of ten are not narrow."""
    return KINDS[number % len(KINDS)]


def draw(seed: int, number: int) -> Draw:
    """Scene `number` of a seed."""
    rng = np.random.default_rng([seed, number])
    makers: dict[str, Callable[[np.random.Generator], Draw]] = {
        "narrow": narrow,
        "wide": wide,
        "ring": ring,
        "several": several,
        "network": network,
    }
    return makers[kind_of(number)](rng)


def paper(rng: np.random.Generator) -> Sheet:
    """Card of a random thickness."""
    return Sheet(E=4000.0, nu=float(rng.choice([0.0, 0.2, 0.38])), t=float(rng.choice([0.127, 0.2, 0.3])))


def _asked(rng: np.random.Generator) -> float:
    return float(rng.choice(WITHIN))


def _folded(
    rng: np.random.Generator, model: Model, low: float, high: float, spring: bool
) -> tuple[Model, str]:
    by = math.radians(float(rng.uniform(low, high)))
    model = model.fold("all", by=by, Lstar=float(rng.choice(SPRINGS)) if spring else None)
    return model, f"{'spring' if spring else 'imposed'} {math.degrees(by):.0f} degrees"


def _held(model: Model, curved: bool) -> Model:
    model = model.support("corner:inner-start", "xyz").support("corner:outer-start", "yz" if curved else "xz")
    return model.support("corner:inner-end", "z")


def narrow(rng: np.random.Generator) -> Draw:
    """Sectors and strips with one or two creases, folded, then perhaps pulled."""
    sheet = paper(rng)
    creases = int(rng.choice([1, 1, 1, 2]))
    width = float(rng.uniform(6.0, 15.0))
    curved = bool(rng.random() < 0.75)
    if curved:
        radius = float(rng.uniform(60.0, 150.0))
        angle = float(rng.uniform(30.0, 100.0) / radius * 1.2)
        radii = [radius + 1.2 * width * k for k in range(creases)]
        pattern = meshes.annulus_sector(radii, width, angle, alternating(creases))
        words = f"sector of {creases}"
    else:
        length = float(rng.uniform(40.0, 100.0))
        heights = [width * (k + 1) for k in range(creases)]
        pattern = meshes.strip(length, width * (creases + 1), heights, alternating(creases))
        words = f"strip of {creases}"
    model = Model(first_mesh(pattern), sheet, contact=False)
    held = not curved or bool(rng.random() < 0.5)  # a free sheet folds along straight creases for nothing
    if held:
        model = _held(model, curved)
        words += ", held at three corners"
    model, how = _folded(rng, model, 25.0, 90.0, bool(rng.random() < 0.5))
    words += f", {how}"
    what = "energy"
    if held:
        if not curved or rng.random() < 0.5:
            up = float(rng.uniform(2.0, 8.0))
            model = model.displace("corner:outer-end", "z", up)
            words += f", corner to {up:.1f} mm"
        what = str(rng.choice(["energy", "tip", "stiffness"]))
    within = _asked(rng)
    if what == "tip":
        goal = Goal(within, "tip", "corner:inner-end")
    elif what == "stiffness":
        goal = Goal(within, "stiffness", "corner:outer-start", (1.0, 0.0, 0.0) if curved else (0.0, 1.0, 0.0))
    else:
        goal = Goal(within)
    return Draw(words, model, goal)


def wide(rng: np.random.Generator) -> Draw:
    """One crease with panels a quarter to six tenths of its radius wide."""
    radius = float(rng.uniform(60.0, 150.0))
    width = radius * float(rng.uniform(0.25, 0.6))
    angle = float(rng.uniform(0.6, 1.3))
    model = Model(first_mesh(meshes.annulus_sector(radius, width, angle)), paper(rng), contact=False)
    words = f"wide sector, R = {radius:.0f}, w = {width:.0f}, {angle:.2f} rad"
    tip = bool(rng.random() < 0.4)
    if tip:
        model, words = _held(model, True), words + ", held at three corners"
    model, how = _folded(rng, model, 20.0, 70.0, bool(rng.random() < 0.6))
    goal = Goal(_asked(rng), "tip", "corner:outer-end") if tip else Goal(_asked(rng))
    return Draw(f"{words}, {how}", model, goal)


def ring(rng: np.random.Generator) -> Draw:
    """A closed ring with one or two creases that nothing holds; it buckles into a saddle."""
    radius = float(rng.uniform(40.0, 90.0))
    width = radius * float(rng.uniform(0.15, 0.4))
    creases = int(rng.choice([1, 1, 2]))
    radii = [radius + width * k for k in range(creases)]
    model = Model(
        first_mesh(meshes.full_annulus(radii, width, alternating(creases))), paper(rng), contact=False
    )
    model, how = _folded(rng, model, 20.0, 50.0, True)
    return Draw(f"ring of {creases}, R = {radius:.0f}, w = {width:.0f}, {how}", model, Goal(_asked(rng)))


def several(rng: np.random.Generator) -> Draw:
    """Three to five creases side by side: pleated sectors, sines, parabolas, two arcs."""
    count = int(rng.integers(3, 6))
    width = float(rng.uniform(8.0, 20.0))
    which = int(rng.integers(0, 4))
    pattern: CreasePattern
    if which == 0:
        radii = [float(60.0 + width * k) for k in range(count)]
        pattern, name = (
            meshes.annulus_sector(radii, width, float(rng.uniform(0.5, 1.2)), alternating(count)),
            "sector",
        )
    elif which == 1:
        amplitude = float(rng.uniform(2.0, 6.0))
        pattern, name = meshes.sine_tessellation(100.0, 100.0, count, amplitude, 1.5), "sines"
    elif which == 2:
        pattern, name = (
            meshes.parabolic_canopy(100.0, 100.0, count, float(rng.uniform(8.0, 20.0))),
            "parabolas",
        )
    else:
        count, name = 2, "arcs"
        pattern = meshes.two_arcs(
            100.0, 100.0, [float(rng.uniform(70.0, 100.0)), float(rng.uniform(150.0, 300.0))]
        )
    model, how = _folded(rng, Model(first_mesh(pattern), paper(rng), contact=False), 20.0, 60.0, True)
    return Draw(f"{count} {name}, {how}", model, Goal(_asked(rng)))


def network(rng: np.random.Generator) -> Draw:
    """A drawing: curved creases that meet inside a rectangle, or one that ends inside."""
    wide_, high = float(rng.uniform(60.0, 100.0)), float(rng.uniform(50.0, 90.0))
    x, y = wide_ * float(rng.uniform(0.4, 0.6)), high * float(rng.uniform(0.4, 0.6))
    ends = [(0.0, high * 0.5), (wide_ * 0.5, high), (wide_, high * 0.5), (wide_ * 0.5, 0.0)]
    if rng.random() < 0.4:
        ends = ends[:3]
    lines = []
    for k, (u, v) in enumerate(ends):
        bow = float(rng.uniform(-0.15, 0.15))
        cx, cy = 0.5 * (x + u) - bow * (v - y), 0.5 * (y + v) + bow * (u - x)
        colour = "blue" if k == 0 else "red"
        lines.append(f'<path d="M{x} {y} Q{cx} {cy} {u} {v}" stroke="{colour}" fill="none"/>')
    head = (
        f'xmlns="http://www.w3.org/2000/svg" width="{wide_}mm" height="{high}mm" viewBox="0 0 {wide_} {high}"'
    )
    rim = f'<rect width="{wide_}" height="{high}" stroke="black" fill="none"/>'
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "network.svg")
        file.write_text(f"<svg {head}>{rim}{''.join(lines)}</svg>")
        pattern = read_pattern(file)
    model, how = _folded(rng, Model(first_mesh(pattern), paper(rng), contact=False), 15.0, 45.0, True)
    return Draw(f"{len(ends)} curved creases meet, {how}", model, Goal(_asked(rng)))
