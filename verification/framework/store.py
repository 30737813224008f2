"""Results of a long case on disk as they are found, so that a run that was stopped goes on where it was."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from verification.framework.environment import environment


@dataclass
class Store:
    """Plain data by key in one JSON file."""

    file: Path
    runs: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def open(cls, folder: Path, name: str, quick: bool) -> Store:
        """What `folder / name` holds of a run of these versions, else nothing."""
        file = folder / name
        made_by = {"versions": environment(), "quick": quick}
        try:
            found = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            found = {}
        same = isinstance(found, dict) and found.get("made_by") == made_by
        return cls(file, found if same else {"made_by": made_by})

    def keep(self, key: str, value: Any) -> None:
        """Write a result at once."""
        self.runs[key] = value
        draft = self.file.with_suffix(".part")
        draft.write_text(json.dumps(self.runs), encoding="utf-8")
        draft.replace(self.file)
