"""Gymnasium environments, single and vector: checkers, `SyncVectorEnv`, options, episodes."""

import dataclasses
import pickle
import warnings

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.config.transforms import Gray, LateFrames, Noise, Stack, Standardize
from drone_rl.sim.tasks import Task
from drone_rl.sim.tasks.task import EndReason
from drone_rl.utils.errors import InputError
from tests.second_task import Posts

gymnasium = pytest.importorskip("gymnasium", minversion="1.1", reason="Gymnasium is not installed")


NAME = "drone_rl/CollectCubes-v0"


SHORT = {"num_cubes": 1, "first_distance": 3.0, "step_limit": 5, "front_margin": 3.0}


COUNT = 5


@pytest.fixture
def make():
    envs = []

    def build(num_envs=COUNT, **options):
        envs.append(gymnasium.make_vec(NAME, num_envs=num_envs, **options))
        return envs[-1]

    yield build
    for env in envs:
        env.close()


def assert_same(ours, theirs, where=""):
    """Assert equal keys, types, shapes and values, recursively."""
    assert type(ours) is type(theirs), where
    if isinstance(ours, dict):
        assert ours.keys() == theirs.keys(), where
        for key in ours:
            assert_same(ours[key], theirs[key], f"{where}.{key}")
    elif isinstance(ours, tuple) or ours.dtype == object:
        for i, (one, other) in enumerate(zip(ours, theirs, strict=True)):
            if one is not None or other is not None:
                assert_same(one, other, f"{where}[{i}]")
    else:
        assert (ours.dtype, ours.shape) == (theirs.dtype, theirs.shape), where
        assert np.array_equal(ours, theirs), where


FAULTY = [Gray(), Noise(strength=0.1), LateFrames(frames=2), Standardize(), Stack()]


@pytest.mark.parametrize(
    "observed", [{}, {"observations": "state"}, {"transforms": FAULTY}], ids=str
)
@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_batch_equals_gymnasiums_sync_vector_env(make, mode, observed):
    options = {**SHORT, **observed}
    ours = make(autoreset_mode=mode, **options)
    sync = {"vectorization_mode": "sync", "vector_kwargs": {"autoreset_mode": mode}}
    theirs = make(**sync, **options)
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    assert ours.metadata == theirs.metadata
    assert_same(ours.reset(seed=3), theirs.reset(seed=3), "reset")
    moves = np.random.default_rng(0)
    ends = np.zeros(2, int)
    for t in range(25):
        actions = moves.integers(0, 3, COUNT)
        step = ours.step(actions)
        assert_same(step, theirs.step(actions), f"step {t}")
        ends += [step[2].sum(), step[3].sum()]
        assert step[0] in ours.observation_space
    assert (ends >= 2).all()  # both terminations and truncations
    assert_same(ours.reset(), theirs.reset(), "reset without a seed")
    seeds = [9, None, 9, 1, None]
    assert_same(ours.reset(seed=seeds)[0][:1], theirs.reset(seed=seeds)[0][:1], "seeds")
    assert ours.np_random_seed == theirs.np_random_seed
    for one, other in zip(ours.np_random, theirs.np_random, strict=True):
        assert one.bit_generator.state == other.bit_generator.state


def test_memory_of_frames_ends_with_the_episode(make_one):
    env = make_one(transforms=["gray", "noise", "stack"], **SHORT)
    seen, ended = env.reset(seed=0)[0], False
    assert np.array_equal(seen[0], seen[1])  # padded at the start
    while not ended:
        after, _, terminated, truncated, _ = env.step(0)
        assert np.array_equal(after[0], seen[1]) and not np.array_equal(after[1], seen[1])
        seen, ended = after, terminated or truncated
    again = env.reset()[0]
    assert np.array_equal(again[0], again[1])


def test_disabled_autoreset_requires_a_reset(make):
    ours = make(autoreset_mode=gymnasium.vector.AutoresetMode.DISABLED, **SHORT)
    sync = {"vectorization_mode": "sync", "vector_kwargs": {"autoreset_mode": "Disabled"}}
    theirs = make(**sync, **SHORT)
    assert_same(ours.reset(seed=0), theirs.reset(seed=0))
    moves, ended = np.random.default_rng(1), np.zeros(COUNT, bool)
    for _ in range(15):
        if ended.any():
            with pytest.raises(InputError, match=r"worlds \[.*\] have ended; reset them by reset"):
                ours.step(np.zeros(COUNT, int))
            resets = [env.reset(options={"reset_mask": ended}) for env in (ours, theirs)]
            assert_same(*resets, "partial reset")
        actions = moves.integers(0, 3, COUNT)
        step = ours.step(actions)
        assert_same(step, theirs.step(actions))
        ended = step[2] | step[3]


def test_first_environments_do_not_depend_on_batch_size(make):
    one, many = make(1), make(3)
    assert np.array_equal(one.reset(seed=4)[0][0], many.reset(seed=4)[0][0])
    alone = gymnasium.make(NAME)
    assert np.array_equal(many.reset(seed=4)[0][2], alone.reset(seed=6)[0])
    assert np.array_equal(many.reset(seed=np.int64(4))[0][2], alone.reset(seed=6)[0])
    alone.close()


def test_render_returns_frames_from_behind(make):
    env = make(2, render_mode="rgb_array")
    env.reset(seed=0)
    assert [frame.shape for frame in env.render()] == [(360, 640, 3)] * 2
    with pytest.warns(UserWarning, match="render_mode='rgb_array'"):
        assert make(2).render() is None


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"autoreset_mode": "Later"}, "autoreset_mode='Later' is unknown; give one of: NextStep"),
        ({"render_mode": "human"}, "render_mode='human': it must be 'rgb_array'"),
    ],
)
def test_invalid_options_raise_one_line(make, options, message):
    with pytest.raises(InputError, match=f"^{message}"):
        make(**options)


def test_invalid_calls_raise(make):
    env = make(2)
    with pytest.raises(InputError, match=r"needs a running episode; call reset\(\) first"):
        env.step([0, 0])
    with pytest.raises(InputError, match="seed has 3 values; give one, or 2"):
        env.reset(seed=[1, 2, 3])
    with pytest.raises(InputError, match=r"options=\['start'\] are unknown to reset"):
        env.reset(options={"start": 1})
    for mask in ([True], [1, 0], "all"):
        with pytest.raises(InputError, match=r"reset_mask is of .*; give bool of shape \(2,\)"):
            env.reset(options={"reset_mask": mask})
    env.reset(seed=0)
    with pytest.raises(InputError, match=r"action=\[0, 7\] is invalid; give an array of sha"):
        env.step([0, 7])
    env.close()
    env.close()


def test_class_accepts_settings():
    env = drone_rl.DroneWorlds(2, drone_rl.TaskSettings(num_cubes=2), step_limit=100)
    assert env.reset(seed=0)[1]["collected"].shape == (2, 2)
    env.close()


WIDE = {"width": 64, "height": 64}


@pytest.fixture
def make_one():
    envs = []

    def build(**options):
        envs.append(gymnasium.make(NAME, **options))
        return envs[-1]

    yield build
    for env in envs:
        env.close()


def put(env, lateral):
    """Set the lateral positions of the cubes of the running episode in meters to the left."""
    env.unwrapped.batch.worlds.state.places[0, :, 1] = lateral


@pytest.mark.parametrize(
    "options", [{}, {"observations": "state"}, {"render_mode": "rgb_array"}, {"num_cubes": 1}]
)
def test_gymnasiums_checker_passes(make_one, options):
    from gymnasium.utils.env_checker import check_env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make_one(**options).unwrapped)


def test_gymnasiums_checker_passes_for_a_user_task():
    from gymnasium.utils.env_checker import check_env

    gymnasium.register("posts-v0", entry_point="drone_rl:DroneWorld", kwargs={"task": Posts()})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make("posts-v0").unwrapped)
    del gymnasium.registry["posts-v0"]


@pytest.mark.parametrize("options", [{"observations": "state"}, {"camera": WIDE}])
def test_stable_baselines3s_checker_passes(make_one, options):
    reason = "Stable-Baselines3 is not installed"
    checker = pytest.importorskip("stable_baselines3.common.env_checker", reason=reason)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(make_one(**options).unwrapped)


def test_collecting_all_cubes_terminates_with_success(make_one):
    env = make_one(num_cubes=1, first_distance=3.0, front_margin=5.0)
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


def test_episodes_depend_only_on_the_seed(make_one):
    def episodes(env, seed):
        first = env.reset(seed=seed)[1]["cube_positions"]
        return first, env.reset()[1]["cube_positions"]

    one, two = make_one(), make_one(observations="state")
    assert np.array_equal(episodes(one, 5), episodes(two, 5))
    assert not np.array_equal(*episodes(one, 5))
    assert not np.array_equal(episodes(one, 5), episodes(one, 6))
    unseeded = [make_one().reset()[1]["cube_positions"] for _ in range(2)]
    assert not np.array_equal(*unseeded)


def test_returned_arrays_are_copies(make_one):
    env = make_one(observations="state")
    seen, info = env.reset(seed=1)
    seen[:], info["cube_positions"][:], info["collected"][:] = 7.0, 7.0, True
    again = env.step(0)[4]
    assert again["cube_positions"][0, 0] == 15.0 and not again["collected"].any()


def test_second_close_is_allowed_and_spec_recreates_the_environment(make_one):
    env = make_one(num_cubes=2, camera={"width": 32})
    assert gymnasium.make(env.spec).observation_space.shape == (25, 32, 3)
    assert pickle.loads(pickle.dumps(env.spec)) == env.spec
    assert "num_cubes" in env.spec.to_json()
    env.close()
    env.close()


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
