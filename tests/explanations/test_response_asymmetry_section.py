import numpy as np
import pytest

from drone_rl.explanations.response import asymmetry_section, grid_asymmetry, policy_response


def test_frames_and_grid_are_compared_with_their_mirror_images(context):
    numbers, arrays = asymmetry_section(context)
    found = numbers["asymmetry"]
    assert arrays == {}
    assert found["grid"] == grid_asymmetry(policy_response(context), context.scenes.actions)
    worst = [entry["distance"] for entry in found["dataset"]["worst"]]
    assert worst == sorted(worst, reverse=True)
    assert worst[0] >= found["dataset"]["absolute"]["mean"] >= 0
    frame = found["dataset"]["worst"][0]["frame"]
    picture = context.dataset.tensor("observations")[frame : frame + 1]
    here, there = (context.network(p).detach().softmax(-1)[0] for p in (picture, picture.flip(-1)))
    by_hand = 0.5 * float((here - there[[0, 2, 1]]).abs().sum())
    assert worst[0] == pytest.approx(by_hand, abs=1e-5)
    assert np.isfinite(found["grid"]["absolute"])
