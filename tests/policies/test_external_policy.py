"""External policies are evaluated, judged and explained like our own."""

import pytest
import torch
from torch import nn

import drone_rl
from drone_rl.config.transforms import EpisodeReward, Gray, Resize, Rgb, Stack, Standardize
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from tests.explanations.quick import quick, quick_figures
from tests.fake_flight import FLIGHT, floating
from tests.second_dynamics import Turning
from tests.second_task import Posts

FEW = {"episodes": 8, "sampled": False, "seed": 0, "progress": silent}
ONE = {"num_cubes": 1}
"""A task with short episodes."""


@pytest.fixture(scope="module")
def network():
    return drone_rl.load_policy("good").make_network()


def on_bytes(network):
    """Return the network with its transforms in NumPy, which torch cannot differentiate."""

    def logits(frames):
        assert frames.dtype == torch.uint8 and frames.shape[1:] == (25, 64, 3)
        gray = frames.float() @ torch.tensor([0.299, 0.587, 0.114]) / 255
        with torch.no_grad():
            return network(((gray - 0.53) / 0.21)[:, None]).numpy()

    return logits


def left(images):
    return torch.tensor([0.0, 99.0, 0.0]).expand(len(images), 3)


def test_verdict_does_not_depend_on_the_wrapping(network):
    own = drone_rl.judge("good", task=ONE, **FEW).as_dict()
    wrappings = {
        "module": network,
        "function": lambda x: network(x),
        "bytes": drone_rl.policy_from(on_bytes(network), transforms=()),
    }
    for name, wrapping in wrappings.items():
        found = drone_rl.judge(wrapping, task=ONE, **FEW).as_dict()
        for key in ("kind", "greedy", "quantities"):
            assert found[key] == own[key], (name, key)


def test_in_task_changes_or_replaces_the_task():
    done = drone_rl.judge(left, task={"num_cubes": 1}, **FEW)
    assert (done.policy, done.num_cubes, done.kind) == ("left", 1, "poor")
    posts = drone_rl.policy_from(left, task=Posts(), name="aside")
    with posts.flying(2) as (env, actor):
        assert actor(env.reset())["action"].tolist() == [1, 1]
    assert posts.in_task() is posts
    with pytest.raises(InputError, match=r"^task\.num_cubes can't be changed in a task obj"):
        posts.in_task(num_cubes=2)


@pytest.mark.parametrize(
    ("transforms", "shape"),
    [
        ([Gray()], (1, 25, 64)),
        ([Rgb(), Resize(height=8, width=9)], (3, 8, 9)),
        ([Gray(), Stack(N=3)], (3, 25, 64)),
        ([Gray(), EpisodeReward()], (1, 25, 64)),
    ],
)
def test_policy_receives_transformed_images(transforms, shape):
    seen = []

    def note(images):
        seen.append(tuple(images.shape[1:]))
        return left(images)

    policy = drone_rl.policy_from(note, transforms=transforms)
    assert policy.make_network().in_shape == shape
    with policy.flying(2) as (env, actor):
        actor(env.reset())
    assert set(seen) == {shape}


def test_network_attributes_define_transforms():
    class Color:
        observation_shape = (3, 8, 9)

        def __call__(self, images):
            return left(images)

    policy = drone_rl.policy_from(Color())
    assert policy.transforms == (Rgb(),) and policy.make_network().in_shape == (3, 8, 9)
    given = drone_rl.CameraSettings(width=12, height=10)
    policy = drone_rl.policy_from(Color(), camera=given, transforms=[Gray()])
    assert policy.make_network().in_shape == (1, 10, 12)
    assert drone_rl.policy_from(left).transforms == (Gray(), Standardize())


@pytest.mark.parametrize(
    ("given", "options", "message"),
    [
        (3, {}, "policy=3 is no policy"),
        (nn.Flatten, {}, r"policy=\(the class Flatten\) is no policy"),
        (drone_rl.load_policy("good").act_batch, {}, "policy_from takes callables"),
        (left, {"transforms": [Resize()]}, "the transform resize needs floats; put gray before"),
        (left, {"transforms": [Gray(), Gray()]}, "the transform gray needs the camera's bytes"),
    ],
)
def test_mismatched_arguments_raise_at_construction(given, options, message):
    with pytest.raises(InputError, match=f"^{message}"):
        drone_rl.policy_from(given, **options)


def test_external_policies_cannot_be_proved(tmp_path):
    policy = drone_rl.policy_from(left)
    words = r"^policy=left is in no file of drone_rl's"
    for ask in (drone_rl.prove, drone_rl.chances, drone_rl.places, drone_rl.load_policy):
        with pytest.raises(InputError, match=words) as caught:
            ask(policy)
        assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match=r"policy=left was made elsewhere, and nothing is proved"):
        drone_rl.judge(policy, certificate=tmp_path / "certificate.json", **FEW)


@pytest.mark.slow
def test_callable_gets_a_reduced_report(network, tmp_path):
    task = drone_rl.TaskSettings(**ONE)
    policy = drone_rl.policy_from(on_bytes(network), transforms=(), name="a function", task=task)
    small = {"frames": 40, "episodes": 6, "perplexity": 5}
    with quick(), quick_figures():
        done = drone_rl.explain(policy, folder=tmp_path, progress=silent, **small)
    explanation = done.policies["a function"]
    assert explanation.left_out.keys() == {"class_model", "tsne", "places"}
    assert explanation.class_model is explanation.tsne is None
    assert [*explanation.attribution.heat] == ["occlusion"]
    assert explanation.attribution.layer is None
    assert explanation.truth.outcomes.flights > 0
    assert explanation.provenance["trained"] is None
    assert "What is left out, and why" in done.report.read_text()


def test_dynamics_can_be_replaced(monkeypatch):
    floating(monkeypatch)
    policy = drone_rl.policy_from(left)
    assert policy.dynamics.is_computer_vision and policy.unlike == {}
    moved = policy.in_dynamics(mode="simple_flight", gusts=1.0)
    assert moved.unlike["gusts"] == {"own": 0.0, "flown": 1.0}
    with moved.flying(1) as (env, _):
        assert env.base_env.worlds.dynamics.settings == FLIGHT.replace(gusts=1.0)
    made = drone_rl.policy_from(left, dynamics=FLIGHT)
    assert made.unlike == {} and made.in_dynamics(mode="computer_vision").unlike == {
        "mode": {"own": "simple_flight", "flown": "computer_vision"}
    }
    with made.flying(1, dynamics=Turning(), pixels=False) as (env, _):
        assert isinstance(env.base_env.worlds.dynamics, Turning)
    with pytest.raises(InputError, match=r"^dynamics\.mass=-1\.0"):
        policy.in_dynamics(mass=-1.0)


def test_appearance_can_be_replaced(network):
    def look(policy):
        with policy.flying(2, seed=3) as (env, _):
            return env.reset()["pixels"]

    policy = drone_rl.policy_from(network)
    foggy, made = policy.in_appearance("fog"), drone_rl.policy_from(network, appearance="fog")
    assert policy.unlike == made.unlike == {}
    assert foggy.unlike["appearance.fog_visibility"] == {"own": None, "flown": 40.0}
    own = look(drone_rl.load_policy("good").in_appearance("fog"))
    assert torch.equal(look(foggy), own) and torch.equal(look(made), own)
    assert not torch.equal(look(policy), own)
    for refused in (policy.in_appearance, lambda x: drone_rl.policy_from(network, appearance=x)):
        with pytest.raises(InputError, match=r"^appearance='foggy': .*did you mean fog"):
            refused("foggy")


def test_tasks_by_name_and_values_of_wrong_type():
    found = drone_rl.policy_from(left, task="pillars")
    assert found.task == drone_rl.PillarsSettings()
    for given in (
        {"dynamics": None},
        {"dynamics": "quadrotor"},
        {"transforms": 3},
        {"task": "x"},
        {"actions": None},
    ):
        with pytest.raises(InputError, match=f"^{next(iter(given))}"):
            drone_rl.policy_from(left, **given)
