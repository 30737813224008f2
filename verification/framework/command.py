"""The `bh verify` command."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bh.runtime.terminal import say
from bh.solvers.outcome import Outcome


def verify(
    cases: Annotated[
        list[str] | None, typer.Argument(help="cases to run; all but long ones if none is named")
    ] = None,
    json: Annotated[Path | None, typer.Option("--json", help="write the records to this file")] = None,
    results: Annotated[Path, typer.Option("--results", help="folder for records and pictures")] = Path(
        "results"
    ),
    quick: Annotated[bool, typer.Option("--quick", help="fewer points in every case")] = False,
    jobs: Annotated[int, typer.Option("--jobs", "-j", min=1, help="cases that are run at a time")] = 1,
    listing: Annotated[bool, typer.Option("--list", help="list the cases and stop")] = False,
) -> None:
    """Check the solvers against theory and published numbers.

    A study of several parts, such as App. B (appendix_b), is run whole when its first part is named.
    What is found replaces what the results folder has of the cases that are run; the other cases stay. Exit code 1 if
    a check fails.
    """
    from verification.framework.cases import CASES, LONG_CASES, with_parts
    from verification.framework.run import run, write_json

    if listing:
        for name in CASES:
            say(name)
        for name in LONG_CASES:
            say(f"{name}: takes minutes, runs only when named")
        return
    data = run(with_parts(cases) if cases else None, results, quick, lambda text: say(text, err=True), jobs)
    if json is not None:
        write_json(json, {"checks": data["checks"], "versions": data["versions"]})
    failed = [check for check in data["checks"] if check["passed"] is False]
    for check in failed:
        say(
            f"failed: {check['case']} {check['quantity']} {check['params']} = "
            f"{check['value'] if check['outcome'] == Outcome.REACHED else check['outcome']}",
            err=True,
        )
    judged = sum(check["passed"] is not None for check in data["checks"])
    say(f"{judged - len(failed)} of {judged} checks passed, {len(data['checks']) - judged} reported")
    if failed:
        raise typer.Exit(1)
