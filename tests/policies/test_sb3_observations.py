"""Models of Stable-Baselines3 act as by their own `predict`, on every frame of the same episodes.

The library's actions come from its own vector environments and wrappers, which replay the frames.
"""

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.config.transforms import Gray, Noise, Rgb, Standardize
from drone_rl.envs import base_env
from drone_rl.policies.external_policy import as_policy
from drone_rl.utils.errors import InputError
from tests.policies.sb3_models import (
    CAMERA,
    KINDS,
    NAME,
    TASK,
    Inverted,
    Playback,
    gymnasium,
    library_actions,
    make_model,
    sb3,
    single,
)

vec_env = pytest.importorskip("stable_baselines3.common.vec_env")
atari_wrappers = pytest.importorskip("stable_baselines3.common.atari_wrappers")
STEPS = 8


@pytest.mark.parametrize("kind", KINDS)
def test_actions_equal_those_of_predict_on_every_frame(kind):
    model = make_model(kind)
    policy = as_policy(model)
    frames, actions = [], []
    with policy.flying(4, seed=5) as (env, _):
        network = policy.make_network()
        for _ in range(2):
            state, shown, taken = env.reset(), [], []
            for step in range(STEPS):
                shown.append(base_env(env).last_pixels.clone())
                taken.append(network(state["pixels"]).argmax(-1))
                other = torch.tensor([0, 1, 2, step % 3])
                state = env.step(state.set("action", other))["next"]
            frames.append(torch.stack(shown, 1))
            actions.append(torch.stack(taken, 1))
    frames, actions = torch.cat(frames).numpy(), torch.cat(actions).numpy()
    assert (actions == library_actions(model, kind, frames)).all()
    assert len(np.unique(actions)) > 1  # else any observations would do
    assert network.is_differentiable


def test_task_and_camera_are_those_of_the_environment():
    policy = as_policy(make_model("gray"))
    assert (policy.name, policy.camera) == ("PPO of Stable-Baselines3", CAMERA)
    assert policy.task == drone_rl.TaskSettings(**TASK)
    given = drone_rl.policy_from(
        make_model("bytes, CNN"), task=drone_rl.TaskSettings(num_cubes=1), name="mine"
    )
    assert (given.name, given.task.num_cubes, given.transforms) == ("mine", 1, (Rgb(),))


def test_camera_faults_of_the_environment_are_those_of_the_policy():
    transforms = (Gray(), Noise(strength=0.2))
    env = gymnasium.make(NAME, camera=CAMERA, transforms=transforms)
    policy = as_policy(sb3.PPO("MlpPolicy", env, seed=0, n_steps=4, batch_size=4))
    assert policy.transforms == transforms


def reload(model, folder, env=None):
    model.save(folder / "model.zip")
    return sb3.PPO.load(folder / "model.zip", env=env)


def test_loaded_models_need_their_environment_unless_they_observe_color(tmp_path):
    color = as_policy(reload(make_model("bytes, CNN"), tmp_path))
    size = (CAMERA.height, CAMERA.width)
    assert (color.camera.height, color.camera.width, color.transforms) == (*size, (Rgb(),))
    for kind, shape in (("normalized bytes", "40, 48, 3"), ("stacked", "9, 40, 48")):
        model = make_model(kind)
        loaded = reload(model, tmp_path)
        with pytest.raises(InputError, match=rf"shape \({shape}\).*no environment .* give .* env="):
            as_policy(loaded)
        policy = drone_rl.policy_from(loaded, env=model.get_env())
        assert policy.make_network().in_shape == (int(shape[0]) if shape[1] == "," else 3, *size)


class Brighter(vec_env.VecEnvWrapper):
    """A wrapper of the user's own, which only a run can show."""

    def reset(self):
        return self.venv.reset() / np.float32(200)

    def step_wait(self):
        seen, *rest = self.venv.step_wait()
        return seen / np.float32(200), *rest


def own_wrapper():
    env = Brighter(single()(gymnasium.make(NAME, camera=CAMERA)))
    env.observation_space = gymnasium.spaces.Box(0, 2, (40, 48, 3), np.float32)
    return sb3.PPO("MlpPolicy", env, seed=0, n_steps=4, batch_size=4)


def test_unknown_wrappers_need_transforms():
    model = own_wrapper()
    with pytest.raises(InputError, match=r"it has Brighter; ((?!env=).)* transforms="):
        as_policy(model)
    policy = drone_rl.policy_from(model, transforms=[Rgb(), Standardize(mean=0.0, std=200 / 255)])
    assert policy.make_network().in_shape == (3, 40, 48)


class Skipping(gymnasium.ObservationWrapper):
    """An observation wrapper that changes the time, too."""

    def observation(self, observation):
        return observation

    def step(self, action):
        self.env.step(action)
        return super().step(action)


class Mirrored(gymnasium.ActionWrapper):
    def action(self, action):
        return (0, 2, 1)[int(action)]


class Peeking(gymnasium.ObservationWrapper):
    """A wrapper whose result depends on more than the current observation."""

    def observation(self, observation):
        return observation + np.uint8(self.unwrapped.batch.worlds.num_envs)


def model_of(env):
    return sb3.PPO("MlpPolicy", env, seed=0, n_steps=4, batch_size=4)


def single_of(*layers):
    return single(*layers)(gymnasium.make(NAME, camera=CAMERA))


def test_wrappers_of_rewards_and_records_are_neutral():
    layers = (
        lambda env: gymnasium.wrappers.TimeLimit(env, 50),
        gymnasium.wrappers.RecordEpisodeStatistics,
        lambda env: gymnasium.wrappers.TransformReward(env, lambda reward: 2 * reward),
    )
    model = model_of(vec_env.VecCheckNan(vec_env.VecMonitor(single_of(*layers))))
    assert as_policy(model).transforms == (Rgb(),)


@pytest.mark.parametrize(
    "layer",
    [
        Mirrored,
        atari_wrappers.MaxAndSkipEnv,
        lambda env: gymnasium.wrappers.MaxAndSkipObservation(env, 4),
        lambda env: gymnasium.wrappers.StickyAction(env, 0.2),
    ],
)
def test_changed_actions_are_refused_with_transforms_too(layer):
    model = model_of(single_of(layer))
    for transforms in (None, [Rgb()]):
        with pytest.raises(InputError, match=r"^\w+ changes actions"):
            drone_rl.policy_from(model, transforms=transforms)


def test_observation_wrappers_must_not_change_time_or_read_the_state():
    with pytest.raises(InputError, match="it has Skipping"):
        as_policy(model_of(single_of(Skipping)))
    with pytest.raises(InputError, match="has no attribute 'batch'"):
        as_policy(model_of(single_of(Peeking)))


def hidden():
    frames = np.zeros((1, 2, CAMERA.height, CAMERA.width, 3), np.uint8)
    return Inverted(Playback(frames))


def test_wrappers_in_other_processes_are_refused():
    env = vec_env.SubprocVecEnv([hidden])
    try:
        model = model_of(env)
        with pytest.raises(InputError, match=r"SubprocVecEnv .* other processes.* DummyVecEnv"):
            drone_rl.policy_from(model, transforms=[Rgb()])
    finally:
        env.close()
    policy = drone_rl.policy_from(model, env=single_of(Inverted))
    assert len(policy.transforms) == 2


def test_an_environment_must_have_the_spaces_of_the_model():
    with pytest.raises(InputError, match=r"Box\(0\.0, 1\.0, .* != Box\(0, 255, "):
        drone_rl.policy_from(make_model("floats, channels last"), env=single_of())
    plain = gymnasium.make(NAME, camera=CAMERA)  # channels last; the library moves them
    assert drone_rl.policy_from(model_of(single_of()), env=plain).transforms == (Rgb(),)


def test_state_observations_are_no_images():
    env = gymnasium.make(NAME, observations="state")
    model = sb3.PPO("MlpPolicy", env, seed=0, n_steps=4, batch_size=4)
    with pytest.raises(InputError, match="observes the ground truth instead of images"):
        as_policy(model)
