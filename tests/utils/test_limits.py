"""Sizes are refused before anything is allocated; every bound by hand."""

import numpy as np
import pytest

from drone_rl.utils.errors import InputError
from drone_rl.utils.limits import (
    Allowance,
    check_depth,
    check_indices,
    check_json_size,
    check_shape,
)


def test_files_share_an_allowance():
    allowance = Allowance(10)
    allowance.take(4, "a")
    allowance.take(6, "b")
    with pytest.raises(InputError, match="c has 1 bytes, more than the 0 left of 10 bytes"):
        allowance.take(1, "c")


@pytest.mark.parametrize("content", ["[1,[2],{}]", b"[1,[2],{}]"])
def test_separators_are_counted(content):
    check_json_size(content, "x", 6)  # two commas, two lists, a mapping
    with pytest.raises(InputError, match="x holds more than 5 values"):
        check_json_size(content, "x", 5)


def test_depth():
    check_depth({"a": [1, {"b": 2}]}, "x", 3)
    check_depth(7, "x", 1)
    with pytest.raises(InputError, match="nested more than 2 times"):
        check_depth({"a": [1, {"b": 2}]}, "x", 2)


@pytest.mark.parametrize(
    ("shape", "itemsize", "count"), [((2, 3), 4, 6), ((), 8, 1), ((0, 6), 4, 0)]
)
def test_shapes(shape, itemsize, count):
    assert check_shape(shape, itemsize, 24, "x") == count


@pytest.mark.parametrize(
    ("shape", "itemsize"), [((2, 4), 4), ((0, 7), 4), ((1,) * 9, 1), ((-1,), 4), ((1,), 0)]
)
def test_shapes_that_are_refused(shape, itemsize):
    with pytest.raises(InputError, match=r"x has"):
        check_shape(shape, itemsize, 24, "x")


def test_indices():
    check_indices(np.array([0, 2]), 3, "x")
    check_indices(np.array([], int), 1, "x")
    for wrong in ([0, 3], [-1, 0], [2**40]):
        with pytest.raises(InputError, match="at least 0 and below 3"):
            check_indices(np.array(wrong), 3, "x")
    with pytest.raises(InputError, match="not of whole numbers"):
        check_indices(np.zeros(2), 3, "x")
