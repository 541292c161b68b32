from types import SimpleNamespace

import numpy as np
import pytest
import torch

from drone_rl.config import AppearanceSettings
from drone_rl.config.commands import PlacesSettings
from drone_rl.envs import DroneEnv, GrayPixels, Noise
from drone_rl.explanations.context import Context, find_lacking
from drone_rl.explanations.scenes import place_target
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.policies import ExternalNetwork, SmallCNN
from drone_rl.sim.actions import MOVES
from drone_rl.verification import places_section
from drone_rl.verification.prover.cube_images import camera_ahead
from tests.five_actions import FIVE


def test_the_exact_map_is_that_of_rendered_observations(context, monkeypatch):
    small = PlacesSettings(farthest=3.5, sideways=3.0)
    monkeypatch.setattr(places_section, "PlacesSettings", lambda: small)
    told = places_section.places_section(context)
    assert dict(told.window) == {"nearest": 2.5, "farthest": 3.5, "sideways": 3.0}
    found = places_section._exact_map(context, small)
    where = np.random.RandomState(0).uniform((2.5, -3.0), (3.5, 3.0), (100, 2))
    ahead, left = torch.from_numpy(where).T
    pictures = context.scenes.observe(place_target(context.scenes, ahead + camera_ahead(), left))
    with torch.no_grad():
        taken = context.network(pictures).argmax(-1)
    assert found.at(where).tolist() == taken.tolist()


def test_reasons_for_no_exact_map(context):
    scenes = context.scenes

    def refused(**changes):
        names = ("task", "actions", "memory", "seen", "worlds")
        network = changes.pop("network", None)
        changed = {name: getattr(scenes, name) for name in names} | changes
        given = SimpleNamespace(scenes=SimpleNamespace(**changed), network=network)
        return find_lacking({"places": places_section.places_section}, given)["places"]

    assert "stack of frames" in refused(memory=1)
    assert "not gray and goal" in refused(seen="gray and goal")
    assert "chooses among forward, left, right" in refused(actions=FIVE)
    assert "Only cube collection" in refused(task=None)
    tall = scenes.task.settings.replace(vertical_bound=1.0)
    function = ExternalNetwork(lambda x: x.flatten(1)[:, :3], (1, 25, 64), MOVES)
    assert "not a torch module" in refused(network=function)
    assert "vertical_bound=1.0" in refused(task=type(scenes.task)(tall))


@pytest.mark.parametrize(
    ("look", "faults"),
    [
        (AppearanceSettings(), [Noise(0.1)]),
        (AppearanceSettings(ground_color=((0.4,) * 3, (0.6,) * 3)), []),
    ],
)
def test_there_is_no_exact_map_where_a_place_has_several_images(look, faults, monkeypatch):
    small = PlacesSettings(farthest=3.5, sideways=3.0)
    monkeypatch.setattr(places_section, "PlacesSettings", lambda: small)
    env = DroneEnv(1, appearance=look, transforms=[GrayPixels(), *faults])
    network = SmallCNN((1, 25, 64), 3, channels=(4,), hidden=(8,))
    settings = ExplainSettings(frames=40, episodes=6, perplexity=5, seed=3)
    sections = {"places": places_section.places_section}
    lacking = find_lacking(sections, Context(env, network, settings))
    env.close()
    assert "several images" in lacking["places"]
