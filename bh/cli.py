"""The `bh` command. Only here is anything printed, and only here does the program exit.

Exit codes: 0 reached or done; 1 a path that ended early, or a check that failed; 2 bad input, told in one line;
3 a fault of the program; 130 interrupted. Everything heavy is imported where it is needed: `bh --version` is quick.
"""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Callable, Sequence
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Optional

import typer

from bh.errors import InputError

if TYPE_CHECKING:
    from bh.path import Path as Trace
    from bh.run import Run

COMMANDS = "bh.commands"
app = typer.Typer(
    name="bh",
    help="Bar-and-hinge simulation of sheets folded along curved creases.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    own = words[: words.index("--")] if "--" in words else words
    debug = "--debug" in own
    if debug:  # wherever it stands
        words.remove("--debug")
    try:
        code = app(args=words, prog_name="bh", standalone_mode=False)
        return code if isinstance(code, int) else 0
    except KeyboardInterrupt:
        return _fail("interrupted", 130, debug)
    except BrokenPipeError:  # the reader of a pipe has gone; nothing is left to say
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except InputError as error:
        return _fail(str(error), 2, debug)
    except Exception as error:
        if hasattr(error, "format_message"):  # typer's usage errors
            return _fail(f"{error.format_message()} See 'bh --help'.", 2, debug)
        return _fail(
            f"{type(error).__name__}: {error} (a fault of the program; --debug shows where)", 3, debug
        )


def _fail(message: str, code: int, debug: bool) -> int:
    if debug:
        traceback.print_exc()
    typer.echo("bh: " + " ".join(message.split()), err=True)
    return code
