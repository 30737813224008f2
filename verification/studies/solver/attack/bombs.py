"""Bombs: small files that ask for much. Each gets its one line in 5 s of processor time and 1 GB."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from ezdxf.filemanagement import new

from verification.studies.solver.attack.attempts import Found
from verification.studies.solver.attack.programs import BH, play

MOST_CPU_S, MOST_MB = 5.0, 1000.0
REST = '[sheet]\nt = 0.2\nE = 4000.0\n[[steps]]\nfold = { crease = "all", by = 0.3, Lstar = 40.0 }\n'
ANNULUS = '[pattern]\nkind = "annulus_sector"\nradius = {}\nwidth = 10.0\nangle = 1.0\n'
GMSH = ANNULUS.format(40.0) + '[mesh]\nkind = "gmsh"\n'


def _scene(text: str) -> Callable[[Path], str]:
    def make(folder: Path) -> str:
        (folder / "bomb.toml").write_text(text + REST, encoding="utf-8")
        return "bomb.toml"

    return make


def _svg(inside: Callable[[], str]) -> Callable[[Path], str]:
    def make(folder: Path) -> str:
        head = '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="100mm" viewBox="0 0 100 100">'
        rim = '<rect width="100" height="100" fill="none" stroke="black"/>'
        (folder / "bomb.svg").write_text(f"{head}{rim}{inside()}</svg>", encoding="utf-8")
        return "bomb.svg"

    return make


def _lines(count: int, long: bool) -> str:
    ends = np.random.default_rng(1).uniform(1.0, 99.0, (count, 4))
    if not long:
        ends[:, 2:] = ends[:, :2] + 0.2
    words = '<line x1="{:.4f}" y1="{:.4f}" x2="{:.4f}" y2="{:.4f}" stroke="red"/>'
    return "".join(words.format(*row) for row in ends.tolist())


def _uses(depth: int) -> str:
    groups = [f'<g id="g{i + 1}"><use href="#g{i}"/><use href="#g{i}" x="1"/></g>' for i in range(depth)]
    first = '<g id="g0"><line x1="1" y1="1" x2="9" y2="9" stroke="red"/></g>'
    return f'<defs>{first}{"".join(groups)}</defs><use href="#g{depth}"/>'


def _beziers() -> str:
    numbers = np.random.default_rng(2).uniform(1.0, 99.0, (30_000, 6)).round(3).tolist()
    path = " ".join("C " + " ".join(map(str, row)) for row in numbers)
    return f'<path fill="none" stroke="red" d="M 1 1 {path}"/>'


def _blocks(cyclic: bool) -> Callable[[Path], str]:
    def make(folder: Path) -> str:
        drawing = new()
        drawing.blocks.new("b0").add_line((0, 0), (1, 1))
        for level in range(1, 31):
            block = drawing.blocks.new(f"b{level}")
            for x in (0, 1):
                block.add_blockref(f"b{level - 1}", (x, 0))
        if cyclic:
            drawing.blocks.get("b0").add_blockref("b30", (0, 0))
        drawing.modelspace().add_blockref("b30", (0, 0))
        drawing.saveas(folder / "bomb.dxf")
        return "bomb.dxf"

    return make


def _array(folder: Path) -> str:
    drawing = new()
    drawing.blocks.new("a").add_line((0, 0), (1, 1))
    many = {"row_count": 30_000, "column_count": 30_000, "row_spacing": 1, "column_spacing": 1}
    drawing.modelspace().add_blockref("a", (0, 0), dxfattribs=many)
    drawing.saveas(folder / "bomb.dxf")
    return "bomb.dxf"


def _fold(side: int) -> Callable[[Path], str]:
    def make(folder: Path) -> str:
        at = [(x, y) for x in range(side - 1) for y in range(side - 1)]
        corner = [x * side + y for x, y in at]
        frame = {
            "vertices_coords": [[x, y] for x in range(side) for y in range(side)],
            "faces_vertices": [[c, c + side, c + side + 1, c + 1] for c in corner],
        }
        (folder / "bomb.fold").write_text(json.dumps(frame), encoding="utf-8")
        return "bomb.fold"

    return make


def _megabytes(folder: Path) -> str:
    with (folder / "bomb.svg").open("wb") as file:
        file.write(b'<svg xmlns="http://www.w3.org/2000/svg">')
        file.truncate(200 * 2**20)
    return "bomb.svg"


def _pipe(suffix: str) -> Callable[[Path], str]:
    def make(folder: Path) -> str:
        os.mkfifo(folder / f"bomb.{suffix}")
        return f"bomb.{suffix}"

    return make


LINE = '<line x1="1" y1="1" x2="99" y2="99" stroke="red"{}/>'
LONG_PATH = f'<defs><path id="p" stroke="red" d="M 1 1{" L 2 2" * 10_000}"/></defs>'
TURNED = f'<g transform="{"rotate(1) " * 900}">' * 9 + LINE.format("") * 5_000 + "</g>" * 9
CLIPPED = '<clipPath id="c"><rect width="50" height="50"/></clipPath>'
BOMBS: dict[str, Callable[[Path], str]] = {
    "5,000 radii": _scene(ANNULUS.format([20.0 + i for i in range(5_000)]) + "[mesh]\nalong = 8\n"),
    "100,000 radii": _scene(ANNULUS.format([20.0 + i for i in range(100_000)])),
    "10^9 cells along": _scene(ANNULUS.format(40.0) + "[mesh]\nalong = 1000000000\n"),
    "99,999 rows": _scene(ANNULUS.format(40.0) + "[mesh]\nalong = 8\nrows = 99999\n"),
    "gmsh, size 0.001": _scene(GMSH + "size = 0.001\n"),
    "gmsh, near 1e-6": _scene(GMSH + 'size = 5.0\nnear = { "crease:crease" = 1e-6 }\n'),
    "gmsh, growth 1e-9": _scene(GMSH + 'size = 5.0\nnear = { "crease:crease" = 0.05 }\ngrowth = 1e-9\n'),
    "1,000 sines": _scene('[pattern]\nkind = "sine_tessellation"\ncreases = 1000\namplitude = 0.001\n'),
    "20,000 steps": _scene(ANNULUS.format(40.0) + "[mesh]\nalong = 8\n" + REST[REST.index("[[") :] * 20_000),
    "<use> doubled 20 times": _svg(lambda: _uses(20)),
    "<use> of itself": _svg(lambda: '<g id="a"><use href="#a"/></g>'),
    "3,000 lines across": _svg(lambda: _lines(3_000, True)),
    "30,000 short lines": _svg(lambda: _lines(30_000, False)),
    "30,000 Beziers": _svg(_beziers),
    "a path of 10,000 pieces <use>d 5,000 times": _svg(lambda: LONG_PATH + '<use href="#p"/>' * 5_000),
    "8,100 transforms of 5,000 lines": _svg(lambda: TURNED),
    "16,000 style rules for 5,000 lines": _svg(
        lambda: f"<style>{'*{a:b}' * 16_000}</style>{LINE.format('') * 5_000}"
    ),
    "5,000 clipped lines": _svg(lambda: CLIPPED + LINE.format(' clip-path="url(#c)"') * 5_000),
    "SVG of 200 MB": _megabytes,
    "blocks doubled 30 times": _blocks(False),
    "cyclic blocks": _blocks(True),
    "MINSERT of 9e8": _array,
    "FOLD of 160,000 faces": _fold(401),
    "a pipe as a scene": _pipe("toml"),
    "a pipe as a drawing": _pipe("svg"),
    "a pipe as a FOLD file": _pipe("fold"),
}


def bomb(folder: Path, random: np.random.Generator) -> Found:
    """All bombs, one after another, in random order."""
    failures, worst = [], 0.0
    names = list(BOMBS)
    for number in random.permutation(len(names)):
        name, place = names[number], folder / str(number)
        place.mkdir()
        ended = play((*BH, "check", BOMBS[name](place), "--no-picture"), place)
        if ended.code != 2 or ended.lines != 1:
            failures.append(
                f"{name}: exit code {ended.code}, {ended.lines} lines: {ended.said.strip()[:200]}"
            )
        if ended.cpu_s > MOST_CPU_S or ended.megabytes > MOST_MB:
            failures.append(f"{name}: {ended.cpu_s:.1f} s of processor time, {ended.megabytes:.0f} MB")
        worst = max(worst, ended.cpu_s)
        for file in place.iterdir():
            file.unlink()
    return Found(len(names), failures, worst)
