import numpy as np
import pytest

from benchmarks.evidence import EXPLANATION
from drone_rl.explanations.report.attribution import (
    BLOCK,
    explained_step,
    film,
    key_frames,
    say_attribution,
)

STEPS = 5


@pytest.fixture
def explanation(make_explanation):
    entries = [{"step": t, "why": "first"} for t in (0, 2, 4, 1)]
    by = ["grad_cam", "grad_cam_logit", None, "grad_cam", "grad_cam"]
    numbers = {"attribution": {"film": {"key_steps": entries, "heat_by": by}}}
    arrays = {
        "film_frames": np.zeros((STEPS, 4, 20, 3), np.uint8),
        "film_heat": np.zeros((STEPS, 4, 20), np.float16),
        "film_probabilities": np.full((STEPS, 3), 1 / 3),
        "film_actions": np.array([0, 1, 2, 0, 1]),
    }
    return make_explanation(numbers, arrays)


def test_a_film_shows_every_step_in_a_size_that_can_be_encoded(explanation):
    frames = film(explanation)
    step = np.asarray(explained_step(explanation, 3, "step 3"))
    assert frames.shape[0] == STEPS
    assert all(size % BLOCK == 0 for size in frames.shape[1:3])
    assert (frames[3, : step.shape[0], : step.shape[1]] == step).all()
    assert (frames[3, step.shape[0] :] == 255).all()


def test_key_frames_stand_three_in_a_row(explanation):
    tile = explained_step(explanation, 0, "1. first")
    assert key_frames(explanation).size == (3 * tile.width + 24, 2 * tile.height + 12)


def test_a_step_without_heat_says_so(explanation):
    shown = {t: np.asarray(explained_step(explanation, t, "x")) for t in (0, 1, 2, 3)}
    assert (shown[0] == shown[3]).all()
    assert not (shown[0] == shown[2]).all()


def test_empty_maps_are_counted_and_no_reason_is_made_up():
    found = say_attribution(EXPLANATION)
    assert found["attribution.stand_in"].startswith("On 1 of the 4 steps shown")
    assert found["attribution.no_heat"] == "On 1 of the 4 steps shown, the map is zero everywhere."
    assert "because" not in " ".join(found.values())
