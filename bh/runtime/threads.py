"""How many threads the linear algebra of a trace may use.

The matrices of a fold are narrow bands or small fronts: a second BLAS thread gains nothing there, and on a busy machine
the threads wait for each other (a ring of 1,920 unknowns took 5 s in place of 0.5 s on two busy cores).
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

_lock = threading.Lock()
_inside = 0
_limit: Any = None


@cache
def _blas() -> Any:
    """The BLAS libraries of this process. NumPy's and SciPy's are there once SciPy's linear algebra is imported."""
    import scipy.linalg  # noqa: F401
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(user_api="blas")


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """One BLAS thread inside, as many as before afterwards.

    The number belongs to the whole process. So where traces run in several threads the first one that enters sets it
    and the last one that leaves restores it.
    """
    global _inside, _limit
    from threadpoolctl import OpenBLASController

    with _lock:
        if _inside == 0:
            _limit = _blas().limit(limits=1)
        _inside += 1
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            if _inside == 0:
                # only the thread that set the number may change it again, unless it is told to give that up
                OpenBLASController.clear_controlling_thread(force=True)
                _limit.restore_original_limits()
                OpenBLASController.clear_controlling_thread(force=True)
                _limit = None
