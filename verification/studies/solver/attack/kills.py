"""Random kills and interrupts of run, sweep, verify and report: what is finished is kept, the end has the same bits."""

from __future__ import annotations

import hashlib
import json
import shutil
import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import bh
import bh.sweep
from verification.studies.solver.attack.attempts import Found
from verification.studies.solver.attack.inputs import write
from verification.studies.solver.attack.programs import BH, Ended, play

CHAIN = 10  # signals that hit, then the program may end
SOON_S = 1.0  # within which an interrupted program has ended
MOST_S = 25.0  # of a program's time in which it is killed
CASES = ("shear_calibration", "strips")


def digest(*parts: bytes) -> str:
    """A few digits of a checksum."""
    found = hashlib.sha256()
    for part in parts:
        found.update(part)
    return found.hexdigest()[:16]


def path_bits(folder: Path) -> str:
    """Checksum of all states of the path of a run."""
    path = bh.Path.load(folder / "out" / "path.bh")
    parts = (f"{r.step} {r.lam.hex()}".encode() + np.ascontiguousarray(r.q).tobytes() for r in path.records)
    return digest(path.outcome.encode(), *parts)


def sweep_bits(folder: Path) -> str:
    """Checksum of all values of a data set that do not tell of the run."""
    data = bh.sweep.load(folder / "sweep.nc").drop_vars(list(bh.sweep.ABOUT_RUN))
    return digest(*(f"{name}".encode() + data[name].values.tobytes() for name in data.variables))


def case_bits(file: Path) -> dict[str, str]:
    """Checksum of the figures of every case that is stored.

    Raises:
        ValueError: the file is no whole JSON.
    """
    stored = json.loads(file.read_text(encoding="utf-8"))
    names = {info["name"] for info in stored["cases"]}
    figures = {
        name: json.dumps(
            [[c["quantity"], c["params"], c["value"]] for c in stored["checks"] if c["case"] == name]
        )
        for name in names
    }
    return {name: digest(text.encode()) for name, text in figures.items()}


def _read_run(folder: Path) -> None:
    result, path = folder / "out" / "result.json", folder / "out" / "path.bh"
    if result.exists():
        json.loads(result.read_text(encoding="utf-8"))
    if path.exists():
        bh.Path.load(path)


def _read_sweep(folder: Path) -> None:
    if (folder / "sweep.nc").exists():
        bh.sweep.load(folder / "sweep.nc")


@dataclass(frozen=True)
class Target:
    """A program that goes on where it was.

    Attributes:
        words: of its command line from the second start on.
        first: of the first.
        bits: checksum of what it has made at its end.
        read: reads what it has left half-way; raises where that is not whole.
        holds: what is there as soon as it can go on.
    """

    first: Sequence[str]
    words: Sequence[str]
    bits: Callable[[Path], str]
    read: Callable[[Path], None]
    holds: str


RUN = Target(
    ("run", "scene.toml", "-o", "out", "-q", "--no-estimate"),
    ("run", "scene.toml", "-o", "out", "-q", "--no-estimate", "--resume"),
    path_bits,
    _read_run,
    "out/path.bh",
)
SWEEP = Target(
    ("sweep", "sweep.toml", "-o", "sweep.nc", "-q", "-w", "2"),
    ("sweep", "sweep.toml", "-o", "sweep.nc", "-q", "-w", "2", "--resume"),
    sweep_bits,
    _read_sweep,
    "sweep.nc.points",
)


@cache
def _reference(target: Target) -> tuple[str, float]:
    """Bits and time, s, of a run that nobody disturbs."""
    with TemporaryDirectory() as place:
        folder = Path(place)
        write(folder)
        began = time.monotonic()
        done = play((*BH, *target.first), folder)
        if done.code != 0:
            raise RuntimeError(f"bh {' '.join(target.first)} ended with {done.code}: {done.said}")
        return target.bits(folder), time.monotonic() - began


def _disturbed(target: Target, send: signal.Signals, folder: Path, random: np.random.Generator) -> Found:
    """A chain of signals at random moments, each to a program that goes on; where one was done, it begins anew."""
    bits, seconds = _reference(target)
    failures: list[str] = []
    worst, tried, before = 0.0, 0, 0
    write(folder)
    for _ in range(4 * CHAIN):
        words = target.words if (folder / target.holds).exists() else target.first
        ended = play((*BH, *words), folder, send=send, after_s=random.uniform(0.0, min(seconds, MOST_S)))
        if ended.before:
            before += 1
        elif ended.code == 0:  # it was done before the signal, or all but
            failures += _other(target, folder, bits)
            _empty(folder)
            write(folder)
        else:
            tried += 1
            failures += _judged(ended, send)
            worst = max(worst, ended.after_s)
        failures += _broken(target, folder)
        if tried == CHAIN:
            break
    words = target.words if (folder / target.holds).exists() else target.first
    ended = play((*BH, *words), folder)
    if ended.code != 0:
        failures.append(f"went on to exit code {ended.code}: {ended.said.strip()}")
    else:
        failures += _other(target, folder, bits)
    return Found(tried, failures, worst, before=before)


def _empty(folder: Path) -> None:
    for place in folder.iterdir():
        shutil.rmtree(place) if place.is_dir() else place.unlink()


def _other(target: Target, folder: Path, bits: str) -> list[str]:
    return [] if target.bits(folder) == bits else ["other bits than without the signals"]


def _broken(target: Target, folder: Path) -> list[str]:
    try:
        target.read(folder)
    except (ValueError, OSError, bh.InputError) as error:
        return [f"half-written: {error}"]
    return []


def _judged(ended: Ended, send: signal.Signals) -> list[str]:
    """What did not hold of the end itself."""
    failures = []
    if ended.left:
        failures.append(f"{ended.left} processes were left behind")
    if send is signal.SIGINT:
        if ended.code != 130:
            failures.append(f"exit code {ended.code} in place of 130: {ended.said.strip()[-200:]}")
        if ended.lines != 1 and "Traceback" in ended.said:
            failures.append("a traceback")
        if ended.after_s > SOON_S * ended.crowd:
            failures.append(f"ended {ended.after_s:.1f} s after Ctrl-C, {ended.crowd:.1f} processes a core")
    return failures


def killed_run(folder: Path, random: np.random.Generator) -> Found:
    """Kills of `bh run`."""
    return _disturbed(RUN, signal.SIGKILL, folder, random)


def interrupted_run(folder: Path, random: np.random.Generator) -> Found:
    """Ctrl-C in `bh run`."""
    return _disturbed(RUN, signal.SIGINT, folder, random)


def killed_sweep(folder: Path, random: np.random.Generator) -> Found:
    """Kills of `bh sweep` with two workers."""
    return _disturbed(SWEEP, signal.SIGKILL, folder, random)


def interrupted_sweep(folder: Path, random: np.random.Generator) -> Found:
    """Ctrl-C in `bh sweep` with two workers."""
    return _disturbed(SWEEP, signal.SIGINT, folder, random)


# ------------------------------------------------------------------------------------------ verify, report


@cache
def _figures() -> dict[str, str]:
    """Bits of the cases that `verify` is killed in, undisturbed."""
    with TemporaryDirectory() as place:
        done = play((*BH, "verify", *CASES, "--quick", "--results", "results"), Path(place))
        if done.code != 0:
            raise RuntimeError(f"bh verify ended with {done.code}: {done.said}")
        return case_bits(Path(place) / "results" / "checks.json")


@cache
def _cases_s() -> float:
    """Time, s, in which verify and report are disturbed: until workers, which start as long, have ended a case."""
    with TemporaryDirectory() as place:
        began = time.monotonic()
        play((*BH, "verify", CASES[0], "--quick", "--results", "results"), Path(place))
        return 2.0 * (time.monotonic() - began)


def _cases(words: Sequence[str], send: signal.Signals, folder: Path, random: np.random.Generator) -> Found:
    """A chain of signals; finished cases are stored, whole, and have the same figures."""
    bits = _figures()
    failures: list[str] = []
    worst, tried, early = 0.0, 0, 0
    file = folder / "results" / "checks.json"
    for _ in range(4 * CHAIN):
        if tried == CHAIN:
            break
        before = case_bits(file) if file.exists() else {}
        ended = play((*BH, *words), folder, send=send, after_s=random.uniform(0.0, _cases_s()))
        if ended.before:
            early += 1
            continue
        if ended.code in (0, 1):  # it was done before the signal
            continue
        tried += 1
        failures += _judged(ended, send)
        worst = max(worst, ended.after_s)
        try:
            stored = case_bits(file) if file.exists() else {}
        except ValueError as error:
            failures.append(f"half-written: {error}")
            continue
        told = [line.split(":")[0] for line in ended.said.splitlines() if " checks passed, " in line]
        # the last may be told of and not yet stored
        failures += [f"{name} was finished and is lost" for name in {*before, *told[:-1]} - set(stored)]
        failures += [f"{n} has other figures" for n in stored if n in bits and stored[n] != bits[n]]
    return Found(tried, failures, worst, before=early)


VERIFY = ("verify", *CASES, "--quick", "--jobs", "2", "--results", "results")
REPORT = ("report", "--quick", "--jobs", "2", "--results", "results")


def killed_verify(folder: Path, random: np.random.Generator) -> Found:
    """Kills of `bh verify` with two workers."""
    return _cases(VERIFY, signal.SIGKILL, folder, random)


def interrupted_verify(folder: Path, random: np.random.Generator) -> Found:
    """Ctrl-C in `bh verify` with two workers."""
    return _cases(VERIFY, signal.SIGINT, folder, random)


def killed_report(folder: Path, random: np.random.Generator) -> Found:
    """Kills of `bh report` while cases are run."""
    return _cases(REPORT, signal.SIGKILL, folder, random)


def interrupted_report(folder: Path, random: np.random.Generator) -> Found:
    """Ctrl-C in `bh report` while cases are run."""
    return _cases(REPORT, signal.SIGINT, folder, random)
