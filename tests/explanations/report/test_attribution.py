import numpy as np
import pytest

from drone_rl.explanations.report.attribution import (
    BLOCK,
    PART,
    explained_step,
    film,
    key_frames,
    say_attribution,
    say_untrusted,
)
from drone_rl.utils.display import page_environment
from tests.evidence import EXPLANATION, changed

STEPS = 5


@pytest.fixture
def explanation(make_explanation):
    entries = [{"step": t, "why": "first"} for t in (0, 2, 4, 1)]
    by = ["grad_cam", "grad_cam_logit", None, "grad_cam", "grad_cam"]
    numbers = {"attribution": {"film": {"key_steps": entries, "heat_by": by}}}
    arrays = {
        "film_frames": np.zeros((STEPS, 4, 20, 3), np.uint8),
        "film_heat": np.ones((STEPS, 4, 20), np.float16) * np.array([1, 1, 0, 1, 1])[:, None, None],
        "film_heat_saliency": np.tri(4, 20, dtype=np.float16)[None].repeat(STEPS, 0),
        "film_probabilities": np.full((STEPS, 3), 1 / 3),
        "film_actions": np.array([0, 1, 2, 0, 1]),
    }
    return make_explanation(numbers, arrays)


def test_a_film_shows_every_step_in_a_size_that_can_be_encoded(explanation):
    frames = film(explanation, None)
    step = np.asarray(explained_step(explanation, 3, "step 3", None))
    assert frames.shape[0] == STEPS
    assert all(size % BLOCK == 0 for size in frames.shape[1:3])
    assert (frames[3, : step.shape[0], : step.shape[1]] == step).all()
    assert (frames[3, step.shape[0] :] == 255).all()


def test_key_frames_have_number_and_reason(explanation):
    assert [*key_frames(explanation, None)] == ["1. first", "2. first", "3. first", "4. first"]


def test_a_step_without_heat_says_so(explanation):
    shown = {t: np.asarray(explained_step(explanation, t, "x", None)) for t in (0, 1, 2, 3)}
    assert (shown[0] == shown[3]).all()
    assert not (shown[0] == shown[2]).all()


def test_the_map_that_passed_is_shown_and_the_other_one_comes_second(explanation):
    explanation.numbers["truth"] = {"trusted": "saliency", "methods": {"saliency": {}}}
    explanation.numbers["attribution"]["film"]["heat_of"] = ["saliency"]
    drawn = PART.draw(explanation)
    assert [*drawn] == ["sequence", "untrusted", "episode"]
    for name, method in (("sequence", "saliency"), ("untrusted", None)):
        tile = explained_step(explanation, 0, "1. first", method)
        assert list(drawn[name]["1. first"].getdata()) == list(tile.getdata())
    assert (drawn["episode"] == film(explanation, "saliency")).all()
    assert (drawn["episode"] != film(explanation, None)).any()


def test_without_one_that_passed_only_untrusted_maps_are_shown(explanation):
    for truth in (None, {"trusted": None, "methods": {"saliency": {}}}):
        explanation.numbers["truth"] = truth
        assert [*PART.draw(explanation)] == ["untrusted", "episode"]
    explanation.numbers["truth"] = {"trusted": "saliency", "methods": {"saliency": {}}}
    assert [*PART.draw(explanation)] == ["untrusted", "episode"]  # no maps of it in the file
    (claim,) = say_attribution(explanation.numbers).values()
    assert "run drone-rl explain again" in claim


def test_grad_cam_that_passed_is_not_shown_twice(explanation):
    explanation.arrays["film_heat_grad_cam"] = explanation.arrays["film_heat"]
    explanation.numbers["truth"] = {"trusted": "grad_cam", "methods": {"grad_cam": {}}}
    explanation.numbers["attribution"] |= {"shown": "grad_cam"}
    explanation.numbers["attribution"]["film"]["heat_of"] = ["grad_cam"]
    assert [*PART.draw(explanation)] == ["sequence", "episode"]


def test_the_page_says_first_that_no_map_passed():
    none = changed(EXPLANATION, {"truth.trusted": None})
    assert [*say_attribution(none)] == ["attribution.none_passed"]
    assert [*say_attribution({**none, "truth": None})] == ["attribution.untested"]
    assert [*say_attribution(EXPLANATION)] == ["attribution.trusted"]


def test_empty_maps_are_counted_and_no_reason_is_made_up():
    found = say_untrusted(EXPLANATION)
    assert found["attribution.stand_in"].startswith("On 1 of the 4 steps")
    assert found["attribution.no_heat"] == "On 1 of the 4 steps, the map is zero everywhere."
    assert "because" not in " ".join(found.values())


def test_a_map_that_passed_but_is_not_the_best_is_not_called_untrusted(explanation):
    methods = {"saliency": {"trusted": True}, "grad_cam": {"trusted": True}}
    explanation.numbers["truth"] = {"trusted": "saliency", "methods": methods}
    explanation.numbers["attribution"]["film"]["heat_of"] = ["saliency"]
    assert [*PART.draw(explanation)] == ["sequence", "episode"]
    methods["grad_cam"]["trusted"] = False
    assert [*PART.draw(explanation)] == ["sequence", "untrusted", "episode"]


def test_the_page_does_not_say_that_untested_maps_failed():
    template = page_environment("drone_rl.explanations.report").get_template(
        "sections/attribution.html"
    )
    pictures = {"episode": "", "untrusted": {"1. first": ""}}
    found = {"attribution": ["No heat map was tested."], "untrusted": []}
    policy = {"name": "x", "numbers": {}, "found": found, "pictures": pictures}
    html = template.render(policies=[policy])
    assert "Maps that are not trusted" in html
    assert "did not pass" not in html and "tests the maps" not in html
    policy["numbers"] = {"truth": {"trusted": None}}
    assert "tests the maps" in template.render(policies=[policy])
