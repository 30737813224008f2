"""Path files, journals and data sets that lie about what they hold: one line, before memory or time is taken."""

from __future__ import annotations

import json
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import h5py
import numpy as np
import pytest

import bh
import bh.sweep
from bh.applications.inverse.surrogate import loaded
from bh.commands.cli import main
from bh.errors import InputError
from bh.paths.stored import parsed
from bh.sweep.journal import Journal, Meta

SCENE = """
[pattern]
kind = "annulus_sector"
radius = 100.0
width = 10.0
angle = 0.5
[sheet]
E = 4000.0
t = 0.1
[mesh]
along = 6
[model]
formulation = "bars-and-hinges"
[[steps]]
fold = { crease = "crease", by = 0.2 }
[[steps]]
fold = { crease = "crease", by = 0.2 }
"""
Change = Callable[[sqlite3.Connection], object]
DEEP = "[" * 200_000
ENDLESS = "WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c)"


def sql(*statements: str, given: tuple[object, ...] = ()) -> Change:
    def change(db: sqlite3.Connection) -> None:
        for text in statements:
            db.execute(text, given if "?" in text else ())

    return change


def model(*keys: str, value: object) -> Change:
    def change(db: sqlite3.Connection) -> None:
        data = json.loads(db.execute("SELECT value FROM meta WHERE key = 'model'").fetchone()[0])
        at = data
        for key in keys[:-1]:
            at = at[key]
        at[keys[-1]] = value
        db.execute("UPDATE meta SET value = ? WHERE key = 'model'", (json.dumps(data),))

    return change


def meta(key: str, value: str) -> Change:
    return lambda db: db.execute("INSERT OR REPLACE INTO meta VALUES (?, ?)", (key, value))


LIES: dict[str, Change] = {
    "shape in too many brackets": sql("UPDATE arrays SET shape = ? WHERE name = 'points'", given=(DEEP,)),
    "shape of another size": sql("UPDATE arrays SET shape = '[1000000000, 2]' WHERE name = 'points'"),
    "shape that is left to be found": sql("UPDATE arrays SET shape = '[-1, 2]' WHERE name = 'points'"),
    "dtype of objects": sql("UPDATE arrays SET dtype = '|O' WHERE name = 'points'"),
    "dtype of dates": sql("UPDATE arrays SET dtype = '<M8[s]' WHERE name = 'points'"),
    "array as text": sql("UPDATE arrays SET data = 'hello' WHERE name = 'points'"),
    "points of 1e300": sql(
        "UPDATE arrays SET data = ? WHERE name = 'points'", given=(np.full(42, 1e300).tobytes(),)
    ),
    "model in too many brackets": meta("model", DEEP),
    "model of too many entries": meta("model", '{"format": 2, "a": [' + "{}," * 1_500_000 + "{}]}"),
    "model that is a list": meta("model", "[]"),
    "aspect ratio as text": model("mesh", "aspect_ratio", value="x"),
    "a name of a megabyte": model("formulation", value="z" * 1_000_000),
    "provenance that is a list": meta("provenance", "[1]"),
    "provenance of other things": meta("provenance", '{"input": ["x"], "versions": {}}'),
    "accuracy that is a list": meta("accuracy", "[]"),
    "accuracy of other things": meta("accuracy", '{"told": {"goal": 3}, "reason": ""}'),
    "a reason that is a number": meta("accuracy", '{"told": null, "reason": 7}'),
    "step as text": sql("UPDATE states SET step = 'a' WHERE id = 2"),
    "step that is not there": sql("UPDATE states SET step = 99 WHERE id > 1"),
    "lambda as text": sql("UPDATE states SET \"lambda\" = 'a'"),
    "mode as bytes": sql("UPDATE states SET mode = x'00'"),
    "note as bytes": sql("UPDATE states SET note = x'00'"),
    "cuts in too many brackets": sql("UPDATE states SET cuts = ?", given=(DEEP,)),
    "cuts that are numbers": sql("UPDATE states SET cuts = '[1]'"),
    "unknowns too few": sql("UPDATE states SET unknowns = substr(unknowns, 1, 80)"),
    "unknowns too many": sql("UPDATE states SET unknowns = unknowns || unknowns"),
    "unknowns of ten megabytes": sql("UPDATE states SET unknowns = zeroblob(10000000)"),
    "unknowns that are no numbers": sql(
        "UPDATE states SET unknowns = CAST(replace(hex(unknowns), '0', 'f') AS BLOB)"
    ),
    "points of other nodes": sql("UPDATE states SET points = substr(points, 1, 72)"),
    "no state of a reached step": sql("DELETE FROM states"),
    "step that ended and is not there": sql("UPDATE steps SET step = step + 10"),
    "history that nobody has": sql("INSERT INTO history VALUES (1, zeroblob(160))"),
    "critical point of another size": sql(
        'INSERT INTO critical (state, step, kind, "lambda", error, negative_before, negative_behind, unknowns, mode)'
        " VALUES (1, 0, 'limit', 0.5, 0.0, 0, 1, zeroblob(80), zeroblob(80))"
    ),
    "a view that never ends": sql(
        "ALTER TABLE steps RENAME TO others",
        f"CREATE VIEW steps AS {ENDLESS} SELECT x AS step, 'reached' AS outcome, '' AS reason, 0 AS iterations FROM c",
    ),
    "a trigger": sql("CREATE TRIGGER t AFTER INSERT ON steps BEGIN SELECT 1; END"),
    "a table of its own": sql("CREATE TABLE more (a)"),
}


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("solved")
    (folder / "scene.toml").write_text(SCENE, encoding="utf-8")
    words = ["run", str(folder / "scene.toml"), "-o", str(folder / "out"), "-q", "--no-estimate"]
    assert main(words) == 0
    return folder


def refused(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    capsys.readouterr()
    assert main([str(word) for word in words]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert len(said) < 1500
    return said


@pytest.mark.parametrize("name", LIES)
def test_a_path_file_that_lies_is_refused(
    name: str, solved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    shutil.copytree(solved / "out", out)
    with closing(sqlite3.connect(out / "path.bh")) as db, db:
        LIES[name](db)
    assert "path" in refused(capsys, "export", out, tmp_path / "a.obj")
    refused(capsys, "run", solved / "scene.toml", "-o", out, "-q", "--no-estimate", "--resume")
    with pytest.raises(InputError):
        bh.read(out).path[-1]


def test_a_path_file_with_too_many_states_or_bytes_is_refused(
    solved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = Path(shutil.copy(solved / "out" / "path.bh", tmp_path / "path.bh"))
    monkeypatch.setenv("BH_LIMIT_STORED_ROWS", "3")
    with pytest.raises(InputError, match=r"stored rows, more than 3.*BH_LIMIT_STORED_ROWS"):
        bh.Path.load(file)
    monkeypatch.delenv("BH_LIMIT_STORED_ROWS")
    assert bh.Path.load(file).reached
    with file.open("r+b") as stream:
        stream.truncate(600 * 2**20)  # a hole, which takes no disk
    with pytest.raises(InputError, match="600 stored megabytes, more than 500"):
        bh.Path.load(file)


def test_a_result_that_lies_is_refused(
    solved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    shutil.copytree(solved / "out", out)
    (out / "result.json").write_text("[" * 200_000, encoding="utf-8")
    with pytest.raises(InputError, match="is no result of bh"):
        bh.read(out)
    words = ["run", str(solved / "scene.toml"), "-o", str(out), "-q", "--no-estimate", "--resume"]
    assert main(words) == 0  # the path is whole, and the result is written anew
    assert json.loads((out / "result.json").read_text(encoding="utf-8"))["outcome"] == "reached"


def test_the_scene_of_a_path_is_not_looked_for_where_a_stranger_says(solved: Path, tmp_path: Path) -> None:
    """Drawings beside a scene that is not there are not read, whatever folder the path file names."""
    secret, out = tmp_path / "secret", tmp_path / "out"
    secret.mkdir()
    (secret / "sheet.svg").write_text("<svg/>", encoding="utf-8")
    shutil.copytree(solved / "out", out)
    text = SCENE.replace(
        'kind = "annulus_sector"\nradius = 100.0\nwidth = 10.0\nangle = 0.5', 'file = "sheet.svg"'
    )
    with closing(sqlite3.connect(out / "path.bh")) as db, db:
        meta("scene", json.dumps({"file": str(secret / "scene.toml"), "text": text}))(db)
    assert str(out / "sheet.svg") in bh.read(out).scene_reason
    (secret / "scene.toml").write_text(text, encoding="utf-8")  # it is here: the reader's own
    assert str(secret / "sheet.svg") in bh.read(out).scene_reason


def test_json_is_counted_before_it_is_parsed() -> None:
    assert parsed('{"a": [1, 2]}') == {"a": [1, 2]}
    for text in (7, b"{}", "{", DEEP, "[" + "1," * 2_000_000 + "1]", " " * 70_000_000):
        with pytest.raises(ValueError, match=r"JSON|text|Expecting"):
            parsed(text)


# --- data sets ----------------------------------------------------------------------------------------------------


def _texts(data: h5py.File) -> None:
    words = data.create_dataset("a", shape=(100,), dtype=h5py.string_dtype())
    for number in range(100):
        words[number] = "x" * 1_000_000


DATA: dict[str, tuple[Callable[[h5py.File], object], str]] = {
    "terabytes that are not there": (
        lambda data: data.create_dataset("a", shape=(10**6, 10**6), dtype="f8", chunks=(100, 100)),
        "stored megabytes",
    ),
    "packed zeros": (
        lambda data: data.create_dataset(
            "a", shape=(10**8,), dtype="f8", chunks=(10**6,), compression="gzip"
        ),
        "stored megabytes",
    ),
    "a part larger than the array": (
        lambda data: data.create_dataset("a", shape=(9,), maxshape=(None,), dtype="f8", chunks=(10**8,)),
        "stored megabytes",
    ),
    "another file's bytes": (
        lambda data: data.create_dataset("a", shape=(9,), dtype="u1", external=[("/etc/passwd", 0, 9)]),
        "other files",
    ),
    "another file's array": (
        lambda data: data.__setitem__("a", h5py.ExternalLink("other.nc", "/a")),
        "another place",
    ),
    "a large attribute": (lambda data: data.attrs.create("a", np.ones(8000)), ""),
    "a scale that is a text": (
        lambda data: data.create_dataset("a", data=np.ones(5)).attrs.__setitem__("scale_factor", "x"),
        "no data set that can be read",
    ),
}


@pytest.mark.parametrize("name", DATA)
@pytest.mark.parametrize("read", [bh.sweep.load, loaded], ids=["sweep", "segments"])
def test_a_data_set_that_lies_is_refused(
    name: str, read: Callable[[Path], object], tmp_path: Path, recwarn: pytest.WarningsRecorder
) -> None:
    make, words = DATA[name]
    with h5py.File(tmp_path / "x.nc", "w") as data:
        make(data)
    if words:
        with pytest.raises(InputError, match=words) as told:
            read(tmp_path / "x.nc")
        assert "\n" not in str(told.value)
    else:
        read(tmp_path / "x.nc")
    assert not recwarn.list


def test_texts_of_a_data_set_are_counted_as_they_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A hundred points may name one text of any length; the file is no larger for it."""
    monkeypatch.setenv("BH_LIMIT_STORED_MEGABYTES", "50")
    with h5py.File(tmp_path / "x.nc", "w") as data:
        _texts(data)
    if (tmp_path / "x.nc").stat().st_size < 50 * 2**20:
        pytest.skip("texts are kept once here")
    with pytest.raises(InputError, match="stored megabytes"):
        bh.sweep.load(tmp_path / "x.nc")


def test_a_journal_that_lies_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "x.points"
    details = Meta(identity="i", names=["t"], values=[[1.0]], grid=True, labels={}, attributes={})
    Journal.create(file, details).close()
    with closing(Journal.open(file)) as journal:
        assert journal.meta["identity"] == "i"
    with closing(sqlite3.connect(file)) as db, db:
        db.execute("INSERT INTO points VALUES (5, 'reached', '', '[1]', 0.0, 1, '')")
    with closing(Journal.open(file)) as journal, pytest.raises(InputError, match="measured is no table"):
        list(journal)
    with closing(sqlite3.connect(file)) as db, db:
        db.execute("UPDATE points SET measured = '{}'")
    with pytest.raises(InputError, match="is not a journal of a sweep"):
        bh.sweep.partial(tmp_path / "x")
    with closing(sqlite3.connect(file)) as db, db:
        db.execute("CREATE TRIGGER t AFTER INSERT ON points BEGIN SELECT 1; END")
    with pytest.raises(InputError, match="not of this format"):
        Journal.open(file)


def test_a_full_disk_leaves_nothing_behind(
    tmp_path: Path, solved: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither half a file, nor its journal, nor the folder that was made for it."""
    plain = sqlite3.connect

    def small(file: Path, timeout: float = 5.0) -> sqlite3.Connection:
        db = plain(file, timeout)
        db.execute("PRAGMA max_page_count = 3")
        return db

    monkeypatch.setattr("sqlite3.connect", small)
    out = tmp_path / "out"
    assert "disk is full" in refused(capsys, "run", solved / "scene.toml", "-o", out, "-q", "--no-estimate")
    details = Meta(identity="i", names=["x" * 20_000], values=[], grid=True, labels={}, attributes={})
    with pytest.raises(InputError, match="disk is full"):
        Journal.create(tmp_path / "x.points", details)
    assert list(tmp_path.iterdir()) == []
