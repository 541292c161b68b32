"""Number, position, size and color of distractors."""

import numpy as np
import pytest
import torch

from drone_rl.config import MINIMAL, AppearanceSettings, TaskSettings
from drone_rl.sim.tasks import as_task
from drone_rl.sim.visual_randomization import (
    HIDDEN_DEPTH,
    PALETTE,
    WIDTH,
    draw_distractors,
    most_distractors,
    object_region_of,
    stand,
)

CUBES = TaskSettings()
SOME = AppearanceSettings(
    distractors=(2, 5),
    distractor_size=(1.0, 2.0),
    distractor_distance=(3.0, 6.0),
    distractor_color=((0.0, 0.5, 0.0), (0.4, 0.5, 1.0)),
)


def test_colors_are_neither_red_nor_brown():
    for red, green, blue in PALETTE:
        assert min(red, green, blue) >= 0.0 and max(red, green, blue) <= 1.0
        assert green > 0.4 or blue > 0.4


def drawn(settings, seed):
    source = None if seed is None else np.random.RandomState(seed)
    return torch.tensor(draw_distractors(settings, CUBES.object_region, source)).reshape(-1, WIDTH)


def test_positions_are_beside_the_path():
    ahead, aside = torch.tensor([1.0, 2.0]), torch.tensor([3.0, 4.0])
    places = stand(CUBES.object_region, ahead, aside, torch.tensor([True, False]), 2.5)
    assert places.tolist() == [[1.0, 9.0, 2.5], [2.0, -10.0, 2.5]]  # cubes are within 6 m


def test_samples_fill_their_ranges():
    rows = torch.stack([drawn(SOME, seed) for seed in range(200)])
    assert rows.shape == (200, 5, WIDTH)
    stands = rows[..., 2] > 0
    assert {*stands.sum(1).tolist()} == {2, 3, 4, 5} and stands[:, :2].all()
    x, y, z, size = rows[..., :4].unbind(-1)
    assert x.min() >= 0 and 33 < x.max() <= 48  # the last cube is at 33 m, the first at 15 m
    beside = y.abs() - 6.0 - size / 2
    assert 3 <= beside.min() < 3.1 and 5.9 < beside.max() <= 6
    assert (z == size / 2)[stands].all() and torch.allclose(
        z[~stands], (size / 2 - HIDDEN_DEPTH)[~stands]
    )
    assert 1 <= size.min() < 1.05 and 1.95 < size.max() <= 2
    assert (rows[..., 5] == 0.5).all() and 0.3 < rows[..., 4].max() <= 0.4
    assert (y[:, 0] > 0).all() and (y[:, 1] < 0).all()  # alternating sides


def test_fixed_settings_need_fewer_samples():
    fixed = AppearanceSettings(distractors=3, distractor_size=2.0, distractor_distance=4.0)
    rows = drawn(fixed, 0)
    assert (rows[:, 3] == 2.0).all() and (rows[:, 1].abs() == 11.0).all()
    assert rows[:, 4:].tolist() == [pytest.approx(color) for color in PALETTE[:3]]
    assert not torch.equal(drawn(fixed, 1)[:, 0], rows[:, 0])


def test_middle_values_and_no_distractors():
    middle = drawn(SOME, None)
    assert (middle[:, 3] == 1.5).all() and (middle[:, 4] - 0.2).abs().max() < 1e-6
    assert draw_distractors(MINIMAL, CUBES.object_region, None) == []
    assert draw_distractors(SOME, None, None) == []


def test_only_tasks_with_objects_have_distractors():
    assert object_region_of(CUBES) == object_region_of(as_task(CUBES)) == CUBES.object_region
    assert object_region_of(object()) is None
    assert (most_distractors(SOME), most_distractors(MINIMAL)) == (5, 0)


def test_middle_positions_follow_the_golden_section():
    """Positions start at half of 48 m, alternate sides, and advance by 0.618 per pair."""
    turn = 0.6180339887498949
    shares = [(0.5 + pair * turn + side * 0.5) % 1.0 for pair in range(3) for side in (0, 1)][:5]
    rows = drawn(SOME, None)
    assert rows[:, 0].tolist() == pytest.approx([48 * share for share in shares], rel=1e-6)
    assert rows[:, 1].tolist() == [sign * (6 + 4.5 + 0.75) for sign in (1, -1, 1, -1, 1)]


def test_fixed_settings_draw_no_random_numbers():
    fixed = AppearanceSettings(distractors=3, distractor_size=2.0, distractor_distance=4.0)
    source, other = np.random.RandomState(0), np.random.RandomState(0)
    begin, shift = other.uniform(0.0, 1.0), other.uniform(-0.5, 0.5, 3)
    rows = torch.tensor(draw_distractors(fixed, CUBES.object_region, source)).reshape(-1, WIDTH)
    assert source.uniform() == other.uniform()
    shares = (begin + np.array([0.0, 0.5, 0.6180339887498949]) + shift / 3) % 1.0
    assert rows[:, 0].tolist() == pytest.approx((48 * shares).tolist(), rel=1e-6)
