"""Each case is refused because of one part; the rest is valid."""

import pytest

from benchmarks import hostile_explanations
from benchmarks.evidence import changed
from drone_rl.explanations.report.validation import check_files
from drone_rl.sim.vocabulary import SHOWN_MOVES
from drone_rl.utils.errors import InputError


def check(numbers, arrays):
    check_files(numbers, arrays, hostile_explanations.data(), SHOWN_MOVES)


def test_the_unchanged_explanation_is_valid():
    check(hostile_explanations.numbers(), hostile_explanations.arrays())


@pytest.mark.parametrize("name", hostile_explanations.NUMBERS)
def test_an_inconsistent_number_is_refused(name):
    with pytest.raises(InputError):
        check(
            changed(hostile_explanations.numbers(), dict([hostile_explanations.NUMBERS[name]])),
            hostile_explanations.arrays(),
        )


@pytest.mark.parametrize("name", hostile_explanations.ARRAYS)
def test_an_inconsistent_array_is_refused(name):
    with pytest.raises(InputError):
        check(
            hostile_explanations.numbers(),
            {**hostile_explanations.arrays(), **dict([hostile_explanations.ARRAYS[name]])},
        )
