from drone_rl.explanations.report.behavior import DATASET_PART
from drone_rl.utils.text import say
from tests.evidence import EXPLANATION


def test_it_tells_the_size_of_the_data_set_and_draws_nothing(make_explanation):
    explanation = make_explanation({"dataset": EXPLANATION["dataset"]})
    assert DATASET_PART.fits(explanation)
    assert say(DATASET_PART.text["dataset"], explanation.numbers).startswith("600 frames")
    assert DATASET_PART.draw(explanation) == {}
