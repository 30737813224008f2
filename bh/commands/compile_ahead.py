"""A first run compiles from both ends: other processes take its kernels from the last one on, until they meet.

numba holds a lock while it compiles, so threads do not help; what another process has compiled is found in the cache.
Nothing waits for the others: a kernel that is not there yet when it is needed is compiled by the run itself. They end
with it, and their number is that of idle cores, two at most. `python -m bh.commands.compile_ahead PID PLACE` is one.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import TYPE_CHECKING

from bh.runtime.compiling import compilations_heard

if TYPE_CHECKING:
    from numba import types

MOST = 2  # processes beside the run
# what a run of the default formulation compiles, in the order in which it is needed; a test holds it to the code.
# Arguments: d, q, i, b, ? are float64, int64, int32, int8, bool; then the dimensions of an array, then r if read-only;
# Name:... is the named tuple of that name in the kernel's module
KERNELS = (
    "bh.mechanics.consistent.setup:_join q2 q1 q1 q1 q1 q1",
    "bh.mechanics.consistent.membrane_kernels:_triangle_strains d2r q2 d3 d1",
    "bh.mechanics.consistent.membrane_kernels:_edge_strains d2r q2 d3 d2",
    "bh.mechanics.consistent.membrane_kernels:bar_strains d2 q2 d1 d1",
    "bh.mechanics.consistent.membrane_kernels:cell_forces q2 d3 q2 d3 d1 d1",
    "bh.mechanics.consistent.membrane_kernels:bar_forces d2 q2 d1 d1 d2",
    "bh.mechanics.consistent.kernels:bending_forces d2 d1 q2 q3 d3 d2 q2 d3 d2 d1 d2 d2",
    "bh.mechanics.consistent.kernels:spring_forces d2 d1 q2 d1 d1 d1 q2 d2 d1 d1 d1",
    "bh.mechanics.shared.sparsity:_band_slots q2 q2 q1 q1 q1 i2 q1",
    "bh.mechanics.consistent.sparsity:_pick i2 q2 q1 i2",
    "bh.mechanics.consistent.membrane_kernels:triangle_tangent d2 q2 q2 ?2 d3 d1 q1 d3 q1 i2 d1",
    "bh.mechanics.consistent.membrane_kernels:edge_tangent d2 q2 q2 ?2 d3 d1 q1 d3 q1 i2 d1",
    "bh.mechanics.consistent.kernels:bending_tangent d2 q2 q3 d3 q3 q2 q2 q1 d3 d2 q2 q1 d3 i2 d1",
    "bh.mechanics.consistent.kernels:spring_tangent d2 q2 d1 d1 q2 q1 d3 i2 d1",
    "bh.solvers.envelope:_factorise d2 q1 d1 d2 q1 i1 d1",
    "bh.solvers.envelope:_solve d2 q1 d2",
    "bh.mechanics.consistent.membrane_kernels:bar_rates d2 d2 q2 d1",
    "bh.mechanics.consistent.kernels:bending_rates d2 d2 d1 q2 q3 d3 d2 q2 d3 d2",
    "bh.mechanics.consistent.kernels:spring_rates d2 d2 d1 q2 d1 d1 d1 q2 d1 d1",
    "bh.analysis.projection:outline q2r",
    "bh.analysis.projection:seen_once d2 q2r q2",
    "bh.solvers.dissection:_spread q1 q1 q q1 q1",
    "bh.solvers.dissection:_dissect q1 q1 q1 d2 q2 q b1 b1",
    "bh.solvers.sparse:_lower q1 q1 q1",
    "bh.mechanics.shared.sparsity:_sparse_slots q2 q2 q1 q1 i1 i1 i2 q1",
    "bh.solvers.multifrontal:_borders q1 q1 q1 q1 q1 q1 q1 q1 q1 q1",
    "bh.solvers.multifrontal:_rows_in_parent q1 q1 i1 q1 i1",
    "bh.solvers.multifrontal:_entry_places i1 i1 q1 q1 i1 q1",
    "bh.solvers.multifrontal:_update_places q1 q1 q1 q2 q2",
    "bh.solvers.multifrontal:_factorise d1 q1 q1 i1 q1 q1 q1 q1 q q d1 q1 i1 d1",
    "bh.solvers.multifrontal:_solve d1 q1 q1 i1 q1 d1 d1 q1 i1 d1",
)
# what the shell, which comes next where the default formulation converges slowly, compiles beside these solvers
SHELL = (
    "fem.kernels:measures d2 d3 Loops:q2,q2,d2,d2,d3,d3,d3,d3,d2,d2,d3,d3,d2 Frames:d3,d3 d2 d2",
    "fem.kernels:gradients d2 Loops:q2,q2,d2,d2,d3,d3,d3,d3,d2,d2,d3,d3,d2 Frames:d3,d3 d3",
    "fem.kernels:add_material d3 d3 d3 d3",
    "fem.kernels:add_geometric d2 d2 Loops:q2,q2,d2,d2,d3,d3,d3,d3,d2,d2,d3,d3,d2 Frames:d3,d3 d3",
    "fem.assembly:_sparse_slots q2 i1 i1",
    "fem.assembly:scatter d3 d2 i2 d1",
)


@contextlib.contextmanager
def compiled_ahead() -> Iterator[None]:
    """Inside, the first kernel of the bending formulations that must be compiled sets the other processes going.

    Where all kernels are in the cache nothing happens.
    """
    helpers: list[subprocess.Popen[bytes]] = []

    def help_with(module: str) -> None:
        if not helpers and module.startswith("bh.mechanics"):
            helpers.extend(_begin(place) for place in range(min(MOST, _cores() - 1)))

    try:
        with compilations_heard(help_with):
            yield
    finally:
        for helper in helpers:
            helper.terminate()
        for helper in helpers:
            helper.wait()


def _cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _begin(place: int) -> subprocess.Popen[bytes]:
    """One process, which finds the packages that this one has, and says nothing."""
    quiet = subprocess.DEVNULL
    return subprocess.Popen(
        [sys.executable, "-P", "-m", __name__, str(os.getpid()), str(place)],
        stdin=quiet,
        stdout=quiet,
        stderr=quiet,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )


def order(place: int) -> list[str]:
    """The kernels in the order of one process: from the last one on; the first process leaves the solver to the end.

    What a narrow sheet does without, the factors of wide ones, thus comes late where there is one process only, and
    the shell, which many runs do without, comes last in both.

    Args:
        place: of the process, from 0.
    """
    last_first = list(reversed(KERNELS))
    first = last_first if place else sorted(last_first, key=lambda kernel: kernel.startswith("bh.solvers"))
    return [*first, *reversed(SHELL)]


def compile_kernel(kernel: str) -> None:
    """Compile one kernel of the table, or load it where it is in the cache.

    Args:
        kernel: as in `KERNELS`.
    """
    name, *arguments = kernel.split()
    module, _, function = name.partition(":")
    place = importlib.import_module(module)
    getattr(place, function).compile(tuple(_type(code, place) for code in arguments))


def _type(code: str, module: ModuleType) -> types.Type:
    """The numba type of one argument of a kernel of that module."""
    from numba import types

    tuple_, colon, members = code.partition(":")
    if colon:
        kinds = [_type(member, module) for member in members.split(",")]
        return types.BaseTuple.from_types(kinds, getattr(module, tuple_))
    plain = {"d": types.float64, "q": types.int64, "i": types.int32, "b": types.int8, "?": types.boolean}
    if not code[1:]:
        return plain[code]
    return types.Array(plain[code[0]], int(code[1]), "C", readonly=code.endswith("r"))


def main(parent: int, place: int, compiling: Callable[[str], None] = compile_kernel) -> None:
    """Compile until all is done or the run has ended.

    Args:
        parent: process of the run.
        place: of this process among those that it started.
        compiling: what compiles one kernel of the table.
    """
    for kernel in order(place):
        if os.getppid() != parent:
            return
        compiling(kernel)


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        main(int(sys.argv[1]), int(sys.argv[2]))
