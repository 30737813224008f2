"""Whatever an SVG file holds, reading it gives a pattern or one clear line."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from meshes import CreasePattern, FileFormatError
from meshes.io import read_drawn, read_pattern

NUMBERS = st.one_of(
    st.integers(-20, 120), st.floats(-1e3, 1e3), st.sampled_from(["", "1e400", "nan", "50%", "x"])
)
COLOURS = st.sampled_from(
    ["red", "blue", "black", "#888", "yellow", "none", "green", "hsl(3,4%,5%)", "url(#a)", ""]
)
FRAME = '<rect width="100" height="100" stroke="black" fill="none"/>'


@st.composite
def shapes(draw: st.DrawFn) -> str:
    look = f'stroke="{draw(COLOURS)}"'
    if draw(st.booleans()):
        look += f' stroke-opacity="{draw(NUMBERS)}" stroke-dasharray="{draw(NUMBERS)} {draw(NUMBERS)}"'
    kind = draw(st.sampled_from(["line", "path", "circle", "polyline", "ellipse"]))
    n = [draw(NUMBERS) for _ in range(8)]
    if kind == "line":
        return f'<line x1="{n[0]}" y1="{n[1]}" x2="{n[2]}" y2="{n[3]}" {look}/>'
    if kind == "path":
        letters = [draw(st.sampled_from("MLCQAZHVhvlcqazST")) for _ in range(4)]
        words = " ".join(f"{a} {x} {y}" for a, x, y in zip(letters, n[::2], n[1::2], strict=True))
        return f'<path d="M{n[0]},{n[1]} {words}" {look}/>'
    if kind == "circle":
        return f'<circle cx="{n[0]}" cy="{n[1]}" r="{n[2]}" {look}/>'
    if kind == "ellipse":
        turn = f'transform="rotate({n[4]}) scale({n[5]})"'
        return f'<ellipse cx="{n[0]}" cy="{n[1]}" rx="{n[2]}" ry="{n[3]}" {turn} {look}/>'
    return f'<polyline points="{n[0]},{n[1]} {n[2]},{n[3]} {n[4]},{n[5]} {n[6]},{n[7]}" {look}/>'


def told(read: Callable[[Path], object], file: Path) -> tuple[object, str]:
    """What was read and nothing, or None and the one line that was told."""
    try:
        return read(file), ""
    except FileFormatError as error:
        message = str(error)
    assert "\n" not in message
    return None, message


@settings(max_examples=60, deadline=None)
@given(
    st.lists(shapes(), max_size=5),
    st.booleans(),
    st.sampled_from(["", 'viewBox="0 0 100 100"', 'width="3in"']),
)
def test_a_pattern_or_one_line(body: list[str], frame: bool, head: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "sheet.svg"
        file.write_text(
            f'<svg xmlns="http://www.w3.org/2000/svg" {head}>{FRAME * frame}{"".join(body)}</svg>'
        )
        for read in (read_pattern, read_drawn):
            found, message = told(read, file)
            assert found is not None or message.startswith(str(file))
            if isinstance(found, CreasePattern):
                assert len(found.rings) >= 1


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=200), st.sampled_from([".svg", ".dxf"]))
def test_any_bytes(content: bytes, suffix: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"sheet{suffix}"
        file.write_bytes(content)
        told(read_pattern, file)
