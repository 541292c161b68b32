"""What policies see: rendering, transforms, and memory of each environment."""

import pytest
import torch
from torchrl.envs import CatFrames, Compose, ToTensorImage, TransformedEnv

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.envs import (
    CameraFault,
    CropRows,
    DroneEnv,
    GrayPixels,
    Noise,
    Pipeline,
    Resize,
    RgbPixels,
    StandardizePixels,
)
from drone_rl.envs.fault_models import FaultModel, late_frames
from drone_rl.envs.observer import Observer, Stage
from drone_rl.envs.transforms import PixelTransform
from drone_rl.utils.errors import InputError

SHORT = TaskSettings(num_cubes=2, first_distance=3.0, spacing=3.0, step_limit=12, front_margin=3.0)


class Dark(GrayPixels):
    """A subclass, which may transform images differently."""


@pytest.mark.parametrize(
    ("first", "modality"), [(GrayPixels(), "gray"), (RgbPixels(), "rgb"), (Dark(), "rgb")]
)
def test_observations_equal_transformed_images(first, modality):
    """Gray is rendered directly, with the same result as from colors."""
    transforms = [first, CropRows(5, 25), StandardizePixels()]
    env = DroneEnv(3, SHORT, transforms=transforms)
    assert env.observer.image.view.modalities == (modality,)
    plain = TransformedEnv(DroneEnv(3, SHORT), Compose(*transforms))
    assert torch.equal(env.reset()["pixels"], plain.reset()["pixels"])
    assert env.observation_spec["pixels"].shape == plain.observation_spec["pixels"].shape


@pytest.mark.parametrize(("size", "kept"), [((25, 64), 1), ((13, 32), 2), ((50, 128), 2)])
def test_resize_to_the_camera_size_is_skipped(size, kept):
    camera = CameraSettings(height=size[0], width=size[1])
    transforms = [GrayPixels(), Resize(height=25, width=64), StandardizePixels()]
    env = DroneEnv(2, SHORT, camera, transforms=transforms)
    steps = [type(t) for t in env.observer.image.pipeline.transforms]
    assert steps == [Resize, StandardizePixels][-kept:]
    assert env.reset()["pixels"].shape == (2, 1, 25, 64)


def numbers(*values):
    return torch.tensor(values, dtype=torch.float32).reshape(-1, 1, 1, 1)


def test_stacks_repeat_the_first_frame_of_each_environment():
    pipeline = Pipeline([CatFrames(3, -3, in_keys=["pixels"])])
    assert pipeline(numbers(1, 2))[:, :, 0, 0].tolist() == [[1, 1, 1], [2, 2, 2]]
    assert pipeline(numbers(3, 4), starts=False)[:, :, 0, 0].tolist() == [[1, 1, 3], [2, 2, 4]]
    mixed = pipeline(numbers(5, 6), starts=torch.tensor([True, False]))
    assert mixed[:, :, 0, 0].tolist() == [[5, 5, 5], [2, 4, 6]]
    assert pipeline(numbers(7), torch.tensor([1]), False)[0, :, 0, 0].tolist() == [4, 6, 7]
    again = pipeline(numbers(0, 0), starts=None)
    assert again[:, :, 0, 0].tolist() == [[5, 5, 5], [4, 6, 7]]
    assert pipeline.earlier == 2


def test_faults_need_random_streams():
    images = torch.rand(2, 1, 4, 4)
    assert torch.equal(Pipeline([Noise(0.5)])(images), images)


def test_transforms_with_methods_that_are_not_called_are_refused():
    class Flicker(PixelTransform):
        def _apply_transform(self, obs):
            return obs

        def _step(self, tensordict, next_tensordict):
            return next_tensordict

    class Forgetting(Flicker):
        _step = PixelTransform._step

        def _reset(self, tensordict, tensordict_reset):
            return tensordict_reset

    for kind, name in ((Flicker, "_step"), (Forgetting, "_reset")):
        with pytest.raises(InputError, match=rf"{kind.__name__} has its own {name}, .*CameraFault"):
            DroneEnv(1, SHORT, transforms=[GrayPixels(), kind()])
    DroneEnv(1, SHORT, transforms=[ToTensorImage(in_keys=["pixels"], out_keys=["pixels"])])


def test_a_fault_of_ones_own_remembers_each_environment():
    """It shows the darkest image of the episode so far."""
    darkest = FaultModel(
        show=lambda images, memory, blank: memory,
        begin=lambda images, sample: images,
        update=lambda memory, images, sample: memory.minimum(images),
    )
    pipeline = Pipeline([CameraFault(darkest)], lambda rows, key: [None] * len(rows), 2)
    assert pipeline(numbers(0.5, 0.2)).flatten().tolist() == pytest.approx([0.5, 0.2])
    after = pipeline(numbers(0.4, 0.9), starts=torch.tensor([False, True]))
    assert after.flatten().tolist() == pytest.approx([0.4, 0.9])
    last = pipeline(numbers(0.6, 0.8), starts=False)
    assert last.flatten().tolist() == pytest.approx([0.4, 0.8])


def test_faults_of_an_evaluation_act_before_the_transforms():
    """Colors arrive one step late, at a policy that takes the camera's bytes, too."""
    env = DroneEnv(1, SHORT)
    env.reset()
    worlds = env.worlds
    state, rows = worlds.state, torch.tensor([0])
    moved, _ = worlds.advance(state, torch.tensor([0]))
    for transforms in ((), (RgbPixels(),), (GrayPixels(),)):
        seen = Observer(worlds, transforms).observe(state, rows, True, None)["pixels"]
        late = Observer(
            worlds, transforms, faults={"pixels": Pipeline(stages=[Stage(late_frames(1))])}
        )
        assert torch.equal(late.observe(state, rows, True, None)["pixels"], seen)
        assert torch.equal(late.observe(moved, rows, False, None)["pixels"], seen)
        assert not torch.equal(late.observe(moved, rows, False, None)["pixels"], seen)
