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

from bh.plotting.frames import evenly
from bh.plotting.offscreen import PlotError
from bh.plotting.pictures import moving_pictures
from meshes.io.export import replacing

if TYPE_CHECKING:
    from bh.paths.path import Path

ENDINGS = (".gif", ".mp4")
HOLD = 1.0  # s that the last frame is shown for
MOST = 5000  # frames


def animation(
    path: Path,
    file: str | os.PathLike[str],
    colour: str | None = "bending",
    size: tuple[int, int] = (800, 600),
    *,
    fps: int = 24,
    states: Sequence[int] | None = None,
    frames: int | None = None,
) -> FilePath:
    """Write a path as a moving picture, seen from one place and on one scale of colours.

    Frames are at even distances along the motion; those between two states of the path are solved
    (`bh.plotting.frames.evenly`).

    Args:
        path: solved, as far as it goes.
        file: to write, .gif or .mp4; appears whole or not at all.
        colour: as for `picture`.
        size: width and height, pixels.
        fps: frames a second, 1 to 50.
        states: show just these states of the path, a frame each, in place of even frames.
        frames: how many, 2 to 5000; two seconds of them unless given.

    Returns:
        The absolute path of the file.

    Raises:
        PlotError: no states, a size, rate or number of frames that cannot be, or no ffmpeg for .mp4.
        FileFormatError: the file cannot be written.
    """
    target = FilePath(file)
    ending = target.suffix.lower()
    if ending not in ENDINGS:
        raise PlotError(f"animation '{target}' is neither .gif nor .mp4; name it so")
    if not 1 <= fps <= 50:
        raise PlotError(f"fps = {fps} cannot be; give 1 to 50")
    if frames is not None and (states is not None or not 2 <= frames <= MOST):
        raise PlotError(f"frames = {frames} cannot be; give 2 to {MOST}, and no states beside them")
    if len(path) == 0 or (states is not None and not states):
        raise PlotError("the path has no states to show; trace the model first")
    program = _ffmpeg() if ending == ".mp4" else ""
    shown = evenly(path, frames or 2 * fps) if states is None else [path[index] for index in states]
    # an even number of pixels, as video takes no other
    pictures = moving_pictures(shown, colour, (size[0] // 2 * 2, size[1] // 2 * 2))
    pictures += [pictures[-1]] * round(HOLD * fps)
    with replacing(target) as temporary:
        if ending == ".gif":
            _gif(pictures, temporary, fps)
        else:
            _mp4(pictures, temporary, fps, program)
    return target.resolve()


def _gif(pictures: Sequence[NDArray[np.uint8]], file: FilePath, fps: int) -> None:
    from PIL import Image

    # a GIF counts in hundredths of a second: some frames stand one longer, so that the rate is kept
    ends = [round(100 * (index + 1) / fps) for index in range(len(pictures))]
    durations = [10 * (end - begin) for begin, end in zip([0, *ends], ends, strict=False)]
    images = [Image.fromarray(picture).quantize(128, dither=Image.Dither.NONE) for picture in pictures]
    images[0].save(
        file,
        format="GIF",
        save_all=True,
        append_images=images[1:],
        duration=durations,
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
