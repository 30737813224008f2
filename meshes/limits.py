"""Limits on what a file may ask for, checked before time or memory is taken. The one place where they are written.

Within them everything that is refused is refused within seconds; what is larger and meant is let in by a variable of
the environment for each limit, such as BH_LIMIT_CREASES=5000 (worker processes inherit it).
"""

from __future__ import annotations

import os
from dataclasses import dataclass, fields

from meshes.errors import InputError

PREFIX = "BH_LIMIT_"


@dataclass(frozen=True)
class Limits:
    """What a pattern, a mesh and a drawing may have at the most.

    Attributes:
        creases: of a pattern of the library, side by side.
        pieces: of a crease that is made of arcs.
        steps: load steps of a scene.
        entries: of a scene, a sweep or a target: lines, keys and values of lists, some microseconds each to parse.
        triangles: of a mesh; gmsh makes some twenty thousand a second, a million take gigabytes to solve.
        entities: of a drawing's file, every <use> and block written out; rows of a .cp file; vertices, edges or
            faces of a frame of a FOLD file.
        frames: of a FOLD file; each may inherit from all the others.
        attributes: of an SVG file, those of groups counted again for every element in them, since they are handed down.
        transforms: of an SVG file in the same way; some 50 microseconds each to read.
        style_characters: of the style sheets of an SVG file.
        attribute_characters: of one attribute of an SVG file that is no path, and no editor's own.
        clips: elements of an SVG file that are clipped, some 3 ms each, and pieces that are left of them.
        clip_vertices: of clip paths, counted again for every line that they cut; up to 30 microseconds each.
        lines: of a drawing, without those that are ignored.
        vertices: of a drawing's lines, once curves are chords; numbers of its paths, values of a DXF file.
        crossings: of a drawing's lines where none has a node.
        loose_ends: of a drawing's lines within a face, some milliseconds each to tie to its rim.
        control_points: of one spline.
        solid_triangles: of a body that presses, read from a file; some microseconds each in every increment.
        megabytes: of a drawing's file, unpacked.
        stored_megabytes: of a path file, a journal or a data set, unpacked; most of them are held in memory.
        stored_rows: of a table of a path file (states) or a journal (points).
    """

    creases: int = 1_000
    pieces: int = 1_000
    steps: int = 1_000
    entries: int = 100_000
    triangles: int = 250_000
    entities: int = 20_000
    frames: int = 1_000
    attributes: int = 1_000_000
    transforms: int = 60_000
    style_characters: int = 100_000
    attribute_characters: int = 10_000
    clips: int = 1_000
    clip_vertices: int = 50_000
    lines: int = 10_000
    vertices: int = 100_000
    crossings: int = 10_000
    loose_ends: int = 1_000
    control_points: int = 2_000
    solid_triangles: int = 50_000
    megabytes: int = 32
    stored_megabytes: int = 500
    stored_rows: int = 100_000


def limits() -> Limits:
    """The limits that hold in this process.

    Raises:
        InputError: a variable of the environment that is no whole number from 1.
    """
    return Limits(**{field.name: _limit(field.name) for field in fields(Limits)})


def _limit(name: str) -> int:
    word = os.environ.get(PREFIX + name.upper(), "").strip()
    if not word:
        return int(getattr(Limits, name))
    if not word.isdecimal() or len(word) > 18 or int(word) < 1:
        raise InputError(f"{PREFIX}{name.upper()} = {word[:40]!r} cannot be; give a whole number from 1")
    return int(word)


def check_limit(name: str, count: float, what: str, error: type[InputError]) -> None:
    """Refuse what is more than its limit.

    Args:
        name: of the limit, a field of `Limits`.
        count: how many there are, or would be.
        what: what would have so many, for the message: "this pattern".
        error: the kind of error to raise.

    Raises:
        InputError: of the kind `error`, if there are more.
    """
    most = _limit(name)
    if count > most:
        some = f"{count:,.0f}" if count < 1e6 else f"some {count:.2g}"
        raise error(
            f"{what} has {some} {name.replace('_', ' ')}, more than {most:,}; ask for fewer, or raise the limit: "
            f"{PREFIX}{name.upper()}=..."
        )
