"""Components of a proof, refused policies and tasks, and the partition of large tasks."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.config import AppearanceSettings, TaskSettings
from drone_rl.policies.zoo import PolicyDescription
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.boxes import volumes
from drone_rl.verification.prover.lattice import Lattice
from drone_rl.verification.prover.policy_spec import (
    make_compositor,
    make_policy_spec,
    partition_placements,
)


@pytest.fixture(scope="module")
def spec():
    policy = drone_rl.load_policy("good")
    spec = make_policy_spec(policy.description, policy.make_network(), 1e-4)
    yield spec
    spec.close()


def with_transforms(*names):
    """Policy good's description with other transforms; they decide only what is seen."""
    described = drone_rl.load_policy("good").description.model_dump(mode="json")
    image = described["inputs"]["pixels"]
    image["transforms"] = [n if isinstance(n, dict) else {"name": n} for n in names]
    return PolicyDescription.read(described)


def test_composed_images_equal_observations(spec):
    """Painted by hand and by the renderer and the real transforms."""
    policy = drone_rl.load_policy("good")
    env = policy.make_env(3)
    try:
        state = env.reset()
        seen = state["pixels"]
        nothing = spec.compositor.see(spec.compositor.paint([], 1)[0])
        assert seen.shape[1:] == nothing.shape[1:]
        assert torch.allclose(seen[:, :, 0], nothing[:, :, 0].expand_as(seen[:, :, 0]))
    finally:
        env.close()


def test_later_transforms_are_applied(spec):
    crop = {"name": "crop", "top": 2, "bottom": 22}
    description = with_transforms("gray", crop, {"name": "standardize", "mean": 0.5, "std": 0.25})
    compositor = make_compositor(description, spec.images)
    image = compositor.see(compositor.paint([], 1)[0])
    assert image.shape == (1, 1, 20, 64)
    sky = (0.299 * 158 + 0.587 * 188 + 0.114 * 234) / 255
    assert float(image[0, 0, 0, 0]) == pytest.approx((sky - 0.5) / 0.25, abs=1e-5)


def test_blur_is_monotone(spec):
    blur = {"name": "blur", "width": 1.0}
    compositor = make_compositor(with_transforms("gray", blur), spec.images)
    nothing = compositor.paint([], 1)[0]
    brighter = nothing.clone()
    brighter[0, 12, 32] += 0.1
    dark, bright = compositor.see(nothing), compositor.see(brighter)
    assert (bright >= dark).all() and (bright > dark)[0, 0, 10:15, 30:35].all()


@pytest.mark.parametrize(
    ("most", "strips"), [(1000, [1, 1, 1]), (999, [1, 1, 2]), (100, [1, 1, 10]), (40, [1, 3, 10])]
)
def test_the_farthest_cubes_are_cut_first(most, strips):
    boxes = partition_placements(lattice_spec(3), most)
    assert len(boxes) == math.prod(strips)
    assert [len(np.unique(boxes[:, k, 0])) for k in range(3)] == strips
    assert volumes(boxes).sum() == pytest.approx(12**3)
    lower, upper = boxes[:, None, :, 0], boxes[None, :, :, 1]
    meets = (lower < upper).all(-1)
    assert (meets & meets.T).sum() == len(boxes)  # each only itself
    assert np.abs(boxes).max() == 6.0


def test_tasks_that_take_days_are_refused():
    with pytest.raises(InputError, match=r"task.num_cubes=9 .* 1e\+09 .* fewer cubes"):
        partition_placements(lattice_spec(9), 100)


def lattice_spec(num_cubes, borders=(-7.0, -5.0, 0.0, 5.0, 6.5)):
    """Stand for a `PolicySpec` whose camera has these borders at any distance."""
    camera = SimpleNamespace(borders=lambda ahead: (np.array(borders), None))
    return SimpleNamespace(lattice=Lattice(TaskSettings(num_cubes=num_cubes)), camera=camera)


@pytest.mark.parametrize(
    ("task", "appearance", "message"),
    [
        ({"vertical_bound": 0.5}, {}, "vertical_bound=0.5 is not supported"),
        ({"spacing": 2.0}, {}, "spacing=2.0 puts cubes next to each other"),
        ({"lateral_bound": 0.0}, {}, "leaves a single placement"),
        ({"step_length": 0.3}, {}, "are rounded"),
        ({}, {"fog_visibility": 50.0}, "appearance=minimal"),
    ],
)
def test_unsupported_tasks_and_appearances_are_refused(task, appearance, message):
    policy = drone_rl.load_policy("good").in_task(**task)
    policy = policy.in_appearance(AppearanceSettings(**appearance))
    with pytest.raises(InputError, match=message):
        make_policy_spec(policy.description, policy.make_network(), 1e-4)
