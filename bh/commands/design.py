"""`bh design`: from a target file to a crease, its pattern to cut and its simulated shape (docs/inverse_design.md)."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer
from numpy.typing import NDArray
from pydantic import Field, model_validator

from bh.applications.inverse.along import landed
from bh.applications.inverse.converged import Converged
from bh.applications.inverse.fit import fit_curve, folded_fit, move_tip
from bh.applications.inverse.forward import Forward
from bh.applications.inverse.judge import Verdict, judge
from bh.applications.inverse.models import Name, model, read
from bh.applications.inverse.problems import CURVES, Design
from bh.applications.inverse.reach import Library, Reach, size_of
from bh.applications.inverse.segments import DesignError
from bh.applications.inverse.simulate import Landing, Simulated, frames
from bh.applications.inverse.tolerances import Region, Spreads, Tolerance, predicted, region
from bh.applications.inverse.wants import Wants
from bh.errors import InputError
from bh.paths.provenance import versions
from bh.runtime.terminal import say
from bh.scene.reading import (
    Number,
    Scale,
    Spot,
    Table,
    Turn,
    Vector,
    check_keys,
    inside,
    one_line,
    read_table,
)
from bh.scene.toml_text import read_toml, toml_bytes
from meshes import parallel_creases
from meshes.curves import arc_lengths, interpolated
from meshes.io import write_pattern
from meshes.io.export import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Stopping = Annotated[list[Number], Field(min_length=4, max_length=5)]
Box = Annotated[list[Number], Field(min_length=6, max_length=6)]
SPREADS, PROBABILITY = Spreads(), 0.95
CLEARS, YES_OR_NO = "clears itself in space", "1 yes, 0 no"


class TargetTable(Table):
    """What is asked for: exactly one of point, curve and move_tip; of a point perhaps more."""

    point: Spot | None = Field(None, description="three coordinates [x, y, z] in mm")
    curve: str | None = Field(
        None, description=f"the name of a CSV file of points x, y in mm, or one of {', '.join(CURVES)}"
    )
    tangent: Vector | None = Field(None, description="of a point: direction in which the crease ends there")
    up: Vector | None = Field(
        None, description="of a point: direction of the ridge of the fold there; needs tangent, too"
    )
    stops: list[Stopping] = Field(
        default_factory=list,
        description="of a point: where the crease is on its way, rows [part, x, y, z] or [part, x, y, z, along]: part "
        "of the pinch, mm, and which point: a share of the length of the crease, 1 (the end) if not given",
    )
    keep_out: list[Box] = Field(
        default_factory=list,
        description="of a point: boxes without the strip, rows [x, y, z, x, y, z] of two opposite corners in mm",
    )
    move_tip: bool = Field(
        False, description="true: the end moves as far as it can when the crease is pinched"
    )

    @model_validator(mode="after")
    def one_target(self) -> TargetTable:
        """Check that one thing is asked for."""
        if (self.point is not None) + (self.curve is not None) + self.move_tip != 1:
            raise ValueError("needs exactly one of point, curve and move_tip = true")
        if self.point is None and (self.tangent or self.up or self.stops or self.keep_out):
            raise ValueError("takes tangent, up, stops and keep_out with a point only")
        return self


class SearchTable(Table):
    """How the design is looked for."""

    segments: Annotated[int, Field(ge=1, le=8)] = Field(
        4, description="the largest number of segments, 1 to 8"
    )
    tolerance: Scale = Field(1.0, description="of a point, mm, a positive number")
    angle: Turn = Field(
        math.radians(1.0),
        gt=0.0,
        description="a positive angle, rad or a text such as '1deg': the tolerance of a direction",
    )
    robust: bool = Field(
        False, description="true: prefer designs whose end moves least with what is not made exactly"
    )
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = Field(1, description="a whole number from 0")
    model: Name = Field("converged", description="converged, or source for one row of bars and hinges")
    data: str | None = Field(
        None, description="the name of a data set of `bh segments`, from the folder of this file"
    )


@dataclass(frozen=True, eq=False)
class Answer:
    """A design with its simulated strip, and what it was judged by.

    Attributes:
        design: crease and pinches.
        landing: of the simulated strip.
        measure: name, value and unit of what was asked for, by the surrogate and by the simulation of the
            strip.
        goal: (k, 3) point or curve to be drawn beside it, mm.
        surrogate: the model that it was made with.
        wants: all that was asked for of a point to be reached; None for other goals.
        verdict: the shell's, where that was asked for.
    """

    design: Design
    landing: Landing
    measure: dict[str, tuple[float, str]]
    goal: Array
    surrogate: Forward
    wants: Wants | None = None
    verdict: Verdict | None = None

    @cached_property
    def tolerance(self) -> Tolerance | None:
        """How the end moves with what is not made exactly; None where the model does not know."""
        k0, length, on = self.design.k0, self.design.length, self.design.pinched
        if not self.surrogate.has_variants:
            return None
        return predicted(self.surrogate, k0, length, on, SPREADS).one()

    @cached_property
    def region(self) -> Region | None:
        """The ellipsoid that the ends of most strips are in; None where the model does not know."""
        if not self.surrogate.has_variants:
            return None
        return region(self.surrogate, self.design, SPREADS, PROBABILITY)

    @property
    def strip(self) -> Simulated:
        """The strip on the mesh on which it was simulated."""
        return self.landing.strip

    def judged(self) -> Answer:
        """With the shell's word on it.

        Raises:
            DesignError: the shell does not get there.
        """
        verdict = judge(*self.design.lists(), self.surrogate.setting)
        more = {"change of that end with the mesh of the shell": (verdict.change, "mm")}
        if self.wants is not None:
            more = {"distance of the strip by the shell": (verdict.missed(self.goal[0]), "mm"), **more}
        return replace(self, verdict=verdict, measure={**self.measure, **more})


def solve(file: str | Path) -> Answer:
    """The design that a target file asks for.

    Raises:
        DesignError: the file asks for what cannot be, or the target is not reached; one line.
    """
    file = Path(file)
    try:
        data = read_toml(toml_bytes(file).decode("utf-8-sig"))
        check_keys("", data, ("target", "search"))
        if "target" not in data:
            raise DesignError("target is missing; add a table [target] with point, curve or move_tip")
        target = read_table(TargetTable, data["target"], "target")
        search = read_table(SearchTable, data.get("search", {}), "search")
        surrogate = (
            model(search.model)
            if search.data is None
            else read(inside(file.parent, search.data, "search.data"))
        )
        if target.point is not None:
            return _point(target, search, surrogate)
        if target.curve is not None:
            return _curve(target.curve, search, file.parent, surrogate)
        return _tip(search, surrogate)
    except InputError as error:
        raise DesignError(one_line(f"{file}: {error}")) from error
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or error
        raise DesignError(
            one_line(f"the target file '{file}' cannot be read ({why}); check the name")
        ) from error


def _point(target: TargetTable, search: SearchTable, surrogate: Forward) -> Answer:
    assert target.point is not None
    stops = [(row[0], row[1:4], row[4] if len(row) > 4 else 1.0) for row in target.stops]
    wants = Wants.of(target.point, target.tangent, target.up, stops, target.keep_out)
    books = tuple(Library(surrogate, n, size_of(n), search.seed) for n in range(1, search.segments + 1))
    reach = Reach(
        most=search.segments,
        tolerance=search.tolerance,
        angle=search.angle,
        prefer="robust" if search.robust else "short",
        seed=search.seed,
        libraries=books,
    )
    found = reach(wants)
    assert found.landing is not None
    measure = {
        "distance by the model": (found.missed, "mm"),
        "distance of the simulated strip": (found.missed_simulated, "mm"),
        "its error bar": (found.bar, "mm"),
        CLEARS: (float(found.clear), YES_OR_NO),
    }
    if wants.stops:  # the distances above are the largest ones of all points
        measure["points on the way of the pinch"] = float(len(wants.stops)), "met, too"
    if len(wants.keep_out):
        measure["boxes that it stays out of"] = float(len(wants.keep_out)), "folded and pinched"
    if wants.directed:
        measure["angle of the simulated strip to its direction"] = math.degrees(found.turned_simulated), "deg"
        measure["error bar of the angle"] = math.degrees(found.turn_bar), "deg"
    goal = np.array([target.point], dtype=float)
    return Answer(found.design, found.landing, measure, goal, surrogate, wants)


def _curve(name: str, search: SearchTable, folder: Path, surrogate: Forward) -> Answer:
    curve = CURVES[name] if name in CURVES else read_curve(inside(folder, name, "target.curve"))
    problem, top, landing = folded_fit(fit_curve(curve, search.segments, seed=search.seed), surrogate)
    design = problem.design(top.x)
    at = np.linspace(0.0, 1.0, problem.samples)
    crease = landing.strip.crease()
    s = arc_lengths(crease)
    points = interpolated(at * s[-1], s, crease)
    goal = np.column_stack((problem.goal, np.zeros(problem.samples)))
    measure = {
        "mean distance by the arcs": (top.value * problem.size, "mm"),
        "mean distance of the simulated strip": (float(np.linalg.norm(points - goal, axis=1).mean()), "mm"),
        "length of the curve": (problem.size, "mm"),
        "segments": (
            float(design.n),
            "" if design.n == search.segments else "(more cannot be cut or folded)",
        ),
    }
    return Answer(design, landing, measure, goal, surrogate)


def _tip(search: SearchTable, surrogate: Forward) -> Answer:
    problem, top = move_tip(search.segments, seed=search.seed, surrogate=surrogate)[-1]
    design = problem.design(top.x, top.on)
    k0, length, _ = design.lists()
    after = surrogate.land(*design.lists())
    before = surrogate.land(k0, length, [False] * design.n)
    measure = {
        "movement of the tip by the model": (-top.value, "mm"),
        "movement of the tip of the simulated strip": (float(np.linalg.norm(after.end - before.end)), "mm"),
        "its error bar": (after.bar + before.bar, "mm"),
    }
    return Answer(design, after, measure, before.end[None], surrogate)


def read_curve(file: str | Path) -> Array:
    """(k, 2) points of a CSV file with two columns x, y in mm; a first row of names may be there.

    Raises:
        DesignError: it cannot be read, or does not begin at the origin.
    """
    try:
        with Path(file).open(newline="", encoding="utf-8-sig") as stream:
            rows = [row for row in csv.reader(stream) if row]
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or error
        raise DesignError(f"the curve '{file}' cannot be read ({why}); check the name") from error
    try:
        float(rows[0][0])
    except (ValueError, IndexError):
        rows = rows[1:]
    try:
        points = np.array([[float(x), float(y)] for x, y in rows])
    except ValueError as error:
        raise DesignError(f"the curve '{file}' needs rows of two numbers x, y in mm ({error})") from error
    if len(points) < 2 or np.hypot(*points[0]) > 1e-3 * np.ptp(points, axis=0).max():
        raise DesignError(
            f"the curve '{file}' must have two points or more and begin at the origin, where the crease does"
        )
    return points


def write(answer: Answer, folder: str | Path, data: str = "shipped") -> list[Path]:
    """Write pattern.svg, pattern.dxf, path.bh, design.png and design.json; returns the files.

    Args:
        answer: of `solve`.
        folder: for the files; made if need be.
        data: what the data set is called in design.json.

    Raises:
        DesignError: the folder cannot be written.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        k0, length, _ = answer.design.lists()
        pattern = parallel_creases(k0, length, 5.0)
        files = [
            folder / name for name in ("pattern.svg", "pattern.dxf", "path.bh", "design.png", "design.json")
        ]
        write_pattern(files[0], pattern)
        write_pattern(files[1], pattern)
        answer.strip.path.save(files[2])
        with replacing(files[3]) as draft:
            picture(answer).savefig(draft, format="png", dpi=110, metadata={"Software": None})
        tolerance, where = answer.tolerance, answer.region
        about = {
            "segments": answer.design.rows(),
            "total_length_mm": answer.design.total,
            "end_mm": answer.landing.end.tolist(),
            "error_bar_mm": answer.landing.bar,
            "model": {"formulation": answer.surrogate.setting.formulation, **answer.surrogate.about()},
            "measures": {
                name: {"value": value, "unit": unit} for name, (value, unit) in answer.measure.items()
            },
            "tolerance": None if tolerance is None or where is None else _spread(tolerance, where),
            "data": data,
            "versions": versions(),
        }
        with replacing(files[4]) as draft:
            draft.write_text(json.dumps(about, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise DesignError(
            f"cannot write to '{folder}' ({error.strerror}); choose another folder with -o"
        ) from error
    return files


def _spread(tolerance: Tolerance, where: Region) -> dict[str, object]:
    """Spreads, movements and the ellipsoid as plain data."""
    return {
        "spreads": asdict(SPREADS),
        "moves_mm": {name: move.tolist() for name, move in tolerance.moves.items()},
        "probability": PROBABILITY,
        "middle_mm": where.middle.tolist(),
        "semi_axes_mm": where.axes.tolist(),
        "directions": where.directions.T.tolist(),
    }


def _told(tolerance: Tolerance | None, where: Region | None) -> str:
    """One line on how the end moves."""
    if tolerance is None or where is None:
        return "tolerances: not known to this model"
    by = sorted(((float(np.linalg.norm(move)), name) for name, move in tolerance.moves.items()), reverse=True)
    most = ", ".join(f"{name} {moved:.2g}" for moved, name in by[:3])
    axes = " x ".join(f"{axis:.2g}" for axis in where.axes)
    inside = f"{PROBABILITY:.0%} of strips end in an ellipsoid of semi-axes {axes} mm"
    return f"{inside}; what moves the end most, in mm by one standard deviation: {most}"


def picture(answer: Answer) -> Figure:
    """The flat pattern with its pinches, and the folded strip from above and from the side with the target."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.0, 4.6), layout="constrained")
    flat, above, side = figure.subplots(1, 3)
    mesh, state = answer.strip.path.model.mesh, answer.strip.path[-1]
    crease = mesh.points[mesh.nodes("crease:crease")]
    for name in ("edge:inner", "edge:outer", "edge:start", "edge:end"):
        flat.plot(*mesh.points[mesh.nodes(name), :2].T, color="0.4", lw=1.0)
    flat.plot(*crease[:, :2].T, color="C0", lw=1.5, label="crease")
    knots = np.concatenate(([0.0], np.cumsum(answer.design.length)))
    at = np.rint(knots / knots[-1] * (len(crease) - 1)).astype(int)
    flat.plot(*crease[at, :2].T, "k.", ms=6, label="ends of segments")
    middle = np.rint(
        (0.5 * (knots[1:] + knots[:-1]))[answer.design.pinched] / knots[-1] * (len(crease) - 1)
    ).astype(int)
    if len(middle):
        flat.plot(*crease[middle, :2].T, "v", color="C3", ms=9, label="pinches")
    flat.set(title="pattern", xlabel="x, mm", ylabel="y, mm", aspect="equal")
    origin, frame = state.points[mesh.nodes("crease:crease")[0]], frames(answer.strip.path[-1])[0][1]
    x = (state.points - origin) @ frame
    limit = None  # fits of curves are outside of the data set, and the source's model is of one mesh
    if len(answer.goal) == 1 and isinstance(answer.surrogate, Converged):
        limit = landed(answer.surrogate, *answer.design.lists(), answer.landing.end)
    for ax, (i, j), title in ((above, (0, 1), "folded, from above"), (side, (0, 2), "folded, from the side")):
        for name, colour in (("edge:inner", "0.8"), ("edge:outer", "0.8"), ("crease:crease", "0.5")):
            label = "simulated on one mesh" if name == "crease:crease" else None
            ax.plot(*x[mesh.nodes(name)][:, [i, j]].T, color=colour, lw=1.0, label=label)
        if limit is not None:  # a mesh of 4 rows is millimetres from it where strips are pinched
            ax.plot(*limit[:, [i, j]].T, color="C0", lw=1.5, label="crease, limit of fine meshes")
        if answer.verdict is not None:
            ax.plot(*answer.verdict.end[[i, j]], "k+", ms=9, zorder=5, label="end by the shell")
        style = "*" if len(answer.goal) == 1 else "-"
        ax.plot(answer.goal[:, i], answer.goal[:, j], style, color="C3", ms=11, label="target")
        if answer.wants is not None:
            for stop in answer.wants.stops:
                ax.plot(stop.point[i], stop.point[j], "x", color="C3", ms=8)
                ax.annotate(f"{stop.part:.0%}", stop.point[[i, j]], fontsize=8)
            for low, high in answer.wants.keep_out:
                corners = [(low[i], low[j]), (high[i], low[j]), (high[i], high[j]), (low[i], high[j])]
                ax.fill(*np.transpose(corners), color="0.7", zorder=0)
        ax.set(title=title, xlabel="xyz"[i] + ", mm", ylabel="xyz"[j] + ", mm", aspect="equal")
        ax.margins(0.08)
    flat.legend(fontsize=8)
    above.legend(fontsize=8)
    return figure


def design(
    target: Annotated[Path, typer.Argument(metavar="TARGET", help="Target file (TOML).")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Output folder; default TARGET-design."),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")] = False,
    by_shell: Annotated[
        bool,
        typer.Option("--judge", help="Also simulate the answer by the shell, which no design is made with."),
    ] = False,
) -> int:
    """Find a crease for a target, and check it by simulation."""
    answer = solve(target)
    answer = answer.judged() if by_shell else answer
    folder = Path(f"{target.stem}-design") if output is None else output
    files = write(answer, folder)
    if not quiet:
        for row in answer.design.rows():
            state = "pinched" if row["pinched"] else "not pinched"
            say(f"segment: k0 {row['k0']:+.6f} /mm, length {row['length']:.2f} mm, {state}")
        for name, (value, unit) in answer.measure.items():
            yes = "yes" if value else "no"
            say(f"{name}: {yes}" if unit == YES_OR_NO else f"{name}: {value:.4g} {unit}")
        if not answer.measure.get(CLEARS, (1.0, ""))[0]:
            say("panels of this strip pass through each other, and no design that was found clears itself:")
            say("nothing prevents it; take other segments, or see where panels stop (docs/inverse_design.md)")
        say(_told(answer.tolerance, answer.region))
        turn = math.degrees(float(np.abs(answer.design.k0 * answer.design.length).sum()))
        say(f"total length {answer.design.total:.1f} mm, the flat crease turns by {turn:.0f} degrees in all")
        say("files: " + " ".join(str(file) for file in files))
    return 0
