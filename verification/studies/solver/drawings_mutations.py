"""Mutations of the project's own drawings by a seed, and what the readers make of them: a sheet, or one clear line.

Mutation number n is the same on every machine: a file, and one to four small accidents in it, such as numbers that
are far too large, words that are gone or come twice, a piece of another file of the kind, bytes that are no text.
"""

from __future__ import annotations

import re
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import meshes
from meshes.errors import InputError
from meshes.io import read_fold, write_fold, write_pattern
from meshes.io.drawing import PATTERNS, read_drawn, read_pattern

MOST = 4  # accidents in a file
SPAN = 40  # bytes of a piece that is lost, or comes twice, at the most
NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[A-Za-z_:]+")
STRANGE = (b"", *b"0 -1 1e-12 1e12 1e308 -1e400 1e6 nan inf 0.5 180 7 99999999999 1e-320 % 1,2 --3".split())
BYTES = (b"\x00", b"\xff", b"<", b">", b'"', b"{", b"]", b"\n", b"&", b";", b"\r\n", b"\xc3\xa4")
# what the project's own files have not: transforms, symbols, styles, arcs
SHAPES = """<svg xmlns="http://www.w3.org/2000/svg" width="120mm" height="80mm" viewBox="0 0 120 80" fill="none">
<style>.a{stroke:red} .b{stroke:rgb(0 0 255);stroke-dasharray:3 1}</style>
<defs><symbol id="s" viewBox="0 0 10 10"><path d="M0,5 Q5,2 10,5"/></symbol></defs>
<rect width="120" height="80" rx="4" stroke="black"/>
<g transform="translate(10 5) rotate(3)"><path class="a" d="M0,20 C20,40 40,0 60,20 S80,30 90,22 a5,8 20 0 1 9,-2"/></g>
<use href="#s" x="20" y="30" width="60" height="20" class="b"/>
<circle cx="60" cy="62" r="6" stroke="black"/><ellipse cx="30" cy="60" rx="8" ry="3" stroke="#00ff00"/>
<polyline points="5,70 20,66 35,71 50,69" stroke="blue" stroke-opacity="0.5"/>
<line x1="70" y1="70" x2="90" y2="72" stroke="yellow"/>
</svg>"""
CP = "1 -9 -9 9 -9\n1 9 -9 9 9\n1 9 9 -9 9\n1 -9 9 -9 -9\n2 -9 0 9 0\n3 0 -9 0 9"
OPX = """<?xml version="1.0"?><java class="java.beans.XMLDecoder"><object class="oripa.DataSet"><void property="lines">
<array class="oripa.OriLineProxy" length="3">{}</array></void></object></java>"""
LINE = """<void index="{0}"><object class="oripa.OriLineProxy"><void property="type"><int>{1}</int></void>
<void property="x0"><double>{2}</double></void><void property="x1"><double>{3}</double></void>
<void property="y0"><double>{4}</double></void><void property="y1"><double>{5}</double></void></object></void>"""
ORIPA = (
    (1, -9, 9, -9, -9),
    (1, 9, 9, -9, 9),
    (1, 9, -9, 9, 9),
    (1, -9, -9, 9, -9),
    (2, -9, 9, 0, 1),
    (3, -9, 0, 2, 9),
)


@dataclass(frozen=True)
class Read:
    """What the readers made of a mutation.

    Attributes:
        file: that was mutated.
        sheet: whether any of them made a sheet of it.
        fault: what went wrong, "" where nothing did: an error that is no clear line, a sheet that is none.
        seconds: processor time of the slowest reader.
    """

    file: str
    sheet: bool
    fault: str
    seconds: float


def seeds(folder: Path, scratch: Path) -> list[tuple[str, bytes]]:
    """Names and contents of the files to mutate, of every kind that is read.

    Args:
        folder: of own drawings.
        scratch: where those that are made are written first.
    """
    files = sorted(file for file in folder.iterdir() if file.suffix in PATTERNS)
    found = [(file.name, file.read_bytes()) for file in files]
    pattern = meshes.annulus_sector([60.0, 80.0], 10.0, 1.2, ["mountain", "valley"])
    for suffix in (".dxf", ".svg"):
        write_pattern(scratch / f"sector{suffix}", pattern)
    write_fold(scratch / "sector.fold", meshes.structured(pattern, along=4, rows=1))
    found += [(file.name, file.read_bytes()) for file in sorted(scratch.glob("sector.*"))]
    lines = "".join(LINE.format(k, *line) for k, line in enumerate(ORIPA))
    texts = {"shapes.svg": SHAPES, "square.cp": CP, "square.opx": OPX.format(lines)}
    return found + [(name, text.encode()) for name, text in texts.items()]


def mutant(files: Sequence[tuple[str, bytes]], number: int) -> tuple[str, bytes]:
    """Mutation of a number: the name of its file, and its content.

    Args:
        files: see `seeds`.
        number: from 0; files take turns.
    """
    chance = np.random.default_rng(number)
    name, text = files[number % len(files)]
    kin = [other for title, other in files if Path(title).suffix == Path(name).suffix]
    for _ in range(min(MOST, int(chance.geometric(0.5)))):
        how = _ACCIDENTS[int(chance.integers(len(_ACCIDENTS)))]
        text = how(text, chance, kin[int(chance.integers(len(kin)))])
    return name, text


def read(name: str, content: bytes) -> Read:
    """What the readers make of a file.

    Args:
        name: of it; its suffix says which readers.
        content: of it.
    """
    readers: list[Callable[[Path], object]] = [read_pattern, read_drawn]
    if name.endswith(".fold"):
        readers.append(read_fold)
    sheet, slowest = False, 0.0
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / name
        file.write_bytes(content)
        for reader in readers:
            began = time.process_time()
            fault = ""
            try:
                reader(file)
                sheet = True
            except InputError as error:
                text = str(error)
                if "\n" in text or not text.isprintable() or len(text) > len(str(file)) + 500:
                    fault = f"no clear line: {text[:200]!r}"
            except Exception as error:  # whatever else it is: a fault
                fault = f"{type(error).__name__}: {str(error)[:200]!r}"
            slowest = max(slowest, time.process_time() - began)
            if fault:
                return Read(name, sheet, f"{getattr(reader, '__name__', '')}: {fault}", slowest)
    return Read(name, sheet, "", slowest)


def _place(text: bytes, chance: np.random.Generator) -> tuple[int, int]:
    start = int(chance.integers(len(text) + 1))
    return start, min(len(text), start + int(chance.integers(1, SPAN + 1)))


def _number(text: bytes, chance: np.random.Generator, _: bytes) -> bytes:
    """A number becomes another, or a strange one."""
    found = list(NUMBER.finditer(text))
    if not found:
        return text
    one = found[int(chance.integers(len(found)))]
    if chance.random() < 0.6:
        new = b"%.6g" % (float(one[0]) * chance.normal(1.0, 0.3))
    else:
        new = STRANGE[int(chance.integers(len(STRANGE)))]
    return text[: one.start()] + new + text[one.end() :]


def _exchanged(text: bytes, chance: np.random.Generator, kin: bytes) -> bytes:
    """A word becomes one of a file of the kind."""
    found, others = list(WORD.finditer(text)), [word[0] for word in WORD.finditer(kin)]
    if not found or not others:
        return text
    one = found[int(chance.integers(len(found)))]
    return text[: one.start()] + others[int(chance.integers(len(others)))] + text[one.end() :]


def _lost(text: bytes, chance: np.random.Generator, _: bytes) -> bytes:
    start, end = _place(text, chance)
    return text[:start] + text[end:]


def _twice(text: bytes, chance: np.random.Generator, _: bytes) -> bytes:
    start, end = _place(text, chance)
    return text[:end] + text[start:end] + text[end:]


def _foreign(text: bytes, chance: np.random.Generator, kin: bytes) -> bytes:
    """A piece of a file of the kind gets in."""
    start, end = _place(kin, chance)
    at = int(chance.integers(len(text) + 1))
    return text[:at] + kin[start:end] + text[at:]


def _no_text(text: bytes, chance: np.random.Generator, _: bytes) -> bytes:
    at = int(chance.integers(len(text) + 1))
    return text[:at] + BYTES[int(chance.integers(len(BYTES)))] + text[at:]


def _cut_short(text: bytes, chance: np.random.Generator, _: bytes) -> bytes:
    """The end is missing, where chance is small: such files are all alike."""
    return text[: int(chance.integers(len(text) + 1))] if chance.random() < 0.2 else _number(text, chance, _)


_ACCIDENTS = (
    _number,
    _number,
    _number,
    _number,
    _number,
    _exchanged,
    _lost,
    _twice,
    _foreign,
    _no_text,
    _cut_short,
)
