"""Gains of randomized training, and operating domains on every axis."""

import dataclasses
import json
from types import SimpleNamespace

import pytest

import drone_rl
from benchmarks import domain_axes, robust
from benchmarks.robust import ARMS, bench_robust
from benchmarks.robust_comparison import (
    PLAIN,
    TOUCHED_BY,
    by_kind,
    changed,
    compare,
    touched_axes,
    untouched_kinds,
)
from drone_rl.config import AppearanceSettings, TaskSettings
from drone_rl.config.training import TrainSettings
from drone_rl.config.transforms import Blur, Fault, Gray, LateFrames, Noise, Shift, Standardize
from drone_rl.trust.axes import AXES, GROUPS
from drone_rl.trust.paired_evaluation import PairedEvaluator
from drone_rl.utils.run_result import RunResult
from tests.trust.making import shifts_of
from tests.trust.subjects import Blind, subject

AHEAD = TaskSettings(num_cubes=1, first_distance=8.0, front_margin=4.0, lateral_bound=0.0)


def seeing(*steps):
    return TrainSettings(transforms=(Gray(), *steps, Standardize()))


def looking(**appearance):
    return TrainSettings(appearance=AppearanceSettings(**appearance))


def test_gains_and_costs_by_hand(setup, monkeypatch):
    """With the arm "all", camera position succeeds in 0.6 and 0.7 of episodes instead of 0.4."""
    setup = dataclasses.replace(setup, seeds=(1, 2), quick=False)

    def success_rates(runs, episodes):
        rates = {}
        for run in runs:
            is_all = run.name[:-2] == "all"
            camera = 0.5 + 0.1 * int(run.name[-1]) if is_all else 0.4
            rates[run] = {PLAIN: 0.98 if is_all else 1.0, **dict.fromkeys(AXES, 1.0)}
            rates[run] |= {"camera_height": camera, "camera_sideways": camera, "distractors": 0.4}
        return rates

    appearance = AppearanceSettings(
        exposure=(0.5, 2.0), fog_visibility=(40.0, 100.0), ground_color=((0, 0, 0), (1, 1, 1))
    )
    steps = (Gray(), Noise(), Shift(), Standardize())
    config = TrainSettings(appearance=appearance, transforms=steps).config()

    def train(run, seed, *settings):
        return 1.0, RunResult(reason="solved", frames=int(seed[5:]), largest_reward=3)

    monkeypatch.setattr(robust, "train", train)
    monkeypatch.setattr(robust, "read_checkpoint", lambda path: SimpleNamespace(config=config))
    monkeypatch.setattr(robust, "success_rates", success_rates)
    figures = bench_robust(setup)
    kinds = ["camera position", "field of view", "object size", "distractors", "dynamics"]
    assert figures["robust_untouched"] == kinds
    assert figures["robust_gain_by_seed"] == pytest.approx([100 * 0.2 / 5, 100 * 0.3 / 5])
    assert figures["robust_gain_points"] == pytest.approx(5.0)
    assert figures["robust_gain_all_kinds_points"] == pytest.approx(100 * 0.25 / 10)
    assert figures["robust_gain_by_axis_points"] == pytest.approx(100 * 0.25 * 2 / 7)
    assert figures["robust_room_points"] == pytest.approx(100 * 1.2 / 5)
    assert figures["robust_cost_points"] == pytest.approx(2.0)
    assert list(figures["robust_arms"]) == list(ARMS)
    assert figures["robust_arms"]["all"]["frames"] == [1, 2]


@pytest.mark.parametrize(
    ("settings", "axes"),
    [
        (TrainSettings(seed=3, evaluate_after=10), []),
        (looking(ambient_strength=0.4), ["sun", "brightness"]),
        (seeing(Shift()), ["camera_yaw", "camera_pitch"]),
        (seeing(LateFrames(), Blur()), ["blur", "late_frames", "action_delay"]),
    ],
)
def test_a_training_is_exposed_to_the_axes_of_its_settings(settings, axes):
    assert touched_axes(settings) == axes and bool(changed(settings)) == bool(axes)
    kinds = {AXES[name].group for name in axes}
    assert untouched_kinds(settings) == [kind for kind in GROUPS if kind not in kinds]


def test_every_setting_of_appearance_and_every_fault_belongs_to_an_axis():
    named = {name for names in TOUCHED_BY.values() for name in names}
    appearance = {f"appearance.{name}" for name in AppearanceSettings.model_fields}
    faults = {f"transforms.{fault.name}" for fault in (Blur, *Fault.__subclasses__())}
    of_scene_files = {"appearance.objects", "appearance.lights"}
    assert (appearance - of_scene_files) | faults <= named


def test_impossible_strengths_are_left_out():
    """With dead rows alone even the oracle, which knows visible cubes only, finds no cube."""
    dark = dataclasses.replace(AXES["dead_rows"], strengths=(5.0, 5.0, 5.0, 5.0, 0.0))
    policies = {"ahead": subject(Blind(0), task=AHEAD), "left": subject(Blind(1), task=AHEAD)}
    evaluator = PairedEvaluator(policies["ahead"], 3)
    rates = compare(evaluator, policies, [AXES["blur"], dark])
    evaluator.close()
    assert rates["ahead"] == {PLAIN: 1.0, "blur": 1.0, "dead_rows": 1.0}
    assert rates["left"] == {PLAIN: 0.0, "blur": 0.0, "dead_rows": 0.0}


def test_means_by_kind_of_shift():
    rates = {PLAIN: 1.0, "sun": 0.5, "brightness": 1.0, "fog": 0.25}
    assert by_kind(rates, ["light", "fog", "sensor"]) == {"light": 0.75, "fog": 0.25}


@pytest.mark.parametrize("is_reversed", [False, True])
def test_ranges_are_accepted_and_values_beyond_them_are_not(setup, monkeypatch, is_reversed):
    made = shifts_of(drone_rl.load_policy(domain_axes.POLICY), axes=tuple(AXES))

    def check(policy, path, settings, seed):
        ((name, need),) = json.loads(path.read_text()).items()
        is_within = need == made.requirements()[name]
        return SimpleNamespace(is_covered=is_within != is_reversed)

    monkeypatch.setattr(domain_axes, "shifts", lambda *args, **options: made)
    monkeypatch.setattr(domain_axes, "check_required", check)
    figures = domain_axes.bench_domain_axes(setup)
    assert figures["domain_axes"] == len(AXES)
    assert figures["domain_axes_right"] == (0 if is_reversed else len(AXES))
