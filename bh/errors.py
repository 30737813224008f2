"""Errors of the solver's input; see `meshes.errors` for the base."""

from __future__ import annotations

from meshes.errors import InputError


class ModelError(InputError):
    """A model that cannot be solved as described."""


class SceneError(InputError):
    """A scene file that is not understood."""


class PathFileError(InputError):
    """A stored path that cannot be read or written."""


__all__ = ["InputError", "ModelError", "PathFileError", "SceneError"]
