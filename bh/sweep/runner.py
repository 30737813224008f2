"""The loop of a sweep: hands points to workers, writes each finished one at once, tries again where a worker died."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from dataclasses import dataclass, field, replace
from typing import Protocol

from bh.solvers.outcome import Outcome
from bh.sweep.points import SweepError, Value
from bh.sweep.pools import Pool
from bh.sweep.task import Finished, Task, work

QUIET_S = 20.0  # how long a scheduler may be out of reach before the sweep ends
AHEAD = 2  # tasks handed out for each that can run, so that no worker waits for the next


class Meter(Protocol):
    """Told about every finished task: points done of all, how many of them failed, done in this run, its seconds."""

    def update(self, done: int, total: int, failed: int, now: int, seconds: float) -> None:
        """Report points done of all, how many of them failed, how many were done in this run, and its seconds.

        Args:
            done: points that are done.
            total: points of the sweep.
            failed: points that failed.
            now: points done in this run.
            seconds: of this run.
        """

    def close(self) -> None:
        """The sweep has ended, or was stopped."""


class Store(Protocol):
    """Where finished points go; `Journal` is one."""

    def add(self, found: Sequence[Finished]) -> None:
        """Keep some points, all of them or none."""


@dataclass(frozen=True)
class Job:
    """Points that one worker does one after another.

    Attributes:
        attempts: how often they were begun.
        deaths: how often a worker died of them while they ran alone; None where they never had to.
    """

    indices: tuple[int, ...]
    attempts: int = 0
    deaths: int | None = None


@dataclass(frozen=True)
class Count:
    """Points of the whole sweep, and how many of those that were stored before failed."""

    total: int
    failed: int = 0


@dataclass
class _State:
    waiting: deque[Job]
    suspects: deque[Job] = field(default_factory=deque)  # in flight when workers died: each is run alone
    running: dict[Future[list[Finished]], Job] = field(default_factory=dict)


def jobs(indices: Sequence[int], chunk: int) -> list[Job]:
    """Jobs of `chunk` points each.

    Args:
        indices: of the points to do.
        chunk: points a job.

    Returns:
        the jobs in order.

    Raises:
        SweepError: a chunk of less than one point.
    """
    if chunk < 1:
        raise SweepError(f"chunk = {chunk} cannot be; give a whole number of points a task, from 1")
    return [Job(tuple(indices[i : i + chunk])) for i in range(0, len(indices), chunk)]


def run(
    task: Task,
    parameters: Callable[[int], Mapping[str, Value]],
    todo: Sequence[Job],
    store: Store,
    pool: Pool,
    meter: Meter,
    *,
    count: Count,
    retries: int = 2,
) -> int:
    """Run jobs until all of them are stored.

    Args:
        task: called in a worker with the parameters of a point.
        parameters: of a point by its index.
        todo: what is to be done.
        store: where finished points go at once.
        pool: the workers.
        meter: told about every finished task.
        count: points of the whole sweep, and how many of those stored before failed.
        retries: how often a point in flight when workers died is tried again, alone, after the first such
            try.
        total, failed: points of the whole sweep, and how many of those stored before failed.

    Returns:
        How many points of the whole sweep have another outcome than "reached".

    Raises:
        SweepError: the pool is gone for good; what was finished is in the store.
    """
    began = time.monotonic()
    total, failed = count.total, count.failed
    left = sum(len(job.indices) for job in todo)
    done, now = total - left, 0
    state = _State(deque(todo))
    quiet = 0.0
    while state.waiting or state.suspects or state.running:
        _hand_out(state, task, parameters, pool)
        ready, _ = wait(state.running, timeout=1.0, return_when=FIRST_COMPLETED)
        quiet = 0.0 if ready or not pool.trouble() else quiet + 1.0
        if quiet > QUIET_S or (not ready and pool.trouble() == "gone"):
            pool.renew()
            raise SweepError(
                "the workers are out of reach; what is finished is kept: resume when they are back"
            )
        found, broken = _collect(state, ready, pool, retries)
        if broken:  # everything in flight is lost with the pool, or was finished just before
            # a scheduler that is gone may leave futures that never come back
            more, _ = _collect(state, wait(state.running, timeout=QUIET_S).done, pool, retries)
            found += more
        if found:
            store.add(found)
            failed += sum(point.outcome != Outcome.REACHED for point in found)
            done, now = done + len(found), now + len(found)
            meter.update(done, total, failed, now, time.monotonic() - began)
        if broken and (state.waiting or state.suspects):
            pool.renew()
    return failed


def _hand_out(
    state: _State, task: Task, parameters: Callable[[int], Mapping[str, Value]], pool: Pool
) -> None:
    """Fill the workers; suspects go alone, so that it is known which of them kills its worker."""
    most = 1 if state.suspects else AHEAD * pool.slots
    queue = state.suspects or state.waiting
    while queue and len(state.running) < most:
        job = queue.popleft()
        job = replace(job, attempts=job.attempts + 1)
        points = [(index, parameters(index)) for index in job.indices]
        state.running[pool.submit(work, task, points)] = job


def _collect(
    state: _State, ready: set[Future[list[Finished]]], pool: Pool, retries: int
) -> tuple[list[Finished], bool]:
    """Results of finished futures, and whether the pool broke."""
    found: list[Finished] = []
    broken = False
    for future in ready:
        job = state.running.pop(future)
        error = CancelledError() if future.cancelled() else future.exception()
        if error is None:
            found += [point._replace(attempts=job.attempts) for point in future.result()]
            continue
        lost = pool.lost(error)
        if lost == "pool":
            broken = True
            deaths = 0 if job.deaths is None else job.deaths + 1
            if deaths > retries:
                found.append(_dead(job, f"its worker died, {job.attempts} times in all"))
            else:
                state.suspects += [Job((index,), job.attempts, deaths) for index in job.indices]
        elif lost == "worker" and len(job.indices) > 1:
            state.waiting += [Job((index,), job.attempts) for index in job.indices]
        elif lost == "worker":
            found.append(_dead(job, f"every worker that tried it died ({' '.join(str(error).split())})"))
        else:
            raise SweepError(f"a task came back with an error ({type(error).__name__}: {error})") from error
    return found, broken


def _dead(job: Job, reason: str) -> Finished:
    return Finished(job.indices[0], "died", reason, {}, 0.0, job.attempts)
