from drone_rl.evaluation.plots.images import gridded, probed_frame
from drone_rl.explanations.report.response import worst_frames


def test_the_three_worst_are_shown_in_order(make_explanation):
    worst = [{"frame": t, "distance": d} for t, d in ((7, 0.9), (3, 0.5), (1, 0.25), (0, 0.1))]
    explanation = make_explanation({"asymmetry": {"dataset": {"worst": worst}}})
    captions = ("differs by 0.90", "differs by 0.50", "differs by 0.25")
    tiles = [probed_frame(explanation.data, t, c) for t, c in zip((7, 3, 1), captions, strict=True)]
    assert list(worst_frames(explanation).getdata()) == list(gridded(tiles, 3).getdata())
