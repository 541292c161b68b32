from types import SimpleNamespace

import numpy as np

from drone_rl.explanations import response
from drone_rl.explanations.response import OutcomeMap, ResponseMap, summarise
from drone_rl.utils.seeding import RootSeed


def test_every_field_of_both_maps_is_kept(monkeypatch):
    axes = {"height": np.zeros(1), "forward": np.arange(2.0), "lateral": np.array([-4.0, 0, 4])}
    ahead = np.zeros((1, 2, 3, 3))
    ahead[..., 0] = 1.0
    oracle = np.array([2, 0, 1])
    needs = {"oracle": oracle, "stratum": np.array([2, 1, 0])}
    blind = np.array([[[True, False, True]] * 2])
    does = ResponseMap(
        **axes, **needs, probabilities=ahead, without_target=np.array([1.0, 0, 0]), blind=blind
    )
    comes = OutcomeMap(**axes, **needs, collected=np.array([[[False, True, False]] * 2]))
    monkeypatch.setattr(response, "outcome_map", lambda scenes, network, seed: comes)
    sides = ("left", "ahead", "right")
    scenes = SimpleNamespace(task=SimpleNamespace(strata=sides))
    seed = RootSeed(5, False)
    context = SimpleNamespace(shared=lambda *_: does, scenes=scenes, network=None, seed=seed)
    numbers, arrays = response.response_section(context)
    assert numbers == {"response": summarise(does, comes, sides)}
    assert arrays["response_probabilities"] is ahead
    assert arrays["outcome_collected"] is comes.collected
    assert arrays["response_blind"].tolist() == [[[True, False, True]] * 2]
    names = ("height", "forward", "lateral")
    assert {f"{kind}_{n}" for kind in ("response", "outcome") for n in names} <= arrays.keys()
