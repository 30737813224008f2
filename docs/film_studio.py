"""The recording of the studio in the README: `python docs/film_studio.py`.

A browser without a screen does what a person does in a minute: drops a drawing, folds it, pulls on it, pinches it, and
saves the cut file and the scene. The pointer and the lines below are drawn into the page for the recording only.
"""

from __future__ import annotations

import io
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from bh.commands.run import solve  # noqa: E402 - found beside this file
from bh.scene.load import load_scene  # noqa: E402
from bh.studio.opening import Opened  # noqa: E402 - found beside this file
from tests.unit.browsers import opened  # noqa: E402

DRAWING = ROOT / "examples" / "wave.svg"
TARGET = ROOT / "docs" / "images" / "studio.gif"
SIZE = {"width": 1180, "height": 700}
WIDE, COLOURS, MS = 800, 160, 140
REPEATED = "bh run repeats it to the digit"
BEHIND_A_SNAP = "bh run --resume begins in this state, solves it anew"
ROUNDED = 1e-4  # mm; the window's positions are of single precision
DRESS = """() => {
  const put = (id, style) => {
    const item = document.createElement("div");
    Object.assign(item, { id, style: `position: fixed; z-index: 9; ${style}` });
    document.body.append(item);
  };
  put("film-said", `left: 0; right: 0; bottom: 0; padding: 10px 16px; color: #fff;
    font: 600 20px system-ui; background: #1b1f24`);
  put("film-hand", `width: 22px; height: 22px; border-radius: 50%; border: 3px solid #b06000; background: #ffb84d99;
    transform: translate(-50%, -50%); left: -50px; pointer-events: none`);
  addEventListener("mousemove", (e) => {
    const { style } = document.getElementById("film-hand");
    style.left = `${e.clientX}px`; style.top = `${e.clientY}px`;
  }, true);
  document.querySelector("main").style.paddingBottom = "56px";
  document.getElementById("message").style.bottom = "64px";
}"""
JAW = """(side) => {
  const { middle, along, gap } = studio.head.pinches[0];
  return studio.spot(middle.map((value, c) => value + 0.5 * side * gap * along[c]));
}"""
DROP = """([name, text]) => {
  const data = new DataTransfer();
  data.items.add(new File([text], name, { type: "image/svg+xml" }));
  document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
}"""


class Film:
    """Pictures of a page, one after another."""

    def __init__(self, page: Any) -> None:
        """Nothing was taken yet."""
        self.page = page
        self.pictures: list[bytes] = []

    def say(self, text: str, times: int = 0) -> None:
        """A line below, held for some pictures."""
        self.page.evaluate("(text) => { document.getElementById('film-said').textContent = text; }", text)
        self.take(times)

    def take(self, times: int = 1) -> None:
        """The same picture for a while."""
        if times:
            self.pictures += [self.page.screenshot()] * times

    def rest(self, condition: str = "true") -> None:
        """Until the sheet is in equilibrium with what is asked."""
        self.page.wait_for_function(
            f"(() => {{ const head = studio.head; return head?.rest && ({condition}); }})()"
        )

    def stroke(self, start: list[float], end: list[float], steps: int) -> None:
        """The pointer pressed at a point, moved and left pressed, with a picture a step."""
        mouse = self.page.mouse
        mouse.move(*start)
        self.take(2)
        mouse.down()
        for k in range(1, steps + 1):
            mouse.move(*(a + (b - a) * k / steps for a, b in zip(start, end, strict=True)))
            self.page.wait_for_timeout(150)
            self.take()

    def write(self, file: Path) -> None:
        """As a GIF whose pictures that are the same are one."""
        from PIL import Image

        images = [Image.open(io.BytesIO(data)).convert("RGB") for data in self.pictures]
        small = [
            each.resize((WIDE, round(WIDE * each.height / each.width)), Image.Resampling.LANCZOS)
            for each in images
        ]
        every = Image.new("RGB", (WIDE, small[0].height * 8))
        for k in range(8):  # colours of the whole film
            every.paste(small[(len(small) - 1) * k // 7], (0, k * small[0].height))
        palette = every.quantize(COLOURS, dither=Image.Dither.NONE)
        frames = [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in small]
        frames[0].save(file, save_all=True, append_images=frames[1:], duration=MS, loop=0, optimize=True)


@contextmanager
def window() -> Iterator[Film]:
    """A page with the studio, dressed for the recording."""
    served = Opened()
    with opened() as chromium:
        page = chromium.new_context(viewport=SIZE, bypass_csp=True, accept_downloads=True).new_page()
        page.set_default_timeout(120_000)
        page.goto(served.address)
        page.wait_for_function("window.studio?.head")
        page.evaluate(DRESS)
        page.wait_for_timeout(500)
        yield Film(page)
    served.close()


def corner(film: Film, sign: int) -> list[float]:
    """Where a corner of the sheet is seen, a little inside of its rim: the one farthest to the right or left."""
    x, y = film.page.evaluate(
        f"""() => {{
          const n = studio.points.length / 3, at = Array.from({{ length: n }}, (_, k) => studio.place(k));
          const far = at.reduce((a, b) => ({sign} * (a[0] + 0.3 * a[1] - b[0] - 0.3 * b[1]) >= 0 ? a : b));
          const middle = [0, 1].map((c) => at.reduce((sum, p) => sum + p[c], 0) / n);
          return far.map((value, c) => value + 0.03 * (middle[c] - value));
        }}"""
    )
    return [x, y]


def play(film: Film) -> None:
    """What a person does."""
    page = film.page
    film.say("1  Drop a drawing: SVG, DXF, FOLD, .cp", 7)
    page.evaluate(DROP, [DRAWING.name, DRAWING.read_text(encoding="utf-8")])
    page.wait_for_function(f"studio.sheet.name === '{DRAWING.name}'")
    film.rest()
    film.take(5)
    film.say("2  Fold it: every picture is an equilibrium", 1)
    for value in range(3, 49, 3):
        page.locator("#percent").fill(str(value))
        film.rest(
            f"Math.abs(Object.values(head.asked)[0] / studio.sheet.creases[0].full - {value / 100}) < 0.01"
        )
        film.take()
    film.take(4)
    film.say("3  Pull on it, and read the newton", 1)
    x, y = corner(film, 1)
    film.stroke([x, y], [x + 50.0, y - 80.0], 12)
    film.rest()
    film.take(8)
    page.mouse.up()
    page.locator("#let-go").click()
    film.rest("Object.keys(head.forces).length === 0")
    print(f"behind a snap after the pull: {page.evaluate('studio.head.left')}")
    film.say("4  Pinch two points", 1)
    page.locator("#hand-pinch").check()
    left, right = corner(film, -1), corner(film, 1)
    film.stroke(left, right, 4)
    page.mouse.up()
    film.rest("head.pinches.length === 1")
    film.take(2)
    jaw, middle = page.evaluate(JAW, 1), page.evaluate(JAW, 0)
    film.stroke(jaw, [j + 0.35 * (m - j) for j, m in zip(jaw, middle, strict=True)], 8)
    film.rest("head.pinches[0].force > 0")
    film.take(8)
    page.mouse.up()
    left = page.evaluate("studio.head.left")
    for what, text in (
        ("flat.dxf", "5  Save the flat pattern to cut ..."),
        ("scene", f"6  ... and the scene: {BEHIND_A_SNAP if left else REPEATED}"),
    ):
        film.say(text)
        with page.expect_download() as waiting:
            page.locator("#export").select_option(what)
        page.locator("#message", has_text="is saved").wait_for()
        film.take(8)
    repeated(Path(waiting.value.path()), page.evaluate("Array.from(studio.points)"))


def repeated(file: Path, points: list[float]) -> None:
    """Run the saved scene and say how far it ends from what is in the film.

    Args:
        file: .zip of the scene.
        points: (3 n,) of the window, mm, in single precision.

    Raises:
        SystemExit: it ends elsewhere than the film says.
    """
    with tempfile.TemporaryDirectory() as place, zipfile.ZipFile(file) as archive:
        archive.extractall(place)
        scene = load_scene(next(Path(place).glob("*.toml")))
        out = Path(place) / f"{scene.name}-out"
        path = solve(scene, out, resume=out.is_dir(), estimate=False).path
    off = float(np.abs(path[-1].points.ravel() - np.array(points)).max())
    print(
        f"bh run ends as {path.outcome}, {path[-1].energy.total:.6g} N mm, at most {off:.2g} mm from the film"
    )
    if not path.reached or off > ROUNDED:
        raise SystemExit("the film's last caption is wrong; the film is not written")


def main() -> None:
    """Record it, write it, say how large it is."""
    with window() as film:
        play(film)
        film.write(TARGET)
    print(f"{TARGET}: {len(film.pictures)} pictures, {TARGET.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
