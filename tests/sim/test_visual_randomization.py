"""Fixed appearances, appearances sampled at every reset, and distractors."""

import math

import numpy as np
import pytest
import torch
from PIL import Image

from drone_rl.config import AppearanceSettings, PillarsSettings, TaskSettings
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.visual_randomization import (
    HIDDEN_DEPTH,
    WIDTH,
    AppearanceSampler,
    draw_distractors,
    stand,
)
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import world_random_state

DRAWN = AppearanceSettings(
    sun_elevation=(30.0, 30.0),
    sun_azimuth=(0.0, 90.0),
    fog_visibility=(50.0, 100.0),
    shadows=0.5,
    sky_zenith=((0.0, 0.5, 1.0), (1.0, 0.5, 1.0)),
    ground_texture=("none", "grid", "bricks"),
    ground_tile=(2.0, 4.0),
)


def streams(count):
    return [world_random_state(0, world) for world in range(count)]


def reset(settings, count):
    looks = AppearanceSampler(settings, count)
    looks.reset(torch.arange(count), streams(count))
    return looks


def test_fixed_appearance_is_shared_by_all_environments():
    looks = reset(AppearanceSettings(sun_elevation=30.0, sun_azimuth=90.0, sun_strength=0.5), 3)
    look = looks.middle
    assert looks.current() is None and not looks.varies
    # sun on the left at 30 degrees: light points right and down
    wanted = [0.0, -math.sqrt(0.75), -0.5]
    assert look.sun_direction.tolist() == pytest.approx(wanted, abs=1e-9)
    assert look.sun.tolist() == [0.5] * 3 and look.ambient.tolist() == [0.35] * 3
    assert look.fog_visibility is None and look.zenith is None and look.is_plain
    assert set(look.colors) == {SemanticClass.SKY, SemanticClass.GROUND}


def test_samples_fill_their_ranges():
    look = reset(DRAWN, 400).current()
    assert 50 <= look.fog_visibility.min() < 55 and 95 < look.fog_visibility.max() <= 100
    assert 160 < look.shadows.sum() < 240
    assert (look.zenith[:, 1:] == torch.tensor([0.5, 1.0])).all() and look.zenith[:, 0].std() > 0.2
    assert torch.allclose(look.sun_direction[:, 2], torch.tensor(-0.5, dtype=torch.float64))
    ground = look.textures[SemanticClass.GROUND]
    assert ground.images == ("grid", "bricks") and 2 <= ground.size.min() <= ground.size.max() <= 4
    assert all(100 < (ground.choice == which).sum() < 170 for which in (-1, 0, 1))


def test_middle_appearance_is_the_center_of_ranges():
    middle = AppearanceSampler(DRAWN, 2).middle
    assert middle.fog_visibility == 75.0 and middle.zenith.tolist() == [0.5, 0.5, 1.0]
    assert middle.textures[SemanticClass.GROUND].choice == -1  # the first


def test_sampling_does_not_advance_the_environments_stream():
    alone, together = reset(DRAWN, 1), reset(DRAWN, 5)
    assert torch.equal(alone.values[0], together.values[0])
    assert len({tuple(row) for row in together.values.tolist()}) == 5
    (state,) = streams(1)
    alone.reset(torch.tensor([0]), [state])
    assert state.uniform() == streams(1)[0].uniform()


def test_only_reset_environments_are_resampled():
    looks = reset(DRAWN, 3)
    before, part = looks.values, looks.current(torch.tensor([2]))
    looks.reset(torch.tensor([1]), [np.random.RandomState(9)])
    assert torch.equal(looks.values[[0, 2]], before[[0, 2]])
    assert not torch.equal(looks.values[1], before[1])
    assert torch.equal(looks.current().fog_visibility[2:], part.fog_visibility)
    looks.load(before)
    assert torch.equal(looks.current().fog_visibility, before[:, 14])


MOUNTED = DRAWN.replace(
    distractors=(1, 3), camera_offset=((-1, 0, 0), (1, 0, 0.5)), camera_turn=(0, 0, 90)
)


def test_later_settings_do_not_change_earlier_samples():
    before, after = reset(DRAWN, 5), reset(MOUNTED, 5)
    own = before.values.shape[1] - 7  # values of the camera are last, then those of distractors
    assert torch.equal(before.values[:, :own], after.values[:, :own])
    assert after.values.shape[1] == own + 7 + 3 * 7


def test_camera_and_distractors_of_each_environment():
    looks = reset(MOUNTED, 50)
    look = looks.current()
    forward, left, up = look.camera.offset.T
    assert -1 <= forward.min() < -0.8 and 0.8 < forward.max() <= 1
    assert (left == 0).all() and 0 <= up.min() < up.max() <= 0.5
    half = math.sqrt(0.5)
    assert look.camera.turn.tolist() == [pytest.approx([half, 0, 0, half])] * 50
    assert look.camera.zoom is None and looks.distractors == 3
    assert look.distractors.places.shape == (50, 3, 3)
    part = looks.current(torch.tensor([4, 7]))
    assert torch.equal(part.distractors.places, look.distractors.places[[4, 7]])
    assert torch.equal(look[torch.tensor([4, 7])].distractors.colors, part.distractors.colors)
    assert looks.middle.distractors.expand(2).sizes.shape == (2, 3)


@pytest.mark.parametrize("size", [None, (4097, 2)])
def test_textures_are_read_at_construction(tmp_path, size):
    path = tmp_path / "ground.png"
    if size:
        Image.new("RGB", size).save(path)
    with pytest.raises(InputError, match=r"ground\.png"):
        AppearanceSampler(AppearanceSettings(object_texture=("none", str(path))), 1)


@pytest.mark.parametrize("task", [TaskSettings(), PillarsSettings()])
def test_defaults_equal_the_appearance_of_the_tasks(task):
    """Compare with an appearance whose differences are invisible."""
    worlds = Worlds(2, task)
    worlds.reset(torch.arange(2), streams(2))
    plain = worlds.render(worlds.state)
    worlds.appearance = AppearanceSampler(AppearanceSettings(fog_visibility=100_000.0), 2).middle
    clear = worlds.render(worlds.state)
    assert (plain.int() - clear.int()).abs().max() <= 2 and not torch.equal(plain, clear)
    worlds.close()


CUBES = TaskSettings()


SOME = AppearanceSettings(
    distractors=(2, 5),
    distractor_size=(1.0, 2.0),
    distractor_distance=(3.0, 6.0),
    distractor_color=((0.0, 0.5, 0.0), (0.4, 0.5, 1.0)),
)


def drawn(settings, seed):
    source = None if seed is None else np.random.RandomState(seed)
    return torch.tensor(draw_distractors(settings, CUBES.object_region, source)).reshape(-1, WIDTH)


def test_positions_are_beside_the_path():
    ahead, aside = torch.tensor([1.0, 2.0]), torch.tensor([3.0, 4.0])
    places = stand(CUBES.object_region, ahead, aside, torch.tensor([True, False]), 2.5)
    assert places.tolist() == [[1.0, 9.0, 2.5], [2.0, -10.0, 2.5]]  # cubes are within 6 m


def test_distractors_fill_their_ranges():
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


def test_fixed_settings_draw_no_random_numbers():
    fixed = AppearanceSettings(distractors=3, distractor_size=2.0, distractor_distance=4.0)
    source, other = np.random.RandomState(0), np.random.RandomState(0)
    begin, shift = other.uniform(0.0, 1.0), other.uniform(-0.5, 0.5, 3)
    rows = torch.tensor(draw_distractors(fixed, CUBES.object_region, source)).reshape(-1, WIDTH)
    assert source.uniform() == other.uniform()
    shares = (begin + np.array([0.0, 0.5, 0.6180339887498949]) + shift / 3) % 1.0
    assert rows[:, 0].tolist() == pytest.approx((48 * shares).tolist(), rel=1e-6)
