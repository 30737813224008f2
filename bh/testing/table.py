"""What a check of convergence asks for, what is wrong with what was found, and the table that shows it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bh.analysis.richardson import Convergence, Verdict
from bh.errors import ModelError
from bh.testing.levels import Level


@dataclass(frozen=True)
class Asked:
    """What is asked of values on finer and finer meshes; see `bh.testing.assert_energy_converges`."""

    name: str
    unit: str
    order: float | None
    within: float
    expected: float | None
    frozen: float | None
    frozen_within: float

    def __post_init__(self) -> None:
        """Refuse what nothing could be held against.

        Raises:
            ModelError: one line that names the option.
        """
        for key, value, positive in (
            ("order", self.order, True),
            ("within", self.within, True),
            ("expected", self.expected, False),
            ("frozen", self.frozen, False),
            ("frozen_within", self.frozen_within, True),
        ):
            if value is None:
                continue
            numeric = isinstance(value, int | float | np.number) and math.isfinite(value)
            if not numeric or (positive and value <= 0.0):
                raise ModelError(f"{key} = {value!r} cannot be; give a {'positive ' * positive}number")
        if self.within >= 1.0 and self.expected != 0.0:  # a limit of 0 is met to within a value of its unit
            raise ModelError(
                f"within = {self.within:g} holds for all values; it is a part of them: 0.05 is 5 %"
            )


def complaints(found: Convergence, asked: Asked) -> list[str]:
    """What does not hold, one line each; empty where all does.

    Args:
        found: of the values.
        asked: of them.

    Returns:
        lines without the name of the quantity.
    """
    wrong = [found.reason] if found.reason else []
    rate, unit = found.limit.rate, f" {asked.unit}" if asked.unit else ""
    if asked.order is not None and math.isfinite(rate) and rate < asked.order:
        wrong.append(f"converges at order {rate:.2f}, {asked.order:g} asked")
    if asked.expected is not None:
        size = abs(asked.expected) or 1.0  # absolute where nothing is expected
    else:
        size = abs(found.limit.value)
    bar = found.limit.bar / size if size > 0.0 else (0.0 if found.limit.bar == 0.0 else math.inf)
    if bar > asked.within and asked.expected is not None:
        wrong.append(
            f"the finest value {found.values[-1]:.6g} is {100 * bar:.3g} % off the expected "
            f"{asked.expected:.6g}{unit}, {100 * asked.within:.3g} % asked"
        )
    elif bar > asked.within:
        wrong.append(
            f"the limit is not bracketed: {found.limit.value:.6g} +- {found.limit.bar:.2g}{unit} "
            f"({100 * bar:.3g} %), {100 * asked.within:.3g} % asked; add a level"
        )
    if asked.frozen is not None:
        moved = abs(found.limit.value - asked.frozen)
        if moved > asked.frozen_within * abs(asked.frozen):
            part = 100 * moved / abs(asked.frozen) if asked.frozen else math.inf
            wrong.append(
                f"the frozen reference moved: {asked.frozen:.8g}{unit} before, {found.limit.value:.8g} now "
                f"({part:.3g} %, {100 * asked.frozen_within:.3g} % allowed)"
            )
    return wrong


def line(found: Convergence, asked: Asked) -> str:
    """One line for the summary: "0.05370 +- 0.00002 N mm, order 2.0 of 3 levels".

    Args:
        found: of the values.
        asked: of them.
    """
    limit = found.limit
    unit = f" {asked.unit}" if asked.unit else ""
    order = f"order {limit.rate:.2f}" if math.isfinite(limit.rate) else found.reason or str(found.verdict)
    return f"{limit.value:.6g} +- {limit.bar:.2g}{unit}, {order}, {len(found.values)} levels"


def table(found: Convergence, asked: Asked, levels: Sequence[Level]) -> str:
    """The levels in rows: what was solved, its value, how it changed and the order that is seen there.

    Args:
        found: of the values.
        asked: of them.
        levels: that were solved; empty where only values were given.
    """
    known = asked.expected is not None
    heads = ["level", "triangles"] if levels else ["size"]
    heads += [
        f"{asked.name}{f' / {asked.unit}' if asked.unit else ''}",
        "error" if known else "change",
        "order",
        "time / s",
    ]
    heads = heads if levels else heads[:-1]
    rows = []
    behind = len(found.values) - len(found.orders)
    for k, value in enumerate(found.values):
        off = value - asked.expected if asked.expected is not None else value - found.values[k - 1]
        row = [str(levels[k].level), str(levels[k].triangles)] if levels else [f"{found.sizes[k]:.4g}"]
        row += [f"{value:.8g}", "" if k == 0 and not known else f"{off:+.3g}"]
        seen = found.orders[k - behind] if k >= behind else math.nan
        row.append(f"{seen:.2f}" if math.isfinite(seen) else "")
        if levels:
            row.append("cached" if levels[k].cached else f"{levels[k].wall_time_s:.2f}")
        rows.append(row)
    widths = [max(len(row[k]) for row in [heads, *rows]) for k in range(len(heads))]
    lines = [
        "  " + "  ".join(text.rjust(width) for text, width in zip(row, widths, strict=True))
        for row in [heads, *rows]
    ]
    if found.verdict in (Verdict.CONVERGES, Verdict.EXACT) and not known:
        lines.append(f"  limit {line(found, asked)}")
    return "\n".join(lines)
