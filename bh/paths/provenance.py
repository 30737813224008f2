"""What a result was made of: the input and the versions."""

from __future__ import annotations

import platform
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version

from bh.model.model import Model
from bh.model.serialise import fingerprint


@lru_cache(maxsize=1)
def versions() -> dict[str, str]:
    """Versions of the project and of what its numbers depend on.

    Returns:
        version by name of the package.
    """
    found = {"python": platform.python_version()}
    for name in ("curved-crease-workbench", "numpy", "scipy", "numba"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "unknown"
    return found


def provenance_of(model: Model) -> dict[str, object]:
    """Fingerprint of the input, versions and formulation of a model.

    Returns:
        plain data for path files and results.
    """
    return {"input": fingerprint(model), "versions": versions(), "formulation": model.formulation}
