"""The first solve works where neither the installation nor the home can be written.

Permissions do not bind root, so folders are made impossible to write: a file stands where they would have to be.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from bh.runtime import kernel_cache

ROOT = Path(__file__).resolve().parents[2]
SOLVE = """
import os, numba
from bh.solvers.matrices import band_ldl
import numpy as np
ab = np.array([[2.0, -3.0]])
print(band_ldl(ab), os.environ.get("NUMBA_CACHE_DIR", "unset"))
"""


@pytest.fixture
def installation(tmp_path: Path) -> Path:
    """A copy of `bh` in which no compiled kernel can be kept."""
    target = tmp_path / "site"
    shutil.copytree(ROOT / "bh", target / "bh", ignore=shutil.ignore_patterns("__pycache__"))
    for folder in (target / "bh", *(p for p in (target / "bh").rglob("*") if p.is_dir())):
        (folder / "__pycache__").write_text("not a folder")
    return target


def run(installation: Path, **environment: str) -> list[str]:
    keep = {
        key: value for key, value in os.environ.items() if key not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")
    }
    done = subprocess.run(
        [sys.executable, "-c", SOLVE],
        capture_output=True,
        text=True,
        env={**keep, "PYTHONPATH": str(installation), "PYTHONDONTWRITEBYTECODE": "1", **environment},
        cwd=installation,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_read_only_installation_and_home(installation: Path, tmp_path: Path) -> None:
    """Kernels go to a private temporary folder, which the next run uses again."""
    nowhere = tmp_path / "file"
    nowhere.write_text("")
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    places = {"HOME": str(nowhere / "home"), "TMPDIR": str(temporary)}
    for given in ({}, {"NUMBA_CACHE_DIR": str(nowhere / "cache")}):
        negative, folder = run(installation, **places, **given)
        assert negative == "1"
        assert Path(folder).parent == temporary
        assert any(Path(folder).rglob("*.nbi"))
        assert Path(folder).stat().st_mode & 0o777 == 0o700
    assert len(list(temporary.glob(f"{kernel_cache.NAME}-*"))) == 1


def test_a_folder_of_someone_else_is_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Anyone could have put compiled code into a folder that others can write to."""
    monkeypatch.setattr(tempfile, "gettempdir", lambda: str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    first = kernel_cache._temporary()
    assert kernel_cache._temporary() == first
    first.chmod(0o777)
    assert kernel_cache._temporary() != first


def test_home_is_preferred(installation: Path, tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.mkdir()
    assert Path(run(installation, HOME=str(home))[1]).is_relative_to(home)


def test_what_the_user_chose_is_kept(installation: Path, tmp_path: Path) -> None:
    chosen = tmp_path / "chosen"
    assert run(installation, NUMBA_CACHE_DIR=str(chosen)) == ["1", str(chosen)]
    assert any(chosen.rglob("*.nbi"))


def test_an_ordinary_installation_is_left_alone() -> None:
    done = subprocess.run(
        [sys.executable, "-c", "import bh, os; print(os.environ.get('NUMBA_CACHE_DIR', 'unset'))"],
        capture_output=True,
        text=True,
        env={key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"},
        cwd=ROOT,
        check=True,
    )
    assert done.stdout.strip() == "unset"
