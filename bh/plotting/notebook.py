"""What notebooks show of pictures and charts: the formats that Jupyter, VS Code and nbviewer ask an object for.

matplotlib tells a notebook how to show a figure only where pyplot was imported, which no chart needs.
"""

from __future__ import annotations

import io
import sys
from dataclasses import dataclass

from matplotlib.figure import Figure


class Chart(Figure):
    """A figure that a notebook shows where it is the last line of a cell."""

    def _repr_png_(self) -> bytes:
        with io.BytesIO() as file:
            self.savefig(file, format="png")
            return file.getvalue()


@dataclass(frozen=True, repr=False)
class Still:
    """A picture that a notebook shows in the output of its cell.

    Attributes:
        png: the file's bytes.
    """

    png: bytes

    def __repr__(self) -> str:
        """One line: "Still(PNG, 48 kB)"."""
        return f"Still(PNG, {len(self.png) / 1000:.0f} kB)"

    def _repr_png_(self) -> bytes:
        return self.png


def in_notebook() -> bool:
    """True if a notebook shows what a line returns (Jupyter, VS Code), and not a terminal."""
    ipython = sys.modules.get("IPython")  # imported by the kernel, never by this package
    return hasattr(ipython.get_ipython(), "kernel") if ipython is not None else False
