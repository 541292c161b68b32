"""Inputs of policies: their values by hand, and the same values from readings of real sensors."""

import io

import numpy as np
import pytest
import torch
from PIL import Image

import drone_rl
from drone_rl import InputError, define_task
from drone_rl.config.inputs import Altitude, DepthImage, Goal, GrayImage, LastAction
from drone_rl.config.networks import SmallCnn
from drone_rl.config.training import TrainSettings
from drone_rl.envs import base_env
from drone_rl.envs.rollout import ActorAgent, steps
from drone_rl.flight.fly_page.flight import Flight
from drone_rl.flight.settings import FlySettings
from drone_rl.policies import make_actor
from drone_rl.policies.zoo import describe, make_onnx, open_onnx
from drone_rl.training import demonstrations
from drone_rl.training.cloning import clone
from drone_rl.trust.onnx_export import agreement
from drone_rl.trust.video import film_episode, render_step
from tests.flight.fly_page.conftest import decode
from tests.untrained import untrained

FORWARD, LEFT = 0, 1
BOX = {"size": [2.0, 2.0, 2.0], "x": 6.0, "y": 0.0, "z": 2.5}
BALL = {"shape": "ball", "role": "goal", "size": [1.0, 1.0, 1.0], "x": 9.0, "y": 3.0, "z": 4.5}


@pytest.fixture
def see():
    """Return a function that makes environments of the task and acts in them."""
    objects, rewards = {"box": BOX, "ball": BALL}, {"progress": 1.0}
    define_task("test_inputs", objects=objects, reward=rewards, success=["all_goals"])
    envs = []

    def observe(inputs, *actions, num_envs=1, **task):
        """Return the inputs at each step, of shapes (T, num_envs, *)."""
        settings = drone_rl.config.BaseTaskSettings.read({"name": "test_inputs", **task}, "task")
        env = drone_rl.make_env(num_envs, task=settings, inputs=inputs)
        envs.append(env)
        seen = [env.reset()]
        for action in actions:
            seen.append(env.step(seen[-1].set("action", torch.full((num_envs,), action)))["next"])
        return torch.stack([step.select(*inputs) for step in seen])

    yield observe
    for env in envs:
        env.close()


def test_depth_of_a_box_is_that_along_the_axis_of_the_camera(see):
    seen = see({"depth": DepthImage(maximum=10.0, size=(9, 9))}, FORWARD)["depth"][:, 0, 0]
    # the face is at x 5, the camera 0.4 m in front of the drone; standardized by 0.5 and 0.25
    for step, face in zip(seen, (4.6, 3.6), strict=True):
        assert step[4, 4] == pytest.approx((face / 10.0 - 0.5) / 0.25, abs=1e-5)
        assert step[0, 0] == pytest.approx(2.0)  # the sky is the maximum


def test_a_camera_looks_down(see):
    down = DepthImage(camera="down", maximum=10.0, size=(9, 9))
    below = float(see({"down": down})["down"][0, 0, 0, 4, 4])
    assert 10.0 * (0.25 * below + 0.5) == pytest.approx(
        2.5, abs=0.5
    )  # its mount is below the drone


def test_a_segmentation_is_the_same_in_every_scene(see):
    seen = see(["segmentation"])["segmentation"][0, 0]
    assert seen.sum(0).eq(1).all()
    assert seen[:, 12, 32].tolist() == [0, 1, 0, 0, 0]  # target, obstacle, ground, other, sky
    assert seen[:, -1, 0].tolist() == [0, 0, 1, 0, 0] and seen[:, 0, 0].tolist() == [0, 0, 0, 0, 1]


@pytest.mark.parametrize(
    ("heading", "expected"), [(0.0, [0.9, 0.3, 0.2]), (90.0, [0.3, -0.9, 0.2])]
)
def test_the_goal_is_where_the_drone_sees_it_after_a_turn(see, heading, expected):
    goal = see(["goal"], start={"heading": heading})["goal"][0, 0]
    assert goal.tolist() == pytest.approx(expected, abs=1e-6)


def test_the_last_action_starts_at_zero(see):
    assert see(["last_action"], FORWARD, LEFT)["last_action"][:, 0].tolist() == [
        [0.0, 0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
    ]


def test_errors_of_vectors_are_in_their_unit(see):
    late = see({"goal": Goal(delay=1)}, FORWARD, FORWARD)["goal"][:, 0, 0]
    assert late.tolist() == pytest.approx([0.9, 0.9, 0.8])
    lost = see({"goal": Goal(loss=1.0)}, FORWARD, FORWARD)["goal"][:, 0, 0]
    assert lost.tolist() == pytest.approx([0.9, 0.9, 0.9])
    noise = see({"altitude": Altitude(noise=0.5)}, *[LEFT] * 9, num_envs=200)["altitude"]
    assert 5.0 * noise.mean() == pytest.approx(2.5, abs=0.05)
    assert 5.0 * noise.std() == pytest.approx(0.5, abs=0.05)
    bias = 5.0 * see({"altitude": Altitude(bias=0.5)}, LEFT, num_envs=200)["altitude"] - 2.5
    assert torch.equal(bias[0], bias[1])
    assert -0.5 <= bias.min() < -0.45 < 0.45 < bias.max() <= 0.5


def test_images_of_a_stack_begin_with_the_first_frame(see):
    seen = see({"two": GrayImage(stack=2), "one": "gray"}, FORWARD)
    assert torch.equal(seen["two"][1, 0, 0], seen["one"][0, 0, 0])
    assert torch.equal(seen["two"][1, 0, 1], seen["one"][1, 0, 0])


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ([], "inputs: the policy would see nothing"),
        (["gray", "gray"], "inputs: .* names an input twice"),
        (["gray", "foo"], "inputs.foo='foo': it must be one of"),
        ({"gray": {"name": "gray", "stack": 0}}, "inputs.gray.stack=0: it must be a whole"),
        (["velocity"], "drones that move at once have no velocity"),
    ],
)
def test_inputs_that_there_are_not_are_one_line(inputs, message, see):
    with pytest.raises(InputError, match=f"^{message}"):
        see(inputs)


def test_inputs_are_given_without_a_camera():
    with pytest.raises(InputError, match="leave them out"):
        drone_rl.make_env(1, camera={"width": 32}, inputs=["gray"])
    with pytest.raises(InputError, match="camera describes the input pixels, which inputs="):
        TrainSettings(camera={"width": 32}, inputs=["gray"])


# Policies

INPUTS = {
    "gray": GrayImage(noise=0.1, stack=2, size=(17, 33)),
    "down": DepthImage(camera="down"),
    **{name: name for name in ("rgb", "segmentation", "normals", "goal", "altitude")},
    "last_action": LastAction(delay=1),
}


@pytest.fixture
def policy(see):
    """Return an untrained policy of several inputs in the task."""
    del see
    return untrained(SmallCnn(channels=(4,)), task="test_inputs", inputs=INPUTS)


@torch.no_grad()
def test_act_equals_the_network_in_its_environment(policy):
    clean = policy._described(inputs=policy.description.without_faults().inputs)
    network = clean.make_network()
    with clean.flying(3) as (env, actor):
        base = base_env(env)
        for step in steps(ActorAgent(actor), base.observer, base.start(), num_steps=4):
            seen = step.context.inputs
            logits = network(*(seen[name] for name in network.in_keys))
            acted = clean.act_batch(**step.context.readings)
            torch.testing.assert_close(acted, logits.argmax(-1))
    clean.reset()
    first = {name: values[0].numpy() for name, values in step.context.readings.items()}
    policy.reset()
    assert clean.act(**first) == policy.act(**first)  # without simulated errors


def readings(policy, **others):
    images = {
        "gray": np.zeros((17, 33, 3), np.uint8),
        "rgb": np.zeros((25, 64, 3), np.uint8),
        "down": np.zeros((25, 64)),
        "segmentation": np.zeros((25, 64), np.uint8),
        "normals": np.zeros((25, 64, 3)),
    }
    vectors = {"goal": [1, 2, 3], "altitude": [1.0], "last_action": np.zeros(4)}
    return {**images, **vectors, **others}


@pytest.mark.parametrize(
    ("others", "message"),
    [
        ({"depth": 0}, "depth is no input of the policy; it reads gray, down, rgb"),
        ({"goal": [1, 2]}, r"goal of shape \(2,\) .* give float32 of shape \(3\)"),
        ({"goal": [1, 2, np.nan]}, "goal has NaN"),
        ({"goal": "left"}, "goal='left' is no array of numbers"),
        ({"gray": np.zeros((17, 33, 3))}, r"gray of shape .* give uint8 of shape \(17, 33, 3\)"),
    ],
)
def test_readings_that_do_not_fit_are_one_line(policy, others, message):
    with pytest.raises(InputError, match=f"^{message}"):
        policy.act(**readings(policy, **others))


def test_inputs_that_are_not_given_are_one_line(policy):
    given = readings(policy)
    del given["goal"]
    with pytest.raises(InputError, match=r"^the policy reads gray, .*; give goal, too$"):
        policy.act(**given)
    with pytest.raises(InputError, match="give them by name"):
        policy.act(given["gray"])
    batch = {name: np.array(values)[None] for name, values in readings(policy).items()}
    batch["goal"] = np.zeros((2, 3))
    with pytest.raises(InputError, match=r"several numbers of drones: .* goal of 2"):
        policy.act_batch(**batch)


# Gymnasium and Stable-Baselines3


def test_gymnasium_observes_a_dictionary(see):
    check_env = pytest.importorskip("gymnasium.utils.env_checker").check_env
    inputs = {"down": DepthImage(camera="down"), "goal": Goal()}
    want = see(inputs)[0]
    world = drone_rl.DroneWorld("test_inputs", inputs=inputs)
    check_env(world, skip_render_check=True)
    seen, _ = world.reset(seed=0)
    assert {name: values.shape for name, values in seen.items()} == {
        "down": (1, 25, 64),
        "goal": (3,),
    }
    assert all(np.array_equal(values, want[name][0]) for name, values in seen.items())
    with pytest.raises(InputError, match="leave them out"):
        drone_rl.DroneWorld("test_inputs", inputs=["gray"], camera={"width": 32})
    with pytest.raises(InputError, match="inputs are of policies"):
        drone_rl.DroneWorld("test_inputs", inputs=["gray"], observations="state")


def test_a_batch_ends_with_the_last_inputs(see):
    pytest.importorskip("gymnasium")
    del see
    options = {"inputs": ["gray", "goal"], "step_limit": 2, "autoreset_mode": "SameStep"}
    worlds = drone_rl.DroneWorlds(2, "test_inputs", **options)
    worlds.reset(seed=0)
    worlds.step(np.array([FORWARD] * 2))
    seen, *_, info = worlds.step(np.array([FORWARD, LEFT]))
    assert worlds.observation_space.contains(seen)
    last = [info["final_obs"][i]["goal"].tolist() for i in range(2)]
    assert last == [pytest.approx([0.7, 0.3, 0.2]), pytest.approx([0.8, 0.2, 0.2])]
    assert seen["goal"].tolist() == [pytest.approx([0.9, 0.3, 0.2])] * 2


def test_a_model_of_several_inputs_is_read_back(see):
    sb3 = pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.vec_env import VecNormalize

    del see
    worlds = drone_rl.DroneWorlds(2, "test_inputs", inputs=INPUTS, autoreset_mode="SameStep")
    env = drone_rl.Sb3Worlds(worlds)
    model = sb3.PPO("MultiInputPolicy", env, n_steps=4, batch_size=4, n_epochs=1)
    policy = drone_rl.policy_from(model.learn(8))  # checks it on episodes
    assert [*policy.inputs] == [*INPUTS]
    judged = drone_rl.judge(policy, episodes=4, task={"step_limit": 3}, progress=lambda *_: None)
    assert judged.greedy.episodes == 4
    with pytest.raises(InputError, match=r"^VecNormalize makes the dictionary"):
        drone_rl.policy_from(model, env=VecNormalize(env))


def test_a_callable_gets_a_dictionary_of_inputs(see):
    del see

    def to_the_goal(inputs):
        return inputs["goal"] @ torch.tensor([[1.0, 0, 0], [0, 9, -9], [0, 0, 0]])

    inputs = {"depth": "depth", "goal": "goal"}
    policy = drone_rl.policy_from(to_the_goal, task="test_inputs", inputs=inputs)
    with policy.flying(2) as (env, actor):
        assert actor(env.reset())["logits"].tolist() == [pytest.approx([0.9, 2.7, -2.7])] * 2
    with pytest.raises(
        InputError, match=r"a dictionary of inputs of shapes depth \(1, 1, 25, 64\)"
    ):
        drone_rl.policy_from(lambda inputs: inputs["gray"], task="test_inputs", inputs=inputs)


# Exported models


def test_an_exported_model_has_the_inputs_by_name(see):
    onnxruntime = pytest.importorskip("onnxruntime")
    pytest.importorskip("onnxscript")
    del see
    inputs = {**INPUTS, "gray": GrayImage(noise=0.1)}
    policy = untrained(SmallCnn(channels=(4,)), task="test_inputs", inputs=inputs)
    network = policy.make_network()
    network.rescale(torch.full((3,), 50.0), torch.zeros(3))
    content = make_onnx(policy.description, network, {})
    session = onnxruntime.InferenceSession(content)
    assert {entry.name: entry.shape[1:] for entry in session.get_inputs()} == {
        "gray": [25, 64, 3],
        "down": [25, 64],
        "rgb": [25, 64, 3],
        "segmentation": [25, 64],
        "normals": [25, 64, 3],
        "goal": [3],
        "altitude": [1],
        "last_action": [4],
    }
    clean = policy._described(inputs=policy.description.without_faults().inputs)
    env = clean.make_env(8)
    actor = make_actor(network, env.action_spec, torch.Generator().manual_seed(0))
    found = agreement(env, actor, open_onnx(content), 40)
    env.close()
    assert found.difference <= 1e-5 and found.actions_differ == 0 and found.frames == 320


def test_models_of_stacks_are_not_exported(policy):
    pytest.importorskip("onnxscript")
    with pytest.raises(InputError, match="sees a stack of frames"):
        make_onnx(policy.description, policy.make_network(), {})


# Demonstrations, films and the page


def test_a_policy_learns_from_demonstrations_of_its_inputs(tmp_path):
    names = ["gray", "depth", "segmentation", "last_action"]
    task = {"num_cubes": 1, "first_distance": 4.0}
    settings = drone_rl.TrainSettings(task=task, inputs=names)
    paths = demonstrations.record_oracle(tmp_path, settings, flights=2)
    conditions = demonstrations.FlightConditions.of(settings)
    found = demonstrations.read_demonstrations(tmp_path, conditions)
    assert len(paths) == len(found) == 2
    for one in found:
        assert {name: values.shape[1:] for name, values in one.readings.items()} == {
            "gray": (25, 64, 3),
            "depth": (25, 64),
            "segmentation": (25, 64),
            "last_action": (4,),
        }
        moved = np.eye(4)[one.actions[:-1]] * np.array([1, 1, -1, 0])  # right is -1 to the left
        expected = np.where(one.actions[:-1, None] == 2, [0, -1, 0, 0], moved)
        assert np.array_equal(one.readings["last_action"][1:], expected)
    network = describe(settings).build_network(torch.Generator().manual_seed(0))
    done = clone(settings.replace(demonstrations=str(tmp_path)), network, found)["cloning"]
    assert done["accuracy"] > 0.9
    other = demonstrations.FlightConditions.of(settings.replace(inputs=["gray", "depth"]))
    with pytest.raises(InputError, match=r"recorded with inputs.segmentation=.*=absent"):
        demonstrations.read_demonstrations(tmp_path, other)


def test_the_page_shows_each_image_and_vector(policy, tmp_path):
    flight = Flight(policy, FlySettings(saliency=False), tmp_path)
    state, images = decode(flight.frame())
    picture = Image.open(io.BytesIO(images["observation"]))
    assert picture.size == (64, 17 + 4 * 25)
    assert "goal 9.00 3.00 2.00; altitude 2.50; last_action 0.00" in state["texts"]["vectors"]
    flight.close()


def test_films_show_each_image(policy):
    with policy.flying(1) as (env, actor):
        base = base_env(env)
        base.start()
        shown = render_step(base).camera
        assert shown.shape == (17 + 4 * 25, 64, 3) and shown.dtype == torch.uint8
        assert len(list(film_episode(env, actor))) > 1
