"""The house of DESIGN.md, section 2: who may import whom, what `import bh` may load, and how long things may get."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
HOUSE = ("meshes", "bh", "fem", "verification", "reports")
LONGEST_MODULE, LONGEST_FUNCTION = 450, 80
HEAVY = (
    "gmsh", "pyvista", "matplotlib", "plotly", "skfem", "dask", "distributed", "pymoo", "xarray", "h5py",
    "svgelements", "ezdxf", "trimesh",
)  # fmt: skip

DESCRIPTION = (
    "bh.errors", "bh.model", "bh.model.supports", "bh.model.actuations", "bh.model.pinch", "bh.model.laws", "bh.loading.builder", "bh.model.plugins",
    "bh.loading.load_step", "bh.program", "bh.formulations.observables",
    "bh.model.serialise", "bh.scene", "bh.scene.tables", "bh.scene.patterns", "bh.scene.reading", "bh.state", "bh.formulations",
    "bh.model.refinement", "bh.symmetry", "bh.formulations.remarks",
)  # fmt: skip
PATH = (
    "bh.path",
    "bh.formulations.symmetry_reduction",
    "bh.solving.follow",
    "bh.paths.provenance",
    "bh.paths.storage",
    "bh.runtime.progress",
    "bh.runtime.threads",
)
PROTOCOL = ("bh.solvers.matrices", "bh.solvers.sparse", "bh.solvers.saddle", "bh.solvers.system")
TOP = (
    "bh.sweep", "bh.commands.cli", "bh.run", "bh.plotting", "bh.interactive", "bh.plotting.panels", "bh.plotting.charts", "bh.plotting.animation",
    "bh.plotting.offscreen", "bh.commands.warm_up",
    "bh.accuracy", "bh.check", "bh.design", "bh.example", "bh.export", "bh.schema",
)  # fmt: skip

# What each part may import of the house; the first prefix that fits a module decides. Its own part is written out,
# so that a part can be closed against itself too (the description does not know `bh.path`, ...).
RULES: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("meshes", ("meshes",)),
    ("bh.materials", ("bh.model.model", "bh.materials")),
    ("bh.mechanics", ("meshes", *DESCRIPTION, "bh.materials", "bh.mechanics", *PROTOCOL)),
    ("bh.solvers", ("meshes", "bh.solvers")),
    *((module, ("meshes", *DESCRIPTION)) for module in DESCRIPTION),
    # `path.plot()` and `bh.trace(..., accuracy=...)` are the user's words; what they need is loaded when it is called
    *(
        (module, ("meshes", *DESCRIPTION, "bh.solvers", *PATH, "bh.plotting", "bh.accuracy"))
        for module in PATH
    ),
    ("bh.accuracy", ("meshes", *DESCRIPTION, "bh.solvers", *PATH, "bh.accuracy", "bh.analysis")),
    ("bh.analysis", ("meshes", *DESCRIPTION, "bh.solvers", *PATH, "bh.analysis")),
    ("bh.applications", ("meshes", *DESCRIPTION, "bh.solvers", *PATH, "bh.analysis", "bh.applications")),
    *(
        (top, ("meshes", *DESCRIPTION, "bh.solvers", *PATH, "bh.analysis", "bh.applications", *TOP))
        for top in TOP
    ),
    # the facade: names for type checkers only, see `test_facade_loads_nothing`
    (
        "bh",
        (
            "meshes",
            *DESCRIPTION,
            "bh.solvers",
            *PATH,
            "bh.analysis",
            "bh.applications",
            *TOP,
            "bh.runtime.kernel_cache",
        ),
    ),
    ("fem", ("meshes", "fem", *DESCRIPTION, "bh.solvers", *PATH)),
    ("verification", ("meshes", "bh", "fem", "verification")),
    ("reports", ("meshes", "verification", "reports", "bh.plotting", "bh.interactive")),
)
# the mechanics of bars and hinges are known by name to none of these
DRIVERS = (
    "bh.solvers",
    "bh.path",
    "bh.paths.storage",
    "bh.scene",
    "bh.commands.cli",
    "bh.run",
    "bh.formulations",
    "bh.model",
)


def module_name(file: Path, root: Path = ROOT) -> str:
    parts = list(file.relative_to(root).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FILES = {module_name(f): f for part in HOUSE for f in sorted((ROOT / part).rglob("*.py"))}


@cache
def tree(name: str) -> ast.Module:
    return ast.parse(FILES[name].read_text(encoding="utf-8"))


def within(module: str, prefix: str) -> bool:
    return module == prefix or module.startswith(prefix + ".")


def imported(source: ast.AST, module: str, package: bool, known: set[str]) -> set[str]:
    """Modules that a syntax tree imports anywhere, also inside functions; `from a import b` is a.b if that is one."""
    found: set[str] = set()
    for node in ast.walk(source):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                up = module.split(".")[: len(module.split(".")) - node.level + package]
                base = ".".join([*up, *([base] if base else [])])
            for alias in node.names:
                full = f"{base}.{alias.name}"
                found.add(full if full in known else base)
    return found


def violations(module: str, imports: set[str]) -> list[str]:
    """Imports that the rules forbid."""
    allowed = next(may for prefix, may in RULES if within(module, prefix))
    return sorted(
        other
        for other in imports
        if other.split(".")[0] in HOUSE and not any(within(other, prefix) for prefix in allowed)
    )


def imports_of(name: str) -> set[str]:
    return imported(tree(name), name, FILES[name].name == "__init__.py", set(FILES))


# --------------------------------------------------------------------------------------- who may import whom


def test_house_is_there() -> None:
    """The walk finds the modules; an empty list would let every rule pass."""
    for part in ("meshes", "bh", "verification"):
        assert sum(within(name, part) for name in FILES) > 5
    assert {"bh.mechanics.shared.kinematics", "bh.solvers.newton", "bh.path", "meshes.mesh"} <= set(FILES)


@pytest.mark.parametrize("name", sorted(FILES))
def test_imports(name: str) -> None:
    wrong = violations(name, imports_of(name))
    assert not wrong, f"{name} must not import {', '.join(wrong)} (DESIGN.md, section 2)"


@pytest.mark.parametrize(
    ("module", "source", "wrong"),
    [
        ("meshes.mesh", "import bh", "bh"),
        (
            "meshes.io.fold",
            "def f():\n    from verification.framework.checks import Check",
            "verification.framework.checks",
        ),
        ("bh.model", "from bh.path import trace", "bh.path"),
        ("bh.model", "from bh import trace", "bh"),
        ("bh.state", "import bh.mechanics.shared.kinematics as k", "bh.mechanics.shared.kinematics"),
        ("bh.mechanics.shell", "from bh.solvers.newton import Newton", "bh.solvers.newton"),
        ("bh.mechanics.shell", "from bh.path import Path", "bh.path"),
        ("bh.solvers.newton", "from bh.mechanics import kinematics", "bh.mechanics.shared.kinematics"),
        ("bh.solvers.newton", "from ..mechanics import kinematics", "bh.mechanics.shared.kinematics"),
        ("bh.solvers.newton", "from bh.model import Model", "bh.model"),
        ("bh.solvers.newton", "from bh.program import StepProgram", "bh.program"),
        ("bh.path", "from bh.mechanics.bars_and_hinges import X", "bh.mechanics.bars_and_hinges"),
        ("bh.commands.cli", "from fem import shell", "fem.shell"),
        ("bh.analysis.observables", "import bh.commands.cli", "bh.commands.cli"),
        (
            "fem.shell",
            "from bh.mechanics.shared.kinematics import dihedral_angles",
            "bh.mechanics.shared.kinematics",
        ),
        ("fem.shell", "import verification", "verification"),
        ("verification.studies.ch3.cone", "from reports import build", "reports.build"),
        ("reports.build", "from bh import trace", "bh"),
        ("reports.build", "from bh.path import Path", "bh.path"),
        ("reports.build", "from bh.solvers.newton import Newton", "bh.solvers.newton"),
    ],
)
def test_the_rules_can_fail(module: str, source: str, wrong: str) -> None:
    """Each forbidden import, were it written, would be found."""
    assert violations(module, imported(ast.parse(source), module, False, set(FILES))) == [wrong]


@pytest.mark.parametrize(
    ("module", "source"),
    [
        (
            "fem.system",
            "from bh.model import Model\nfrom bh.solvers.newton import Newton\nimport meshes, bh.path",
        ),
        (
            "bh.mechanics.shell",
            "from bh.solvers.matrices import Matrix\nfrom bh.solvers.system import System",
        ),
        ("verification.cross", "import bh, fem, meshes\nfrom bh.mechanics import kinematics"),
        ("reports.build", "import verification.run\nfrom bh.plotting import picture"),
    ],
)
def test_the_rules_allow(module: str, source: str) -> None:
    assert violations(module, imported(ast.parse(source), module, False, set(FILES))) == []


def docstrings(source: ast.Module) -> set[int]:
    """Ids of the constants that are docstrings."""
    found = set()
    for node in ast.walk(source):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and node.body:
            first = node.body[0]
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
                found.add(id(first.value))
    return found


def formulation_words() -> set[str]:
    words = {point.name for point in entry_points(group="bh.formulations")}
    words |= {point.value.split(":")[0].split(".")[-1] for point in entry_points(group="bh.formulations")}
    words |= {point.value.split(":")[1] for point in entry_points(group="bh.formulations")}
    return words


@pytest.mark.parametrize("name", [name for name in sorted(FILES) if any(within(name, d) for d in DRIVERS)])
def test_drivers_know_no_formulation(name: str) -> None:
    """No module, class or registered name of a formulation outside docstrings; only a default may be written down."""
    words = formulation_words()
    assert "bars-and-hinges" in words
    source = tree(name)
    skip = docstrings(source)
    defaults = {
        id(node.value)
        for node in ast.walk(source)
        if isinstance(node, ast.AnnAssign) and node.value is not None
    }
    found = [
        node.value
        for node in ast.walk(source)
        if isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and id(node) not in skip | defaults
        and node.value in words
    ]
    found += [node.id for node in ast.walk(source) if isinstance(node, ast.Name) and node.id in words]
    assert not found, f"{name} names the formulation {found}"


# --------------------------------------------------------------------------------------- what is loaded when


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
    assert not loaded & {*HEAVY, "numba", "scipy", "meshio", "pydantic", "typer", "rich"}


def test_folding_loads_no_heavy_library() -> None:
    code = (
        "import bh, meshes\n"
        "mesh = meshes.structured(meshes.annulus_sector(100.0, 10.0, 0.5), along=2)\n"
        "path = bh.trace(bh.Model(mesh, bh.Sheet(E=4000.0, t=0.1)).fold('crease', to=3.0))\n"
        "assert path.outcome == 'reached'"
    )
    loaded = loaded_after(code)
    assert "numba" in loaded  # the test can see what is loaded
    assert not loaded & {*HEAVY, "meshio", "pydantic", "typer", "rich"}


def test_facade_loads_nothing() -> None:
    """`bh/__init__.py` imports from the house only for type checkers; and what must run before kernels are defined."""
    body = [
        node
        for node in tree("bh").body
        if not (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node))
    ]
    found = {m for m in imported(ast.Module(body, []), "bh", True, set(FILES)) if m.split(".")[0] in HOUSE}
    assert found == {"bh.runtime.kernel_cache"}
    assert (
        not {m.split(".")[0] for m in imports_of("bh.runtime.kernel_cache")}
        - set(sys.stdlib_module_names)
        - {"__future__"}
    )


def test_facade_names_exist() -> None:
    import bh

    for name in bh.__all__:
        assert getattr(bh, name).__name__ == name
    with pytest.raises(AttributeError, match="nonsense"):
        _ = bh.nonsense


# --------------------------------------------------------------------------------------- size


TOO_LONG: dict[str, str] = {}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.xfail(strict=True, reason=TOO_LONG[name]))
        if name in TOO_LONG
        else name
        for name in sorted(FILES)
    ],
)
def test_length_of_modules(name: str) -> None:
    lines = len(FILES[name].read_text(encoding="utf-8").splitlines())
    assert lines <= LONGEST_MODULE, f"{name} has {lines} lines; split it"


@pytest.mark.parametrize("name", sorted(FILES))
def test_length_of_functions(name: str) -> None:
    long = [
        f"{node.name} ({node.end_lineno - node.lineno + 1} lines)"
        for node in ast.walk(tree(name))
        if isinstance(node, ast.FunctionDef) and (node.end_lineno or 0) - node.lineno + 1 > LONGEST_FUNCTION
    ]
    assert not long, f"{name}: {', '.join(long)}"
