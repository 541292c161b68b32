from types import SimpleNamespace

import numpy as np
import pytest

from drone_rl.explanations.context import LeftOutError
from drone_rl.explanations.embedding import section
from drone_rl.explanations.settings import ExplainSettings


def test_features_and_pixels_are_embedded_each_by_itself():
    rng = np.random.default_rng(0)
    data = SimpleNamespace(
        features={"fc1": rng.normal(size=(40, 8)).astype(np.float32)},
        observations=rng.normal(size=(40, 1, 3, 4)).astype(np.float32),
    )
    settings = ExplainSettings(frames=40, perplexity=4, seed=1)
    numbers, arrays = section(
        SimpleNamespace(
            dataset=data, settings=settings, seed=SimpleNamespace(value=settings.seed), layer="fc1"
        )
    )
    assert {name: points.shape for name, points in arrays.items()} == {
        "tsne_features": (40, 2),
        "tsne_pixels": (40, 2),
    }
    found = numbers["tsne"]
    assert (found["features"]["layer"], found["pixels"]["layer"]) == ("fc1", None)
    assert found["features"]["perplexity"] == 4
    assert 0 < found["pixels"]["trustworthiness"] <= 1
    assert found["features"]["neighbours_kept"] > found["features"]["neighbours_chance"]


def test_without_layers_it_is_left_out():
    with pytest.raises(
        LeftOutError, match="no layers of this policy are known; give it as a torch"
    ):
        section(SimpleNamespace(layer=None))
