"""ONNX models equal the pipeline and document all that is needed to use them."""

import json

import onnxruntime
import pytest
import torch

from drone_rl.config.registry import register_network
from drone_rl.envs import Pipeline
from drone_rl.policies import MLP, make_actor
from drone_rl.policies.zoo import PolicyDescription, make_onnx, open_onnx
from drone_rl.policies.zoo.description import ActionSpace
from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.trust.onnx_export import agreement
from drone_rl.utils.errors import InputError
from tests.continuous import SETTINGS
from tests.policies.zoo.test_description import DEFAULT, with_image

GRAY, STANDARD = {"name": "gray"}, {"name": "standardize", "mean": 0.53, "std": 0.21}
BLIND = [{"name": "episode_reward"}, {"name": "step_count"}]
SMALLER = {"name": "resize", "height": 13, "width": 40}
LINEAR = {"name": "mlp", "hidden": []}


def describe(height, width, transforms, network):
    image = with_image(size=[height, width], transforms=transforms)
    return PolicyDescription.read({**image, "network": network})


def build(description, scale=1.0):
    network = description.build_network(torch.Generator().manual_seed(0))
    network.layers.get_parameter("logits.weight").data.mul_(scale)
    return network


@pytest.fixture(scope="module")
def linear():
    """Return a model of images of 1x2 pixels whose logits are gray levels."""
    description = describe(1, 2, [GRAY], LINEAR)
    network = build(description)
    with torch.no_grad():
        network.layers.get_parameter("logits.bias").copy_(torch.tensor([0.0, 0.0, 1.0]))
        weights = torch.tensor([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
        network.layers.get_parameter("logits.weight").copy_(weights)
    return make_onnx(description, network, {"command": "drone-rl train seed=7"})


def test_probabilities_match_hand_computed_ones(linear):
    red_and_white = [[[255, 0, 0], [255, 255, 255]]]
    black_and_blue = [[[0, 0, 0], [0, 0, 255]]]
    green_twice = [[[0, 255, 0], [0, 255, 0]]]
    frames = torch.tensor([red_and_white, black_and_blue, green_twice], dtype=torch.uint8)
    logits = torch.tensor([[0.299, 1.0, 1.0], [0.0, 0.114, 1.0], [0.587, 0.587, 1.0]])
    torch.testing.assert_close(open_onnx(linear)(frames), logits.softmax(-1))
    torch.testing.assert_close(open_onnx(linear)(frames[:1]), logits[:1].softmax(-1))


def test_model_documents_inputs_and_outputs(linear):
    session = onnxruntime.InferenceSession(linear)
    ((given,), (got,)) = (session.get_inputs(), session.get_outputs())
    assert (given.name, given.type, given.shape[1:]) == ("frames", "tensor(uint8)", [1, 2, 3])
    assert (got.name, got.type, got.shape[1:]) == ("probabilities", "tensor(float)", [3])
    assert isinstance(given.shape[0], str) and given.shape[0] == got.shape[0]  # any batch size
    metadata = session.get_modelmeta().custom_metadata_map
    metadata = {key: json.loads(text) for key, text in metadata.items()}
    assert metadata.pop("actions") == ["forward", "left", "right"]
    assert metadata.pop("command") == "drone-rl train seed=7"
    assert PolicyDescription.read(metadata["description"]) == describe(1, 2, [GRAY], LINEAR)


def test_continuous_actions_are_outputs():
    slow = ActionSpace.of(SETTINGS.replace(forward_speed=2.0))
    description = describe(1, 2, [GRAY], LINEAR).replace(actions=slow)
    network = MLP((1, 1, 2), 6, hidden=(), generator=torch.Generator().manual_seed(0))
    network.actions = ContinuousActions.of(SETTINGS)
    content = make_onnx(description, network, {})
    session = onnxruntime.InferenceSession(content)
    metadata = session.get_modelmeta().custom_metadata_map
    description = PolicyDescription.read(json.loads(metadata["description"]))
    assert description.actions == slow
    assert json.loads(metadata["actions"]) == [
        "forward",
        "left",
        "right",
        "turn left",
        "turn right",
    ]
    frames = torch.tensor([[[[255, 0, 0], [9, 99, 255]]]], dtype=torch.uint8)
    found = dict(
        zip(
            (o.name for o in session.get_outputs()),
            session.run(None, {"frames": frames.numpy()}),
            strict=True,
        )
    )
    with torch.no_grad():
        outputs = network(Pipeline(description.make_transforms())(frames))
    assert set(found) == {"probabilities", "action"}
    expected = {
        "probabilities": network.actions.probabilities(outputs),
        "action": outputs[:, :3].div(3).tanh().mul(3).tanh(),
    }
    for name, values in expected.items():
        torch.testing.assert_close(torch.from_numpy(found[name]), values, atol=1e-6, rtol=0)
    torch.testing.assert_close(open_onnx(content)(frames), torch.from_numpy(found["probabilities"]))


def test_a_recurrent_model_forgets_where_an_episode_starts():
    lstm = {"name": "lstm", "channels": [4], "hidden": [8], "memory": 6, "patch": 4}
    description = describe(8, 16, [GRAY], lstm)
    network = description.build_network(torch.Generator().manual_seed(0))
    for parameter in network.parameters():
        parameter.data.mul_(8.0)
    model = open_onnx(make_onnx(description, network, {}))
    frames = torch.randint(0, 256, (2, 8, 16, 3), generator=torch.Generator().manual_seed(1))
    frames = frames.to(torch.uint8)
    first = model(frames, is_init=torch.tensor([[True], [True]]))
    second = model(frames, is_init=torch.tensor([[True], [False]]))
    assert torch.equal(second[0], first[0])
    assert not torch.allclose(second[1], first[1], atol=1e-3)


@pytest.mark.parametrize(
    ("height", "width", "transforms", "network"),
    [
        (25, 64, [GRAY, STANDARD, *BLIND], DEFAULT["network"]),
        (
            *(36, 64, [GRAY, STANDARD, {"name": "crop", "top": 5, "bottom": 30}]),
            {"name": "original_cnn", "channels": [6, 16], "hidden": [120, 84]},
        ),
        (31, 77, [GRAY, SMALLER, {"name": "blur", "width": 0.8}, STANDARD], LINEAR),
        (7, 9, [GRAY, {"name": "resize", "height": 10, "width": 20}], LINEAR),
        (5, 6, [STANDARD], {"name": "mlp", "hidden": [4]}),
    ],
    ids=["default", "original", "averaged unevenly and blurred", "enlarged", "in color"],
)
def test_model_agrees_with_the_pipeline(height, width, transforms, network):
    description = describe(height, width, transforms, network)
    policy = build(description, scale=20.0)
    env = description.build_env(8, seed=0, device="cpu")
    actor = make_actor(policy, env.action_spec, torch.Generator().manual_seed(0))
    found = agreement(env, actor, open_onnx(make_onnx(description, policy, {})), 40)
    env.close()
    assert found.difference <= 1e-5 and found.actions_differ == 0 and found.frames == 320


def test_frame_stacks_raise():
    description = describe(25, 64, [GRAY, {"name": "stack", "N": 2}], LINEAR)
    with pytest.raises(InputError, match=r"stack of frames.*format=safetensors"):
        make_onnx(description, build(description), {})


class Branching(MLP):
    """A network with data-dependent control flow, which no graph can represent."""

    def forward(self, pixels):
        return super().forward(pixels if pixels.sum() > 0 else -pixels)


def test_unsupported_graph_raises_one_line(registered):
    registered(register_network("torn")(Branching))
    description = describe(5, 6, [GRAY], {"name": "torn", "hidden": []})
    with pytest.raises(InputError, match=r"can't be written as an ONNX model \(.*safeten") as error:
        make_onnx(description, build(description), {})
    assert "\n" not in str(error.value)
