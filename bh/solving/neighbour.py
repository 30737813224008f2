"""The ends of all steps of a model next to one that is solved, by Newton's method from the states of that one."""

from __future__ import annotations

from bh.model.model import Model
from bh.paths.path import Path
from bh.paths.record import Record, StepOutcome
from bh.runtime.threads import one_blas_thread
from bh.solvers.load_control import LoadControl
from bh.solvers.outcome import Outcome


def neighbour(before: Path, model: Model) -> Path | None:
    """The path of a model, of which there is the end of every step alone, begun at those of another path.

    It costs an iteration or two a step. Elastic sheets do not depend on the way, so that an end that is found next to
    one that is known is that of the whole path; creases that yield do.

    Args:
        before: a path of a model on the same mesh with the same steps, of which all were reached whole.
        model: with other values.

    Returns:
        the path, or None where it cannot be had this way: a crease yields, a step ends early, or no state is found near
        that is stable as the known one is.
    """
    if not before.reached or len(before.model.steps) != len(model.steps):
        return None
    if any(step.until is not None for step in model.steps):
        return None
    if model.remembers:
        return None
    path = Path(model)
    ends = {record.step: index for index, record in enumerate(before.records)}
    for step in range(len(model.steps)):
        known = before.records[ends[step]]
        if known.lam != 1.0:
            return None
        found = end_beside(path, step, before, ends[step], "from a neighbouring model")
        if found is None or (found.stable is False and known.stable is not False):
            return None
        path.records.append(found)
        path.steps.append(StepOutcome(Outcome.REACHED))
    return path


def end_beside(path: Path, step: int, before: Path, index: int, note: str) -> Record | None:
    """The end of a step by Newton's method from a state of another path; None where there is none without a jump.

    Args:
        path: of which it is to be the next state.
        step: number of the step.
        before: a path of a model on the same mesh.
        index: of its state at the end of that step.
        note: for the record.
    """
    old, known = before.solved(index)
    system = path.system(step)
    if len(known.q) != system.size:
        return None
    with one_blas_thread():
        forces = old.evaluate(known.q, 1.0).forces
        found = LoadControl().newton.solve(system, known.q, 1.0, forces)
    if not found.converged or system.objection(known.q, 1.0, found.q, 1.0):
        return None
    return Record(
        step,
        1.0,
        found.q,
        found.iterations,
        found.evaluation.imbalance,
        0.0,
        known.next_increment,
        negative=found.negative,
        note=note,
    )
