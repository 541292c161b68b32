from drone_rl.explanations.report.sections.left_out import PART
from drone_rl.utils.text import say


def test_it_says_why_where_something_is_left_out(make_explanation):
    explanation = make_explanation({"left_out": {"embedding": "No layers.", "eyes": "No eyes."}})
    assert PART.fits(explanation)
    assert say(PART.words["left_out"], explanation.numbers) == "No layers. No eyes."
    assert not PART.fits(make_explanation({}))
