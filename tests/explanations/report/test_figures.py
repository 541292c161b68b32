"""Figures and tables of the report, from small explanations made by hand."""

import numpy as np
import pytest
from matplotlib.colors import to_hex

from drone_rl.explanations.report import (
    attribution,
    behavior,
    class_models,
    embedding,
    places,
    response,
)
from drone_rl.explanations.report.explanation import Explanation
from drone_rl.explanations.report.truth import changes, truth_charts
from drone_rl.utils.palette import GOOD, MUTED, css
from tests.evidence import EXPLANATION, SAVED_SHIFTS, SHIFTS, VERDICT
from tests.trust.plots.test_regions import NUMBERS, WAYS

SCORE = {"mean": 0.5, "lower95": 0.4, "upper95": 0.6}
UNKNOWN = {"mean": None, "lower95": None, "upper95": None}
STEPS = 5


@pytest.fixture
def flown(make_explanation):
    """An explanation with a film, heat maps, and results of their tests."""
    entries = [{"step": t, "why": "first"} for t in (0, 2, 4, 1)]
    by = ["grad_cam", "grad_cam_logit", None, "grad_cam", "grad_cam"]
    numbers = {
        "attribution": {"shown": "grad_cam", "film": {"key_steps": entries, "heat_by": by}},
        "truth": {
            "trusted": "saliency",
            "methods": {"saliency": {"trusted": True}, "grad_cam": {"trusted": False}},
        },
    }
    arrays = {
        "film_frames": np.zeros((STEPS, 4, 20, 3), np.uint8),
        "film_heat": np.ones((STEPS, 4, 20), np.float16) * np.array([1, 1, 0, 1, 1])[:, None, None],
        "film_heat_saliency": np.tri(4, 20, dtype=np.float16)[None].repeat(STEPS, 0),
        "film_probabilities": np.full((STEPS, 3), 1 / 3),
        "film_actions": np.array([0, 1, 2, 0, 1]),
    }
    return make_explanation(numbers, arrays)


def test_a_film_has_every_step_in_a_size_that_can_be_encoded(flown):
    frames = attribution.film(flown, None)
    step = np.asarray(attribution.explained_step(flown, 3, "step 3", None))
    assert frames.shape[0] == STEPS
    assert all(size % attribution.BLOCK == 0 for size in frames.shape[1:3])
    assert (frames[3, : step.shape[0], : step.shape[1]] == step).all()
    assert (frames[3, step.shape[0] :] == 255).all()


def test_the_map_that_passed_comes_first_and_others_are_marked(flown):
    drawn = attribution.draw(flown)
    assert [*drawn] == ["sequence", "untrusted", "episode"]
    assert [*drawn["sequence"]] == ["1. first", "2. first", "3. first", "4. first"]
    tile = attribution.explained_step(flown, 0, "1. first", "saliency")
    assert list(drawn["sequence"]["1. first"].getdata()) == list(tile.getdata())
    assert (drawn["episode"] == attribution.film(flown, "saliency")).all()
    flown.numbers["truth"]["methods"]["grad_cam"]["trusted"] = True
    assert [*attribution.draw(flown)] == ["sequence", "episode"]
    flown.numbers["truth"]["trusted"] = None
    assert [*attribution.draw(flown)] == ["untrusted", "episode"]


def test_pairs_are_limited_and_left_and_right_take_turns(make_explanation):
    pair = {"kind": "unknown", "left": 1, "right": 2}
    explanation = make_explanation({"contradictions": {"list": [pair] * 9}})
    shown = behavior.pairs(explanation, "unknown")
    assert len(shown) == 2 * behavior.MAX_PAIRS
    assert [*shown][:2] == ["pair 1, frame 1: more left", "pair 1, frame 2: more right"]
    assert behavior.FLAWS_PART.draw(explanation).keys() == {"pairs_unknown"}


def test_a_robustness_evaluation_is_drawn_unless_it_is_refused(make_explanation):
    good = {**VERDICT, "kind": "good", "certain": True}
    arrays = {f"shifts_{name}": np.zeros((6, 5, 16, 3), np.uint8) for name in SHIFTS["axes"]}
    part = behavior.SHIFTS_PART
    drawn = part.draw(make_explanation({"shifts": SAVED_SHIFTS, "verdict": good}, arrays))
    assert [*drawn] == ["shifts", *(f"conditions_{name}" for name in SHIFTS["axes"])]
    for numbers in (
        {"shifts": {"path": "a", "refused": "it is of another task"}, "verdict": good},
        {"shifts": SAVED_SHIFTS, "verdict": {**good, "kind": "poor"}},
    ):
        explanation = make_explanation(numbers)
        assert part.draw(explanation) == {}


def test_class_models_have_actions_from_left_to_right_and_their_colors(make_explanation):
    reached = {"probabilities": [0.9, 0.8, 0.7]}
    numbers = {"statistics": {"low": 0.0, "high": 1.0}, "channels": "gray"}
    numbers |= {"probability": reached, "logit": reached}
    observations = np.zeros((3, 1, 4, 30))
    observations[1] = 1.0  # that for left is white
    arrays = {f"class_model_{objective}": observations for objective in ("probability", "logit")}
    explanation = make_explanation({"class_model": numbers}, arrays)
    grid = class_models.grid([explanation])
    assert grid.size == (3 * 150 + 24, 2 * 42 + 12)
    pixels = [grid.getpixel((x * 162 + 75, 30)) for x in range(3)]
    assert pixels == [(255,) * 3, (0,) * 3, (0,) * 3]
    two = class_models.PART.compare([explanation] * 2)["class_models"]
    assert two.size == (grid.width, 2 * grid.height + 12)


@pytest.fixture
def embedded(make_explanation):
    rng = np.random.default_rng(1)
    return make_explanation(arrays={f"tsne_{n}": rng.normal(size=(12, 2)) for n in embedding.MAPS})


def test_each_thumbnail_has_its_own_cell_and_their_number_is_limited(embedded, make_explanation):
    placed = embedding.cells(embedded, "features")
    assert len({tuple(cell) for cell in placed.tolist()}) == 12 and placed.min() >= 0
    most = embedding.MAX_THUMBNAILS
    many = embedding.shown_frames(make_explanation(frames=2 * most + 1))
    assert (len(many), many[0], many[-1]) == (most, 0, 2 * most)


def test_the_interactive_map_has_the_data_of_each_frame(embedded):
    points = embedding.points(embedded)
    assert points["tile"] == [6, 4] and points["last"] == [5, 5]
    assert points["step"] == [*range(6), *range(6)]
    assert points["event"][1:4] == ["", "collects a cube", ""]
    assert points["cells"]["pixels"] == embedding.cells(embedded, "pixels").tolist()
    assert np.allclose(np.sum(points["probabilities"], axis=1), 1, atol=2e-3)


def test_the_sprite_has_each_frame_where_the_page_cuts_it(make_explanation):
    explanation = make_explanation(frames=32)
    explanation.data["frames"][:] = 0
    explanation.data["frames"][31] = 255
    sheet = embedding.sprite(explanation).convert("RGB")
    assert sheet.size == (30 * 6, 2 * 4)
    assert sheet.getpixel((1 * 6 + 2, 4 + 1)) == (255, 255, 255)
    assert sheet.getpixel((2, 1)) == (0, 0, 0)


@pytest.fixture
def mapped(make_explanation):
    """Response and outcome at two heights."""
    probabilities = np.zeros((2, 3, 4, 3))
    probabilities[..., 0] = 1.0
    probabilities[1, 2, 3] = [0.25, 0.5, 0.25]
    blind, collected = np.zeros((2, 3, 4), bool), np.zeros((2, 2, 2), bool)
    blind[0, 0, 0] = collected[1, 0, 1] = True
    arrays = {
        "response_height": np.array([0.0, 1.5]),
        "response_forward": np.array([2.0, 4.0, 6.0]),
        "response_lateral": np.array([-3.0, -1.0, 1.0, 3.0]),
        "response_probabilities": probabilities,
        "response_oracle": np.array([2, 0, -1, 1]),
        "response_blind": blind,
        "outcome_height": np.array([0.0, 1.5]),
        "outcome_forward": np.array([2.0, 6.0]),
        "outcome_lateral": np.array([-3.0, 3.0]),
        "outcome_collected": collected,
    }
    return make_explanation(arrays=arrays)


def test_the_charts_of_the_response_are_of_each_height(mapped):
    charts = response.response_charts(mapped)
    assert len(charts) == 2 * 5
    assert [*charts][:2] == ["P(left), cube +1.5 m", "P(forward), cube +1.5 m"]
    left = charts["P(left), cube +1.5 m"].axes[0].collections[0]
    assert left.get_array().ravel().tolist() == [*[0.0] * 11, 0.5]
    assert left.get_datalim(left.axes.transData).bounds == pytest.approx((-4.0, 1.0, 8.0, 6.0))
    assert any("blind" in title for title in charts)


def test_the_exact_map_is_drawn_unless_it_is_refused(make_explanation):
    part = places.PART
    numbers = {"places": EXPLANATION["places"] | NUMBERS}
    explanation = make_explanation(numbers, {f"places_{name}": a for name, a in WAYS.items()})
    assert list(part.draw(explanation)) == ["places"]
    assert part.extras(explanation)["rows"][1][0] == "on its left"
    refused = make_explanation({"places": {"refused": "it sees a stack of frames"}})
    assert part.draw(refused) == part.extras(refused) == {}


def test_the_most_asymmetric_frames_are_shown_in_order(make_explanation):
    worst = [{"frame": t, "distance": d} for t, d in ((7, 0.9), (3, 0.5), (1, 0.25), (0, 0.1))]
    shown = response.worst_frames(make_explanation({"asymmetry": {"dataset": {"worst": worst}}}))
    assert [caption.split(":")[0] for caption in shown] == ["frame 7", "frame 3", "frame 1"]


def test_each_change_of_a_scene_has_its_effect_as_caption(make_explanation):
    effects = {
        "target taken away": {"mean": 0.5, "lower95": 0.4, "upper95": 0.6},
        "target moved": UNKNOWN,
    }
    truth = {"shown_frame": 3, "interventions": effects}
    after = np.zeros((2, 4, 60, 3), np.uint8)
    shown = changes(make_explanation({"truth": truth}, {"interventions": after}))
    assert [*shown][1:] == ["target taken away: 0.50 [0.40, 0.60]", "target moved: not tried"]


def bound(lower, median, upper):
    return {"lower": lower, "median": median, "upper": upper}


@pytest.fixture
def truth():
    return {
        "methods": {
            "grad_cam": {
                "trusted": True,
                "score": SCORE,
                "placebos": {"ones": bound(0.3, 0.4, 0.5), "blob": bound(0.1, 0.6, 0.9)},
                "pointing": bound(0.2, 0.3, 0.4),
                "likeness": bound(0.6, 0.7, 0.8),
            },
            "saliency": {"trusted": False, "score": UNKNOWN, "pointing": bound(None, 0.1, None)},
        },
        "placebos": {"ones": {**SCORE, "mean": 0.1}, "blob": {**SCORE, "mean": 0.2}},
    }


def draw(truth):
    charts = truth_charts(Explanation({"name": "x", "truth": truth}, {}, {}))
    return [figure.axes[0] for figure in charts.values()]


def texts(axis):
    return [text.get_text().strip() for text in axis.texts]


def test_scores_of_methods_and_placebos_have_their_intervals(truth):
    axis = draw(truth)[0]
    labels = [label.get_text() for label in axis.get_yticklabels()]
    assert labels == ["placebo: ones", "placebo: blob", "saliency", "Grad-CAM"]
    lines = [list(line.get_xdata()) for line in axis.lines[:-1]]
    assert lines == [[0.4, 0.6], [0.1], [0.4, 0.6], [0.2], [0.4, 0.6], [0.5]]  # none of saliency
    colors = [to_hex(line.get_color()) for line in axis.lines[1:-1:2]]
    assert colors == [css(MUTED), css(MUTED), css(GOOD)]


def test_tests_of_maps_have_limits_and_the_hardest_placebo_counts(truth):
    _, placebos, pointing, likeness = draw(truth)
    assert [list(line.get_xdata()) for line in placebos.lines] == [[0.1, 0.9], [0.6], [0, 0]]
    assert texts(pointing) == ["too few episodes"]
    assert list(likeness.lines[-1].get_xdata()) == [0.5, 0.5]


def test_empty_charts_give_the_reason(truth):
    for one in (*truth["methods"].values(), *truth["placebos"].values()):
        one |= {"score": UNKNOWN, **UNKNOWN}
    for method in truth["methods"].values():
        method |= {"placebos": {}, "pointing": None, "likeness": None}
    for axis in draw(truth):
        assert "affects this policy" in texts(axis)[0]
    for axis in draw({**truth, "methods": {}})[1:]:
        assert texts(axis) == ["no method was tested"]
