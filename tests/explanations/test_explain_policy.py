import json

import numpy as np
import pytest
import torch

from drone_rl.config import TaskSettings
from drone_rl.explanations.context import LeftOutError
from drone_rl.explanations.explain import explain_policy
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.policies import MLP
from drone_rl.utils.errors import InputError
from tests.explanations.quick import ALL_SECTIONS, quick

SMALL = ExplainSettings(frames=40, episodes=6, perplexity=5, seed=3)


def explain(env, network, folder, settings=SMALL, **kwargs):
    origin = {"policy": "a test", "trained": {}}
    with quick():
        return explain_policy(
            env, network, folder, settings, name="test", provenance=origin, **kwargs
        )


@pytest.mark.slow
def test_everything_is_written_and_the_order_of_sections_changes_nothing(make_pipeline, tmp_path):
    contents, found = [], ALL_SECTIONS
    for name, order in (("a", list(found)), ("b", list(found)[::-1])):
        env, actor = make_pipeline(num_envs=30, seed=2, task=TaskSettings(num_cubes=1))
        network = actor.module[0].module
        sections = {title: found[title] for title in order}
        explain(env, network, tmp_path / name, sections=sections)
        numbers = json.loads((tmp_path / name / "explanation.json").read_text())
        del numbers["seconds"], numbers["date"]
        arrays = np.load(tmp_path / name / "arrays.npz")
        contents.append((numbers, {key: arrays[key] for key in arrays.files}))
        assert sum(len(m._forward_hooks) for m in network.modules()) == 0
    (numbers, arrays), (again, same) = contents
    assert numbers == again
    assert arrays.keys() == same.keys()
    assert all(np.array_equal(arrays[key], same[key], equal_nan=True) for key in arrays)
    assert 0 <= numbers["dataset"]["entropy"]["mean"] <= 1
    assert numbers["dataset"]["episodes"] == numbers["loops"]["episodes"]["trials"] == 30
    assert {"verdict", "tsne", "truth", "response", "asymmetry", "loops"} <= numbers.keys()


@pytest.mark.slow
def test_a_policy_without_convolutions_and_with_one_action_is_explained(make_pipeline, tmp_path):
    env, _ = make_pipeline(num_envs=30, task=TaskSettings(num_cubes=1))
    network = MLP((1, 25, 64), 3, hidden=(8,))
    with torch.no_grad():
        network.layers.logits.bias.copy_(torch.tensor([0.0, 50.0, 0.0]))  # always left
    numbers = explain(env, network, tmp_path)
    assert numbers["verdict"]["kind"] == "poor"
    assert numbers["dataset"]["action_shares"] == [0.0, 1.0, 0.0]
    assert numbers["contradictions"]["pairs"] == 0
    assert numbers["attribution"]["layer"] is None
    assert numbers["truth"]["trusted"] is None


def test_a_section_that_can_not_be_made_is_told_of_and_the_others_are(make_pipeline, tmp_path):
    env, actor = make_pipeline(num_envs=30, task=TaskSettings(num_cubes=1))

    def fails(context):
        raise LeftOutError("It has no eyes.")

    sections = {"eyes": fails, "dataset": ALL_SECTIONS["dataset"]}
    numbers = explain(env, actor.module[0].module, tmp_path, sections=sections)
    assert numbers["left_out"] == {"eyes": "It has no eyes."}
    assert numbers["dataset"]["frames"] == SMALL.frames and "eyes" not in numbers["seconds"]
    del sections["eyes"]
    assert "left_out" not in explain(env, actor.module[0].module, tmp_path, sections=sections)


def test_sections_aside_meet_a_copy_of_the_network_and_stand_in_their_order(
    make_pipeline, tmp_path
):
    env, actor = make_pipeline(num_envs=6)
    network, met = actor.module[0].module, {}

    def meet(name):
        def section(context):
            met[name] = context.network
            return {name: 1}, {}

        return section

    sections = {"flaws": meet("flaws"), "truth": meet("truth")}
    written = explain(env, network, tmp_path, sections=sections)
    assert met["truth"] is network and met["flaws"] is not network
    assert [*written["seconds"]] == [k for k in written if k in sections] == [*sections]


def test_an_unknown_layer_is_refused_before_any_work(make_pipeline, tmp_path):
    env, actor = make_pipeline()
    settings = ExplainSettings(frames=60, perplexity=5, layer="conv7")
    with pytest.raises(InputError, match=r"layer=conv7 .* choose from: conv1"):
        explain(env, actor.module[0].module, tmp_path / "x", settings)
    assert not (tmp_path / "x").exists()
