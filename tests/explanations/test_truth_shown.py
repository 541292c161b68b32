import numpy as np
import pytest
import torch

from drone_rl.explanations.truth import Intervention, clear_frame


@pytest.mark.parametrize(
    ("effect", "covered", "shown"),
    [
        ([0.9, 0.8, 0.1], [90, 6, 5], 1),  # the target fills the first, the last shows no effect
        ([np.nan, 0.4, 0.5], [0, 20, 5], 2),
        ([0.0, 0.0, 0.0], [0, 50, 6], 2),
        ([np.nan, np.nan], [0, 0], 0),
    ],
)
def test_a_frame_with_an_effect_and_a_target_that_is_small_is_shown(effect, covered, shown):
    area = torch.zeros(len(covered), 10, 10, dtype=torch.bool)
    for mask, count in zip(area, covered, strict=True):
        mask.view(-1)[:count] = True
    change = Intervention("taken away", area, np.array(effect), torch.zeros(0))
    assert clear_frame(change) == shown
