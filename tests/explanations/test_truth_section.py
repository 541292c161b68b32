import json

import numpy as np
import pytest

from drone_rl.explanations.truth import section


@pytest.mark.slow
def test_methods_are_tried_against_placebos_and_every_change_is_shown(context):
    numbers, arrays = section(context)
    found = numbers["truth"]
    json.dumps(numbers)
    tried = set(found["methods"])
    assert tried == set(found["heat"]) >= {"grad_cam", "saliency"}
    assert set(found["curves"]) == {"shares", *tried, *found["placebos"]}
    assert found["trusted"] is None or found["methods"][found["trusted"]]["trusted"]
    assert arrays["interventions"].shape[0] == len(found["interventions"])
    assert arrays["interventions"].shape[1:] == context.dataset.frames.shape[1:]
    assert 0 <= found["shown_frame"] < len(context.dataset)
    assert found["frames"] + found["frames_unmoved"] == len(context.dataset)
    assert (arrays["patch_effects"] >= 0).all()
    assert np.isfinite(arrays["patch_effects"]).all()
