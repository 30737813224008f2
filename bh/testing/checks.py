"""The checks: they pass and give back what they have found, or raise an AssertionError with a table.

They need no pytest. In a test of it the plugin gives them levels and a cache, and takes what they find.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from bh.analysis.richardson import Convergence, judged
from bh.analysis.shapes import Distance, shape_distance
from bh.errors import ModelError
from bh.formulations.state import State
from bh.model.model import Model
from bh.paths.path import Path
from bh.solvers.outcome import Outcome
from bh.testing.levels import (
    L,
    Level,
    Maker,
    Solvable,
    solved_level,
    solved_levels,
    solved_path,
    told,
    wanted,
)
from bh.testing.levels import sizes as sizes_of
from bh.testing.session import running
from bh.testing.table import Asked, complaints, line, table
from meshes.quantities import number

PARTS = ("total", "stretching", "bending", "folding")


def assert_energy_converges(
    of: Model | Maker[L],
    levels: Sequence[L] | None = None,
    *,
    part: str = "total",
    order: float | None = None,
    within: float = 0.05,
    expected: float | None = None,
    frozen: float | None = None,
    frozen_within: float = 1e-3,
) -> Convergence:
    """The elastic energy of the last state converges under refinement.

    Args:
        of: a model, refined by its own cells; or a function from a level to a model, a path or a state.
        levels: three or more, coarse to fine; those of the test's marker `levels`, or (1, 2, 4), unless given. Of a
            model they say how often its cells are cut in each direction.
        part: "total", "stretching", "bending" or "folding".
        order: the least order in the size of the cells that will do; None asks for none, but one that can be trusted.
        within: the largest part of the limit that may be left unknown: else the limit is not bracketed.
        expected: the limit where it is known, N mm: the order is then that of the errors, and the finest value must lie
            `within` it.
        frozen: the limit that was found before, N mm; it may not move.
        frozen_within: by how much of itself it may move all the same.

    Returns:
        sizes, values, limit, order and verdict.

    Raises:
        AssertionError: with a table, where one of these does not hold, or a level is not reached.
        ModelError: the levels do not refine, there are fewer than three, or `part` is no part.
    """
    __tracebackhide__ = True
    if part not in PARTS:
        raise ModelError(f"energy has no part '{part}'; use one of {', '.join(PARTS)}")
    return assert_converges(
        of,
        levels,
        quantity=lambda state: state.energy.as_dict()[part],
        name=f"{part} energy",
        unit="N mm",
        order=order,
        within=within,
        expected=expected,
        frozen=frozen,
        frozen_within=frozen_within,
    )


def assert_converges(  # noqa: PLR0913 - as above
    of: Model | Maker[L],
    levels: Sequence[L] | None = None,
    *,
    quantity: Callable[[State], float],
    name: str = "quantity",
    unit: str = "",
    order: float | None = None,
    within: float = 0.05,
    expected: float | None = None,
    frozen: float | None = None,
    frozen_within: float = 1e-3,
) -> Convergence:
    """A number that is read from the last state converges under refinement.

    Args:
        of: as for `assert_energy_converges`, like all that is not named here.
        levels: three or more, coarse to fine.
        quantity: reads the number from a state.
        name: of it, for the table.
        unit: of it.
        order: least order.
        within: largest unknown part of the limit.
        expected: the limit where it is known.
        frozen: the limit that was found before.
        frozen_within: by how much of itself it may move.

    Returns:
        sizes, values, limit, order and verdict.

    Raises:
        AssertionError: as `assert_energy_converges`.
        ModelError: as `assert_energy_converges`.
    """
    __tracebackhide__ = True
    asked = Asked(name, unit, order, within, expected, frozen, frozen_within)
    found = solved_levels(of, wanted(levels))
    values = [_number(quantity(each.state), name) for each in found]
    return _held(asked, values, sizes_of(found), found)


def _number(value: object, name: str) -> float:
    __tracebackhide__ = True
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.item()
    if not isinstance(value, int | float | np.number):
        shape = f" of shape {value.shape}" if isinstance(value, np.ndarray) else ""
        raise ModelError(
            f"{name} is a {type(value).__name__}{shape} and no number; let the function return one"
        )
    return float(value)


def assert_values_converge(  # noqa: PLR0913 - as above
    values: Sequence[float],
    sizes: Sequence[float],
    *,
    name: str = "value",
    unit: str = "",
    order: float | None = None,
    within: float = 0.05,
    expected: float | None = None,
    frozen: float | None = None,
    frozen_within: float = 1e-3,
) -> Convergence:
    """Numbers that are there already, of cells that get smaller, converge.

    Args:
        values: three or more, coarse to fine.
        sizes: of the cells, falling; only their ratios matter.
        name: of the values, for the table.
        unit: of the values.
        order: as for `assert_energy_converges`, like the rest.
        within: largest unknown part of the limit.
        expected: the limit where it is known.
        frozen: the limit that was found before.
        frozen_within: by how much of itself it may move.

    Returns:
        sizes, values, limit, order and verdict.

    Raises:
        AssertionError: with a table, where something that is asked for does not hold.
        ModelError: fewer than three values, or sizes that do not fall.
    """
    __tracebackhide__ = True
    return _held(Asked(name, unit, order, within, expected, frozen, frozen_within), values, sizes, [])


def _held(
    asked: Asked, values: Sequence[float], sizes: Sequence[float], levels: Sequence[Level]
) -> Convergence:
    __tracebackhide__ = True
    if not all(math.isfinite(value) for value in values):
        raise AssertionError(f"{asked.name}: values {list(values)} are not finite")
    try:
        found = judged(values, sizes, asked.expected)
    except ValueError as error:
        raise ModelError(f"{asked.name}: {error}") from error
    wrong = complaints(found, asked)
    _tell(
        asked.name,
        line(found, asked),
        not wrong,
        value=found.limit.value,
        unit=asked.unit,
        reference=asked.expected if asked.expected is not None else asked.frozen,
        tolerance=asked.within if asked.frozen is None else asked.frozen_within,
        params={
            "order": found.limit.rate if math.isfinite(found.limit.rate) else None,
            "error_bar": found.limit.bar,
            "verdict": str(found.verdict),
            "sizes": list(found.sizes),
            "values": list(found.values),
        },
        unknowns=levels[-1].unknowns if levels else None,
        iterations=sum(each.iterations for each in levels) if levels else None,
        wall_time_s=sum(each.wall_time_s for each in levels) if levels else None,
    )
    if wrong:
        raise AssertionError("\n".join([f"{asked.name}: {'; '.join(wrong)}", table(found, asked, levels)]))
    return found


def assert_reached(of: Solvable) -> Path | State:
    """Every step of a model or a path is reached; a model is solved first.

    Args:
        of: a model, a path, or a state, which was reached as it is there.

    Returns:
        the path, or the state.

    Raises:
        AssertionError: says which step ended early, how and why.
    """
    __tracebackhide__ = True
    if isinstance(of, State):
        return of
    path = solved_path(of)
    end = "" if path.reached else told(path)
    _tell("outcome", end or "reached", path.reached, outcome=path.outcome, value=None)
    assert path.reached, end
    return path


def assert_stable(of: Solvable) -> State:
    """The last state is stable; of a model or path, its end is reached, too.

    Args:
        of: a model, a path or a state.

    Returns:
        the state.

    Raises:
        AssertionError: it is not stable, or that is not known.
    """
    __tracebackhide__ = True
    if isinstance(of, State):
        state, stable = of, of.stable
    else:
        path = solved_path(of)
        assert path.reached, told(path)
        state, stable = path[-1], path.stable
    why = {
        True: "stable",
        False: "not stable: the sheet would leave this state",
        None: "not known to be stable",
    }
    _tell("stability", why[stable], stable is True, value=None)
    assert stable, f"{why[stable]} ({state!r})"
    return state


def assert_same_shape(
    one: Solvable, two: Solvable, within: float | str, *, in_place: bool = False
) -> Distance:
    """Two folded sheets have the same shape, whatever their meshes and formulations.

    Args:
        one: a model (solved first), a path (its last state) or a state.
        two: another of the same flat sheet.
        within: the largest distance of a point of the sheet in one from the same point in the other, mm,
            or with a unit.
        in_place: compare where they are; else the second is moved rigidly onto the first before.

    Returns:
        the largest and the root mean square distance, and where the largest is.

    Raises:
        AssertionError: they lie farther apart, or one was not reached.
        ModelError: they are not of the same flat sheet.
    """
    __tracebackhide__ = True
    asked = number(within, "length")
    found = shape_distance(solved_level(one).state, solved_level(two).state, in_place=in_place)
    text = (
        f"largest distance {found.largest:.4g} mm at ({found.at[0]:.4g}, {found.at[1]:.4g}) of the flat sheet"
    )
    text += f", rms {found.rms:.4g} mm"
    same = found.largest <= asked
    _tell("distance of shapes", text, same, value=found.largest, unit="mm", reference=0.0, tolerance=asked)
    assert same, f"shapes differ: {text}; {asked:g} mm asked"
    return found


def _tell(quantity: str, text: str, passed: bool, **figures: object) -> None:
    """An entry for the summary, with the keys of the records of `bh verify`."""
    test = running()
    if test is None:
        return
    value, reference = figures.get("value"), figures.get("reference")
    error = None
    if isinstance(value, int | float) and isinstance(reference, int | float):
        error = abs(value - reference) / abs(reference) if reference else abs(value)
    record = {
        "case": test.name,
        "quantity": quantity,
        "params": figures.get("params", {}),
        "value": value,
        "unit": figures.get("unit", ""),
        "reference": reference,
        "source": None,
        "tolerance": figures.get("tolerance"),
        "unknowns": figures.get("unknowns"),
        "iterations": figures.get("iterations"),
        "wall_time_s": figures.get("wall_time_s"),
        "outcome": str(figures.get("outcome", Outcome.REACHED)),
        "error": error,
        "passed": passed,
    }
    test.tell({"record": record, "line": f"{quantity}: {text}"})
