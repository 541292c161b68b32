"""What can be proved is taken apart; what can't is refused in one line."""

import dataclasses

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.config import AppearanceSettings, TaskSettings
from drone_rl.policies.zoo import parse
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.cells import Cells
from drone_rl.verification.prover.cube_images import CubeView
from drone_rl.verification.prover.policy_spec import check_task, make_compositor, make_policy_spec
from tests.own_networks import Mirrored


@pytest.fixture(scope="module")
def spec():
    policy = drone_rl.load_policy("good")
    spec = make_policy_spec(policy.description, policy.make_network(), 1e-4)
    yield spec
    spec.close()


def with_transforms(*names):
    """Policy good's description with other transforms; they decide only what is seen."""
    described = drone_rl.load_policy("good").description.as_dict()
    described["transforms"] = [n if isinstance(n, dict) else {"name": n} for n in names]
    return parse(described)


def test_pictures_are_what_the_network_sees(spec):
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


def test_transforms_after_the_shades_are_applied(spec):
    crop = {"name": "crop", "top": 2, "bottom": 22}
    description = with_transforms("gray", crop, {"name": "standardize", "mean": 0.5, "std": 0.25})
    compositor = make_compositor(description, spec.images)
    image = compositor.see(compositor.paint([], 1)[0])
    assert image.shape == (1, 1, 20, 64)
    sky = (0.299 * 158 + 0.587 * 188 + 0.114 * 234) / 255
    assert float(image[0, 0, 0, 0]) == pytest.approx((sky - 0.5) / 0.25, abs=1e-5)


def test_a_resize_to_the_same_size_is_left_out(spec):
    resize = {"name": "resize", "height": 25, "width": 64}
    standardize = {"name": "standardize", "mean": 0.5, "std": 0.25}
    plain = make_compositor(with_transforms("gray", standardize), spec.images)
    resized = make_compositor(with_transforms("gray", resize, standardize), spec.images)
    assert resized._rest is None
    image = plain.paint([], 1)[0]
    assert torch.equal(resized.paint([], 1)[0], image)
    smaller = make_compositor(with_transforms("gray", {**resize, "height": 24}), spec.images)
    assert smaller.see(smaller.paint([], 1)[0]).shape == (1, 1, 24, 64)


def test_a_blurred_picture_is_bounded_by_its_blurred_bounds(spec):
    blur = {"name": "blur", "width": 1.0}
    compositor = make_compositor(with_transforms("gray", blur), spec.images)
    nothing = compositor.paint([], 1)[0]
    brighter = nothing.clone()
    brighter[0, 12, 32] += 0.1
    dark, bright = compositor.see(nothing), compositor.see(brighter)
    assert (bright >= dark).all() and (bright > dark)[0, 0, 10:15, 30:35].all()


def test_cells_are_those_of_a_cubes_distance(spec):
    """The second cube is 24 m ahead of the start, so 19.6 m of the camera after 4 steps."""
    cells = spec.cells(1, 4, -3.0, 3.0)
    expected = Cells(spec.camera, 24.0 - 4.0 - 0.4, -3.0, 3.0, CubeView(spec.images, 1, 4))
    assert np.array_equal(cells.limits, expected.limits)
    assert np.array_equal(cells.images, expected.images)
    assert len(cells) > 10 and cells.images.any()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"vertical_bound": 0.5}, "vertical_bound=0.5 is not supported"),
        ({"spacing": 2.0}, "spacing=2.0 puts cubes next to each other"),
        ({"lateral_bound": 0.0}, "leaves a single placement"),
    ],
)
def test_worlds_without_a_closed_form_are_refused(change, message):
    check_task(TaskSettings())
    with pytest.raises(InputError, match=message):
        check_task(TaskSettings(**change))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"step_length": 0.3}, "are rounded"),
        ({"cube_color": (0.0, 0.0, 0.0)}, "gives a face the color of another"),
    ],
)
def test_what_the_parts_refuse_is_refused(change, message):
    policy = drone_rl.load_policy("good").in_task(**change)
    with pytest.raises(InputError, match=message):
        make_policy_spec(policy.description, policy.make_network(), 1e-4)


def test_worlds_of_another_look_are_refused():
    policy = drone_rl.load_policy("good")
    foggy = dataclasses.replace(
        policy.description, appearance=AppearanceSettings(fog_visibility=50.0)
    )
    with pytest.raises(InputError, match="appearance=minimal"):
        make_policy_spec(foggy, policy.make_network(), 1e-4)


def test_the_networks_actions_must_be_moves():
    policy = drone_rl.load_policy("good")
    network = policy.make_network()
    network.actions = dataclasses.replace(network.actions)
    with pytest.raises(InputError, match="support only the actions"):
        make_policy_spec(policy.description, network, 1e-4)


def test_a_forward_pass_of_its_own_is_refused():
    description = drone_rl.load_policy("good").description
    with pytest.raises(InputError, match="Mirrored has a forward of its own"):
        make_policy_spec(description, Mirrored(description.input.shape, 3), 1e-4)
