"""What a user has agreed to: a file runs no code and names no file outside its own folder unless somebody said so.

Scenes, sweeps, targets and stored paths come from strangers too. What they may not do by themselves, the user allows:
by an option of the command, by a variable of the environment (which worker processes inherit), by a call in Python, or
by an entry point that was installed.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from importlib.metadata import entry_points

PLUGINS, OUTSIDE = "BH_ALLOW_PLUGINS", "BH_ALLOW_OUTSIDE"
GROUP = "bh.plugins"
OPTIONS = {"--allow-plugins": PLUGINS, "--allow-outside": OUTSIDE}
_SAID: set[str] = set()  # names that the user's own Python has said in this process
YES, NO = ("1", "true", "yes", "on"), ("", "0", "false", "no", "off")


def allow_plugins(*names: str) -> None:
    """Let files name code of your own: "module:name", as docs/extending.md has it.

    This process and the worker processes that it starts from now on import and call what files name.

    Args:
        names: "module:name", or a module for all of its names; none of them for any code.
    """
    listed = _listed()
    if listed is None:
        return
    os.environ[PLUGINS] = ",".join(dict.fromkeys((*listed, *names))) if names else "1"


def said(name: str) -> None:
    """Note a name "module:name" that the user's own Python has said, in this process, so that its files may, too."""
    _SAID.add(name)


def allow_outside() -> None:
    """Let files name others that lie outside their own folder."""
    os.environ[OUTSIDE] = "1"


def plugin_allowed(name: str) -> bool:
    """Whether a file may name this code.

    Args:
        name: "module:name".
    """
    listed = _listed()
    if listed is None:
        return True
    allowed = {*listed, *_SAID, *(point.value for point in entry_points(group=GROUP))}
    return name in allowed or name.partition(":")[0] in allowed


def outside_allowed() -> bool:
    """Whether a file may name others that lie outside its own folder."""
    return os.environ.get(OUTSIDE, "").strip().lower() not in NO


def take_options(words: list[str]) -> Callable[[], None]:
    """Take the options of consent out of a command line; they may stand anywhere before "--".

    Args:
        words: of the command line; changed.

    Returns:
        what takes the consent back.
    """
    before = {variable: os.environ.get(variable) for variable in OPTIONS.values()}
    said_before = set(_SAID)
    for option, variable in OPTIONS.items():
        while option in (words[: words.index("--")] if "--" in words else words):
            words.remove(option)
            os.environ[variable] = "1"

    def back() -> None:
        _SAID.intersection_update(said_before)
        for variable, value in before.items():
            if value is None:
                os.environ.pop(variable, None)
            else:
                os.environ[variable] = value

    return back


def _listed() -> list[str] | None:
    """Names that are allowed; None where all are."""
    said = os.environ.get(PLUGINS, "").strip()
    if said.lower() in YES:
        return None
    return [] if said.lower() in NO else [name.strip() for name in said.split(",") if name.strip()]
