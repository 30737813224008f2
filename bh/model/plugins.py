"""Things of the user's own by the name "module:name", as scenes and stored models say it."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

from bh.errors import ModelError


def named(name: str) -> Any:
    """What "module:name" stands for.

    Raises:
        ModelError: no such module, or no such name in it.
    """
    module, _, attribute = name.partition(":")
    try:
        return getattr(import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as missing:
        raise ModelError(f"'{name}' cannot be imported ({missing}); it has to be module:name") from missing


def made(name: str, given: Mapping[str, Any], kind: type | None = None) -> Any:
    """What "module:name" makes of keys and values; lists become tuples.

    Raises:
        ModelError: it does not take these keys, or makes something else than a `kind`.
    """
    make = named(name)
    values = {key: tuple(value) if isinstance(value, list) else value for key, value in given.items()}
    try:
        item = make(**values)
    except TypeError as wrong:
        raise ModelError(f"'{name}' does not take this: {wrong}") from wrong
    if kind is not None and not isinstance(item, kind):
        raise ModelError(f"'{name}' makes a {type(item).__name__}, which is no {kind.__name__}")
    return item
