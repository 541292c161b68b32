"""Say under which other conditions than in its training a policy flew."""

import json
from typing import Any

from drone_rl.utils.text import Evidence, listed

_MAX_NAMED = 4
"""Greatest number of items in a sentence; the last one counts the settings that do not fit."""


def unlike(evidence: Evidence) -> str:
    """Return how dynamics and appearance (dotted names) differ from those of training."""
    differences = evidence["unlike"]
    parts = [
        f"{name if '.' in name else f'dynamics.{name}'}={_said(of['flown'])} instead of "
        f"{_said(of['own'])}"
        for name, of in differences.items()
    ]
    if len(parts) > _MAX_NAMED:
        parts[_MAX_NAMED - 1 :] = [f"{len(parts) - _MAX_NAMED + 1} other changed settings"]
    moved = [] if all("." in name for name in differences) else ["other dynamics"]
    seen = ["another appearance"] if any("." in name for name in differences) else []
    return f"It was trained with {listed(moved + seen)}: here it flew with {listed(parts)}."


def _said(value: Any) -> str:
    """Return a value as one types it in a setting."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_said, value))}]"
    if isinstance(value, float):
        return f"{value:.12g}"  # without ".0"
    return value if isinstance(value, str) else json.dumps(value)
