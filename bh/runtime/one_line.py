"""Results that hold arrays, printed as one line."""

from __future__ import annotations

from dataclasses import fields, is_dataclass

import numpy as np

FEW = 6  # numbers of an array that are printed


class OneLine:
    """Of a dataclass (made with repr=False): its values in one line, long arrays as their shape."""

    def __repr__(self) -> str:
        """One line: "Mode(eigenvalue=0.00217, shape=<127 x 3>, name='bending', free=False, frequency=12.3)"."""
        if not is_dataclass(self):
            return object.__repr__(self)
        values = (f"{item.name}={_short(getattr(self, item.name))}" for item in fields(self))
        return f"{type(self).__name__}({', '.join(values)})"


def _short(value: object) -> str:
    if isinstance(value, np.ndarray):
        if value.size > FEW:
            return f"<{' x '.join(str(n) for n in value.shape)}>"
        return " ".join(np.array2string(value, precision=6, separator=", ").split())
    if isinstance(value, float):
        return f"{value:.6g}"
    return repr(value)
