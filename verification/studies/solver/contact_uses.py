"""Uses of contact in case `contact`: the fan of 3.5.3, Fig. 5.3 with panels that meet, strips of chapter 6.

None of these is in the source, whose panels pass through each other.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import bh
import meshes
from bh.analysis.contact import Panels, first_contact
from bh.applications.inverse.simulate import Setting, model
from bh.model.model import Contact
from bh.paths.path import Path
from bh.plotting.pictures import picture
from meshes import SheetMesh
from verification.framework.checks import CaseResult, Context, line, plot
from verification.studies.ch3 import fig3_11
from verification.studies.ch5 import fig5_3
from verification.studies.solver.hard_cases.pinching import Fan

Array = NDArray[np.float64]
PREDICATE = "the predicate of bh.contact, which shares nothing with the barrier"
CLOSE = 0.02
FAN, SHARE = (24, 2), 0.9558  # cells along and rows a pleat; of the folded width, that brings creases t apart
DEEP, STIFF = 50, 0.02  # cells along the annulus of Fig. 5.3; L*, mm, of the springs that press it shut
DEEPEST, BEYOND = math.pi / 38.0, 0.2  # rad; gap, mm, of panels that are thin enough to get there
FRACTIONS = (1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 14.0, 20.0, 25.0, 31.0, 38.0, 45.0, 55.0, 66.0, 78.5, 90.0)
# curvatures before folding, 1/mm, lengths, mm, and pinches of strips whose panels pass through each other if they may
STRIPS = {
    "three segments": ([0.01367, -0.01558, 0.01271], [205.2, 117.5, 212.4], [False, True, False]),
    "two segments": ([0.01429, -0.01253], [183.6, 207.7], [True, False]),
}
SETTING = Setting(edge=5.0, fold=math.pi / 3.0)


def uses(result: CaseResult, context: Context) -> None:
    """All of them.

    Args:
        result: to which checks, plots and pictures are added.
        context: of the run.
    """
    context.tell("contact: a fan that is pinched shut")
    fan(result, context)
    context.tell("contact: panels of Fig. 5.3 that meet")
    deep(result, context)
    context.tell("contact: strips that cross in space")
    strips(result, context)


# ------------------------------------------------------------------------------------ the fan of 3.5.3


def pinched_fan(contact: bool) -> tuple[Fan, Path]:
    """The fan of `fig3_11`, folded, and its middle line drawn in until creases of one side are a thickness apart.

    Args:
        contact: do panels stop each other by their thickness?
    """
    it = Fan(*FAN[:1], fig3_11.ANGLE, fig3_11.THICKNESS, "bars-and-hinges", fig3_11.RADIUS, FAN[1])
    folded = bh.trace(it.folded, estimate=False)
    pinched = replace(fig3_11.pinched(it, folded[-1], SHARE), contact="thickness" if contact else False)
    return it, bh.trace(pinched, warn=False, estimate=False, neighbours=False)


def pinch(it: Fan, path: Path) -> tuple[Array, Array, Array]:
    """Of every state of the pinch: how far creases of one side are apart, mm, what is pulled, N, and the energy, N mm.

    The pull is what its own work says, the sum over the line of force times way, in parts of the way of its end.

    Args:
        it: the fan.
        path: of `pinched_fan`.
    """
    states = [state for state in path if state.step == 1]
    at = np.array([state.points[it.line] @ it.er for state in states])
    force = np.array([state.reactions[it.line] @ it.er for state in states])
    ways = at[-1] - at[0]
    pull = force[:, 1:] @ ways[1:] / ways[-1]
    energy = np.array([state.energy.total + state.energy.contact for state in states])
    return (at[:, -1] - at[:, 0]) * 2.0 / (len(it.line) - 1), pull, energy


def apart(mesh: SheetMesh, x: Array) -> float:
    """Least distance of panels that share no crease, mm, by points that are spread over their triangles.

    Args:
        mesh: of the sheet.
        x: (n, 3) positions, mm.
    """
    from scipy.spatial import cKDTree

    panels, cells = Panels.of(mesh), 8
    share = np.array([(i, j, cells - i - j) for i in range(cells + 1) for j in range(cells + 1 - i)]) / cells
    points = [
        np.einsum("sk,tkc->tsc", share, x[mesh.triangles[panels.of_triangle == k]]).reshape(-1, 3)
        for k in range(len(panels.creases))
    ]
    return min(
        float(cKDTree(points[a]).query(points[b])[0].min())
        for a in range(len(points))
        for b in range(a)
        if not set(panels.creases[a]) & set(panels.creases[b])
    )


def fan(result: CaseResult, context: Context) -> None:
    """It touches, it presses, nothing passes through, and the pull's work is what the sheet gains.

    Args:
        result: to which checks are added.
        context: of the run.
    """
    it, path = pinched_fan(contact=True)
    _, free = pinched_fan(contact=False)
    width, pull, energy = pinch(it, path)
    _clear(result, "the fan of 3.5.3, pinched", path)
    t = path.model.sheet.t
    first = next((i for i, s in enumerate(s for s in path if s.step == 1) if s.energy.contact > 0.0), -1)
    result.check(
        "least distance of pleats of a pinched fan",
        apart(it.mesh, path[-1].points) if path.reached and first >= 0 else math.nan,
        unit="mm",
        reference=t,
        source="panels that touch lie a thickness apart",
        tolerance=CLOSE,
        path=path,
    )
    work = float(np.trapezoid(pull, width)) * 0.5 * (len(it.line) - 1)
    result.check(
        "work of the pull of a fan, over what the sheet gains",
        abs(work / (energy[-1] - energy[0])),
        reference=1.0,
        source="no friction",
        tolerance=CLOSE,
        path=path,
    )
    result.check(
        "pull of a fan whose pleats begin to touch", abs(pull[first]), unit="N", source="measured", path=path
    )
    result.check("pull of a fan that is pinched shut", abs(pull[-1]), unit="N", source="measured", path=path)
    wide, without, _ = pinch(it, free)
    result.check("the same, without contact", abs(without[-1]), unit="N", source="measured", path=free)
    result.plots.append(
        plot(
            "contact-fan",
            "A fan that is pinched until its pleats touch",
            "distance of creases of one side, thicknesses",
            "pull, N",
            [
                line("panels stop each other", (width / t).tolist(), np.abs(pull).tolist()),
                line("without contact", (wide / t).tolist(), np.abs(without).tolist(), "reference"),
            ],
            "The fan of Fig. 3.11 (t = 0.5 mm): beyond one thickness there is nothing left to pinch.",
            log="xy",
        )
    )
    _picture(result, context, path, "contact_fan", "The fan of 3.5.3 pinched until its pleats touch")


# ------------------------------------------------------------------------------------ deep folds of Fig. 5.3


def annulus(contact: Contact) -> bh.Model:
    """The sheet of Fig. 5.3 with one row of bars and hinges, as the source's.

    Args:
        contact: of the model.
    """
    pattern = meshes.annulus_sector(
        1.0 / fig5_3.KAPPA_0, fig5_3.WIDTH, fig5_3.LENGTH * fig5_3.KAPPA_0, folds="mountain"
    )
    mesh = meshes.structured(pattern, along=DEEP, rows=1)
    return bh.Model(mesh, bh.Sheet(E=fig5_3.E, t=fig5_3.T), formulation="bars-and-hinges", contact=contact)


def closed(contact: Contact) -> Path:
    """Its crease pressed shut by stiff springs.

    Args:
        contact: of the model.
    """
    sheet = annulus(contact).fold("crease", rest=math.pi / 3.0, Lstar=STIFF)
    return bh.trace(sheet.fold("crease", rest=0.0, Lstar=STIFF), warn=False, estimate=False, neighbours=False)


def deep(result: CaseResult, context: Context) -> None:
    """How far a crease closes whose panels meet, and that its curvature is that of Fig. 5.3 up to there.

    Args:
        result: to which checks are added.
        context: of the run.
    """
    model = annulus(contact=False)
    for fraction in FRACTIONS:
        model = model.fold("crease", to=math.pi / fraction)
    free = bh.trace(model, warn=False, estimate=False)
    angle, ratio = _curve(free)
    series = [line("without contact", np.degrees(angle).tolist(), ratio.tolist(), "reference")]
    t = fig5_3.T
    pressed: tuple[tuple[str, Contact, float], ...] = (
        ("thickness of 0.5 mm", "thickness", t),
        ("gap of 0.2 mm", BEYOND, BEYOND),
    )
    for name, contact, rest in pressed:
        path = closed(contact)
        _clear(result, f"Fig. 5.3 pressed shut, {name}", path)
        turned, curved = _curve(path)
        touch = next((i for i, s in enumerate(path) if s.energy.contact > 0.0), -1)
        least = 2.0 * math.asin(0.5 * rest / fig5_3.WIDTH)
        params = {"panels": name}
        if rest == t:
            result.check(
                "dihedral angle at which panels of Fig. 5.3 rest on each other",
                turned[-1] if path.reached else math.nan,
                unit="rad",
                reference=least,
                source="2 asin(t / 2 w)",
                tolerance=0.03,  # layers rest at 1.008 t, and edges are chords
                params=params,
                path=path,
            )
        result.check(
            "deepest fold of Fig. 5.3 whose panels press, over pi/38",
            turned[-1] / DEEPEST if touch >= 0 else math.nan,
            source="measured",
            params=params,
            path=path,
        )
        result.check(
            "curvature where panels of Fig. 5.3 begin to press, over kappa_0",
            curved[touch] if touch >= 0 else math.nan,
            reference=float(np.interp(-turned[touch], -angle, ratio)),
            source="the same angle imposed, without contact",
            tolerance=CLOSE,
            params=params,
            path=path,
        )
        series.append(line(name, np.degrees(turned).tolist(), curved.tolist()))
    result.plots.append(
        plot(
            "contact-deep",
            "Curvature of Fig. 5.3 with panels that meet",
            "dihedral angle of the crease, degrees",
            "kappa / kappa_0",
            series,
            "Panels of 5 mm and t = 0.5 mm meet at pi/31: the peak at pi/38 is that of thinner sheets.",
            log="xy",
        )
    )
    _picture(
        result, context, path, "contact_deep", "The annulus of Fig. 5.3 pressed shut, its panels 0.2 mm apart"
    )


def _curve(path: Path) -> tuple[Array, Array]:
    """(k,) dihedral angles of the middle of the crease, rad, and curvatures there over the first one, of a path."""
    from bh.analysis.creases import along

    profiles = [along(state, "crease") for state in path]
    at = len(profiles[0].u) // 2
    angles = [float(state.dihedral("crease")[DEEP // 2]) for state in path]
    return np.array(angles), np.array([p.signed_curvature[at] / p.flat_curvature[at] for p in profiles])


# ------------------------------------------------------------------------------------ strips of chapter 6


def crossing(name: str, contact: Contact) -> Path:
    """One of `STRIPS`, folded and pinched.

    Args:
        name: of the strip.
        contact: of the model.
    """
    strip = replace(model(*STRIPS[name], SETTING), contact=contact)
    return bh.trace(strip, warn=False, estimate=False, neighbours=False)


def said(path: Path) -> list[str]:
    """What a path says of panels that have met.

    Args:
        path: with contact = "auto".
    """
    return [text for text in (*path.remarks, path.reason) if "panels met without contact" in text]


def strips(result: CaseResult, context: Context) -> None:
    """Strips that pass through themselves without contact do not with contact = "auto", and it is said.

    Args:
        result: to which checks are added.
        context: of the run.
    """
    for name in list(STRIPS)[:1] if context.quick else STRIPS:
        free, path = crossing(name, contact=False), crossing(name, contact="auto")
        params = {"strip": name}
        result.check(
            "strips of chapter 6 that pass through themselves without contact",
            first_contact(free) is not None,
            reference=1.0,
            source=PREDICATE,
            tolerance=0.0,
            params=params,
            path=free,
        )
        _clear(result, f"strip of chapter 6, {name}", path)
        result.check(
            "strips of chapter 6 that say that they met themselves",
            bool(said(path)),
            reference=1.0,
            source="asked for",
            tolerance=0.0,
            params=params,
        )
        last, told = path.records[-1], said(path)
        result.notes.append(
            f"A strip of chapter 6 ({name}), folded to 60 degrees and pinched, is {path.outcome} with contact = 'auto' "
            f"at lambda {last.lam:.3g} of step {last.step + 1}: {told[0] if told else 'nothing is said'}."
        )
        _picture(result, context, path, f"contact_{name.replace(' ', '_')}", f"A strip of chapter 6, {name}")


# ------------------------------------------------------------------------------------ all of them


def _clear(result: CaseResult, what: str, path: Path) -> None:
    """No state meets itself, whether or not the path reaches its end."""
    result.check(
        "states that meet themselves",
        int(first_contact(path) is not None),
        reference=0.0,
        source=PREDICATE,
        tolerance=0.0,
        params={"sheet": what, "states": len(path), "press": any(s.energy.contact > 0.0 for s in path)},
    )


def _picture(result: CaseResult, context: Context, path: Path, name: str, caption: str) -> None:
    picture(path[-1], context.folder / f"{name}.png", "stretching", (900, 560), caption=caption)
    result.pictures.append(
        {"file": f"{name}.png", "alt": caption, "caption": f"{caption}. Coloured by stretching energy."}
    )
