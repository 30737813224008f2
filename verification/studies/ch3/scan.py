"""Case `scan` (source 3.4.3, Fig. 3.7): sheets against point clouds.

There are no scans to be had, so clouds are made: of a folded annulus sector with the scanner's density and noise, with
holes and stray points, moved by a known rigid motion; of the exact cones; and, for the four patterns of Fig. 3.7,
of the sheet folded by the consistent formulation in the place of the paper model.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import bh
import meshes
from bh.applications import scan
from bh.errors import InputError
from meshes.pattern import CreasePattern
from verification.framework.checks import CaseResult, Check, Context, line, plot
from verification.theory import cone

Array = NDArray[np.float64]

NOISE = 0.127  # mm, the scanner's accuracy, taken as the standard deviation of each coordinate
DENSITY = 104.0 / 5.0  # points a mm^2: 10,400 a cm^2, of which the source keeps every fifth
RADIUS, WIDTH, DIHEDRAL = 100.0, 10.0, 0.5 * math.pi
STRAYS, HOLES = 0.05, (4.0, 5.0, 6.0)  # share of the points; radii in mm
MOTION = ((0.4, -0.9, 1.3), (30.0, -20.0, 50.0))  # rotation vector, rad, and translation, mm
SCANNER = "known motion; noise, density and every fifth point of source 3.4.3"
SAME_MESH = "the consistent formulation on the same mesh and with the same L*"
FORMULATIONS = ("bars-and-hinges", "consistent")

PAPER = bh.Sheet(E=4000.0, t=0.274)  # the source's linen paper; it tells no modulus
FOLD, PAPER_LSTAR = math.pi / 3.0, 10.0  # rad, mm
LSTARS = (0.1, 1.0, 10.0, 100.0)  # tried for the lowest mean distance, as the source does


@dataclass(frozen=True)
class Sample:
    """A pattern of Fig. 3.7 and the mean distance that the source stays under, mm."""

    name: str
    pattern: CreasePattern
    claim: float


def samples() -> tuple[Sample, ...]:
    """The four patterns; the source draws them, but tells no sizes beyond 100 mm by 100 mm."""
    return (
        Sample("sine tessellation", meshes.sine_tessellation(), 2.0),
        Sample("two arcs", meshes.two_arcs(), 1.0),
        Sample("canopy of parabolas", meshes.parabolic_canopy(), 1.0),
        Sample("opposite parabolas", meshes.opposite_parabolas(), 1.0),
    )


# ------------------------------------------------------------------------------------------------- clouds


def sampled(state: bh.State, density: float, seed: int) -> Array:
    """Points (k, 3) spread evenly at random over a sheet, `density` a mm^2."""
    random = np.random.default_rng(seed)
    p = state.points[state.mesh.triangles]
    area = 0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    count = round(density * float(area.sum()))
    chosen = p[random.choice(len(p), count, p=area / area.sum())]
    u, v = random.random((2, count, 1))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    points: Array = chosen[:, 0] + u * (chosen[:, 1] - chosen[:, 0]) + v * (chosen[:, 2] - chosen[:, 0])
    return points


def scanned(points: Array, seed: int, strays: float = STRAYS, holes: tuple[float, ...] = HOLES) -> Array:
    """The points as a scanner gives them: noisy, with stray points in and around the sheet's box, and with holes."""
    random = np.random.default_rng(seed)
    centres = points[random.choice(len(points), len(holes), replace=False)]
    seen = points + random.normal(0.0, NOISE, points.shape)
    low, high = points.min(axis=0) - 10.0, points.max(axis=0) + 10.0
    seen = np.vstack((seen, random.uniform(low, high, (round(strays * len(points)), 3))))
    for centre, radius in zip(centres, holes, strict=True):
        seen = seen[np.linalg.norm(seen - centre, axis=1) > radius]
    return random.permutation(seen)


def folded_sector(formulation: str, angle: float) -> bh.State:
    """The annulus sector of App. B with its crease in its plane, folded to a right angle.

    The consistent formulation gets four rows a panel: with one the free ends stray from the cones by 0.33 mm, with two
    by 0.24, with four by 0.21.
    """
    rows, alpha = (4, 4.0) if formulation == "consistent" else (1, 8.0)
    mesh = meshes.structured(meshes.annulus_sector(RADIUS, WIDTH, angle), aspect_ratio=alpha, rows=rows)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127), formulation=formulation)
    model = model.support("crease:crease", "z").support("rigid-body").fold("crease", to=DIHEDRAL)
    return bh.trace(model)[-1]


def corners(state: bh.State) -> Array:
    """(4, 3) corners of the sheet: what is picked."""
    return state.points[[state.mesh.corners[name] for name in sorted(state.mesh.corners)]]


# ------------------------------------------------------------------------------------------------- the case


def run(context: Context) -> CaseResult:
    """Known motions, exact cones, and the four patterns."""
    result = CaseResult(
        name="scan",
        title="Sheets against point clouds, and the patterns of Fig. 3.7",
        question="Does registration find a known motion to the noise, and how far apart are the two formulations?",
        source="source 3.4.3, Fig. 3.7",
    )
    angle = math.pi / 4 if context.quick else math.pi / 2
    _known_motion(result, context, angle)
    _exact_cones(result, context, angle)
    for sample in samples():
        context.tell(f"scan: {sample.name}")
        _pattern(result, context, sample)
    _notes(result)
    return result


def _add(result: CaseResult, quantity: str, value: float, unit: str, reference: float | None, source: str,
         tolerance: float | None, **params: Any) -> None:  # fmt: skip
    result.checks.append(Check("scan", quantity, params, float(value), unit, reference, source, tolerance))


def truncated_normal() -> tuple[float, float, float]:
    """Root mean square, mean and median of |N(0, 1)| below `bh.scan`'s trim."""
    trim = scan.TRIM
    inside = math.erf(trim / math.sqrt(2.0))
    density = math.exp(-0.5 * trim * trim)
    square = 1.0 - math.sqrt(2.0 / math.pi) * trim * density / inside
    mean = math.sqrt(2.0 / math.pi) * (1.0 - density) / inside
    from scipy.special import erfinv

    return math.sqrt(square), mean, math.sqrt(2.0) * float(erfinv(0.5 * inside))


def _known_motion(result: CaseResult, context: Context, angle: float) -> None:
    """A scan of the solved sheet itself, so that nothing but noise, holes and strays is between them."""
    state = folded_sector("bars-and-hinges", angle)
    square, mean, median = (NOISE * value for value in truncated_normal())
    motion = scan.Motion.about(state.points.mean(axis=0), *MOTION)
    picks = np.random.default_rng(0).normal(0.0, 1.0, (3, 3))  # picked by hand, a millimetre wrong
    for seed in (1,) if context.quick else (1, 2, 3, 4):
        context.tell(f"scan: known motion, seed {seed}")
        cloud = motion.apply(scanned(sampled(state, DENSITY, seed), seed))
        start = scan.picked(motion.apply(corners(state)[:3]) + picks, corners(state)[:3])
        found = scan.register(cloud, state, start)
        left = found.motion.after(motion)
        params: dict[str, Any] = {
            "angle_deg": round(math.degrees(angle), 6), "points": len(cloud), "seed": seed, "noise_mm": NOISE,
            "strays": STRAYS, "holes": len(HOLES),
        }  # fmt: skip
        error = np.concatenate((left.apply(found.centre) - found.centre, _rotation_vector(left)))
        worst = float(np.abs(error / found.standard_error).max())
        _add(result, "motion left, in its standard errors", worst, "", 0.0, SCANNER, 4.0, **params)
        moved = np.linalg.norm(left.apply(state.points) - state.points, axis=1)
        _add(result, "motion left, root mean square of the nodes", math.sqrt(float((moved**2).mean())), "mm", 0.0,
             SCANNER + "; half of the noise", 0.5 * NOISE, **params)  # fmt: skip
        out = (left.apply(state.points) - state.points)[:, 2].mean()
        across = abs(float(out))
        _add(result, "motion left across the crease plane", across, "mm", 0.0, "5 noise / sqrt(n) / sin(phi/2)",
             5.0 * NOISE / math.sqrt(len(cloud)) / math.sin(0.5 * DIHEDRAL), **params)  # fmt: skip
        kept = scan.distances(found.motion.apply(cloud), state).of(found.kept)
        law = "normal noise, trimmed at 3 standard deviations"
        _add(result, "root mean square distance", found.noise, "mm", square, law, 0.03, **params)
        _add(result, "mean distance", kept.mean, "mm", mean, law, 0.03, **params)
        _add(result, "median distance", kept.median, "mm", median, law, 0.03, **params)
        _add(result, "share of the scan that is kept", float(found.kept.mean()), "", 1.0 / (1.0 + STRAYS),
             "all but the strays", 0.01, **params)  # fmt: skip


def _rotation_vector(motion: scan.Motion) -> Array:
    from scipy.spatial.transform import Rotation

    vector: Array = Rotation.from_matrix(motion.rotation).as_rotvec()
    return vector


def _exact_cones(result: CaseResult, context: Context, angle: float) -> None:
    """Scans of the cones of 3.4.2 against the solved sheets: their free ends are no cones, and are to be seen.

    Noise and what the sheet is off the cones are independent, so their squares add.
    """
    random = np.random.default_rng(5)
    count = round((0.2 if context.quick else 1.0) * DENSITY * 2.0 * WIDTH * RADIUS * angle)
    radius = np.sqrt(random.uniform((RADIUS - WIDTH) ** 2, (RADIUS + WIDTH) ** 2, count))
    exact = cone.folded_points(radius, random.uniform(0.0, angle, count), RADIUS, DIHEDRAL)
    cloud = scanned(exact, 5)
    at = np.array([(r, a) for r in (RADIUS - WIDTH, RADIUS + WIDTH) for a in (0.0, angle)])
    places = cone.folded_points(at[:, 0], at[:, 1], RADIUS, DIHEDRAL)
    for formulation in FORMULATIONS:
        context.tell(f"scan: cones, {formulation}")
        state = folded_sector(formulation, angle)
        names = ("inner-start", "inner-end", "outer-start", "outer-end")
        start = scan.picked(places, state.points[[state.mesh.corners[f"corner:{name}"] for name in names]])
        found = scan.compare(cloud, state, start)
        params = {
            "angle_deg": round(math.degrees(angle), 6),
            "formulation": formulation,
            "points": len(cloud),
        }
        kept = found.cloud_to_sheet.of(found.registration.kept)
        clean = scan.distances(found.registration.motion.apply(exact), state)
        square = float((clean.values**2).mean())
        expected = math.sqrt((NOISE * truncated_normal()[0]) ** 2 + square)
        _add(result, "cones: root mean square distance", math.sqrt(float((kept.values**2).mean())), "mm", expected,
             "the scanner's noise, and the sheet off the exact cones", 0.03, **params)  # fmt: skip
        _add(result, "cones: root mean square of the sheet off the cones", math.sqrt(square), "mm", 0.0,
             "source 3.4.2: portions of cones; free ends are not", 0.5 * NOISE, **params)  # fmt: skip
        _statistics(result, "cones", kept, "cloud to sheet", params)
        _statistics(result, "cones", found.sheet_to_cloud, "sheet to cloud", params)
        _statistics(result, "cones without noise", clean, "cloud to sheet", params)
        if formulation == "consistent" and not context.quick:
            _picture(
                result,
                context,
                "scan_cones",
                found.sheet_to_cloud,
                "The folded sector against the scan of cones",
                "Distances of the enriched mesh to the scan, as the source draws them; spots are its holes.",
            )


def _statistics(
    result: CaseResult, what: str, found: scan.Distances, way: str, params: dict[str, Any]
) -> None:
    for name in ("mean", "median", "standard_deviation", "max"):
        quantity = f"{what}: {name.replace('_', ' ')} of the distances"
        _add(result, quantity, getattr(found, name), "mm", None, "source 3.4.3", None, way=way, **params)


# ------------------------------------------------------------------------------------------------- patterns


def folded(pattern: CreasePattern, formulation: str, Lstar: float, size: float | None) -> bh.Path:
    """All creases folded by 60 degrees as drawn, default settings; gmsh triangles of `size` mm, or one row a panel."""
    if size is None:
        mesh = meshes.structured(pattern, along=32)
    else:
        mesh = meshes.unstructured(pattern, size=size)
    return bh.trace(bh.Model(mesh, PAPER, formulation=formulation).fold("all", by=FOLD, Lstar=Lstar))


def _pattern(result: CaseResult, context: Context, sample: Sample) -> None:
    """The consistent formulation is the paper; bars and hinges try several L*, as the source did."""
    name = sample.name
    size = 6.0 if context.quick else 3.0
    paper = folded(sample.pattern, "consistent", PAPER_LSTAR, size)
    same = folded(sample.pattern, "bars-and-hinges", PAPER_LSTAR, size)
    for path, formulation in ((paper, "consistent"), (same, "bars-and-hinges")):
        _add(result, "pattern folds with default settings", float(path.outcome == "reached"), "", 1.0,
             "the last rest angle is reached", 0.0, pattern=name, formulation=formulation, size_mm=size)  # fmt: skip
    _same_mesh(result, name, paper[-1], same[-1], size)
    cloud = sampled(paper[-1], 0.2 * DENSITY if context.quick else DENSITY, 1)
    Lstars = (PAPER_LSTAR,) if context.quick else LSTARS
    series = []
    for mesh, length in (("gmsh", size), ("one row", None)):
        paths = [(folded(sample.pattern, "bars-and-hinges", Lstar, length), Lstar) for Lstar in Lstars]
        tried = []
        for path, Lstar in paths:
            if path.outcome != "reached":
                continue
            try:
                tried.append((_against(cloud, paper[-1], path[-1]), Lstar))
            except InputError as lost:  # this stiffness has no place beside the others, and says so
                result.notes.append(f"{name}, {mesh}, L* = {Lstar:g} mm: no distance, {lost}.")
        if not tried:
            _add(result, "pattern: lowest mean distance over L*", math.nan, "mm", 0.0, "no path was reached",
                 sample.claim, pattern=name, mesh=mesh)  # fmt: skip
            continue
        (there, back), Lstar = min(tried, key=lambda one: one[0][0].mean)
        params = {"pattern": name, "mesh": mesh, "formulation": "bars-and-hinges", "Lstar_mm": Lstar}
        # one row a panel lets bars and hinges bend along its node lines only, which soft springs cannot force: it needs
        # its own L*, and quick runs try one only
        judged = sample.claim if mesh == "gmsh" or not context.quick else None
        _add(result, "pattern: lowest mean distance over L*", there.mean, "mm", 0.0,
             f"source 3.4.3: below {sample.claim:g} mm (there to paper)", judged, **params)  # fmt: skip
        _statistics(result, "pattern", back, "sheet to cloud", params)
        _statistics(result, "pattern", there, "cloud to sheet", params)
        for (to_sheet, _), other in tried:
            _add(result, "pattern: mean distance by L*", to_sheet.mean, "mm", 0.0,
                 f"consistent, L* = {PAPER_LSTAR:g} mm", None, **{**params, "Lstar_mm": other})  # fmt: skip
        series.append(line(mesh, [at for _, at in tried], [one.mean for (one, _), _ in tried]))
        if mesh == "gmsh" and not context.quick:
            _picture(result, context, f"scan_{name.replace(' ', '_')}_distances", back,
                     f"Distances, {name}", f"{name}: bars and hinges (L* = {Lstar:g} mm) against the consistent "
                     "formulation (L* = 10 mm) in the place of paper.")  # fmt: skip
    result.plots.append(
        plot(f"scan-{name.replace(' ', '-')}", name.capitalize(), "L*, mm", "mean distance, mm", series,
             "Bars and hinges with several L* against the consistent sheet with L* = 10 mm.", log="x")
    )  # fmt: skip
    if not context.quick:
        _folded_picture(result, context, name, paper[-1])


def _against(cloud: Array, paper: bh.State, state: bh.State) -> tuple[scan.Distances, scan.Distances]:
    """Distances of a tenth of the cloud to the sheet, and of the sheet to the cloud.

    The cloud is clean and the sheets really differ: nothing is trimmed, and 4,000 points tell the motion.
    """
    surface = scan.Surface(state)
    found = scan.register(cloud[:4000], surface, scan.align(corners(paper), corners(state)), trim=math.inf)
    moved = found.motion.apply(cloud)
    there = scan.distances(moved[: max(len(cloud) // 10, 4000)], surface)
    return there, scan.distances(moved, surface, "sheet-to-cloud")


def _same_mesh(result: CaseResult, name: str, paper: bh.State, same: bh.State, size: float) -> None:
    params = {"pattern": name, "size_mm": size, "Lstar_mm": PAPER_LSTAR}
    own, other = paper.energy.as_dict(), same.energy.as_dict()
    for kind in own:
        _add(result, f"pattern: {kind} energy, bars and hinges over consistent", other[kind] / own[kind], "", 1.0,
             SAME_MESH, None, **params)  # fmt: skip
    moved = scan.align(same.points, paper.points).apply(same.points)
    apart = np.linalg.norm(moved - paper.points, axis=1)
    for quantity, value in (("mean", apart.mean()), ("largest", apart.max())):
        _add(result, f"pattern: {quantity} distance of the same nodes", value, "mm", 0.0,
             SAME_MESH, None, **params)  # fmt: skip
    for crease in paper.mesh.creases:
        angle = math.degrees(float(np.abs(same.fold_angle(crease)).mean()))
        reference = math.degrees(float(np.abs(paper.fold_angle(crease)).mean()))
        _add(result, "pattern: mean fold angle by bars and hinges", angle, "degrees", reference,
             SAME_MESH, None, crease=crease, **params)  # fmt: skip


# ------------------------------------------------------------------------------------------------- pictures and words


def _picture(
    result: CaseResult, context: Context, name: str, found: scan.Distances, alt: str, caption: str
) -> None:
    scan.picture(found, context.folder / f"{name}.png")
    result.pictures.append({"file": f"{name}.png", "alt": alt, "caption": caption})


def _folded_picture(result: CaseResult, context: Context, name: str, state: bh.State) -> None:
    file = f"scan_{name.replace(' ', '_')}.png"
    bh.plotting.picture(state, context.folder / file)
    result.pictures.append(
        {
            "file": file,
            "alt": f"The {name} folded by 60 degrees, bending energy",
            "caption": f"{name.capitalize()}, consistent formulation, L* = 10 mm, rest angles 60 degrees from flat.",
        }
    )


def _notes(result: CaseResult) -> None:
    means = {
        (c.params["pattern"], c.params["mesh"]): c.value
        for c in result.checks
        if c.quantity == "pattern: lowest mean distance over L*"
    }
    words = "; ".join(
        f"{name} {means[name, 'gmsh']:.2g} mm on gmsh triangles, {means[name, 'one row']:.2g} mm on one row a panel"
        for name in dict.fromkeys(name for name, _ in means)
    )
    result.notes.append(
        f"Mean distances of bars and hinges to the consistent sheet, at the best L*: {words}."
    )
    result.notes.append(
        "The source's scans are not published, nor are the sizes of its patterns. Its claim of means below 1 mm (2 mm "
        "for the sine tessellation) is against paper; here it is put to the consistent formulation."
    )
