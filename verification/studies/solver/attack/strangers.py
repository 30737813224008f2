"""Files that name code: without consent nothing of it is imported or called."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np

from verification.studies.solver.attack.attempts import Found
from verification.studies.solver.attack.inputs import SCENE
from verification.studies.solver.attack.programs import BH, Ended, play

MARK = "it-ran"
PATTERN = 'kind = "annulus_sector"\nradius = 100.0\nwidth = 10.0\nangle = 0.7'
FOLD = 'fold = { crease = "crease", by = 0.3 }'
SCENES = {
    "support": f'{SCENE}[[supports]]\nkind = "os:system"\ncommand = "touch {MARK}"\n',
    "pattern": SCENE.replace(
        PATTERN, f"kind = \"timeit:timeit\"\nstmt = \"open('{MARK}', 'w')\"\nnumber = 1"
    ),
    "step": SCENE.replace(FOLD, f'"os:system" = {{ command = "touch {MARK}" }}'),
    "until": SCENE + 'until = { observable = "trap:value", value = 1.0 }\n',
    "formulation": SCENE.replace('"bars-and-hinges"', '"trap:Shell"'),
}


def proofs(folder: Path, random: np.random.Generator) -> Found:
    """Five entries of a scene, by two commands each, and a stored path, by three."""
    del random
    (folder / "trap.py").write_text(f"open({str(folder / MARK)!r}, 'w').close()\n", encoding="utf-8")
    failures, tried = [], 0
    for name, text in SCENES.items():
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
        for words in (("check", f"{name}.toml", "--no-picture"), ("run", f"{name}.toml", "-q", "-o", "out")):
            tried += 1
            failures += _refused(_play(words, folder), folder, f"{name}, {words[0]}")
    (folder / "scene.toml").write_text(SCENE, encoding="utf-8")
    _play(("run", "scene.toml", "-q", "-o", "run", "--no-estimate"), folder)
    _poison(folder / "run" / "path.bh")
    stored: tuple[tuple[str, ...], ...] = (
        ("view", "run", "--picture", "a.png"),
        ("run", "scene.toml", "-q", "-o", "run", "--resume"),
        ("export", "run", "a.obj"),
    )
    for again in stored:
        tried += 1
        failures += _refused(_play(again, folder), folder, f"stored path, {again[0]}")
    return Found(tried, failures)


def _play(words: tuple[str, ...], folder: Path) -> Ended:
    return play((*BH, *words), folder, env={"PYTHONPATH": str(folder), "BH_ALLOW_PLUGINS": ""})


def _refused(ended: Ended, folder: Path, what: str) -> list[str]:
    failures = []
    if (folder / MARK).exists():
        (folder / MARK).unlink()
        failures.append(f"{what}: the code was run")
    if ended.code != 2 or ended.lines != 1 or "--allow-plugins" not in ended.said:
        failures.append(f"{what}: exit code {ended.code}: {ended.said.strip()[:200]}")
    return failures


def _poison(file: Path) -> None:
    """Name a formulation of the stranger's own in a stored path."""
    with closing(sqlite3.connect(file)) as base, base:
        for key, value in list(base.execute("select key, value from meta")):
            if isinstance(value, str) and '"bars-and-hinges"' in value:
                text = value.replace('"bars-and-hinges"', '"trap:Shell"')
                base.execute("update meta set value = ? where key = ?", (text, key))
