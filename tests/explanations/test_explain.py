"""Explanations from Python: policies, settings, sections, and the files."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.config import TaskSettings
from drone_rl.config.inputs import Altitude, DepthImage, GrayImage
from drone_rl.config.networks import SmallCnn
from drone_rl.envs import DroneEnv, GrayPixels, StandardizePixels
from drone_rl.explanations import explain as explaining
from drone_rl.explanations.context import Context, LeftOutError
from drone_rl.explanations.explain import Explanations, _named, explain_policy
from drone_rl.explanations.report import write_report
from drone_rl.explanations.results import Explanation
from drone_rl.explanations.rollouts import collect
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.policies import MLP, make_actor
from drone_rl.sim.entities import Cube
from drone_rl.sim.tasks import EndReason, Task
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.seeding import RootSeed
from tests.explanations.example import changed_explanation
from tests.explanations.quick import ALL_SECTIONS, few_sections, quick, quick_figures
from tests.second_task import NUM_POSTS, Posts
from tests.untrained import untrained

SEED = RootSeed(6, is_fixed=False)


def explanation(kind, **verdict):
    changes = {"kind": kind, **verdict}
    return changed_explanation({f"verdict.{name}": value for name, value in changes.items()})


def test_policies_of_the_same_name_are_named_by_their_files():
    good = drone_rl.load_policy("good")
    other = dataclasses.replace(good, path=Path("elsewhere.safetensors"))
    assert list(_named([good, "poor"], "outputs")) == ["good", "poor"]
    assert list(_named(good, "outputs")) == ["good"]
    assert list(_named([good, other], "outputs")) == [str(good.path), "elsewhere.safetensors"]


@pytest.mark.parametrize("policies", [[], ["good", "good"]])
def test_each_policy_is_explained_once(policies):
    with pytest.raises(InputError, match="each once"):
        _named(policies, "outputs")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"frames": 3}, "frames=3 is less than one for each episode"),
        ({"num_envs": 0}, "num_envs=0"),
    ],
)
def test_mistakes_name_the_argument(change, message, tmp_path):
    with pytest.raises(InputError, match=f"^{message}"):
        drone_rl.explain("good", folder=tmp_path, **change)


def test_all_policies_are_explained_from_one_fresh_seed(tmp_path, monkeypatch):
    seen = []

    def note(context, folder, **kwargs):
        states = context.env.base_env.state_dict()["random_states"]
        seen.append((context.seed, context.settings.seed, states[0]))
        return explanation("good", certain=True)

    monkeypatch.setattr(explaining, "explain_policy", note)
    monkeypatch.setattr(explaining, "write_report", lambda *args: tmp_path)
    how = {"folder": tmp_path, "num_envs": 2, "progress": silent}
    first = drone_rl.explain(["good", "poor"], **how)
    drone_rl.explain("good", **how)
    drone_rl.explain("good", seed=first.seed.value, **how)
    one, two, other, again = seen
    assert one == two
    assert (one[0], one[1]) == (first.seed, first.seed.value)
    assert (one[0].is_fixed, again[0].is_fixed) == (False, True)
    assert one[2] == again[2] != other[2]


def test_the_result_prints_verdict_and_report(tmp_path):
    (tmp_path / "report.html").write_text("<h1>trusted?</h1>")
    of_x = explanation("good", certain=False)
    shown = Explanations(tmp_path, tmp_path / "report.html", {"x": of_x}, SEED)
    first, *rest = str(shown).splitlines()
    assert first.startswith("x: good (not certain): This policy looks good")
    assert rest[0].startswith("It fails in 40.0% of episodes, most with cubes on its left")
    assert rest[1].startswith("With sampled actions it collects every cube in 40.0%")
    assert rest[-2:] == [f"report: {tmp_path / 'report.html'}", "environments: seed 6 (fresh)"]
    assert shown._repr_html_().startswith(
        '<iframe sandbox="allow-scripts" srcdoc="&lt;h1&gt;trusted?'
    )


def test_each_image_has_maps_of_its_own(tmp_path):
    inputs = {"gray": GrayImage(), "altitude": Altitude(), "depth": DepthImage(size=(20, 40))}
    policy = untrained(SmallCnn(channels=(2,), hidden=(4,)), inputs=inputs)
    with few_sections("attribution", "dataset"), quick_figures():
        how = {"frames": 30, "perplexity": 5, "num_envs": 30, "progress": silent}
        found = drone_rl.explain(policy, folder=tmp_path, **how)
    gray, depth = found.policies["untrained"], found.policies["untrained, depth"]
    assert gray.dataset is not None and depth.dataset is None
    assert gray.attribution.layer == "branches.gray.relu1"
    assert gray.attribution.frames.shape[1:] == (25, 64, 3)
    assert depth.attribution.layer == "branches.depth.relu1"
    assert depth.attribution.frames.shape[1:] == (20, 40, 3)
    assert "untrained, depth" in found.report.read_text()


SMALL = ExplainSettings(frames=40, episodes=6, perplexity=5, seed=3)


def explain(env, network, folder, settings=SMALL, **kwargs):
    origin = {"policy": "a test", "trained": {}}
    with quick():
        context = Context(env, network, settings)
        return explain_policy(context, folder, name="test", provenance=origin, **kwargs)


def test_the_order_of_sections_changes_no_result(make_pipeline, tmp_path):
    names, contents = ["dataset", "verdict", "response", "flaws", "attribution"], []
    for order in (names, names[::-1]):  # of this seed, no action is chosen by a rounding error
        env, actor = make_pipeline(num_envs=30, seed=3, task=TaskSettings(num_cubes=1))
        network, folder = actor.module[0].module, tmp_path / order[0]
        explain(env, network, folder, sections={name: ALL_SECTIONS[name] for name in order})
        numbers = json.loads((folder / "explanation.json").read_text())
        del numbers["seconds"], numbers["date"]
        with np.load(folder / "arrays.npz") as arrays:
            contents.append((numbers, dict(arrays)))
        assert sum(len(m._forward_hooks) for m in network.modules()) == 0
    (numbers, arrays), (again, same) = contents
    assert numbers == again and arrays.keys() == same.keys()
    assert all(np.array_equal(arrays[key], same[key], equal_nan=True) for key in arrays)
    assert Explanation.load(tmp_path / "dataset").attribution.heat.keys() >= {
        "grad_cam",
        "occlusion",
    }


def test_a_section_that_fails_is_left_out_with_the_reason(make_pipeline, tmp_path):
    env, actor = make_pipeline(num_envs=30, task=TaskSettings(num_cubes=1))

    def fails(context):
        raise LeftOutError("It has no eyes.")

    sections = {"eyes": fails, "dataset": ALL_SECTIONS["dataset"]}
    numbers = explain(env, actor.module[0].module, tmp_path, sections=sections)
    assert numbers.left_out == {"eyes": "It has no eyes."}
    assert numbers.dataset.frames == SMALL.frames and [*numbers.seconds] == ["dataset"]


def test_an_unknown_layer_is_refused_before_any_work(make_pipeline, tmp_path):
    env, actor = make_pipeline()
    settings = ExplainSettings(frames=60, perplexity=5, layer="conv7")
    with pytest.raises(InputError, match=r"layer=conv7 .* choose from: conv1"):
        explain(env, actor.module[0].module, tmp_path / "x", settings)
    assert not (tmp_path / "x").exists()


@pytest.fixture
def posts():
    env = DroneEnv(6, Posts(), seed=2, transforms=[GrayPixels(), StandardizePixels()])
    generator = torch.Generator().manual_seed(0)
    network = MLP((1, 25, 64), 3, hidden=(8,), generator=generator)
    with torch.no_grad():  # mostly forward, or no post is ever passed
        network.layers.logits.bias.copy_(torch.tensor([2.0, 0.0, 0.0]))
    yield Context(env, network, ExplainSettings(frames=40, episodes=12, perplexity=5))
    env.close()


def test_all_sections_work_with_another_task(posts, tmp_path):
    """Nothing of an explanation needs cubes, only targets."""
    with quick():
        numbers = explain_policy(posts, tmp_path, name="posts", provenance={})
    assert numbers.verdict.num_cubes == NUM_POSTS
    assert [row.side for row in numbers.response.rows] == ["left", "ahead", "right"]
    assert numbers.truth.outcomes.collected.keys() == {"as it was", "moved left", "moved right"}


class FlyLeft(Task):
    """Get a metre to the left within six steps, past a box; nothing else is defined."""

    name = "fly_left"

    def make_props(self):
        return [Cube(1.0, (0.1, 0.1, 0.6), name="box")]

    def places(self, state):
        return state.sampled[:, None]

    def sample(self, random_state):
        return torch.tensor([4.0, random_state.uniform(-2.0, 2.0), 1.0], dtype=torch.float64)

    def step(self, state, body):
        end = torch.where(body.position[:, 1] >= 1.0, EndReason.SUCCESS, EndReason.RUNNING)
        end = end.masked_fill(state.steps >= 5, EndReason.FAILURE)
        steps = state.steps + 1
        new = dataclasses.replace(state, body=body, steps=steps, end_reason=end)
        return new, (end == EndReason.SUCCESS).double()


def test_a_task_without_operations_on_objects_is_explained(tmp_path, caplog):
    env = DroneEnv(6, FlyLeft(), seed=2, transforms=[GrayPixels(), StandardizePixels()])
    generator = torch.Generator().manual_seed(0)
    network = MLP((1, 25, 64), 3, hidden=(8,), generator=generator)
    sections = {n: s for n, s in ALL_SECTIONS.items() if n not in ("verdict", "class_model")}
    results = explain(env, network, tmp_path, sections=sections)
    assert results.left_out.keys() == {"contradictions", "response", "interventions", "places"}
    assert len(caplog.messages) == 2 and "interventions: Task fly_left has no" in caplog.text
    assert results.truth.methods and results.truth.frames and not results.truth.interventions
    flights = collect(env, make_actor(network, env.action_spec), num_episodes=12)
    env.close()
    ends = np.append(flights.episode[1:] != flights.episode[:-1], True)
    is_reached = flights.end_reason[ends] == EndReason.SUCCESS
    assert 0 < is_reached.sum() < len(is_reached)
    np.testing.assert_array_equal(flights.event[ends], np.where(is_reached, 1, -1))
    assert not flights.event[~ends].any()
    page = write_report([tmp_path], tmp_path).read_text()
    assert page.count("interventions: Task fly_left has no objects that can be moved.") == 1
