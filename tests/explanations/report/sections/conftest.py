"""Small explanations made by hand: what each part needs, and nothing else."""

import numpy as np
import pytest

from drone_rl.explanations.report.explanation import Explanation


@pytest.fixture
def make_explanation():
    """One of `frames` frames in two flights; more numbers and arrays as given."""

    def build(numbers=None, arrays=None, frames=12, name="a policy"):
        rng = np.random.default_rng(0)
        half = frames // 2
        episode = np.repeat([0, 1], [half, frames - half])
        step = np.concatenate([np.arange(half), np.arange(frames - half)])
        data = {
            "frames": rng.integers(0, 255, (frames, 4, 6, 3), dtype=np.uint8),
            "actions": np.arange(frames) % 3,
            "probabilities": rng.dirichlet(np.ones(3), frames),
            "episode": episode,
            "step": step,
            "rewards": (np.arange(frames) == 2).astype(float),
            "event": (np.arange(frames) == 2).astype(np.int8),
            "flights/episode": episode,
        }
        return Explanation({"name": name, **(numbers or {})}, arrays or {}, data)

    return build
