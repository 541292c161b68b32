import math

import numpy as np
import pytest
import torch

from drone_rl.flight.commands import checks
from drone_rl.utils.errors import InputError

HUGE = pytest.param(10**400, id="huge")
BOUNDS = r"a finite number of -1e\+06 or more, up to 1e\+06"


def test_numbers_of_any_kind_are_taken():
    assert checks.real(np.float32(1.5), "x") == 1.5
    assert checks.real(torch.tensor(2), "x") == 2.0


@pytest.mark.parametrize(
    "value",
    [math.nan, math.inf, "far", None, [1.0, 2.0], 2e6, 10**400, 1 << 20_000, np.zeros((3, 3))],
    ids=lambda value: type(value).__name__,
)
def test_what_is_no_finite_number_is_refused(value):
    words = r"^x=.* is invalid; give a finite number of -1e\+06 or more, up to 1e\+06$"
    with pytest.raises(InputError, match=words):
        checks.real(value, "x")


def test_so_many_numbers():
    assert checks.numbers(np.array([1, 2]), "start", 2, 0, 5) == [1.0, 2.0]
    with pytest.raises(InputError, match=r"start\[1\]=9 is invalid"):
        checks.numbers((1, 9), "start", 2, 0, 5)
    with pytest.raises(InputError, match=r"^start=array.* is invalid; give 2 numbers$"):
        checks.numbers(np.zeros((3, 3)), "start", 2, 0, 5)


def test_a_path():
    assert checks.path([(1, 2, 3), (4, 5, 6)]).tolist() == [[[1, 2, 3], [4, 5, 6]]]


@pytest.mark.parametrize(
    ("path", "told"),
    [
        ([], "path has no points"),
        ([(1, 2)], r"shape \(1, 2\)"),
        ([1, 2, 3], r"shape \(3,\)"),
        ([(1, 2, 3), (0, math.nan, 1)], r"path\[1\].y=nan is invalid"),
        ([(0, 0, -1)], r"path\[0\].z=-1 is below the ground"),
        ("home", "path='home' is invalid"),
        ([(1, 2, 3), (1, 2)], "is invalid"),
        ([(10**400, 0, 1)], "is invalid"),
        (np.array([["a", "b"], ["c", "d"]]), r"path=array.* is invalid"),
    ],
)
def test_what_is_no_path(path, told):
    with pytest.raises(InputError, match=told) as error:
        checks.path(path)
    assert "\n" not in str(error.value)
