"""Descriptions are strict and complete, and build the described policy."""

import copy
import hashlib
from pathlib import Path

import pytest
import torch

from drone_rl.config import (
    COMPUTER_VISION,
    TASKS,
    ActionSettings,
    AppearanceSettings,
    TaskSettings,
)
from drone_rl.config.registry import register_network, register_transform
from drone_rl.envs.transforms import PixelTransform
from drone_rl.policies import SmallCNN
from drone_rl.policies.zoo import PolicyDescription
from drone_rl.policies.zoo.description import ActionSpace, TaskDescription
from drone_rl.sim.dynamics import ComputerVision
from drone_rl.sim.scenes import load_scene
from drone_rl.sim.tasks import as_settings
from drone_rl.utils.errors import InputError
from tests.fake_flight import FLIGHT, floating
from tests.forked import run_forked
from tests.second_dynamics import Turning
from tests.second_task import Posts

DEFAULT = {
    "format": "drone_rl policy",
    "format_version": 3,
    "task": {
        "name": "collect_cubes",
        "parameters": {
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
        "rewards": {},
        "scene": None,
        "code": None,
    },
    "inputs": {
        "pixels": {
            "kind": "image",
            "camera": {"name": "front", "horizontal_fov": 135.0},
            "size": [25, 64],
            "modality": "rgb",
            "maximum": None,
            "transforms": [{"name": "gray"}, {"name": "standardize", "mean": 0.53, "std": 0.21}],
        }
    },
    "actions": {
        "settings": {
            "kind": "moves",
            "move_speed": 4.0,
            "move_lead": 0.5,
            "turn_step": 15.0,
            "forward_speed": 4.0,
            "sideways_speed": 3.0,
            "yaw_rate": 45.0,
            "climb_speed": 0.0,
            "backward_speed": 0.0,
        },
        "axes": [
            {"name": "forward", "unit": "moves", "low": 0.0, "high": 1.0, "step": 1.0},
            {"name": "left", "unit": "moves", "low": -1.0, "high": 1.0, "step": 1.0},
        ],
    },
    "network": {"name": "small_cnn", "patch": 4, "channels": [16, 32], "hidden": [128]},
    "appearance": AppearanceSettings().values(),
    "dynamics": COMPUTER_VISION.values(),
}
parse = PolicyDescription.read
IMAGE = "inputs.pixels"
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


def with_image(**changes):
    """Return the default description with another image."""
    image = {**DEFAULT["inputs"]["pixels"], **changes}
    return {**DEFAULT, "inputs": {"pixels": image}}


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
        parse(with_image(transforms=[GRAY, {"name": "own"}]))
    assert __file__ in str(error.value)


def test_description_round_trip():
    described = parse(DEFAULT)
    assert described.model_dump(mode="json") == DEFAULT
    assert parse(DEFAULT) == described
    assert PolicyDescription.model_validate_json(described.model_dump_json()) == described


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
    described = parse(with_image(size=camera, transforms=transforms))
    assert described.shapes["pixels"] == shape
    env = described.build_env(1, seed=0, device="cpu")
    assert tuple(env.reset()["pixels"].shape[1:]) == shape
    env.close()


@pytest.mark.parametrize(
    ("where", "value", "message"),
    [
        ("format", "drone_rl checkpoint", "format='drone_rl checkpoint'"),
        ("format_version", 2, "former layout; convert the file: drone-rl convert FILE"),
        ("format_version", 4, "format_version=4"),
        ("more", 1, "more is unknown"),
        ("task", ..., "task is missing"),
        ("task.name", "exec", r"task\.parameters\.name='exec': it must be one of collect_cubes"),
        ("task.parameters", "pillars", "task.parameters: it must be a mapping"),
        ("task.parameters.num_cubes", 10**9, r"task\.parameters\.num_cubes=1000000000"),
        ("task.parameters.vertical_bound", 3.0, "into the floor; give at least 4.25"),
        ("task.scene", {"name": "house.xml"}, r"task\.scene=.*must be a list"),
        ("task.code", {"name": "a", "hash": "0" * 63}, "task.code.hash"),
        ("inputs", {}, "inputs=.* at least 1 item"),
        (f"{IMAGE}.kind", "vector", "vector.quantity is missing"),
        (f"{IMAGE}.size", [25, 4096], "width=4096"),
        (f"{IMAGE}.size", [25, 1024], None),
        (f"{IMAGE}.transforms", [], "needs floats"),
        (f"{IMAGE}.transforms", [GRAY] * 17, "at most 16 items"),
        (f"{IMAGE}.transforms", [GRAY, GRAY], "put it first"),
        (f"{IMAGE}.transforms", [GRAY, {"name": "crop", "top": 9, "bottom": 9}], "9 to 9 of 25"),
        (f"{IMAGE}.transforms", [GRAY, *[{**STACK, "N": 16}] * 3], "shape"),
        (f"{IMAGE}.transforms.0.name", "exec", r"transforms\[0\]\.name='exec': it must be one of"),
        (f"{IMAGE}.transforms.0._target_", "os.system", "_target_='os.system' is refused"),
        ("actions.settings.kind", "eval", r"actions\.settings\.kind='eval'"),
        ("actions.axes.0.high", 2.0, "axes are not those of the settings"),
        ("network.name", "os.system", "network.name='os.system': it must be one of small_cnn"),
        ("network._target_", "os.system", "_target_='os.system' is refused"),
        ("network.hidden", [4096] * 3, "parameters"),
        ("network.patch", 26, "too small"),
        ("network.bias", True, "network.bias is unknown"),
        ("dynamics.gusts", 1.0, r"dynamics\.gusts=1\.0 moves nothing"),
        ("dynamics._target_", "os.system", "dynamics._target_ is unknown"),
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
    network = {"name": "small_cnn", "patch": 64, "channels": [4], "hidden": []}
    parse({**with_image(size=[256, 1024]), "network": network})
    with pytest.raises(InputError, match="263168 pixels"):
        parse({**with_image(size=[257, 1024]), "network": network})


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
    described = parse(with_image(transforms=[GRAY, blur, DEAD, late]))
    assert described.faults == ("dead_rows", "late_frames")
    assert described.without_faults() == parse(with_image(transforms=[GRAY, blur]))
    assert parse(DEFAULT).without_faults() == parse(DEFAULT)


def test_appearance_is_that_of_the_environment():
    look = AppearanceSettings(fog_visibility=(20.0, 50.0), ground_texture="grid").values()
    described = parse({**DEFAULT, "appearance": look})
    assert parse(described.model_dump(mode="json")) == described
    env = described.build_env(1, seed=0, device="cpu")
    assert 20.0 <= env.base_env.appearances.values[0, 14] <= 50.0
    env.close()


def test_axes_of_actions_have_units_and_bounds():
    settings = ActionSettings(kind="velocity", forward_speed=5.0, yaw_rate=30.0)
    axes = [tuple(axis.model_dump().values()) for axis in settings.axes]
    assert axes == [
        ("forward", "m/s", 0.0, 5.0, None),
        ("left", "m/s", -3.0, 3.0, None),
        ("turn left", "degrees/s", -30.0, 30.0, None),
    ]
    assert [axis.name for axis in ActionSettings(kind="moves_3d").axes] == ["forward", "left", "up"]
    free = ActionSettings(kind="velocity", climb_speed=2.0, backward_speed=1.0).axes
    assert [(axis.name, axis.low) for axis in free[::3]] == [("forward", -1.0), ("up", -2.0)]
    full = [tuple(axis.model_dump().values()) for axis in ActionSettings(kind="moves_full").axes]
    assert full[::3] == [
        ("forward", "moves", -1.0, 1.0, 1.0),
        ("turn left", "turns", -1.0, 1.0, 1.0),
    ]


def test_environment_uses_described_or_given_dynamics(monkeypatch):
    floating(monkeypatch)
    fast = ActionSettings(move_speed=5.0)
    actions = ActionSpace.of(fast).model_dump(mode="json")
    flight = {"dynamics": FLIGHT.values(), "actions": actions}
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


def test_the_file_of_a_users_task_is_named_and_another_one_reported(caplog):
    described = TaskDescription.of(as_settings(Posts()))
    content = Path("tests/second_task.py").read_bytes()
    assert (described.code.name, described.rewards) == ("second_task.py", {})
    assert described.code.hash == hashlib.sha256(content).hexdigest()
    stored = described.model_dump(mode="json")
    assert TaskDescription.read(stored) == described and not caplog.messages
    TaskDescription.read({**stored, "code": {"name": "older.py", "hash": "0" * 64}})
    missing = {**stored, "name": "not_imported"}
    with pytest.raises(InputError, match=r"'not_imported' is a task of 'second_task.py'.*plugins="):
        TaskDescription.read(missing)
    assert "older.py" in caplog.text
    shipped = TaskDescription.of(TaskSettings())
    assert shipped.code is None and shipped.rewards == {"reached": 1.0}


def test_a_scene_is_named_by_its_hash_and_missed_when_it_is_needed(tmp_path, caplog):
    file = tmp_path / "hall.xml"
    text = '<mujoco><worldbody><geom type="plane" size="9 9 1"/>{}</worldbody></mujoco>'
    file.write_text(text.format('<site name="goal" pos="3 0 1"/><site name="start" pos="0 0 1"/>'))
    task = TASKS["reach"](scene=(str(file),), start={"z": 1.0})
    described = TaskDescription.of(task)
    (scene,) = described.scene
    assert (scene.name, scene.hash) == ("hall.xml", load_scene(file).sha256)
    assert "plane" not in described.model_dump_json()
    file.write_text(text.format('<site name="goal" pos="4 0 1"/><site name="start" pos="0 0 1"/>'))
    again = TaskDescription.read(described.model_dump(mode="json"))
    again.changed(task.replace(step_limit=5)).check_scenes()
    assert "has changed since this policy's training" in caplog.text
    assert again.changed(task.replace(scene=("indoor",))).scene[0].name == "indoor.xml"
    file.unlink()
    missing = TaskDescription.read(described.model_dump(mode="json"))
    with pytest.raises(InputError, match=r"hall\.xml.*is not there; give its path, task\.scene="):
        missing.check_scenes()
