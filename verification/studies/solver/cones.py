"""Case `cones`: a disc with radial creases has two states; both found without a push, from either side.

An isometric cone cannot be pushed through to its other state (the two are apart in the space of such shapes), and a
push that stretches the sheet crushed small holes (decision 140). Here creases lead: folded down, the four creases make
the cone of the other sign; then two and two are folded up, and since the sheet is a cone of that sign all the way, it
ends in the other state. Half-way, with two creases flat, it is the snapped state of two creases.

A disc has a hole, and generators are straight from the hole to the rim, so what the sheet saves at the hole bends it
all over. With s whatever tells shapes apart, L = ln(R / r0), e an energy of the cone and c one of the hole,

    E(s) = L e(s) + c(s),    s0 where e' = 0:
    s = s0 - c' / (L e'' + c'') = s0 - a / (L - L0),    E = L e(s0) + c(s0) - K / (L - L0).

So elevations come to those of the closed form as 1 / L, and energies of an octave as 1 / L^2: with a hole of 2^-10 of
the rim they are 2 degrees and 1 % away. Three holes give s0, a and L0 (`small_hole`), and e(s0) with the same L0
(`of_octave`). The closed form is in `verification.theory.creased_cone`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bh import Fold, Model, Path, Sheet, trace
from bh.formulations.state import State
from meshes import SheetMesh
from meshes.curves import Arc
from verification.framework.checks import CaseResult, Context, Cost
from verification.studies.solver.published.common import Claim, Level, by_shell, converged
from verification.theory.creased_cone import ConeState, cone_state

CASE = "cones"
SOURCE = (
    "Lechenault and Adda-Bedia (2015), Andrade, Adda-Bedia and Dias (2019); the elastica on a sphere solved in "
    "verification.theory.creased_cone"
)
RIM = 100.0  # mm
OCTAVES = (6, 8, 10)  # the holes are 2^-6, 2^-8 and 2^-10 of the rim
BEYOND = 12  # the hole whose elevations the others foretell, on the coarsest mesh
CREASES = 4
PSI = math.radians(60.0)  # fold angle
THIN = 60.0  # radius of the hole over the thickness
LEVELS = ((4, 2), (6, 3), (8, 4))  # cells of half a panel around, and of an octave outwards
SHELL = ((6, 3), (8, 4))  # with 4 x 2 its energies are 4 to 8 % high where the sheet is thin to its cells
# Relative, and degrees: those that were set before the first run of discs, whose second state was not had
ENERGY, ELEVATION = 0.01, 0.5
FORESEEN = 0.1  # degrees
ENERGY_OF = "energy of an octave of the cone over B ln 2"
REST_BACK = "energy at rest, come back to from the other state, over that before"


@dataclass(frozen=True)
class Stage:
    """A state on the way: which step ends in it, and whose closed form it is.

    Attributes:
        words: for the records.
        step: number of the step of `cone_model`.
        creases: that are folded.
        snapped: the other state of these, or that at rest.
    """

    words: str
    step: int
    creases: int
    snapped: bool

    @property
    def exact(self) -> ConeState:
        """The closed form."""
        return cone_state(self.creases, PSI, self.snapped)


STAGES = (
    Stage("four creases, at rest", 0, 4, False),
    Stage("two creases, snapped", 2, 2, True),
    Stage("four creases, snapped", 3, 4, True),
)
BACK = 5  # the step in which it is at rest again


def disc_mesh(octaves: int, half: int, octave: int) -> SheetMesh:
    """Rings whose radii grow by one factor, mirrored about every crease and every panel's middle.

    Args:
        octaves: the hole is 2^-octaves of the rim.
        half: cells around in half a panel.
        octave: cells outwards in which radii double.
    """
    around, rings = 2 * half * CREASES, octaves * octave
    radii = RIM * 2.0 ** ((np.arange(rings + 1) - rings) / octave)
    phase = 2.0 * math.pi * np.arange(around) / around
    points = np.array([(r * math.cos(p), r * math.sin(p)) for r in radii for p in phase])

    def node(ring: int, ray: int) -> int:
        return ring * around + ray % around

    triangles = []
    for ring in range(rings):
        for ray in range(around):
            a, b = node(ring, ray), node(ring, ray + 1)
            c, d = node(ring + 1, ray + 1), node(ring + 1, ray)
            first = (ray // half) % 2 == 0
            triangles += [(a, d, c), (a, c, b)] if first else [(a, d, b), (d, c, b)]
    rays = {f"ray-{i + 1}": 2 * half * i for i in range(CREASES)}
    sets = {
        f"crease:{name}": [(node(k, ray), node(k + 1, ray)) for k in range(rings)]
        for name, ray in rays.items()
    }
    for name, ring in (("inner", 0), ("outer", rings)):
        sets[f"edge:{name}"] = [(node(ring, k), node(ring, k + 1)) for k in range(around)]
    full = 2.0 * math.pi
    curves = {
        f"edge:{name}": Arc((0.0, 0.0), float(radii[ring]), 0.0, full)
        for name, ring in (("inner", 0), ("outer", rings))
    }
    return SheetMesh(
        points=points,
        triangles=np.array(triangles),
        edge_sets={name: np.array(pairs) for name, pairs in sets.items()},
        folds=dict.fromkeys(rays, "mountain"),
        curves=curves,
    )


def cone_model(octaves: int, formulation: str, half: int, octave: int, back: bool = True) -> Model:
    """A free disc: all creases down, 1 and 3 up, 2 and 4 flat and up; then back, 1 and 3 first.

    Args:
        octaves: the hole is 2^-octaves of the rim.
        formulation: by name.
        half: cells around in half a panel.
        octave: cells outwards in which radii double.
        back: whether it comes back.
    """
    sheet = Sheet(E=4000.0, nu=0.0, t=RIM * 2.0**-octaves / THIN)
    model = Model(disc_mesh(octaves, half, octave), sheet, formulation=formulation, contact=False)
    ways = ((-1.0, -1.0), (1.0, -1.0), (1.0, 0.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0))
    for odd, even in ways if back else ways[: STAGES[-1].step + 1]:
        folds = [Fold(f"ray-{i + 1}", to=math.pi - PSI * (even if i % 2 else odd)) for i in range(CREASES)]
        model = model.step(*folds)
    return model


def elevations(state: State, creases: int) -> tuple[float, float]:
    """Of the middles of panels and of creases in the outer half of the rings, means over all, degrees.

    The axis is the normal of the plane through the ends at the rim, up on the side of the crests of mountain creases.

    Args:
        state: of the disc.
        creases: that are folded: two of four leave panels twice as wide.
    """
    points, around = state.points, len(state.mesh.edge_sets["edge:inner"])
    rings = len(points) // around - 1
    inner, outer = points[rings // 2 * around :][:around], points[-around:]
    panel = around // creases
    turn = np.arange(around) % panel
    axis = np.cross(outer, np.roll(outer, -1, axis=0)).sum(axis=0)
    axis /= np.linalg.norm(axis)
    along = outer - inner
    rise = np.degrees(np.arcsin(along @ axis / np.linalg.norm(along, axis=1)))
    return float(rise[turn == panel // 2].mean()), float(rise[turn == 0].mean())


def small_hole(values: Sequence[float]) -> tuple[float, float]:
    """(s0, L0 in octaves) of s = s0 - a / (L - L0), from a value with each hole of `OCTAVES`; nan where none fits."""
    large, middle, small = values
    first, ratio = OCTAVES[0], (middle - large) / (small - middle)
    if not ratio > 1.0:  # not slower and slower; also where a value is nan
        return math.nan, math.nan
    offset = (ratio * first - OCTAVES[-1]) / (ratio - 1.0)
    here, last = OCTAVES[1] - offset, OCTAVES[-1] - offset
    return small + (small - middle) * here / (last - here), offset


def of_octave(energies: Sequence[float], offset: float) -> float:
    """e(s0) of E = L e(s0) + c - K / (L - L0), over ln 2.

    Args:
        energies: over B, with each hole of `OCTAVES`.
        offset: L0, octaves.
    """
    at = np.array(OCTAVES, dtype=float)
    columns = np.column_stack((at * math.log(2.0), np.ones(3), -1.0 / (at - offset)))
    return float(np.linalg.solve(columns, np.asarray(energies))[0]) if math.isfinite(offset) else math.nan


@dataclass(frozen=True)
class Disc:
    """A mesh: the path with each hole of `OCTAVES`."""

    formulation: str
    mesh: tuple[int, int]
    paths: tuple[Path, ...]

    def elevations(self, stage: Stage) -> list[tuple[float, float]]:
        """With each hole, degrees; nan where a path did not get there."""
        ends = [_end(path, stage.step) for path in self.paths]
        return [(math.nan, math.nan) if end is None else elevations(end, stage.creases) for end in ends]

    @property
    def cost(self) -> Cost:
        """Of all holes."""
        return Cost(
            unknowns=self.paths[-1].unknowns,
            iterations=sum(path.iterations for path in self.paths),
            wall_time_s=sum(path.wall_time_s for path in self.paths),
        )


def solved(formulation: str, mesh: tuple[int, int], back: bool = False) -> Disc:
    """A mesh with each hole; with the smallest one it comes back, if asked."""
    return Disc(
        formulation,
        mesh,
        tuple(
            trace(
                cone_model(octaves, formulation, *mesh, back=back and octaves == OCTAVES[-1]),
                warn=False,
                neighbours=False,
            )
            for octaves in OCTAVES
        ),
    )


def run(context: Context) -> CaseResult:
    """All holes on every mesh, and by the shell."""
    result = CaseResult(
        name=CASE,
        title="A creased disc and its two states",
        question="Do both states of a creased cone have the energies and shapes of the closed form?",
        source=SOURCE,
    )
    levels = LEVELS[:2] if context.quick else LEVELS
    shells = SHELL[:1] if context.quick else SHELL
    discs = []
    for formulation, meshes in (("consistent", levels), ("shell", shells)):
        for mesh in meshes:
            context.tell(f"{CASE}: {formulation}, {mesh[0]} x {mesh[1]}")
            discs.append(solved(formulation, mesh, back=mesh is meshes[-1]))
    context.tell(f"{CASE}: a hole that others foretell")
    beyond = trace(cone_model(BEYOND, "consistent", *LEVELS[0], back=False), warn=False, neighbours=False)
    for stage in STAGES:
        _stage(result, stage, discs)
        _foretold(result, stage, discs[0], beyond)
    for disc in (discs[len(levels) - 1], discs[-1]):
        params = {"formulation": disc.formulation, "mesh": _words(disc.mesh), "creases": CREASES}
        _both_sides(result, disc.paths[-1], params)
    result.notes += NOTES
    return result


NOTES = [
    "Tolerances are those that were set for creased discs before their first run (1 % of the energy, 0.5 degrees); the "
    "way to the other state was found after it. What is compared was changed after the first record: figures were of "
    "one hole of 2^-10 of the rim, whose elevations of creases were 1.1 and 2.3 degrees low, and of one octave beside "
    "it; they are limits of small holes now, as the closed form is. By the shell they were of 4 x 2 cells, too few.",
    "A barrier has no closed form here: isometric cones do not lead from one state to the other while the creases "
    "keep their angles, so a sheet that is pushed through stretches, by an amount that hangs on its thickness.",
]


def _words(mesh: tuple[int, int]) -> str:
    return "{} x {} a half panel and octave".format(*mesh)


def _end(path: Path, step: int) -> State | None:
    """The last state of a step that was reached; None where it was not."""
    if not (path.reached or len(path.steps) > step + 1):
        return None
    ends = [state for state in path if state.step == step]
    return ends[-1] if ends else None


def _over(path: Path, step: int) -> float:
    """Energy over B; nan where the step was not reached."""
    state = _end(path, step)
    return math.nan if state is None else state.energy.total / path.model.sheet.bending_stiffness()


def _stage(result: CaseResult, stage: Stage, discs: Sequence[Disc]) -> None:
    """Energy of an octave and elevations by every mesh with small holes, their limits, and by the shell."""
    params = {"state": stage.words, "fold angle, degrees": math.degrees(PSI)}
    sign = 1.0 if stage.snapped else -1.0  # at rest it is that of valley creases: upside down
    found: dict[str, list[float]] = {"energy": [], "middle": [], "crease": []}
    for disc in discs:
        middles, creases = zip(*disc.elevations(stage), strict=True)
        crease, offset = small_hole(creases)
        found["crease"].append(crease)
        found["middle"].append(small_hole(middles)[0])
        found["energy"].append(of_octave([_over(path, stage.step) for path in disc.paths], offset))
        _with_holes(
            result, {**params, "formulation": disc.formulation, "mesh": _words(disc.mesh)}, middles, creases
        )
    claims = [Claim(ENERGY_OF, stage.exact.energy, SOURCE, ENERGY, params)]
    for what, angle in (("middle", stage.exact.middle), ("crease", stage.exact.crease)):
        exact = sign * math.degrees(angle)
        claims.append(
            Claim(f"elevation of the {what}", exact, SOURCE, ELEVATION / abs(exact), params, "degrees")
        )
    for claim, values in zip(claims, found.values(), strict=True):
        levels = [
            Level(_words(disc.mesh), 1.0 / disc.mesh[0], value, disc.cost)
            for disc, value in zip(discs, values, strict=True)
        ]
        flat = sum(disc.formulation != "shell" for disc in discs)
        converged(result, claim, levels[:flat])
        for level, disc in zip(levels[flat:], discs[flat:], strict=True):
            by_shell(result, claim if disc.mesh == SHELL[-1] else replace(claim, tolerance=None), level)


def _with_holes(
    result: CaseResult, params: Mapping[str, object], middles: Sequence[float], creases: Sequence[float]
) -> None:
    """Elevations with each hole, as they were read."""
    for octaves, middle, crease in zip(OCTAVES, middles, creases, strict=True):
        own = {**params, "hole": f"2^-{octaves}"}
        result.check("elevation of the middle, with a hole", middle, unit="degrees", params=own)
        result.check("elevation of the crease, with a hole", crease, unit="degrees", params=own)


def _foretold(result: CaseResult, stage: Stage, disc: Disc, beyond: Path) -> None:
    """What the law of holes says of a smaller one, and what is solved there."""
    creases = [crease for _, crease in disc.elevations(stage)]
    limit, offset = small_hole(creases)
    off = (limit - creases[-1]) * (OCTAVES[-1] - offset) / (BEYOND - offset)
    end = _end(beyond, stage.step)
    result.check(
        "elevation of the crease, with a smaller hole",
        math.nan if end is None else elevations(end, stage.creases)[1],
        unit="degrees",
        reference=limit - off,
        source="s0 - a / (L - L0) of three larger holes",
        tolerance=FORESEEN / abs(limit - off),
        params={
            "state": stage.words,
            "hole": f"2^-{BEYOND}",
            "formulation": "consistent",
            "mesh": _words(disc.mesh),
        },
        path=beyond,
    )


def _both_sides(result: CaseResult, path: Path, params: dict[str, object]) -> None:
    """Each state is stable, and that at rest is the same when come to from the other one."""
    result.check(
        REST_BACK,
        _over(path, BACK) / _over(path, 0),
        reference=1.0,
        source="an elastic sheet forgets its way",
        tolerance=1e-4,
        params=params,
        path=path,
    )
    for stage in STAGES:
        ends = [record for record in path.records if record.step == stage.step]
        result.check(
            "the state is stable",
            bool(ends) and ends[-1].stable is True,
            reference=1.0,
            source="Fourier modes (m^2 - 1)(m^2 - 1 + lambda) > 0 for n < 8",
            tolerance=0.0,
            params={**params, "state": stage.words},
            path=path,
        )
    ratio = _over(path, STAGES[-1].step) / _over(path, 0)
    result.check("energy snapped over at rest, with the hole", ratio, source="measured", params=params)
