"""Explanations with one number or array that is inconsistent with the others.

The rest is valid and contains a long film, which takes seconds to render. So a reader that renders
before it has checked everything is too slow.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.evidence import EXPLANATION, changed
from benchmarks.hostile_case import Case, npz
from drone_rl.explanations.report.explanation import FORMAT, FORMAT_VERSION

STEPS = 400
"""Steps of the film."""
FRAMES = 50


def numbers() -> dict[str, Any]:
    """Return the content of `explanation.json` of a valid explanation."""
    film = {"heat_by": [None] * STEPS, "key_steps": [{"step": 0, "why": "start"}] * 6}
    frame = {"format": FORMAT, "format_version": FORMAT_VERSION, "name": "x"}
    parts = {key: EXPLANATION[key] for key in ("attribution", "places", "asymmetry")}
    of = {**frame, **parts, "contradictions": {"list": []}}
    worst = {"asymmetry.dataset.worst": [{"frame": 0, "distance": 0.5}]}
    return changed(of, {"attribution.film": film, "places.touch_distance": 1.65, **worst})


def arrays() -> dict[str, NDArray[Any]]:
    """Return the content of its `arrays.npz`."""
    zeros = np.zeros
    return {
        "film_frames": zeros((STEPS, 25, 64, 3), np.uint8),
        "film_heat": zeros((STEPS, 25, 64), np.float16),
        "film_probabilities": np.full((STEPS, 3), 1 / 3),
        "film_actions": zeros(STEPS, int),
        "places_points": np.array([[2.5, -8.0], [20.0, -8.0], [20.0, 8.0]]),
        "places_ends": np.array([3]),
        "places_labels": np.array([0]),
        "response_height": zeros(1),
        "response_forward": np.arange(4.0),
        "response_lateral": np.arange(5.0),
        "response_probabilities": np.full((1, 4, 5, 3), 1 / 3),
        "response_blind": zeros((1, 4, 5), bool),
        "response_oracle": zeros(5, int),
    }


def data() -> dict[str, NDArray[Any]]:
    """Return the content of its `dataset.npz`."""
    return {
        "frames": np.zeros((FRAMES, 25, 64, 3), np.uint8),
        "probabilities": np.full((FRAMES, 3), 1 / 3),
        "actions": np.zeros(FRAMES, int),
    }


NUMBERS: Mapping[str, tuple[str, Any]] = {
    "window_0": ("places.window", 0),
    "window_negative": ("places.window", -1),
    "window_1e9": ("places.window", 1e9),
    "window_empty": ("places.window", {}),
    "window_far": ("places.window.farthest", 1e9),
    "window_wide": ("places.window.sideways", 1e9),
    "window_of_no_width": ("places.window.sideways", 0),
    "window_turned": ("places.window.farthest", 1.0),
    "touch_as_text": ("places.touch_distance", "x"),
    "gap_far": ("places.least_gap_ahead", 1e300),
    "gap_negative": ("places.least_gap", -1),
    "action_alone": ("places.alone", 3),
    "shares_of_two_actions": ("places.actions", [0.5, 0.5]),
    "side_unknown": ("places.sides.behind", {}),
    "share_of_7": ("places.sides.left.share", 7),
    "heat_of_one_step": ("attribution.film.heat_by", [None]),
    "heat_unknown": ("attribution.film.heat_by", ["luck"] * STEPS),
    "key_step_late": ("attribution.film.key_steps", [{"step": STEPS, "why": "x"}]),
    "key_step_as_text": ("attribution.film.key_steps", [{"step": "0", "why": "x"}]),
    "worst_frame_late": ("asymmetry.dataset.worst", [{"frame": FRAMES, "distance": 0.5}]),
    "pair_negative": ("contradictions.list", [{"kind": "unknown", "left": -1, "right": 0}]),
}
"""Paths in `explanation.json` and their invalid values, by case."""
ARRAYS: Mapping[str, tuple[str, NDArray[Any]]] = {
    "heights_2": ("response_height", np.zeros(2)),
    "heights_none": ("response_height", np.zeros(0)),
    "blind_of_others": ("response_blind", np.zeros((1, 4, 6), bool)),
    "response_of_2_actions": ("response_probabilities", np.full((1, 4, 5, 2), 0.5)),
    "film_action_3": ("film_actions", np.full(STEPS, 3)),
    "film_of_fewer_steps": ("film_frames", np.zeros((1, 25, 64, 3), np.uint8)),
    "labels_2": ("places_labels", np.zeros(2, int)),
    "points_far": ("places_points", np.full((3, 2), 1e300)),
    "class_models_of_2_actions": ("class_model_logit", np.zeros((2, 1, 25, 64))),
    "map_of_other_frames": ("tsne_features", np.zeros((FRAMES - 1, 2))),
}
"""Names in `arrays.npz` and their invalid arrays, by case."""


def hostile_explanations(folder: Path) -> list[Case]:
    """Create the folders and return their cases.

    Args:
        folder: Parent folder.
    """
    contents = {name: (changed(numbers(), dict([change])), {}) for name, change in NUMBERS.items()}
    contents |= {name: (numbers(), dict([change])) for name, change in ARRAYS.items()}
    cases = []
    for name, (explanation, changes) in contents.items():
        here = folder / f"explanation_part_{name}"
        here.mkdir()
        (here / "explanation.json").write_text(json.dumps(explanation))
        for file, content in (("arrays", {**arrays(), **changes}), ("dataset", data())):
            (here / f"{file}.npz").write_bytes(npz(content))
        cases.append((here.name, ["report", f"explanations={here}"], "an inconsistent part"))
    return cases
