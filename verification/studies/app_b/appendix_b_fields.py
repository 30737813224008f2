"""Case `appendix_b_fields` (source Fig. B.5): where the folded annulus of App. B stores its energy, by the shell."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bh import State
from bh.plotting.pictures import picture
from verification.framework.checks import CaseResult, Context, line, plot
from verification.studies.app_b.shell_folding import ACTUATIONS, ANGLE, SHEET, Solved, solve

Array = NDArray[np.float64]
CASE = "appendix_b_fields"
INNER, CREASE, OUTER, ARC = 90.0, 100.0, 110.0, math.pi / 4
KINDS = {"stretching": "in-plane", "bending": "bending"}
NEAR = 2.5  # mm, about the width of the strips of in-plane energy, 0.7 sqrt(R t)
BRIGHT = 97.0  # percent of the nodes of all actuations lie within the colours
FROM_ABOVE = (ARC / 2.0, 1.5)  # azimuth and elevation, rad: both panels are seen alike
NOTE = (
    "Profiles are means over the cells of the mesh. In-plane energy lies in strips of some 2.5 mm along the crease and "
    "along both free edges, with a weak one between; bending in the middle of the arc falls outwards like the cone's "
    "1 / r^2 at some 0.9 of its height. At the ends it gathers at the crease and at the corners for (a) to (c), at the "
    "crease only for (d), whose ends are otherwise flat. A strip of more bending along the crease and the in-plane "
    "energy toward the inner edge, which the source sees in (c), are there only where the crease's spring resists the "
    "force."
)


@dataclass(frozen=True)
class Grid:
    """Energy an area by cells of the sector, N mm / mm^2: `density[kind]` (rows from inside, columns along the arc).

    Attributes:
        r: (rows,) radii and `theta`: (columns,) angles of the cells' middles, mm and rad.
        area: (rows, columns) of the cells, mm^2.
    """

    r: NDArray[np.floating]
    theta: NDArray[np.floating]
    area: NDArray[np.floating]
    density: dict[str, Array]

    def along_r(self, kind: str, share: float = 0.1) -> Array:
        """(rows,) mean density over the columns of the middle `share` of the arc, at least the middle ones."""
        off = np.abs(self.theta / ARC - 0.5)
        middle = off <= max(0.5 * share, off.min() + 1e-9)
        out: Array = self.density[kind][:, middle].mean(axis=1)
        return out

    def along_theta(self, kind: str, r: float) -> Array:
        """(columns,) density in the row of cells whose middle is nearest to the radius r."""
        out: Array = self.density[kind][int(np.argmin(np.abs(self.r - r)))]
        return out

    def part(self, kind: str, rows: NDArray[np.bool_]) -> float:
        """Part of the energy of a kind that some rows (a mask) hold."""
        energy = self.density[kind] * self.area
        return float(energy[rows].sum() / energy.sum())


def on_grid(state: State, along: int, rows: int) -> Grid:
    """Energies of the triangles of a structured sector gathered by its cells: `along` the arc, `rows` on each side."""
    mesh = state.mesh
    middle = mesh.points[mesh.triangles].mean(axis=1)
    height, width = (OUTER - INNER) / (2 * rows), ARC / along
    row = np.floor((np.hypot(middle[:, 0], middle[:, 1]) - INNER) / height).astype(int)
    column = np.floor(_angles(mesh.points, middle) / width).astype(int)
    shape = (2 * rows, along)
    cell = np.ravel_multi_index((np.clip(row, 0, shape[0] - 1), np.clip(column, 0, along - 1)), shape)
    weight = np.bincount(cell, mesh.areas, minlength=shape[0] * shape[1])
    stored = {kind: mesh.areas * state.energy_density[kind] for kind in KINDS}
    density = {
        kind: (np.bincount(cell, energy, minlength=len(weight)) / weight).reshape(shape)
        for kind, energy in stored.items()
    }
    r = INNER + height * (np.arange(shape[0], dtype=float) + 0.5)
    theta = width * (np.arange(along, dtype=float) + 0.5)
    return Grid(r, theta, np.broadcast_to((r * height * width)[:, None], shape), density)


def _angles(points: Array, at: Array) -> Array:
    """Angle along the arc from its start, rad; the sector begins on the x axis or is turned from it."""
    phase = np.arctan2(points[:, 1], points[:, 0])
    out: Array = np.arctan2(at[:, 1], at[:, 0]) - phase.min()
    return out


def run(context: Context) -> CaseResult:
    """Pictures of both energies and profiles along r and theta for all actuations."""
    result = CaseResult(
        name=CASE,
        title="Where the sheet of App. B stores its energy",
        question="Where do the four actuations of App. B leave in-plane and bending energy?",
        source="source Fig. B.5, by the shell",
    )
    along, rows = (32, 4) if context.quick else (64, 12)
    found: dict[str, Solved] = {}
    for actuation in ACTUATIONS:
        context.tell(f"{CASE}: ({actuation}), {along} x {2 * rows} cells")
        found[actuation] = solve(actuation, along, rows)
    grids = {a: on_grid(s.state, along, rows) for a, s in found.items() if s.reached}
    for actuation, solved in found.items():
        _checks(result, actuation, solved, grids.get(actuation), {"along": along, "rows": rows})
    if grids:
        _profiles(result, grids)
        _pictures(result, context, {a: found[a].state for a in grids})
    result.notes.append(NOTE)
    return result


def _checks(
    result: CaseResult, actuation: str, solved: Solved, grid: Grid | None, mesh: dict[str, Any]
) -> None:
    params = {"actuation": actuation, "how": ACTUATIONS[actuation], **mesh, "formulation": "shell"}
    check = partial(result.check, params=params, path=solved)
    if grid is None:  # not reached: said once, with no figure
        check("energy fields", math.nan, unit="N mm", source="source Fig. B.5")
        return
    crease = np.abs(grid.r - CREASE) < NEAR
    edges = (grid.r - INNER < NEAR) | (OUTER - grid.r < NEAR)
    for kind, name in KINDS.items():
        stored = float((grid.density[kind] * grid.area).sum())
        check(
            f"{name} energy of the field",
            stored,
            unit="N mm",
            reference=getattr(solved.state.energy, kind),
            source="the state's own total; cells are sectors, triangles flat-edged",
            tolerance=2e-3,
        )
        for rows, where in ((crease, "the crease"), (edges, "the inner and outer edges")):
            check(
                f"part of the {name} energy within {NEAR} mm of {where}",
                grid.part(kind, rows),
                unit="1",
                source="of the area it is 0.25",
            )
    inside = np.abs(grid.r - 95.0) < NEAR
    middle = float((grid.along_r("bending")[inside] / _cone(grid.r[inside])).mean())
    check(
        "bending energy over the cone's, middle of the arc, inner panel",
        middle,
        unit="1",
        reference=1.0,
        source="1/2 D cot^2(phi / 2) / r^2, D with nu",
        tolerance=0.15 if actuation != "c-spring" else None,
    )


def _cone(r: NDArray[np.floating]) -> NDArray[np.floating]:
    """Bending energy an area of the cone, N mm / mm^2."""
    return 0.5 * SHEET.bending_stiffness() / (math.tan((math.pi - ANGLE) / 2.0) * r) ** 2


def _profiles(result: CaseResult, grids: dict[str, Grid]) -> None:
    any_grid = next(iter(grids.values()))
    for kind, name in KINDS.items():
        series = [line(f"({a})", g.r.tolist(), g.along_r(kind).tolist()) for a, g in grids.items()]
        if kind == "bending":
            series.append(line("cone", any_grid.r.tolist(), _cone(any_grid.r).tolist(), "reference"))
        result.plots.append(
            plot(
                f"appendix-b-fields-{kind}-r",
                f"{name.capitalize()} energy along r",
                "r, mm",
                "energy an area, N mm / mm^2",
                series,
                "Mean over the middle tenth of the arc; the crease is at 100 mm.",
                log="y",
            )
        )
    for kind, radius, where in (
        ("bending", INNER, "at the inner edge"),
        ("bending", CREASE + 1e-6, "beside the crease"),
        ("stretching", CREASE + 1e-6, "beside the crease"),
    ):
        series = [
            line(f"({a})", (g.theta / ARC).tolist(), g.along_theta(kind, radius).tolist())
            for a, g in grids.items()
        ]
        result.plots.append(
            plot(
                f"appendix-b-fields-{kind}-theta-{radius:.0f}",
                f"{KINDS[kind].capitalize()} energy along theta, {where}",
                "theta over the arc",
                "energy an area, N mm / mm^2",
                series,
                f"The row of cells {where}" + (", on its outer side." if radius > CREASE else "."),
            )
        )


def _pictures(result: CaseResult, context: Context, states: dict[str, State]) -> None:
    """Both energies of each actuation, in one scale of colours a kind so that they can be compared."""
    for kind, name in KINDS.items():
        top = float(np.percentile([s.nodal_energy_density(kind) for s in states.values()], BRIGHT))
        for actuation, state in states.items():
            file = f"{CASE}_{actuation}_{kind}.png"
            context.tell(f"{CASE}: {file}")
            energy = getattr(state.energy, kind)
            caption = f"({actuation}) {ACTUATIONS[actuation]}: {name} energy {energy:.3g} N mm"
            picture(
                state, context.folder / file, kind, (1000, 560), caption=caption, camera=FROM_ABOVE, top=top
            )
            result.pictures.append(
                {
                    "file": file,
                    "alt": f"The folded sheet of App. B ({actuation}), coloured by {name} energy",
                    "caption": f"Fig. B.5 ({actuation}), {ACTUATIONS[actuation]}: {name} energy an area, N mm / mm²; "
                    "one scale for all actuations.",
                }
            )
