"""One sheet by every formulation: energies, shapes, fold angles, stiffness and time, beside each other."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.analysis.shapes import Distance, shape_distance
from bh.analysis.stiffness_probe import Probe
from bh.errors import InputError, ModelError
from bh.formulations.registry import names
from bh.loading.builder import load_steps
from bh.model.model import Model
from bh.model.refinement import Goal
from bh.paths.path import Path
from bh.runtime.progress import ProgressMeter, meter, stage
from bh.solving.trace import trace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bh.loading.symmetry import Plane

Array = NDArray[np.float64]
JUDGES = (
    "shell",
    "linear-shell",
    "consistent",
)  # whose answer the others are compared with: the first that is there


@dataclass(frozen=True)
class Stiff:
    """The stiffness that is asked for.

    Attributes:
        at: a place.
        direction: of the force on it; three numbers.
    """

    at: str
    direction: tuple[float, float, float]


@dataclass(frozen=True)
class Member:
    """One formulation's answer.

    Attributes:
        formulation: its name.
        outcome: of the path; "refused" where the model could not be solved as described.
        reason: why it did not reach its end; empty where it did.
        path: solved, or None where it was refused.
        distance: of its shape from the reference's; None of the reference, and where one of them did not reach its end.
        stiffness: N/mm, nan where none was asked for or is there.
        wall_time_s: of the solve, with what goes around it.
    """

    formulation: str
    outcome: str
    reason: str = ""
    path: Path | None = None
    distance: Distance | None = None
    stiffness: float = math.nan
    wall_time_s: float = math.nan

    @property
    def reached(self) -> bool:
        """Is there a last state to compare?"""
        return self.path is not None and self.path.reached


@dataclass(frozen=True)
class Comparison:
    """All answers on one mesh.

    Attributes:
        members: in the order asked for.
        reference: name of the formulation that the others are compared with; None where none reached its end.
        mesh: its cells in words.
    """

    members: tuple[Member, ...]
    reference: str | None
    mesh: str

    def of(self, name: str) -> Member:
        """The member of that name."""
        return next(member for member in self.members if member.formulation == name)

    def as_dict(self) -> dict[str, object]:
        """Plain data for JSON: energies N mm, angles rad, distances mm, stiffness N/mm, times s.

        Returns:
            plain data; what is not there is None.
        """
        return {
            "reference": self.reference,
            "mesh": self.mesh,
            "formulations": [_plain(m) for m in self.members],
        }


def compare(
    model: Model,
    *,
    formulations: Sequence[str] = (),
    accuracy: Goal | None = None,
    symmetry: Plane | None = None,
    stiffness: Stiff | None = None,
    progress: bool | ProgressMeter = False,
) -> Comparison:
    """Solve a model by several formulations on one mesh.

    Args:
        model: the sheet; its own formulation does not matter.
        formulations: names; all that are registered unless given.
        accuracy: where the scene has no mesh: the mesh is then the one that is chosen for it.
        symmetry: plane of that choice; the comparison is of the whole sheet.
        stiffness: to compare, too.
        progress: as for `bh.trace`.

    Raises:
        ModelError: a formulation is not known, or one stands twice; or a stiffness is asked of a sheet that nothing
            holds.
    """
    known = names()
    asked = list(formulations) or known
    for name in asked:
        if name not in known and ":" not in name:
            raise ModelError(f"formulation '{name}' is not known; use one of {', '.join(known)}")
    if len(set(asked)) < len(asked):
        raise ModelError(f"formulations {', '.join(asked)}: each can be compared once")
    if stiffness is not None and load_steps(model)[-1].constraints.rigid_body:
        raise ModelError(
            f"nothing holds the sheet, so that it yields to any force at {stiffness.at}; hold it somewhere, as it lies "
            'in a step of its own: hold = "edge:start"'
        )
    report = meter(progress)
    if accuracy is not None:
        stage(report, "choosing a mesh")
        chosen = trace(model, accuracy=accuracy, symmetry=symmetry, progress=report, warn=False)
        model = replace(model, mesh=chosen.model.mesh)
    members = [_solved(model, name, stiffness, report) for name in asked]
    reached = [member.formulation for member in members if member.reached]
    reference = next((name for name in (*JUDGES, *reached) if name in reached), None)
    members = [_measured(member, members, reference) for member in members]
    cells = model.mesh.cells
    words = f"{len(model.mesh.triangles)} triangles" + ("" if cells is None else f" ({cells})")
    return Comparison(tuple(members), reference, words)


def _solved(model: Model, name: str, stiffness: Stiff | None, report: ProgressMeter) -> Member:
    stage(report, name)
    began = time.perf_counter()
    try:
        path = trace(replace(model, formulation=name), progress=report, warn=False)
    except InputError as error:
        return Member(name, "refused", str(error), wall_time_s=time.perf_counter() - began)
    spent = time.perf_counter() - began
    stiff = math.nan
    if path.reached and stiffness is not None:
        stiff = float(Probe(path).at(stiffness.at).loaded(np.asarray(stiffness.direction)))
    return Member(name, str(path.outcome), path.reason, path, None, stiff, spent)


def _measured(member: Member, members: Sequence[Member], reference: str | None) -> Member:
    judge = next((each for each in members if each.formulation == reference), None)
    if judge is None or judge is member or not member.reached:
        return member
    assert member.path is not None
    assert judge.path is not None
    return replace(member, distance=shape_distance(member.path[-1], judge.path[-1]))


def _plain(member: Member) -> dict[str, object]:
    """A member as plain data."""
    out: dict[str, object] = {
        "formulation": member.formulation,
        "outcome": member.outcome,
        "reason": member.reason or None,
        "wall_time_s": member.wall_time_s,
    }
    if not member.reached or member.path is None:
        return out
    state, far = member.path[-1], member.distance
    angles = {crease: state.fold_angle(crease) for crease in state.mesh.drawn_creases}
    return out | {
        "stable": member.path.stable,
        "energy": state.energy.as_dict(),
        "fold_angle": {crease: float(a.mean()) for crease, a in angles.items() if len(a)},
        "largest_distance": None if far is None else far.largest,
        "rms_distance": None if far is None else far.rms,
        "stiffness": member.stiffness if math.isfinite(member.stiffness) else None,
        "unknowns": member.path.unknowns,
        "iterations": member.path.iterations,
    }


def lines(found: Comparison) -> list[str]:
    """The comparison as lines of a table, the reference marked.

    Args:
        found: to be shown.

    Returns:
        heads, rows, and why formulations are missing.
    """
    with_stiffness = any(math.isfinite(member.stiffness) for member in found.members)
    heads = [
        "formulation",
        "stretching",
        "bending",
        "folding",
        "total / N mm",
        "off",
        "largest / mm",
        "fold / deg",
    ]
    heads += [*(["stiffness / (N/mm)"] if with_stiffness else []), "unknowns", "time / s"]
    judge = None if found.reference is None else found.of(found.reference).path
    rows = [heads]
    notes = []
    for member in found.members:
        if not member.reached or member.path is None:
            notes.append(f"{member.formulation}: {member.outcome} ({member.reason})")
            continue
        state = member.path[-1]
        energy = state.energy
        total = math.nan if judge is None else judge[-1].energy.total
        off = "reference" if member.formulation == found.reference else _percent(energy.total, total)
        far = "" if member.distance is None else f"{member.distance.largest:.4g}"
        folds = [
            math.degrees(float(a.mean()))
            for c in state.mesh.drawn_creases[:3]
            if len(a := state.fold_angle(c))
        ]
        row = [member.formulation, *(f"{e:.5g}" for e in (energy.stretching, energy.bending, energy.folding))]
        row += [f"{energy.total:.5g}", off, far, " ".join(f"{angle:.1f}" for angle in folds)]
        row += [f"{member.stiffness:.4g}"] if with_stiffness else []
        rows.append([*row, str(member.path.unknowns), f"{member.wall_time_s:.2f}"])
        if member.path.stable is False:
            notes.append(f"{member.formulation}: the last state is not stable")
    widths = [max(len(row[k]) for row in rows) for k in range(len(heads))]
    return [
        f"on {found.mesh}",
        *("  ".join(text.rjust(width) for text, width in zip(row, widths, strict=True)) for row in rows),
        *notes,
    ]


def _percent(value: float, reference: float) -> str:
    return f"{100.0 * (value / reference - 1.0):+.2f} %" if reference else ""


def picture(found: Comparison) -> Figure:
    """Energies by kind, and for every formulation but the reference its distance from it over the flat sheet.

    Args:
        found: to be drawn.

    Raises:
        ModelError: fewer than two formulations reached their end.
    """
    from matplotlib.figure import Figure

    drawn = [member for member in found.members if member.path is not None and member.reached]
    others = [member for member in drawn if member.distance is not None]
    if not others:
        raise ModelError("fewer than two formulations reached their end, so there is no difference to draw")
    figure = Figure(figsize=(4.0 * (1 + len(others)), 4.0), dpi=110, layout="constrained")
    axes = figure.subplots(1, 1 + len(others))
    bottom = np.zeros(len(drawn))
    for kind, colour in (("bending", "#0072b2"), ("stretching", "#d55e00"), ("folding", "#009e73")):
        heights = np.array([m.path[-1].energy.as_dict()[kind] for m in drawn if m.path is not None])
        axes[0].bar([m.formulation for m in drawn], heights, bottom=bottom, color=colour, label=kind)
        bottom += heights
    axes[0].set_ylabel("energy, N mm")
    axes[0].tick_params(axis="x", rotation=20)
    axes[0].legend(frameon=False, fontsize="small")
    for place, member in zip(axes[1:], others, strict=True):
        far = member.distance
        assert far is not None
        x, y = far.mesh.points[:, :2].T
        shown = place.tripcolor(x, y, far.mesh.triangles, far.distances, shading="gouraud", cmap="viridis")
        figure.colorbar(shown, ax=place, label="mm", shrink=0.8)
        place.set(
            title=f"{member.formulation} from {found.reference}",
            aspect="equal",
            xlabel="x, mm",
            ylabel="y, mm",
        )
    return figure
