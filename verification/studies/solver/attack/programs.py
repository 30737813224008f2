"""Programs that are started to be ended: `bh` in a session of its own, what it said, and whom it left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import bh

ROOT = Path(bh.__file__).parents[1]
BH = (sys.executable, str(ROOT / "bh_command.py"))  # as the script `bh` begins, installed or not
OURS = tuple(
    str(ROOT / name) for name in ("bh_command.py", "bh/", "fem/", "meshes/", "verification/", "reports/")
)
PATIENCE_S = 900.0  # then a program that nobody ends is killed, and its attempt lost
GONE_S = 5.0  # within which workers have to be gone


@dataclass(frozen=True)
class Ended:
    """How a program ended.

    Attributes:
        code: its exit code; -9 where it was killed.
        said: its stderr.
        after_s: time from the signal, or from the start without one, to its end, s.
        cpu_s: processor time of it and of the children that it waited for, s.
        megabytes: the most memory that it held.
        left: processes of its session that were still there `GONE_S` later.
        crowd: processes that shared a core then (mean of a minute), 1 or more.
        heeds: whether the program had a handler of SIGINT right before the signal; Python itself sets one on its way
            to the first line of any program.
    """

    code: int
    said: str
    after_s: float
    cpu_s: float
    megabytes: float
    left: int
    crowd: float = 1.0
    heeds: bool = True

    @property
    def before(self) -> bool:
        """Whether SIGINT came before the first line of the program could run; no program can change what happens then.

        Either Python had not set its own handler yet, and the signal ended it without a word; or it says where it was,
        and no place in this project's functions is among them.
        """
        if self.code == -signal.SIGINT and not self.said:
            return not self.heeds
        places = [line for line in self.said.splitlines() if any(place in line for place in OURS)]
        begun = [line for line in places if not line.endswith(" in <module>") or OURS[0] not in line]
        return self.code != 130 and "KeyboardInterrupt" in self.said and not begun

    @property
    def lines(self) -> int:
        """Lines of stderr."""
        return len(self.said.splitlines())


def members(session: int) -> list[int]:
    """Processes of a session that have not ended."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                state, _, _, of = (entry / "stat").read_text().rsplit(")", 1)[1].split()[:4]
            except OSError:
                continue
            if int(of) == session and state != "Z":
                found.append(int(entry.name))
    return found


def play(
    words: Sequence[str],
    folder: Path,
    *,
    send: signal.Signals | None = None,
    after_s: float = 0.0,
    env: Mapping[str, str] | None = None,
) -> Ended:
    """Run a program to its end, or to a signal.

    Args:
        words: of its command line.
        folder: that it runs in.
        send: SIGINT goes to its whole group, as the terminal sends it, others to the program alone; None waits.
        after_s: when, from its start, s.
        env: variables beside those of this process.
    """
    with tempfile.TemporaryFile("w+") as said:
        began = time.monotonic()
        program = subprocess.Popen(
            words,
            cwd=folder,
            env={**os.environ, "OMP_NUM_THREADS": "1", **(env or {})},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=said,
            start_new_session=True,
            preexec_fn=_heeding,
        )
        done = _wait(program.pid, PATIENCE_S if send is None else after_s)
        heeds = True
        if done is None:
            heeds = _heeds_interrupts(program.pid)
            began = time.monotonic()
            if send is signal.SIGINT:
                os.killpg(program.pid, send)
            else:
                os.kill(program.pid, signal.SIGKILL if send is None else send)
            done = _wait(program.pid, PATIENCE_S)
        took = time.monotonic() - began
        left = _left(program.pid)
        said.seek(0)
        text = said.read()
    status, usage = done if done is not None else (signal.SIGKILL, None)
    program.returncode = os.waitstatus_to_exitcode(status)
    cpu = usage.ru_utime + usage.ru_stime if usage else 0.0
    memory = usage.ru_maxrss / 1024.0 if usage else 0.0
    crowd = max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))
    return Ended(program.returncode, text, took, cpu, memory, left, crowd, heeds)


def _heeding() -> None:
    """Interrupts count in the program, also where this process runs in the background of a shell."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _heeds_interrupts(pid: int) -> bool:
    """Whether a process has a handler of SIGINT now."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines()
    except OSError:
        return True
    caught = next(line.split()[1] for line in lines if line.startswith("SigCgt:"))
    return bool(int(caught, 16) >> (signal.SIGINT - 1) & 1)


def _wait(pid: int, seconds: float) -> tuple[int, os.struct_rusage] | None:  # type: ignore[name-defined]
    """Status and resources of a child, or None where it has not ended by then."""
    end = time.monotonic() + seconds
    while True:
        found, status, usage = os.wait4(pid, os.WNOHANG)
        if found:
            return status, usage
        if time.monotonic() >= end:
            return None
        time.sleep(0.005)


def _left(session: int) -> int:
    """Processes of an ended program's session that outlive it by `GONE_S`; they are ended here."""
    end = time.monotonic() + GONE_S
    while members(session) and time.monotonic() < end:
        time.sleep(0.05)
    left = members(session)
    for process in left:
        os.kill(process, signal.SIGKILL)
    return len(left)
