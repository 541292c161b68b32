"""`import drone_rl` is quick and offers all that it lists."""

import importlib
import subprocess
import sys

import pytest

import drone_rl
from drone_rl.utils.errors import InputError


def test_everything_that_is_listed_is_there():
    for name in set(drone_rl.__all__) - {"explain"}:  # which is a package, too
        assert getattr(drone_rl, name).__name__ == name
        assert name in dir(drone_rl)
    assert set(drone_rl._HOMES) == set(drone_rl.__all__)


def test_the_package_explain_is_the_function_too():
    module = importlib.import_module("drone_rl.explain")
    for explain in (drone_rl.explain, module):
        with pytest.raises(InputError, match=r"^frames=3 is less than one of each flight"):
            explain("good", frames=3)
    assert importlib.import_module("drone_rl.explain.settings").ExplainSettings


def test_what_is_not_there():
    with pytest.raises(AttributeError, match="no attribute 'fly'"):
        drone_rl.fly  # noqa: B018


def test_nothing_heavy_is_imported():
    code = "import sys, drone_rl; assert not {'torch', 'numpy', 'hydra'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_importing_the_api_says_nothing():
    code = "import warnings; warnings.simplefilter('default'); import drone_rl; drone_rl.judge"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")
