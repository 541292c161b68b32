"""A camera that is mounted otherwise in each world."""

import dataclasses
import itertools
import math

import pytest
import torch

from drone_rl.config import (
    MINIMAL,
    BaseTaskSettings,
    CameraSettings,
    PillarsSettings,
    TaskSettings,
)
from drone_rl.envs.fault_models import dead_rows, frozen_frames, late_frames, noise, out_of_focus
from drone_rl.policies.baselines import OracleAgent
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.worlds import Worlds
from drone_rl.trust.paired_evaluation import PairedEvaluator
from drone_rl.trust.perturbations import (
    DRIFT,
    MAX_DISTRACTORS,
    Condition,
    as_bright,
    clutter,
    expose,
    fog,
    make_faults,
    mount,
    reflect,
    sample_distractors,
    scene_appearance,
    sun_at,
    task_region,
    tint,
    variations,
    whiten,
)
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import world_random_state
from tests.trust.subjects import subject

SWAY = torch.tensor([[1.0], [-0.5]], dtype=torch.float64)


def test_mounting_of_each_environment():
    look = mount(offset=(0.0, 2.0, 1.0)).change(Appearance(), SWAY)
    assert look.camera.offset.tolist() == [[0.0, 2.0, 1.0], [0.0, -1.0, -0.5]]
    assert look.camera.turn.tolist() == [[1.0, 0.0, 0.0, 0.0]] * 2
    both = mount(turn="yaw", degrees=60.0).change(look, SWAY)
    assert both.camera.offset.tolist() == look.camera.offset.tolist()
    assert both.camera.turn[0].tolist() == pytest.approx([3**0.5 / 2, 0.0, 0.0, 0.5])


def test_mounting_keeps_the_appearance():
    own = Appearance(colors={SemanticClass.GROUND: (0.1, 0.2, 0.3)}, fog_visibility=50.0)
    look = mount(degrees=5.0).change(own, SWAY)
    assert (look.colors, look.fog_visibility) == (own.colors, 50.0)


@pytest.mark.parametrize("renderer", ["raytrace", "mujoco_warp"])
def test_image_of_a_moved_camera(renderer):
    """Half a metre higher, the horizon stays and the near ground shrinks: as if the drone rose."""
    worlds = Worlds(1, num_shards=1, renderer=renderer)
    worlds.reset(torch.arange(1), [world_random_state(0, 0)])
    risen = worlds.poses(worlds.state)
    risen.position = risen.position + torch.tensor([0.0, 0.0, 0.5])
    look = mount(offset=(0.0, 0.0, 0.5)).change(Appearance(), SWAY[:1])
    here = worlds.poses(worlds.state)
    drawn = [
        worlds.renderer.render(worlds.policy_view, poses, look)["rgb"].clone()
        for poses, look in ((risen, None), (here, look), (here, None))
    ]
    worlds.close()
    assert torch.equal(drawn[0], drawn[1])
    assert not torch.equal(drawn[0], drawn[2])


def test_combined_conditions():
    blurred, late = out_of_focus(1.0), late_frames(2)
    tinted, sun, moved = tint((SemanticClass.GROUND,), 0.1), sun_at(5.0), mount(degrees=3.0)
    one = Condition(
        task={"cube_size": 2.0}, appearance_changes=(tinted,), faults=(blurred,), delay=3
    )
    two = Condition(
        task={"cube_size": 3.0, "step_length": 0.5},
        camera={"horizontal_fov": 90.0},
        appearance_changes=(sun,),
        mounts=(moved,),
        faults=(late,),
        delay=1,
    )
    both = one | two
    assert both.task == {"cube_size": 3.0, "step_length": 0.5}
    assert both.camera == {"horizontal_fov": 90.0}
    assert (both.appearance_changes, both.mounts, both.faults) == (
        (tinted, sun),
        (moved,),
        (blurred, late),
    )
    assert both.delay == 3
    assert both.dimensions == (3, 0, 1)


CUBES = TaskSettings()


def test_distractors_are_blue_and_as_bright():
    red, green, blue = as_bright((0.75, 0.12, 0.08))
    assert 0.299 * red + 0.587 * green + 0.114 * blue == pytest.approx(0.30381)
    assert blue > green > red
    assert as_bright((1.0, 1.0, 1.0)) == (
        pytest.approx(0.4895, abs=1e-3),
        pytest.approx(0.979, abs=1e-3),
        1.0,
    )


def test_distractors_stand_next_to_the_task():
    places = sample_distractors(CUBES.object_region, 500, torch.Generator().manual_seed(0))
    assert places.shape == (500, MAX_DISTRACTORS, 3)
    x, y, z = places.flatten(0, 1).T
    assert 7.5 <= x.min() < 8 and 40 < x.max() <= 7.5 + 33
    assert 8 <= y.abs().min() < 8.1 and 15.9 < y.abs().max() <= 16
    assert abs((y > 0).double().mean() - 0.5) < 0.03
    assert (z == 2.5).all()


def test_distractors_are_appended_with_the_targets_size():
    places = torch.arange(12.0).reshape(2, 2, 3)
    look = clutter(None, CUBES.object_region, places)
    assert look.distractors.sizes.tolist() == [[2.5, 2.5]] * 2
    assert look.distractors.colors[1, 0].tolist() == pytest.approx(as_bright(CUBES.cube_color))
    both = clutter(look, CUBES.object_region, 1 + places[:, :1])
    assert both.distractors.places.tolist() == torch.cat([places, 1 + places[:, :1]], 1).tolist()


def test_oracle_ignores_distractors():
    evaluator = PairedEvaluator(
        subject(task=TaskSettings(num_cubes=1), camera=CameraSettings()), 20
    )
    for count in (0, 16):
        run = evaluator.run(Condition(clutter=count), agent=OracleAgent(only_visible=True))
        assert run.episodes.success.all()
    evaluator.close()


def test_task_without_objects():
    assert task_region(PillarsSettings()).size == 1.0

    class Other(BaseTaskSettings):
        name = "other"

    with pytest.raises(InputError, match="axes=distractors is not for task=other"):
        task_region(Other())


PLAIN = Appearance(
    colors={SemanticClass.TARGET: (0.8, 0.1, 0.0), SemanticClass.SKY: (0.6, 0.7, 0.9)},
    ambient=(0.3, 0.3, 0.3),
    sun=(0.7, 0.7, 0.7),
    sun_direction=(3.0, -4.0, -12.0),
)
NONE = torch.zeros(2, 0)


def test_tints_are_clipped():
    sway = torch.tensor([[1.0, -1.0, 1.0], [-0.5, 0.0, 1.0]], dtype=torch.float64)
    made = tint((SemanticClass.TARGET, SemanticClass.OBSTACLE), 0.3).change(PLAIN, sway)
    expected = torch.tensor([[1.0, 0.0, 0.3], [0.65, 0.1, 0.3]], dtype=torch.float64)
    torch.testing.assert_close(made.colors[SemanticClass.TARGET], expected)
    assert made.colors[SemanticClass.SKY] == PLAIN.colors[SemanticClass.SKY]
    assert SemanticClass.OBSTACLE not in made.colors


def test_whitening():
    made = whiten((SemanticClass.TARGET,), 0.5).change(PLAIN, NONE)
    assert made.colors[SemanticClass.TARGET].tolist() == pytest.approx([0.9, 0.55, 0.5])


def test_elevation_of_the_sun():
    made = sun_at(30.0).change(PLAIN, NONE).sun_direction
    assert made.tolist() == pytest.approx([0.6 * 3**0.5 / 2, -0.8 * 3**0.5 / 2, -0.5])


def test_exposure_and_fog():
    assert expose(2.0).change(PLAIN, NONE).exposure == 2.0
    assert expose(2.0).change(dataclasses.replace(PLAIN, exposure=0.75), NONE).exposure == 1.5
    assert fog(40.0).change(PLAIN, NONE).fog_visibility == 40.0


def test_appearance_of_a_scene_renders_the_same():
    worlds = Worlds(1, num_shards=1)
    look = scene_appearance(worlds.scene)
    x, y, z = look.sun_direction
    elevation = math.degrees(math.atan2(-z, math.hypot(x, y)))
    assert elevation == pytest.approx(MINIMAL.sun_elevation, abs=0.05)
    drawn = worlds.render(worlds.state).clone()
    assert torch.equal(worlds.render(worlds.state, appearance=look), drawn)
    worlds.close()


def test_classes_of_several_colors_are_kept():
    worlds = Worlds(1, task="pillars", num_shards=1)
    geoms = worlds.scene.geoms(SemanticClass.OBSTACLE)
    assert SemanticClass.OBSTACLE in scene_appearance(worlds.scene).colors
    worlds.scene.model.geom_rgba[geoms[0], :3] = (0.1, 0.2, 0.3)
    look = scene_appearance(worlds.scene)
    assert SemanticClass.OBSTACLE not in look.colors and SemanticClass.SKY in look.colors
    with pytest.raises(InputError, match="the task has no objects of one color"):
        whiten([SemanticClass.OBSTACLE], 0.5).change(look, NONE)
    worlds.close()


def first(mode, steps, count=1000, dimensions=(1, 2)):
    generator = torch.Generator().manual_seed(0)
    return [*itertools.islice(variations(mode, dimensions, count, generator), steps)]


@pytest.mark.parametrize("mode", ["constant", "onset"])
def test_constant_variations(mode):
    one, two = first(mode, 2)
    assert [part.shape for part in one] == [(1000, 1), (1000, 2)]
    assert all(torch.equal(a, b) for a, b in zip(one, two, strict=True))
    ways = torch.cat(one, -1)
    assert set(ways.unique().tolist()) == {-1.0, 1.0}
    assert abs(ways.mean()) < 0.1  # half of the worlds either way


def test_drifting_variations():
    walk = torch.stack([part[1] for part in first("drifting", 400, 300)])
    assert walk[0].abs().max() == 0
    assert walk.abs().max() <= 1
    assert (walk[1] - walk[0]).std() == pytest.approx(DRIFT, rel=0.1)
    assert walk[-1].std() == pytest.approx(3**-0.5, rel=0.1)  # anywhere alike, in the end


def test_reflection():
    away = torch.tensor([0.3, 1.0, 1.2, -1.3, 3.0, -5.0])
    torch.testing.assert_close(reflect(away), torch.tensor([0.3, 1.0, 0.8, -0.7, -1.0, -1.0]))


def test_variations_repeat():
    for one, two in zip(first("drifting", 5), first("drifting", 5), strict=True):
        assert all(torch.equal(a, b) for a, b in zip(one, two, strict=True))


def picture(*values):
    """A picture of 4x3 pixels in each world, all of one value."""
    return torch.tensor(values)[:, None, None, None].expand(-1, 1, 4, 3).clone()


ALL = torch.arange(2)


def test_dead_rows():
    few, more = (make_faults([dead_rows(n)], 2, seed=3) for n in (1, 2))
    dead = [spoil(picture(1.0, 1.0), ALL, True)[:, 0, :, 0] == 0 for spoil in (few, more)]
    assert [d.sum(-1).tolist() for d in dead] == [[1, 1], [2, 2]]
    assert (dead[0] <= dead[1]).all()
    assert torch.equal(few(picture(0.5, 0.5), ALL, False)[:, 0, :, 0] == 0, dead[0])
    assert (more(picture(1.0, 1.0), ALL, True, -1.0).amin() == -1).all()


def test_random_numbers_do_not_depend_on_which_episodes_are_running():
    gray, rows = torch.full((2, 1, 4, 3), 0.5), torch.tensor([1])
    both, one = (make_faults([noise(0.1), frozen_frames(0.5)], 2, seed=1) for _ in range(2))
    assert torch.equal(both(gray, ALL, True)[1:], one(gray, ALL, True)[1:])
    assert torch.equal(both(gray, ALL, False)[1:], one(gray[1:], rows, False))


def test_faults_that_hide_objects():
    faults = [noise(0.5), dead_rows(2), out_of_focus(2.0)]
    sharp = picture(1.0, 1.0)
    seen = make_faults(faults, 2, seed=5, hiding_only=True)(sharp, ALL, True)
    rows = make_faults([noise(0.0), dead_rows(2)], 2, seed=5)(sharp, ALL, True)
    assert torch.equal(seen, rows)  # the same rows are dead as in what the policy sees
    assert set(seen.unique().tolist()) == {0.0, 1.0}
