"""A policy of two pixels, whose map can be drawn by hand."""

import numpy as np
import pytest
import torch

from drone_rl.sim.actions import Move
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.action_map import BLIND, UNSEEN, map_actions
from drone_rl.verification.prover.arrangement import Window
from drone_rl.verification.prover.cube_images import NOTHING, CameraModel

EYE = CameraModel(
    np.array([1.0, -1.0]), np.array([0.0]), half=1.0, farthest=10.0, widest=10.0, bound=6.0
)
"""A pixel sees half left, one half right: fronts at Y = +-(D - 2 to D), sides to +-(D + 2)."""
WINDOW = Window(4.0, 5.0, 10.0)


def look(faces):
    """Bright where there is something of a cube."""
    return torch.from_numpy((faces != NOTHING).astype(np.float32))[:, None]


class Turns(torch.nn.Module):
    """Turns to the pixel that is bright; flies on by a gap of 0.5 where none is."""

    def forward(self, images):
        left, right = images[:, 0, 0].T
        return torch.stack([torch.full_like(left, 0.5), left, 0.8 * right], -1)


@pytest.fixture(scope="module")
def found():
    return map_actions(EYE, WINDOW, look, Turns(), touch_distance=3.0, most_cells=100)


def test_cells_areas_and_actions(found):
    """To either side: nothing to D - 2, front to D, side to D + 2, nothing to 10."""
    assert len(found.action) == 7
    assert found.alone == Move.FORWARD
    assert found.areas.sum() == pytest.approx(20)
    assert found.areas[found.action == Move.LEFT].sum() == pytest.approx(4)
    assert found.areas[found.action == Move.RIGHT].sum() == pytest.approx(4)
    assert found.areas[found.is_unseen].sum() == pytest.approx(12)
    places = np.array([[4.5, 3.0], [4.5, -3.0], [4.5, 0.0], [4.5, 9.0], [4.1, 6.0], [4.1, 6.2]])
    assert found.at(places).tolist() == [1, 2, 0, 0, 1, 0]


def test_the_summary(found):
    """Beyond 3 m to the left: nothing below D - 2 = 2..3 is left out; 6..7 to 10 is not seen."""
    told = found.summary(0.31)
    assert told["cells"] == 7 and told["area"] == pytest.approx(20)
    assert told["sides"]["ahead"]["share"] == pytest.approx(0.3)
    left, ahead = told["sides"]["left"], told["sides"]["ahead"]
    assert left["actions"] == pytest.approx([3.5 / 7, 3.5 / 7, 0])
    assert left[UNSEEN] == left[BLIND] == pytest.approx(0.5)
    assert ahead["actions"] == pytest.approx([5 / 6, 0.5 / 6, 0.5 / 6])
    assert ahead[BLIND] == 0
    assert told["actions"] == pytest.approx([0.6, 0.2, 0.2])
    assert (told[UNSEEN], told[BLIND], told["unmoved"]) == pytest.approx((0.6, 0.35, 0.6))
    assert told["least_gap"] == pytest.approx(0.3)  # right: 0.8 against 0.5
    assert told["least_gap_left"] < -2
    assert told["close"] == pytest.approx(0.2)
    assert found.summary(0.2)["close"] == 0
    assert 0 < told["in_doubt"] < 1e-4


def test_outlines_are_those_of_actions_and_of_what_is_not_seen(found):
    ways = found.outlines()
    assert ways["labels"].tolist().count(1) == 1 and ways["labels"].tolist().count(3) == 3
    parts = dict(zip(ways["labels"], np.split(ways["points"], ways["ends"][:-1]), strict=True))
    np.testing.assert_allclose(
        sorted(parts[1].tolist()), [[4, 2], [4, 6], [5, 3], [5, 7]], atol=1e-12
    )


def test_a_place_in_the_cube_is_refused():
    window = Window(1.0, 5.0, 10.0)
    with pytest.raises(InputError, match=r"nearest=1.0 .* more than 1.0"):
        map_actions(EYE, window, look, Turns(), touch_distance=3.0, most_cells=100)


def test_too_many_cells_are_refused():
    with pytest.raises(InputError, match="most_cells"):
        map_actions(EYE, WINDOW, look, Turns(), touch_distance=3.0, most_cells=2)
