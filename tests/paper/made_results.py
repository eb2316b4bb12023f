"""Results of `continuair paper` and their folder, made of what is recorded: no flight is flown."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

from amiri2026.paper.recorded import recorded
from amiri2026.paper.report import as_table
from continuair.studies.results import MARKER


def made_results() -> dict[str, Any]:
    """A few sentences, of every part and kind, with all that a run writes of each."""
    found = recorded()
    kept: dict[tuple[Any, ...], dict[str, Any]] = {}
    for entry in found["sentences"]:
        key = entry["id"].partition(".")[0], bool(entry["cases"]), bool(entry["correction"])
        kept.setdefault(key, entry)
    more = {"measure": "the error", "redo": "continuair paper --only X", "times": {"a step": 1e-6}}
    entries = [entry | more for entry in kept.values()]
    counts = dict(Counter(entry["verdict"] for entry in entries))
    vehicle = {"name": "paper", "uav": {"mass": 2.0}, "camera": {"tip_frame": "untwisted"}}
    return found | {"sentences": entries, "counts": counts, "vehicle": vehicle}


def write_results(folder: Path, results: dict[str, Any] | None = None) -> Path:
    """Write the folder of a run without figures."""
    found = made_results() if results is None else results
    folder.mkdir(parents=True)
    marker = {"study": "paper", "version": "0.1.0", "command": "continuair paper", "files": [],
              "parts": []}  # fmt: skip
    (folder / MARKER).write_text(json.dumps(marker))
    (folder / "paper.json").write_text(json.dumps(found))
    (folder / "table.md").write_text(as_table(found))
    return folder
