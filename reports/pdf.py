"""The report as one PDF file, printed by a browser of the machine."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from meshes.errors import FileFormatError
from meshes.io.export import replacing
from reports.build import one_page
from reports.figures import ReportError

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge")
SECONDS = 300


def browser() -> str | None:
    """The first browser of the machine that can print to a file without a window, or None."""
    return next((found for name in BROWSERS if (found := shutil.which(name))), None)


def print_report(results_folder: Path, out_file: Path) -> Path:
    """Write all of the report, front page and chapters, as one PDF file.

    Returns:
        the absolute path of the file.

    Raises:
        ReportError: results that are missing or not valid, no browser, or one that does not print.
    """
    program = browser()
    if program is None:
        raise ReportError(f"a PDF needs a browser; install one of {', '.join(BROWSERS[:3])}")
    page = one_page(results_folder)
    try:
        with tempfile.TemporaryDirectory() as scratch, replacing(out_file) as temporary:
            html, pdf = Path(scratch) / "report.html", Path(scratch) / "report.pdf"
            html.write_text(page, encoding="utf-8", newline="\n")
            # root may start it only without its sandbox; the page has no scripts
            alone = ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []
            done = subprocess.run(
                [
                    program,
                    "--headless",
                    *alone,
                    "--disable-gpu",
                    f"--user-data-dir={scratch}/profile",
                    "--no-pdf-header-footer",
                    f"--print-to-pdf={pdf}",
                    html.as_uri(),
                ],
                capture_output=True,
                text=True,
                timeout=SECONDS,
                check=False,
            )
            if not pdf.is_file():
                messages = done.stderr.strip().splitlines()
                raise ReportError(
                    f"'{program}' did not print the report ({messages[-1] if messages else 'no reason given'})"
                )
            shutil.copyfile(pdf, temporary)
    except subprocess.TimeoutExpired as error:
        raise ReportError(f"'{program}' did not print the report in {SECONDS} s") from error
    except FileFormatError as error:
        raise ReportError(str(error)) from error
    return Path(out_file).resolve()
