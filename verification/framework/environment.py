"""What numbers and pictures depend on: versions of the libraries, and the commit."""

from __future__ import annotations

import shutil
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from bh.paths.provenance import versions

PROJECT = Path(__file__).resolve().parents[2]


def environment() -> dict[str, str]:
    """Versions of what numbers and pictures depend on, and the commit if this is a working copy."""
    found = dict(versions())
    for name in ("pyvista", "vtk", "matplotlib"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    commit = _commit()
    return {**found, "git commit": commit} if commit else found


def _commit() -> str:
    """The commit of the working copy, or an empty string where there is none to be told."""
    git = shutil.which("git")
    if git is None or not (PROJECT / ".git").exists():
        return ""

    def ask(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [git, *words], cwd=PROJECT, capture_output=True, text=True, timeout=10, check=False
        )

    try:
        head = ask("rev-parse", "--short=12", "HEAD")
        if head.returncode != 0:
            return ""
        changed = ask("diff", "--quiet", "HEAD").returncode == 1
    except (OSError, ValueError, subprocess.SubprocessError):
        return ""
    return head.stdout.strip() + (" with changes" if changed else "")
