"""Meshes for other programs, written through meshio; lengths in mm."""

from __future__ import annotations

import contextlib
import os
import uuid
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from meshes.curves import Array
from meshes.errors import FileFormatError
from meshes.mesh import SheetMesh

# suffix: (meshio's name, holds fields); formats that need further libraries or several files are left out
FORMATS: dict[str, tuple[str, bool]] = {
    ".vtu": ("vtu", True),
    ".vtk": ("vtk", True),
    ".msh": ("gmsh", True),
    ".obj": ("obj", False),
    ".stl": ("stl", False),
    ".ply": ("ply", False),
    ".off": ("off", False),
    ".inp": ("abaqus", False),
}


def write_mesh(
    path: str | os.PathLike[str],
    mesh: SheetMesh,
    points: ArrayLike | None = None,
    node_fields: Mapping[str, ArrayLike] | None = None,
    cell_fields: Mapping[str, ArrayLike] | None = None,
) -> None:
    """Write the triangles to `path` in the format of its suffix: one of `FORMATS`.

    The file appears whole or not at all: it is written beside its place and then moved there.

    Args:
        path: of the file; its suffix decides the format.
        mesh: the triangles, and the positions where `points` is None.
        points: (n, 3) positions, mm, of a folded state; the mesh's own where None.
        node_fields: by name, (n,) or (n, k) values of the nodes; only .vtu, .vtk and .msh hold fields.
        cell_fields: by name, (t,) or (t, k) values of the triangles.

    Raises:
        FileFormatError: an unknown suffix, fields that do not fit, a place that cannot be written to.
    """
    import meshio

    name = shown(path)
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        raise FileFormatError(f"{name}: suffix '{suffix}' is not known; use one of {', '.join(FORMATS)}")
    form, holds_fields = FORMATS[suffix]
    if (node_fields or cell_fields) and not holds_fields:
        able = ", ".join(key for key, (_, holds) in FORMATS.items() if holds)
        raise FileFormatError(f"{name}: {suffix} files hold no fields; leave them out or use one of {able}")
    place = mesh.points if points is None else _field(name, "points", points, len(mesh.points)).astype(float)
    if place.shape != mesh.points.shape or not np.isfinite(place).all():
        raise FileFormatError(f"{name}: points must be {len(mesh.points)} rows of three finite numbers in mm")
    count, nodes = len(mesh.triangles), len(mesh.points)
    at_nodes = {k: _field(name, f"node field {k!r}", v, nodes) for k, v in (node_fields or {}).items()}
    at_cells = {k: [_field(name, f"cell field {k!r}", v, count)] for k, v in (cell_fields or {}).items()}
    # .ply has no 64-bit integers: meshio would cast them with a printed warning
    triangles = mesh.triangles.astype(np.int32) if form == "ply" else mesh.triangles
    if form == "obj":
        with replacing(path) as temporary:
            temporary.write_text(_obj(mesh, place), encoding="ascii")
        return
    try:
        out = meshio.Mesh(np.array(place), [("triangle", triangles)], point_data=at_nodes, cell_data=at_cells)
        with replacing(path) as temporary:
            out.write(temporary, file_format=form)
    except meshio.WriteError as error:
        raise FileFormatError(f"{name}: {' '.join(str(error).split())}") from error


def texture(mesh: SheetMesh) -> Array | None:
    """(n, 2) where the nodes lie on the flat sheet, lower left corner at 0, longer side 1; None if it is not flat.

    Args:
        mesh: stress-free.
    """
    if not mesh.flat:
        return None
    xy = mesh.points[:, :2] - mesh.points[:, :2].min(axis=0)
    return np.asarray(xy / xy.max())


def _obj(mesh: SheetMesh, place: Array) -> str:
    """Wavefront's format, mm; meshio writes no texture coordinates that faces refer to."""
    flat = texture(mesh)
    lines = ["# curved-crease-workbench; mm"]
    lines += [f"v {x:.10g} {y:.10g} {z:.10g}" for x, y, z in place.tolist()]
    if flat is not None:
        lines += [f"vt {u:.8f} {v:.8f}" for u, v in flat.tolist()]
    each = "{0}/{0}" if flat is not None else "{0}"
    lines += [f"f {' '.join(each.format(k + 1) for k in row)}" for row in mesh.triangles.tolist()]
    return "\n".join([*lines, ""])


def _field(name: str, what: str, values: ArrayLike, count: int) -> Array:
    """`values` as floats or integers with `count` rows."""
    try:
        array = np.asarray(values)
    except ValueError:
        array = np.empty(0, dtype=object)
    if array.dtype.kind not in "biuf":
        raise FileFormatError(f"{name}: {what} is not an array of numbers; give one row of numbers each")
    if array.ndim not in (1, 2) or len(array) != count:
        raise FileFormatError(f"{name}: {what} has shape {array.shape}; give ({count},) or ({count}, k)")
    array = array.astype(float if array.dtype.kind == "f" else np.int64)
    if array.ndim == 2 and array.shape[1] == 2:  # VTK knows vectors of three components only
        array = np.column_stack((array, np.zeros_like(array[:, 0])))
    return array


def shown(path: str | os.PathLike[str]) -> str:
    """The path for a message of one line; anything that cannot be printed is escaped."""
    text = os.fspath(path)
    return text if text.isprintable() else ascii(text)


def one_line(error: Exception) -> str:
    """What an error says, on one line; characters that cannot be printed are escaped."""
    text = " ".join(str(error).split())
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary path in the same folder that takes the place of `path` once the block is through.

    Raises:
        FileFormatError: the file cannot be written there; what was there before stays as it was.
    """
    name = shown(path)
    try:
        target = Path(os.path.realpath(path))  # a link stays a link
        blocked = target.exists() and not target.is_file()
    except (OSError, ValueError) as error:  # a path with a null character is a ValueError
        raise FileFormatError(f"{name} is not a path; name a file to write") from error
    if blocked:
        raise FileFormatError(f"{name} is a folder or device; name a file to write")
    temporary = target.parent / f".{uuid.uuid4().hex}.tmp"
    try:
        yield temporary
        temporary.replace(target)
    except OSError as error:
        raise FileFormatError(
            f"{name} cannot be written ({error.strerror}); choose an existing folder that you may write to"
        ) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
