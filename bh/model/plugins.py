"""Things of the user's own by the name "module:name", as scenes and stored models say it.

A name that the user's own Python has said (`bh.Model(..., formulation="mine:Shell")`) is imported as it is. A name
that stands in a file is only followed with the user's consent (`bh.runtime.consent`): importing and calling what a
stranger's file names would run any command. Classes that are there already, since the user's Python has defined them
for this very purpose, are found by their name and nothing is imported.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Any

from bh.errors import ModelError
from bh.runtime.consent import PLUGINS, plugin_allowed


def named(name: str) -> Any:
    """What "module:name" stands for; for names that the user's own Python has said.

    Raises:
        ModelError: no such module, or no such name in it.
    """
    module, _, attribute = name.partition(":")
    try:
        return getattr(import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as missing:
        raise ModelError(f"'{name}' cannot be imported ({missing}); it has to be module:name") from missing


def consent(name: str) -> None:
    """See that a file may name this code.

    Args:
        name: "module:name" from a file.

    Raises:
        ModelError: nobody has allowed it; one line that names it and the mend.
    """
    if not plugin_allowed(name):
        raise ModelError(
            f"'{name}' is code that this file wants to run; if you trust the file, add --allow-plugins "
            f'({PLUGINS}=1, or bh.allow_plugins("{name}") in Python)'
        )


def from_file(name: str, kind: type | None = None) -> Any:
    """What "module:name" of a file stands for, if it may be followed.

    Args:
        name: from a file.
        kind: of class that it is to be; one that is defined already needs no consent.

    Raises:
        ModelError: nobody has allowed it, no such module, or no such name in it.
    """
    if kind is not None:
        module, _, attribute = name.partition(":")
        there = getattr(sys.modules.get(module), attribute, None)
        if any(there is derived for derived in _below(kind)):
            return there
    consent(name)
    return named(name)


def made(name: str, given: Mapping[str, Any], kind: type | None = None) -> Any:
    """What "module:name" of a file makes of keys and values; lists become tuples.

    Args:
        name: "module:name", imported if it is not yet.
        given: keys and values.
        kind: class that the result must be of; None for any.

    Raises:
        ModelError: nobody has allowed it, it does not take these keys, or makes something else than a `kind`.
    """
    make = from_file(name, kind)
    values = {key: tuple(value) if isinstance(value, list) else value for key, value in given.items()}
    try:
        item = make(**values)
    except TypeError as wrong:
        raise ModelError(f"'{name}' does not take this: {wrong}") from wrong
    if kind is not None and not isinstance(item, kind):
        raise ModelError(f"'{name}' makes a {type(item).__name__}, which is no {kind.__name__}")
    return item


def _below(kind: type) -> Iterator[type]:
    """Classes that derive from one."""
    derived: type
    for derived in type.__subclasses__(kind):
        yield derived
        yield from _below(derived)
