"""Keys of a scene set from outside: by `--set` of commands, by the points of a sweep."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Sequence
from functools import partial

from bh.errors import SceneError

TOKEN = re.compile(r"([^.\[\]]+)|\[(\d+)\]")
EXAMPLE = "--set mesh.rows=4"


def set_keys(tables: dict[str, object], changes: Sequence[str]) -> None:
    """Set keys of tables, in order.

    Args:
        tables: of a scene, which are changed; tables that are not there yet are made.
        changes: "key=value" each; the value as TOML has it, or a word as it is: "model.formulation=shell".

    Raises:
        SceneError: no "=", or no such key; one line that names it.
    """
    for change in changes:
        key, mark, text = change.partition("=")
        if not mark or not key.strip() or not text.strip():
            raise SceneError(f"'{change}' sets nothing; write it as {EXAMPLE}")
        setter(tables, key.strip())(value_of(text.strip()))


def value_of(text: str) -> object:
    """The value that a text stands for: TOML's where it is TOML, else the word itself.

    Args:
        text: such as "2", "true", "[0, 0, 1]", "shell" or "60deg".
    """
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def setter(tables: dict[str, object], key: str) -> Callable[[object], None]:
    """What sets a key of some tables; tables that are not there yet are made.

    Args:
        tables: of a scene.
        key: such as "steps[0].fold.to".

    Raises:
        SceneError: it is no key, or names none of the tables.
    """
    words = TOKEN.findall(key)
    if not words or "".join(f"[{i}]" if i else f".{w}" for w, i in words).lstrip(".") != key:
        raise SceneError(f"the key '{key}' is not understood; write it as steps[0].fold.to")
    parts: list[str | int] = [int(i) if i else w for w, i in words]
    here: dict[str, object] | list[object] = tables
    wrong = SceneError(f"the scene has no '{key}'; it must name a key of one of its tables")
    for part, after in zip(parts, [*parts[1:], None], strict=True):
        inner: object
        if isinstance(here, list):
            if not isinstance(part, int) or part >= len(here):
                raise wrong
            if after is None:
                return partial(here.__setitem__, part)
            inner = here[part]
        else:
            if not isinstance(part, str):
                raise wrong
            if after is None:
                return partial(here.__setitem__, part)
            if part not in here and not isinstance(after, int):
                here[part] = {}
            if part not in here:
                raise wrong
            inner = here[part]
        if not isinstance(inner, dict | list):
            raise wrong
        here = inner
    raise wrong
