"""Where the points of a sweep run: this process, local processes, a given executor, a Dask cluster."""

from __future__ import annotations

import asyncio
import contextlib
import os
import threading
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from typing import TYPE_CHECKING, Protocol, TypeVar

from bh.runtime.workers import Workers, interrupts_wait
from bh.sweep.points import SweepError

if TYPE_CHECKING:
    from distributed import Client, LocalCluster, Security

Result = TypeVar("Result")
ANSWER_S = 15.0  # until a scheduler counts as silent
ASK_AGAIN_S = 5.0  # between two looks at how many workers a cluster has


class Pool(Protocol):
    """Workers. `slots` is how many tasks run at the same time."""

    @property
    def slots(self) -> int:
        """How many tasks run at the same time."""

    def submit(self, function: Callable[..., Result], *args: object) -> Future[Result]:
        """Have a worker call `function(*args)`.

        Args:
            function: that can be pickled.
            *args: for it, that can be pickled.
        """

    def lost(self, error: BaseException) -> str:
        """Why a task came to nothing by no fault of its own: "worker" (it died), "pool" (all are gone), or ""."""
        ...

    def renew(self) -> None:
        """Make new workers after some died.

        Raises:
            SweepError: it cannot.
        """
        ...

    def trouble(self) -> str:
        """Why nothing will ever be finished again, or an empty string."""
        ...

    def close(self) -> None:
        """Let the workers go."""


class Here:
    """One after another in this process: no worker can die without it."""

    slots = 1

    def submit(self, function: Callable[..., Result], *args: object) -> Future[Result]:
        """Call it now; an exception is kept in the future."""
        future: Future[Result] = Future()
        try:
            future.set_result(function(*args))
        except Exception as error:
            future.set_exception(error)
        return future

    def lost(self, error: BaseException) -> str:
        """Why a task came to nothing: never by a worker, there is none but this process."""
        del error
        return ""

    def renew(self) -> None:
        """Refuse: there are no workers.

        Raises:
            SweepError: always.
        """
        raise SweepError("the sweep runs in this process and has no workers to renew")

    def trouble(self) -> str:
        """Nothing can be wrong."""
        return ""

    def close(self) -> None:
        """Nothing to close."""
        return


class Given:
    """A `concurrent.futures` executor; it is not shut down, and broken it cannot be made anew."""

    def __init__(self, executor: Executor) -> None:
        """Take an executor; where it does not say how many workers it has, one a core."""
        self.executor = executor
        self.slots = int(getattr(executor, "_max_workers", 0) or os.cpu_count() or 1)

    def submit(self, function: Callable[..., Result], *args: object) -> Future[Result]:
        """Have the executor call `function(*args)`."""
        return self.executor.submit(function, *args)

    def lost(self, error: BaseException) -> str:
        """See `Pool.lost`."""
        return "pool" if isinstance(error, BrokenExecutor | CancelledError) else ""

    def renew(self) -> None:
        """Refuse: the executor is another's.

        Raises:
            SweepError: always.
        """
        raise SweepError(
            "the given executor is broken; what is finished is kept: go on with a new one and resume"
        )

    def trouble(self) -> str:
        """Nothing is known of it."""
        return ""

    def close(self) -> None:
        """Nothing: the executor is another's."""
        return


class Local:
    """Processes on this machine, one solver thread each, started anew where one dies.

    Args:
        workers: how many.

    Raises:
        SweepError: none, or they cannot start.
    """

    def __init__(self, workers: int) -> None:
        """Start the processes."""
        if workers < 1:
            raise SweepError(f"workers = {workers} cannot be; give 1 or more, or 0 for this process")
        self.slots = workers
        self._start()

    def _start(self) -> None:
        self._executor = Workers(self.slots)
        try:
            self._executor.submit(os.getpid).result()
        except BrokenExecutor as error:
            raise SweepError(
                "the worker processes cannot start; a script that sweeps must do so under "
                "`if __name__ == '__main__':`, because they import it"
            ) from error

    def submit(self, function: Callable[..., Result], *args: object) -> Future[Result]:
        """Have a process call `function(*args)`."""
        try:
            return self._executor.submit(function, *args)
        except BrokenExecutor as error:  # found out between two tasks
            future: Future[Result] = Future()
            future.set_exception(error)
            return future

    def lost(self, error: BaseException) -> str:
        """See `Pool.lost`."""
        return "pool" if isinstance(error, BrokenExecutor) else ""

    def renew(self) -> None:
        """Start all processes anew."""
        self._executor.shutdown(wait=True, cancel_futures=True)
        self._start()

    def trouble(self) -> str:
        """Processes of this machine are always in reach."""
        return ""

    def close(self) -> None:
        """End the processes, also in the middle of a point."""
        # an interrupted sweep does not wait for points of minutes: nothing of them would be kept
        self._executor.end()


class Dask:
    """A Dask distributed cluster.

    Args:
        address: of a scheduler; None for a local cluster.
        workers: processes of a local cluster.

    Raises:
        SweepError: Dask is not installed, the scheduler does not answer, or it has no workers.
    """

    def __init__(self, address: str | None = None, workers: int = 0) -> None:
        """Connect to the scheduler."""
        try:
            from distributed import Client, LocalCluster, Security
        except ImportError as error:
            raise SweepError(
                "Dask is not installed; add the extra: pip install 'curved-crease-workbench[cluster]'"
            ) from error
        self._cluster: LocalCluster | None = None
        security: Security | None = None
        if address is None:
            security = _temporary_certificate(Security)
            self._cluster = _local_cluster(LocalCluster, workers, security)
        try:
            if address is not None:
                reach(address)
            self._client: Client = Client(
                self._cluster or address, timeout=ANSWER_S, set_as_default=False, security=security
            )
        except KeyboardInterrupt:
            if self._cluster is not None:
                self._cluster.close(timeout=2)
            raise
        except (OSError, TypeError, ValueError) as error:  # a time-out is an OSError
            raise SweepError(
                f"the scheduler '{address}' does not answer ({' '.join(str(error).split())}); start it with "
                "`dask scheduler` or check its address"
            ) from error
        self.address = str(self._client.scheduler_info()["address"])
        try:
            self._client.wait_for_workers(1, timeout=ANSWER_S)
        except TimeoutError as error:
            self.close()
            raise SweepError(
                f"the scheduler '{self.address}' has no workers; start some with `dask worker {self.address}`"
            ) from error
        self._executor = self._client.get_executor(pure=False)
        self._slots, self._asked = 1, 0.0

    @property
    def slots(self) -> int:
        """Threads of the cluster; workers may come and go."""
        if time.monotonic() > self._asked + ASK_AGAIN_S:
            self._asked = time.monotonic()
            with contextlib.suppress(OSError, TimeoutError):  # `trouble` tells of a scheduler that is gone
                self._slots = max(1, sum(self._client.nthreads().values()))
        return self._slots

    def submit(self, function: Callable[..., Result], *args: object) -> Future[Result]:
        """Have a worker call `function(*args)`."""
        future: Future[Result]
        try:
            future = self._executor.submit(function, *args)
        except (OSError, RuntimeError) as error:
            future = Future()
            future.set_exception(CancelledError(str(error)))
        return future

    def lost(self, error: BaseException) -> str:
        """See `Pool.lost`."""
        if isinstance(error, CancelledError):  # the scheduler forgot it
            return "pool"
        # the scheduler itself has tried it on several workers
        return "worker" if type(error).__name__ == "KilledWorker" else ""

    def renew(self) -> None:
        """Refuse: the scheduler is gone.

        Raises:
            SweepError: always.
        """
        raise SweepError(
            f"the scheduler '{self.address}' is gone; what is finished is kept: resume when it is back"
        )

    def trouble(self) -> str:
        """What the connection to the scheduler says."""
        if self._client.status in ("closed", "closing"):
            return "gone"
        if self._client.status == "connecting":
            return "does not answer any more"
        return ""

    def close(self) -> None:
        """Close the connection, and a local cluster with it."""
        with contextlib.suppress(Exception):  # it may be gone already
            self._client.close(timeout=2)
        if self._cluster is not None:
            with contextlib.suppress(Exception):
                self._cluster.close(timeout=5)


def reach(address: str) -> None:
    """Shake hands with a scheduler, and leave again.

    A `Client` that is refused is one more thing to be collected, and where that happens while another one starts, both
    wait for the same lock for ever: so none is made before the scheduler has answered.

    Args:
        address: of the scheduler; Dask's own settings say which keys are shown.

    Raises:
        OSError: nobody answers within `ANSWER_S`.
        TypeError: the address is one with keys, and there are none.
        ValueError: no address.
    """
    from distributed import Security
    from distributed.comm import connect

    keys: dict[str, object] = Security().get_connection_args("client")
    answer: Future[None] = Future()

    async def shake_hands() -> None:
        connection = await connect(address, timeout=ANSWER_S, **keys)
        await connection.close()

    def wait() -> None:
        try:
            answer.set_result(asyncio.run(shake_hands()))
        except BaseException as error:
            answer.set_exception(error)

    threading.Thread(
        target=wait, daemon=True
    ).start()  # the caller's own thread may run a loop, as a notebook's does
    answer.result()


def _temporary_certificate(kind: type[Security]) -> Security:
    """Keys that only this process has and hands to its workers.

    A scheduler runs what it is sent: without them, whoever reaches its port on this machine runs code as this user.
    """
    try:
        return kind.temporary()
    except ImportError as error:
        raise SweepError(
            "a Dask cluster of one's own needs cryptography; add the extra: "
            "pip install 'curved-crease-workbench[cluster]'"
        ) from error


def _local_cluster(kind: type[LocalCluster], workers: int, security: Security) -> LocalCluster:
    """A cluster of processes on this machine, or nothing at all where its start is interrupted."""
    import logging

    import dask
    from distributed.utils import LoopRunner

    with (
        interrupts_wait()
    ):  # what the thread of this loop starts inherits it: workers leave Ctrl-C to this process
        runner = LoopRunner()
        runner.start()
    cluster: LocalCluster = object.__new__(kind)
    silent: dict[str, list[str]] = {
        f"distributed.{each}.http.routes": [] for each in ("scheduler", "worker", "nanny")
    }
    try:
        with dask.config.set(silent):  # its web servers know no keys, and tell what is run
            kind.__init__(
                cluster,
                n_workers=workers,
                threads_per_worker=1,
                dashboard_address=":0",
                silence_logs=50,
                protocol="tls://",
                loop=runner.loop,
                security=security,
            )
    except KeyboardInterrupt:
        # what is half begun cannot be closed in good order, as Dask would try at exit; its processes end with this one
        cluster.shutdown_on_close = False
        for name in ("distributed", "tornado", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        raise
    return cluster
