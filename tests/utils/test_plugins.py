"""Errors of a user's own code name its file and line."""

from pathlib import Path

import numpy as np
import pytest

import drone_rl
from drone_rl.utils.errors import InputError
from drone_rl.utils.plugins import described, errors_of, failure, line_of


def raise_it(error):
    raise error


def caught(error):
    with pytest.raises(type(error)) as info:
        raise_it(error)
    return info.value


def test_failure_names_the_last_line_of_the_users_files():
    line = raise_it.__code__.co_firstlineno + 1
    error = caught(ValueError("two\n words"))
    where = f"line {line} of {__file__}"
    assert failure("x=1", error) == f"x=1 failed in {where} (ValueError: two words); correct it"


def test_a_file_whose_name_begins_like_the_package_is_the_users(tmp_path):
    file = f"{Path(drone_rl.__file__).parent}_tasks.py"
    with pytest.raises(ValueError) as info:
        exec(compile("raise ValueError('here')", file, "exec"))
    assert line_of(info.value) == f"line 1 of {file}"


def test_failure_of_syntax_names_the_line_of_the_file():
    error = caught(SyntaxError("invalid", ("mine.py", 7, 1, "x =")))
    assert "failed in line 7 of mine.py (SyntaxError: invalid" in failure("x=1", error)


def test_errors_become_one_line_and_known_ones_stay():
    failed = r"^x=1 failed in line .*\(OSError: no\); correct it$"
    with pytest.raises(InputError, match=failed), errors_of("x=1", "A of b.py"):
        raise_it(OSError("no"))
    with pytest.raises(InputError, match=r"^known$"), errors_of("x=1", "A of b.py"):
        raise InputError("known")


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "None"), (1.5, "a float"), (np.zeros((2, 3)), "a ndarray of shape (2, 3)")],
)
def test_described(value, text):
    assert described(value) == text
