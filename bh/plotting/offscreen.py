"""Drawing by VTK without a window, and whether a window could be opened at all.

On Linux drawing needs EGL, OSMesa or an X server. Which of them works is found out before VTK is asked, because
VTK ends the whole process where it finds none. Nothing heavy is imported until something is drawn.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meshes.errors import InputError

if TYPE_CHECKING:
    from pyvista import Plotter

Array = NDArray[np.float64]


class PlotError(InputError):
    """A picture, curve or series that cannot be made or written."""


def render(size: tuple[int, int], draw: Callable[[Plotter], None]) -> Array:
    """What `draw` puts into a pyvista plotter, as a picture (height, width, 3) with values in [0, 1].

    Args:
        size: width and height, pixels.
        draw: puts things into the plotter and sets its camera.

    Raises:
        PlotError: there is no library to draw with.
    """
    width, height = size
    with _environment():
        import pyvista as pv

        # drawn twice as large and averaged: the same smooth lines from every driver
        plotter = pv.Plotter(off_screen=True, window_size=[2 * width, 2 * height], lighting="none")
        try:
            plotter.add_light(pv.Light(light_type="headlight", intensity=0.6))
            plotter.add_light(pv.Light(position=(-0.8, 0.9, 0.7), light_type="camera light", intensity=0.55))
            draw(plotter)
            image = np.asarray(plotter.screenshot(return_img=True))[..., :3]
        finally:
            plotter.close()
    total = np.zeros((height, width, 3), dtype=np.uint16)  # whole numbers are added in a fifth of the time
    for row in range(2):
        for column in range(2):
            total += image[row::2, column::2]
    averaged: Array = total / (4.0 * 255.0)
    return averaged


def window() -> str:
    """VTK's kind of window to draw in without a display; "" to let VTK choose.

    Raises:
        PlotError: there is none; says what to install.
    """
    if not sys.platform.startswith("linux"):
        return ""
    if egl_works():
        return "vtkEGLRenderWindow"
    if any(library(name) for name in ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")):
        return "vtkOSOpenGLRenderWindow"
    if has_display():
        return "vtkXOpenGLRenderWindow"
    raise PlotError(
        "pictures need an OpenGL library; on Debian or Ubuntu: apt-get install libegl1 libgl1-mesa-dri"
    )


def has_display() -> bool:
    """True if a window can be opened."""
    if not sys.platform.startswith("linux"):
        return True
    x11 = library("libX11.so.6") if os.environ.get("DISPLAY") else None
    if x11 is None:
        return False
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XCloseDisplay.argtypes = (ctypes.c_void_p,)
    display = x11.XOpenDisplay(None)
    if display:
        x11.XCloseDisplay(display)
    return bool(display)


@lru_cache(maxsize=1)
def egl_works() -> bool:
    """True if EGL can be set up on some device (a processor will do). It stays set up, VTK shares it."""
    egl = library("libEGL.so.1")
    if egl is None:
        return False
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    query = egl.eglGetProcAddress(b"eglQueryDevicesEXT")
    platform = egl.eglGetProcAddress(b"eglGetPlatformDisplayEXT")
    if not (query and platform):
        return False
    pointer, number = ctypes.c_void_p, ctypes.c_int
    query_devices = ctypes.CFUNCTYPE(number, number, pointer, pointer)(query)
    display_of = ctypes.CFUNCTYPE(pointer, number, pointer, pointer)(platform)
    egl.eglInitialize.argtypes = (pointer, pointer, pointer)
    devices, count = (pointer * 16)(), number()
    if not query_devices(16, devices, ctypes.byref(count)):
        return False
    device_platform = 0x313F  # EGL_PLATFORM_DEVICE_EXT
    displays = (display_of(device_platform, devices[i], None) for i in range(count.value))
    return any(display and egl.eglInitialize(display, None, None) for display in displays)


def library(name: str) -> ctypes.CDLL | None:
    """The shared library, or None if the system has none of this name."""
    try:
        return ctypes.CDLL(name)
    except OSError:
        return None


@contextlib.contextmanager
def _environment() -> Iterator[None]:
    """Let VTK make its window from a library that is there, and leave the environment as it was."""
    key = "VTK_DEFAULT_OPENGL_WINDOW"
    chosen, before = window(), os.environ.get(key)
    if chosen and before is None:
        os.environ[key] = chosen
    try:
        yield
    finally:
        if chosen and before is None:
            os.environ.pop(key, None)
