"""Random sheets of case `map`, by kind: small, so that the shell is cheap, and none with which anything was tuned."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import meshes
from bh import Displace, Indenter, Model, Path, Sheet, trace
from meshes.choices import choices, cut, first_mesh
from meshes.errors import MeshError
from meshes.library import alternating
from meshes.pattern import CreasePattern
from verification.studies.solver import honesty_scenes

SEED = 20261129
Random = np.random.Generator
Array = NDArray[np.float64]
EIGHTHS = 8  # a ring's cells are a multiple of it, so that nodes lie where it is held
TIP = ("corner:outer-start", (1.0, 0.0, 0.0))


@dataclass(frozen=True)
class Sample:
    """One sheet.

    Attributes:
        words: what it is.
        model: on some mesh; its places are names, so that any mesh of its pattern takes them.
        force: what it takes to hold it there, of a path, in any unit; None where nothing pulls or presses.
        probes: places and directions whose mean stiffness is that of the sheet; none where it has none.
        spring: whether its fold angle is an answer, not imposed.
        twins: of flat points (n, 2), those that lie there in a state that is as good by symmetry.
        cells: along a crease, a multiple of which its meshes have.
    """

    words: str
    model: Model
    force: Callable[[Path], float] | None = None
    probes: tuple[tuple[str, tuple[float, float, float]], ...] = ()
    spring: bool = False
    twins: tuple[Callable[[Array], Array], ...] = ()
    cells: int = 1

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
        return Sample(words, _sprung(rng, model, 30.0, 80.0), probes=(TIP,), spring=True)

    return make


def _several(rng: Random) -> Sample:
    return _folded((0.08, 0.15), int(rng.integers(3, 6)))(rng)


def _ring(rng: Random) -> Sample:
    """A closed ring that buckles into a saddle; which way it turns costs nothing, so it is held where it crosses z = 0.

    Either of two diameters may be the one that rises; the states are each other's, turned by a right angle.
    """
    drawn = honesty_scenes.ring(rng)
    pattern = Sample(drawn.words, drawn.model).pattern
    radius = float(np.linalg.norm(pattern.creases[0].curve.point(np.zeros(1))[0]))

    def at(eighth: int) -> str:
        angle = 0.25 * math.pi * eighth
        return f"near:{radius * math.cos(angle):.9f},{radius * math.sin(angle):.9f}"

    model = drawn.model
    for eighth, fix in ((1, "z"), (3, "z"), (5, "z"), (7, "z"), (0, "y"), (4, "y"), (2, "x")):
        model = model.support(at(eighth), fix)
    up = (0.0, 0.0, 1.0)
    probes = ((at(0), up), (at(2), up))
    return Sample(drawn.words, model, probes=probes, spring=True, twins=(_quarter,), cells=EIGHTHS)


def _quarter(flat: Array) -> Array:
    """Flat points (n, 2), turned by a right angle about the centre of a ring."""
    return np.column_stack((-flat[:, 1], flat[:, 0]))


def _network(rng: Random) -> Sample:
    """A drawing, held so at three corners that nothing but rigid motions is taken; stiff is the fourth."""
    drawn = honesty_scenes.network(rng)
    x, y = (float(each) for each in drawn.model.mesh.points[:, :2].max(axis=0))
    low_x, low_y = (float(each) for each in drawn.model.mesh.points[:, :2].min(axis=0))
    corners = ((low_x, low_y, "xyz"), (x, low_y, "yz"), (low_x, y, "z"))
    model = drawn.model
    for at_x, at_y, fix in corners:
        model = model.support(f"near:{at_x:.9f},{at_y:.9f}", fix)
    probe = (f"near:{x:.9f},{y:.9f}", (0.0, 0.0, 1.0))
    return Sample(drawn.words, model, probes=(probe,), spring=True)


def _pinched(rng: Random) -> Sample:
    """Folded to a right angle, then closed by a raised cosine over a third of the crease."""
    model, words = _sector(rng, honesty_scenes.paper(rng), (0.08, 0.15))
    by = math.radians(float(rng.uniform(110.0, 140.0)))
    length = Sample(words, model).pattern.creases[0].curve.length / 3.0
    model = model.fold("crease", by=0.5 * math.pi).pinch("crease", by=by, length=length)
    return Sample(f"{words}, pinched by {math.degrees(by):.0f} degrees", model, _moment, (TIP,))


def _moment(path: Path) -> float:
    """Of a pinch: the rate of its work at its end, N mm for all of the step."""
    system, _ = path.solved()
    return float(system.power(path.records[-1].q, path.records[-1].lam))


def _reaction(place: str) -> Callable[[Path], float]:
    """Upward force that a place takes, N."""
    return lambda path: float(path[-1].reactions[path.model.mesh.nodes(place), 2].sum())


def _pulled(rng: Random) -> Sample:
    """Folded by its spring, then a corner is lifted."""
    model, words = _sector(rng, honesty_scenes.paper(rng), (0.08, 0.15))
    up = float(rng.uniform(3.0, 8.0))
    place = "corner:outer-end"
    model = _sprung(rng, model, 30.0, 80.0).displace(place, "z", up)
    return Sample(f"{words}, corner to {up:.1f} mm", model, _reaction(place), (TIP,), spring=True)


def _pressed(rng: Random) -> Sample:
    """Folded by its spring, held at four corners, then pressed by a cylinder that crosses the middle of its crease.

    The way is measured from where the consistent formulation on two rows has the crease; the cylinder begins a quarter
    of its height above, clear of what any model makes of it.
    """
    model, words = _sector(rng, honesty_scenes.paper(rng), (0.08, 0.15))
    model = _sprung(rng, model.support("corner:outer-end", "z"), 30.0, 80.0)
    radius, share = float(rng.uniform(3.0, 6.0)), float(rng.uniform(0.15, 0.3))
    pattern = Sample(words, model).pattern
    rough = replace(
        model, mesh=cut(pattern, next(choices(pattern, "staggered", 2.0))), formulation="consistent"
    )
    crease = trace(rough, neighbours=False, estimate=False).require()[-1].crease_points("crease")
    middle = crease[len(crease) // 2]
    high, angle = float(crease[:, 2].max()), math.atan2(middle[1], middle[0])
    way, clear = share * high, 0.25 * high
    bar = Indenter(
        "bar",
        (float(middle[0]), float(middle[1]), float(middle[2]) + radius + clear),
        angle,
        2.0 * radius,
        2.0 * radius,
        radius,
        by=(0.0, 0.0, -way - clear),
        stiffness=10.0,  # stiff beside a fold that gives way by a millimetre for 0.03 N
    )
    return Sample(
        f"{words}, pressed {way:.2f} mm by a cylinder of {radius:.1f} mm",
        model.step(bar),
        lambda path: float(path[-1].contact_forces["bar"][2]),
        (TIP,),
        spring=True,
    )


def _twisted(rng: Random) -> Sample:
    """A flat strip held at one end and twisted by two corners of the other."""
    length, height = float(rng.uniform(60.0, 120.0)), float(rng.uniform(12.0, 24.0))
    pattern = meshes.strip(length, height, [0.5 * height], "flat")
    turn = 0.5 * height * math.sin(math.radians(float(rng.uniform(8.0, 20.0))))
    model = Model(first_mesh(pattern), honesty_scenes.paper(rng), contact=False).support("edge:start", "xyz")
    low, high = "corner:inner-end", "corner:outer-end"
    model = model.step(Displace(low, "z", -turn), Displace(high, "z", turn))
    words = f"strip of {length:.0f} x {height:.0f}, ends {turn:.1f} mm up and down"

    def turned(flat: Array) -> Array:
        return np.column_stack((flat[:, 0], height - flat[:, 1]))

    return Sample(words, model, _reaction(high), ((high, (0.0, 1.0, 0.0)),), twins=(turned,))


def _grained(rng: Random) -> Sample:
    """A narrow sector of card whose fibres run at any angle."""
    sheet = Sheet.orthotropic(
        E1=float(rng.uniform(4000.0, 7000.0)),
        E2=float(rng.uniform(1800.0, 3000.0)),
        G12=float(rng.uniform(1000.0, 2000.0)),
        nu12=float(rng.uniform(0.2, 0.35)),
        grain=math.radians(float(rng.uniform(0.0, 180.0))),
        t=float(rng.choice([0.2, 0.3])),
        strength=30.0,  # of card, for an equivalent stress only
        strength2=15.0,
    )
    model, words = _sector(rng, sheet, (0.08, 0.15))
    return Sample(f"{words}, grain", _sprung(rng, model, 30.0, 80.0), probes=(TIP,), spring=True)


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
    "pressed": _pressed,
}
LOOSE = "nothing pulls or presses"
ABSENT: dict[str, dict[str, str]] = {
    "narrow ring": {"force": LOOSE},
    "wide panel": {"force": LOOSE},
    "orthotropic": {"force": LOOSE},
    "several creases": {"force": LOOSE},
    "closed ring": {"force": LOOSE},
    "network": {"force": LOOSE},
    "pinched": {"fold angle": "it is imposed"},
    "twisted": {"fold angle": "it has no crease"},
}  # what a kind has not, and why


def on(item: Sample, mesh: meshes.SheetMesh, formulation: str) -> Model:
    """The sheet on a mesh, by a formulation."""
    return replace(item.model, mesh=mesh, formulation=formulation)
