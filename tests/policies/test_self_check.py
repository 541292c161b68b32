"""Third-party policies are compared with themselves in other batches, and with their library."""

import pytest
import torch

import drone_rl
from drone_rl.config.transforms import Gray, Rgb, Standardize
from drone_rl.policies.external_policy import as_policy
from drone_rl.utils.errors import InputError

models = pytest.importorskip("tests.policies.sb3_models")


def test_batches_of_several_frames_are_tried():
    with pytest.raises(InputError, match=r"on images of shape \(2, 1, 25, 64\)"):
        drone_rl.policy_from(lambda images: images.reshape(1, 1, 25, 64)[:, 0, 10, :3])

    def mean_of_batch(images):
        return images[:, 0, 10, :3] + 10 * images.mean()

    with pytest.raises(InputError, match=r"^policy=mean_of_batch gives other logits .* a batch of"):
        drone_rl.policy_from(mean_of_batch)


class Late(models.gymnasium.ObservationWrapper):
    """The observation of the step before."""

    def __init__(self, env):
        super().__init__(env)
        self.before = None

    def observation(self, observation):
        seen, self.before = self.before, observation
        return observation if seen is None else seen


def test_wrappers_with_memory_are_refused():
    env = models.single(Late)(models.gymnasium.make(models.NAME, camera=models.CAMERA))
    model = models.sb3.PPO("CnnPolicy", env, seed=0, n_steps=4, batch_size=4)
    with torch.no_grad():
        model.policy.action_net.weight.mul_(1000)
    with pytest.raises(InputError, match=r"acts otherwise than by its library.*: Late, VecTransp"):
        as_policy(model)


def test_transforms_that_are_not_those_of_the_environment_are_refused():
    model = models.make_model("floats, channels first")
    right, wrong = (Gray(), Standardize()), (Gray(), Standardize(mean=0.2))
    assert drone_rl.policy_from(model, transforms=right).transforms == right
    with pytest.raises(InputError, match="acts otherwise than by its library's predict"):
        drone_rl.policy_from(model, transforms=wrong)
    with pytest.raises(InputError, match=r"observes \(1, 40, 48\), .* return images of \(3, 40, 4"):
        drone_rl.policy_from(model, transforms=[Rgb()])
