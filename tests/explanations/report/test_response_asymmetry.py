from drone_rl.explanations.report.response import worst_frames
from drone_rl.trust.plots.images import frame_with_probabilities


def test_the_three_worst_are_shown_in_order(make_explanation):
    worst = [{"frame": t, "distance": d} for t, d in ((7, 0.9), (3, 0.5), (1, 0.25), (0, 0.1))]
    explanation = make_explanation({"asymmetry": {"dataset": {"worst": worst}}})
    shown = worst_frames(explanation)
    assert [*shown] == [
        "frame 7: differs by 0.90", "frame 3: differs by 0.50", "frame 1: differs by 0.25"
    ]  # fmt: skip
    for frame, (caption, picture) in zip((7, 3, 1), shown.items(), strict=True):
        tile = frame_with_probabilities(explanation.data, frame, caption)
        assert list(picture.getdata()) == list(tile.getdata())
