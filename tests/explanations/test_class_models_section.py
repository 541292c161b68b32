from types import SimpleNamespace

import pytest
import torch

from drone_rl.explanations import class_models
from drone_rl.explanations.class_models import section
from drone_rl.explanations.context import LeftOutError


def test_both_objectives_are_sought_in_the_range_of_the_pictures(monkeypatch):
    calls = []

    def search(network, statistics, objective, *, seed):
        calls.append((network, statistics.low, statistics.high, objective, seed))
        images = torch.full((3, 1, 2, 2), float(len(calls)))
        return SimpleNamespace(images=images, summary=lambda: {"sought": objective})

    monkeypatch.setattr(class_models, "search", search)
    observations = torch.linspace(-2, 2, 40).reshape(10, 1, 2, 2)
    network = SimpleNamespace(is_differentiable=True)
    context = SimpleNamespace(
        dataset=SimpleNamespace(tensor={"observations": observations}.get),
        network=network,
        seed=SimpleNamespace(value=7),
        scenes=SimpleNamespace(channels="rgb"),
    )
    numbers, arrays = section(context)
    assert [call[0] for call in calls] == [network, network]
    assert [call[3:] for call in calls] == [("probability", 7), ("logit", 7)]
    assert numbers["class_model"]["logit"] == {"sought": "logit"}
    assert numbers["class_model"]["statistics"]["low"] == calls[0][1] < calls[0][2]
    assert numbers["class_model"]["channels"] == "rgb"
    assert (arrays["class_model_probability"] == 1).all()
    assert (arrays["class_model_logit"] == 2).all()


def test_without_gradients_they_are_left_out():
    network = SimpleNamespace(is_differentiable=False)
    with pytest.raises(LeftOutError, match="this policy has none; give it as a PyTorch function"):
        section(SimpleNamespace(network=network))
