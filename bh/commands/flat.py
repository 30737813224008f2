"""`bh export`: a flat pattern as it was drawn, or a folded sheet, for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, cast

import typer

from bh.runtime.terminal import say

if TYPE_CHECKING:
    from bh.scene.flat import Angles, Cutting


def cutting(
    facets: bool, kerf: str | None, perforate: str | None, units: str, angles: str | None, marks: bool
) -> Cutting:
    """The options of a flat pattern.

    Args:
        facets: also lines that do not fold.
        kerf: a length, or None.
        perforate: two lengths with a comma between, or None.
        units: "mm" or "in".
        angles: "layer" or "text", or None.
        marks: of pinches.

    Raises:
        InputError: lengths that are none; the writer checks the words.
    """
    from bh.errors import InputError
    from bh.scene.flat import Cutting
    from meshes.quantities import spoken

    lengths: tuple[float, float] | None = None
    if perforate is not None:
        parts = perforate.split(",")
        if len(parts) != 2:
            raise InputError(f"--perforate {perforate} cannot be; give two lengths, such as 3,1")
        lengths = spoken(parts[0], "length"), spoken(parts[1], "length")
    return Cutting(
        facets,
        lengths,
        0.0 if kerf is None else spoken(kerf, "length"),
        cast("Literal['mm', 'in']", units),
        cast("Angles | None", angles),
        marks,
    )


def export(  # noqa: PLR0913 - the options of a command line
    source: Annotated[
        Path, typer.Argument(metavar="SOURCE", help="A scene (flat), or a path or run's folder (folded).")
    ],
    file: Annotated[Path, typer.Argument(metavar="FILE", help="What to write; its suffix is the format.")],
    state: Annotated[int, typer.Option("--state", help="Which state, from 0; -1 is the last.")] = -1,
    facets: Annotated[bool, typer.Option("--facets", help="Also lines that do not fold (SVG, DXF).")] = False,
    kerf: Annotated[
        str | None, typer.Option("--kerf", help="Width of the beam: outline out, holes in.")
    ] = None,
    perforate: Annotated[
        str | None, typer.Option("--perforate", metavar="CUT,LEFT", help="Creases as dashes: 3,1 (mm).")
    ] = None,
    units: Annotated[str, typer.Option("--units", help="mm or in.")] = "mm",
    angles: Annotated[
        str | None, typer.Option("--angles", help="Fold angles as names of layers (layer) or as text.")
    ] = None,
    marks: Annotated[
        bool, typer.Option("--marks", help="Mark the pinches, on a layer of their own.")
    ] = False,
) -> None:
    """Write a flat pattern as it was drawn, or a folded sheet."""
    from bh.errors import InputError
    from bh.paths.export import write_flat, write_state
    from meshes.io.drawing import DRAWINGS

    how = cutting(facets, kerf, perforate, units, angles, marks)
    if source.suffix.lower() in (".toml", *DRAWINGS):
        from bh.scene.flat import write_flat_pattern
        from bh.scene.load import load_scene

        scene = load_scene(source) if source.suffix.lower() == ".toml" else source
        if file.suffix.lower() in (".svg", ".dxf"):
            done = write_flat_pattern(file, scene, how)
        elif isinstance(scene, Path):
            raise InputError(f"'{source}' is a drawing: write it as .svg or .dxf, or fold it (bh fold)")
        else:
            done = write_flat(file, scene.model.mesh, facets)
    else:
        if (kerf, perforate, angles, marks, units) != (None, None, None, False, "mm"):
            raise InputError(
                f"'{source}' knows its mesh only: --kerf, --perforate, --units, --angles and --marks are for the "
                "scene that it was made from, or its drawing"
            )
        from bh.commands.occupied import path_file
        from bh.paths.path import Path as Trace

        solved = Trace.load(path_file(source) if source.is_dir() else source)
        if not -len(solved) <= state < len(solved):
            raise InputError(
                f"--state {state}: '{source}' has the states 0 to {len(solved) - 1}; -1 is the last"
            )
        last = state % len(solved)
        if file.suffix.lower() in (".svg", ".dxf"):
            done = write_flat(file, solved.model.mesh, facets)
        else:
            done = write_state(file, [solved[k] for k in range(last + 1)], source.stem)
    say(f"wrote {done}")
