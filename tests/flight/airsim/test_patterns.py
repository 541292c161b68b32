"""Searches by regular expressions of clients end."""

import time

import pytest

from drone_rl.flight.airsim.messages import MAX_NAME
from drone_rl.flight.airsim.patterns import matching
from drone_rl.utils.errors import InputError


@pytest.mark.parametrize(
    "pattern",
    [
        "(a+)+b",
        "(a|aa)*b",
        "a?a?a?a?a?a",
        "(a*){9}",
        ".*.*.*.*b",
        "(.*|b)(.*|c)(.*|d)(.*|e)",
        "(?:a*)+",
    ],
)
def test_searches_that_could_take_forever_are_refused(pattern):
    with pytest.raises(InputError, match="repeats too much; give at most 3"):
        matching(pattern, ["a" * 100])


def test_the_slowest_search_that_is_allowed_ends():
    begin = time.monotonic()
    assert matching(".*.*.*b", ["a" * MAX_NAME] * 20) == []
    assert time.monotonic() - begin < 5.0
