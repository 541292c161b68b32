"""Each case has one part that is refused, and is valid without it."""

import pytest

from benchmarks import hostile_explanations as made
from benchmarks.evidence import changed
from drone_rl.explanations.report.validation import check_fit, check_sizes
from drone_rl.sim.vocabulary import SHOWN_MOVES
from drone_rl.utils.errors import InputError


def check(numbers, arrays):
    check_sizes(numbers, arrays, made.data())
    check_fit(numbers, arrays, made.data(), SHOWN_MOVES)


def test_the_rest_is_valid():
    check(made.numbers(), made.arrays())


@pytest.mark.parametrize("name", made.NUMBERS)
def test_a_number_is_refused(name):
    with pytest.raises(InputError):
        check(changed(made.numbers(), dict([made.NUMBERS[name]])), made.arrays())


@pytest.mark.parametrize("name", made.ARRAYS)
def test_an_array_is_refused(name):
    with pytest.raises(InputError):
        check(made.numbers(), {**made.arrays(), **dict([made.ARRAYS[name]])})
