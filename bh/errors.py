"""Errors of the solver's input; see `meshes.errors` for the base."""

from __future__ import annotations

from meshes.errors import InputError


class ModelError(InputError):
    """A model that cannot be solved as described."""


class TooCoarseError(ModelError):
    """A mesh that is too coarse for what is asked of it; a finer one will do."""


class NotHeldError(ModelError):
    """Supports that leave rigid motions free, in the state in which a step begins."""


class SceneError(InputError):
    """A scene file that is not understood."""


class PathFileError(InputError):
    """A stored path that cannot be read or written."""


class NotReachedError(RuntimeError):
    """A path that was to reach its end (`Path.require`) and did not; one line with reason and advice."""


class NotReachedWarning(UserWarning):
    """`bh.trace` gives back a path that did not reach its end; its last state is not what was asked for."""


__all__ = [
    "InputError",
    "ModelError",
    "NotHeldError",
    "NotReachedError",
    "NotReachedWarning",
    "PathFileError",
    "SceneError",
]
