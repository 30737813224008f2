"""Pictures of folded sheets by pyvista, framed by matplotlib, and series for ParaView."""

from __future__ import annotations

import math
import os
import shutil
import tempfile
import uuid
from collections.abc import Sequence
from pathlib import Path as FilePath
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.paths.export import cell_data
from bh.plotting.camera import Camera, camera_of
from bh.plotting.charts import INK
from bh.plotting.colouring import KINDS, Colouring, colouring_of
from bh.plotting.offscreen import PlotError, has_display, render
from bh.plotting.panels import cut_open
from meshes.io.export import replacing, write_mesh

if TYPE_CHECKING:
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure
    from pyvista import Actor, Plotter, PolyData

    from bh.formulations.state import State
    from bh.paths.path import Path

Array = NDArray[np.float64]

# of a collection of VTU files
HEAD = (
    '<?xml version="1.0"?>',
    '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">',
    "  <Collection>",
)
FOOT = ("  </Collection>", "</VTKFile>", "")
PAPER, BLANK_SHEET, COLOURS = "white", "#b9c4cf", "viridis"
MOST_EDGES = 20_000  # triangles of a mesh whose edges can still be told apart in a picture


def picture(
    state: State,
    file: str | os.PathLike[str],
    colour: str | None = "bending",
    size: tuple[int, int] = (1200, 900),
    *,
    caption: str | bool = True,
    camera: tuple[float, float] | None = None,
    top: float | None = None,
) -> FilePath:
    """Write a picture of the folded sheet, coloured by energy density, without a window.

    Args:
        state: of a path.
        file: to write, .png; appears whole or not at all.
        colour: "stretching", "bending", "folding" or "total" energy density averaged to nodes, N mm / mm^2; "stress",
            the larger equivalent stress of top and bottom, MPa, averaged within panels; "utilisation", the same over
            the strength; None for the plain sheet (also drawn where there is nothing to colour).
        size: width and height, pixels.
        caption: a line of text; True for lambda and the energies, False for none.
        camera: azimuth and elevation that it looks from, rad; None for where most of the sheet is seen.
        top: energy density where the colours end, to compare pictures; None for the largest there is.

    Returns:
        The absolute path of the file.

    Raises:
        PlotError: not a state, an unknown colour, a size that cannot be, or no library to draw with.
        FileFormatError: the file cannot be written.
    """
    target = FilePath(file)
    if target.suffix.lower() != ".png":
        raise PlotError(f"picture '{target}' is not a .png file; name it so")
    width, height = _possible(size)
    colouring = colouring_of(state, colour, top)
    title = _energies(state) if caption is True else (caption or "")
    unit = _unit(width, height)
    head, foot = int(64 * unit) if title else 0, int(118 * unit) if colouring is not None else 0
    inner = height - head - foot
    image = _render(state, colouring, (width, inner), camera_of(state, width / inner, camera))
    figure = _frame(image, (width, height), foot, title, colouring)
    with replacing(target) as temporary:
        figure.savefig(temporary, format="png", dpi=100, metadata={"Software": None})
    return target.resolve()


def side_by_side(
    states: Sequence[State], file: str | os.PathLike[str], size: tuple[int, int] = (600, 450)
) -> FilePath:
    """Write a picture of several folded sheets, to one scale, in rows from the top left.

    Args:
        states: one a sheet; at least one.
        file: to write, .png; appears whole or not at all.
        size: width and height that each gets, pixels.

    Returns:
        The absolute path of the file.

    Raises:
        PlotError: no states, a size that cannot be, or no library to draw with.
        FileFormatError: the file cannot be written.
    """
    if not states:
        raise PlotError("there is no sheet to draw")
    width, height = _possible(size)
    cameras = [camera_of(state, width / height, None) for state in states]
    half = max(camera.half_height for camera in cameras)
    tiles = [
        _render(state, None, size, camera._replace(half_height=half))
        for state, camera in zip(states, cameras, strict=True)
    ]
    columns = math.ceil(math.sqrt(len(tiles)))
    rows = math.ceil(len(tiles) / columns)
    blank = np.ones_like(tiles[0])
    tiles += [blank] * (rows * columns - len(tiles))
    whole = np.vstack([np.hstack(tiles[columns * row : columns * (row + 1)]) for row in range(rows)])
    figure = _frame(whole, (columns * width, rows * height), 0, "", None)
    with replacing(FilePath(file)) as temporary:
        figure.savefig(temporary, format="png", dpi=100, metadata={"Software": None})
    return FilePath(file).resolve()


def moving_pictures(
    states: Sequence[State], colour: str | None, size: tuple[int, int]
) -> list[NDArray[np.uint8]]:
    """Pictures (height, width, 3) of states as `animation` shows them: one camera, one scale of colours.

    Args:
        states: of one path.
        colour: as for `picture`.
        size: width and height, pixels.

    Raises:
        PlotError: an unknown colour, a size that cannot be, or no library to draw with.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    width, height = _possible(size)
    whole = [colouring_of(state, colour, None) for state in states]
    top = max((found.top for found in whole if found is not None), default=0.0)
    unit = _unit(width, height)
    head, foot = int(64 * unit), int(118 * unit) if top else 0
    inner = height - head - foot
    camera = camera_of(states[-1], width / inner, None, np.concatenate([state.points for state in states]))
    found = []
    for state in states:
        colouring = colouring_of(state, colour, top or None)
        image = _render(state, colouring, (width, inner), camera)
        figure = _frame(image, (width, height), foot, _energies(state), colouring)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()  # type: ignore[no-untyped-call]
        found.append(np.asarray(canvas.buffer_rgba())[..., :3].copy())  # type: ignore[no-untyped-call]
    return found


def show(state: State, colour: str | None = "bending", **options: object) -> object:
    """Show the folded sheet in a window that turns with the mouse; returns when it is closed. In a notebook: a picture.

    Args:
        state: of a path.
        colour: as for `picture`.
        **options: of `pyvista.Plotter.show`; a notebook has no use for them.

    Returns:
        What `pyvista.Plotter.show` returns; in a notebook a `Still`, which a cell shows where it is its last line.

    Raises:
        PlotError: not a state, an unknown colour, or there is no display and no notebook.
    """
    from bh.plotting.notebook import Still, in_notebook

    if in_notebook():
        with tempfile.TemporaryDirectory() as folder:
            return Still(picture(state, FilePath(folder) / "sheet.png", colour).read_bytes())
    if not has_display():
        raise PlotError("no display to show the sheet on; use bh.plotting.picture(state, 'sheet.png')")
    import pyvista as pv
    from matplotlib.font_manager import findfont

    colouring = colouring_of(state, colour, None)
    plotter = pv.Plotter(window_size=[1200, 900], title="bh")
    near = camera_of(state, 4 / 3, None)
    # room for the texts
    camera = near._replace(
        half_height=1.22 * near.half_height, centre=near.centre - 0.08 * near.half_height * near.up
    )
    sheet = _draw(plotter, state, colouring, 2.0 * camera.half_height / 900)
    if colouring is not None:
        plotter.add_scalar_bar(
            f"{colouring.label}, {colouring.unit}\n",
            mapper=sheet.mapper,
            color=INK,
            n_labels=3,
            fmt="%.2g",
            position_x=0.03,
            position_y=0.03,
            width=0.34,
            height=0.08,
            title_font_size=18,
            label_font_size=16,
        )
    # VTK's own fonts have neither Greek letters nor raised digits
    plotter.add_text(_energies(state), font_size=9, color=INK, font_file=findfont("DejaVu Sans"))
    camera.aim(plotter)
    return plotter.show(**options)


def export_series(path: Path, folder: str | os.PathLike[str], name: str = "path") -> FilePath:
    """Write every state as a VTU file, and the collection `name`.pvd of them with time = step + lambda.

    Point data are the displacement (mm) and the energy densities by kind averaged to nodes, cell data what
    `bh.paths.export.cell_data` gives: energy densities, membrane forces, moments, stresses, reserve. The states lie in
    the folder `name` beside the collection;
    both appear when all is written and replace what was there.

    Args:
        path: solved, as far as it goes.
        folder: where the collection is written.
        name: of the collection and of its folder.

    Returns:
        The absolute path of the collection.

    Raises:
        PlotError: a path without states, or a folder that cannot be written to.
    """
    if not name or not name.replace("-", "").replace("_", "").isalnum():
        raise PlotError(f"series name '{name}' cannot be; use letters, digits, '-' and '_'")
    if len(path) == 0:
        raise PlotError("the path has no states to export; trace the model first")
    home = FilePath(folder)
    new = home / f".{name}-{uuid.uuid4().hex}"
    try:
        new.mkdir(parents=True)
        entries = []
        for index, (state, time) in enumerate(zip(path, path.lambdas.tolist(), strict=True)):
            file = f"{index:04d}.vtu"
            at_nodes: dict[str, Array] = {"displacement": state.points - state.mesh.points}
            at_nodes |= {f"{kind}_energy_density": state.nodal_energy_density(kind) for kind in KINDS}
            write_mesh(new / file, state.mesh, state.points, at_nodes, cell_data(state))
            entries.append(f'    <DataSet timestep="{time:.17g}" part="0" file="{name}/{file}"/>')
        _swap(new, home / name)
        text = "\n".join((*HEAD, *entries, *FOOT))
        with replacing(home / f"{name}.pvd") as temporary:
            temporary.write_text(text, encoding="utf-8")
    except OSError as error:
        raise PlotError(
            f"'{home / name}' cannot be written ({error.strerror}); choose a folder that you may write to"
        ) from error
    finally:
        shutil.rmtree(new, ignore_errors=True)
    return (home / f"{name}.pvd").resolve()


def _possible(size: tuple[int, int]) -> tuple[int, int]:
    width, height = size
    if not (160 <= width <= 8000 and 120 <= height <= 8000):
        raise PlotError(f"picture size {width} x {height} cannot be; give 160 x 120 to 8000 x 8000 pixels")
    return width, height


# --- what is drawn -----------------------------------------------------------------------------------------


def _energies(state: State) -> str:
    energy = state.energy
    parts = [f"{kind} {_number(getattr(energy, kind))}" for kind in KINDS if getattr(energy, kind) != 0.0]
    what = ", ".join(parts) + " N mm" if parts else "no energy"
    return f"step {state.step + 1}, λ = {state.lam:.4g}     {what}"


def _number(value: float) -> str:
    """Three digits, with a power of ten in superscript where that is shorter."""
    if value == 0.0 or 1e-3 <= abs(value) < 1e5:
        return f"{value:.3g}" if abs(value) < 1e3 else f"{value:.0f}"
    mantissa, exponent = f"{value:.2e}".split("e")
    return f"{mantissa} \N{MULTIPLICATION SIGN} 10{_superscript(int(exponent))}"


def _superscript(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def _panels(state: State) -> PolyData:
    """The sheet as a pyvista surface cut open along its creases, so that shading is smooth up to them."""
    import pyvista as pv

    nodes, triangles = cut_open(state.mesh)
    surface = pv.PolyData.from_regular_faces(state.points[nodes], triangles)
    surface.point_data["node"] = nodes
    return surface


def _draw(plotter: Plotter, state: State, colouring: Colouring | None, pixel: float) -> Actor:
    """Sheet (which is returned), mesh edges, boundary and creases; `pixel` is how many mm one is wide."""
    surface = _panels(state).compute_normals(
        cell_normals=False, split_vertices=False, consistent_normals=False, auto_orient_normals=False
    )
    look: dict[str, object] = {"ambient": 0.57, "diffuse": 0.47, "specular": 0.0}
    edges = _lines(state, state.mesh.topology.edges)
    faint: dict[str, object] = {"line_width": 1.0, "lighting": False, "show_scalar_bar": False}
    if colouring is None:
        look["color"] = BLANK_SHEET
        faint |= {"color": INK, "opacity": 0.25}
    else:
        scale = {"clim": (0.0, colouring.top), "show_scalar_bar": False, "interpolate_before_map": True}
        look |= {"scalars": colouring.on_panels(state), "cmap": COLOURS, **scale}
        faint |= {"scalars": colouring.values, "cmap": _shades_of_edges(), **scale}
    drawn = plotter.add_mesh(surface, smooth_shading=True, **look)
    # pushed back a little, so that the edges in the surface win over it
    drawn.mapper.SetResolveCoincidentTopologyToPolygonOffset()
    drawn.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(2.0, 2.0)
    if len(state.mesh.triangles) <= MOST_EDGES:
        plotter.add_mesh(edges, **faint)
    _tubes(plotter, _lines(state, state.mesh.topology.boundary), 0.9 * pixel)
    for crease in state.mesh.creases:
        _tubes(plotter, _lines(state, state.mesh.crease_edges(crease)), 2.3 * pixel)
    plotter.set_background(PAPER)
    return drawn


def _shades_of_edges() -> ListedColormap:
    """The colour map, a shade lighter where it is dark and a shade darker where it is light."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    colours = colormaps[COLOURS](np.linspace(0.0, 1.0, 256))[:, :3]
    dark = colours @ (0.30, 0.59, 0.11) < 0.36
    return ListedColormap(np.where(dark[:, None], 0.72 * colours + 0.28, 0.78 * colours))


def _lines(state: State, pairs: NDArray[np.int64]) -> PolyData:
    import pyvista as pv

    cells = np.column_stack((np.full(len(pairs), 2), pairs))
    return pv.PolyData(state.points, lines=cells.ravel())


def _tubes(plotter: Plotter, lines: PolyData, radius: float) -> None:
    joined = lines.strip(join=True, max_length=100_000)
    tube = joined.tube(radius=radius, n_sides=12, capping=True)
    if tube.n_points:  # lines without a length have no tube, and are not seen
        plotter.add_mesh(tube, color=INK, lighting=False)


# --- rendering ---------------------------------------------------------------------------------------------


def _render(state: State, colouring: Colouring | None, size: tuple[int, int], camera: Camera) -> Array:
    """(height, width, 3) picture of the sheet alone, values in [0, 1]."""
    _, height = size
    pixel = 2.0 * camera.half_height / height * max(height / 700.0, 0.5)

    def draw(plotter: Plotter) -> None:
        _draw(plotter, state, colouring, pixel)
        camera.aim(plotter)

    return render(size, draw)


def _frame(image: Array, size: tuple[int, int], foot: int, title: str, colouring: Colouring | None) -> Figure:
    """The rendered sheet, `foot` pixels above the bottom, a line of text above it and a colour bar below."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure
    from matplotlib.font_manager import FontProperties

    width, height = size
    unit = _unit(width, height)
    figure = Figure(figsize=(width / 100, height / 100), dpi=100, facecolor=PAPER)
    figure.figimage(image, 0, foot, origin="upper", zorder=-1)
    font = FontProperties(family="DejaVu Sans", size=16.0 * unit)
    if title:
        top = 1.0 - 28 * unit / height
        figure.text(0.03, top, title.replace("$", r"\$"), ha="left", va="top", color=INK, fontproperties=font)
    if colouring is not None:
        power = int(np.floor(np.log10(colouring.top)))
        power = power if not -2 <= power <= 2 else 0
        scale = f"10{_superscript(power)} " if power else ""
        axes = figure.add_axes((0.03, 56 * unit / height, 0.36, 16 * unit / height))
        colours = ScalarMappable(Normalize(0.0, colouring.top / 10.0**power), colormaps[COLOURS])
        extend = "max" if colouring.cut else "neither"
        figure.colorbar(colours, cax=axes, orientation="horizontal", extend=extend, drawedges=False)
        axes.spines[:].set_visible(False)
        axes.tick_params(length=5.0 * unit, width=unit, color=INK, labelcolor=INK, labelsize=15.0 * unit)
        axes.locator_params(nbins=5)
        title = f"{colouring.label}, {scale}{colouring.unit}"
        axes.set_title(title, loc="left", pad=8.0 * unit, color=INK, fontproperties=font)
    return figure


def _unit(width: int, height: int) -> float:
    """Size of texts: 1 in a picture of 1200 x 900 pixels, still to be read in small ones."""
    return max(min(width / 1200, height / 500), 0.5)


def _swap(new: FilePath, place: FilePath) -> None:
    """Move the folder `new` to `place`, whatever was there before."""
    with tempfile.TemporaryDirectory(dir=place.parent, prefix=".old-") as old:
        if place.exists():
            place.replace(FilePath(old) / place.name)
        new.replace(place)
