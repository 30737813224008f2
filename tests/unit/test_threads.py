"""One BLAS thread inside a trace, and the process's own number afterwards."""

from __future__ import annotations

import threading
from typing import Any

import pytest

import bh
from bh.runtime.threads import _blas, one_blas_thread
from verification.studies.app_b.appendix_b import model


def numbers() -> set[int]:
    return {library["num_threads"] for library in _blas().info()}


@pytest.fixture
def three_threads() -> Any:
    with _blas().limit(limits=3):
        yield


def test_one_inside_and_the_same_afterwards(three_threads: None) -> None:
    assert numbers() == {3}
    with one_blas_thread():
        assert numbers() == {1}
        with one_blas_thread():
            assert numbers() == {1}
        assert numbers() == {1}
    assert numbers() == {3}


def test_an_error_restores_it(three_threads: None) -> None:
    with pytest.raises(KeyError), one_blas_thread():
        raise KeyError
    assert numbers() == {3}


def test_the_last_of_several_threads_restores_it(three_threads: None) -> None:
    """The first one leaves while the second is still inside."""
    inside, leave = threading.Event(), threading.Event()

    def second() -> None:
        with one_blas_thread():
            inside.set()
            leave.wait(10.0)

    worker = threading.Thread(target=second)
    with one_blas_thread():
        worker.start()
        assert inside.wait(10.0)
    assert numbers() == {1}
    leave.set()
    worker.join()
    assert numbers() == {3}


def test_a_trace_uses_one(three_threads: None, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    class Meter:
        def update(self, *_: Any) -> None:
            seen.append(numbers())

        def close(self, *_: Any) -> None:
            pass

    bh.trace(model("a", along=8), progress=Meter())
    assert seen
    assert all(number == {1} for number in seen)
    assert numbers() == {3}
