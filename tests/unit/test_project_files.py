"""What newcomers meet first says the same everywhere: versions, changelog, decisions, glossary, workflow."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
RELEASE = re.compile(r"^## \[(\d+\.\d+\.\d+)\] - (\d{4}-\d{2}-\d{2})$", re.MULTILINE)


def text_of(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def slug(heading: str) -> str:
    """The anchor that code hosts and MyST give a heading."""
    return re.sub(r"[^\w\s-]", "", heading.lower()).replace(" ", "-")


def test_one_version_everywhere() -> None:
    version, date = RELEASE.findall(text_of("CHANGELOG.md"))[0]
    citation = yaml.safe_load(text_of("CITATION.cff"))
    assert PROJECT["project"]["version"] == version == citation["version"]
    assert str(citation["date-released"]) == date
    assert citation["license"] == PROJECT["project"]["license"]
    assert citation["authors"] == PROJECT["project"]["authors"]


def test_changelog_has_released_versions_with_the_kinds_of_changes() -> None:
    parts = re.split(r"^## ", text_of("CHANGELOG.md"), flags=re.MULTILINE)[1:]
    assert parts[0].startswith("[Unreleased]\n")
    assert all(RELEASE.match(f"## {part.splitlines()[0]}") for part in parts[1:])
    kinds = {"Added", "Changed", "Deprecated", "Fixed", "Removed", "Security"}
    for part in parts:
        found = re.findall(r"^### (.*)$", part, re.MULTILINE)
        assert len(found) == len(set(found))
        assert set(found) <= kinds


def test_no_line_of_the_changelog_stands_twice() -> None:
    """A merge once left one there."""
    lines = [line.strip() for line in text_of("CHANGELOG.md").splitlines() if len(line) > 60]
    assert [line for line in lines if lines.count(line) > 1] == []
    tails = [line[-60:] for line in lines]
    assert [tail for tail in tails if tails.count(tail) > 1] == []


def test_no_marks_of_a_merge() -> None:
    """Text that a merge has left unresolved is in no file."""
    kinds = {".md", ".py", ".toml", ".yml", ".lock", ".cff", ".json"}
    folders = ("bh", "docs", "examples", "fem", "meshes", "reports", "tests", "verification")
    files = [p for p in ROOT.iterdir() if p.is_file()] + [p for f in folders for p in (ROOT / f).rglob("*")]
    marks = tuple(7 * mark + " " for mark in "<>")
    for file in files:
        if file.suffix in kinds and file.is_file():
            lines = file.read_text(encoding="utf-8").splitlines()
            assert not [line for line in lines if line.startswith(marks)], file


def test_decisions_are_numbered_dated_and_in_the_index() -> None:
    text = text_of("docs/decisions.md")
    index, _, body = text.partition("\n## ")
    headings = re.findall(r"^### (\d+\. .*)$", body, re.MULTILINE)
    numbers = [int(heading.split(".")[0]) for heading in headings]
    assert sorted(numbers) == list(range(1, len(numbers) + 1))
    assert sorted(re.findall(r"^- \[(\d+\. .*)\]\(#(.*)\)$", index, re.MULTILINE)) == sorted(
        (heading, slug(heading)) for heading in headings
    )
    assert len(re.findall(r"^\*\d{4}-\d{2}-\d{2}\.\* ", body, re.MULTILINE)) == len(headings)
    groups = re.findall(r"^## (.*)$", text, re.MULTILINE)
    assert re.findall(r"^\*\*(.*)\*\*$", index, re.MULTILINE) == groups


def test_glossary_is_in_order_and_short() -> None:
    terms, _, _ = text_of("docs/glossary.md").partition("\n## ")
    entries = re.findall(r"^\*\*(.*?)\.\*\* (.*)$", terms, re.MULTILINE)
    names = [name for name, _ in entries]
    assert len(names) >= 60
    assert names == sorted(names, key=str.lower)
    for name, about in entries:
        assert 20 < len(about) <= 320, name


def test_glossary_explains_every_outcome() -> None:
    solver = text_of("docs/solver.md").split("| outcome | means |")[1].split("\n\n")[0]
    outcomes = re.findall(r"^\| `([a-z-]+)` \|", solver, re.MULTILINE)
    assert len(outcomes) >= 6
    for outcome in outcomes:
        assert f"`{outcome}`" in text_of("docs/glossary.md")


@pytest.fixture(scope="module")
def workflow() -> dict[str, Any]:
    found = yaml.safe_load(text_of(".github/workflows/ci.yml"))
    assert isinstance(found, dict)
    return found


def test_workflow_runs_on_every_system_and_python_that_is_named(workflow: dict[str, Any]) -> None:
    matrix = workflow["jobs"]["test"]["strategy"]["matrix"]
    named = [line.split(" :: ")[-1] for line in PROJECT["project"]["classifiers"] if "Python :: 3." in line]
    assert matrix["python"] == named
    assert {name.split("-")[0] for name in matrix["os"]} == {"ubuntu", "macos", "windows"}
    assert f">={named[0]}" == PROJECT["project"]["requires-python"]


def test_workflow_calls_what_ci_run_calls_and_needs_no_secret(workflow: dict[str, Any]) -> None:
    assert "secrets" not in text_of(".github/workflows/ci.yml")
    assert workflow["permissions"] == {"contents": "read"}
    runs = [step.get("run", "") for step in workflow["jobs"]["test"]["steps"]]
    assert ".ci/run" in runs
    # Windows has no make: every command of `make lint` and `make test` is there by name
    makefile = text_of("Makefile")
    commands = re.findall(r"^\t@\$\(PY\) -m ((?:ruff|mypy|pytest).*)$", makefile, re.MULTILINE)
    wanted = [command.replace(" $(PYTEST_ARGS)", "") for command in commands if "--cov" not in command]
    wanted = [command for command in wanted if "--fix" not in command and "benchmarks" not in command]
    assert "pytest -n auto --maxprocesses=4 --dist worksteal" in wanted
    for command in wanted:
        if command != "ruff format .":
            assert f".venv/Scripts/python -m {command}" in "\n".join(runs)


def test_hooks_download_nothing_and_run_the_linters() -> None:
    repos = yaml.safe_load(text_of(".pre-commit-config.yaml"))["repos"]
    assert [repo["repo"] for repo in repos] == ["local"]
    hooks = repos[0]["hooks"]
    assert [hook["id"] for hook in hooks] == ["ruff-check", "ruff-format", "mypy"]
    for hook in hooks:
        assert hook["language"] == "unsupported"
        assert hook["entry"].startswith(".venv/bin/python -m ")
        assert "additional_dependencies" not in hook


def loosely_checked(tool: dict[str, Any]) -> list[str]:
    """What the type checker would pass over, by its settings."""
    folders = {"bh", "fem", "meshes", "verification", "reports", "tests"}
    found = sorted(folders - set(tool["files"])) + ([] if tool.get("strict") else ["strict"])
    found += [str(one["module"]) for one in tool.get("overrides", []) if one.get("ignore_errors")]
    return found + (["exclude"] if tool.get("exclude") else [])


def test_the_type_checker_reads_everything_strictly() -> None:
    """Tests too, and no module is let off as a whole."""
    assert loosely_checked(PROJECT["tool"]["mypy"]) == []
    loose = {"files": ["bh"], "exclude": "x", "overrides": [{"module": "fem.*", "ignore_errors": True}]}
    assert loosely_checked(loose) == [
        "fem",
        "meshes",
        "reports",
        "tests",
        "verification",
        "strict",
        "fem.*",
        "exclude",
    ]


def test_tools_of_the_project_are_in_the_lock() -> None:
    locked = {line.split("==")[0] for line in text_of("requirements.lock").splitlines()}
    wanted = PROJECT["project"]["dependencies"] + PROJECT["project"]["optional-dependencies"]["dev"]
    names = {re.split(r"[\[>=<;]", line)[0].strip() for line in wanted}
    assert names - {PROJECT["project"]["name"]} <= locked


def test_no_test_looks_outside_the_repository() -> None:
    """Parents of a test's own folder end at the root: `parents[2]` of tests/unit/test_NAME.py."""
    for file in sorted((ROOT / "tests").rglob("*.py")):
        depth = len(file.relative_to(ROOT).parts) - 1
        for found in re.findall(r"parents\[(\d+)\]", file.read_text(encoding="utf-8")):
            assert int(found) <= depth, f"{file.name} leaves the repository"


# --------------------------------------------------------------------------------------------------- addresses


def made_up(urls: dict[str, str]) -> list[str]:
    """Names of addresses that lead nowhere: not https, or of a domain that is reserved for examples (RFC 2606)."""
    nowhere = re.compile(r"https://([^/]+\.)?(invalid|example|test|localhost|example\.(com|org|net))(/|$)")
    return [name for name, url in urls.items() if not url.startswith("https://") or nowhere.match(url)]


def test_no_address_is_made_up() -> None:
    """What `pip show` and an index print as links opens, or is not there (docs/releasing.md)."""
    assert made_up(PROJECT["project"].get("urls", {})) == []
    assert made_up(
        {"Source": "https://code.example/x", "Issues": "https://example.org", "Home": "docs/"}
    ) == [
        "Source",
        "Issues",
        "Home",
    ]
    assert made_up({"Source": "https://codeberg.org/name/project", "Docs": "https://protest.org/"}) == []
