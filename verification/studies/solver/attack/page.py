"""The table of docs/reliability.md, from the records of the case."""

from __future__ import annotations

from collections.abc import Sequence

from verification.framework.checks import Check


def table(checks: Sequence[Check]) -> str:
    """A table in Markdown: attack, promise, how often, how often it did not hold, and the worst figure."""
    rows = [
        "| Attack | What has to hold | Attacks | Did not hold | Worst |",
        "|---|---|---|---|---|",
    ]
    for check in checks:
        of = check.params
        worst = f"{of['worst']:g} {of['unit']}" if "worst" in of else of.get("skipped", "")
        count = f"{of['attacks']}" + (
            f", and {of['before']} before Python began the program" if "before" in of else ""
        )
        rows.append(f"| {check.quantity} | {of['promise']} | {count} | {check.value:.0f} | {worst} |")
    return "\n".join(rows) + "\n"
