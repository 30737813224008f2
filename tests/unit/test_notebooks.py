"""The notebooks of the examples run in a real kernel, and show pictures."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

import bh
import meshes
from bh.plotting.notebook import in_notebook
from tests.unit.test_plotting import needs_opengl

NOTEBOOKS = sorted((Path(__file__).resolve().parents[2] / "examples" / "notebooks").glob("*.ipynb"))
# a kernel with its imports takes six seconds of processor time, so one of them is enough for every day
QUICK: dict[str, tuple[pytest.MarkDecorator, ...]] = {"first_fold": (), "how_stiff": (pytest.mark.slow,)}
KINDS = {  # what their cells show, in this order
    "first_fold": ["image/png", "image/png", "text/html", "image/png"],
    "how_stiff": ["image/png", "image/png"],
}


def executed(text: str, folder: Path) -> Any:
    """The notebook with its outputs, run by a kernel of this Python in `folder`."""
    import nbclient

    notebook = import_module("nbformat").reads(text, as_version=4)
    client = nbclient.NotebookClient(
        notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(folder)}}
    )
    return client.execute()


def shown(notebook: Any) -> list[str]:
    """The richest kind of every output that is not a line of text."""
    found = [out.data for cell in notebook.cells for out in cell.get("outputs", ()) if "data" in out]
    return [next((kind for kind in ("image/png", "text/html") if kind in data), "") for data in found]


@needs_opengl
@pytest.mark.parametrize(
    "file", [pytest.param(file, marks=QUICK[file.stem], id=file.stem) for file in NOTEBOOKS]
)
def test_notebooks_run_and_show_pictures(file: Path, tmp_path: Path) -> None:
    assert shown(executed(file.read_text(encoding="utf-8"), tmp_path)) == KINDS[file.stem]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_they_are_kept_without_outputs(file: Path) -> None:
    nbformat = import_module("nbformat")
    notebook = nbformat.reads(file.read_text(encoding="utf-8"), as_version=4)
    nbformat.validate(notebook)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(cell.outputs == [] and cell.execution_count is None for cell in code)


def test_charts_show_themselves_where_nobody_imported_pyplot() -> None:
    mesh = meshes.structured(meshes.strip(20.0, 10.0, [5.0]), along=2, rows=1)
    chart: Any = bh.plotting.pattern(bh.Model(mesh, bh.Sheet(E=4000.0, t=0.2)))
    assert chart._repr_png_().startswith(b"\x89PNG")


def test_show_is_a_window_outside_of_notebooks() -> None:
    assert not in_notebook()
