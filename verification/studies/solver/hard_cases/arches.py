"""Snap-through and snap-back of sheets and bars as a user would model them, against exact curves."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import meshes
from bh import Force, Model, Path, Sheet, trace
from bh.solvers.outcome import Critical
from verification.framework.checks import CaseResult, line, plot
from verification.studies.solver.benchmark_systems import VonMisesTruss
from verification.studies.solver.hard_cases.common import located
from verification.theory.arch import SineArch

LIMIT, BIFURCATION = Critical.LIMIT, Critical.BIFURCATION

Array = NDArray[np.float64]
SPAN, BREADTH, THICKNESS, MODULUS = 100.0, 4.0, 1.0, 4000.0


# ------------------------------------------------------------------------------------ a sheet: sinusoidal arch


def arch_theory(rise: float) -> SineArch:
    """The beam of the strip's section."""
    return SineArch(SPAN, rise, MODULUS * BREADTH * THICKNESS**3 / 12.0, MODULUS * BREADTH * THICKNESS)


def arch_model(rise: float, along: int, load: float) -> Model:
    """A strip whose stress-free shape is the arch, hinged at both ends, under `load` sin(pi x / L) in N/mm.

    Every node takes the share of the load of its part of the edge lines.
    """
    mesh = meshes.structured(meshes.strip(SPAN, BREADTH), along=along)
    sine = np.sin(math.pi * mesh.points[:, 0] / SPAN)
    model = Model(
        replace(mesh, points=mesh.points + np.outer(rise * sine, [0.0, 0.0, 1.0])),
        Sheet(E=MODULUS, t=THICKNESS),
        formulation="bars-and-hinges",
        contact=False,
    )
    model = model.support("edge:start", "xz").support("edge:end", "xz").support("edge:inner", "y")
    share = np.zeros(len(sine))
    for edge in ("inner", "outer"):
        nodes = mesh.nodes(f"edge:{edge}")
        share[nodes] = 0.5 * np.gradient(mesh.points[nodes, 0]) * sine[nodes]
    return model.step(
        *(Force([i], each=(0.0, 0.0, -load * s)) for i, s in enumerate(share.tolist()) if s > 1e-9)
    )


def amplitudes(path: Path) -> tuple[Array, Array]:
    """(states,) amplitudes of sin(pi x / L) and sin(2 pi x / L) in the shape, by least squares, mm."""
    x = path.model.mesh.points[:, 0]
    modes = np.column_stack([np.sin(k * math.pi * x / SPAN) for k in (1, 2)])
    found = np.array([np.linalg.lstsq(modes, state.points[:, 2], rcond=None)[0] for state in path])
    return found[:, 0], found[:, 1]


def arch(result: CaseResult) -> None:
    """Through snap-through along the symmetric path (rise 1.2 t), and over a bifurcation (rise 3 t)."""
    source = "Fung and Kaplan 1952 (closed form, shallow arch)"
    series = []
    low = arch_theory(1.2 * THICKNESS)
    peak = float(low.load(low.limits()[0]))
    for along in (32, 64, 128, 256):
        path = trace(arch_model(low.h, along, 1.5 * peak))
        b, _ = amplitudes(path)
        load = 1.5 * peak * path.lambdas
        judged = along == 256
        result.check(
            "arch: largest distance from the exact path, in limit loads",
            np.abs(load - low.load(b)).max() / peak,
            reference=0.0,
            source=source,
            tolerance=0.01 if judged else None,
            params={"along": along},
            path=path,
        )
        _critical(result, low, path, peak, source, judged, along)
        unstable = [bool(abs(x) < low.limits()[0]) for x in b[1:]]
        told = [record.stable is False for record in path.records[1:]]
        near = np.abs(np.abs(b[1:]) - low.limits()[0]) < 0.05 * low.h
        wrong = sum(u != s for u, s, n in zip(unstable, told, near, strict=True) if not n)
        result.check(
            "arch: states whose stability is told wrongly",
            wrong,
            reference=0.0,
            source=source,
            tolerance=0.0 if judged else None,
            params={"along": along},
            path=path,
        )
        if judged:
            series.append(line("256 cells", (low.h - b).tolist(), (load / peak).tolist(), "points"))
    exact = np.linspace(low.h, -1.3 * low.h, 200)
    series.append(line("exact", (low.h - exact).tolist(), (low.load(exact) / peak).tolist(), "reference"))
    result.plots.append(
        plot(
            "hard-arch",
            "Shallow sinusoidal arch",
            "fall of the crown, mm",
            "load over limit load",
            series,
            "Rise 1.2 t, hinged, dead sinusoidal load: through the limit points.",
        )
    )
    _tall_arch(result, source)


def _critical(
    result: CaseResult, low: SineArch, path: Path, peak: float, source: str, judged: bool, along: int
) -> None:
    """Loads and kinds of the four critical points of the low arch: behind its limit points it could also sway."""
    top, bottom = low.limits()
    sway = low.bifurcation()
    exact = ((LIMIT, top), (BIFURCATION, sway), (BIFURCATION, -sway), (LIMIT, bottom))
    found = [at for _, at in path.critical_points]
    result.check(
        "arch: critical points",
        len(found),
        reference=4.0,
        source=source,
        tolerance=0.0 if judged else None,
        params={"along": along},
        path=path,
    )
    for number, ((kind, b), at) in enumerate(zip(exact, found, strict=False), 1):
        params = {"along": along, "number": number, "kind": kind}
        off = abs(1.5 * at.lam - float(low.load(b)) / peak)
        result.check(
            "arch: distance of a critical load from the exact one, in limit loads",
            off,
            reference=0.0,
            source=source,
            tolerance=0.02 if judged else None,
            params=params,
            path=path,
        )
        result.check(
            "arch: critical point called what it is",
            at.kind == kind,
            reference=1.0,
            source=source,
            tolerance=0.0 if judged else None,
            params=params,
            path=path,
        )


def _tall_arch(result: CaseResult, source: str) -> None:
    """The arch sways before its limit point; the default then goes to the stable state beyond."""
    tall = arch_theory(3.0 * THICKNESS)
    sway = float(tall.load(tall.bifurcation()))
    path = trace(arch_model(tall.h, 256, 1.5 * sway))
    b, _ = amplitudes(path)
    found = located(path, BIFURCATION) + located(path, LIMIT)
    first = min((lam for lam, _ in found), default=math.nan)
    result.check(
        "arch: load where it sways",
        1.5 * first * sway,
        unit="N/mm",
        reference=sway,
        source=source,
        tolerance=0.01,
        path=path,
    )
    load = 1.5 * sway * path.lambdas[-1]
    result.check(
        "arch: load that belongs to the snapped shape",
        tall.load(b[-1]),
        unit="N/mm",
        reference=load,
        source=source,
        tolerance=0.01,
        path=path,
    )


# ------------------------------------------------------------------------------------ bars alone: a truss in a model


def truss_model(truss: VonMisesTruss) -> Model:
    """The truss of `benchmark_systems` as bars of a model in the plane y = 0; its spring hangs from the top as a bar.

    Nodes 0 and 1 are the feet, 2 the top, 3 the lower end of the spring; 4 and 5, fixed aside, only make triangles
    that stay open. Other edges and all hinges have no stiffness.
    """
    assert truss.spring is not None
    aside = 2.0 * truss.span
    points = [
        [-truss.span, 0.0, 0.0],
        [truss.span, 0.0, 0.0],
        [0.0, 0.0, truss.rise],
        [0.0, 0.0, truss.rise - 10.0],
        [0.0, aside, 0.0],
        [0.0, -aside, 0.0],
    ]
    triangles = [[0, 2, 4], [2, 1, 4], [2, 3, 5]]
    bars = [[0, 2], [1, 2], [2, 3], [0, 4], [2, 4], [1, 4], [2, 5], [3, 5]]
    stiffness = [truss.stiffness, truss.stiffness, truss.spring, *[0.0] * 5]
    supports = [[0, 1, 1, 1], [1, 1, 1, 1], [2, 0, 1, 0], [3, 1, 1, 0], [4, 1, 1, 1], [5, 1, 1, 1]]
    return Model.from_arrays(points, triangles, bars, stiffness, [[2, 4]], [0.0], [], [], supports)


def truss_with_spring(result: CaseResult) -> None:
    """Driven by a force and by a displacement at the end of the spring; a soft one snaps back under both."""
    series = []
    for spring in (0.5, 0.05):
        truss = VonMisesTruss(spring=spring)
        base = truss_model(truss)
        reach = 2.7 * truss.rise + truss.force / spring
        for drive, model in (
            ("force", base.force([3], each=(0.0, 0.0, -truss.force))),
            ("displacement", base.displace([3], "z", -reach)),
        ):
            path = trace(model)
            top = np.array([truss.rise - state.points[2, 2] for state in path])
            end = np.array([truss.rise - 10.0 - state.points[3, 2] for state in path])
            pull = truss.force * truss.load(top)
            off = np.abs(end - top - pull / spring).max()
            if drive == "force":
                off = max(float(off), float(np.abs(pull - truss.force * path.lambdas).max()))
            params = {"spring": spring, "drive": drive}
            result.check(
                "truss in a model: distance from the exact path",
                off,
                unit="mm",
                reference=0.0,
                source="closed form",
                tolerance=1e-6,
                params=params,
                path=path,
            )
            result.check(
                "truss in a model: snapped through",
                top[-1] > truss.rise,
                reference=1.0,
                source="closed form",
                tolerance=0.0,
                params=params,
                path=path,
            )
            if drive == "force":
                found = [lam for lam, _ in located(path, LIMIT)]
                for number, exact in enumerate((truss.limit(), -truss.limit())):
                    lam = found[number] if number < len(found) else math.nan
                    result.check(
                        "truss in a model: limit load",
                        truss.force * lam,
                        unit="N",
                        reference=truss.force * exact,
                        source="closed form",
                        tolerance=1e-5,
                        params={"number": number + 1, **params},
                        path=path,
                    )
            series.append(line(f"spring {spring:g}, {drive}", end.tolist(), pull.tolist()))
    result.plots.append(
        plot(
            "hard-truss-model",
            "Truss with a spring, as a model",
            "displacement of the spring's end, mm",
            "force, N",
            series,
            "By bh.trace with default settings.",
        )
    )
