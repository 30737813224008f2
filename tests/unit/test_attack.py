"""The case `attack`: its judges can see, and docs/reliability.md has the counts of its record."""

from __future__ import annotations

import json
import re
import signal
import sys
import time
from pathlib import Path
from threading import Barrier

import numpy as np
import pytest

from verification.framework.checks import CaseResult, Context
from verification.studies.solver import attack
from verification.studies.solver.attack import page
from verification.studies.solver.attack.attempts import Found, Kind
from verification.studies.solver.attack.kills import _judged
from verification.studies.solver.attack.programs import OURS, Ended, play

ROOT = Path(__file__).resolve().parents[2]
linux = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")
LEAVES_A_CHILD = (
    "import subprocess, sys; subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(60)'])"
)


def test_the_page_has_the_counts_of_the_record() -> None:
    record = json.loads((ROOT / "verification" / "records" / "attack.json").read_text(encoding="utf-8"))
    result = CaseResult("attack", "", "", "")
    for check in record["checks"]:
        result.check(check["quantity"], check["value"], params=check["params"])
    text = (ROOT / "docs" / "reliability.md").read_text(encoding="utf-8")
    assert page.table(result.checks) in text


@linux
def test_a_process_that_is_left_behind_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("verification.studies.solver.attack.programs.GONE_S", 0.3)
    ended = play((sys.executable, "-c", LEAVES_A_CHILD), tmp_path)
    assert (ended.code, ended.left) == (0, 1)
    assert play((sys.executable, "-c", "raise SystemExit('why')"), tmp_path).said == "why\n"


@linux
def test_signals_reach_the_program(tmp_path: Path) -> None:
    words = (sys.executable, "-c", "import time; time.sleep(60)")
    assert play(words, tmp_path, send=signal.SIGKILL, after_s=0.2).code == -signal.SIGKILL
    heeding = play(words, tmp_path, send=signal.SIGINT, after_s=1.0)
    assert "KeyboardInterrupt" in heeding.said
    assert heeding.heeds
    deaf = play(("sleep", "60"), tmp_path, send=signal.SIGINT, after_s=0.2)
    assert (deaf.code, deaf.heeds, deaf.before) == (-signal.SIGINT, False, True)


def test_a_signal_before_the_program_is_told_apart() -> None:
    """It is none where the program had begun, or where nothing shows that it had not."""

    def before(code: int, said: str, heeds: bool = True) -> bool:
        return Ended(code, said, 0.1, 0.1, 50.0, 0, heeds=heeds).before

    site = 'Traceback\n  File "<frozen site>", line 616, in <module>\n'
    start = f'  File "{OURS[0]}", line 0, in <module>\n'
    assert before(-2, "", heeds=False)
    assert before(1, f"Fatal Python error: init_import_site\n{site}KeyboardInterrupt\n")
    assert before(-2, f"{site}{start}KeyboardInterrupt\n")
    assert not before(-2, "")
    assert not before(130, "bh: interrupted\n", heeds=False)
    for place in (f'{OURS[0]}", line 9, in main', f'{OURS[1]}__init__.py", line 1, in <module>'):
        assert not before(-2, f'{site}{start}  File "{place}\nKeyboardInterrupt\n')


def test_ends_are_judged() -> None:
    good = Ended(130, "bh: interrupted\n", 0.2, 0.1, 50.0, 0)
    assert not _judged(good, signal.SIGINT)
    assert not _judged(Ended(-9, "", 0.0, 0.1, 50.0, 0), signal.SIGKILL)
    assert len(_judged(Ended(-2, "Traceback\n  more\n", 3.0, 0.1, 50.0, 1), signal.SIGINT)) == 4
    assert not _judged(Ended(130, "bh: interrupted\n", 3.0, 0.1, 50.0, 0, crowd=4.0), signal.SIGINT)


@linux
def test_attempts_are_kept_and_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that was interrupted goes on, and what did not hold is told."""
    played: list[int] = []

    def one(folder: Path, random: np.random.Generator) -> Found:
        assert folder.is_dir()
        played.append(int(random.integers(1000)))
        if len(played) == 2:
            raise KeyboardInterrupt
        return Found(5, ["it broke"] if len(played) == 1 else [], 0.5)

    monkeypatch.setattr(attack, "KINDS", (Kind("a kind", "a promise", one, 3, 3, "s"),))
    context = Context(tmp_path, True, lambda _text: None)
    with pytest.raises(KeyboardInterrupt):
        attack.run(context)
    result = attack.run(context)
    assert len(played) == 4  # the second twice
    assert played[1] == played[2]
    [check] = result.checks
    assert (check.value, check.passed, check.params["attacks"], check.params["worst"]) == (
        1.0,
        False,
        15,
        0.5,
    )
    assert result.notes == ["a kind: it broke"]
    linked = (tmp_path / "reliability.md").read_text()
    figures = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", linked)
    assert "| a kind | a promise | 15 | 1 | 0.5 s |" in figures
    assert linked.count('attack.json "a kind \\| read ') == 3


@linux
def test_attempts_are_played_beside_each_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two at once, each kept under its own number; a kind that does not say so is played one by one."""
    together, playing = Barrier(2, timeout=10.0), []

    def beside(folder: Path, random: np.random.Generator) -> Found:
        del folder
        together.wait()
        return Found(int(random.integers(1000)))

    def alone(folder: Path, random: np.random.Generator) -> Found:
        del folder, random
        playing.append(1)
        assert len(playing) == 1
        time.sleep(0.05)
        playing.pop()
        return Found(1)

    kinds = (Kind("beside", "", beside, 4, 4, at_once=True), Kind("alone", "", alone, 3, 3))
    monkeypatch.setattr(attack, "KINDS", kinds)
    monkeypatch.setattr(attack, "_count", lambda _result, _kind, found: counts.extend(f.tried for f in found))
    counts: list[int] = []
    attack.run(Context(tmp_path, True, lambda _text: None))
    drawn = [int(np.random.default_rng([attack.SEED, 0, number]).integers(1000)) for number in range(4)]
    assert counts == [*drawn, 1, 1, 1]
