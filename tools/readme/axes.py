"""The table of the axes of perturbation."""

import math

from drone_rl.trust.axes import AXES

MEANINGS = {
    "object_color": "largest change of red, green and blue, which range from 0 to 1",
    "object_white": "fraction of white that is mixed into the color",
    "floor_color": "as `object_color`",
    "camera_yaw": "degrees to the left or right",
    "camera_pitch": "degrees up or down",
    "camera_roll": "degrees in either direction",
    "camera_height": "metres up or down",
    "camera_sideways": "metres to the left or right",
    "field_of_view": "degrees added to the horizontal field of view in training",
    "sun": "elevation above the horizon, degrees",
    "brightness": "factor of the camera's exposure",
    "fog": "visibility, metres",
    "object_size": "factor of the size in training",
    "distractors": "number of blue objects at the sides of the task's area",
    "noise": "standard deviation of each pixel's noise, in levels of 255",
    "slow_noise": "the same; consecutive frames correlate by 0.95",
    "blur": "standard deviation of a Gaussian, pixels",
    "dead_rows": "number of blank rows of pixels",
    "frozen_frames": "probability that a frame repeats the previous one",
    "late_frames": "steps by which images are delayed",
    "step_length": "factor of the step in training",
    "action_delay": "steps by which actions are delayed",
}
"""What the strength of each axis is."""


def list_axes() -> str:
    """Return a Markdown table with group and strengths of each axis of `drone-rl shifts`."""
    head = "| axis | group | a strength is | unperturbed | strengths | unit in `domain.yaml` |"
    lines = [head, "|---|---|---|---|---|---|"]
    for axis in AXES.values():
        neutral = "clear air" if math.isinf(axis.neutral) else f"{axis.neutral:g}"
        strengths = ", ".join(f"{strength:g}" for strength in axis.strengths)
        cells = f"{axis.group} | {MEANINGS[axis.name]} | {neutral} | {strengths} | {axis.unit}"
        lines.append(f"| `{axis.name}` | {cells} |")
    return "\n".join(lines)
