"""Verdicts on policies whose flaws are known: the kind, whether it is certain, and the sentence."""

import functools

import pytest
import torch

from benchmarks.scripted_policies import SCRIPTS, ScriptedPolicy
from drone_rl.collectors.complete_episodes import run_episodes
from drone_rl.envs import DroneEnv
from drone_rl.trust.baselines import run_baselines
from drone_rl.trust.verdict import apply_rule
from drone_rl.utils.seeding import RootSeed, Stream

EPISODES = 400
NONE, RIGHT, LEFT = "none of these", "one-sided (right)", "one-sided (left)"
TRIVIAL = "good, but trivial"
CERTAIN, OPEN = True, False
BASELINES = "acting at random 29.1% and the oracle 100%"
WANTED = {
    "all cubes": ("good", CERTAIN, ["does its task", "at most 0.9%", BASELINES]),
    "all cubes, slowly": ("good", CERTAIN, ["in 100% of episodes", "at most 0.9%"]),
    "first cube only, then straight on": (NONE, CERTAIN, ["at the second cube", "(72.8%)"]),
    "first cube only, then leaves": (
        "poor",
        CERTAIN,
        [
            "hardly better than acting at random. It collects 53.7% of the cubes on its left, ",
            f"collects 33.3% of all cubes, {BASELINES}",
            "at the second cube: in all 400 episodes; 100% of all end outside the field",
        ],
    ),
    "first two cubes only": (NONE, CERTAIN, ["fails most at the third cube"]),
    "dithers at the third cube": (
        NONE,
        CERTAIN,
        ["third cube: in all 400 episodes; 100% of all end at the step limit"],
    ),
    "dithers at far first cubes": (
        NONE,
        CERTAIN,
        ["4 to 6 m", "31.5% of all end at the step limit"],
    ),
    "dodges cubes ahead": (
        NONE,
        CERTAIN,
        [
            "100% of the cubes on its left, 0% of those ahead",
            "fails most with cubes ahead",
        ],
    ),
    "dodges 35% of the cubes ahead": (NONE, CERTAIN, ["67.2% of those ahead", "with cubes ahead"]),
    "sees 4 m sideways": (NONE, CERTAIN, ["with cubes 4 to 6 m to its side: in all 221 episodes"]),
    "sees 2.5 m sideways": (NONE, OPEN, ["with cubes 4 to 6 m to its side: in all"]),
    "blind to higher cubes": (NONE, CERTAIN, ["with cubes higher than its start", "(82.4%)"]),
    "blind to much lower cubes": (NONE, CERTAIN, ["with cubes lower than its start"]),
    "blind on its left": (RIGHT, CERTAIN, ["can't be trusted with cubes on its left", "0% of the"]),
    "blind on its right": (LEFT, CERTAIN, ["can't be trusted with cubes on its right"]),
    "half blind on its right": (NONE, CERTAIN, ["fails most with cubes on its right"]),
    "finds three cubes of ten on its left": (
        NONE,
        OPEN,
        ["looks neither good", "on its left"],
    ),
    "finds one cube of ten on its left": (RIGHT, CERTAIN, ["can't be trusted", "on its left"]),
    "loses one episode in 13": (
        "good",
        OPEN,
        ["looks good, but 400 episodes are too few", "second cube", "outside the field"],
    ),
    "loses one episode in 50": ("good", CERTAIN, ["97.8% of episodes", "second cube: in 9 of 400"]),
    "leaves when the first cube is far": (
        "good",
        OPEN,
        ["looks good, but", "with cubes 4 to 6 m to its side: in 28", "outside the field"],
    ),
    "all or nothing, nine in ten": (
        "good",
        OPEN,
        ["first cube: in 32 of 400", "; 8.0% of all end"],
    ),
    "misses the last cube in one of ten": (
        "good",
        OPEN,
        ["third cube: in 32 of 400 episodes"],
    ),
    "leaves at once, every other time": (NONE, OPEN, ["first cube", "50.5% of all end outside"]),
    "sure of nothing": ("good", CERTAIN, ["most probable actions", "in 17.0% of episodes, not in"]),
    "turns the wrong way": (
        "poor",
        CERTAIN,
        ["no better than acting at random", "collects 0% of all cubes"],
    ),
    "finds one cube of ten beside it": ("poor", CERTAIN, ["hardly better than acting", BASELINES]),
    "finds one cube of three beside it": (NONE, CERTAIN, ["36.3% of the cubes on its left"]),
    "all of five cubes": ("good", CERTAIN, ["flying straight on 27.5%"]),
    "asleep at the fifth cube": (NONE, CERTAIN, ["fifth cube: in all 400", "at the step limit"]),
    "all cubes where none stand aside": (
        TRIVIAL,
        CERTAIN,
        ["none were offered on its left or on its right", "Flying straight on does as well"],
    ),
    "straight on where none stand aside": (TRIVIAL, CERTAIN, ["Flying straight on does as well"]),
    "straight on in a narrow field": (
        "poor",
        CERTAIN,
        ["no better than flying straight on", "straight on 55.0%"],
    ),
    "straight on among large cubes": (
        "poor",
        CERTAIN,
        ["no better than flying straight on", "straight on 49.0%"],
    ),
    "no time for all cubes": (
        NONE,
        OPEN,
        ["Even the oracle", "by ending at the step limit"],
    ),
}


@functools.cache
def baselines(task):
    env = DroneEnv(EPISODES, task, pixels=False, stream=Stream.REPORT)
    return run_baselines(EPISODES, task, env.state_dict(), EPISODES)


UNKNOWN = RootSeed(0, False)
"""Scripts are not fitted to any environments."""


def run(name, greedy=True):
    task = SCRIPTS[name].settings
    env = DroneEnv(EPISODES, task, pixels=False, stream=Stream.REPORT)
    policy = ScriptedPolicy(SCRIPTS[name], torch.Generator().manual_seed(0))
    return run_episodes(env, policy, EPISODES, greedy=greedy)


def test_every_script_is_judged():
    assert WANTED.keys() == SCRIPTS.keys()
    assert len(SCRIPTS) >= 30


@pytest.mark.parametrize("name", SCRIPTS)
def test_kind_certainty_and_sentence(name):
    kind, certain, phrases = WANTED[name]
    task = SCRIPTS[name].settings
    sampled = run(name, greedy=False) if SCRIPTS[name].confidence < 1 else None
    verdict = apply_rule(run(name), baselines(task), sampled=sampled, seed=UNKNOWN)
    assert (verdict.kind.value, verdict.certain) == (kind, certain), verdict.sentence
    assert all(phrase in verdict.sentence for phrase in phrases), verdict.sentence
    assert 2 <= verdict.sentence.count(". ") + 1 <= 6, verdict.sentence


def test_seeking_equals_the_oracle():
    task = SCRIPTS["all cubes"].settings
    ours, theirs = run("all cubes"), baselines(task)["oracle"]
    assert torch.equal(ours.length, theirs.length)
    assert torch.equal(ours.goals.reached, theirs.goals.reached)


def test_zigzag_is_slow_and_dithering_ends_at_the_step_limit():
    slow, fast = (run(name).length.double().mean() for name in ("all cubes, slowly", "all cubes"))
    assert slow > 1.4 * fast
    assert (run("dithers at the third cube").length == 300).all()
