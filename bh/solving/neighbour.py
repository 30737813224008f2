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
    if any(law.law is not None and law.law.remembers for law in model.creases.values()):
        return None
    path, newton = Path(model), LoadControl().newton
    ends = {record.step: index for index, record in enumerate(before.records)}
    with one_blas_thread():
        for step in range(len(model.steps)):
            old, record = before.solved(ends[step])
            system = path.system(step)
            if len(record.q) != system.size or record.lam != 1.0:
                return None
            found = newton.solve(system, record.q, 1.0, old.evaluate(record.q, 1.0).forces)
            lost = found.stable is False and record.stable is not False
            if not found.converged or lost or system.objection(record.q, 1.0, found.q, 1.0):
                return None
            path.records.append(
                Record(
                    step,
                    1.0,
                    found.q,
                    found.iterations,
                    found.evaluation.imbalance,
                    0.0,
                    record.next_increment,
                    negative=found.negative,
                    note="from a neighbouring model",
                )
            )
            path.steps.append(StepOutcome(Outcome.REACHED))
    return path
