"""What is missing is named with the command that installs it."""

import json
import sys

import pytest

from drone_rl.utils.errors import InputError, extra


def test_a_package_that_is_there():
    assert extra("json", "x", "y") is json


def test_one_that_is_not(monkeypatch):
    monkeypatch.setitem(sys.modules, "submitit", None)
    with pytest.raises(InputError, match=r"launcher=slurm.*pip install -e '.\[slurm\]'"):
        extra("submitit", "slurm", "hydra/launcher=slurm")
