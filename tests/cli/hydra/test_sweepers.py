"""Ranges in Hydra's grammar as Optuna's distributions."""

import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser

optuna = pytest.importorskip("optuna", reason="pip install -e '.[optuna]'")

from optuna.distributions import (  # noqa: E402
    CategoricalDistribution,
    FloatDistribution,
    IntDistribution,
)

from drone_rl.cli.hydra.sweepers import SearchSweeper, check_params, distribution  # noqa: E402
from drone_rl.utils.errors import InputError  # noqa: E402
from tests.cli.running import error_line  # noqa: E402


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a=interval(0.9,1)", FloatDistribution(0.9, 1.0)),
        ("a=tag(log,interval(1e-4,1e-1))", FloatDistribution(1e-4, 1e-1, log=True)),
        ("a=int(interval(1,5))", IntDistribution(1, 5)),
        ("a=tag(log,int(interval(1,100)))", IntDistribution(1, 100, log=True)),
        ("a=range(0,10,4)", IntDistribution(0, 8, step=4)),
        ("a=choice(x,y)", CategoricalDistribution(["x", "y"])),
    ],
)
def test_distributions(text, expected):
    (override,) = OverridesParser.create().parse_overrides([text])
    assert distribution(override) == expected


@pytest.mark.parametrize(
    "text",
    [
        "optimizer.lr=range(0.001,0.01,0.001)",
        "seed=range(3,3)",
        "optimizer.lr=tag(log,interval(0,1))",
    ],
)
def test_ranges_that_cannot_be_searched_are_refused(text):
    (override,) = OverridesParser.create().parse_overrides([text])
    with pytest.raises(InputError, match="can't be searched; give a choice, interval"):
        distribution(override)


def test_numbers_below_one_are_refused():
    settings = {"seed": 0, "prune": True, "startup_trials": 1, "report_frames": 1, "params": {}}
    settings["metric"] = "running_reward"
    with pytest.raises(InputError, match="num_trials=0"):
        SearchSweeper(num_trials=0, batch=1, **settings)


def test_a_journal_sets_only_what_is_searched():
    space = {"a": FloatDistribution(0.0, 1.0), "b": CategoricalDistribution(["x", "y"])}
    check_params({"a": 0.5, "b": "x"}, space)
    for params in ({"policy._target_": "os.system"}, {"a": 2.0}, {"a": "x"}, {"b": "z"}):
        with pytest.raises(InputError, match="outside this search's space"):
            check_params(params, space)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["task.reward.contact.weight=interval(-1,0)"], "add hydra.sweeper.metric=success"),
        (["experiment=smoke,pillars", "optimizer.lr=1,2"], "it changes the task"),
        (
            ["hydra.sweeper.metric=success", "seed=0,1", "trainer.confirm_episodes=0"],
            "give 1 or more",
        ),
    ],
)
def test_searches_without_a_comparable_metric_are_refused(in_process, tmp_path, words, message):
    chosen = ["hydra/sweeper=optuna", "task=pillars"]
    assert message in error_line(in_process("train", "-m", *chosen, *words))
    assert [*tmp_path.iterdir()] == []
