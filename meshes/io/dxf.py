"""DXF drawings as strokes, read by ezdxf: lines, arcs, circles, ellipses, polylines with bulges, splines, blocks."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from meshes.curves import Array
from meshes.errors import FileFormatError
from meshes.io.strokes import Colour, Dash, Stroke, dash_kind

UNITS = {
    0: 1.0,
    1: 25.4,
    2: 304.8,
    4: 1.0,
    5: 10.0,
    6: 1000.0,
    8: 2.54e-5,
    9: 0.0254,
    10: 914.4,
    13: 1e-3,
    14: 100.0,
}
TEXTS = ("TEXT", "MTEXT", "DIMENSION", "ATTDEF", "ATTRIB", "LEADER", "MULTILEADER")
SILENT = (*TEXTS, "POINT", "HATCH", "IMAGE", "VIEWPORT", "SOLID", "WIPEOUT")
LINES = ("LINE", "ARC", "CIRCLE", "ELLIPSE", "LWPOLYLINE", "POLYLINE", "SPLINE", "HELIX", "3DFACE", "TRACE")


def read_dxf(path: str | os.PathLike[str]) -> tuple[list[Stroke], float]:
    """The strokes of the model space, and millimetres a unit of theirs ($INSUNITS; without units: mm).

    Layers that are off or frozen are left out, and so are texts, dimensions and hatches.

    Args:
        path: of the file.

    Raises:
        FileFormatError: the file cannot be read or is not DXF, has units that are no lengths, lines that are
            not in the xy plane, or entities that are no lines.
    """
    from ezdxf.disassemble import recursive_decompose
    from ezdxf.filemanagement import readfile
    from ezdxf.lldxf.const import DXFError

    try:
        drawing = readfile(os.fspath(path))
    except DXFError as error:
        raise FileFormatError(
            f"this is not a DXF file that can be read ({error}); save it as DXF again"
        ) from error
    except IsADirectoryError as error:
        raise FileFormatError("this is a folder; name a .dxf file in it") from error
    except UnicodeDecodeError as error:
        raise FileFormatError(f"byte {error.start} cannot be decoded; save the file as DXF again") from error
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise FileFormatError(f"cannot be read ({why}); check the name and rights") from error
    unit = int(drawing.header.get("$INSUNITS", 0))
    if unit not in UNITS:
        raise FileFormatError(f"$INSUNITS = {unit} is no unit of a drawing; save it in mm, or give scale")
    strokes: list[Stroke] = []
    for entity in recursive_decompose(drawing.modelspace()):
        kind = entity.dxftype()
        if kind in SILENT or _off(drawing, entity):
            continue
        if kind not in LINES:
            raise FileFormatError(
                f"entity {kind} (handle {entity.dxf.handle}) is no line; explode or remove it"
            )
        strokes.append(_stroke(drawing, entity, len(strokes)))
    return strokes, UNITS[unit]


def _stroke(drawing: Any, entity: Any, number: int) -> Stroke:
    from ezdxf.path import make_path

    name = f"{entity.dxftype()} {number + 1} (handle {entity.dxf.handle})"
    path = make_path(entity)

    def sample(tolerance: float) -> Array:
        points = np.array([tuple(p) for p in path.flattening(tolerance, segments=4)])
        if len(points) and np.ptp(points[:, 2]) > 1e-6 * max(np.ptp(points, axis=0).max(), 1e-12):
            raise FileFormatError(f"{name} is not in the xy plane; flatten the drawing")
        return np.asarray(points[:, :2], dtype=float)

    return Stroke(
        sample=sample,
        name=name,
        colour=_colour(drawing, entity),
        layer=str(entity.dxf.layer),
        dash=_dash(drawing, entity),
        opacity=1.0 - entity.transparency,
    )


def _layer(drawing: Any, entity: Any) -> Any:
    name = entity.dxf.layer
    return drawing.layers.get(name) if name in drawing.layers else None


def _off(drawing: Any, entity: Any) -> bool:
    layer = _layer(drawing, entity)
    return bool(entity.dxf.get("invisible", 0)) or (
        layer is not None and (layer.is_off() or layer.is_frozen())
    )


def _colour(drawing: Any, entity: Any) -> Colour | None:
    """Its own colour or that of its layer; 7 is black on white paper and white on a black screen: None, the outline."""
    from ezdxf.colors import aci2rgb

    if entity.rgb is not None:
        return _rgb(entity.rgb)
    number, layer = entity.dxf.color, _layer(drawing, entity)
    if number in (0, 256):  # by block, by layer
        if layer is None:
            return None
        if layer.rgb is not None:
            return _rgb(layer.rgb)
        number = abs(layer.dxf.color)
    return None if number == 7 else _rgb(aci2rgb(number))


def _rgb(colour: Any) -> Colour:
    return int(colour[0]), int(colour[1]), int(colour[2])


def _dash(drawing: Any, entity: Any) -> Dash:
    name = str(entity.dxf.get("linetype", "BYLAYER"))
    layer = _layer(drawing, entity)
    if name.upper() in ("BYLAYER", "BYBLOCK"):
        name = str(layer.dxf.get("linetype", "CONTINUOUS")) if layer is not None else "CONTINUOUS"
    if name.upper() in ("CONTINUOUS", "SOLID") or name not in drawing.linetypes:
        return "solid"
    pattern = [tag.value for tag in drawing.linetypes.get(name).pattern_tags.tags if tag.code == 49]
    return dash_kind([float(value) for value in pattern])
