import math

import torch

from drone_rl.config import CameraSettings
from drone_rl.sim.tasks.pillars import changes
from tests.sim.tasks.pillars.conftest import body

FAR = (6.0, -6.0)


def test_the_next_pillar_is_the_one_nearest_to_the_way_in_the_next_row(field):
    assert changes.next_pillar(field((5.0, -2.0), FAR)) == 1
    assert changes.next_pillar(field((5.0, -2.0), FAR, y=4.0)) == 0
    state = field((5.0, -2.0), (7.0, 1.0))
    state.passed[:, 0] = True
    assert changes.next_pillar(state) == 3
    assert changes.next_offset(state)[0].tolist() == [16.0, 1.0, 0.0]
    state.passed[:] = True
    assert changes.next_pillar(state) == 4 and changes.next_offset(state).isnan().all()


def test_a_pillar_that_does_not_stand_is_none(field):
    state = changes.without_next(field((5.0, -2.0), FAR))
    assert state.present[0].tolist() == [True, False, True, True]
    assert changes.next_pillar(state) == 0
    assert changes.next_pillar(changes.without_next(state)) == 4


def test_one_pillar_alone(settings):
    state = changes.one_pillar(settings, body(3.0, 1.0), torch.tensor([[5.0, -2.0, 0.0]]))
    assert state.pillars[0, 0].tolist() == [8.0, -1.0, 3.0] and state.present.sum() == 1


def test_pillars_elsewhere_stand_at_none_of_their_places_nor_at_the_drone(field, settings):
    state = field((5.0, -2.0), FAR)
    generator = torch.Generator().manual_seed(0)
    other = changes.elsewhere(settings, state, CameraSettings(), generator)
    away = other.pillars[..., :2] - state.drone[:, None, :2]
    assert (away[..., 0] >= settings.touch_distance + settings.width).all()
    assert (other.pillars[..., 2] == 3.0).all() and other.present.all()
    assert not torch.isclose(other.pillars, state.pillars)[..., :2].all(-1).any()


def test_the_grid_reaches_over_the_field(settings):
    grid = changes.grid(settings, 3, 5)
    assert grid.forward.tolist() == [1.5, 5.25, 9.0]
    assert grid.lateral.tolist() == [8.0, 4.0, 0.0, -4.0, -8.0]


def test_pillars_elsewhere_fill_what_is_in_view(field, settings):
    """From 2.2 m ahead to where the second row stands, 16 m; up to 16 m to either side."""
    state = field((5.0, -2.0), FAR)[torch.zeros(800, dtype=torch.int64)]
    camera = CameraSettings()
    found = changes.elsewhere(settings, state, camera, torch.Generator().manual_seed(0))
    away = (found.pillars[..., :2] - state.drone[:, None, :2]).flatten(0, 1)
    ahead, aside = away.unbind(-1)
    edge = math.tan(math.radians(camera.horizontal_fov / 2))
    assert 2.2 <= ahead.min() < 2.3 and 15.9 < ahead.max() <= 16.0
    slope = aside / ahead
    assert -edge <= slope.min() < -0.98 * edge and 0.98 * edge < slope.max() <= edge
    assert 15.5 < aside.abs().max() <= 16.0 + 1e-9 and abs(slope.mean()) < 0.1 * edge
    near = slope.abs() < 0.4 * edge  # all as far as 16 m
    assert torch.corrcoef(torch.stack([ahead, slope])[:, near])[0, 1].abs() < 0.1
    assert abs(ahead[near].mean() - (2.2 + 16.0) / 2) < 0.4


def test_the_grid_begins_half_a_step_from_touching(settings):
    short = settings.replace(step_length=0.5)
    assert changes.grid(short, 2, 2).forward.tolist() == [1.25, 9.0]
