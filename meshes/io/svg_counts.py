"""What elements of an SVG file carry, counted before svgelements reads them: attributes are handed down in groups."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple
from xml.etree.ElementTree import Element

from meshes.errors import FileFormatError
from meshes.limits import check_limit

LONG = 30  # characters of a style or a transform count as one: texts are split and joined on the way down
PLAIN = 1000  # characters of an attribute that are not looked at
NUMBERS = ("d", "points")
_TRANSFORM = re.compile(r"(?<![\w-])transform\s*:", re.IGNORECASE)


class Load(NamedTuple):
    """What an element hands down to those in it, or a style sheet to an element.

    Attributes:
        attributes: names with a value.
        transforms: functions of transforms, or `LONG` characters of them.
    """

    attributes: int = 0
    transforms: int = 0

    def __add__(self, other: object) -> Load:
        """Both together."""
        if not isinstance(other, Load):
            return NotImplemented
        return Load(self.attributes + other.attributes, self.transforms + other.transforms)


NOTHING = Load()


@dataclass(frozen=True)
class Rules:
    """The style sheets of a drawing, in the plain form that svgelements' patterns read in linear time.

    Attributes:
        text: of each <style> element, in their order.
        clips: clip paths by the class that has them, as Illustrator writes them.
        loads: what a selector puts on an element.
    """

    text: list[str] = field(default_factory=list)
    clips: dict[str, str] = field(default_factory=dict)
    loads: dict[str, Load] = field(default_factory=dict)


def style_rules(sheets: Sequence[str]) -> Rules:
    """Read style sheets.

    Args:
        sheets: the text of each <style> element.

    Raises:
        FileFormatError: they are longer than the limit, or have brackets in brackets, too many to be read.
    """
    check_limit(
        "style_characters", sum(map(len, sheets)), "the style sheets of this drawing", FileFormatError
    )
    rules = Rules()
    for sheet in sheets:
        plain = []
        try:
            found = list(_plain(sheet))
        except RecursionError as error:
            raise FileFormatError(
                "the style sheets have brackets in brackets; save it as plain SVG"
            ) from error
        for selectors, declared in found:
            text = ";".join(f"{name}:{value}" for name, value in declared)
            plain.append(f"{','.join(selectors)}{{{text}}}")
            load = Load(len(declared) + len(text) // LONG, _words(text) if _TRANSFORM.search(text) else 0)
            for selector in selectors:
                rules.loads[selector] = rules.loads.get(selector, NOTHING) + load
                for name, value in declared:
                    if name.lower() == "clip-path":
                        rules.clips[selector.removeprefix(".")] = value
        rules.text.append("\n".join(plain))
    return rules


def _plain(sheet: str) -> Iterator[tuple[list[str], list[tuple[str, str]]]]:
    """Selectors and declarations of the rules of a sheet; what has braces in it is no rule that lines need."""
    import tinycss2

    for rule in tinycss2.parse_stylesheet(sheet, skip_comments=True, skip_whitespace=True):
        if rule.type != "qualified-rule":
            continue
        declared = [
            (item.name, tinycss2.serialize(item.value).strip() + (" !important" if item.important else ""))
            for item in tinycss2.parse_blocks_contents(rule.content)
            if item.type == "declaration"
        ]
        declared = [(name, value) for name, value in declared if value and not re.search(r"[{};]", value)]
        selectors = [word.strip() for word in tinycss2.serialize(rule.prelude).split(",")]
        selectors = [word for word in selectors if word and not re.search(r"[{};]", word)]
        if declared and selectors:
            yield selectors, declared


@dataclass
class Counter:
    """Counts what the elements of a drawing carry, with what is handed down to them.

    Attributes:
        rules: the style sheets.
        total: of all elements so far.
        numbers: of the paths of all elements so far, about.
    """

    rules: Rules
    total: Load = NOTHING
    numbers: int = 0

    def carried(self, element: Element, tag: str, above: Load) -> Load:
        """What an element hands down.

        Args:
            element: to be read.
            tag: of it, without its namespace.
            above: what is handed down to it.

        Raises:
            FileFormatError: all elements so far carry more than the limits.
        """
        for key, value in list(element.attrib.items()):
            if len(value) > PLAIN and key not in NUMBERS:
                self._check_length(element, key, value)
        numbers = max(_separators(element.get(key, "")) for key in NUMBERS)
        self.numbers += numbers
        check_limit("vertices", self.numbers, "this drawing, every <use> written out,", FileFormatError)
        style, classes = element.get("style", ""), element.get("class", "").split()
        own = Load(
            len(element.attrib) + style.count(";") + len(style) // LONG + len(classes),
            _words(element.get("transform", "")) + (_words(style) if _TRANSFORM.search(style) else 0),
        )
        names = ["*", tag, f"#{element.get('id')}"]
        names += [name for word in classes for name in (f".{word}", f"{tag}.{word}")]
        for name in names:
            own += self.rules.loads.get(name, NOTHING)
        down = above + own
        self.total += down
        what = "this drawing, counted again for every element in the groups that have them,"
        check_limit("attributes", self.total.attributes, what, FileFormatError)
        check_limit("transforms", self.total.transforms, what, FileFormatError)
        return down

    @staticmethod
    def _check_length(element: Element, key: str, value: str) -> None:
        """Refuse long texts where numbers and names belong; what is an editor's own is dropped."""
        if key.startswith(("{", "data-")) or key in ("href", "id"):
            del element.attrib[key]
            return
        what = f"the attribute '{key[:40]}' of an element"
        check_limit("attribute_characters", len(value), what, FileFormatError)


def _separators(text: str) -> int:
    """About how many numbers a path has."""
    return max(text.count(" ") + text.count(","), text.count("."), text.count("-"))


def _words(text: str) -> int:
    return max(text.count("("), len(text) // LONG)
