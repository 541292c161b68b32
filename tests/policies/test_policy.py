"""Policies by name, file and run, and in a changed task."""

from pathlib import Path

import numpy as np
import pytest
import torch
from torchrl.envs.utils import ExplorationType, set_exploration_type

import drone_rl
from drone_rl.config import MINIMAL, AppearanceSettings
from drone_rl.config.task import BaseTaskSettings
from drone_rl.policies.policy import _name_of
from drone_rl.policies.zoo import policy_path
from drone_rl.utils.errors import InputError
from tests.fake_flight import FLIGHT, Floating, floating
from tests.house import write_house
from tests.untrained import untrained


def test_bundled_policy_is_loaded():
    policy = drone_rl.load_policy("good")
    assert (policy.name, policy.task.num_cubes) == ("good", 3)
    assert policy.path == policy_path("good")
    shown = policy._repr_html_()
    assert "<td>network</td>" in shown
    assert "small_cnn" in shown
    assert repr(policy) == f"Policy(name='good', path={policy.path!r})"  # without its weights


@pytest.mark.parametrize(
    ("path", "name"),
    [
        ("/a/mine.pt", "mine"),
        ("/mine.pt", "mine"),
        ("/a/mine.safetensors", "mine"),
        ("/a/checkpoints/last.pt", "a"),
        ("/a/checkpoints/best.pt", "a_best"),
    ],
)
def test_a_policy_has_the_name_of_its_run_or_of_its_file(path, name):
    assert _name_of(Path(path)) == name


def test_reversed_channels_are_accepted():
    policy = drone_rl.load_policy("good")
    bgr = np.random.default_rng(0).integers(0, 256, (4, 25, 64, 3), np.uint8)
    rgb = bgr[..., ::-1]  # with a negative stride
    assert torch.equal(policy.act_batch(rgb), policy.act_batch(rgb.copy()))
    assert policy.act(rgb[0]) == policy.act(rgb[0].copy())


@pytest.mark.parametrize("image", ["image.png", [[1], [2, 3]]])
def test_what_is_no_image_is_refused(image):
    for act in (drone_rl.load_policy("good").act, drone_rl.load_policy("good").act_batch):
        with pytest.raises(InputError, match="is no array of numbers; give uint8"):
            act(image)


def test_environment_is_closed_at_the_end_or_on_failure():
    policy = drone_rl.load_policy("good")
    with pytest.raises(KeyError), policy.flying(2) as (env, actor):
        assert actor(env.reset())["action"].shape == (2,)
        assert not env.is_closed
        raise KeyError
    assert env.is_closed


def test_scenes_are_those_of_the_training_by_their_content(tmp_path):
    a, b, c = (
        write_house(tmp_path, wall=wall, name=name)
        for name, wall in zip("abc", (1, 1.2, 1.4), strict=True)
    )
    task = BaseTaskSettings.read({"name": "reach", "scene": [str(a), str(b)]}, "task")
    policy = untrained({"name": "small_cnn"}, task=task)
    assert policy.known_scenes == policy.in_task(scene=[str(b)]).known_scenes == (str(a), str(b))
    assert policy.in_task(scene=[str(b), str(c)]).known_scenes == ()
    (tmp_path / "copies").mkdir()
    copy = write_house(tmp_path / "copies", wall=1, name="a")
    assert policy.in_task(scene=[str(copy)]).known_scenes == (str(a), str(b))
    write_house(tmp_path, wall=1.3, name="a")
    assert policy.known_scenes == ()
    assert drone_rl.load_policy("good").known_scenes == ()


def test_changed_task_changes_only_the_environment():
    policy = drone_rl.load_policy("good")
    other = policy.in_task(num_cubes=5, spacing=None)
    assert (other.task.num_cubes, other.task.spacing) == (5, policy.task.spacing)
    assert policy.task.num_cubes == 3
    env = other.make_env(2)
    assert env.reset()["info", "cube_positions"].shape == (2, 5, 3)
    actor = other.make_actor(env)
    assert actor(env.reset())["action"].shape == (2,)
    env.close()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"num_cubes": 0}, "task.num_cubes=0: it must"),
        ({"wind": 1}, "task.wind is unknown"),
        ({"step_limit": 5}, "task.step_limit=5 ends before"),
    ],
)
def test_invalid_task_changes_raise(changes, message):
    with pytest.raises(InputError, match=f"^{message}"):
        drone_rl.load_policy("good").in_task(**changes)


def test_changes_are_also_given_as_a_mapping():
    for policy in (
        drone_rl.load_policy("good"),
        drone_rl.policy_from(lambda images: images[:, 0, 0, :3]),
    ):
        assert policy.in_task({"num_cubes": 1}, spacing=4.0).task == policy.task.replace(
            num_cubes=1, spacing=4.0
        )
        wind = (5.0, 0.0, 0.0)
        simple = policy.in_dynamics({"mode": "simple_flight", "wind": wind})
        assert simple.dynamics.wind == wind
        with pytest.raises(InputError, match=r"^task='pillars' gives no changes"):
            policy.in_task("pillars")
        with pytest.raises(InputError, match=r"^dynamics='simple_flight' gives no changes"):
            policy.in_dynamics("simple_flight")


def test_actor_can_be_created_without_environment():
    policy = drone_rl.load_policy("good")
    env = policy.make_env(2, seed=3)
    flown = []
    for actor in (policy.make_actor(), policy.make_actor(env)):
        env.set_seed(3)
        flown.append(env.rollout(4, actor)["action"])
    env.close()
    assert torch.equal(*flown)
    with pytest.raises(
        drone_rl.InputError, match=r"env=2 is not a TorchRL environment; use policy"
    ):
        policy.make_actor(2)


def test_missing_policies_raise(tmp_path):
    with pytest.raises(InputError, match="policy=latest, but there is no run"):
        drone_rl.load_policy("latest", outputs=tmp_path)
    with pytest.raises(InputError, match=r"policy=nobody does not exist.*good, .*poor"):
        drone_rl.load_policy("nobody")


def test_timing_counts_in_computer_vision_mode_where_actions_are_velocities():
    policy = drone_rl.load_policy("flight_velocity").in_dynamics(mode="computer_vision")
    slower = policy.in_dynamics(control_ticks=330)
    assert slower.unlike["control_ticks"] == {"own": 66, "flown": 330}
    assert "control_ticks" not in policy.unlike
    assert drone_rl.load_policy("good").in_dynamics(control_ticks=330).unlike == {}


def test_another_appearance_changes_only_the_environment():
    policy, fog = drone_rl.load_policy("good"), AppearanceSettings(fog_visibility=40.0)
    other = policy.in_appearance(fog)
    assert policy.in_appearance("fog").description.appearance.fog_visibility == 40.0
    assert other.unlike == {"appearance.fog_visibility": {"own": None, "flown": 40.0}}
    assert other.in_task(num_cubes=1).description.appearance == fog
    assert policy.unlike == {} and other.in_appearance(MINIMAL).unlike == {}
    with policy.flying(1) as (plain, _), other.flying(1) as (hazy, _):
        assert hazy.base_env.appearances.settings == fog
        assert not torch.equal(plain.reset()["pixels"], hazy.reset()["pixels"])


def test_changed_dynamics_change_only_the_environment(monkeypatch):
    floating(monkeypatch)
    policy = drone_rl.load_policy("good")
    other = policy.in_dynamics(mode="simple_flight", wind=[5.0, 0.0, 0.0], gusts=None)
    assert other.dynamics == FLIGHT.replace(wind=(5.0, 0.0, 0.0))
    assert policy.dynamics.is_computer_vision and other.own_dynamics == policy.dynamics
    assert policy.unlike == {} and other.unlike == {
        "mode": {"own": "computer_vision", "flown": "simple_flight"},
        "wind": {"own": [0.0, 0.0, 0.0], "flown": [5.0, 0.0, 0.0]},
    }
    with other.flying(2) as (env, actor):
        assert isinstance(env.base_env.worlds.dynamics, Floating)
        assert actor(env.reset())["action"].shape == (2,)
    back = other.in_dynamics(mode="computer_vision", wind=[0, 0, 0])
    assert back.unlike == {} and back.description == policy.description
    with policy.flying(1, dynamics=FLIGHT) as (env, _):
        assert env.base_env.worlds.dynamics.settings == FLIGHT


@pytest.mark.parametrize("name", ["good", "pillars_good", "flight_velocity"])
def test_act_equals_the_actor_in_its_environment(name):
    """Over several steps, because the pillars' policy stacks two frames."""
    policy = drone_rl.load_policy(name)
    with policy.flying(3) as (env, actor), set_exploration_type(ExplorationType.DETERMINISTIC):
        state = env.reset()
        for _ in range(4):
            state = actor(state)
            images = env.base_env.last_pixels.clone()
            torch.testing.assert_close(policy.act_batch(images), state["action"])
            state = env.step_mdp(env.step(state))
    policy.reset()
    first = policy.act_batch(images)
    policy.reset()
    one = policy.act(images[0].numpy())
    assert isinstance(one, int) == (name != "flight_velocity")
    assert one == pytest.approx(first[0].numpy())


@pytest.mark.parametrize("as_given", [lambda x: x, torch.Tensor.numpy])
def test_remembered_frames_do_not_share_the_callers_buffer(as_given):
    policy = drone_rl.load_policy("pillars_good")  # stacks two frames
    camera = policy.description.camera
    buffer = torch.full((1, camera.height, camera.width, 3), 7, dtype=torch.uint8)
    policy.act_batch(as_given(buffer))
    buffer.zero_()  # a camera writes its next frame
    (stack,) = policy._network_and_readings[1].pipelines["pixels"].stages
    assert len(stack.memory.unique()) == 1


def test_images_that_do_not_fit_the_camera_raise():
    policy = drone_rl.load_policy("pillars_good")
    height, width = policy.description.camera.height, policy.description.camera.width
    for wrong in (
        torch.zeros(2, height, width + 1, 3, dtype=torch.uint8),
        torch.zeros(2, height, width, 3),
        torch.zeros(height, width, 3, dtype=torch.uint8),
    ):
        with pytest.raises(InputError, match=rf"give uint8 of shape \(N, {height}, {width}, 3\)"):
            policy.act_batch(wrong)
    with pytest.raises(InputError, match=rf"\(2, {height}, {width}, 3\) .* act_batch"):
        policy.act(torch.zeros(2, height, width, 3, dtype=torch.uint8))
    policy.act_batch(torch.zeros(2, height, width, 3, dtype=torch.uint8))
    three = torch.zeros(3, height, width, 3, dtype=torch.uint8)
    with pytest.raises(InputError, match=r"^3 images follow 2; call reset\(\)"):
        policy.act_batch(three)
    policy.reset()
    assert policy.act_batch(three).shape == (3,)
