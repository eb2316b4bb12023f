"""Results of studies as JSON."""

from __future__ import annotations

import json
import math
from typing import Any


def as_json(results: dict[str, Any]) -> str:
    """Return the results as JSON; a number that is not finite becomes null."""
    return json.dumps(_finite(results), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(child) for key, child in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(child) for child in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
