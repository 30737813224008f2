"""Models of several levels, solved once: what a check of convergence is made of.

A level is whatever a function takes that makes a model of it, such as the number of rows; a model given as such
is refined by its own cells, cut as often as the level says. The size of the cells is that of the mesh, whatever the
levels are called.
"""

from __future__ import annotations

import hashlib
import json
import re
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path as FilePath
from typing import TypeVar, cast

from bh.errors import InputError, ModelError, PathFileError
from bh.formulations.state import State
from bh.model.model import Model
from bh.model.refinement import pattern_of, with_mesh
from bh.model.serialise import describe, fingerprint
from bh.paths.path import Path
from bh.solving.trace import trace
from bh.testing.session import running
from meshes.cells import Cells, RuledCells
from meshes.choices import cut

LEVELS = (1, 2, 4)  # of a model that is refined by itself, and of functions unless given
FEWEST = 3
KEPT = 200  # files in the folder of solved levels; the oldest go
OWN_CODE = re.compile(r'"(?:kind|observable)": "[^"]*:')  # "module:name"
Solvable = Model | Path | State
L = TypeVar("L")  # whatever the user's function takes
Maker = Callable[[L], Solvable]


@dataclass(frozen=True)
class Level:
    """One solved level.

    Attributes:
        level: as it was asked for.
        state: the last one.
        triangles: of the mesh.
        cells: how they were made, where the mesh knows that.
        unknowns, iterations, wall_time_s: of the solve; 0 where a state was given.
        cached: whether it was found solved.
    """

    level: object
    state: State
    triangles: int
    cells: Cells | None = None
    unknowns: int = 0
    iterations: int = 0
    wall_time_s: float = 0.0
    cached: bool = False


def wanted(levels: Sequence[L] | None) -> tuple[L, ...]:
    """The levels that are given, else those of the test's marker, else `LEVELS`.

    Args:
        levels: as given to a check.

    Returns:
        at least three.

    Raises:
        ModelError: it is no list, there are fewer, or one stands twice.
    """
    __tracebackhide__ = True
    if levels is not None and (isinstance(levels, str) or not isinstance(levels, Iterable)):
        raise ModelError(f"levels = {levels!r} are no list; an order needs three or more, such as (1, 2, 4)")
    test = running()
    marked = None if test is None else test.levels
    found = tuple(levels) if levels is not None else cast("tuple[L, ...]", marked or LEVELS)
    if len(found) < FEWEST:
        raise ModelError(f"levels = {found} are too few; an order needs three or more, such as (1, 2, 4)")
    if len(set(found)) < len(found):
        raise ModelError(f"levels = {found} do not refine: one stands twice")
    return found


def solved_levels(of: Model | Maker[L], levels: Sequence[L]) -> list[Level]:
    """Solve all levels, coarse to fine.

    Args:
        of: a model that is refined by its own cells, or a function from a level to a model (or a path or state of one).
        levels: in the order of refinement.

    Returns:
        one a level, with more triangles each.

    Raises:
        ModelError: the levels do not refine, or the model cannot be refined by itself.
        AssertionError: a level does not reach the end of its steps.
    """
    __tracebackhide__ = True
    maker: Maker[L] = _refining(of) if isinstance(of, Model) else of
    if not callable(maker):
        raise ModelError(
            f"{type(of).__name__} cannot be refined; give a model, or a function from a level to one"
        )
    found: list[Level] = []
    for level in levels:
        made = solved_level(maker(level), level)
        if found and made.triangles <= found[-1].triangles:
            raise ModelError(
                f"the levels do not refine: level {level} has {made.triangles} triangles, "
                f"level {found[-1].level} has {found[-1].triangles}; order them from coarse to fine"
            )
        found.append(made)
    return found


def _refining(model: Model) -> Callable[[object], Model]:
    """The model by level: its own cells, `level` times as short."""
    pattern, cells = pattern_of(model), model.mesh.cells
    if cells is None:
        raise ModelError(
            "this model's mesh does not know its cells, so it cannot be refined by itself; "
            "give a function from a level to a model"
        )

    def make(level: object) -> Model:
        if not isinstance(level, int) or isinstance(level, bool) or level < 1:
            raise ModelError(
                f"level {level!r} of a model cannot be; give whole numbers from 1: how often cells are cut"
            )
        mesh = model.mesh if level == 1 else cut(pattern, cells.refined(level))
        return with_mesh(model, mesh, model.formulation)

    return make


def solved_level(made: Solvable, level: object = None) -> Level:
    """The last state of a model that is solved now or was before, of a path, or as it is.

    Args:
        made: a model, path or state.
        level: that it is of.

    Raises:
        ModelError: it is none of them.
        AssertionError: the end of the steps is not reached.
    """
    __tracebackhide__ = True
    if isinstance(made, State):
        return Level(level, made, len(made.mesh.triangles), made.mesh.cells)
    if not isinstance(made, Model | Path):
        raise ModelError(f"a {type(made).__name__} is no model; a level gives a model, a path or a state")
    began = time.perf_counter()
    path, cached = (made, False) if isinstance(made, Path) else _traced(made)
    if not path.reached:
        where = "" if level is None else f"level {level}: "
        raise AssertionError(f"{where}{told(path)}")
    spent = path.wall_time_s if isinstance(made, Path) or cached else time.perf_counter() - began
    mesh = made.mesh if isinstance(made, Model) else path.model.mesh
    return Level(
        level, path[-1], len(mesh.triangles), mesh.cells, path.unknowns, path.iterations, spent, cached
    )


def sizes(levels: Sequence[Level]) -> list[float]:
    """Of the cells of every level: exactly where all are of one shape, else (area / triangles)^(1/2).

    Args:
        levels: coarse to fine.

    Returns:
        one a level, of which only the ratios matter.
    """
    ruled = [each.cells for each in levels if isinstance(each.cells, RuledCells)]
    if len(ruled) == len(levels) and len({(c.kind, c.along / c.rows) for c in ruled}) == 1:
        return [1.0 / c.rows for c in ruled]
    return [(float(each.state.mesh.areas.sum()) / each.triangles) ** 0.5 for each in levels]


def told(path: Path) -> str:
    """How a path ended: "step 2 of 3: limit-point (reason)".

    Args:
        path: that has not reached its end.
    """
    reason = f" ({path.reason})" if path.reason else ""
    return f"step {max(len(path.steps), 1)} of {len(path.model.steps)}: {path.outcome}{reason}"


# ------------------------------------------------------------------------------------- solved levels on disk


def solved_path(of: Model | Path) -> Path:
    """The path of a model, from the folder of solved levels where it is there; a path as it is.

    Args:
        of: one of them.

    Raises:
        ModelError: it is none.
    """
    __tracebackhide__ = True
    if not isinstance(of, Model | Path):
        raise ModelError(f"a {type(of).__name__} cannot be checked; give a model, a path or a state")
    return of if isinstance(of, Path) else _traced(of)[0]


def _traced(model: Model) -> tuple[Path, bool]:
    """(path, whether it was found solved)."""
    test = running()
    folder = None if test is None else test.cache
    key = None if folder is None else _key(model)
    if folder is None or key is None:
        return trace(model, warn=False), False
    file = folder / f"{key}.bh"
    if file.is_file():
        try:
            found = Path.load(file)
            if found.reached:
                return found, True
        except (PathFileError, ModelError):
            file.unlink(missing_ok=True)
    path = trace(model, warn=False)
    if path.reached:
        _keep(path, file)
    return path, False


def _keep(path: Path, file: FilePath) -> None:
    try:
        path.save(file)
    except (PathFileError, OSError):
        return  # a folder that cannot be written keeps nothing; the path is there
    old = sorted(file.parent.glob("*.bh"), key=lambda each: each.stat().st_mtime)
    for each in old[:-KEPT]:
        each.unlink(missing_ok=True)


def _key(model: Model) -> str | None:
    """What a solved level is filed under: its input, and the code that solves it; None where it cannot be stored."""
    try:
        data, _ = describe(model)
        known = fingerprint(model)
    except (InputError, TypeError, AttributeError, KeyError):
        return None
    if ":" in model.formulation or OWN_CODE.search(json.dumps(data)):
        return None  # code of the user's own, which may change without the model
    return hashlib.sha256(f"{known} {_code()}".encode()).hexdigest()[:40]


@cache
def _code() -> str:
    """The state of all code that a solve can depend on: names, sizes and times of the files of the packages."""
    import importlib.util

    marks = []
    for name in ("bh", "fem", "meshes"):
        spec = importlib.util.find_spec(name)
        for place in (spec.submodule_search_locations or ()) if spec is not None else ():
            for file in sorted(FilePath(place).rglob("*.py")):
                about = file.stat()
                marks.append(f"{file} {about.st_size} {about.st_mtime_ns}")
    return hashlib.sha256("\n".join(marks).encode()).hexdigest()
