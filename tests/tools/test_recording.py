"""Records of the tests of a small program, run in a fork as `make mutants` does."""

import json

from tools.mutants import forks
from tools.mutants.forks import Run, run_all

MODULE = """\
def half(x):
    if x < 0:
        return -half(-x)
    return x / 2


def made():
    return half(8)
"""
TESTS = """\
import pytest

from recorded_program.module import half, made


@pytest.fixture(scope="module")
def four():
    return made()


def test_plus():
    assert half(3) == 1.5


def test_minus():
    assert half(-3) == -1.5


def test_four(four):
    assert four == 4


def test_five(four):
    assert four + 1 == 5


def test_wrong():
    assert half(1) == 1


@pytest.mark.skip
def test_left_out():
    assert half(1) == 1
"""


def test_a_record_has_the_blocks_of_each_test_and_its_fixtures(tmp_path, monkeypatch):
    monkeypatch.setattr(forks, "PACKAGE", "recorded_program")
    package = tmp_path / "tree" / "recorded_program"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("")
    (package / "module.py").write_text(MODULE)
    (tmp_path / "tree" / "test_module.py").write_text(TESTS)
    run = Run("a", ["test_module.py"], 60.0, record=tmp_path / "record.json")
    (outcome,) = run_all(iter([run]), tmp_path / "tree", tmp_path, jobs=1)
    assert outcome.status == "failed"  # one test fails, and the others run nevertheless
    assert outcome.failing == "test_module.py::test_wrong"
    record = json.loads((tmp_path / "record.json").read_text())
    assert record["failed"] == ["test_module.py::test_wrong"]
    blocks = [name.removeprefix("recorded_program.module:") for name in record["blocks"]]
    found = {test.split("::")[1]: [blocks[i] for i in at] for test, _, at in record["tests"]}
    assert found == {
        "test_plus": ["half#0"],
        "test_minus": ["half#0", "half#1"],
        "test_four": ["half#0", "made#0"],
        "test_five": ["half#0", "made#0"],  # executed by the fixture for an earlier test
    }
    assert all(0 <= seconds < 60 for _, seconds, _ in record["tests"])
