"""What the records said at the last release, so that the report can say what has changed since.

A line a record: 12 hexadecimal digits for its case, quantity, source and parameters, then its value and whether it
passed. `python -m verification.framework.release VERSION results/checks.json` writes the file (docs/releasing.md).
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

RELEASE = Path(__file__).parents[1] / "release.json"
# parameters that are results: they do not tell records apart
FOUND = ("rate", "error_bar", "finest", "seconds")

Key = tuple[str, str, str, str, int]


def keys(records: Iterable[Mapping[str, Any]]) -> list[Key]:
    """What tells each record from all others: case, quantity, source, parameters, and how many alike came before.

    Args:
        records: as they are stored.
    """
    seen: dict[tuple[str, str, str, str], int] = {}
    found: list[Key] = []
    for record in records:
        params = {key: value for key, value in record["params"].items() if key not in FOUND}
        plain = (record["case"], record["quantity"], record["source"], json.dumps(params, sort_keys=True))
        seen[plain] = seen.get(plain, -1) + 1
        found.append((*plain, seen[plain]))
    return found


def digest(key: Key) -> str:
    """12 hexadecimal digits of a key; two of 10,000 records are alike once in 5 million releases."""
    return hashlib.sha256(json.dumps(key).encode()).hexdigest()[:12]


def of_release(data: Mapping[str, Any], version: str) -> dict[str, Any]:
    """What is kept of results: {"version", "date", "cases": {case: {digest: [value, passed]}}}.

    Args:
        data: of `checks.json`; quick cases are left out.
        version: that is released.
    """
    whole = {info["name"] for info in data["cases"] if not info.get("quick", data.get("quick"))}
    cases: dict[str, dict[str, Any]] = {}
    for key, record in zip(keys(data["checks"]), data["checks"], strict=True):
        if record["case"] in whole:
            cases.setdefault(record["case"], {})[digest(key)] = [record["value"], record["passed"]]
    return {"version": version, "date": data["date"], "cases": cases}


def main(version: str, results: Path, to: Path = RELEASE) -> None:
    """Write the file of a release.

    Args:
        version: that is released.
        results: `checks.json` of a full run.
        to: the file to write.
    """
    kept = of_release(json.loads(results.read_text(encoding="utf-8")), version)
    to.write_text(json.dumps(kept, indent=0) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
