"""Figures of the report, from a small explanation made by hand."""

import numpy as np
import pytest
from matplotlib.colors import to_hex

from drone_rl.explanations.report import attribution, behavior, class_models, embedding, response
from drone_rl.explanations.report.truth import changes, truth_charts
from drone_rl.utils.palette import GOOD, MUTED, css
from tests.evidence import SHIFTS
from tests.explanations.example import PICTURED, STEPS, changed_explanation, mean, median


@pytest.fixture
def explanation():
    return changed_explanation()


def test_the_map_that_passed_comes_first_and_others_are_marked(explanation):
    drawn = attribution.draw(explanation.attribution, explanation)
    assert [*drawn] == ["sequence", "untrusted", "episode"]
    assert [*drawn["sequence"]] == ["1. first", "2. first", "3. first", "4. first"]
    trusted = changed_explanation({"truth.methods.grad_cam.trusted": True})
    assert [*attribution.draw(trusted.attribution, trusted)] == ["sequence", "episode"]
    none = changed_explanation({"truth.trusted": None})
    assert [*attribution.draw(none.attribution, none)] == ["untrusted", "episode"]


def test_a_film_has_every_step_in_a_size_that_can_be_encoded(explanation):
    frames = attribution.draw(explanation.attribution, explanation)["episode"]
    maps, actions = explanation.attribution, explanation.actions
    step = np.asarray(attribution.explained_step(maps, actions, 3, "step 3", "saliency"))
    assert frames.shape[0] == STEPS
    assert all(size % attribution.BLOCK == 0 for size in frames.shape[1:3])
    assert (frames[3, : step.shape[0], : step.shape[1]] == step).all()
    assert (frames[3, step.shape[0] :] == 255).all()


def test_pairs_are_limited_and_left_and_right_take_turns(explanation):
    pair = {"kind": "unknown", "left": 1, "right": 2, "distance": 0.1, "opposition": 0.5}
    flaws = changed_explanation({"flaws.pairs": [pair] * 9}).flaws
    drawn = behavior.draw_pairs(flaws, explanation)
    shown = [*drawn["pairs_unknown"]]
    assert len(shown) == 2 * behavior.MAX_PAIRS and len(drawn) == 1
    assert shown[:2] == ["pair 1, frame 1: more left", "pair 1, frame 2: more right"]


def test_a_robustness_evaluation_is_drawn_unless_it_is_refused():
    good = {"verdict.kind": "good", "shifts": PICTURED}
    shown = changed_explanation(good)
    drawn = behavior.draw_shifts(shown.shifts, shown)
    assert [*drawn] == ["shifts", *(f"conditions_{name}" for name in SHIFTS["axes"])]
    refused = {"path": "shifts.json", "refused": "it is of another task"}
    for change in ({"shifts": refused}, {"verdict.kind": "poor"}):
        other = changed_explanation({**good, **change})
        assert behavior.draw_shifts(other.shifts, other) == {}


def test_class_models_have_actions_from_left_to_right_and_their_colors(explanation):
    drawn = class_models.tiles(explanation.class_model, explanation)["class_model"]
    names = [caption.split()[0] for caption in drawn]
    assert names == ["left", "forward", "right"] * 2
    pixels = [image.getpixel((75, 30)) for image in drawn.values()][:3]
    assert pixels == [(255,) * 3, (0,) * 3, (0,) * 3]


def test_thumbnails_have_cells_of_their_own_in_all_rows_and_columns():
    points = np.array([[0.0, 0.0], [0.0, 0.65], [1.0, 1.0]])
    assert embedding.snap_to_grid(points, columns=2, rows=4).tolist() == [[0, 0], [0, 2], [1, 3]]
    assert embedding.snap_to_grid(points * 0, columns=2, rows=2).shape == (3, 2)
    most = embedding.MAX_THUMBNAILS
    many = embedding.shown_frames(2 * most + 1)
    assert (len(many), many[0], many[-1]) == (most, 0, 2 * most)


def test_the_interactive_map_has_the_data_of_each_frame(explanation):
    points = embedding.interactive_map(explanation.tsne, explanation)
    assert points["tile"] == [60, 4] and points["last"] == [5, 5]
    assert points["step"] == [*range(6), *range(6)]
    assert points["event"][1:4] == ["", "collects a cube", ""]
    assert len({tuple(cell) for cell in points["cells"]["pixels"]}) == 12
    assert np.allclose(np.sum(points["probabilities"], axis=1), 1, atol=2e-3)
    assert points["sprite"].startswith("data:image/png")


def test_the_charts_of_the_response_are_of_each_height(explanation):
    charts = response.response_charts(explanation.response, explanation)
    assert len(charts) == 2 * 5
    assert [*charts][:2] == ["P(left), cube +1.5 m", "P(forward), cube +1.5 m"]
    left = charts["P(left), cube +1.5 m"].axes[0].collections[0]
    assert left.get_array().ravel().tolist() == [*[0.0] * 11, 0.5]
    assert left.get_datalim(left.axes.transData).bounds == pytest.approx((-4.0, 1.0, 8.0, 6.0))
    assert any("no reaction" in title for title in charts)


def test_each_change_of_a_scene_has_its_effect_as_caption(explanation):
    assert [*changes(explanation.truth, explanation)] == [
        "as it was",
        "target taken away: 0.40 [0.30, 0.50]",
        "ground patch changed: not tried",
    ]


def draw(changes=None):
    return [figure.axes[0] for figure in truth_charts(changed_explanation(changes).truth).values()]


def texts(axis):
    return [text.get_text().strip() for text in axis.texts]


def test_scores_of_methods_and_placebos_have_their_intervals():
    axis = draw({"truth.methods.grad_cam.score": mean(None, -1.0, 1.0)})[0]
    labels = [label.get_text() for label in axis.get_yticklabels()]
    assert labels == ["placebo: ones", "placebo: horizon", "Grad-CAM", "saliency"]
    lines = [list(line.get_xdata()) for line in axis.lines[:-1]]
    assert lines == [[0.0, 0.0], [0.0], [0.2, 0.4], [0.3], [0.4, 0.6], [0.5]]  # none of Grad-CAM
    colors = [to_hex(line.get_color()) for line in axis.lines[1:-1:2]]
    assert colors == [css(MUTED), css(MUTED), css(GOOD)]


def test_tests_of_maps_have_limits_and_the_hardest_placebo_counts():
    few = {**median(None, 0.1, None), "hit": 0.5, "chance": 0.1}
    _, placebos, pointing, likeness = draw({"truth.methods.grad_cam.pointing": few})
    lines = [list(line.get_xdata()) for line in placebos.lines[2:]]
    assert lines == [pytest.approx([0.2, 0.5]), pytest.approx([0.3]), [0, 0]]
    assert texts(pointing) == ["too few episodes"]
    assert list(likeness.lines[-1].get_xdata()) == [0.5, 0.5]


def test_empty_charts_give_the_reason():
    nothing = {"trusted": False, "failed": [], "score": mean(None, -1.0, 1.0)}
    placebos = {"ones": mean(None, -1.0, 1.0)}
    blind = {"truth.methods": {"saliency": nothing}, "truth.placebos": placebos}
    assert all("affects this policy" in texts(axis)[0] for axis in draw(blind))
    for axis in draw({**blind, "truth.methods": {}})[1:]:
        assert texts(axis) == ["no method was tested"]
