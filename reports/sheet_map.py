"""The map on the front page: for every kind of sheet and every model errors with their bars, and the time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from reports.records import Case, Check

CASE, ERROR, NO_FIGURES = "map", ": median relative error", "sheets without figures"
NOTHING = "sheets without this quantity"


@dataclass
class Row:
    """A kind of sheet by one model.

    Attributes:
        kind, model: by name.
        cells: record by quantity, numbered as in the file.
        why: why sheets of it have no figures; empty where all have them.
        without: how many have none.
    """

    kind: str
    model: str
    cells: dict[str, tuple[int, Check]] = field(default_factory=dict)
    why: str = ""
    without: int = 0

    @property
    def time_s(self) -> float | None:
        """Median processor time of a trace, s."""
        return next((check.wall_time_s for _, check in self.cells.values()), None)


@dataclass(frozen=True)
class SheetMap:
    """All rows, a kind after the other, and the quantities that are columns.

    Attributes:
        case: of the records.
        quantities: columns.
        kinds: rows by kind.
        empty: why cells are empty by intent: quantity, reason and the kinds that it holds for.
    """

    case: Case
    quantities: list[str]
    kinds: dict[str, list[Row]]
    empty: list[tuple[str, str, list[str]]] = field(default_factory=list)


def sheet_map(cases: Iterable[Case]) -> SheetMap | None:
    """The map, if the case has been run."""
    case = next((case for case in cases if case.name == CASE), None)
    if case is None:
        return None
    kinds: dict[str, dict[str, Row]] = {}
    quantities: dict[str, None] = {}
    empty: dict[tuple[str, str], dict[str, None]] = {}
    for number, check in case.checks:
        kind, model = str(check.params.get("kind", "")), str(check.params.get("model", ""))
        if not model:
            continue  # a judgement of a kind, in the chapter
        if check.quantity == NOTHING:
            reason = str(check.params.get("quantity", "")), str(check.params.get("why", ""))
            empty.setdefault(reason, {})[kind] = None
            continue
        row = kinds.setdefault(kind, {}).setdefault(model, Row(kind, model))
        if check.quantity == NO_FIGURES:
            row.why, row.without = str(check.params.get("why", "")), int(check.value or 0)
        elif check.quantity.endswith(ERROR):
            quantity = check.quantity.removesuffix(ERROR)
            quantities[quantity] = None
            row.cells[quantity] = (number, check)
    return SheetMap(
        case,
        list(quantities),
        {kind: list(rows.values()) for kind, rows in kinds.items()},
        [(quantity, why, list(names)) for (quantity, why), names in empty.items()],
    )
