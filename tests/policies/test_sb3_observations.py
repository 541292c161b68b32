"""Models of Stable-Baselines3 act as by their own `predict`, on every frame of the same episodes.

The library's actions come from its own vector environments and wrappers, which replay the frames.
"""

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.config.transforms import Rgb, Standardize
from drone_rl.envs import base_env
from drone_rl.policies.external_policy import as_policy
from drone_rl.utils.errors import InputError
from tests.policies.sb3_models import (
    CAMERA,
    KINDS,
    NAME,
    TASK,
    gymnasium,
    library_actions,
    make_model,
    sb3,
    single,
)

vec_env = pytest.importorskip("stable_baselines3.common.vec_env")
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
    with pytest.raises(InputError, match=r"\(it has Brighter\); give drone_rl\.policy_from env="):
        as_policy(model)
    policy = drone_rl.policy_from(model, transforms=[Rgb(), Standardize(mean=0.0, std=200 / 255)])
    assert policy.make_network().in_shape == (3, 40, 48)


def test_state_observations_are_no_images():
    env = gymnasium.make(NAME, observations="state")
    model = sb3.PPO("MlpPolicy", env, seed=0, n_steps=4, batch_size=4)
    with pytest.raises(InputError, match="observes the ground truth instead of images"):
        as_policy(model)
