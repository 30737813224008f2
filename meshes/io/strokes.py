"""What a drawn line stands for: by the name of its layer, its colour or its dashes.

A drawing of any format becomes strokes; docs/drawing.md has the table of what they mean by default, and every rule
can be overruled by a mapping such as {"#00aa00": "valley", "layer:score": "mountain", "dash:dotted": "ignore"}.
"""

from __future__ import annotations

import colorsys
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

from meshes.curves import Array
from meshes.drawn_curves import Chain
from meshes.errors import FileFormatError
from meshes.limits import check_limit

LineKind = Literal["mountain", "valley", "flat", "boundary", "cut", "facet", "ignore"]
Dash = Literal["solid", "dashed", "dotted", "dashdot"]
Colour = tuple[int, int, int]

# a layer that is named by one of these words, whole or among others
LAYERS: dict[LineKind, tuple[str, ...]] = {
    "mountain": ("mountain", "mountains", "m", "berg", "bergfalte", "montagne", "monte"),
    "valley": ("valley", "valleys", "v", "tal", "talfalte", "vallee", "valle"),
    "flat": ("flat", "undriven", "hinge", "hinges"),
    "boundary": (
        "boundary",
        "outline",
        "border",
        "contour",
        "rim",
        "edge",
        "edges",
        "b",
        "umriss",
        "rand",
        "kontur",
    ),
    "cut": ("cut", "cuts", "cutting", "slit", "slits", "schnitt", "schneiden", "coupe", "corte"),
    "facet": ("facet", "facets", "triangulation", "ruling", "rulings", "f"),
    "ignore": (
        "pinch",
        "angle",
        "angles",
        "ignore",
        "text",
        "notes",
        "dimensions",
        "construction",
        "guide",
        "guides",
        "hidden",
    ),
}
# layers of creases that do not say which way they fold: a mountain where their colour does not tell either
SCORES = (
    "score",
    "scores",
    "scoring",
    "crease",
    "creases",
    "fold",
    "folds",
    "engrave",
    "etch",
    "rill",
    "falz",
    "ritzen",
)
# hue in degrees, of colours that are neither dark, pale nor grey
HUES: tuple[tuple[float, float, LineKind], ...] = (
    (-20.0, 20.0, "mountain"),
    (45.0, 72.0, "facet"),
    (85.0, 160.0, "cut"),
    (205.0, 265.0, "valley"),
    (285.0, 330.0, "flat"),
)
DASHES: dict[Dash, LineKind] = {"dashdot": "mountain", "dashed": "valley"}
WORDS = {
    "black": (0, 0, 0), "white": (255, 255, 255), "red": (255, 0, 0), "green": (0, 128, 0), "lime": (0, 255, 0),
    "blue": (0, 0, 255), "yellow": (255, 255, 0), "magenta": (255, 0, 255), "fuchsia": (255, 0, 255),
    "cyan": (0, 255, 255), "aqua": (0, 255, 255), "gray": (128, 128, 128), "grey": (128, 128, 128),
    "orange": (255, 165, 0), "purple": (128, 0, 128),
}  # fmt: skip


@dataclass(frozen=True)
class Stroke:
    """One line of a drawing, before it means anything.

    Attributes:
        sample: points (k, 2) whose chords stay within a tolerance (in units of the drawing, y upwards) of the line.
        name: what messages call it: its id, or format and number.
        colour: of the line, 0 to 255 each; None where the drawing gives none.
        layer: name of the layer or group that it lies in, or "".
        dash: solid or how it is broken.
        opacity: 0 to 1; as a part of 180 degrees it says how far to fold.
        key: "id:NAME" or "handle:NUMBER" by which a mapping can name this line alone, or "".
        unknown: what its colour says where that is not understood; `colour` is None then.
        curve: what was drawn, in units of the drawing, y upwards; None where only points are known.
    """

    sample: Callable[[float], Array]
    name: str
    colour: Colour | None = None
    layer: str = ""
    dash: Dash = "solid"
    opacity: float = 1.0
    unknown: str = ""
    key: str = ""
    curve: Chain | None = None


@dataclass(frozen=True)
class Strokes:
    """The lines of a file.

    Attributes:
        strokes: the lines.
        unit: millimetres a unit of theirs.
        stated: whether the file says so itself; otherwise `unit` is what its format takes for granted.
        remarks: what was read into the file.
    """

    strokes: list[Stroke]
    unit: float
    stated: bool = True
    remarks: list[str] = field(default_factory=list)


def always(points: Array) -> Callable[[float], Array]:
    """A sampler of a line that is a polyline already: any tolerance gives its own points (k, 2)."""
    return lambda _: points


def drawn_curve(curve: Chain, name: str) -> Callable[[float], Array]:
    """A sampler of a drawn curve that refuses more chords than a line may have.

    Args:
        curve: in units of the drawing.
        name: for the message.

    Returns:
        a function of the tolerance (in that unit) that gives points (k, 2).
    """

    def sample(tolerance: float) -> Array:
        check_limit("vertices", curve.chords(tolerance), name, FileFormatError)
        return curve.sampled(tolerance)

    return sample


def layer_angle(layer: str) -> float:
    """The fold angle, rad, that a layer such as "mountain 62.5deg" says its lines have; nan where it says none."""
    found = re.search(r"(?<![\d.])(\d+(?:\.\d+)?) ?deg\b", layer.lower())
    return math.radians(float(found[1])) if found and float(found[1]) <= 180.0 else math.nan


class Rules:
    """The defaults with a user's own mapping in front of them.

    Args:
        lines: what "#rrggbb", "layer:NAME" and "dash:WORD" stand for; None for the defaults alone.

    Raises:
        FileFormatError: a key or a meaning that is not known.
    """

    def __init__(self, lines: Mapping[str, str] | None = None) -> None:
        """Sort the mapping by what its keys name."""
        self.layers: dict[str, LineKind] = {}
        self.colours: dict[Colour, LineKind] = {}
        self.dashes: dict[str, LineKind] = {}
        self.keys: dict[str, LineKind] = {}
        self._scored: list[str] = []
        for key, word in (lines or {}).items():
            kind = _kind(key, word)
            if key.startswith("layer:"):
                self.layers[key.removeprefix("layer:").strip().lower()] = kind
            elif key.startswith("dash:") and key.removeprefix("dash:") in get_args(Dash):
                self.dashes[key.removeprefix("dash:")] = kind
            elif key.startswith(("handle:", "id:")):
                self.keys[key.lower()] = kind
            elif (colour := parse_colour(key)) is not None:
                self.colours[colour] = kind
            else:
                raise FileFormatError(
                    f'lines: \'{key}\' names no line; use a colour ("#ff0000", "red"), "layer:NAME", '
                    f'"handle:NUMBER" (DXF), "id:NAME" (SVG) or '
                    f'"dash:WORD" with {", ".join(get_args(Dash))}'
                )

    def kind(self, stroke: Stroke) -> LineKind:
        """What a stroke stands for: the mapping first, then layer, colour and dashes.

        Raises:
            FileFormatError: nothing says so.
        """
        own = (
            self.keys.get(stroke.key.lower()),
            self.layers.get(stroke.layer.strip().lower()),
            self.colours.get(stroke.colour) if stroke.colour else None,
            self.dashes.get(stroke.dash),
        )
        for found in (*own, _by_layer(stroke.layer)):
            if found is not None:
                return found
        if stroke.unknown:
            raise FileFormatError(
                f"{stroke.name} has the colour '{stroke.unknown}', which is not understood; write it as #rrggbb, or "
                "put the line on a layer that says what it is (mountain, valley, boundary, ...)"
            )
        by_colour = _by_colour(stroke.colour)
        if by_colour in ("boundary", None) and stroke.dash == "solid" and _scored(stroke.layer):
            self._scored.append(stroke.layer)
            return "mountain"
        if by_colour == "boundary" and stroke.dash in DASHES:  # a drawing in black only
            return DASHES[stroke.dash]
        if by_colour is None:
            shown = "#{:02x}{:02x}{:02x}".format(*(stroke.colour or (0, 0, 0)))
            raise FileFormatError(
                f"{stroke.name} has the colour {shown}, which stands for nothing; say what it is: "
                f'lines = {{ "{shown}" = "mountain" }} (or {", ".join(get_args(LineKind)[1:])})'
            )
        return by_colour

    @property
    def remarks(self) -> list[str]:
        """What was taken for granted by the strokes so far."""
        return [
            f"layer '{layer}' does not say which way its lines fold: taken as mountain; to change that: lines = "
            f'{{ "layer:{layer}" = "valley" }}'
            for layer in dict.fromkeys(self._scored)
        ]


def _scored(layer: str) -> bool:
    return any(word in SCORES for word in re.split(r"[^a-z]+", layer.lower()))


def _kind(key: str, word: str) -> LineKind:
    kinds: tuple[LineKind, ...] = get_args(LineKind)
    for kind in kinds:
        if kind == word:
            return kind
    raise FileFormatError(f"lines: '{key}' = '{word}' is no kind of line; use one of {', '.join(kinds)}")


def _by_layer(layer: str) -> LineKind | None:
    words = [word for word in re.split(r"[^a-z]+", layer.lower()) if word]
    found = {kind for kind, known in LAYERS.items() for word in words if word in known}
    if len(words) > 1 and len(found) > 1:  # "mountain folds, not cut"
        return None
    return found.pop() if len(found) == 1 else None


def _by_colour(colour: Colour | None) -> LineKind | None:
    if colour is None:
        return "boundary"
    hue, saturation, value = colorsys.rgb_to_hsv(*(c / 255.0 for c in colour))
    if value <= 0.25:
        return "boundary"
    if saturation < 0.05 and value > 0.97:
        return "ignore"  # white on white
    if saturation < 0.4:
        return None
    degrees = 360.0 * hue if hue < 0.93 else 360.0 * hue - 360.0
    return next((kind for low, high, kind in HUES if low <= degrees <= high), None)


def parse_colour(text: str) -> Colour | None:
    """The colour of "#ff0000", "#f00" or a common word, or None."""
    word = text.strip().lower()
    if word in WORDS:
        return WORDS[word]
    if re.fullmatch(r"#[0-9a-f]{3}", word):
        word = "#" + "".join(2 * c for c in word[1:])
    if re.fullmatch(r"#[0-9a-f]{6}", word):
        return int(word[1:3], 16), int(word[3:5], 16), int(word[5:7], 16)
    return None


def dash_kind(pattern: list[float]) -> Dash:
    """Name of a pattern of dash and gap lengths, in any one unit (none, or all zero, is solid)."""
    marks = [abs(value) for value in pattern]
    if not marks or max(marks) == 0.0:
        return "solid"
    if len(marks) % 2:
        marks *= 2
    drawn, gaps = marks[::2], marks[1::2]
    if len(drawn) > 1 and max(drawn) > 2.0 * min(drawn):
        return "dashdot"
    return "dotted" if max(drawn) <= 0.35 * max(gaps) else "dashed"
