"""Descriptions are strict and complete, and build the described policy."""

import copy

import pytest
import torch

from drone_rl.config import COMPUTER_VISION, MOVES_SETTINGS, ActionSettings, AppearanceSettings
from drone_rl.config.registry import register_network, register_transform
from drone_rl.envs.transforms import PixelTransform
from drone_rl.policies import SmallCNN
from drone_rl.policies.zoo import parse
from drone_rl.sim.dynamics import ComputerVision
from drone_rl.utils.errors import InputError
from tests.fake_flight import FLIGHT, floating
from tests.forked import run_forked
from tests.second_dynamics import Turning

DEFAULT = {
    "format": "drone_rl policy",
    "format_version": 2,
    "task": {
        "num_cubes": 3,
        "first_distance": 15.0,
        "spacing": 9.0,
        "lateral_bound": 6.0,
        "vertical_bound": 0.0,
        "cube_size": 2.5,
        "cube_color": [0.75, 0.12, 0.08],
        "drone_size": 0.8,
        "altitude": 2.5,
        "step_length": 1.0,
        "step_limit": 300,
        "front_margin": 11.0,
        "side_margin": 20.0,
    },
    "camera": {"width": 64, "height": 25, "horizontal_fov": 135.0},
    "transforms": [{"name": "gray"}, {"name": "standardize", "mean": 0.53, "std": 0.21}],
    "network": {"name": "small_cnn", "patch": 4, "channels": [16, 32], "hidden": [128]},
}
GRAY, STACK = {"name": "gray"}, {"name": "stack", "N": 2}
DEAD = {"name": "dead_rows", "count": 0, "rows": [], "level": 0.0}


def changed(where, value):
    """Return the default description with one value changed, or removed if it is `...`."""
    data, *keys = copy.deepcopy(DEFAULT), *where.split(".")
    part = data
    for key in keys[:-1]:
        part = part[int(key) if key.isdigit() else key]
    if value is ...:
        del part[keys[-1]]
    else:
        part[int(keys[-1]) if keys[-1].isdigit() else keys[-1]] = value
    return data


def test_critic_is_the_network_with_one_output():
    described = parse(DEFAULT)
    critic = described.build_critic(torch.Generator().manual_seed(0))
    wanted = dict(described.expected_weights())
    shapes = {name: tuple(value.shape) for name, value in critic.state_dict().items()}
    last = {"layers.logits.weight": (1, 128), "layers.logits.bias": (1,)}
    assert shapes == {name: tuple(value.shape) for name, value in wanted.items()} | last
    assert critic(torch.zeros(5, 1, 25, 64)).shape == (5, 1)


class Own(SmallCNN):
    """The small network with another result."""

    result = staticmethod(lambda logits: logits)

    def __init__(self, in_shape, num_actions, *, generator: torch.Generator | None = None):
        super().__init__(in_shape, num_actions, generator=generator)

    def forward(self, pixels):
        return self.result(super().forward(pixels))


@pytest.mark.parametrize(
    ("result", "fault"),
    [
        (lambda _: None, r"returns None for input of shape \(2, 1, 25, 64\)"),
        (lambda x: x[:, :2], r"returns a Tensor of shape \(2, 2\) .* of shape \(2, 3\)$"),
        (lambda x: x @ x, r"network=own failed in line \d+ of .*\(RuntimeError: mat1 and mat2"),
    ],
)
def test_wrong_outputs_of_a_registered_network_are_named(registered, monkeypatch, result, fault):
    registered(register_network("own")(Own))
    described = parse({**DEFAULT, "network": {"name": "own"}})
    weights = described.build_network().state_dict()
    monkeypatch.setattr(Own, "result", staticmethod(result))
    for build in (described.build_network, lambda: described.load_network(weights)):
        with pytest.raises(InputError, match=fault) as error:
            build()
        assert __file__ in str(error.value)


@pytest.mark.parametrize(
    ("result", "fault"),
    [
        (lambda _: None, r"returns None for input .*; return a tensor of shape \(2, C, H, W\)$"),
        (lambda x: x.double(), "returns float64"),
        (lambda x: x * float("nan"), "returns values that are not finite"),
        (lambda x: x.nope, r"transform=own failed in line \d+ of .*\(AttributeError: 'Tensor'"),
    ],
)
def test_wrong_outputs_of_a_registered_transform_are_named(registered, result, fault):
    class Filter(PixelTransform):
        def _apply_transform(self, obs):
            return result(obs)

    registered(register_transform("own")(Filter))
    with pytest.raises(InputError, match=fault) as error:
        parse({**DEFAULT, "transforms": [GRAY, {"name": "own"}]})
    assert __file__ in str(error.value)


def test_description_round_trip():
    assert parse(DEFAULT).as_dict() == DEFAULT
    assert parse(parse(DEFAULT).as_dict()) == parse(DEFAULT)


def test_expected_weights_are_known_without_building():
    expected = parse(DEFAULT).expected_weights()
    built = parse(DEFAULT).build_network(torch.Generator().manual_seed(0)).state_dict()
    assert all(value.is_meta for value in expected.values())
    assert {k: (v.shape, v.dtype) for k, v in expected.items()} == {
        k: (v.shape, v.dtype) for k, v in built.items()
    }


@pytest.mark.parametrize(
    ("camera", "transforms", "shape"),
    [
        ((25, 64), [GRAY], (1, 25, 64)),
        ((36, 64), [GRAY, {"name": "crop", "top": 5, "bottom": 30}], (1, 25, 64)),
        ((50, 100), [GRAY, {"name": "resize", "height": 13, "width": 20}], (1, 13, 20)),
        (
            (25, 64),
            [GRAY, STACK, {"name": "episode_reward"}, {"name": "step_count"}],
            (2, 25, 64),
        ),
    ],
)
def test_image_shape_is_predicted(camera, transforms, shape):
    data = {**DEFAULT, "transforms": transforms}
    data["camera"] = {"height": camera[0], "width": camera[1], "horizontal_fov": 90.0}
    described = parse(data)
    assert described.input.shape == shape
    env = described.build_env(1, seed=0, device="cpu")
    assert tuple(env.reset()["pixels"].shape[1:]) == shape
    env.close()


@pytest.mark.parametrize(
    ("where", "value", "message"),
    [
        ("format", "drone_rl checkpoint", "format='drone_rl checkpoint'"),
        ("format_version", 3, "format_version=3"),
        ("more", 1, "missing or unknown: 'more'"),
        ("task", ..., "missing or unknown: 'task'"),
        ("task.num_cubes", 10**9, r"task\.num_cubes=1000000000"),
        ("task.num_cubes", True, "num_cubes=True"),
        ("task.spacing", float("nan"), "spacing=nan"),
        ("task.wind", 1.0, "task.wind is unknown"),
        ("task.vertical_bound", 3.0, "fly into the floor"),
        ("camera.width", 4096, "width=4096"),
        ("camera.width", 1024, None),
        ("transforms", [], "needs floats"),
        ("transforms", [GRAY] * 17, "at most 16 items"),
        ("transforms", [GRAY, GRAY], "put it first"),
        ("transforms", [GRAY, {"name": "crop", "top": 9, "bottom": 9}], "9 to 9 of 25"),
        ("transforms", [GRAY, {**DEAD, "count": 26}], "the image has 25 rows"),
        ("transforms", [GRAY, {**DEAD, "rows": [25]}], "the image has 25 rows"),
        ("transforms", [GRAY, {**DEAD, "rows": [3, 3]}], "twice"),
        ("transforms", [GRAY, {**STACK, "N": 16}, {**STACK, "N": 16}, {**STACK, "N": 16}], "shape"),
        ("transforms.1.std", 0.0, r"transforms\[1\]\.std=0\.0"),
        ("transforms.0.name", "exec", r"transforms\[0\]\.name='exec': it must be one of gray"),
        ("network.name", "os.system", "network.name='os.system': it must be one of small_cnn"),
        ("network.hidden", [128] * 9, "at most 8 items"),
        ("network.hidden", [4096] * 3, "parameters"),
        ("network.patch", 26, "too small"),
        ("network.bias", True, "network.bias is unknown"),
    ],
)
def test_out_of_bounds_values_are_named(where, value, message):
    if message is None:
        parse(changed(where, value))  # at the bound
        return
    with pytest.raises(InputError, match=message) as error:
        parse(changed(where, value))
    assert "\n" not in str(error.value)


def test_number_of_pixels_is_bounded():
    camera = {"width": 1024, "height": 256, "horizontal_fov": 90.0}
    network = {"name": "small_cnn", "patch": 64, "channels": [4], "hidden": []}
    parse({**DEFAULT, "camera": camera, "network": network})
    with pytest.raises(InputError, match="263168 pixels"):
        parse({**DEFAULT, "camera": {**camera, "height": 257}, "network": network})


def test_parsing_and_loading_compute_nothing(tmp_path):
    """Computing on the meta device would load torch's symbolic algebra, which takes 0.5 s."""
    code = """import sys
import torch
from drone_rl.config.training import TrainSettings
from drone_rl.policies.zoo import describe
described = describe(TrainSettings())
wanted = described.expected_weights()
described.load_network({name: torch.zeros(one.shape) for name, one in wanted.items()})
print("sympy" in sys.modules)"""
    done = run_forked(code, cwd=tmp_path)
    assert done.stdout == "False\n", done.stderr


def test_loaded_weights_keep_their_memory_layout():
    description = parse(DEFAULT)
    built = description.build_network(torch.Generator().manual_seed(0))
    loaded = description.load_network(built.state_dict())
    pairs = zip(built.parameters(), loaded.parameters(), strict=True)
    for one, other in pairs:
        assert torch.equal(one, other) and one.stride() == other.stride()
        assert one.data_ptr() != other.data_ptr() and other.requires_grad
    assert loaded.actions is built.actions and not loaded.training


def test_without_faults_removes_camera_faults():
    blur, late = {"name": "blur", "width": 1.0}, {"name": "late_frames", "frames": 2}
    described = parse({**DEFAULT, "transforms": [GRAY, blur, DEAD, late]})
    assert described.faults == ("dead_rows", "late_frames")
    assert described.without_faults() == parse({**DEFAULT, "transforms": [GRAY, blur]})
    assert parse(DEFAULT).without_faults() == parse(DEFAULT)


def test_appearance_is_written_unless_minimal():
    assert "appearance" not in parse(DEFAULT).as_dict() and parse(DEFAULT).appearance.is_minimal
    look = AppearanceSettings(fog_visibility=(20.0, 50.0), ground_texture="grid").values()
    described = parse({**DEFAULT, "appearance": look})
    assert described.as_dict()["appearance"] == look
    assert parse(described.as_dict()) == described
    env = described.build_env(1, seed=0, device="cpu")
    assert 20.0 <= env.base_env.appearances.values[0, 14] <= 50.0
    env.close()
    for wrong in ({**look, "fog_visibility": 0.0}, {"fog": 5.0}, 3):
        with pytest.raises(InputError, match="appearance"):
            parse({**DEFAULT, "appearance": wrong})


def test_dynamics_and_actions_are_written_unless_default():
    plain = parse(DEFAULT)
    assert plain.dynamics.is_computer_vision and plain.actions == MOVES_SETTINGS
    windy, fast = FLIGHT.replace(wind=(2.0, 0.0, 0.0)).values(), ActionSettings(move_speed=5.0)
    described = parse({**DEFAULT, "dynamics": windy, "actions": fast.values()})
    assert described.as_dict() == {**DEFAULT, "dynamics": windy, "actions": fast.values()}
    assert parse(described.as_dict()) == described
    assert [*described.expected_weights()] == [*plain.expected_weights()]
    still = {"dynamics": plain.dynamics.values(), "actions": plain.actions.values()}
    assert parse({**DEFAULT, **still}).as_dict() == DEFAULT


@pytest.mark.parametrize(
    ("part", "value", "message"),
    [
        ("dynamics", {**FLIGHT.values(), "mass": -1.0}, r"dynamics\.mass=-1\.0"),
        ("dynamics", {**COMPUTER_VISION.values(), "gusts": 1.0}, r"dynamics\.gusts=1\.0 moves"),
        ("dynamics", {**FLIGHT.values(), "_target_": "os.system"}, "dynamics._target_ is unknown"),
        ("actions", {**MOVES_SETTINGS.values(), "kind": "eval"}, r"actions\.kind='eval'"),
    ],
)
def test_out_of_bounds_dynamics_and_actions_are_named(part, value, message):
    with pytest.raises(InputError, match=message) as error:
        parse({**DEFAULT, part: value})
    assert "\n" not in str(error.value)


def test_environment_uses_described_or_given_dynamics(monkeypatch):
    floating(monkeypatch)
    fast = ActionSettings(move_speed=5.0)
    flight = {"dynamics": FLIGHT.values(), "actions": fast.values()}
    described = parse({**DEFAULT, **flight})

    def flown(**options):
        env = described.build_env(1, seed=0, device="cpu", pixels=False, **options)
        return env.base_env.worlds.dynamics

    own = flown()
    assert (own.settings, own.action_settings) == (FLIGHT, fast)
    windy = FLIGHT.replace(wind=(1.0, 0.0, 0.0))
    assert (flown(dynamics=windy).settings, flown(dynamics=windy).action_settings) == (windy, fast)
    turning = Turning()
    assert flown(dynamics=turning) is turning
    assert type(flown(dynamics=COMPUTER_VISION)) is ComputerVision


def test_values_that_are_no_weights_survive_loading(registered):
    @register_network("own")
    class Tilted(SmallCNN):
        def __init__(self, in_shape, num_actions, *, generator=None):
            super().__init__(in_shape, num_actions, generator=generator)
            self.register_buffer("tilt", torch.linspace(1, 2, in_shape[-1]), persistent=False)

        def forward(self, pixels):
            return super().forward(pixels + self.tilt)

    registered(Tilted)
    described = parse({**DEFAULT, "network": {"name": "own"}})
    built = described.build_network(torch.Generator().manual_seed(0))
    assert torch.equal(described.load_network(built.state_dict()).tilt, built.tilt)
