import pytest
from torchrl.envs.utils import check_env_specs

import drone_rl
from drone_rl.config.transforms import Gray
from drone_rl.policies.zoo import certificate_path, describe, policy_path
from drone_rl.sim import worlds as worlds_module
from drone_rl.sim.tasks import Pillars
from drone_rl.utils.errors import InputError
from tests.fake_flight import floating
from tests.second_dynamics import Turning


def test_specs_of_a_policys_environment():
    env = drone_rl.make_env(2, task=drone_rl.TaskSettings(num_cubes=2), seed=3)
    assert env.reset()["pixels"].shape == (2, 1, 25, 64)
    assert env.reset()["info", "cube_positions"].shape == (2, 2, 3)
    check_env_specs(env)
    env.close()


def test_images_are_resized_to_the_network():
    env = drone_rl.make_env(1, camera={"width": 32, "height": 13})
    assert env.reset()["pixels"].shape == (1, 1, 25, 64)
    env.close()
    settings = drone_rl.TrainSettings(camera=drone_rl.CameraSettings(width=128, height=50))
    assert [step.name for step in settings.transforms] == ["gray", "resize", "standardize"]
    described = describe(settings)
    assert described.shapes["pixels"] == (1, 25, 64)


def test_task_is_selected_by_name():
    env = drone_rl.make_env(1, task="pillars")
    assert isinstance(env.base_env.worlds.task, Pillars)
    env.close()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"task": "pillar"}, "task='pillar': it must be one of"),
        ({"taks": 3}, "taks is unknown; valid names: .* mean task"),
        ({"dynamics": "simple_flight"}, "dynamics='simple_flight'"),
        ({"appearance": "smog"}, "appearance='smog': it must be one of"),
        ({"transforms": "gray"}, r"transforms\[0\]='gray' is no transform"),
        ({"transforms": [Gray(), 3]}, r"transforms\[1\]=3 is no transform"),
    ],
)
def test_values_of_wrong_type_raise_with_the_name(given, message):
    with pytest.raises(InputError, match=f"^{message}"):
        drone_rl.make_env(1, **given)


def test_a_policys_environment_has_no_other_options():
    policy = drone_rl.load_policy("good")
    for one in (policy, drone_rl.policy_from(lambda images: images[:, 0, 0, :3])):
        with pytest.raises(InputError, match=r"^apearance is unknown; .* mean appearance"):
            one.make_env(1, apearance="fog")


@pytest.mark.parametrize(
    ("command", "given"),
    [
        *[(command, "good") for command in ("prove", "places", "chances", "explain", "judge")],
        ("check", certificate_path(policy_path("proved"))),
    ],
)
def test_commands_pass_the_renderer_on(command, given, monkeypatch, tmp_path):
    def refuse(which):
        raise InputError(f"asked for {which}")

    monkeypatch.setattr(worlds_module, "find_renderer", refuse)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="asked for mujoco_warp"):
        getattr(drone_rl, command)(given, renderer="mujoco_warp", progress=lambda *_: None)


def test_unknown_renderer_raises():
    with pytest.raises(InputError, match="renderer='opengl' is unknown; give one of: raytrace"):
        drone_rl.make_env(1, renderer="opengl")
    with pytest.raises(InputError, match="renderer='opengl': it must be 'raytrace'"):
        drone_rl.TrainSettings(renderer="opengl")


def test_settings_of_dynamics_and_actions(monkeypatch):
    floating(monkeypatch)
    slow = drone_rl.ActionSettings(move_speed=1.0)
    windy = drone_rl.DynamicsSettings(mode="simple_flight", wind=(1.0, 0.0, 0.0))
    env = drone_rl.make_env(2, dynamics=windy, actions=slow)
    made = env.base_env.worlds.dynamics
    assert (made.settings, made.action_settings) == (windy, slow)
    env.close()
    with pytest.raises(InputError, match=r"^actions=moves, but dynamics=Turning brings its own"):
        drone_rl.make_env(1, dynamics=Turning(), actions=slow)
