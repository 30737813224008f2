"""Random sheets of case `map`, by kind: small, so that the shell is cheap, and none with which anything was tuned."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import meshes
from bh import Displace, Model, Sheet
from meshes.choices import first_mesh
from meshes.errors import MeshError
from meshes.library import alternating
from meshes.pattern import CreasePattern
from verification.studies.solver import honesty_scenes

SEED = 20261129
Random = np.random.Generator


@dataclass(frozen=True)
class Sample:
    """One sheet.

    Attributes:
        words: what it is.
        model: on some mesh; its places are names, so that any mesh of its pattern takes them.
        pulled: places whose reactions are its force, with the axis; none where nothing pulls.
        probe: place and direction of its stiffness; None where nothing holds it.
        spring: whether its fold angle is an answer, not imposed.
    """

    words: str
    model: Model
    pulled: tuple[str, str] | None = None
    probe: tuple[str, tuple[float, float, float]] | None = None
    spring: bool = False

    @property
    def pattern(self) -> CreasePattern:
        """Of the flat sheet.

        Raises:
            MeshError: its mesh was not made of one.
        """
        if self.model.mesh.pattern is None:
            raise MeshError(f"{self.words}: a sheet without a pattern has no other mesh")
        return self.model.mesh.pattern


def sample(kind: str, number: int) -> Sample:
    """Sheet `number` of a kind."""
    return KINDS[kind](np.random.default_rng([SEED, list(KINDS).index(kind), number]))


def _held(model: Model) -> Model:
    model = model.support("corner:inner-start", "xyz").support("corner:outer-start", "yz")
    return model.support("corner:inner-end", "z")


def _sector(rng: Random, sheet: Sheet, wide: tuple[float, float], creases: int = 1) -> tuple[Model, str]:
    """A sector of arcs, held at three corners; `wide` bounds the width of a panel over the radius."""
    radius = float(rng.uniform(60.0, 120.0))
    width = radius * float(rng.uniform(*wide))
    angle = float(rng.uniform(0.6, 1.2))
    radii = [radius + width * k for k in range(creases)]
    pattern = meshes.annulus_sector(radii, width, angle, alternating(creases))
    words = f"{creases} creases, R = {radius:.0f}, w = {width:.1f}, {angle:.2f} rad, t = {sheet.t:g}"
    return _held(Model(first_mesh(pattern), sheet, contact=False)), words


def _sprung(rng: Random, model: Model, low: float, high: float) -> Model:
    by = math.radians(float(rng.uniform(low, high)))
    return model.fold("all", by=by, Lstar=float(rng.choice(honesty_scenes.SPRINGS)))


def _folded(wide: tuple[float, float], creases: int = 1) -> Callable[[Random], Sample]:
    """Folded by springs."""

    def make(rng: Random) -> Sample:
        model, words = _sector(rng, honesty_scenes.paper(rng), wide, creases)
        probe = ("corner:outer-start", (1.0, 0.0, 0.0))
        return Sample(words, _sprung(rng, model, 30.0, 80.0), probe=probe, spring=True)

    return make


def _several(rng: Random) -> Sample:
    return _folded((0.08, 0.15), int(rng.integers(3, 6)))(rng)


def _ring(rng: Random) -> Sample:
    drawn = honesty_scenes.ring(rng)
    return Sample(drawn.words, drawn.model, spring=True)


def _network(rng: Random) -> Sample:
    drawn = honesty_scenes.network(rng)
    return Sample(drawn.words, drawn.model, spring=True)


def _pinched(rng: Random) -> Sample:
    """Folded to a right angle, then closed by a raised cosine over a third of the crease."""
    model, words = _sector(rng, honesty_scenes.paper(rng), (0.08, 0.15))
    by = math.radians(float(rng.uniform(110.0, 140.0)))
    length = Sample(words, model).pattern.creases[0].curve.length / 3.0
    model = model.fold("crease", by=0.5 * math.pi).pinch("crease", by=by, length=length)
    return Sample(f"{words}, pinched by {math.degrees(by):.0f} degrees", model)


def _pulled(rng: Random) -> Sample:
    """Folded by its spring, then a corner is lifted."""
    model, words = _sector(rng, honesty_scenes.paper(rng), (0.08, 0.15))
    up = float(rng.uniform(3.0, 8.0))
    model = _sprung(rng, model, 30.0, 80.0).displace("corner:outer-end", "z", up)
    return Sample(f"{words}, corner to {up:.1f} mm", model, ("corner:outer-end", "z"), spring=True)


def _twisted(rng: Random) -> Sample:
    """A flat strip held at one end and twisted by two corners of the other."""
    length, height = float(rng.uniform(60.0, 120.0)), float(rng.uniform(12.0, 24.0))
    pattern = meshes.strip(length, height, [0.5 * height], "flat")
    turn = 0.5 * height * math.sin(math.radians(float(rng.uniform(8.0, 20.0))))
    model = Model(first_mesh(pattern), honesty_scenes.paper(rng), contact=False).support("edge:start", "xyz")
    low, high = "corner:inner-end", "corner:outer-end"
    model = model.step(Displace(low, "z", -turn), Displace(high, "z", turn))
    return Sample(f"strip of {length:.0f} x {height:.0f}, ends {turn:.1f} mm up and down", model, (high, "z"))


def _grained(rng: Random) -> Sample:
    """A narrow sector of card whose fibres run at any angle."""
    sheet = Sheet.orthotropic(
        E1=float(rng.uniform(4000.0, 7000.0)),
        E2=float(rng.uniform(1800.0, 3000.0)),
        G12=float(rng.uniform(1000.0, 2000.0)),
        nu12=float(rng.uniform(0.2, 0.35)),
        grain=math.radians(float(rng.uniform(0.0, 180.0))),
        t=float(rng.choice([0.2, 0.3])),
    )
    model, words = _sector(rng, sheet, (0.08, 0.15))
    probe = ("corner:outer-start", (1.0, 0.0, 0.0))
    return Sample(f"{words}, grain", _sprung(rng, model, 30.0, 80.0), probe=probe, spring=True)


KINDS: dict[str, Callable[[Random], Sample]] = {
    "narrow ring": _folded((0.08, 0.15)),
    "wide panel": _folded((0.3, 0.5)),
    "pinched": _pinched,
    "pulled": _pulled,
    "twisted": _twisted,
    "orthotropic": _grained,
    "several creases": _several,
    "closed ring": _ring,
    "network": _network,
}
UNMEASURED = {
    "pressed": "rigid bodies that press are not in the shell, so it cannot judge; bh verify contact does"
}


def on(item: Sample, mesh: meshes.SheetMesh, formulation: str) -> Model:
    """The sheet on a mesh, by a formulation."""
    return replace(item.model, mesh=mesh, formulation=formulation)
