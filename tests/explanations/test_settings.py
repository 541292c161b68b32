import pytest

from drone_rl.explanations.settings import MIN_EPISODES, ExplainSettings
from drone_rl.utils.errors import InputError


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"frames": 29}, r"frames=29 .* give 30 \(data_episodes\) or more"),
        ({"data_episodes": 29}, "data_episodes=29"),
        ({"episodes": 0}, "episodes=0"),
        ({"perplexity": 300.0}, "perplexity=300 does not fit 600 points; give 1 to 199"),
    ],
)
def test_settings_out_of_range_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        ExplainSettings(**wrong)


def test_the_least_that_shows_anything_is_accepted():
    least = ExplainSettings(
        frames=MIN_EPISODES, data_episodes=MIN_EPISODES, episodes=1, perplexity=5
    )
    assert (least.frames, least.episodes) == (30, 1)
