import math

import numpy as np
import pytest
import torch

from drone_rl.flight.commands import checks
from drone_rl.utils.errors import InputError


def test_numbers_of_any_kind_are_taken():
    for given in (np.array([1.0, 2.0]), torch.tensor([1, 2]), (np.float32(1), torch.tensor(2))):
        assert checks.numbers(given, "start", 2) == (1.0, 2.0)
    with pytest.raises(InputError, match=r"start\[1\]=9: it must be a number from 0 to 1"):
        checks.numbers((1, 9), "start", 2, checks.SHARE)
    with pytest.raises(InputError, match="give a list of 2 values"):
        checks.numbers(np.zeros((3, 3)), "start", 2)


def test_a_path():
    assert checks.path([(1, 2, 3), (4, 5, 6)]).tolist() == [[[1, 2, 3], [4, 5, 6]]]


@pytest.mark.parametrize(
    ("path", "told"),
    [
        ([], "has no points"),
        ([1, 2, 3], "has no points"),
        ([(1, 2, 3), (0, math.nan, 1)], r"path\[1\].y=nan"),
        ([(0, 0, -1)], r"path\[0\].z=-1 is below the ground"),
        ("home", "path='home' has no points"),
        ([(1, 2, 3), (1, 2)], "has no points"),
        ([(10**400, 0, 1)], "has no points"),
    ],
)
def test_what_is_no_path(path, told):
    with pytest.raises(InputError, match=told):
        checks.path(path)
