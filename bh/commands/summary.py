"""A solved scene in lines, and the scene that `bh fold` makes of a drawing."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from bh.runtime.terminal import say

if TYPE_CHECKING:
    from bh.analysis.contact import Contact
    from bh.analysis.yielding import Yielding
    from bh.paths.path import Path as Trace
    from bh.scene.load import Scene


def summary(
    path: Trace,
    scene: Scene,
    written: Sequence[Path],
    contact: Contact | None,
    yields: Yielding | str | None = None,
) -> None:
    """Print what has come of a scene.

    Args:
        path: solved, as far as it goes.
        scene: that it is of.
        written: the files.
        contact: the first self-contact.
        yields: when and where it yields, or why that cannot be told.
    """
    from math import degrees

    from bh.formulations.registry import takes_nu

    energy, last = path[-1].energy, path[-1]
    say(
        f"{scene.name}: {path.outcome}; {len(path)} states, {path.iterations} iterations, "
        f"{path.unknowns} unknowns, {path.wall_time_s:.2f} s"
    )
    stable = {True: "yes", False: "no", None: "was not looked at"}[path.stable]
    say(f"stable: {stable}")
    for remark in sorted(path.remarks, key=_last)[:6]:
        say(remark)
    model = path.model
    if model.sheet.nu != 0.0 and not takes_nu(model.formulation):
        say(f"{model.formulation} take Poisson's ratio as 0, not as nu = {model.sheet.nu:g}")
    say(
        f"energy: stretching {energy.stretching:.5g}, bending {energy.bending:.5g}, "
        f"folding {energy.folding:.5g}, total {energy.total:.5g} N mm"
        + (f"; contact {energy.contact:.3g} N mm" if path.model.hindered else "")
        + (f"; friction has used up {energy.friction:.3g} N mm" if path.model.rubs else "")
    )
    for name, force in last.contact_forces.items():
        x, y, z = force
        say(f"force of {name} on the sheet: {x:.4g}, {y:.4g}, {z:.4g} N")
    creases = model.mesh.drawn_creases
    for crease in creases[:6]:
        a = last.fold_angle(crease)
        say(
            f"fold angle of {crease}: {a.mean():.4f} rad ({degrees(a.mean()):.1f} degrees), "
            f"{a.min():.4f} to {a.max():.4f}"
        )
    if len(creases) > 6:
        say(f"and {len(creases) - 6} more creases")
    if contact is None:
        say("self-contact: none")
    else:
        say(f"self-contact (reported, not prevented), first in {contact}")
    if yields is not None:
        say(f"yield was not looked at: {yields}" if isinstance(yields, str) else str(yields))
    if path.accuracy is not None:
        say(f"accuracy: {path.accuracy}")
    if path.estimate_reason:
        say(f"accuracy: no estimate: {path.estimate_reason}")
    say("files: " + " ".join(str(file) for file in written))


def _last(remark: str) -> bool:
    """Not among the first to be told? What contact has done is, however many critical points were passed."""
    return not ("panels met without contact" in remark or "not prevented: " in remark)


def scene_of_drawing(file: Path) -> Scene:
    """What `bh fold` would begin with; what it assumes is printed.

    Args:
        file: a drawing, or a FOLD file.

    Raises:
        InputError: as `bh.scene.folding.proposals`.
    """
    from bh.scene.folding import proposals
    from bh.scene.load import parse_scene

    first = proposals(file)[0]
    for line in first.assumed:
        say(f"assumed: {line}")
    return parse_scene(first.text, file.parent, file.stem)


def in_browser(solved: Trace, path: Path) -> None:
    """Write the page that turns in a browser beside a path, and open it where $BROWSER says by what.

    Args:
        solved: the path.
        path: its file, or the folder that has it.
    """
    import webbrowser

    import bh.plotting.interactive

    page = (path if path.is_dir() else path.parent) / "view.html"
    page = bh.plotting.interactive.view(solved, title=path.name).save(page)
    say(f"no display for a window; wrote {page}, to turn in a browser")
    if os.environ.get("BROWSER"):  # else Python would take one that draws in the terminal
        webbrowser.open(page.as_uri())
