"""DXF drawings as strokes, read by ezdxf: lines, arcs, circles, ellipses, polylines with bulges, splines, blocks."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from meshes.curves import Array
from meshes.errors import FileFormatError
from meshes.io.dxf_curves import dxf_curve
from meshes.io.files import drawing_bytes
from meshes.io.strokes import Colour, Dash, Stroke, Strokes, dash_kind, drawn_curve
from meshes.limits import check_limit

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
# entities that are no lines of a pattern; others that are no lines are refused
SILENT = (
    "TEXT",
    "MTEXT",
    "DIMENSION",
    "ARC_DIMENSION",
    "LARGE_RADIAL_DIMENSION",
    "POINT",
    "HATCH",
    "MPOLYGON",
    "ATTDEF",
    "ATTRIB",
    "LEADER",
    "MULTILEADER",
    "MLEADER",
    "TOLERANCE",
    "IMAGE",
    "VIEWPORT",
    "SOLID",
    "WIPEOUT",
    "OLE2FRAME",
    "ACAD_PROXY_ENTITY",
)
LINES = ("LINE", "ARC", "CIRCLE", "ELLIPSE", "LWPOLYLINE", "POLYLINE", "SPLINE", "HELIX", "3DFACE", "TRACE")
# how an entity, or a row of a table, begins: its kind after the group code 0
_BEGIN = re.compile(rb"\n *0\r?\n(?=[A-Z3])")
DEEPEST = 50  # blocks in blocks


class Look(NamedTuple):
    """Layer, colour and dashes that an entity takes from the block reference around it."""

    layer: str
    colour: Colour | None
    dash: Dash


def read_dxf(path: str | os.PathLike[str]) -> Strokes:
    """The strokes of the model space, and millimetres a unit of theirs ($INSUNITS; where it is not written, mm).

    Layers that are off or frozen are left out, and so are texts, dimensions, hatches and what has no length. What lies
    on layer 0 of a block, or is coloured "by block", takes layer and colour of the reference.

    Args:
        path: of the file.

    Raises:
        FileFormatError: the file cannot be read or is not DXF, has units that are no lengths, lines that are not in
            the xy plane, entities that are no lines, or blocks that contain themselves or become too many.
    """
    data = drawing_bytes(path, "DXF")
    _check_size(data)
    drawing = _document(path)
    stated = b"$INSUNITS" in data  # a library's default for files without it is metres
    unit = int(drawing.header.get("$INSUNITS", 0)) if stated else 0
    if unit not in UNITS:
        raise FileFormatError(f"$INSUNITS = {unit} is no unit of a drawing; save it in mm, or give scale")
    total = _written_out(drawing, drawing.modelspace(), (), {})
    check_limit("entities", total, "this drawing, its blocks written out,", FileFormatError)
    strokes: list[Stroke] = []
    for entity, around in _entities(drawing, drawing.modelspace(), None, ()):
        kind = entity.dxftype()
        if kind not in LINES:
            raise FileFormatError(
                f"entity {kind} (handle {entity.dxf.handle}) is no line; explode or remove it"
            )
        stroke = _stroke(drawing, entity, around, len(strokes))
        if stroke is not None:
            strokes.append(stroke)
    if not strokes:
        papers = [layout.name for layout in drawing.layouts if layout.name != "Model" and len(layout)]
        if papers:
            raise FileFormatError(
                f"the model space is empty, all is in the paper space '{papers[0]}'; move it to the model space"
            )
    return Strokes(strokes, UNITS[unit], stated=stated and unit != 0)


def _check_size(data: bytes) -> None:
    """Refuse what would take long to be read: a value has two lines, a vertex two or three values."""
    check_limit("vertices", data.count(b"\n") / 16.0, "this drawing", FileFormatError)
    # ezdxf makes three entities of an INSERT, 0.2 ms each
    check_limit(
        "entities", len(_BEGIN.findall(data)) + 2 * data.count(b"INSERT"), "this drawing", FileFormatError
    )


def _document(path: str | os.PathLike[str]) -> Any:
    from ezdxf.filemanagement import readfile
    from ezdxf.lldxf.const import DXFError

    try:
        return readfile(os.fspath(path))
    except DXFError as error:
        raise FileFormatError(
            f"this is not a DXF file that can be read ({error}); save it as DXF again"
        ) from error
    except UnicodeDecodeError as error:
        raise FileFormatError(f"byte {error.start} cannot be decoded; save the file as DXF again") from error
    except OSError as error:
        why = getattr(error, "strerror", None) or "it does not begin as a DXF file does"
        raise FileFormatError(f"cannot be read ({why}); check it, and save it as DXF again") from error
    except StopIteration as error:
        raise FileFormatError("the DXF file ends in its header; save it as DXF again") from error
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError) as error:
        raise FileFormatError(f"the DXF cannot be understood ({error}); save it as DXF again") from error


def _entities(
    drawing: Any, items: Any, around: Look | None, inside: tuple[str, ...]
) -> Iterator[tuple[Any, Look | None]]:
    """What is drawn, blocks written out, each with what it takes from the reference around it."""
    for entity in items:
        kind = entity.dxftype()
        if kind in SILENT or _off(drawing, entity):
            continue
        if kind != "INSERT":
            yield entity, around
            continue
        name = _deeper(entity, inside)
        look = Look(
            _layer_name(entity, around), _colour(drawing, entity, around), _dash(drawing, entity, around)
        )
        for copy in entity.multi_insert() if entity.mcount > 1 else (entity,):
            yield from _entities(drawing, _contents(copy), look, (*inside, name))


def _written_out(drawing: Any, items: Any, inside: tuple[str, ...], sizes: dict[str, int]) -> int:
    """Number of entities that blocks come to; each block is looked at once (`sizes`), and nothing is written out.

    To find out by writing them out takes a minute for as many as are allowed.
    """
    total = 0
    for entity in items:
        kind = entity.dxftype()
        if kind in SILENT or _off(drawing, entity):
            continue
        total += 1
        if kind == "INSERT":
            name = _deeper(entity, inside)
            if name not in sizes:
                sizes[name] = _written_out(drawing, entity.block() or (), (*inside, name), sizes)
            total += max(entity.mcount, 1) * (1 + sizes[name])  # an array of nothing takes its time too
    return total


def _deeper(insert: Any, inside: tuple[str, ...]) -> str:
    """The name of a block that is referred to within others."""
    name = str(insert.dxf.name)
    if name in inside or len(inside) >= DEEPEST:
        raise FileFormatError(f"block '{name}' contains itself; remove the reference in it")
    return name


def _contents(insert: Any) -> Iterator[Any]:
    try:
        yield from insert.virtual_entities()
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise FileFormatError(
            f"block '{insert.dxf.name}' cannot be placed ({error}); explode it in the drawing program"
        ) from error


def _stroke(drawing: Any, entity: Any, around: Look | None, number: int) -> Stroke | None:
    """The stroke of an entity, None where it has no length."""
    name = f"{entity.dxftype()} {number + 1} (handle {entity.dxf.handle})"
    if entity.dxftype() == "SPLINE":
        points = max(entity.control_point_count(), entity.fit_point_count())
        check_limit("control_points", points, name, FileFormatError)
    try:
        curve = dxf_curve(entity)
        sampler = _flattening(entity) if curve is None else curve.sampled
        first = sampler(1e300)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        return None  # no points, no radius, no knots: nothing is drawn
    if len(first) < 2 or (np.isfinite(first).all() and not np.ptp(first, axis=0).any()):
        return None
    return Stroke(
        _flat(sampler, name) if curve is None else drawn_curve(curve, name),
        name,
        _colour(drawing, entity, around),
        _layer_name(entity, around),
        _dash(drawing, entity, around),
        1.0 - entity.transparency,
        key=f"handle:{entity.dxf.handle}",
        curve=curve,
    )


def _flat(flatten: Callable[[float], Array], name: str) -> Callable[[float], Array]:
    """A sampler that gives points (k, 2) of one with points (k, 3), if these lie in the xy plane."""

    def sample(tolerance: float) -> Array:
        points = flatten(tolerance)
        if np.ptp(points[:, 2]) > 1e-6 * max(np.ptp(points, axis=0).max(), 1e-12):
            raise FileFormatError(f"{name} is not in the xy plane; flatten the drawing")
        return np.asarray(points[:, :2], dtype=float)

    return sample


def _flattening(entity: Any) -> Any:
    """A function that gives points (k, 3) of an entity within a tolerance."""
    from ezdxf.path import make_path

    if entity.dxftype() == "SPLINE":
        spline = entity.construction_tool()
        knots = np.asarray(spline.knots())
        first, last = knots[spline.degree], knots[len(knots) - 1 - spline.degree]
        if first > knots[0] or last < knots[-1]:  # the curve is there between these knots only
            return lambda tolerance: _spline(spline, float(first), float(last), tolerance)
    path = make_path(entity)
    size = float(np.ptp([tuple(p) for p in path.control_vertices()], axis=0).max()) if len(path) else 0.0
    return lambda tolerance: np.array(
        [tuple(p) for p in path.flattening(min(tolerance, max(size, 1e-300)), segments=4)]
    ).reshape(-1, 3)


def _spline(spline: Any, first: float, last: float, tolerance: float) -> Array:
    """Points of a spline between two of its knots: twice as many until chords stay within the tolerance."""
    count = 16
    points = _at(spline, np.linspace(first, last, count + 1))
    while count < 2**15:
        count *= 2
        finer = _at(spline, np.linspace(first, last, count + 1))
        off = np.linalg.norm(finer[1::2] - 0.5 * (points[:-1] + points[1:]), axis=1).max()
        points = finer
        if off <= 4.0 * tolerance:  # the finer chords are four times closer
            break
    return points


def _at(spline: Any, parameters: Array) -> Array:
    return np.array([tuple(p) for p in spline.points(parameters.tolist())])


def _layer_name(entity: Any, around: Look | None) -> str:
    name = str(entity.dxf.layer)
    return around.layer if name == "0" and around is not None else name


def _layer(drawing: Any, name: str) -> Any:
    return drawing.layers.get(name) if name in drawing.layers else None


def _off(drawing: Any, entity: Any) -> bool:
    if not entity.dxf.is_supported("layer"):  # what has a name that nobody knows
        return True
    layer = _layer(drawing, entity.dxf.layer)
    return bool(entity.dxf.get("invisible", 0)) or (
        layer is not None and (layer.is_off() or layer.is_frozen())
    )


def _colour(drawing: Any, entity: Any, around: Look | None) -> Colour | None:
    """Its own colour or that of its layer; 7 is black on white paper and white on a black screen: None, the outline."""
    from ezdxf.colors import aci2rgb

    if entity.rgb is not None:
        return _rgb(entity.rgb)
    number, layer = entity.dxf.color, _layer(drawing, _layer_name(entity, around))
    if number == 0 and around is not None:  # by block
        return around.colour
    if number in (0, 256):  # by layer
        if layer is None:
            return None
        if layer.rgb is not None:
            return _rgb(layer.rgb)
        number = abs(layer.dxf.color)
    return None if number == 7 else _rgb(aci2rgb(number))


def _rgb(colour: Any) -> Colour:
    return int(colour[0]), int(colour[1]), int(colour[2])


def _dash(drawing: Any, entity: Any, around: Look | None) -> Dash:
    name = str(entity.dxf.get("linetype", "BYLAYER"))
    if name.upper() == "BYBLOCK" and around is not None:
        return around.dash
    if name.upper() in ("BYLAYER", "BYBLOCK"):
        layer = _layer(drawing, _layer_name(entity, around))
        name = str(layer.dxf.get("linetype", "CONTINUOUS")) if layer is not None else "CONTINUOUS"
    if name.upper() in ("CONTINUOUS", "SOLID") or name not in drawing.linetypes:
        return "solid"
    pattern = [tag.value for tag in drawing.linetypes.get(name).pattern_tags.tags if tag.code == 49]
    return dash_kind([float(value) for value in pattern])
