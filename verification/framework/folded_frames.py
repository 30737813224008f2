"""Folded sheets by several formulations, stored frame by frame beside the results: what the report lets one turn."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from bh import Model, Path, trace
from bh.plotting.interactive import frames
from bh.plotting.pictures import picture
from bh.solvers.outcome import Outcome
from meshes.cells import Kind
from verification.framework.checks import CaseResult, Context, Cost
from verification.framework.run import write_json

# rows of cells a side and mesh pattern that suit each
MESHES: dict[str, tuple[int, Kind]] = {
    "bars-and-hinges": (1, "staggered"),
    "consistent": (4, "mirrored"),
    "shell": (2, "mirrored"),
}
FRAMES = 8  # steps that a folding is told in
NAMES = {"bars-and-hinges": "bars and hinges", "consistent": "consistent", "shell": "shell"}
Fold = Callable[[Model, float], Model]


def in_frames(model: Model, fold: Fold, count: int = FRAMES) -> Path:
    """The path of a model folded in `count` equal steps; `fold` adds the step to a fraction of the whole."""
    for number in range(1, count + 1):
        model = fold(model, number / count)
    return trace(model)


def by_every_formulation(
    result: CaseResult,
    context: Context,
    name: str,
    model: Callable[[str, int, Kind], Model],
    fold: Fold,
    params: dict[str, Any],
    tolerance: float,
) -> dict[str, Path]:
    """A sheet folded in frames by every formulation, and compared with the shell.

    Args:
        result: where the energies go.
        context: of the case.
        name: of the sheet, for the progress.
        model: the model by the name of a formulation, rows a side and mesh pattern.
        fold: the model folded by a share of the whole fold.
        params: of every check.
        tolerance: relative, on the total energy of the consistent formulation; bars and hinges are reported only.

    Returns:
        the paths by formulation.
    """
    paths: dict[str, Path] = {}
    for formulation, (rows, kind) in MESHES.items():
        context.tell(f"{result.name}: {name}, {formulation}")
        paths[formulation] = in_frames(model(formulation, rows, kind), fold)
    for formulation in ("bars-and-hinges", "consistent"):
        judged = tolerance if formulation == "consistent" else None
        compare(result, {**params, "formulation": formulation}, paths[formulation], paths["shell"], judged)
    return paths


def compare(
    result: CaseResult, params: dict[str, Any], path: Path, shell: Path, tolerance: float | None
) -> None:
    """Energies at the end of a path against the shell's; the total is judged where there is a tolerance."""
    took = Cost.of(path, outcome=path.outcome if not path.reached else shell.outcome)
    energy, reference = path[-1].energy.as_dict(), shell[-1].energy.as_dict()
    for kind, value in energy.items():
        if value or reference[kind]:
            judged = tolerance if kind == "total" else None
            result.check(
                f"{kind} energy, folded",
                value,
                unit="N mm",
                reference=reference[kind],
                source="the shell on the same sheet",
                tolerance=judged,
                params=params,
                path=took,
            )


def step_ends(path: Path) -> list[Any]:
    """The state that the path begins with and the one at the end of every step that was reached."""
    last = {record.step: index for index, record in enumerate(path.records)}
    return [
        path[0],
        *(path[last[step]] for step in range(len(path.steps)) if path.steps[step].outcome == Outcome.REACHED),
    ]


def store(
    result: CaseResult,
    context: Context,
    name: str,
    paths: Mapping[str, Path],
    title: str,
    caption: str,
    alt: str,
    fractions: Sequence[float] | None = None,
) -> None:
    """Write the frames of the paths (by formulation) and a picture of the first one, and tell the result of them.

    Frames end where the first path ended early; there is nothing to show where none got beyond its start.
    """
    states = {NAMES.get(key, key): step_ends(path) for key, path in paths.items()}
    count = min(len(found) for found in states.values())
    if count < 2:
        return
    lambdas = (fractions or [number / (count - 1) for number in range(count)])[:count]
    data = frames({key: found[:count] for key, found in states.items()}, lambdas)
    write_json(context.folder / f"{name}.frames.json", data)
    still = f"{name}.png"
    picture(next(iter(states.values()))[count - 1], context.folder / still, size=(1000, 560), caption=caption)
    result.scenes.append(
        {"file": f"{name}.frames.json", "still": still, "title": title, "alt": alt, "caption": caption}
    )
