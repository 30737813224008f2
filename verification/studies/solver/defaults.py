"""Case `defaults`: what a person gets who chooses nothing, neither mesh nor formulation nor accuracy.

Drawings and patterns in which one row of bars and hinges is off by factors: circles, waves, a ring, a card with curves
drawn by hand, a parabola with wide panels, the waves of the shipped example. Each is solved as `bh run` does it and
compared with the shell on fine meshes. The tolerances were set before: 5 % of the energy, the accuracy of a scene that
names none, an error of at most 1.5 times the estimate, and 2 degrees of the mean fold angle of every crease. Every
sheet is kept in `defaults_runs.json` as it is done; a stopped run goes on.
"""

from __future__ import annotations

import math
import time
from dataclasses import asdict, dataclass
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory

from bh import Model, Path, trace
from bh.model.refinement import Goal, pattern_of, with_mesh
from bh.scene.load import parse_scene
from bh.solvers.outcome import Outcome
from meshes import structured
from verification.framework.checks import CaseResult, Context, Cost
from verification.framework.store import Store

CASE, RUNS = "defaults", "defaults_runs.json"
SHELL = "the shell on a fine mesh"
WITHIN, HONEST = 0.05, 1.5
TURNED = 2.0  # degrees, of mean fold angles
SHEET = "[sheet]\nE = 4000.0\nnu = 0.3\nt = {t}\n[[steps]]\nfold = {{ crease = 'all', {how} }}\n"
SPRINGS, EXACT = "by = 0.8, Lstar = 25.0", "by = 1.0471975511965976"
CARD = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="210mm" height="148mm" viewBox="0 0 210 148">'
    '<rect width="210" height="148" stroke="black" fill="none"/>'
    '<path d="M{a},0 C{b},50 {c},100 {d},148" stroke="red" fill="none"/>{more}</svg>'
)
CIRCLES = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="100mm" viewBox="0 0 100 100" fill="none">'
    '<circle cx="50" cy="50" r="48" stroke="black"/><circle cx="50" cy="50" r="12" stroke="black"/>'
    '<circle cx="50" cy="50" r="24" stroke="red"/><circle cx="50" cy="50" r="36" stroke="blue"/></svg>'
)
WAVES = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="120mm" height="80mm" viewBox="0 0 120 80" fill="none">'
    '<path stroke="black" d="m0 0h120v80h-120z"/><path stroke="red" d="M0 30a150 150 0 0 1 120-.0"/>'
    '<path stroke="blue" d="M0,50q30,20 60,0t60,0"/>'
    '<path stroke="red" d="M0,70c20,-10,20,-10 40,0s20,10 40 0 20-10 40 0"/></svg>'
)
WAVE = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="120mm" height="80mm" viewBox="0 0 120 80" fill="none">'
    '<rect width="120" height="80" stroke="black"/>'
    '<path d="M0.05,20 C20,8 40,8 60,20 S100,32 120,20" stroke="red"/>'
    '<path d="M0,40 C20,28 40,28 60,40 S100,52 119.94,40" stroke="blue"/>'
    '<path d="M0,60 C20,48 40,48 60,60 S100,72 120.06,60" stroke="red"/></svg>'
)


@dataclass(frozen=True)
class Scene:
    """A sheet that nobody chose a mesh for.

    Attributes:
        name: for the record.
        text: of the scene, TOML; a drawing is `sheet.svg`.
        judges: cells along, and rows, of the shell's two meshes; the last is the truth.
        drawing: SVG, or empty.
        given: cells along, and rows, of a shipped example of the sheet; they are solved, too.
    """

    name: str
    text: str
    judges: tuple[tuple[int, int], tuple[int, int]]
    drawing: str = ""
    given: tuple[int, int] | None = None

    def read(self) -> tuple[Model, Goal]:
        """The model, and the accuracy of a scene that names none."""
        with TemporaryDirectory() as folder:
            (FilePath(folder) / "sheet.svg").write_text(self.drawing, encoding="utf-8")
            scene = parse_scene(self.text, FilePath(folder))
        assert scene.accuracy is not None
        return scene.model, scene.accuracy


def scenes() -> tuple[Scene, ...]:
    """Those that are solved in seconds first; the last two buckle on every mesh.

    Circles, "three waves" and "drawn waves" are drawings, with what `bh init --drawing` writes of them; the last are
    the shipped example `wave.svg`.
    """
    drawn = '[pattern]\nfile = "sheet.svg"\n'
    springs, card = SHEET.format(t=0.2, how=SPRINGS), SHEET.format(t=0.3, how=EXACT)
    canopy = '[pattern]\nkind = "parabolic_canopy"\ncreases = 1\nsag = 30.0\n'
    ring = '[pattern]\nkind = "full_annulus"\nradius = 100.0\nwidth = 10.0\n'
    one = CARD.format(a=80, b=120, c=130, d=100, more="")
    blue = '<path d="M120,0 C160,50 170,100 140,148" stroke="blue" fill="none"/>'
    fine = ((24, 4), (48, 8))
    return (
        Scene("card with one Bezier curve", drawn + card, fine, one),
        Scene("parabola, wide panels", canopy + SHEET.format(t=0.2, how="by = 0.8"), fine),
        Scene("drawn waves", drawn + springs, fine, WAVE),
        Scene("three waves", drawn + springs, ((32, 4), (64, 8)), WAVES),
        Scene(
            "card with two Bezier curves",
            drawn + card,
            fine,
            CARD.format(a=80, b=120, c=130, d=100, more=blue),
        ),
        Scene(
            "ring",
            ring + "[sheet]\nE = 4000.0\nt = 0.127\n[[steps]]\nfold = { crease = 'crease', to = 2.2 }\n",
            ((62, 2), (124, 4)),
            given=(128, 2),
        ),
        Scene("concentric circles", drawn + springs, ((48, 3), (96, 6)), CIRCLES),
    )


@dataclass(frozen=True)
class Found:
    """What a person gets, and what is true; energies in N mm, mean fold angles in degrees, times in s."""

    energy: float
    estimate: float
    formulation: str
    mesh: str
    outcome: str
    stable: bool
    unknowns: int
    iterations: int
    processor_s: float
    truth: float
    bar: float
    angles: dict[str, float]
    true_angles: dict[str, float]
    others: dict[str, float]

    @property
    def error(self) -> float:
        """Relative, of the energy."""
        return abs(self.energy / self.truth - 1.0)


def examine(scene: Scene) -> Found:
    """Solve a sheet as it comes, and by the shell."""
    model, accuracy = scene.read()
    began = time.process_time()
    path = trace(model, accuracy=accuracy)
    spent = time.process_time() - began
    told = path.accuracy
    assert told is not None
    (coarse, _), (fine, true) = (_judged(model, along, rows) for along, rows in scene.judges)
    return Found(
        path[-1].energy.total,
        told.estimate,
        told.formulation,
        told.trials[-1].mesh,
        path.outcome,
        bool(path.stable),
        path.unknowns,
        sum(trial.iterations for trial in told.trials),
        spent,
        fine,
        abs(coarse / fine - 1.0),
        fold_angles(path),
        true,
        {
            name: path[-1].energy.total
            for name, path in _others(model, scene.given).items()
            if path.reached and path.stable
        },
    )


def _others(model: Model, given: tuple[int, int] | None) -> dict[str, Path]:
    """The sheet as the source meshes it, and on cells that are given."""
    pattern = pattern_of(model)
    if given is None:
        row = structured(pattern, kind="staggered", aspect_ratio=8.0)
    else:
        row = structured(pattern, kind="staggered", along=given[0])
    found = {"bars and hinges, one row": trace(with_mesh(model, row, "bars-and-hinges"))}
    if given is not None:
        mesh = structured(pattern, along=given[0], rows=given[1])
        found[f"consistent, {given[0]} x {given[1]} cells"] = trace(with_mesh(model, mesh, "consistent"))
    return found


def fold_angles(path: Path) -> dict[str, float]:
    """Mean fold angle of every crease at the end of a path, degrees.

    Args:
        path: with a state.
    """
    names = (name.removeprefix("crease:") for name in path.model.mesh.edge_sets if name.startswith("crease:"))
    return {name: math.degrees(float(path[-1].fold_angle(name).mean())) for name in names}


def _judged(model: Model, along: int, rows: int) -> tuple[float, dict[str, float]]:
    """Energy by the shell, N mm, and its fold angles; nan and none where the fold is not reached."""
    mesh = structured(pattern_of(model), kind="mirrored", along=along, rows=rows)
    path = trace(with_mesh(model, mesh, "shell"))
    if not (path.reached and path.stable):
        return math.nan, {}
    return path[-1].energy.total, fold_angles(path)


def run(context: Context) -> CaseResult:
    """All sheets; quick are the first two."""
    result = CaseResult(
        name=CASE,
        title="What one gets who chooses nothing",
        question="Is the energy right to 5 %, and to 1.5 times the estimate, where nobody chose a mesh?",
        source=SHELL,
    )
    store = Store.open(context.folder, RUNS, context.quick)
    for scene in scenes()[:2] if context.quick else scenes():
        if scene.name not in store.runs:
            context.tell(f"{CASE}: {scene.name}")
            store.keep(scene.name, asdict(examine(scene)))
        _record(result, scene, Found(**store.runs[scene.name]))
    store.file.unlink(missing_ok=True)
    return result


def _record(result: CaseResult, scene: Scene, found: Found) -> None:
    params = {"scene": scene.name, "formulation": found.formulation, "mesh": found.mesh}
    took = Cost(found.unknowns, found.iterations, found.processor_s, found.outcome)
    result.check(
        "energy of the sheet as it comes",
        found.energy,
        unit="N mm",
        reference=found.truth,
        tolerance=WITHIN,
        params=params,
        path=took,
    )
    result.check(
        "error over the estimate is at most 1.5",
        found.outcome == Outcome.REACHED and found.error <= HONEST * found.estimate,
        reference=1.0,
        source=f"error {found.error:.2g}, estimate {found.estimate:.2g}",
        tolerance=0.0,
        params=params,
    )
    result.check("error that the estimate tells", found.estimate, params=params)
    for means, energy in found.others.items():
        words = {"scene": scene.name, "by": means}
        result.check("energy of the sheet by other means", energy, unit="N mm", params=words)
    result.check(
        "its end is stable", found.stable, reference=1.0, source="asked", tolerance=0.0, params=params
    )
    for crease, angle in found.angles.items():
        true = found.true_angles.get(crease, math.nan)
        result.check(
            "mean fold angle of the sheet as it comes, from that by the shell",
            angle - true,
            unit="degrees",
            reference=0.0,
            source=SHELL,
            tolerance=TURNED,
            params={**params, "crease": crease, "by the shell": true},
            path=took,
        )
    result.check("distance of the shell's two meshes", found.bar, params=params)
    result.check("processor time", found.processor_s, unit="s", params=params)
