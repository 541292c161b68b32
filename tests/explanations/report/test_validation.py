"""What does not belong together in an explanation is refused by name."""

import copy

import numpy as np
import pytest

from drone_rl.explanations.report.validation import check_files
from drone_rl.sim.vocabulary import SHOWN_MOVES
from drone_rl.utils.errors import InputError

NUMBERS = {
    "attribution": {
        "film": {"heat_by": ["grad_cam", None], "key_steps": [{"step": 1, "why": "start"}]}
    },
    "asymmetry": {"dataset": {"worst": [{"frame": 2, "distance": 0.5}]}},
    "contradictions": {"list": [{"kind": "unknown", "left": 0, "right": 2}]},
    "places": {
        "window": {"nearest": 2.5, "farthest": 20.0, "sideways": 8.0},
        "actions": [0.5, 0.25, 0.25],
        "sides": {"left": {"share": 1.0, "actions": [0, 1, 0], "unseen": 0.0, "blind": 0.0}},
        "alone": 0,
        "touch_distance": 1.65,
        "unseen": 0.0,
        "blind": 0.0,
        "close": 0.0,
        "in_doubt": 0.0,
        "least_gap": 0.1,
        "least_gap_ahead": 3.0,
        "least_gap_left": -1.0,
        "logit_gap": 1e-4,
    },
}
ARRAYS = {
    "film_frames": np.zeros((2, 4, 6, 3), np.uint8),
    "film_actions": np.array([0, 2]),
    "tsne_pixels": np.zeros((3, 2)),
    "places_points": np.zeros((5, 2)),
    "places_ends": np.array([5]),
    "places_labels": np.array([0]),
    "response_height": np.zeros(1),
    "response_forward": np.zeros(4),
    "response_lateral": np.zeros(5),
    "response_probabilities": np.zeros((1, 4, 5, 3)),
    "response_blind": np.zeros((1, 4, 5), bool),
}
DATA = {"actions": np.array([0, 1, 2]), "frames": np.zeros((3, 4, 6, 3), np.uint8)}


def test_what_explain_writes_is_accepted():
    check_files(NUMBERS, ARRAYS, DATA, SHOWN_MOVES)
    check_files({"places": {"refused": "why"}}, {}, {}, SHOWN_MOVES)
    check_files({}, {}, {}, SHOWN_MOVES)


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("places.window", 0, "places.window="),
        ("places.window", -1, "places.window="),
        ("places.window", 1e9, "places.window="),
        ("places.window.farthest", 0, "places.window.farthest=0"),
        ("places.window.farthest", 1e9, "places.window.farthest="),
        ("places.window.farthest", 2.0, "must increase"),
        ("places.window.sideways", 1e-9, "as long as wide"),
        ("places.touch_distance", -1, "places.touch_distance=-1"),
        ("places.least_gap_left", 1e300, "places.least_gap_left="),
        ("places.alone", 3, "places.alone=3"),
        ("places.actions", [1], "places.actions="),
        ("places.sides.left.share", 7, "places.sides.left.share=7"),
        ("places.sides.up", {}, "places.sides.up is unknown"),
        ("attribution.film.heat_by", [None], "heat_by has 1 steps; the film has 2"),
        ("attribution.film.heat_by", [None, "luck"], r"heat_by\[1\]='luck' is unknown"),
        ("attribution.film.key_steps", [{"step": 2}], r"key_steps\[0\].step=2"),
        ("asymmetry.dataset.worst", [{"frame": 3}], r"worst\[0\].frame=3"),
        ("contradictions.list", [{"left": 0, "right": -1}], r"list\[0\].right=-1"),
    ],
)
def test_a_wrong_number(path, value, message):
    numbers = copy.deepcopy(NUMBERS)
    *outer, last = path.split(".")
    part = numbers
    for key in outer:
        part = part[key]
    part[last] = value
    with pytest.raises(InputError, match=message):
        check_files(numbers, ARRAYS, DATA, SHOWN_MOVES)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("response_height", np.zeros(2), "response_probabilities has 1 heights, but"),
        ("response_lateral", np.zeros(6), "has 5 places to the side, but"),
        ("response_height", np.zeros(0), "it is empty"),
        ("film_actions", np.array([0, 3]), "film_actions holds 0 to 3"),
        ("film_actions", np.array([0]), "film_actions has 1 steps of the film, but film_frames"),
        ("tsne_pixels", np.zeros((2, 2)), "tsne_pixels has 2 frames, but frames has 3"),
        ("places_labels", np.zeros(2, int), "has 2 outlines, but places_ends has 1"),
        ("places_points", np.full((5, 2), 1e5), "100000 m away"),
        ("class_model_logit", np.zeros((2, 1, 4, 4)), "has 2 actions, but the list of actions"),
    ],
)
def test_an_array_that_fits_no_other(name, value, message):
    with pytest.raises(InputError, match=message):
        check_files(NUMBERS, {**ARRAYS, name: value}, DATA, SHOWN_MOVES)


def test_unsigned_ends_of_outlines_may_not_decrease_either():
    outlines = {"places_ends": np.array([5, 3], np.uint64), "places_labels": np.zeros(2, int)}
    with pytest.raises(InputError, match="places_ends decrease"):
        check_files(NUMBERS, {**ARRAYS, **outlines}, DATA, SHOWN_MOVES)
