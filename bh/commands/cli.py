"""The `bh` command. Only here is anything printed, and only here does the program exit.

Exit codes: 0 reached, or done; 1 a path that ended early, or a check that failed; 2 bad input, told in one line;
3 a fault of the program; 130 interrupted. What is heavy is imported where it is needed, so that `bh` starts fast.
"""

from __future__ import annotations

import os
import shlex
import signal
import sys
import traceback
from collections.abc import Callable, Sequence
from importlib.metadata import EntryPoint, entry_points, version
from pathlib import Path
from types import FrameType
from typing import Annotated

import typer

from bh.commands.bend import bend
from bh.commands.calibrate import calibrate
from bh.commands.compare import compare
from bh.commands.flat import export
from bh.commands.fold_options import fold
from bh.commands.response import response
from bh.runtime.consent import take_options
from bh.runtime.terminal import say, shortened

COMMANDS = "bh.commands"
ABOUT = {  # what commands of other packages say of themselves; `bh --help` must not import them
    "design": "Find a crease for a target, and check it by simulation.",
    "segments": "Make the data set of strips for inverse design.",
    "studio": "Fold a sheet by sliders, in a window of the browser.",
    "sweep": "Solve a scene for many parameters into a labelled data set.",
    "verify": "Check the solvers against theory and published numbers.",
    "report": "Run the verification cases and write the report page.",
}
app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command line.

    Args:
        arguments: without the program's name; None for those of the process.

    Returns:
        The exit code: 0, 1 where a result was not reached, 2 for bad input, 3 for a fault of the program, 130 where
        it was interrupted.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    debug = "--debug" in (words[: words.index("--")] if "--" in words else words)
    if debug:  # it may stand anywhere, also behind a command
        words.remove("--debug")
    alone = arguments is None
    try:
        if alone:  # until here an interrupt ended the process without more ado; see bh_command.py
            _heed_interrupts(signal.default_int_handler)
        code = _run(words, debug)
        if alone:  # all is told: Python need not be disturbed while it takes everything down
            _heed_interrupts(signal.SIG_IGN)
    except KeyboardInterrupt:  # in the moment in which another end is told of
        code = _fail("interrupted", 130, debug)
    if code == 130 and alone:
        _end_at_once(code)
    return code


def _heed_interrupts(how: Callable[[int, FrameType | None], object] | signal.Handlers) -> None:
    """Take interrupts in another way, unless they are ignored already, as behind `nohup` and `&`."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, how)


def _end_at_once(code: int) -> None:
    """End the process of an interrupted command.

    Whoever interrupts need not wait until everything that was loaded is taken down. And `python -m` forgets the code
    where the interrupt passed an `exec` on its way, as that of a dataclass that is being made: it ends by SIGINT.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def _run(words: list[str], debug: bool) -> int:
    take_back = take_options(words)
    try:
        code = app(args=words, prog_name="bh", standalone_mode=False)
        if code == 130:  # what typer makes of a KeyboardInterrupt
            return _fail("interrupted", 130, debug)
        return code if isinstance(code, int) else 0
    except (KeyboardInterrupt, typer.Abort):
        return _fail("interrupted", 130, debug)
    except _InterruptedError as error:
        return _fail(f"interrupted; {error}", 130, debug)
    except BrokenPipeError:  # whoever read the output has gone
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if _was_interrupted(error):
            return _fail("interrupted", 130, debug)
        return _explain(error, debug)
    finally:
        take_back()


LEFT_OUT = ("gmsh", "matplotlib", "plotly", "pyvista")  # by a light installation (docs/installation.md)


def _was_interrupted(error: BaseException | None) -> bool:
    """Whether an interrupt is behind an error; Python 3.11 makes a RuntimeError of one while a class is made."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__
    return error is not None


class _InterruptedError(Exception):
    """A KeyboardInterrupt with what there is to say about it."""


def _explain(error: Exception, debug: bool) -> int:
    from bh.errors import InputError

    if isinstance(error, InputError):
        return _fail(str(error), 2, debug)
    if hasattr(error, "format_message"):  # how typer tells a wrong command line
        command = getattr(getattr(error, "ctx", None), "command_path", "bh")
        return _fail(f"{error.format_message().rstrip('.')}; see '{command} --help'", 2, debug)
    if isinstance(error, ModuleNotFoundError) and (error.name or "").split(".")[0] in LEFT_OUT:
        return _fail(f"this needs {error.name}, which is not installed; pip install {error.name}", 2, debug)
    what = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    return _fail(f"{what} (a fault of the program, please report it; --debug shows where)", 3, debug)


def _fail(message: str, code: int, debug: bool) -> int:
    if debug:
        traceback.print_exc()
    say("bh: " + shortened(" ".join(message.split())), err=True)
    return code


# --- commands -----------------------------------------------------------------------------------------------


def _print_version(wanted: bool) -> None:
    if wanted:
        say(f"bh {version('curved-crease-workbench')}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _options(
    context: typer.Context,
    show_version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version and exit."),
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show where an error comes from.")] = False,
    allow_plugins: Annotated[
        bool,
        typer.Option("--allow-plugins", help="Run code that files name (module:name); if you trust them."),
    ] = False,
    allow_outside: Annotated[
        bool, typer.Option("--allow-outside", help="Read files that lie outside the folder of the scene.")
    ] = False,
) -> None:
    """Bar-and-hinge simulation of sheets folded along curved creases."""
    # the first has its own callback, `main` looks for the others, wherever they stand
    del show_version, debug, allow_plugins, allow_outside
    if context.invoked_subcommand is None:
        say(context.get_help())


@app.command()
def run(
    scene: Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file (TOML).")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="DIR", help="Output folder; default SCENE-out.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the states in the folder.")] = False,
    force: Annotated[
        bool, typer.Option("--force", help="Replace a run that was stopped, or is of another scene.")
    ] = False,
    pictures: Annotated[bool, typer.Option("--pictures", help="Draw the folded sheet (PNG).")] = False,
    vtu: Annotated[bool, typer.Option("--vtu", help="Write all states for ParaView (PVD, VTU).")] = False,
    neighbours: Annotated[bool, typer.Option("--neighbours", help="Look beside each step's end.")] = False,
    estimate: Annotated[
        bool, typer.Option("--estimate/--no-estimate", help="Of a given mesh: also solve a coarser one.")
    ] = True,
    formulation: Annotated[
        str | None, typer.Option("--formulation", metavar="NAME", help="In place of the scene's.")
    ] = None,
    changes: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Set a key: sheet.t=0.2, steps[0].fold.to=60deg."),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")] = False,
) -> None:
    """Solve a scene into a folder: path.bh and result.json."""
    from bh.commands.occupied import UNFINISHED
    from bh.commands.place import load_marking
    from bh.commands.resuming import say_from
    from bh.commands.run import holds_states, solve, write_extras
    from bh.commands.summary import summary
    from bh.errors import InputError

    asked = [*(changes or ()), *([f"model.formulation={formulation}"] if formulation else [])]
    loaded = load_marking(scene, asked, (output or Path()).parent)
    if formulation is not None and loaded.accuracy is not None:
        raise InputError(
            f"--formulation {formulation}: this scene is solved to an accuracy, which chooses the formulation; "
            "give it a mesh (--set mesh.rows=4 --set mesh.along=32), or use bh compare"
        )
    folder = Path(f"{loaded.name}-out") if output is None else output
    if resume and not quiet:
        say_from(folder, loaded)
    try:
        path, names, before, contact, yields = solve(
            loaded,
            folder,
            resume=resume,
            force=force,
            progress=not quiet,
            estimate=estimate,
            neighbours=neighbours or None,
        )
    except KeyboardInterrupt:
        sets = [word for change in asked for word in ("--set", change)]
        again = shlex.join(["bh", "run", str(scene), *sets, "-o", str(folder), "--resume"])
        raise _InterruptedError(
            f"go on with: {again}" if holds_states(folder) else "nothing is kept"
        ) from None
    if before and not quiet:
        say(f"{loaded.name}: this run had reached its end before; nothing was left to solve")
    written = [*(folder / name for name in names), *write_extras(path, loaded, folder, pictures, vtu)]
    if not quiet:
        summary(path, loaded, written, contact, yields)
    if path.reached and path.accuracy is not None and not path.accuracy.met:
        why = "; ".join(note for note in path.accuracy.notes if note.startswith("ended"))
        say(
            f"bh: {scene}: the accuracy that was asked for is not met: {path.accuracy}; {why}; "
            f"the path is in '{written[0]}'",
            err=True,
        )
        raise typer.Exit(1)
    if not path.reached:
        why = f" ({path.reason})" if path.reason else ""
        kept = "; the finished result of an earlier run is kept" if names == UNFINISHED else ""
        say(
            f"bh: {scene}: step {len(path.steps)} of {len(loaded.model.steps)} ended early: {path.outcome}{why}; "
            f"what was reached is in '{written[1]}'{kept}",
            err=True,
        )
        raise typer.Exit(1)


for _command in (fold, compare, response, bend, calibrate):
    app.command()(_command)


@app.command()
def view(
    path: Annotated[Path, typer.Argument(metavar="PATH", help="A path file, or the output folder of a run.")],
    picture: Annotated[
        Path | None, typer.Option("--picture", metavar="FILE.png", help="Draw to a file; no window.")
    ] = None,
    vtu: Annotated[
        Path | None, typer.Option("--vtu", metavar="DIR", help="Write all states for ParaView; no window.")
    ] = None,
    animation: Annotated[
        Path | None,
        typer.Option("--animation", metavar="FILE.gif", help="All states as .gif or .mp4; no window."),
    ] = None,
    html: Annotated[
        Path | None,
        typer.Option("--html", metavar="FILE.html", help="All states to turn in a browser; no window."),
    ] = None,
    state: Annotated[int, typer.Option("--state", help="Which state, from 0; -1 is the last.")] = -1,
    frames: Annotated[
        int | None, typer.Option("--frames", metavar="N", help="Of the animation; two seconds of them.")
    ] = None,
    fps: Annotated[int, typer.Option("--fps", metavar="N", help="Frames a second.")] = 24,
) -> None:
    """Show a state of a solved path, or draw it to a file."""
    from bh.commands.occupied import path_file
    from bh.commands.summary import in_browser
    from bh.errors import InputError
    from bh.paths.path import Path as Trace

    file = path_file(path) if path.is_dir() else path
    solved = Trace.load(file)
    if not -len(solved) <= state < len(solved):
        raise InputError(f"--state {state}: '{file}' has the states 0 to {len(solved) - 1}; -1 is the last")
    import bh.plotting

    if vtu is not None:
        say(f"wrote {bh.plotting.export_series(solved, vtu)}")
    if picture is not None:
        bh.plotting.picture(solved[state], picture)
        say(f"wrote {picture}")
    if animation is not None:
        say(f"wrote {bh.plotting.animation(solved, animation, fps=fps, frames=frames)}")
    if html is not None:
        import bh.plotting.interactive

        say(f"wrote {bh.plotting.interactive.view(solved, title=path.name).save(html)}")
    if picture is vtu is animation is html is None:
        if bh.plotting.has_display():
            bh.plotting.show(solved[state])
        else:
            in_browser(solved, path)


app.command()(export)


@app.command()
def init(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The scene to write.")] = Path("scene.toml"),
    drawing: Annotated[
        Path | None, typer.Option("--drawing", metavar="FILE", help="SVG, DXF, FOLD, .cp or .opx to fold.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over a file that is there.")] = False,
) -> None:
    """Write a commented example scene."""
    from bh.errors import InputError
    from bh.scene.example import example
    from bh.scene.reading import is_inside
    from meshes.io.export import replacing

    if file.exists() and not force:
        raise InputError(f"'{file}' is there already; name another file, or add --force")
    if drawing is not None:  # a scene looks for its files from its own folder
        drawing = Path(os.path.relpath(drawing, file.parent))
    text = example(drawing, file.parent)
    with replacing(file) as draft:
        draft.write_text(text, encoding="utf-8")
    outside = drawing is not None and not is_inside(file.parent, file.parent / drawing)
    say(f"wrote {file}; next: bh check {shlex.quote(str(file))}{' --allow-outside' if outside else ''}")


@app.command()
def check(
    scene: Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file (TOML), or a drawing.")],
    picture: Annotated[
        Path | None,
        typer.Option("--picture", metavar="FILE", help="PNG, SVG or PDF to draw; default SCENE-check.png."),
    ] = None,
    no_picture: Annotated[bool, typer.Option("--no-picture", help="Draw nothing.")] = False,
) -> None:
    """Check a scene, say what it is, and draw its flat pattern."""
    from bh.commands.place import marking
    from bh.commands.summary import scene_of_drawing
    from bh.scene.load import load_scene
    from bh.scene.report import draw, report
    from meshes.io.drawing import PATTERNS

    with marking(scene, (picture or Path()).parent):
        loaded = scene_of_drawing(scene) if scene.suffix.lower() in PATTERNS else load_scene(scene)
    for line in report(loaded):
        say(line)
    if not no_picture:
        say(f"wrote {draw(loaded, picture or Path(f'{loaded.name}-check.png'))}")


@app.command()
def schema(
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write to a file; default the screen."),
    ] = None,
) -> None:
    """Print the JSON schema of scenes, for editors."""
    import json

    from bh.scene.json_schema import schema as scene_schema
    from meshes.io.export import replacing

    text = json.dumps(scene_schema(), indent=2) + "\n"
    if output is None:
        typer.echo(text, nl=False)
        return
    with replacing(output) as draft:
        draft.write_text(text, encoding="utf-8")
    say(f"wrote {output}; name it in the first line of a scene: #:schema {output}")


@app.command()
def formulations() -> None:
    """List the formulations that a scene can name."""
    from bh.formulations.registry import names

    for name in names():
        say(name)


def _add_commands() -> None:
    """Commands of other packages, by the entry-point group; none of them is imported before it is called."""
    for entry in entry_points(group=COMMANDS):
        settings = {
            "ignore_unknown_options": True,
            "allow_extra_args": True,
            "allow_interspersed_args": False,
        }
        about = ABOUT.get(entry.name, f"From the package {entry.value.split('.')[0]}.")
        app.command(entry.name, help=about, add_help_option=False, context_settings=settings)(_proxy(entry))


def _proxy(entry: EntryPoint) -> Callable[[typer.Context], None]:
    def call(context: typer.Context) -> None:
        from bh.errors import InputError

        try:
            function = entry.load()
        except (ImportError, AttributeError) as error:
            raise InputError(
                f"command '{entry.name}' is not available ({error}); install {entry.value}"
            ) from error
        own = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
        own.command(entry.name)(function)
        code = own(args=context.args, prog_name=f"bh {entry.name}", standalone_mode=False)
        raise typer.Exit(code if isinstance(code, int) else 0)

    return call


_add_commands()


if __name__ == "__main__":
    sys.exit(main())
