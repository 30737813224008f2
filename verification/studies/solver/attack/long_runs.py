"""Hundreds of traces in one process: memory and handles stay as they are."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

from verification.studies.solver.attack.attempts import Found
from verification.studies.solver.attack.programs import PATIENCE_S, play

MOST_MB = 10.0
WARM = 30  # traces before memory is looked at: caches fill
TRACES = 300
PROGRAM = """
import gc, json, os, sys
import bh, meshes
def held():
    gc.collect()
    pages = int(open("/proc/self/statm").read().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20, len(os.listdir("/proc/self/fd"))
def solve(number):
    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.7 + 0.001 * (number % 7)), along=8, rows=1)
    name = ("bars-and-hinges", "consistent")[number % 2]
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127), formulation=name).fold("crease", by=0.5)
    path = bh.trace(model, file="path.bh")
    assert path.reached and path[-1].energy.total > 0.0
warm, count = int(sys.argv[1]), int(sys.argv[2])
for number in range(warm):
    solve(number)
before = held()
for number in range(count):
    solve(number)
json.dump([*before, *held()], open("held.json", "w"))
"""


def traces(folder: Path, random: np.random.Generator, count: int = TRACES) -> Found:
    """Traces of two formulations, each into a path file."""
    del random
    ended = play((sys.executable, "-c", PROGRAM, str(WARM), str(count)), folder)
    if ended.code != 0:
        return Found(count, [f"exit code {ended.code} within {PATIENCE_S:g} s: {ended.said.strip()[-300:]}"])
    memory, handles, memory_after, handles_after = json.loads(
        (folder / "held.json").read_text(encoding="utf-8")
    )
    failures = []
    if memory_after - memory > MOST_MB:
        failures.append(f"memory grew from {memory:.1f} to {memory_after:.1f} MB")
    if handles_after > handles:
        failures.append(f"open files grew from {handles} to {handles_after}")
    return Found(count, failures, memory_after - memory)


def few_traces(folder: Path, random: np.random.Generator) -> Found:
    """Thirty of them."""
    return traces(folder, random, 30)
