"""Verdicts on policies whose flaws are known: the kind, and whether it is certain."""

import functools

import pytest
import torch

from benchmarks import verdicts
from benchmarks.scripted_policies import SCRIPTS, ScriptedPolicy
from drone_rl.collectors.complete_episodes import rollout
from drone_rl.envs import DroneEnv
from drone_rl.trust.baselines import run_baselines
from drone_rl.trust.verdict import apply_rule
from drone_rl.utils.seeding import RootSeed, Stream

EPISODES = 400
KINDS = {
    "good": ["all cubes", "loses one episode in 50"],
    "poor": ["turns the wrong way", "straight on in a narrow field"],
    "one-sided (right)": ["blind on its left"],
    "one-sided (left)": ["blind on its right"],
    "good, but trivial": ["straight on where none stand aside"],
    "none of these": ["dithers at the third cube", "sees 4 m sideways"],
    "not certain": ["all or nothing, nine in ten"],
}
PHRASES = {
    "dithers at the third cube": "in 400 of 400 episodes (100%); 100% of all end at the step",
    "sees 4 m sideways": "with cubes 4 to 6 m to its side: in 221 of 221 episodes",
    "blind on its left": "can't be trusted with cubes on its left",
    "loses one episode in 50": "second cube: in 9 of 400",
    "straight on in a narrow field": 'no better than the baseline "always forward"',
}
"""The finding that a reader needs, for some of them."""


@functools.cache
def baselines(task):
    env = DroneEnv(EPISODES, task, pixels=False, stream=Stream.REPORT)
    return run_baselines(EPISODES, task, env.state_dict(), EPISODES)


def run(name, greedy=True):
    env = DroneEnv(EPISODES, SCRIPTS[name].settings, pixels=False, stream=Stream.REPORT)
    policy = ScriptedPolicy(SCRIPTS[name], torch.Generator().manual_seed(0))
    return rollout(policy, env, EPISODES, greedy=greedy)


def judge(name, sampled=None):
    task = SCRIPTS[name].settings
    return apply_rule(run(name), baselines(task), sampled=sampled, seed=RootSeed(0, False))


def shown(verdict):
    return "\n".join([verdict.sentence, *(finding.text for finding in verdict.own_findings)])


@pytest.mark.parametrize(
    ("kind", "name"), [(k, name) for k, names in KINDS.items() for name in names]
)
def test_a_known_flaw_decides_the_verdict(kind, name):
    verdict = judge(name)
    assert (verdict.kind.value if verdict.certain else "not certain") == kind, verdict.sentence
    assert PHRASES.get(name, "") in shown(verdict)


def test_sampled_actions_of_an_uncertain_policy_fail():
    verdict = judge("sure of nothing", run("sure of nothing", greedy=False))
    assert (verdict.kind.value, verdict.certain) == ("good", True)
    assert "in 17.0% of episodes" in shown(verdict)


def test_right_and_certain_verdicts_are_counted():
    rows = {"right": ("good", True, "good"), "wrong": ("good", True, "poor"),
            "open": ("good", False, "poor")}  # fmt: skip
    figures = verdicts.count(
        {name: dict(zip(("kind", "certain", "is"), row, strict=True)) for name, row in rows.items()}
    )
    assert [figures[f"verdicts_{name}"] for name in ("right", "certain", "total")] == [1, 2, 3]
