"""The models that designs are made with, by name: "converged", where sheets really land, and the "source"'s own.

"converged": chains of pieces by the consistent formulation in the limit of fine meshes (`converged`). "source": one row
of bars and hinges, as the source has it, which is centimetres off for pinched creases (docs/inverse_design.md).
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Literal

from bh.applications.inverse import surrogate
from bh.applications.inverse.converged import Converged
from bh.applications.inverse.forward import Forward
from bh.applications.inverse.pieces import PIECES
from bh.applications.inverse.segments import DesignError

Name = Literal["converged", "source"]
SHIPPED = Path(__file__).with_name("pieces.nc")


@cache
def model(name: Name = "converged") -> Forward:
    """A model with the data set that comes with the package.

    Args:
        name: "converged" or "source".

    Raises:
        DesignError: no such model, or xarray is not installed.
    """
    if name == "source":
        return surrogate.shipped()
    if name != "converged":
        raise DesignError(f"there is no model '{name}'; use converged or source")
    return read(SHIPPED)


def read(file: str | Path) -> Forward:
    """The model that a data set of `bh segments` was made for, with the variants beside it where there are some.

    Raises:
        DesignError: it cannot be read.
    """
    data = surrogate.loaded(file)
    if data.attrs.get("format") != PIECES:
        return surrogate.Surrogate.of(data)
    other = beside(file)
    return Converged.of(data, surrogate.loaded(other) if other.is_file() else None)


def beside(file: str | Path) -> Path:
    """Where the variants of a data set of pieces are: pieces-variants.nc beside pieces.nc.

    Args:
        file: of the pieces.
    """
    file = Path(file)
    return file.with_name(f"{file.stem}-variants{file.suffix}")
