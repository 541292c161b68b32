"""Direct rendering gives the same observations as TorchRL's steps."""

import pytest
import torch

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.envs import (
    CropRows,
    DroneEnv,
    GrayPixels,
    Resize,
    RgbPixels,
    StandardizePixels,
    with_transforms,
)
from drone_rl.envs.direct_renderer import STEP_NAMES, DirectRenderer

SHORT = TaskSettings(num_cubes=2, first_distance=3.0, spacing=3.0, step_limit=5)
KEPT = [("next", name) for name in STEP_NAMES]


class Dark(GrayPixels):
    """A subclass, which may transform images differently."""


@pytest.mark.parametrize(
    ("first", "modality"), [(GrayPixels(), "gray"), (RgbPixels(), "rgb"), (Dark(), "rgb")]
)
def test_gray_is_rendered_directly_with_the_same_result(first, modality):
    env = with_transforms(DroneEnv(3, SHORT), [first, CropRows(5, 25)])
    renderer = DirectRenderer.try_create(env, ["pixels"], KEPT)
    assert renderer.view.modalities == (modality,)
    seen = env.reset()["pixels"]
    assert torch.equal(renderer.observe(env.base_env.worlds.state)["pixels"], seen)
    env.close()


@pytest.mark.parametrize(("size", "kept"), [((25, 64), 1), ((13, 32), 2), ((50, 128), 2)])
def test_resize_to_the_camera_size_is_skipped(size, kept):
    camera = CameraSettings(height=size[0], width=size[1])
    transforms = [GrayPixels(), Resize(height=25, width=64), StandardizePixels()]
    env = with_transforms(DroneEnv(2, SHORT, camera), transforms)
    renderer = DirectRenderer.try_create(env, ["pixels"], KEPT)
    assert [type(t) for t in renderer.after] == [Resize, StandardizePixels][-kept:]
    seen = env.reset()["pixels"]
    assert seen.shape == (2, 1, 25, 64)
    assert torch.equal(renderer.observe(env.base_env.worlds.state)["pixels"], seen)
    plain = with_transforms(DroneEnv(2, SHORT, camera), [GrayPixels(), StandardizePixels()])
    assert torch.equal(plain.reset()["pixels"], seen) is (kept == 1)
    for each in (env, plain):
        each.close()


def test_step_entries_equal_torchrl():
    reason = ("next", "info", "end_reason")
    env = with_transforms(DroneEnv(3, SHORT), [GrayPixels()])
    renderer = DirectRenderer.try_create(env, ["pixels"], [*KEPT, reason])
    state = env.reset()
    action = torch.tensor([0, 1, 2])
    for step in range(5):
        moved, reward = renderer.worlds.advance(renderer.worlds.state, action)
        state = env.step(state.set("action", action))
        entries, done = renderer.entries(moved, reward)
        assert set(entries) == {*KEPT, reason}
        assert not (entries["next", "terminated"] & entries["next", "truncated"]).any()
        assert all(torch.equal(value, state[key]) for key, value in entries.items())
        assert torch.equal(done, state["next", "done"]) and bool(done.all()) is (step == 4)
        state = state["next"]
    env.close()
