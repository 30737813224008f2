"""Other processes that compile the kernels of a first run from the last one on."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from numba import njit

from bh.commands import compile_ahead
from bh.commands.compile_ahead import KERNELS, SHELL, compile_kernel, compiled_ahead, main, order

EXAMPLES = Path(__file__).parents[2] / "examples"
ALL = """
import sys
from numba import types
from numba.core.dispatcher import Dispatcher
from pathlib import Path
from bh.commands.cli import main
assert main(["init"]) == 0
for scene in map(Path, ("scene.toml", "wave.toml")):
    scene.write_text(scene.read_text().replace("pictures = true", "pictures = false"))
    assert main(["run", str(scene), "-o", scene.stem, "--quiet"]) == 0
letters = {types.float64: "d", types.int64: "q", types.int32: "i", types.int8: "b", types.boolean: "?"}
def code(kind):
    if isinstance(kind, types.Array):
        layout = "" if kind.layout == "C" else kind.layout
        return f"{letters[kind.dtype]}{kind.ndim}{layout}{'' if kind.mutable else 'r'}"
    if isinstance(kind, types.BaseNamedTuple):
        return f"{kind.instance_class.__name__}:{','.join(map(code, kind))}"
    return letters[kind]
found = {
    f"{kernel.py_func.__module__}:{kernel.py_func.__name__} {' '.join(map(code, signature))}"
    for module in list(sys.modules) if module.startswith(("bh.", "fem."))
    for kernel in vars(sys.modules[module]).values() if isinstance(kernel, Dispatcher)
    if not kernel.targetoptions.get("no_cpython_wrapper") for signature in kernel.signatures
}
print("found", *sorted(found), sep="\\n")
"""


class Helper:
    """Stands for a process."""

    def __init__(self, place: int) -> None:
        self.place, self.calls = place, ["began"]

    def terminate(self) -> None:
        self.calls.append("terminated")

    def wait(self) -> None:
        self.calls.append("waited for")


@pytest.fixture
def begun(monkeypatch: pytest.MonkeyPatch) -> list[Helper]:
    """Helpers that have begun; none of them is a process."""
    helpers: list[Helper] = []

    def begin(place: int) -> Helper:
        helpers.append(Helper(place))
        return helpers[-1]

    monkeypatch.setattr(compile_ahead, "_begin", begin)
    return helpers


def kernel(module: str) -> Callable[[float], float]:
    """A kernel of a module, not yet compiled."""

    def double(x: float) -> float:
        return 2.0 * x

    double.__module__ = module
    return njit(double)  # type: ignore[no-any-return]


@pytest.mark.slow  # compiles everything anew
def test_the_table_is_what_a_run_compiles(tmp_path: Path) -> None:
    """Of the scene that `bh init` writes, on narrow meshes and on wide ones, and of a drawing that takes the shell."""
    for name in ("wave.toml", "wave.svg"):
        shutil.copy(EXAMPLES / name, tmp_path)
    done = subprocess.run(
        [sys.executable, "-c", ALL], capture_output=True, text=True, timeout=600, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.partition("found\n")[2].splitlines() == sorted((*KERNELS, *SHELL))


def test_a_kernel_of_the_table_is_compiled_for_its_arguments() -> None:
    from bh.solvers import dissection

    (row,) = (row for row in KERNELS if row.startswith("bh.solvers.dissection:_spread "))
    compile_kernel(row)
    (signature,) = dissection._spread.signatures
    assert len(signature) == len(row.split()) - 1


def test_a_kernel_of_named_tuples_is_compiled_for_them() -> None:
    from fem.kernels import Frames, Loops, gradients

    (row,) = (row for row in SHELL if row.startswith("fem.kernels:gradients "))
    compile_kernel(row)
    compiled = [[getattr(kind, "instance_class", None) for kind in one] for one in gradients.signatures]
    assert [None, Loops, Frames, None] in compiled


@pytest.mark.parametrize(("cores", "helpers"), [(1, 0), (2, 1), (3, 2), (64, 2)])
def test_idle_cores_help(
    begun: list[Helper], cores: int, helpers: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compile_ahead, "_cores", lambda: cores)
    with compiled_ahead():
        kernel("elsewhere")(1.0)
        assert not begun
        kernel("bh.mechanics.some")(1.0)
        kernel("bh.mechanics.more")(1.0)
    assert [helper.place for helper in begun] == list(range(helpers))
    assert all(helper.calls == ["began", "terminated", "waited for"] for helper in begun)


def test_helpers_end_with_a_run_that_fails(begun: list[Helper], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compile_ahead, "_cores", lambda: 2)

    def fail() -> None:
        with compiled_ahead():
            kernel("bh.mechanics.some")(1.0)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert begun[0].calls[-1] == "waited for"


def test_nothing_begins_where_all_is_there(begun: list[Helper]) -> None:
    ready = kernel("bh.mechanics.some")
    ready(1.0)
    with compiled_ahead():
        ready(1.0)
    assert not begun


def test_from_the_last_one_on() -> None:
    """The first process leaves the solver, which a narrow sheet does not need, to the end; the shell is behind all."""
    assert order(1) == [*reversed(KERNELS), *reversed(SHELL)]
    assert sorted(order(0)) == sorted((*KERNELS, *SHELL))
    solver = [row.startswith("bh.solvers") for row in order(0)[: len(KERNELS)]]
    assert solver == sorted(solver)
    assert order(0)[len(KERNELS) :] == list(reversed(SHELL))


def test_a_helper_stops_when_its_run_has_ended() -> None:
    done: list[str] = []
    main(os.getppid(), 1, done.append)
    assert done == order(1)
    main(-1, 1, done.append)
    assert len(done) == len(KERNELS) + len(SHELL)


def test_a_helper_begins_and_ends() -> None:
    """As a process: this one is not the parent that it is told, so it has nothing to do."""
    done = subprocess.run([sys.executable, "-m", "bh.commands.compile_ahead", "-1", "0"], capture_output=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")


def test_a_helper_of_this_process_is_ended() -> None:
    helper = compile_ahead._begin(0)
    helper.terminate()
    assert helper.wait(timeout=60) != 0
