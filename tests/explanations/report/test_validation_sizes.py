"""What a report can't render is refused by name."""

import numpy as np
import pytest

from drone_rl.explanations.report.validation import check_files
from drone_rl.sim.vocabulary import SHOWN_MOVES
from drone_rl.utils.errors import InputError

GOOD = {
    "film_frames": np.zeros((2, 4, 6, 3), np.uint8),
    "film_actions": np.array([0, 2]),
    "tsne_pixels": np.zeros((5, 2)),
    "something_else": np.zeros((3, 3, 3)),
}
DATA = {
    "flights/episode": np.array([0, 0, 1]),
    "actions": np.array([1] * 5),
    "step": np.array([7] * 5),
}


def test_what_explain_writes_is_accepted():
    check_files({"truth": {"methods": {"a": 1}}, "more": [1] * 2000}, GOOD, DATA, SHOWN_MOVES)
    check_files({"truth": 5}, {}, {}, SHOWN_MOVES)


@pytest.mark.parametrize(
    ("numbers", "arrays", "data", "name"),
    [
        (
            {"truth": {"methods": dict.fromkeys("abcdefghijklmnopq")}},
            {},
            {},
            "truth.methods has 17",
        ),
        ({"more": [0] * 2001}, {}, {}, "a list of 2001"),
        ({}, {"film_frames": np.zeros((2, 4, 6), np.uint8)}, {}, "film_frames is"),
        ({}, {"film_frames": np.zeros((1, 513, 1, 3), np.uint8)}, {}, "film_frames is"),
        ({}, {"film_frames": np.zeros((1, 4, 4, 3), np.uint16)}, {}, "images have uint8"),
        ({}, {"film_actions": np.array([16])}, {}, "film_actions holds"),
        ({}, {"tsne_pixels": np.array([["a", "b"]])}, {}, "tsne_pixels is"),
        ({}, {"patch_effects": np.zeros((500, 500))}, {}, "patch_effects is"),
        ({}, {}, {"flights/episode": np.array([0, 2])}, "flights/episode holds"),
        ({}, {}, {"flights/episode": np.array([-1])}, "flights/episode holds"),
        ({}, {}, {"episode": np.array([2**40])}, "episode holds"),
    ],
)
def test_what_is_refused(numbers, arrays, data, name):
    with pytest.raises(InputError, match=name):
        check_files(numbers, arrays, data, SHOWN_MOVES)
