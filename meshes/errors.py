"""Errors that a user can mend: one line that names the thing and the mend."""

from __future__ import annotations


class InputError(ValueError):
    """Base of every error that is caused by the input; the CLI prints its one line and exits with 2."""


class PatternError(InputError):
    """A crease pattern that cannot be cut from a sheet."""


class MeshError(InputError):
    """A mesh that is not a valid sheet."""


class FileFormatError(InputError):
    """A file that is not what its format demands."""
