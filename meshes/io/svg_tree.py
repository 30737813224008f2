"""SVG text made into a tree that svgelements reads as a browser does.

Symbols are placed by their viewBox, `use` is written out (counted first, so that a few lines cannot become millions),
percentages become lengths, clip paths are laid beside what they clip, and namespaces cannot be taken for attributes.
"""

from __future__ import annotations

import copy
import re
from dataclasses import dataclass
from xml.etree import ElementTree

from meshes.errors import FileFormatError
from meshes.io.svg_counts import NOTHING, Counter, Load, style_rules
from meshes.limits import check_limit

Element = ElementTree.Element
SVG = "{http://www.w3.org/2000/svg}"
XLINK = "{http://www.w3.org/1999/xlink}href"
DEEPEST = 200  # groups in groups
CLIP, CLIP_SHAPE = "data-clip", "data-clip-shape"
# possessive, so that what fails fails at once
_REAL = r"[-+]?(?:\d++\.?+\d*+|\.\d++)(?:e[-+]?\d++)?+"
LENGTH = re.compile(_REAL + r"\s*[a-z]*%?", re.IGNORECASE)
_REALS = rf"{_REAL}[a-z%]*+(?:(?:[\s,]++|(?=[-+.])){_REAL}[a-z%]*+)*+"
TRANSFORMS = re.compile(
    rf"(?:(?:matrix|translate|scale|rotate|skewX|skewY)\s*+\(\s*+{_REALS}\s*+\)[\s,]*+)++", re.IGNORECASE
)
# which attributes are percentages of what: the viewport's width, its height, or its diagonal / sqrt(2)
_PERCENT = {
    "x": 0, "x1": 0, "x2": 0, "cx": 0, "rx": 0, "width": 0,
    "y": 1, "y1": 1, "y2": 1, "cy": 1, "ry": 1, "height": 1,
    "r": 2,
}  # fmt: skip
_SIZED = {"rect", "circle", "ellipse", "line", "use", "svg", "image"}
_NO_LINES = {"symbol", "clipPath", "marker", "pattern", "mask", "image"}
_SHAPES = {"d": {"path"}, "points": {"polyline", "polygon"}}  # what has them by right
_UNITS = {"": 1.0, "px": 1.0, "in": 96.0, "cm": 96.0 / 2.54, "mm": 96.0 / 25.4, "pt": 96.0 / 72.0, "pc": 16.0}


@dataclass
class Tree:
    """A tree that can be handed to svgelements.

    Attributes:
        text: the SVG written out, UTF-8.
        unit: whether the file states its size in a unit.
        metric: whether that is mm or cm.
        illustrator: whether Adobe Illustrator wrote it in pixels, which are 1/72 inch there.
    """

    text: bytes
    unit: bool
    metric: bool
    illustrator: bool


def svg_tree(data: bytes) -> Tree:
    """Read SVG text and write it out.

    Args:
        data: the bytes of a file, in any encoding that XML states.

    Returns:
        the tree, see `Tree`.

    Raises:
        FileFormatError: it is no XML, has no <svg> element, refers to itself, or becomes too large.
    """
    # an element has one or two angle brackets
    check_limit("entities", data.count(b"<") / 2.0, "this drawing", FileFormatError)
    try:
        root = ElementTree.fromstring(
            data
        )  # at once: in pieces, a long attribute is read again with each of them
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise FileFormatError(f"this is not XML ({error}); save the drawing as SVG again") from error
    if _tag(root) != "svg":
        raise FileFormatError("the file has no <svg> element; save the drawing as SVG")
    sheets = _styles(root)
    rules = style_rules([sheet.text or "" for sheet in sheets])
    for sheet, text in zip(sheets, rules.text, strict=True):
        sheet.text = text
    by_id = {e.get("id", ""): e for e in root.iter() if e.get("id")}
    writer = _Writer(by_id, Counter(rules))
    width, height = root.get("width", ""), root.get("height", "")
    _check_placed(root)
    out = writer.write(root, _viewport(root, None), ())
    pixels = all(re.fullmatch(r"\s*[\d.]+\s*(px)?\s*", value) for value in (width, height))
    return Tree(
        text=ElementTree.tostring(out, encoding="utf-8"),
        unit=any(re.search(r"(mm|cm|in|pt|pc)\s*$", value) for value in (width, height)),
        metric=any(re.search(r"(mm|cm)\s*$", value) for value in (width, height)),
        illustrator=pixels and b"Adobe Illustrator" in data[:2000],
    )


def _check_placed(root: Element) -> None:
    """Refuse sizes of the page and transforms that a browser ignores: nobody knows what was meant."""
    for key in ("width", "height"):
        value = root.get(key, "").strip()
        if value not in ("", "auto") and not LENGTH.fullmatch(value):
            raise FileFormatError(
                f"the page has {key} = {value[:40]!r}, which is no length; give one such as 120mm"
            )
    for element in root.iter():
        value = element.get("transform", "").strip()
        if value not in ("", "none") and not TRANSFORMS.fullmatch(value):
            raise FileFormatError(
                f"transform = {value[:60]!r} is not understood; mend it, or draw the lines in place"
            )


Viewport = tuple[float, float]


@dataclass(frozen=True)
class _Frame:
    """Where an svg within another lies: its box (x, y, width, height) and how its viewBox is placed in it."""

    box: tuple[float, float, float, float]
    transform: str
    overflow: bool


def _frame(element: Element, around: Viewport) -> _Frame:
    given = [_length(element.get(key, "")) for key in ("x", "y", "width", "height")]
    x, y = (value or 0.0 for value in given[:2])
    width, height = (around[k] if value is None else value for k, value in enumerate(given[2:]))
    overflow = bool(re.search(r"overflow\s*:\s*(visible|auto)", element.get("style", "")))
    overflow = overflow or element.get("overflow") in ("visible", "auto")
    box = (x, y, width, height)
    numbers = [_number(word) for word in re.split(r"[\s,]+", element.get("viewBox", "").strip())]
    if len(numbers) != 4 or None in numbers:
        return _Frame(box, f"translate({x!r},{y!r})", overflow)
    left, top, w, h = (float(value or 0.0) for value in numbers)
    if not (w > 0.0 and h > 0.0):
        return _Frame(box, "scale(0)", overflow)
    words = element.get("preserveAspectRatio", "xMidYMid meet").split()
    words = [word for word in words if word != "defer"] or ["xMidYMid"]
    sx, sy = width / w, height / h
    if words[0] != "none":
        sx = sy = max(sx, sy) if words[-1] == "slice" else min(sx, sy)
    shares = {"Min": 0.0, "Mid": 0.5, "Max": 1.0}
    along, up = (shares.get(part, 0.5) for part in (words[0][1:4], words[0][5:8]))
    dx = x + along * (width - sx * w) - sx * left
    dy = y + up * (height - sy * h) - sy * top
    return _Frame(box, f"translate({dx!r},{dy!r}) scale({sx!r},{sy!r})", overflow)


@dataclass
class _Writer:
    by_id: dict[str, Element]
    counter: Counter
    written: int = 0
    clips: int = 0

    def write(
        self, element: Element, view: Viewport, inside: tuple[str, ...], deep: int = 0, above: Load = NOTHING
    ) -> Element:
        """A copy of an element with everything in it; `inside` are the ids that are being written out around it."""
        self.written += 1
        check_limit("entities", self.written, "this drawing, every <use> written out,", FileFormatError)
        if deep > DEEPEST:
            raise FileFormatError(f"the drawing has groups in groups, more than {DEEPEST} deep; ungroup it")
        above = self.counter.carried(element, _tag(element), above)
        if _tag(element) == "use":
            return self._used(element, view, inside, deep, above)
        out = self._copied(element, view)
        frame = None
        if _tag(element) == "svg" and deep:
            frame = _frame(out, view)
            view = _viewport(out, view)
        for child in element:
            if isinstance(child.tag, str) and _tag(child) not in _NO_LINES:
                out.append(self.write(child, view, inside, deep + 1, above))
        if frame is not None:
            out = self._framed(out, frame)
        return self._clipped(element, out, view, inside, deep, above)

    def _framed(self, inner: Element, frame: _Frame) -> Element:
        """An svg within another as a group, placed by its viewBox and clipped to its frame."""
        inner.tag = f"{SVG}g"
        for key in ("x", "y", "width", "height", "viewBox", "preserveAspectRatio"):
            inner.attrib.pop(key, None)
        placed = Element(f"{SVG}g", {"transform": frame.transform})
        placed.append(inner)
        if frame.overflow:
            return placed
        self.clips += 1
        x, y, width, height = (repr(value) for value in frame.box)
        shapes = Element(f"{SVG}g", {CLIP_SHAPE: str(self.clips)})
        shapes.append(Element(f"{SVG}rect", {"x": x, "y": y, "width": width, "height": height}))
        group = Element(f"{SVG}g", {CLIP: str(self.clips)})
        group.extend([shapes, placed])
        return group

    def _copied(self, element: Element, view: Viewport) -> Element:
        out = Element(element.tag, dict(element.attrib))
        if _tag(element) == "style":  # other texts are no lines
            out.text = element.text
        for key, tags in _SHAPES.items():  # svgelements would hand them down
            if _tag(element) not in tags:
                out.attrib.pop(key, None)
        if _tag(element) == "path":
            out.attrib.setdefault("d", "")
        if _tag(element) in _SIZED:
            for key, axis in _PERCENT.items():
                value = out.get(key, "").strip()
                if value.endswith("%"):
                    share = _number(value[:-1])
                    length = (*view, ((view[0] ** 2 + view[1] ** 2) / 2.0) ** 0.5)[axis]
                    if share is not None:
                        out.set(key, repr(share / 100.0 * length))
        return out

    def _used(
        self, element: Element, view: Viewport, inside: tuple[str, ...], deep: int, above: Load
    ) -> Element:
        """`use` as a group; a symbol or an svg in it as an svg of the size that is asked for."""
        name = (element.get("href") or element.get(XLINK) or "").removeprefix("#")
        if name in inside:
            raise FileFormatError(f"<use> of '{name}' contains itself; remove the reference in it")
        wanted = self._copied(element, view)
        move = f"translate({wanted.get('x', '0')},{wanted.get('y', '0')})"
        keep = {
            k: v for k, v in wanted.attrib.items() if k not in ("x", "y", "width", "height", "href", XLINK)
        }
        group = Element(f"{SVG}g", {**keep, "transform": f"{wanted.get('transform', '')} {move}".strip()})
        target = self.by_id.get(name)
        if target is not None:
            if _tag(target) in ("symbol", "svg"):
                target = _as_svg(target, wanted)
            group.append(self.write(target, view, (*inside, name), deep + 1, above))
        return self._clipped(element, group, view, inside, deep, above)

    def _clipped(
        self,
        element: Element,
        out: Element,
        view: Viewport,
        inside: tuple[str, ...],
        deep: int,
        above: Load,
    ) -> Element:
        """The element beside what clips it, in a group that a reader can tell (`CLIP`)."""
        name = self._clip_of(element)
        region = self.by_id.get(name) if name else None
        if region is None or name in inside or _tag(region) != "clipPath":
            return out
        self.clips += 1
        check_limit("clips", self.clips, "this drawing", FileFormatError)
        group = Element(f"{SVG}g", {CLIP: str(self.clips)})
        if out.get("transform"):  # a clip path is in the coordinates of what it clips
            group.set("transform", out.attrib.pop("transform"))
        shapes = Element(f"{SVG}g", {CLIP_SHAPE: str(self.clips)})
        if region.get("transform"):
            shapes.set("transform", str(region.get("transform")))
        for child in region:
            if isinstance(child.tag, str):
                shapes.append(self.write(child, view, (*inside, str(name)), deep + 1, above))
        group.extend([shapes, out])
        return group

    def _clip_of(self, element: Element) -> str | None:
        style = re.search(r"clip-path\s*:\s*([^;]+)", element.get("style", ""))
        value = style.group(1) if style else element.get("clip-path")
        for word in element.get("class", "").split():
            value = value or self.counter.rules.clips.get(word)
        found = re.match(r"""url\(\s*['"]?#([^)'"]+)""", (value or "").strip())
        return found.group(1) if found else None


def _styles(root: Element) -> list[Element]:
    return [e for e in root.iter() if isinstance(e.tag, str) and _tag(e) == "style" and e.text]


def _as_svg(target: Element, wanted: Element) -> Element:
    """A symbol or svg as the svg element of the size that `use` asks for."""
    out = copy.copy(target)
    out.tag = f"{SVG}svg"
    for key in ("width", "height"):
        out.set(key, wanted.get(key) or target.get(key) or "100%")
    return out


def _viewport(element: Element, around: Viewport | None) -> Viewport:
    """Width and height that percentages inside an svg element refer to, in its own units."""
    numbers = [_number(word) for word in re.split(r"[\s,]+", element.get("viewBox", "").strip())]
    if len(numbers) == 4 and None not in numbers[2:]:
        return float(numbers[2] or 0.0), float(numbers[3] or 0.0)
    sizes = [_length(element.get(key, "")) for key in ("width", "height")]
    width, height = around or (100.0, 100.0)
    return (sizes[0] if sizes[0] is not None else width), (sizes[1] if sizes[1] is not None else height)


def _length(text: str) -> float | None:
    """A CSS length in pixels, None for what is none (a percentage, nothing)."""
    found = re.fullmatch(r"\s*([-+.\deE]+?)\s*([a-z]*)\s*", text)
    number = _number(found.group(1)) if found else None
    return (
        None
        if found is None or number is None or found.group(2) not in _UNITS
        else number * _UNITS[found.group(2)]
    )


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _tag(element: Element) -> str:
    return str(element.tag).rsplit("}", 1)[-1]
