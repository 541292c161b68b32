from types import SimpleNamespace

import numpy as np
import pytest

from drone_rl.explanations.behavior import dataset_section


class Frames(SimpleNamespace):
    def __len__(self):
        return len(self.episode)


def test_counts_by_hand():
    certain, torn, toss = [1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [1 / 3] * 3
    data = Frames(probabilities=np.array([certain, torn, toss], np.float32), episode=[0, 1, 1])
    data.episode = np.array(data.episode)
    flights = Frames(
        episode=np.array([0, 0, 0, 1, 2]),
        actions=np.array([0, 0, 0, 2, 0]),
        event=np.array([0, 1, 1, 0, -1], np.int8),
    )
    numbers, arrays = dataset_section(SimpleNamespace(dataset=data, flights=flights))
    found = numbers["dataset"]
    assert arrays == {}
    assert (found["frames"], found["episodes"], found["steps"]) == (3, 3, 5)
    assert found["action_shares"] == [0.8, 0.0, 0.2]
    assert found["goals_reached"] == 2
    # an episode counts once: 0, and the mean of log 2 / log 3 and 1
    assert found["entropy"]["mean"] == pytest.approx((0 + (np.log(2) / np.log(3) + 1) / 2) / 2)
