"""Live heat maps: the tests in another process, and maps of a trusted method."""

from types import SimpleNamespace

import pytest
import torch

import drone_rl
from drone_rl.explanations import trust
from drone_rl.explanations.context import Context
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.flight.fly_page import saliency
from drone_rl.flight.fly_page.saliency import LiveSaliency, find_trusted


def test_the_tests_are_those_of_the_report(monkeypatch):
    few, given = ExplainSettings(frames=60, perplexity=5), {}
    monkeypatch.setattr(saliency, "ExplainSettings", lambda: few)

    def check_maps(trial, methods):
        given.update(trial=trial, methods=methods)
        return SimpleNamespace(trusted="occlusion")

    monkeypatch.setattr(trust, "check_maps", check_maps)
    assert find_trusted(drone_rl.load_policy("good")) == "occlusion"
    assert set(given["methods"]) >= {"grad_cam", "saliency", "occlusion"}
    assert 30 < len(given["trial"].actions) <= 60


def test_nothing_is_shown_without_a_trusted_method(make_world):
    live = LiveSaliency(make_world())
    assert live.state == "off" and live.heat(live._world.see()) is None
    live.trust(None)
    assert live.state == "none" and live.heat(live._world.see()) is None
    live.poll()
    live.close()


def test_the_map_is_that_of_the_most_probable_action(make_world):
    world = make_world()
    for _ in range(10):
        world.step(torch.tensor([0]))
    seen, live = world.see(), LiveSaliency(world)
    live.trust("saliency")
    policy = drone_rl.load_policy("good")
    env = policy.make_env(1)
    explainer = Context(env, policy.make_network(), ExplainSettings()).explainer
    part = torch.tensor(seen.probabilities).argmax()[None]
    expected = explainer.methods()["saliency"](seen.observation, part)[0]
    env.close()
    assert live.heat(seen) == pytest.approx(expected.numpy())
    assert live.heat(seen).shape == (25, 64)


def test_a_policy_that_cannot_be_explained_says_why(make_world):
    def refuse():
        raise drone_rl.InputError("task=x cannot be explained")

    live = LiveSaliency(make_world())
    live._result = SimpleNamespace(ready=lambda: True, get=refuse)
    live.poll()
    assert (live.state, live.problem) == ("failed", "task=x cannot be explained")


def test_a_policy_that_cannot_be_sent_to_the_process_says_so(make_world):
    world = make_world()
    world.policy = lambda: None
    live = LiveSaliency(world)
    world.policy.name = "mine"
    live.start()
    assert live.state == "testing"
    live._result.wait(60)
    live.poll()
    assert live.state == "failed" and "pickle" in live.problem
