"""Two writers, full disks, homes that cannot be written, threads and processes."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

import bh
from verification.studies.solver.attack.attempts import Found
from verification.studies.solver.attack.inputs import SCENE, write
from verification.studies.solver.attack.kills import RUN, digest, path_bits, undisturbed
from verification.studies.solver.attack.programs import BH, play

FOUR = 4


def states(_: int = 0) -> str:
    """Checksum of a path that is solved here and now."""
    import meshes

    mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.7), along=8, rows=1)
    model = bh.Model(mesh, bh.Sheet(E=4000.0, t=0.127), formulation="bars-and-hinges", contact=False).fold(
        "crease", by=0.5
    )
    return digest(*(np.ascontiguousarray(r.q).tobytes() for r in bh.trace(model).records))


def threads_and_processes(folder: Path, random: np.random.Generator) -> Found:
    """Four threads, four forked and four spawned processes at once: the bits of one alone."""
    del folder, random
    alone, failures = states(), []
    with ThreadPoolExecutor(FOUR) as pool:
        if set(pool.map(states, range(FOUR))) != {alone}:
            failures.append("threads: other bits")
    for way in ("fork", "spawn"):
        with ProcessPoolExecutor(FOUR, get_context(way)) as workers:
            if set(workers.map(states, range(FOUR))) != {alone}:
                failures.append(f"{way}: other bits")
    return Found(3 * FOUR, failures)


def two_writers(folder: Path, random: np.random.Generator) -> Found:
    """Two runs that go on in one folder at once: one of them, or both in turn, never both together."""
    del random
    write(folder)
    alone, _ = undisturbed(RUN)
    words = [*BH, *RUN.first]
    both = [
        subprocess.Popen(words, cwd=folder, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        for _ in range(2)
    ]
    ends = [(program.communicate()[1], program.returncode) for program in both]
    failures = [f"exit code {code}: {said.strip()}" for said, code in ends if code not in (0, 2)]
    failures += [
        f"says {said.strip()!r}" for said, code in ends if code == 2 and "another process" not in said
    ]
    if all(code != 0 for _, code in ends):
        failures.append("nobody came to an end")
    if path_bits(folder) != alone:
        failures.append("other states than of one writer")
    return Found(2, failures)


def no_home(folder: Path, random: np.random.Generator) -> Found:
    """A home that cannot be written: the command says nothing of it."""
    del random
    write(folder)
    env = {"HOME": "/proc/nowhere", "XDG_CACHE_HOME": "/proc/nowhere", "XDG_CONFIG_HOME": "/proc/nowhere"}
    failures = []
    for words in (RUN.first, ("check", "scene.toml", "--no-picture")):
        ended = play((*BH, *words), folder, env=env)
        if ended.code != 0 or ended.said:
            failures.append(f"bh {words[0]}: exit code {ended.code}: {ended.said.strip()[:200]}")
    return Found(2, failures)


def two_first_imports(folder: Path, random: np.random.Generator) -> Found:
    """Two runs at once that both have to compile every kernel into one empty cache."""
    del random
    write(folder)
    env = {"NUMBA_CACHE_DIR": str(folder / "cache")}
    with ThreadPoolExecutor(2) as pool:
        ends = list(
            pool.map(
                lambda n: play((*BH, *RUN.first[:3], f"out{n}", "-q", "--no-estimate"), folder, env=env), "ab"
            )
        )
    failures = [f"exit code {e.code}: {e.said.strip()[:200]}" for e in ends if e.code != 0]
    if not failures:
        (folder / "outa").rename(folder / "out")
        one = path_bits(folder)
        (folder / "out").rename(folder / "outa")
        (folder / "outb").rename(folder / "out")
        if path_bits(folder) != one:
            failures.append("other bits")
    return Found(2, failures)


# on a disk of its own, in a namespace of its own: fill it, run into it, look, make room, go on
FULL = """
import json, os, subprocess, sys
place, size, bh = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}k", "tmpfs", place], check=True)
os.chdir(place)
for name, text in json.loads(sys.argv[4]).items():
    open(name, "w").write(text)
run = ["run", "scene.toml", "-o", "out", "-q", "--no-estimate"]
full = subprocess.run([*bh, *run], capture_output=True, text=True)
kept = sorted(os.listdir("out")) if os.path.isdir("out") else []
if "result.json" in kept:
    json.load(open("out/result.json"))
subprocess.run(["mount", "-o", "remount,size=64m", place], check=True)
more = ["--resume"] if "path.bh" in kept else []
after = subprocess.run([*bh, *run, *more], capture_output=True, text=True)
subprocess.run(["cp", "-r", "out", sys.argv[5]], check=True)
print(json.dumps([full.returncode, full.stderr, kept, after.returncode, after.stderr]))
"""


def full_disk(folder: Path, random: np.random.Generator) -> Found:
    """A run onto a disk of few kilobytes: one line; with more room it goes on to the same bits."""
    unshare = shutil.which("unshare")
    if unshare is None or subprocess.run([unshare, "-rm", "true"], capture_output=True).returncode != 0:
        return Found(0, skipped="no namespaces here, so no disk of one's own can be filled")
    alone, _ = undisturbed(RUN)
    (folder / "disk").mkdir()
    size = str(int(random.integers(4, 120)))
    words = [unshare, "-rm", sys.executable, "-c", FULL, str(folder / "disk"), size, json.dumps(BH)]
    words += [json.dumps({"scene.toml": SCENE}), str(folder / "out")]
    done = subprocess.run(words, capture_output=True, text=True, cwd=folder)
    if done.returncode != 0:
        return Found(1, [f"{size} kB: {done.stderr.strip()[-300:]}"])
    code, said, kept, code_after, said_after = json.loads(done.stdout.splitlines()[-1])
    failures = []
    if code not in (0, 2) or (code == 2 and len(said.splitlines()) != 1):
        failures.append(f"{size} kB, {kept}: exit code {code}: {said.strip()[-300:]}")
    if code_after != 0:
        failures.append(f"{size} kB, then room: exit code {code_after}: {said_after.strip()[-300:]}")
    elif path_bits(folder) != alone:
        failures.append(f"{size} kB, then room: other bits")
    return Found(1, failures)
