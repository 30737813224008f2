"""What a first run says of the kernels that it compiles, and that none is compiled twice."""

import logging
import math
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import pytest
from numba import njit

import bh
import meshes
from bh.runtime import compiling
from bh.runtime.progress import Silent
from bh.solving import trace as module

ONCE = """
import sys
from numba.core.dispatcher import Dispatcher
import bh, meshes
mesh = meshes.structured(meshes.annulus_sector(10.0, 1.0, 0.3), along=2)
for name in ("bars-and-hinges", "consistent"):
    model = bh.Model(mesh, bh.Sheet(E=1.0, t=0.1), formulation=name)
    bh.trace(model.fold("crease", by=0.1)), bh.trace(model.fold("crease", by=0.1, Lstar=1.0))
found = {
    f"{module}.{key}": [str(s) for s in value.signatures]
    for module in list(sys.modules) if module.startswith("bh.")
    for key, value in vars(sys.modules[module]).items() if isinstance(value, Dispatcher)
}
assert len(found) > 20
for name, signatures in found.items():
    if len(signatures) > 1:
        print(name, *signatures, sep="\\n  ")
"""


class Listener(Silent):
    def __init__(self) -> None:
        self.notes: list[str] = []

    def note(self, words: str) -> None:
        self.notes.append(words)


@pytest.fixture
def model() -> bh.Model:
    mesh = meshes.structured(meshes.annulus_sector(10.0, 1.0, 0.3), along=2)
    return bh.Model(mesh, bh.Sheet(E=1.0, t=0.1)).fold("crease", to=math.pi - 0.1)


def test_a_compilation_is_told_once(
    model: bh.Model, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(compiling, "_told", False)

    def compile_two(model: bh.Model, **_: object) -> SimpleNamespace:
        njit(lambda x: x + 1.0)(1.0)
        njit(lambda x: x + 2.0)(1.0)
        return SimpleNamespace(accuracy=None, reached=True)

    monkeypatch.setattr(module, "follow", compile_two)
    model = replace(model, contact=False)  # what comes of it has no states to look at
    meter = Listener()
    with caplog.at_level(logging.INFO, "bh"):
        bh.trace(model, progress=meter)
    (words,) = meter.notes
    assert "compiling" in words
    assert "once" in words
    assert [record.getMessage() for record in caplog.records] == [words]
    bh.trace(model, progress=meter)
    assert len(meter.notes) == 1


def test_nothing_is_told_where_nothing_is_compiled(model: bh.Model, monkeypatch: pytest.MonkeyPatch) -> None:
    bh.trace(model)  # from now on all is there
    monkeypatch.setattr(compiling, "_told", False)
    meter = Listener()
    bh.trace(model, progress=meter)
    assert meter.notes == []


def test_the_part_that_is_compiled_is_named() -> None:
    assert "consistent formulation" in compiling._part("bh.mechanics.consistent.kernels")
    assert "solver" in compiling._part("bh.solvers.sparse")
    assert "my_kernels" in compiling._part("my_kernels")


def test_every_kernel_is_compiled_for_one_kind_of_arguments() -> None:
    """A read-only array is a type of its own for numba, and whole numbers that are written out are, too."""
    done = subprocess.run([sys.executable, "-c", ONCE], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
