"""Whole numbers with an exponent, values that do not fit, and quotes for a shell."""

import shlex

import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser

from drone_rl.cli.hydra.names import Command
from drone_rl.cli.hydra.values import in_quotes, several_values, whole_numbers, wrong_type
from drone_rl.utils.settings import conf_dir

pytestmark = pytest.mark.usefixtures("registered")


@pytest.fixture(scope="module")
def train():
    return Command("train", conf_dir())


def parsed(text):
    return OverridesParser.create().parse_override(text)


@pytest.mark.parametrize(
    ("override", "number"),
    [
        ("trainer.total_frames=1e5", "trainer.total_frames=100000"),
        ("trainer.total_frames=1.5E+3", "trainer.total_frames=1500"),
        ("collector.num_envs=1e1,2e1", "collector.num_envs=10,20"),
        ("network.hidden=[1e2,64]", "network.hidden=[100,64]"),
        ("network.channels=[1e1, 2e1]", "network.channels=[10, 20]"),
        ("certificate_flights=1e3", "certificate_flights=1000"),
        ("certificate=1e3", "certificate=1e3"),
        ("+policies=[1e3]", "+policies=[1e3]"),
        ("optimizer.lr=1e-3", "optimizer.lr=1e-3"),
        ("optimizer.lr=1.5e0", "optimizer.lr=1.5e0"),
        ("optimizer.lr=1e30", "optimizer.lr=1e30"),
        ("hydra.run.dir=1e5", "hydra.run.dir=1e5"),
        ("policy=1e5", "policy=1e5"),
        ("task=x1e5", "task=x1e5"),
    ],
)
def test_whole_numbers_may_have_an_exponent(override, number):
    assert whole_numbers(override) == number


def test_values_that_fit_are_no_mistake(train):
    assert wrong_type(train, parsed("seed=3")) is None
    assert str(wrong_type(train, parsed("seed=x"))).startswith("seed=x does not fit; type a whole")


def test_several_values_are_offered_as_a_list_only_where_one_fits(train):
    text = "dynamics.wind=1,2,3"
    assert "type dynamics.wind=[1,2,3]; for one" in str(several_values(train, parsed(text), text))
    assert "[1,2]" not in str(several_values(train, parsed("seed=1,2"), "seed=1,2"))


@pytest.mark.parametrize(
    ("text", "quoted"), [("a=1", "a=1"), ("a='b c'", "\"a='b c'\""), ("a=$b", "'a=$b'")]
)
def test_quotes_for_a_shell(text, quoted):
    assert in_quotes(text) == quoted
    assert shlex.split(quoted) == [text]
