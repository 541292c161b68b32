"""The table of the axes of perturbation."""

import math

from drone_rl.robustness.axes import AXES


def list_axes() -> str:
    """Return a Markdown table with group, unit and strengths of each axis of `drone-rl shifts`."""
    lines = ["| axis | group | unit | without perturbation | strengths |", "|---|---|---|---|---|"]
    for axis in AXES.values():
        neutral = "clear air" if math.isinf(axis.neutral) else f"{axis.neutral:g}"
        strengths = ", ".join(f"{strength:g}" for strength in axis.strengths)
        lines.append(f"| `{axis.name}` | {axis.group} | {axis.unit} | {neutral} | {strengths} |")
    return "\n".join(lines)
