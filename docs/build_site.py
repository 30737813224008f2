"""Builds the documentation site: the pages as they are, a gallery of the examples, the reference of all public names.

    python docs/build_site.py build/docs        # what `make docs` does

Sources are copied into the folder first, laid out as in the repository, so that links lead where they lead on a code
host. Warnings are errors: a broken link or a reference to a name that is not there fails the build.
"""

from __future__ import annotations

import argparse
import contextlib
import html
import inspect
import io
import os
import pkgutil
import re
import runpy
import shutil
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples"
PAGES = {
    "Use": (
        "installation", "which_model", "drawing", "studio", "scenes", "materials", "from_a_test", "results", "plots",
        "accuracy", "testing", "report", "reliability",
    ),
    "Studies": (
        "stiffness", "corrugations", "pinching", "inverse_design", "isometric", "sensitivities", "scaling", "scan",
        "performance",
    ),
    "How it works": ("architecture", "extending", "formulation", "fem", "solver", "glossary", "decisions"),
    "Project": ("releasing",),
}  # fmt: skip
# The reference: packages whose __all__ is public, the modules that `bh` gives a short name, what docs import by its
# full name (USE), the classes that a pattern, a support, an actuation or a formulation of one's own is made from
# (EXTENSION; extending.md), and all modules of `fem` and `meshes`.
PUBLIC = ("bh", "meshes")
USE = (
    "meshes.io",
    "bh.testing",
    "bh.applications.response",
    "bh.applications.comparison",
    "bh.applications.corrugation.design",
    "bh.applications.inverse.reach",
    "bh.applications.inverse.tolerances",
    "bh.analysis.richardson",
    "bh.analysis.shapes",
    "bh.paths.export",
)
EXTENSION = (
    "bh.model.step", "bh.model.supports", "bh.model.actuations", "bh.loading.builder", "bh.loading.load_step",
    "bh.formulations.protocols", "bh.formulations.registry", "bh.solvers.system",
)  # fmt: skip


def main() -> int:
    parser = argparse.ArgumentParser(description="Build the documentation site.")
    parser.add_argument("folder", type=Path, nargs="?", default=ROOT / "build" / "docs")
    parser.add_argument(
        "--no-gallery", action="store_true", help="leave the gallery out; its examples take a minute"
    )
    parser.add_argument(
        "--no-reference",
        action="store_true",
        help="leave the reference and the listings of source out; they take a minute",
    )
    options = parser.parse_args()
    return build(options.folder, gallery=not options.no_gallery, reference=not options.no_reference)


def build(folder: Path, gallery: bool = True, reference: bool = True) -> int:
    """Write the site to `folder`/html; returns sphinx's exit code."""
    source = folder / "source"
    for old in (source, folder / "html"):
        shutil.rmtree(old, ignore_errors=True)
    shutil.copytree(ROOT / "docs", source / "docs", ignore=shutil.ignore_patterns("*.py", "__pycache__"))
    shutil.copytree(EXAMPLES, source / "examples", ignore=shutil.ignore_patterns("__pycache__", "*-out"))
    for page in (source / "docs").glob("*.md"):
        text = page.read_text(encoding="utf-8")
        page.write_text(text.replace("](../examples/)", "](../examples/README.md)"), encoding="utf-8")
    for name in ("CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "LICENSE", "SECURITY.md"):
        shutil.copyfile(ROOT / name, source / name)
    shutil.copytree(
        ROOT / "verification" / "records", source / "verification" / "records"
    )  # figures lead to them
    shutil.copyfile(ROOT / "verification" / "claims.toml", source / "verification" / "claims.toml")
    shutil.copyfile(ROOT / "docs" / "conf.py", source / "conf.py")
    if reference:
        write_reference(source / "reference")
    if gallery:
        write_gallery(source / "gallery")
        write_cookbook(source / "gallery")
    (source / "viewer").mkdir(exist_ok=True)
    write_index(source, gallery, reference)
    command = [sys.executable, "-m", "sphinx", "-q", "-E", "-W", "--keep-going", "-b", "html", str(source)]
    return subprocess.run([*command, str(folder / "html")], check=False, cwd=ROOT).returncode


def write_index(source: Path, gallery: bool, reference: bool) -> None:
    """The README, and what leads on from it."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    text = text.replace("](examples/)", "](gallery/index.md)" if gallery else "](examples/README.md)")
    listed = {name for names in PAGES.values() for name in names}
    rest = sorted(page.stem for page in (source / "docs").glob("*.md") if page.stem not in listed)
    trees = {caption: [f"docs/{name}" for name in names] for caption, names in PAGES.items()}
    trees["Studies"] += [f"docs/{name}" for name in rest]
    trees["Use"][1:1] = ["gallery/index", "gallery/cookbook"] if gallery else ["examples/README"]
    trees["Use"] += [*(["examples/README"] if gallery else []), "examples/cookbook/README"]
    trees["Use"] += ["examples/own_project/README"]
    trees["Project"] = ["CONTRIBUTING", *trees["Project"], "SECURITY", "CHANGELOG"]
    if reference:
        trees["Reference"] = ["reference/index"]
    for caption, pages in trees.items():
        lines = "\n".join(pages)
        text += f"\n```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{lines}\n```\n"
    (source / "index.md").write_text(text, encoding="utf-8")


# --- reference ---------------------------------------------------------------------------------------------------


def public_names(module: ModuleType) -> Iterator[str]:
    """Names of a module that a user may call: those of __all__, else what is defined there without an underscore."""
    if hasattr(module, "__all__"):
        yield from sorted(name for name in module.__all__ if not inspect.ismodule(getattr(module, name)))
        return
    for name, value in sorted(vars(module).items()):
        own = getattr(value, "__module__", None) == module.__name__
        if own and not name.startswith("_") and (inspect.isclass(value) or inspect.isfunction(value)):
            yield name


def reference_pages() -> dict[str, tuple[str, ...]]:
    """Names of the modules that the reference describes, by the heading that they stand under."""
    import bh

    found = {
        "To use": (*PUBLIC, *sorted(bh._SUBMODULES.values()), *USE),
        "To extend": EXTENSION,
        "The shell": tuple(modules_of("fem")),
        "Geometry in detail": tuple(modules_of("meshes")),
    }
    return found


def modules_of(package: str) -> Iterator[str]:
    """Names of all modules of a package, itself first; those with an underscore are private."""
    yield package
    for module in pkgutil.walk_packages(import_module(package).__path__, f"{package}."):
        if not any(part.startswith("_") for part in module.name.split(".")):
            yield module.name


def write_reference(folder: Path) -> None:
    """A page a public module, with every public name where it is first met, and a list of them all by subject."""
    folder.mkdir(parents=True)
    described: set[int] = set()  # a name that two modules share is described once
    tree = ["Reference", "=========", ""]
    for heading, names in reference_pages().items():
        pages = [name for name in names if write_module(folder, name, described)]
        tree += [heading, "-" * len(heading), "", ".. toctree::", "   :maxdepth: 2", ""]
        tree += [*(f"   {page}" for page in pages), ""]
    (folder / "index.rst").write_text("\n".join(tree), encoding="utf-8")


def write_module(folder: Path, name: str, described: set[int]) -> bool:
    """The page of a module; False, and no page, if all of its names are `described` on others. Adds to these."""
    import bh

    module = import_module(name)
    items = [item for item in public_names(module) if id(getattr(module, item)) not in described]
    if not items:
        return False
    # `meshes.structured` is a function, and the module that it comes from: the name leads to the function
    parent, _, last = name.rpartition(".")
    hidden = name in PUBLIC or (parent and inspect.isroutine(getattr(import_module(parent), last, None)))
    lines = [name, "=" * len(name), "", f".. py:module:: {name}", "   :no-index:" if hidden else "", ""]
    lines += [(inspect.getdoc(module) or "").split("\n\n")[0], ""]
    lines += [f"In short ``bh.{short}``.\n" for short, real in bh._SUBMODULES.items() if real == name]
    for item in items:
        value = getattr(module, item)
        described.add(id(value))
        if inspect.isclass(value):
            bases = ["   :show-inheritance:"] if value.__bases__ != (object,) else []
            lines += [f".. autoclass:: {name}.{item}", "   :members:", *bases, ""]
        elif callable(value):
            lines += [f".. autofunction:: {name}.{item}", ""]
    (folder / f"{name}.rst").write_text("\n".join(lines), encoding="utf-8")
    return True


# --- gallery -----------------------------------------------------------------------------------------------------


def write_gallery(folder: Path) -> None:
    """Run every example and write a page of what came out, beside what went in."""
    from bh.plotting import interactive

    folder.mkdir(parents=True)
    static = folder.parent / "viewer"
    static.mkdir()
    shutil.copyfile(interactive.FOLDER / "viewer.js", static / "viewer.js")
    (static / "plotly.min.js").write_text(interactive.library(), encoding="utf-8")
    scenes, scripts = sorted(EXAMPLES.glob("*.toml")), sorted(EXAMPLES.glob("*.py"))
    cards = [(file.stem, scene_page(file, folder)) for file in scenes]
    cards += [(file.stem, script_page(file, folder)) for file in scripts]
    lines = ["# Gallery", "", "Every example is run when these pages are built, and in the tests.", ""]
    for stem, title in cards:
        picture = next(iter(sorted(folder.glob(f"{stem}*.png"))))
        lines += [f"## [{title}]({stem}.md)", "", f"[![{title}]({picture.name})]({stem}.md)", ""]
    lines += ["```{toctree}", ":hidden:", "", *(stem for stem, _ in cards), "```", ""]
    (folder / "index.md").write_text("\n".join(lines), encoding="utf-8")


def scene_page(file: Path, folder: Path) -> str:
    """The page of a scene: what it says, the folded sheet to turn, its pattern, its energies. Returns the title."""
    import bh
    from bh.plotting import interactive

    text = file.read_text(encoding="utf-8")
    comment = re.match(r"(?:#.*\n)+", text)
    about = " ".join(line.lstrip("# ") for line in (comment[0] if comment else "").splitlines())
    title = re.split(r"[.:](?:\s|$)", about)[0].removeprefix("The ").strip()
    title = title[:1].upper() + title[1:]
    path = bh.trace(bh.load_scene(file).model)
    if path.outcome != "reached":
        raise SystemExit(f"example '{file.name}' ended early: {path.outcome} ({path.reason})")
    bh.plotting.picture(path[-1], folder / f"{file.stem}.png", size=(900, 560))
    bh.plotting.pattern(path.model).savefig(folder / f"{file.stem}_pattern.svg")
    shutil.copyfile(folder / f"{file.stem}.png", folder.parent / "viewer" / f"{file.stem}.png")
    image = f'<img src="../_static/{file.stem}.png" alt="{html.escape(title)}, folded">'
    viewer = interactive.figure(interactive.view(path).data, f"sheet-{file.stem}", title, image)
    energy = path[-1].energy
    page = f"""# {title}

{about}

{path.iterations} iterations with {path.unknowns} unknowns; stretching {energy.stretching:.4g}, bending
{energy.bending:.4g}, folding {energy.folding:.4g} N mm.

```{{raw}} html
<style>{interactive.style()}</style>
{viewer}
<script defer src="../_static/plotly.min.js"></script>
<script defer src="../_static/viewer.js"></script>
```

![The flat pattern with its creases and supports]({file.stem}_pattern.svg)

    bh run examples/{file.name} -o out --pictures

```toml
{text}```
"""
    (folder / f"{file.stem}.md").write_text(page, encoding="utf-8")
    return title


def script_page(file: Path, folder: Path) -> str:
    """The page of a script: what it says, prints and draws. Returns the title."""
    text = file.read_text(encoding="utf-8")
    done = subprocess.run(
        [sys.executable, str(file)],
        cwd=folder, capture_output=True, text=True, check=False, env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    if done.returncode != 0:
        raise SystemExit(f"example '{file.name}' failed: {done.stderr.strip().splitlines()[-1]}")
    title = file.stem.replace("_", " ").capitalize()
    about = (re.match(r'"""(.*?)"""', text, re.DOTALL) or ("", ""))[1]
    lines = [f"# {title}", "", about, "", "```python", text.rstrip(), "```", ""]
    if done.stdout:
        lines += ["It prints", "", "```text", done.stdout.rstrip(), "```", ""]
    for made in sorted(folder.glob(f"{file.stem}*")):
        what = made.stem.removeprefix(file.stem).strip("_").replace("_", " ") or title
        if made.suffix in (".png", ".svg", ".gif"):
            lines += [f"![{what}]({made.name})", ""]
        elif made.suffix == ".html":
            lines += [f"{{download}}`{made.name} <{made.name}>`, a page to open in a browser", ""]
    (folder / f"{file.stem}.md").write_text("\n".join(lines), encoding="utf-8")
    return title


def write_cookbook(folder: Path) -> None:
    """One page of all entries of the cookbook, each run here: what it says, its code, its picture."""
    lines = ["# Cookbook", "", "Each entry is run when these pages are built, and in the tests.", ""]
    with contextlib.chdir(folder):
        for file in sorted((EXAMPLES / "cookbook").glob("*.py")):
            text = file.read_text(encoding="utf-8")
            with contextlib.redirect_stdout(io.StringIO()):
                runpy.run_path(str(file), run_name="__main__")
            about, code = text.split('"""\n', 1)
            title, rest = about.removeprefix('"""').split("\n\n", 1)
            (picture,) = re.findall(rf'"({file.stem}\.(?:png|svg))"', text.split("__main__")[1])
            lines += [f"## {title}", "", rest.strip(), "", "```python", code.strip(), "```", ""]
            lines += [f"![{file.stem.replace('_', ' ')}]({picture})", ""]
    Path(folder / "cookbook.md").write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
