"""Who may import whom, what `import bh` may load, and how long and how loose things may get; docs/architecture.md."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from bh.solvers.outcome import Outcome

ROOT = Path(__file__).resolve().parents[1]
HOUSE = ("meshes", "bh", "fem", "verification", "reports")
LONGEST_MODULE, LONGEST_FUNCTION = 450, 80
MOST_ANY, MOST_SKIPS = 60, 60
HEAVY = {
    "gmsh",
    "pint",
    "pyvista",
    "matplotlib",
    "plotly",
    "skfem",
    "dask",
    "distributed",
    "pymoo",
    "xarray",
    "h5py",
    "svgelements",
    "ezdxf",
    "trimesh",
    "tornado",
}
FORBIDDEN_AT_IMPORT = {*HEAVY, "numpy", "numba", "scipy", "meshio", "pydantic", "typer", "rich"}

# Whom a folder may import beside itself. A folder that is not here has no rule, and so fails.
GROUND = ("meshes", "bh.errors", "bh.runtime", "bh.solvers")
DESCRIPTION = (*GROUND, "bh.model", "bh.loading", "bh.formulations")
ANALYSIS = (*DESCRIPTION, "bh.paths", "bh.analysis")
USERS = (*ANALYSIS, "bh.scene", "bh.plotting", "bh.solving", "bh.applications")
RULES: dict[str, tuple[str, ...]] = {
    "meshes": (),
    "bh.errors": ("meshes.errors",),
    "bh.runtime": ("bh.errors",),
    "bh.solvers": ("meshes", "bh.errors", "bh.runtime"),
    "bh.model": GROUND,
    "bh.loading": (*GROUND, "bh.model"),
    "bh.formulations": (*GROUND, "bh.model", "bh.loading"),
    "bh.materials": ("bh.errors", "bh.model"),
    "bh.mechanics": (*DESCRIPTION, "bh.materials"),
    "bh.scene": (*DESCRIPTION, "bh.materials"),
    "bh.paths": DESCRIPTION,
    "bh.analysis": (*DESCRIPTION, "bh.paths"),
    "bh.plotting": (*ANALYSIS, "bh.scene"),
    "bh.solving": ANALYSIS,
    "bh.live": DESCRIPTION,
    "bh.studio": (*USERS, "bh.live"),
    "bh.applications": (*ANALYSIS, "bh.plotting", "bh.solving"),
    "bh.sweep": USERS,
    "bh.testing": USERS,
    "bh.commands": (*USERS, "bh.sweep"),
    "bh": ("meshes", "bh"),  # the facade
    # the judge shares no mechanics with the judged but contact, which is none of the sheet
    "fem": (*DESCRIPTION, "bh.paths", "bh.mechanics.contact"),
    "verification": ("meshes", "bh", "fem"),
    "reports": ("meshes", "verification", "bh.plotting", "bh.runtime"),
}
# none of these knows a formulation by name
DRIVERS = (
    "bh.model",
    "bh.loading",
    "bh.formulations",
    "bh.solvers",
    "bh.paths",
    "bh.solving",
    "bh.scene.load",
)


# ------------------------------------------------------------------------------------------ the sources as data


def module_name(file: Path) -> str:
    parts = list(file.relative_to(ROOT).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FILES = {module_name(f): f for part in HOUSE for f in sorted((ROOT / part).rglob("*.py"))}


@cache
def text_of(name: str) -> str:
    return FILES[name].read_text(encoding="utf-8")


@cache
def tree(name: str) -> ast.Module:
    return ast.parse(text_of(name))


def within(module: str, prefix: str) -> bool:
    return module == prefix or module.startswith(prefix + ".")


def folder(module: str) -> str:
    """The part of the house that a module belongs to: "bh.model" of "bh.model.sheet", "fem" of "fem.shell"."""
    parts = module.split(".")
    return ".".join(parts[:2]) if parts[0] == "bh" else parts[0]


def imported(source: ast.AST, module: str, package: bool) -> set[str]:
    """Modules of the house that a tree imports anywhere: inside functions and for type checkers only, too."""
    found: set[str] = set()
    for node in ast.walk(source):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                up = module.split(".")[: len(module.split(".")) - node.level + package]
                base = ".".join([*up, *([base] if base else [])])
            full = {f"{base}.{alias.name}" for alias in node.names}
            found |= {name if name in FILES else base for name in full}
    return {name for name in found if name.split(".")[0] in HOUSE}


@cache
def imports_of(name: str) -> frozenset[str]:
    return frozenset(imported(tree(name), name, FILES[name].name == "__init__.py") - {name})


def violations(module: str, imports: Iterable[str]) -> list[str]:
    """Imports that the rules forbid."""
    own = folder(module)
    if own not in RULES:
        return [f"{own} has no rule"]
    may = (own, *RULES[own]) if own != "bh" else RULES[own]
    return sorted(
        other
        for other in imports
        if not any(within(other, each) if each != "bh" or own != "fem" else other == each for each in may)
    )


def circles(graph: Mapping[str, Iterable[str]]) -> list[set[str]]:
    """Sets of more than one node that reach each other (Tarjan 1972), of a graph as node -> nodes."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[set[str]] = []

    def visit(node: str) -> None:
        index[node] = low[node] = len(index)
        stack.append(node)
        for other in graph.get(node, ()):
            if other not in index:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], index[other])
        if low[node] == index[node]:
            own = {stack.pop()}
            while node not in own:
                own.add(stack.pop())
            if len(own) > 1:
                found.append(own)

    for node in graph:
        if node not in index:
            visit(node)
    return found


# ------------------------------------------------------------------------------------------ 1, 2: who may import whom


def test_house_is_there() -> None:
    """The walk finds the modules; an empty list would let every rule pass."""
    for part in HOUSE:
        assert sum(within(name, part) for name in FILES) > 5
    assert {"bh.mechanics.shared.kinematics", "bh.solvers.newton", "bh.paths.path", "meshes.mesh"} <= set(
        FILES
    )


@pytest.mark.parametrize("part", sorted({folder(name) for name in FILES}))
def test_imports(part: str) -> None:
    wrong = {name: violations(name, imports_of(name)) for name in FILES if folder(name) == part}
    assert not {name: found for name, found in wrong.items() if found}


@pytest.mark.parametrize(
    ("module", "source", "wrong"),
    [
        ("meshes.mesh", "import bh", "bh"),
        (
            "meshes.io.fold",
            "def f():\n    from verification.framework import checks",
            "verification.framework.checks",
        ),
        ("bh.errors", "from bh.model import model", "bh.model.model"),
        ("bh.runtime.progress", "import bh.solvers.newton", "bh.solvers.newton"),
        ("bh.solvers.newton", "from ..mechanics.shared import kinematics", "bh.mechanics.shared.kinematics"),
        ("bh.solvers.newton", "from bh.model.model import Model", "bh.model.model"),
        ("bh.model.model", "from bh.loading.builder import load_steps", "bh.loading.builder"),
        ("bh.model.model", "from bh import trace", "bh"),
        (
            "bh.loading.builder",
            "if TYPE_CHECKING:\n    import bh.formulations.state",
            "bh.formulations.state",
        ),
        (
            "bh.formulations.state",
            "from bh.mechanics.shared import kinematics",
            "bh.mechanics.shared.kinematics",
        ),
        ("bh.mechanics.own", "from bh.paths.path import Path", "bh.paths.path"),
        ("bh.scene.load", "from bh.paths.path import Path", "bh.paths.path"),
        ("bh.paths.path", "def f():\n    from bh.plotting.pictures import show", "bh.plotting.pictures"),
        (
            "bh.paths.path",
            "from bh.mechanics.bars_and_hinges import system",
            "bh.mechanics.bars_and_hinges.system",
        ),
        ("bh.analysis.creases", "from bh.solving.trace import trace", "bh.solving.trace"),
        ("bh.plotting.charts", "import bh.commands.cli", "bh.commands.cli"),
        ("bh.solving.follow", "from bh.applications import polish", "bh.applications.polish"),
        ("bh.applications.polish", "import bh.sweep", "bh.sweep"),
        ("bh.sweep.runner", "import bh.commands.run", "bh.commands.run"),
        ("bh.commands.cli", "from fem import shell", "fem.shell"),
        ("bh.new.module", "import meshes", "bh.new has no rule"),
        ("fem.shell", "from bh.mechanics.shared import kinematics", "bh.mechanics.shared.kinematics"),
        ("fem.shell", "import verification", "verification"),
        ("verification.studies.ch3.cone", "from reports import build", "reports.build"),
        ("reports.build", "from bh import trace", "bh"),
        ("reports.build", "from bh.solvers.newton import Newton", "bh.solvers.newton"),
    ],
)
def test_imports_can_fail(module: str, source: str, wrong: str) -> None:
    """Each forbidden import, were it written, would be found."""
    assert violations(module, imported(ast.parse(source), module, False)) == [wrong]


def test_no_circles() -> None:
    """Neither among modules nor among folders; lazy imports and those for type checkers count."""
    assert circles({name: imports_of(name) for name in FILES if name != "bh"}) == []
    folders: dict[str, set[str]] = {}
    for name in FILES:
        folders.setdefault(folder(name), set()).update(folder(other) for other in imports_of(name))
    assert circles({part: others - {part} for part, others in folders.items() if part != "bh"}) == []


def test_circles_are_found() -> None:
    """A circle of three beside one of two, and none in a tree."""
    assert circles({"a": "b", "b": "c", "c": "a", "d": "ae", "e": "d"}) == [{"a", "b", "c"}, {"d", "e"}]
    assert circles({"a": "bc", "b": "c", "c": ""}) == []
    lazy = ast.parse(
        "def f():\n    from bh.solving import trace\nif TYPE_CHECKING:\n    import bh.model.sheet"
    )
    assert imported(lazy, "bh.model.until", False) == {"bh.solving.trace", "bh.model.sheet"}


# ------------------------------------------------------------------------------------------ 3, 4: names


def docstrings(source: ast.Module) -> set[int]:
    """Ids of the constants that are docstrings."""
    found = set()
    for node in ast.walk(source):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and node.body:
            first = node.body[0]
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
                found.add(id(first.value))
    return found


def formulations_in(source: ast.Module) -> list[str]:
    """Names, classes and modules of registered formulations outside docstrings; a default may be written down."""
    points = list(entry_points(group="bh.formulations"))
    words = {word for p in points for word in (p.name, p.value.split(":")[1])}
    skip = docstrings(source) | {
        id(node.value)
        for node in ast.walk(source)
        if isinstance(node, ast.AnnAssign) and node.value is not None
    }
    found = [
        node.value
        for node in ast.walk(source)
        if isinstance(node, ast.Constant) and id(node) not in skip and node.value in words
    ]
    return found + [node.id for node in ast.walk(source) if isinstance(node, ast.Name) and node.id in words]


@pytest.mark.parametrize("part", DRIVERS)
def test_drivers_know_no_formulation(part: str) -> None:
    assert not {name: found for name in FILES if within(name, part) if (found := formulations_in(tree(name)))}


def test_drivers_can_fail() -> None:
    assert formulations_in(
        ast.parse("if f == 'bars-and-hinges' or isinstance(f, Consistent):\n    pass")
    ) == ["bars-and-hinges", "Consistent"]
    assert formulations_in(ast.parse("class Model:\n    formulation: str = 'bars-and-hinges'")) == []


def outcome_comparisons(source: ast.Module) -> list[int]:
    """Lines that compare something with an outcome written as a string; a misspelled one would never be noticed."""
    words = {str(item) for item in Outcome}
    return [
        node.lineno
        for node in ast.walk(source)
        if isinstance(node, ast.Compare)
        for side in (node.left, *node.comparators)
        for item in (side.elts if isinstance(side, ast.Tuple | ast.List | ast.Set) else (side,))
        if isinstance(item, ast.Constant) and item.value in words
    ]


def test_no_comparison_with_an_outcome_string() -> None:
    assert not {name: lines for name in FILES if (lines := outcome_comparisons(tree(name)))}


@pytest.mark.parametrize("line", ["path.outcome == 'reached'", "'stalled' != x", "x in ('contact', 1)"])
def test_outcome_strings_can_fail(line: str) -> None:
    assert outcome_comparisons(ast.parse(line)) == [1]


# ------------------------------------------------------------------------------------- 5, 6, 7: what is loaded when


def loaded_after(code: str) -> set[str]:
    """Top-level modules in a fresh interpreter after `code`."""
    script = f"{code}\nimport json, sys\nprint(json.dumps(sorted({{m.split('.')[0] for m in sys.modules}})))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=ROOT
    )
    return set(json.loads(done.stdout.splitlines()[-1]))


def test_import_bh_is_light() -> None:
    loaded = loaded_after("import bh")
    assert "bh" in loaded
    assert not loaded & FORBIDDEN_AT_IMPORT


@pytest.mark.parametrize("name", ["svgelements", "numpy"])
def test_a_heavy_import_is_found(name: str) -> None:
    """What is loaded is seen, also within a function that is called."""
    loaded = loaded_after(f"import bh\ndef f():\n    import {name}\nf()")
    assert name in loaded & FORBIDDEN_AT_IMPORT


def test_folding_loads_no_heavy_library() -> None:
    code = (
        "import bh, meshes\n"
        "mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.5), along=2)\n"
        "path = bh.trace(bh.Model(mesh, bh.Sheet(E=4000.0, t=0.1)).fold('crease', to=3.0))\n"
        "assert path.reached"
    )
    loaded = loaded_after(code)
    assert "numba" in loaded  # the test can see what is loaded
    assert not loaded & {*HEAVY, "meshio", "pydantic", "typer", "rich"}


def test_facade() -> None:
    """It loads nothing before it is asked; its table, its names for type checkers and `__all__` say the same."""
    import bh

    for_checkers = {
        alias.name: node.module
        for block in tree("bh").body
        if isinstance(block, ast.If)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert for_checkers == bh._HOME
    assert sorted(bh.__all__) == sorted(bh._HOME)
    at_once = loaded_at_once(tree("bh"), "bh")
    assert at_once == {"bh.runtime.kernel_cache", "bh.runtime.viewer"}
    for name in at_once:
        outside = {n.split(".")[0] for n in imported_all(tree(name))}
        assert outside <= {*sys.stdlib_module_names, "__future__"}
    for name in bh.__all__:
        assert getattr(bh, name).__name__ == name
    for name in ("Actuation", "Constraint", "Formulation", "Step", "StepBuilder"):  # what a user extends
        assert name in bh.__all__
    with pytest.raises(AttributeError, match="nonsense"):
        _ = bh.nonsense


def loaded_at_once(source: ast.Module, package: str) -> set[str]:
    """Modules of the house that a package loads when it is imported: not those for type checkers or in functions."""
    return {
        name
        for node in source.body
        if not isinstance(node, ast.If | ast.FunctionDef)
        for name in imported(node, package, True)
    }


def test_what_a_facade_loads_at_once_is_found() -> None:
    late = "if TYPE_CHECKING:\n    import bh.model.sheet\ndef f():\n    import bh.model.until\n"
    assert loaded_at_once(ast.parse(late), "bh") == set()
    early = "from bh.solving.trace import trace\ntry:\n    import fem.state\nexcept ImportError:\n    pass\n"
    assert loaded_at_once(ast.parse(late + early), "bh") == {"bh.solving.trace", "fem.state"}


def imported_all(source: ast.Module) -> set[str]:
    """All modules that a tree imports, the house's and others."""
    names = {a.name for node in ast.walk(source) if isinstance(node, ast.Import) for a in node.names}
    return names | {node.module or "" for node in ast.walk(source) if isinstance(node, ast.ImportFrom)}


# ------------------------------------------------------------------------------------------ 8 to 12: size and looseness


def too_long(source: ast.Module, most: int = LONGEST_FUNCTION) -> list[str]:
    """Functions of more lines than `most`."""
    return [
        f"{node.name} ({(node.end_lineno or 0) - node.lineno + 1} lines)"
        for node in ast.walk(source)
        if isinstance(node, ast.FunctionDef) and (node.end_lineno or 0) - node.lineno + 1 > most
    ]


def long_modules(texts: Mapping[str, str], most: int = LONGEST_MODULE) -> dict[str, int]:
    """Modules of more lines than `most`, and how many they have."""
    lengths = {name: len(text.splitlines()) for name, text in texts.items()}
    return {name: lines for name, lines in lengths.items() if lines > most}


def test_length_of_modules() -> None:
    assert not long_modules({name: text_of(name) for name in FILES})
    texts = {"a": "x = 1\n" * LONGEST_MODULE, "b": "x = 1\n" * (LONGEST_MODULE + 1)}
    assert long_modules(texts) == {"b": LONGEST_MODULE + 1}


def test_length_of_functions() -> None:
    assert not {name: found for name in FILES if (found := too_long(tree(name)))}
    assert too_long(ast.parse("def f():\n" + "    x = 1\n" * LONGEST_FUNCTION)) == ["f (81 lines)"]


def crowd(files: Iterable[str]) -> list[str]:
    """What is wrong with the listing of `bh/` (paths in it): modules beside the facade, folders without a rule."""
    parts = [Path(file).parts for file in files]
    beside = [p[0] for p in parts if len(p) == 1 and p[0].endswith(".py") and p[0] != "__init__.py"]
    packages = {f"bh.{p[0]}" for p in parts if len(p) == 2 and p[1] == "__init__.py"}
    ruled = {part for part in RULES if within(part, "bh")} - {"bh", "bh.errors"}
    bare = {p[:-1] for p in parts} - {p[:-1] for p in parts if p[-1] == "__init__.py"}
    return [
        *(sorted(beside) if len(beside) > 2 else ()),
        *(f"{name} has no rule" for name in sorted(packages - ruled)),
        *(f"{name} is not there" for name in sorted(ruled - packages)),
        *(f"{'/'.join(folder)} has no __init__.py, so setuptools leaves it out" for folder in sorted(bare)),
    ]


def test_few_modules_beside_the_facade() -> None:
    """A newcomer sees folders: at most two modules lie directly in `bh/`, whose folders are packages with a rule."""
    files = [str(f.relative_to(ROOT / "bh")) for f in FILES.values() if f.is_relative_to(ROOT / "bh")]
    assert crowd(files) == []
    assert crowd([*files, "one.py", "two.py"]) == ["errors.py", "one.py", "two.py"]
    assert crowd([*files, "new/__init__.py"]) == ["bh.new has no rule"]
    assert crowd([*files, "model/deep/a.py"]) == [
        "model/deep has no __init__.py, so setuptools leaves it out"
    ]
    bare = {f.parent for f in FILES.values() if not (f.parent / "__init__.py").is_file()}
    assert not bare, "setuptools leaves out folders without __init__.py"


def count(pattern: str, texts: Iterable[str]) -> int:
    """How often a pattern occurs in texts."""
    return sum(len(re.findall(pattern, text)) for text in texts)


def texts_in(*places: str) -> Iterable[str]:
    """The modules below folders of the repository."""
    return (f.read_text(encoding="utf-8") for place in places for f in (ROOT / place).rglob("*.py"))


ANY, SKIP = r"\bAny\b", "fmt" + ": skip"


def test_few_any() -> None:
    assert count(ANY, texts_in("bh")) <= MOST_ANY


def test_no_any_in_the_seam() -> None:
    """Load steps, formulations and mechanics speak to each other in types."""
    assert count(ANY, texts_in("bh/formulations", "bh/mechanics", "bh/loading")) == 0


def test_few_unformatted_lines() -> None:
    assert count(SKIP, texts_in(*HOUSE, "tests", "benchmarks", "docs", "examples")) <= MOST_SKIPS


def test_counts_can_count() -> None:
    assert count(ANY, ["def f(x: Any) -> dict[str, Any]: ...", "Anything = typing.Any\n"]) == 3
    assert count(SKIP, ["x = [1,\n2]  # fmt: " + "skip\n"] * 2) == 2
    assert count(r"\bdef\b", texts_in("bh/model", "bh/loading")) > 100  # the files are read
