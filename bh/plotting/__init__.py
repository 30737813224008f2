"""Pictures of folded sheets, curves of energy, and series for ParaView.

Pictures are rendered by pyvista without a window (`bh.plotting.offscreen`) and framed by matplotlib, both imported when
first needed. In one line each:

    bh.plotting.picture(path[-1], "sheet.png")        # the folded sheet, coloured by energy density
    bh.plotting.animation(path, "folding.gif")        # or .mp4
    bh.plotting.pattern(path.model)                   # the flat pattern with creases and supports
    bh.plotting.fold_angles(path, "crease")           # along a crease
    bh.plotting.response(path, "node:3", "z")         # force against displacement, with stability
    bh.plotting.curves(path)                          # energies
    bh.interactive.view(path)                         # to turn in a browser or a notebook
"""

from __future__ import annotations

from bh.plotting.charts import curves, fold_angles, pattern, response
from bh.plotting.moving import animation
from bh.plotting.offscreen import PlotError, has_display
from bh.plotting.pictures import export_series, picture, show

__all__ = [
    "PlotError", "animation", "curves", "export_series", "fold_angles", "has_display", "pattern", "picture", "response",
    "show",
]  # fmt: skip
