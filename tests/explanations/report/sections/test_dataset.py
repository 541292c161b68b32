from benchmarks.evidence import EXPLANATION
from drone_rl.explanations.report.sections.dataset import PART
from drone_rl.utils.text import say


def test_it_tells_the_size_of_the_data_set_and_draws_nothing(make_explanation):
    explanation = make_explanation({"dataset": EXPLANATION["dataset"]})
    assert PART.fits(explanation)
    assert say(PART.words["dataset"], explanation.numbers).startswith("600 frames")
    assert PART.draw(explanation) == {}
