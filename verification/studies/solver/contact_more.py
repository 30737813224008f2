"""Friction, moulds and how far creases close, in case `contact`: each against a closed form or a body that is exact."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

import bh
import meshes
from bh.loading.load_step import crease_hinges
from bh.mechanics.shared.kinematics import dihedral_angles
from bh.paths.path import Path
from meshes.topology import Ints
from verification.framework.checks import CaseResult, Context

Array = NDArray[np.float64]
MU, WEIGHT, SPRING = 0.3, 0.02, 0.01  # coefficient, N, N / mm
SLOPE = 2.0  # at the end, over that at which it slips
FACETS, TRAVEL, GAP, RADIUS = 48, 1.5, 0.005, 2.0  # of a mould of a cylinder; mm
SHUT = ((1, 0.2), (2, 0.2), (2, 0.4))  # rows of cells a panel, and thickness, mm
PANEL = 10.0  # mm
WITHIN = 0.02
DRUM, TURN, HOLD, SOFT = 5.0, math.pi, 0.2, 1e-3  # mm, rad, N, N / mm


def more(result: CaseResult, context: Context) -> None:
    """All of it.

    Args:
        result: to which checks are added.
        context: of the run.
    """
    friction(result, context.quick)
    mould(result)
    shut(result, context.quick)


# ------------------------------------------------------------------------------------ friction


def slope(plate: bh.Indenter | bh.Mould | None = None) -> Path:
    """A strip on a plate that a soft spring holds; its weight leans along the plate by more than it can hold.

    Args:
        plate: whose upper face is at z = -0.05 mm; None for a bar.
    """
    mesh = meshes.structured(meshes.strip(20.0, 5.0, [2.5], ["flat"]), along=8, rows=1)
    plate = plate or bh.Indenter("plate", (10.0, 2.5, -1.05), 0.5 * math.pi, 100.0, 2.0, 0.5)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, nu=0.0, t=0.2), contact=False, friction=MU)
    model = model.spring("all", total=(SPRING, SPRING, 1e-3))
    model = model.step(plate, bh.Force("all", total=(0.0, 0.0, -WEIGHT)))
    leaning = bh.Force("all", total=(SLOPE * MU * WEIGHT, 0.0, -WEIGHT))
    return bh.trace(model.step(plate, leaning), warn=False, estimate=False)


def belt(mu: float) -> tuple[float, Path]:
    """Force of the pulled end over that of the other one of a strip round half a turn of a drum, and its path.

    Args:
        mu: coefficient of friction.
    """
    gap = 0.02
    mesh = meshes.structured(meshes.strip(60.0, 2.0, [1.0], ["flat"]), along=96, rows=1)
    drum = bh.Indenter("drum", (30.0, 1.0, -DRUM - gap), 0.5 * math.pi, 2.0 * DRUM, 2.0 * DRUM, DRUM, gap=gap)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, nu=0.0, t=0.02), contact=False, friction=mu)
    model = model.support("edge:start", "y").support("edge:end", "y").spring("all", total=(SOFT,) * 3)
    ends = [bh.Force(at, total=(0.0, 0.0, -HOLD)) for at in ("edge:start", "edge:end")]
    model = model.step(drum, *ends).step(drum, bh.Displace("edge:end", "z", further=-0.5))
    path = bh.trace(model, neighbours=False, warn=False, estimate=False)
    points, pulled = path[-1].points, path[-1].reactions[mesh.nodes("edge:end"), 2].sum()
    hanging = points[:, 2] < -DRUM - gap
    carried = SOFT * -points[:, 2] / len(points)  # by the springs, on the way from an end to the drum
    left, right = (carried[hanging & side].sum() for side in (points[:, 0] < 30.0, points[:, 0] > 30.0))
    return float((HOLD - pulled - right) / (HOLD - left)), path


def friction(result: CaseResult, quick: bool) -> None:
    """A strip that slips on a slope, and one round a drum.

    Args:
        result: to which checks are added.
        quick: without the drum.
    """
    path = slope()
    way = np.array([float((state.points - path.model.mesh.points)[:, 0].mean()) for state in path])
    lean = np.array([SLOPE * MU * state.lam * (state.step == 1) for state in path])
    stuck = lean < MU
    result.check(
        "way of a strip that sticks on a slope, over the thickness",
        way[stuck].max() / path.model.sheet.t,
        reference=0.0,
        source="a contact sticks up to a slip of 0.01 t",
        tolerance=0.01,
        path=path,
    )
    result.check(
        "way of a strip that slides on a slope",
        way[-1] if path.reached else math.nan,
        unit="mm",
        reference=(SLOPE - 1.0) * MU * WEIGHT / SPRING,
        source="what friction does not hold, a spring does",
        tolerance=0.01,
        path=path,
    )
    result.check(
        "what friction has used up on a slope",
        path[-1].energy.friction,
        unit="N mm",
        reference=MU * WEIGHT * way[-1],
        source="mu N times the way",
        tolerance=WITHIN,
        path=path,
    )
    for mu in () if quick else (0.1, 0.3):
        ratio, round_drum = belt(mu)
        result.check(
            "forces of the ends of a strip round half a turn of a drum",
            ratio if round_drum.reached else math.nan,
            reference=math.exp(mu * TURN),
            source="exp(mu pi)",
            tolerance=WITHIN,
            params={"friction": mu},
            path=round_drum,
        )


# ------------------------------------------------------------------------------------ moulds


def solid(facets: int) -> tuple[Array, Ints]:
    """Points (n, 3), mm, and triangles (m, 3) of a closed cylinder along y, its middle in the origin.

    Args:
        facets: of its round side.
    """
    angle = 2.0 * np.pi * (np.arange(facets) + 0.5) / facets
    ring = np.column_stack((RADIUS * np.cos(angle), np.zeros(facets), RADIUS * np.sin(angle)))
    half = np.array([0.0, 6.0, 0.0])
    here, there = np.arange(facets), np.roll(np.arange(facets), -1)
    one, two = np.full(facets, 2 * facets), np.full(facets, 2 * facets + 1)
    parts = (
        (here, here + facets, there),
        (there, here + facets, there + facets),
        (one, here, there),
        (two, there + facets, here + facets),
    )
    return np.vstack((ring - half, ring + half, -half, half)), np.vstack([np.column_stack(p) for p in parts])


def written(file: FilePath, facets: int) -> FilePath:
    """An STL file of `solid`.

    Args:
        file: its place.
        facets: of its round side.
    """
    points, triangles = solid(facets)
    corners = ("\n".join(f"vertex {x!r} {y!r} {z!r}" for x, y, z in points[t].tolist()) for t in triangles)
    facet = "facet\nouter loop\n{}\nendloop\nendfacet"
    file.write_text("\n".join(["solid s", *(facet.format(three) for three in corners), "endsolid s"]))
    return file


def three_point(file: FilePath | None) -> Path:
    """A strip that is bent between three cylinders.

    Args:
        file: of their mould; None for exact ones.
    """
    mesh = meshes.structured(meshes.strip(40.0, 5.0, [2.5], ["flat"]), along=32, rows=1)

    def body(name: str, x: float, z: float, by: float = 0.0) -> bh.Indenter | bh.Mould:
        at, way = (x, 2.5, z), (0.0, 0.0, by)
        if file is None:
            return bh.Indenter(name, at, 0.5 * math.pi, 2.0 * RADIUS, 2.0 * RADIUS, RADIUS, by=way, gap=GAP)
        return bh.Mould.read(file, unit="mm", name=name, at=at, by=way, gap=GAP)

    off = RADIUS + 1.002 * GAP
    bodies = body("left", 5.0, -off), body("right", 35.0, -off), body("top", 20.0, off, -TRAVEL)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, nu=0.0, t=0.381), formulation="consistent", contact=False)
    soft = bh.Tether("all", (1e-3, 1e-3, 1e-6))
    return bh.trace(model.step(*bodies, soft), warn=False, estimate=False)


def mould(result: CaseResult) -> None:
    """Force and work of a cylinder of facets from an STL file, beside the exact one.

    Args:
        result: to which checks are added.
    """
    with TemporaryDirectory() as folder:
        path = three_point(written(FilePath(folder) / "cylinder.stl", FACETS))
    exact = three_point(None)
    push = [-float(state.contact_forces["top"][2]) if state.lam else 0.0 for state in path]
    result.check(
        "force of a mould of facets that bends a strip",
        push[-1] if path.reached else math.nan,
        unit="N",
        reference=-float(exact[-1].contact_forces["top"][2]),
        source="exact cylinders",
        tolerance=WITHIN,
        params={"facets": FACETS},
        path=path,
    )
    pairs = pairwise(zip(push, (state.lam for state in path), strict=True))
    work = sum(0.5 * TRAVEL * (f + g) * (b - a) for (f, a), (g, b) in pairs)
    result.check(
        "work of a mould that bends a strip",
        work,
        unit="N mm",
        reference=path[-1].energy.total + path[-1].energy.contact,
        source="what the strip has gained",
        tolerance=WITHIN,
        params={"facets": FACETS},
        path=path,
    )


# ------------------------------------------------------------------------------------ how far a crease closes


def shut(result: CaseResult, quick: bool) -> None:
    """The angle at which springs press a crease shut, beside `bh.contact.least_angle` and its formula.

    Args:
        result: to which checks are added.
        quick: with one row of cells only.
    """
    for rows, t in SHUT[:1] if quick else SHUT:
        mesh = meshes.structured(meshes.strip(20.0, 2.0 * PANEL, [PANEL]), along=8, rows=rows)
        (crease,) = mesh.creases
        model = bh.Model(
            mesh, bh.Sheet(E=4000.0, nu=0.0, t=t), contact="thickness", formulation="consistent"
        ).fold(crease, rest=0.0, Lstar=20.0)
        path = bh.trace(model, neighbours=False, warn=False, estimate=False)
        angles = dihedral_angles(path[-1].points, mesh.topology.hinges)[crease_hinges(mesh, crease)]
        params = {"rows": rows, "t": t}
        least = float(bh.contact.least_angle(mesh, crease, t)[0])
        result.check(
            "angle that least_angle tells",
            least,
            unit="rad",
            reference=2.0 * math.asin(0.5 * t * rows / PANEL),
            source="2 asin(t / 2 h)",
            tolerance=1e-12,
            params=params,
        )
        result.check(
            "angle of a crease that is pressed shut",
            float(angles.mean()) if path.reached else math.nan,
            unit="rad",
            reference=least,
            source="bh.contact.least_angle",
            tolerance=WITHIN,
            params=params,
            path=path,
        )
