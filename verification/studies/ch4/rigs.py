"""Bending tests of the source with what it does not print drawn at random: creases, tape, friction, depth, place."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from bh import ElasticPlastic, Model, Path, trace
from bh.applications.corrugation import POLYESTER, Folded, Rig, three_point
from bh.applications.corrugation.folding import fold, laid
from bh.errors import ModelError
from bh.formulations.observables import depth_of
from meshes import corrugation, structured
from verification.studies.ch4.corrugations import AZIMUTHS

ALONG, ROWS = 24, 2
TRAVEL = 4.0  # mm; the second stage ends before
FREE, SIDEWAYS, DOWN = "free", "sideways", "down"
SPRINGS, PLASTIC = "springs", "plastic"
# what is plausible; the middle of each range is what case `three_point` takes, or near it
LSTAR = (2.0, 100.0)  # mm
TAPE = (0.03, 30.0)  # N/mm
GRIP = (0.0, 10.0)  # N/mm; 0 is no friction under the bar, 10 a bar that sticks
DEPTH = (5.5, 6.5)  # mm, "approximately 6 mm"
OFFSET = (0.0, 3.0)  # mm, of a specimen that was aligned by guides
MODULUS = (3000.0, 5500.0)  # MPa, polyester film
YIELD = (0.3, 3.0)  # N mm / mm; a plastic hinge of the whole film has 2.5 to 3.6 (70 to 100 MPa)
HARDENING = 0.3  # N mm / (mm rad)
SECANTS = 6
NEAR = 0.02  # mm, of the depth


@dataclass(frozen=True)
class Guess:
    """What the source does not print.

    Attributes:
        Lstar: of the creases, mm.
        law: creases are springs with one rest angle, or yield: folded by one couple, and let go.
        yield_moment: where they yield, N mm / mm.
        hold: by the tape; the sheet lies free, its valleys over the supports are held sideways, or down as well.
        tape: stiffness sideways, N/mm; without use where it lies free.
        grip: of the bar, N/mm (`bh.applications.corrugation.Rig`).
        depth: folded, mm.
        offset: of the sheet's middle from the bar, mm.
    """

    Lstar: float
    law: str
    yield_moment: float
    hold: str
    tape: float
    grip: float
    depth: float
    offset: float

    @property
    def rig(self) -> Rig:
        """The test stand."""
        return Rig(
            travel=TRAVEL,
            tape=0.0 if self.hold == FREE else self.tape,
            pulled=self.hold == DOWN,
            grip=self.grip,
            offset=self.offset,
        )

    def words(self) -> dict[str, float | str]:
        """For the parameters of a record."""
        found: dict[str, float | str] = {"L*": round(self.Lstar, 2), "creases": self.law, "hold": self.hold}
        if self.law == PLASTIC:
            found["yield_moment"] = round(self.yield_moment, 3)
        if self.hold != FREE:
            found["tape"] = round(self.tape, 4)
        return {
            **found,
            "grip": round(self.grip, 3),
            "depth": round(self.depth, 3),
            "offset": round(self.offset, 3),
        }


def drawn(rng: np.random.Generator) -> Guess:
    """Anywhere in the ranges; lengths and stiffnesses evenly in their logarithms.

    Args:
        rng: random numbers.
    """

    def even(span: tuple[float, float]) -> float:
        return float(math.exp(rng.uniform(math.log(span[0]), math.log(span[1]))))

    return Guess(
        Lstar=even(LSTAR),
        law=str(rng.choice([SPRINGS, SPRINGS, PLASTIC])),
        yield_moment=even(YIELD),
        hold=str(rng.choice([FREE, SIDEWAYS, DOWN])),
        tape=even(TAPE),
        grip=float(rng.choice([GRIP[0], even((0.1, GRIP[1]))])),
        depth=float(rng.uniform(*DEPTH)),
        offset=float(rng.uniform(*OFFSET)),
    )


def beside(guess: Guess, rng: np.random.Generator, far: float) -> Guess:
    """Another one near a guess, with the same kind of creases and tape, within the ranges.

    Args:
        guess: begun from.
        rng: random numbers.
        far: part of each range that it may move.
    """

    def near(value: float, span: tuple[float, float]) -> float:
        moved = value * math.exp(far * math.log(span[1] / span[0]) * rng.uniform(-1.0, 1.0))
        return float(np.clip(moved, *span))

    def along(value: float, span: tuple[float, float]) -> float:
        return float(np.clip(value + far * (span[1] - span[0]) * rng.uniform(-1.0, 1.0), *span))

    return replace(
        guess,
        Lstar=near(guess.Lstar, LSTAR),
        yield_moment=near(guess.yield_moment, YIELD),
        tape=near(guess.tape, TAPE),
        grip=along(guess.grip, GRIP),
        depth=along(guess.depth, DEPTH),
        offset=along(guess.offset, OFFSET),
    )


@lru_cache(maxsize=8)
def folded(kind: str, Lstar: float, law: str, yield_moment: float, depth: float) -> Folded:
    """A corrugation folded so deep, by one rest angle or by one couple that is let go again.

    Args:
        kind: one of the five.
        Lstar: of its creases, mm.
        law: `SPRINGS` or `PLASTIC`.
        yield_moment: of creases that yield, N mm / mm.
        depth: mm.

    Raises:
        ModelError: it cannot be folded so deep.
    """
    if law == SPRINGS:
        return fold(kind, depth, along=ALONG, rows=ROWS, formulation="consistent", Lstar=Lstar)
    mesh = structured(corrugation(kind), along=ALONG, rows=ROWS)
    model = Model(mesh, POLYESTER, formulation="consistent", contact=False).support("rigid-body")
    for name in mesh.creases:
        model = model.crease(name, Lstar=Lstar, law=ElasticPlastic(yield_moment, HARDENING))

    def kept(couple: float) -> tuple[Path, float]:
        path = trace(model.moment("all", to=couple).moment("all", to=0.0), warn=False)
        if not path.reached:
            raise ModelError(f"a couple of {couple:.3g} N mm / mm does not fold it ({path.outcome})")
        return path, depth_of(path[-1])[0]

    a, b = yield_moment + 0.2 * HARDENING, yield_moment + 0.8 * HARDENING
    (path, deep), before = kept(b), kept(a)[1]
    for _ in range(SECANTS):
        if abs(deep - depth) < NEAR:
            return laid(path)
        a, b, before = b, b + (depth - deep) * (b - a) / (deep - before), deep
        path, deep = kept(b)
    raise ModelError(f"no couple folds it {depth:.2f} mm deep; {deep:.2f} mm with {b:.3g} N mm / mm")


def stiffness(guess: Guess, kind: str, name: str) -> float:
    """Slope of the second stage of a test, N/mm, with E = 4000 MPa; nan where it cannot be done.

    Args:
        guess: what is not printed.
        kind: of corrugation.
        name: of the direction, of `AZIMUTHS`.
    """
    try:
        sheet = folded(kind, guess.Lstar, guess.law, guess.yield_moment, guess.depth)
        test = three_point(sheet, AZIMUTHS[name], guess.rig)
    except ModelError:
        return math.nan
    return test.stiffness if test.converged else math.nan
