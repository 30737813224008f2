"""The `bh report` command."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from bh.runtime.terminal import say

MOST_JOBS = 4  # cases at a time unless told otherwise; each takes half a gigabyte


def report(
    quick: Annotated[bool, typer.Option("--quick", help="fewer points in every case")] = False,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="page to write [default: RESULTS/report.html]")
    ] = None,
    results: Annotated[Path, typer.Option("--results", help="folder for records and pictures")] = Path(
        "results"
    ),
    reuse: Annotated[
        bool, typer.Option("--reuse", help="show the results that are there, run nothing")
    ] = False,
    jobs: Annotated[
        int, typer.Option("--jobs", "-j", min=0, help="cases that are run at a time 0: one a core, up to 4")
    ] = 0,
    pdf: Annotated[
        bool, typer.Option("--pdf", help="print all of it to a PDF file beside the page; needs a browser")
    ] = False,
) -> None:
    """Run the verification cases and write the report page.

    It is the front page of a site: the chapters lie in a folder beside it. They need no network and no server.
    """
    from reports.build import build
    from reports.records import read, shortfall
    from reports.verdicts import told

    page = results / "report.html" if out is None else out
    if not reuse:
        from verification.framework.run import run

        at_once = jobs or min(os.cpu_count() or 1, MOST_JOBS)
        run(None, results, quick, lambda text: say(text, err=True), at_once)
    written = build(results, page)
    printed = None
    if pdf:
        from reports.pdf import print_report

        printed = print_report(results, page.with_suffix(".pdf"))
    found = read(results / "checks.json")
    judged = [check.passed for check in found.checks if check.passed is not None]
    less = shortfall(found)
    say(
        f"{sum(judged)} of {len(judged)} checks passed, {len(found.checks) - len(judged)} reported"
        + (f" ({less})" if less else "")
    )
    say(f"claims of the source: {told(found.checks)}")
    say(f"report: {written}")
    if printed is not None:
        say(f"PDF: {printed}")
    say(written.as_uri())
