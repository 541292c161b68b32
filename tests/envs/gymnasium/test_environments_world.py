"""A single environment complies with the checkers of Gymnasium and Stable-Baselines3."""

import dataclasses
import pickle
import warnings

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.sim.tasks import Task
from drone_rl.sim.tasks.task import EndReason
from drone_rl.utils.errors import InputError
from tests.second_task import Posts

gymnasium = pytest.importorskip("gymnasium", reason="Gymnasium is not installed")

NAME = "drone_rl/CollectCubes-v0"
SHORT = {"num_cubes": 1, "first_distance": 3.0, "step_limit": 5, "front_margin": 3.0}
WIDE = {"width": 64, "height": 64}


@pytest.fixture
def make():
    envs = []

    def build(**options):
        envs.append(gymnasium.make(NAME, **options))
        return envs[-1]

    yield build
    for env in envs:
        env.close()


def put(env, lateral):
    """Set the lateral positions of the cubes of the running episode in meters to the left."""
    env.unwrapped.batch.worlds.state.cubes[0, :, 1] = lateral


@pytest.mark.parametrize(
    "options", [{}, {"observations": "state"}, {"render_mode": "rgb_array"}, {"num_cubes": 1}]
)
def test_gymnasiums_checker_passes(make, options):
    from gymnasium.utils.env_checker import check_env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make(**options).unwrapped)


def test_gymnasiums_checker_passes_for_a_user_task():
    from gymnasium.utils.env_checker import check_env

    gymnasium.register("posts-v0", entry_point="drone_rl:DroneWorld", kwargs={"task": Posts()})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make("posts-v0").unwrapped)
    del gymnasium.registry["posts-v0"]


@pytest.mark.parametrize("options", [{"observations": "state"}, {"camera": WIDE}])
def test_stable_baselines3s_checker_passes(make, options):
    reason = "Stable-Baselines3 is not installed"
    checker = pytest.importorskip("stable_baselines3.common.env_checker", reason=reason)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(make(**options).unwrapped)


def test_stable_baselines3s_checker_warns_only_of_small_images(make):
    reason = "Stable-Baselines3 is not installed"
    checker = pytest.importorskip("stable_baselines3.common.env_checker", reason=reason)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        checker.check_env(make().unwrapped)
    (only,) = caught
    assert "36x36 for the default `CnnPolicy`" in str(only.message)


def test_collecting_all_cubes_terminates_with_success(make):
    env = make(num_cubes=1, first_distance=3.0, front_margin=5.0)
    seen, info = env.reset(seed=0)
    put(env, 0.0)
    assert (seen.shape, seen.dtype, info["cubes"].tolist()) == ((25, 64, 3), np.uint8, [0])
    assert env.step(0)[1:4] == (0.0, False, False)
    _, reward, terminated, truncated, info = env.step(0)  # 2 m ahead; contact starts at 1.65 m
    assert (reward, terminated, truncated) == (1.0, True, False)
    assert (info["is_success"], info["collected"].tolist()) == (True, [True])
    ends = env.unwrapped.batch.worlds.task.ends
    assert ends(info["end_reason"]) == ends.ALL_CUBES
    with pytest.raises(InputError, match=r"needs a running episode; call reset\(\) first"):
        env.step(0)
    env.reset()
    env.step(0)


def test_step_limit_truncates(make):
    env = make(**SHORT)
    env.reset(seed=0)
    put(env, 6.0)
    flags = [env.step(1 + t % 2)[2:4] for t in range(5)]
    assert flags == [(False, False)] * 4 + [(False, True)]


def test_out_of_bounds_terminates(make):
    env = make(**SHORT | {"side_margin": 1.0, "lateral_bound": 0.0})
    env.reset(seed=0)
    env.step(2)
    _, reward, terminated, truncated, info = env.step(2)
    assert (reward, terminated, truncated, info["is_success"]) == (0.0, True, False, False)


def test_episodes_depend_only_on_the_seed(make):
    def episodes(env, seed):
        first = env.reset(seed=seed)[1]["cube_positions"]
        return first, env.reset()[1]["cube_positions"]

    one, two = make(), make(observations="state")
    assert np.array_equal(episodes(one, 5), episodes(two, 5))
    assert not np.array_equal(*episodes(one, 5))
    assert not np.array_equal(episodes(one, 5), episodes(one, 6))
    unseeded = [make().reset()[1]["cube_positions"] for _ in range(2)]
    assert not np.array_equal(*unseeded)


def test_returned_arrays_are_copies(make):
    env = make(observations="state")
    seen, info = env.reset(seed=1)
    seen[:], info["cube_positions"][:], info["collected"][:] = 7.0, 7.0, True
    again = env.step(0)[4]
    assert again["cube_positions"][0, 0] == 15.0 and not again["collected"].any()


def test_render_returns_a_frame_from_behind(make):
    env = make(render_mode="rgb_array")
    env.reset(seed=0)
    assert env.render().shape == (360, 640, 3)
    silent = make()
    silent.reset(seed=0)
    with pytest.warns(UserWarning, match="render_mode='rgb_array'"):
        assert silent.unwrapped.render() is None


def test_rgb_array_list_is_supported(make):
    env = make(render_mode="rgb_array_list")
    env.reset(seed=0)
    env.step(0)
    assert [frame.shape for frame in env.render()] == [(360, 640, 3)] * 2


@pytest.mark.filterwarnings("ignore:.*The environment is being initialised with render_mode")
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"render_mode": "ansi"}, "render_mode='ansi' is unknown; give rgb_array"),
        ({"wind": 1}, "unexpected keyword argument 'wind'; valid names: .*observations"),
        ({"num_cubes": "two"}, "num_cubes='two' is a text"),
    ],
)
def test_invalid_options_raise_one_line(make, options, message):
    with pytest.raises(InputError, match=f"^{message}"):
        make(**options)


def test_invalid_calls_raise(make):
    env = make().unwrapped
    with pytest.raises(InputError, match=r"call reset\(\) first"):
        env.step(0)
    with pytest.raises(InputError, match=r"options=\['start'\] are unknown to reset; give none"):
        env.reset(options={"start": 3})
    with pytest.raises(gymnasium.error.Error, match="greater or equal to zero, actual value: -1"):
        env.reset(seed=-1)
    env.reset(seed=0)
    with pytest.raises(InputError, match="action=5 is invalid; give one of: 0 forward"):
        env.step(5)
    env.step(0)  # the episode continues


def test_second_close_is_allowed_and_spec_recreates_the_environment(make):
    env = make(num_cubes=2, camera={"width": 32})
    assert gymnasium.make(env.spec).observation_space.shape == (25, 32, 3)
    assert pickle.loads(pickle.dumps(env.spec)) == env.spec
    assert "num_cubes" in env.spec.to_json()
    env.close()
    env.close()


def test_class_accepts_settings():
    env = drone_rl.DroneWorld(drone_rl.TaskSettings(num_cubes=2), num_cubes=4)
    assert env.reset(seed=0)[1]["collected"].shape == (4,)


class Far(Task):
    name = "far"

    def sample(self, random_state):
        return torch.tensor(random_state.uniform(2.0, 4.0), dtype=torch.float64)

    def step(self, state, body):
        end = (body.position[:, 0] > state.sampled).long() * EndReason.SUCCESS
        new = dataclasses.replace(state, body=body, steps=state.steps + 1, end_reason=end)
        return new, end.double()


def test_a_task_that_samples_one_number_is_observed():
    env = drone_rl.DroneWorld(task=Far(), observations="state")
    assert env.reset(seed=0)[0].shape == env.observation_space.shape
    env.close()
