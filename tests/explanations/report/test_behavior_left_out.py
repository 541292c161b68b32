from drone_rl.explanations.report.behavior import LEFT_OUT_PART
from drone_rl.utils.text import say


def test_it_says_why_where_something_is_left_out(make_explanation):
    explanation = make_explanation({"left_out": {"embedding": "No layers.", "eyes": "No eyes."}})
    assert LEFT_OUT_PART.fits(explanation)
    assert say(LEFT_OUT_PART.text["left_out"], explanation.numbers) == "No layers. No eyes."
    assert not LEFT_OUT_PART.fits(make_explanation({}))
