"""The table of docs/reliability.md, from the records of the case."""

from __future__ import annotations

from collections.abc import Sequence

from verification.framework.checks import Check

RECORD = "../verification/records/attack.json"  # from the page


def table(checks: Sequence[Check]) -> str:
    """A table in Markdown: attack, promise, how often, how often it did not hold, and the worst figure.

    Every figure is a link to the record that it is of (`verification.framework.printed`).
    """
    rows = [
        "| Attack | What has to hold | Attacks | Did not hold | Worst |",
        "|---|---|---|---|---|",
    ]
    for check in checks:
        of, name = check.params, check.quantity
        worst = of.get("skipped", "")
        if "worst" in of:
            worst = _link(f"{of['worst']:g} {of['unit']}", name, "params.worst")
        count = _link(f"{of['attacks']}", name, "params.attacks")
        if "before" in of:
            before = _link(f"{of['before']}", name, "params.before")
            count = f"{count}, and {before} before Python began the program"
        failed = _link(f"{check.value:.0f}", name, "value")
        rows.append(f"| {name} | {of['promise']} | {count} | {failed} | {worst} |")
    return "\n".join(rows) + "\n"


def _link(words: str, quantity: str, read: str) -> str:
    """A figure of a record; the bar of its title is written as cells of tables need it."""
    return f'[{words}]({RECORD} "{quantity} \\| read {read}")'
