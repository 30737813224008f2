"""Docstrings of what others call: parameters, shapes of arrays that come back, and errors are all said.

What the rules ask of public functions and methods of `bh`, `fem` and `meshes` (see `complaints`):

- two parameters or more: an `Args` section that names all of them;
- an array, tuple, list or dict that is returned: a `Returns` section, or its shape in brackets in the first paragraph;
- an error of the library that the body raises: a `Raises` section.

Left out by rule: compiled kernels; properties; commands, whose options carry their help; and methods that a
protocol of the library asks for, which are documented once, at the protocol.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ERRORS = {"DesignError", "FileFormatError", "IndefiniteError", "InputError", "MeshError", "ModelError",
          "PathFileError", "PatternError", "PlotError", "SceneError", "SweepError"}  # fmt: skip
MANY = re.compile(r"Array|\b(?:NDArray|Ints|Bools|tuple|list|dict)\b")
SHAPE = re.compile(r"\((?:\.\.\.|[\w*+ ]+)(?:, ?[\w*+. -]+)*,?\)")
Method = tuple[ast.ClassDef | None, ast.FunctionDef]
Asked = set[tuple[str, ...]]  # methods of protocols, each name followed by its parameters


def sources() -> dict[str, ast.Module]:
    files = [file for folder in ("bh", "fem", "meshes") for file in sorted((ROOT / folder).rglob("*.py"))]
    return {str(file.relative_to(ROOT)): ast.parse(file.read_text(encoding="utf-8")) for file in files}


def is_protocol(node: ast.AST) -> bool:
    return isinstance(node, ast.ClassDef) and any("Protocol" in ast.unparse(base) for base in node.bases)


def public(body: Iterable[ast.stmt], of: ast.ClassDef | None = None) -> Iterator[Method]:
    """Public functions and methods, each with its class."""
    for node in body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield from public(node.body, node)
        elif isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            yield of, node


def parameters(node: ast.FunctionDef) -> list[str]:
    a = node.args
    every = [*a.posonlyargs, *a.args, *a.kwonlyargs, a.vararg, a.kwarg]
    return [one.arg for one in every if one is not None and one.arg not in ("self", "cls")]


def asked(trees: Iterable[ast.Module]) -> Asked:
    """What the protocols ask for."""
    classes = [node for tree in trees for node in ast.walk(tree) if is_protocol(node)]
    return {
        (node.name, *parameters(node))
        for one in classes
        if isinstance(one, ast.ClassDef)
        for node in one.body
        if isinstance(node, ast.FunctionDef)
    }


def left_out(of: ast.ClassDef | None, node: ast.FunctionDef, protocols: Asked) -> bool:
    marks = [ast.unparse(mark) for mark in node.decorator_list]
    if any(re.search(r"njit|property|overload|\.setter|\.command", mark) for mark in marks):
        return True
    return of is not None and not is_protocol(of) and (node.name, *parameters(node)) in protocols


def section(doc: str, title: str) -> str:
    """A section of a docstring, or an empty string."""
    found = re.search(rf"^{title}:\n((?:[ \n].*\n?)*)", doc, re.MULTILINE)
    return found.group(1) if found else ""


def complaints(tree: ast.Module, protocols: Asked) -> list[str]:
    """What is missing, one line for each function and section."""
    out = []
    for of, node in public(tree.body):
        if left_out(of, node, protocols):
            continue
        doc, name = ast.get_docstring(node) or "", f"{of.name}.{node.name}" if of else node.name
        given, args = parameters(node), section(doc, "Args")
        unnamed = [one for one in given if not re.search(rf"^ +\**{one}:", args, re.MULTILINE)]
        if len(given) >= 2 and unnamed:
            out.append(f"{name}: Args ({', '.join(unnamed)})")
        back = ast.unparse(node.returns) if node.returns else "None"
        said = section(doc, "Returns") or section(doc, "Yields") or SHAPE.search(doc.split("\n\n")[0])
        if MANY.search(back) and not said and not doc.startswith("See `"):
            out.append(f"{name}: Returns")
        calls = [
            one.exc.func
            for one in ast.walk(node)
            if isinstance(one, ast.Raise) and isinstance(one.exc, ast.Call)
        ]
        if {ast.unparse(call) for call in calls} & ERRORS and not section(doc, "Raises"):
            out.append(f"{name}: Raises")
    return out


def test_docstrings_say_what_callers_need() -> None:
    trees = sources()
    protocols = asked(trees.values())
    commands = ("bh/commands/", "bh/sweep/command.py", "bh/sweep/segments.py")
    missing = {
        name: found
        for name, tree in trees.items()
        if not name.startswith(commands) and (found := complaints(tree, protocols))
    }
    assert missing == {}


def test_a_docstring_that_lacks_something_is_found() -> None:
    text = '''
class Bare(Protocol):
    def asked(self, a: int, b: int) -> int: ...
class Own:
    def asked(self, a: int, b: int) -> int: ...
    def more(self, a: int, b: int) -> int:
        """Sum.

        Args:
            a: one.
        """
@njit
def kernel(a: Array, b: Array) -> Array: ...
def silent(x: Array) -> Array:
    """Twice x."""
    raise ModelError("no")
def shaped(x: Array) -> Array:
    """(n, 3) twice x."""
'''
    tree = ast.parse(text)
    assert complaints(tree, asked([tree])) == [
        "Bare.asked: Args (a, b)",
        "Own.more: Args (b)",
        "silent: Returns",
        "silent: Raises",
    ]
