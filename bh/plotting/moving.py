"""Folding as a moving picture: GIF by Pillow, MP4 by ffmpeg."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path as FilePath
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bh.plotting.offscreen import PlotError
from meshes.io.export import replacing

if TYPE_CHECKING:
    from bh.paths.path import Path

ENDINGS = (".gif", ".mp4")
HOLD = 8  # frames that the last one is shown for


def animation(
    path: Path,
    file: str | os.PathLike[str],
    colour: str | None = "bending",
    size: tuple[int, int] = (800, 600),
    *,
    fps: int = 10,
    states: Sequence[int] | None = None,
) -> FilePath:
    """Write the states of a path as a moving picture, seen from one place and on one scale of colours.

    Args:
        path: solved, as far as it goes.
        file: to write, .gif or .mp4; appears whole or not at all.
        colour: as for `picture`.
        size: width and height, pixels.
        fps: states a second, 1 to 50.
        states: which states, all by default.

    Returns:
        The absolute path of the file.

    Raises:
        PlotError: no states, a size or rate that cannot be, or no ffmpeg for .mp4.
        FileFormatError: the file cannot be written.
    """
    target = FilePath(file)
    ending = target.suffix.lower()
    if ending not in ENDINGS:
        raise PlotError(f"animation '{target}' is neither .gif nor .mp4; name it so")
    if not 1 <= fps <= 50:
        raise PlotError(f"fps = {fps} cannot be; give 1 to 50")
    chosen = list(range(len(path))) if states is None else list(states)
    if not chosen:
        raise PlotError("the path has no states to show; trace the model first")
    program = _ffmpeg() if ending == ".mp4" else ""
    pictures = _pictures(path, chosen, colour, size)
    pictures += [pictures[-1]] * HOLD
    with replacing(target) as temporary:
        if ending == ".gif":
            _gif(pictures, temporary, fps)
        else:
            _mp4(pictures, temporary, fps, program)
    return target.resolve()


def _pictures(
    path: Path, chosen: Sequence[int], colour: str | None, size: tuple[int, int]
) -> list[NDArray[np.uint8]]:
    """(height, width, 3) of every state."""
    from bh.plotting.pictures import moving_pictures

    # an even number of pixels, as video takes no other
    return moving_pictures([path[index] for index in chosen], colour, (size[0] // 2 * 2, size[1] // 2 * 2))


def _gif(pictures: Sequence[NDArray[np.uint8]], file: FilePath, fps: int) -> None:
    from PIL import Image

    images = [Image.fromarray(picture).quantize(128, dither=Image.Dither.NONE) for picture in pictures]
    images[0].save(
        file,
        format="GIF",
        save_all=True,
        append_images=images[1:],
        duration=1000 // fps,
        loop=0,
        optimize=False,
    )


def _ffmpeg() -> str:
    """The ffmpeg of the system, or that of the package imageio-ffmpeg."""
    found = shutil.which("ffmpeg")
    if found:
        return found
    try:
        from imageio_ffmpeg import get_ffmpeg_exe
    except ImportError as error:
        raise PlotError(
            "an .mp4 needs ffmpeg; pip install imageio-ffmpeg, or name the animation .gif"
        ) from error
    program: str = get_ffmpeg_exe()
    return program


def _mp4(pictures: Sequence[NDArray[np.uint8]], file: FilePath, fps: int, program: str) -> None:
    height, width, _ = pictures[0].shape
    options = f"-y -loglevel error -f rawvideo -pix_fmt rgb24 -s {width}x{height} -r {fps} -i - -an".split()
    options += ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-f", "mp4", str(file)]
    raw = b"".join(picture.tobytes() for picture in pictures)
    done = subprocess.run([program, *options], input=raw, capture_output=True, check=False)
    if done.returncode != 0:
        messages = done.stderr.decode(errors="replace").strip().splitlines()
        raise PlotError(
            f"ffmpeg could not write the animation ({messages[-1] if messages else 'no reason given'})"
        )
