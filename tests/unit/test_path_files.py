"""Files of paths: stored, loaded, resumed, refused."""

from __future__ import annotations

import json
import shutil
import sqlite3
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

import meshes
from bh import (
    ArcLength,
    Automatic,
    Fold,
    Force,
    LoadControl,
    Model,
    ModelError,
    Path,
    PathFileError,
    Sheet,
    trace,
)
from bh.model.serialise import describe, fingerprint, rebuild
from tests.unit.sample_paths import (
    FREE,
    MESH,
    MODELS,
    SHEET,
    Meter,
    Refusing,
    assert_same_records,
    every,
    reached,
    several_steps,
)


@every
def test_saved_and_loaded(name: str, tmp_path: FilePath) -> None:
    path = reached(MODELS[name])
    path.save(tmp_path / "path.bh")
    loaded = Path.load(tmp_path / "path.bh")
    assert_same_records(path, loaded)
    assert [r.wall_time_s for r in loaded.records] == [r.wall_time_s for r in path.records]
    assert loaded.outcome == "reached"
    assert loaded.steps == path.steps
    assert loaded.provenance == path.provenance
    for a, b in zip(path, loaded, strict=True):
        assert a.energy == b.energy
        for field in ("points", "dihedral_angles", "reactions", "crease_moments"):
            assert np.array_equal(getattr(a, field), getattr(b, field), equal_nan=True), field
        for kind in a.energy_density:
            assert np.array_equal(a.energy_density[kind], b.energy_density[kind])
    assert list(tmp_path.iterdir()) == [tmp_path / "path.bh"]  # no drafts, no journals


@every
def test_written_while_it_runs_is_what_is_saved(name: str, tmp_path: FilePath) -> None:
    path = reached(MODELS[name], file=tmp_path / "run.bh")
    loaded = Path.load(tmp_path / "run.bh")
    assert_same_records(path, loaded)
    assert loaded.steps == path.steps


def test_file_is_plain_sqlite(tmp_path: FilePath) -> None:
    """Positions and energies can be read without this library."""
    path = reached(MODELS["held"], file=tmp_path / "run.bh")
    db = sqlite3.connect(tmp_path / "run.bh")
    rows = db.execute(
        "SELECT step, lambda, stretching, bending, folding, points FROM states ORDER BY id"
    ).fetchall()
    db.close()
    assert len(rows) == len(path)
    for (step, lam, stretching, bending, folding, points), state in zip(rows, path, strict=True):
        assert (step, lam) == (state.step, state.lam)
        assert (stretching, bending, folding) == (
            state.energy.stretching,
            state.energy.bending,
            state.energy.folding,
        )
        assert np.array_equal(np.frombuffer(points, "<f8").reshape(-1, 3), state.points)


class Copier(Meter):
    """Copies the path file after every accepted state, as a kill at that moment would leave it."""

    def __init__(self, file: FilePath) -> None:
        super().__init__()
        self.file = file
        self.copies: list[FilePath] = []

    def update(self, *what: Any) -> None:
        super().update(*what)
        copy = self.file.with_name(f"killed-{len(self.copies)}.bh")
        shutil.copy(self.file, copy)
        self.copies.append(copy)


@every
def test_resumed_after_a_kill(name: str, tmp_path: FilePath) -> None:
    """From any moment of the run: nothing is lost, and the rest is bit for bit the same."""
    copier = Copier(tmp_path / "run.bh")
    path = reached(MODELS[name], file=copier.file, progress=copier)
    assert len(copier.copies) == len(path) - 1
    for k, copy in enumerate(copier.copies, start=2):
        assert len(Path.load(copy)) == k
        if k < len(path):
            assert Path.load(copy).outcome == "unfinished"
        resumed = reached(MODELS[name], file=copy, resume=True)
        assert_same_records(path, resumed)
        assert_same_records(path, Path.load(copy))
        assert Path.load(copy).outcome == "reached"


@pytest.mark.parametrize("states", [3, 5, 7])
@pytest.mark.parametrize(
    "strategy", [Automatic(arc=ArcLength(most=20)), ArcLength(most=20)], ids=["automatic", "arc"]
)
def test_resumed_while_following_by_arc_length(
    strategy: Automatic | ArcLength, states: int, tmp_path: FilePath
) -> None:
    """A column under a dead load far beyond buckling, through itself: killed anywhere, it goes on in the same way."""
    strip = meshes.structured(meshes.strip(40.0, 8.0), along=20)
    model = (
        Model(strip, Sheet(E=1000.0, t=0.2), formulation="bars-and-hinges", contact=False)
        .support("edge:start")
        .support("edge:end", "yz")
    )
    model = model.force("edge:end", total=(-0.2, 0.0, 0.0))
    copier = Copier(tmp_path / "run.bh")
    path = trace(model, file=copier.file, progress=copier, strategy=strategy)
    assert sum(record.note == "arc length" for record in path.records) >= 8
    resumed = trace(model, file=copier.copies[states - 2], resume=True, strategy=strategy)
    for a, b in zip(path.records[: states + 2], resumed.records[: states + 2], strict=True):
        assert (a.lam, a.note) == (b.lam, b.note)
        assert np.array_equal(a.q, b.q)


def test_resumed_before_the_first_state(tmp_path: FilePath) -> None:
    file = tmp_path / "run.bh"
    path = reached(MODELS["held"], file=file)
    db = sqlite3.connect(file)
    with db:
        db.execute("DELETE FROM states")
        db.execute("DELETE FROM steps")
    db.close()
    assert_same_records(path, reached(MODELS["held"], file=file, resume=True))


def test_resuming_a_finished_run_does_nothing(tmp_path: FilePath) -> None:
    file = tmp_path / "run.bh"
    path = reached(MODELS["several steps"], file=file)
    meter = Meter()
    again = reached(MODELS["several steps"], file=file, resume=True, progress=meter)
    assert meter.updates == []
    assert_same_records(path, again)


def test_resuming_a_failed_run_tries_again(tmp_path: FilePath) -> None:
    file = tmp_path / "run.bh"
    failed = trace(MODELS["held"], file=file, strategy=LoadControl(smallest=0.1, newton=Refusing()))
    assert failed.outcome == "stalled"
    assert Path.load(file).outcome == "stalled"
    assert Path.load(file).reason == failed.reason
    resumed = reached(MODELS["held"], file=file, resume=True)
    assert len(resumed) > len(failed)
    assert_same_records_up_to(failed, resumed)
    assert Path.load(file).outcome == "reached"
    assert resumed[-1].energy.total == pytest.approx(reached(MODELS["held"])[-1].energy.total, rel=1e-8)


def assert_same_records_up_to(short: Path, long: Path) -> None:
    for a, b in zip(short.records, long.records, strict=False):
        assert np.array_equal(a.q, b.q)


def test_resuming_another_model_is_refused(tmp_path: FilePath) -> None:
    file = tmp_path / "run.bh"
    reached(MODELS["held"], file=file)
    before = file.read_bytes()
    for other in (
        FREE.fold("crease", to=1.3),
        Model(MESH, Sheet(E=4000.0, t=0.1), formulation="bars-and-hinges").fold("crease", to=1.2),
    ):
        with pytest.raises(PathFileError, match="another model"):
            trace(other, file=file, resume=True)
    assert file.read_bytes() == before


def test_errors_of_files(tmp_path: FilePath) -> None:
    """One line each, that names the file."""
    text = tmp_path / "notes.txt"
    text.write_text("not a data base, but long enough to be taken for one: " + "x" * 4096)
    empty = tmp_path / "empty.bh"
    empty.touch()
    other = tmp_path / "other.db"
    db = sqlite3.connect(other)
    db.execute("CREATE TABLE states (id INTEGER)")
    db.commit()
    db.close()
    whole = tmp_path / "whole.bh"
    reached(MODELS["held"], file=whole)
    half = tmp_path / "half.bh"
    half.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    wrong: dict[str, Callable[[], object]] = {
        "load missing": lambda: Path.load(tmp_path / "none.bh"),
        "load text": lambda: Path.load(text),
        "load empty": lambda: Path.load(empty),
        "load other": lambda: Path.load(other),
        "load half": lambda: Path.load(half)[-1],
        "load folder": lambda: Path.load(tmp_path),
        "resume missing": lambda: trace(MODELS["held"], file=tmp_path / "none.bh", resume=True),
        "resume text": lambda: trace(MODELS["held"], file=text, resume=True),
        "folder missing": lambda: trace(MODELS["held"], file=tmp_path / "nowhere" / "run.bh"),
        "save in no folder": lambda: Path.load(whole).save(tmp_path / "nowhere" / "run.bh"),
        "file is a folder": lambda: trace(MODELS["held"], file=tmp_path),
    }
    for name, act in wrong.items():
        with pytest.raises(PathFileError) as caught:
            act()
        assert "\n" not in str(caught.value), name
        assert str(tmp_path) in str(caught.value), name
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "empty.bh",
        "half.bh",
        "notes.txt",
        "other.db",
        "whole.bh",
    ]
    assert not tmp_path.with_name(tmp_path.name + ".part").exists()


@pytest.mark.parametrize(
    "damage",
    [
        "UPDATE meta SET value = '{' WHERE key = 'model'",
        "DELETE FROM arrays WHERE name = 'points'",
        "UPDATE states SET unknowns = x'0011'",
        "DELETE FROM meta WHERE key = 'provenance'",
        "DROP TABLE steps",
        "UPDATE meta SET value = replace(value, 'bars-and-hinges', 'wishes')",
        "UPDATE arrays SET shape = '[7]'",
        "UPDATE states SET cuts = 'no'",
    ],
)
def test_damaged_files(damage: str, tmp_path: FilePath) -> None:
    file = tmp_path / "run.bh"
    reached(MODELS["held"], file=file)
    db = sqlite3.connect(file)
    with db:
        db.execute(damage)
    db.close()
    with pytest.raises(PathFileError, match=r"run\.bh") as caught:
        Path.load(file)
    assert "\n" not in str(caught.value)


def test_a_model_that_cannot_be_solved_leaves_the_old_file(tmp_path: FilePath) -> None:
    file = tmp_path / "run.bh"
    path = reached(MODELS["held"], file=file)
    with pytest.raises(ModelError):
        trace(FREE.force("corner:inner-start", each=(0.0, 0.0, 1.0)), file=file)
    assert_same_records(path, Path.load(file))


# --------------------------------------------------------------------------------------- describing models


def described() -> dict[str, Model]:
    polyline = meshes.Polyline(np.array([[0.0, 5.0], [10.0, 5.5], [20.0, 5.0]]))
    odd = replace(
        meshes.structured(meshes.strip(20.0, 10.0, [5.0]), along=4),
        curves={"crease:crease": polyline},
        fold_angles={"crease": np.full(4, 0.3)},
        spans=None,
    )
    return {
        **MODELS,
        "all kinds": Model(odd, Sheet(E=4000, t=0.1, nu=0.3), formulation="bars-and-hinges")
        .support([0, 1], [[1.0, 2.0, 0.0]])
        .support("edge:start", "yz")
        .support("rigid-body")
        .crease("crease", stiffness=0.2, rest=3.0)
        .step(
            Fold("crease", rest=np.full(4, 2.9).tolist()),
            Force(np.array([3, 4]), total=np.array([1e-3, 0, 0])),  # type: ignore[arg-type]
        )
        .displace((5, 6), np.array([0.0, 0.0, 2.0]), 0.1),  # type: ignore[arg-type]
        "full annulus": Model(
            meshes.structured(meshes.full_annulus(20.0, 5.0), along=12), SHEET, formulation="bars-and-hinges"
        ).fold("all", by=0.1),
    }


@pytest.mark.parametrize("name", described())
def test_description_is_complete(name: str) -> None:
    """Through JSON and back: the same fingerprint; nothing is lost and nothing depends on the process."""
    model = described()[name]
    data, arrays = describe(model)
    back = rebuild(json.loads(json.dumps(data)), {key: value.copy() for key, value in arrays.items()})
    assert fingerprint(back) == fingerprint(model) == fingerprint(described()[name])
    assert len(back.steps) == len(model.steps)


def test_fingerprint_sees_every_change() -> None:
    base = several_steps()
    moved = MESH.points.copy()
    moved[3, 2] += 1e-13
    changed = [
        replace(base, sheet=Sheet(E=4000.0, t=0.127, nu=0.1)),
        replace(base, mesh=replace(MESH, points=moved)),
        replace(base, mesh=replace(MESH, folds={"crease": "valley"})),
        replace(base, supports=base.supports[:-1]),
        replace(base, steps=base.steps[:-1]),
        base.crease("crease", Lstar=31.0),
        base.moment("crease", 1e-5),
        replace(base, formulation="other"),
    ]
    prints = {fingerprint(model) for model in (base, *changed)}
    assert len(prints) == len(changed) + 1


def test_numpy_corner_indices() -> None:
    corners = {name: np.int64(node) for name, node in MESH.corners.items()}
    mesh = replace(MESH, corners=corners)  # type: ignore[arg-type]
    assert fingerprint(Model(mesh, SHEET, formulation="bars-and-hinges")) == fingerprint(FREE)


def test_a_file_of_version_0_1_is_refused_in_one_line(tmp_path: FilePath) -> None:
    """Its steps were tuples that hid what ends them; the line says how to make it anew."""
    file = tmp_path / "old.bh"
    db = sqlite3.connect(file)
    db.executescript(
        """
        CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
        CREATE TABLE arrays (name TEXT PRIMARY KEY, dtype TEXT NOT NULL, shape TEXT NOT NULL, data BLOB NOT NULL);
        CREATE TABLE states (id INTEGER PRIMARY KEY, step INTEGER NOT NULL, lambda REAL NOT NULL);
        CREATE TABLE steps (step INTEGER PRIMARY KEY, outcome TEXT NOT NULL, reason TEXT NOT NULL);
        INSERT INTO meta VALUES ('model', '{"format": 1, "steps": [[{"kind": "fold", "crease": "a", "to": 1.2}]]}');
        INSERT INTO states VALUES (1, 0, 0.0);
        PRAGMA user_version = 2;
        """
    )
    db.close()
    before = file.read_bytes()
    uses: tuple[Callable[[], Path], ...] = (
        lambda: Path.load(file),
        lambda: trace(MODELS["held"], file=file, resume=True),
    )
    for use in uses:
        with pytest.raises(
            PathFileError, match=r"format 2, this one reads 3\); make it anew from its scene"
        ) as told:
            use()
        assert "\n" not in str(told.value)
        assert "old.bh" in str(told.value)
    assert file.read_bytes() == before
