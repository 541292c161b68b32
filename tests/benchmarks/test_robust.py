"""Figures of the ablation, from given success rates."""

import json

import pytest

from benchmarks import commands, robust
from benchmarks.robust import ARMS, bench_robust, success_rates
from benchmarks.robust_comparison import PLAIN
from drone_rl.config import AppearanceSettings
from drone_rl.config.configuration import as_config
from drone_rl.config.training import TrainSettings
from drone_rl.config.transforms import Gray, Noise, Shift, Standardize
from drone_rl.trust.axes import AXES

APPEARANCE = AppearanceSettings(
    exposure=(0.5, 2.0), fog_visibility=(40.0, 100.0), ground_color=((0, 0, 0), (1, 1, 1))
)


@pytest.fixture
def called(monkeypatch, tmp_path):
    """Replace trainings by a stub; the arm "all" has visual randomization, shift and noise."""
    commands_, arms = [], list(ARMS)

    def call(*command):
        commands_.append(command)
        run = next(c for c in command if "run.dir" in c).split("=", 1)[1]
        (tmp_path / run).mkdir(parents=True)
        arm, seed = run.rsplit("/", 1)[-1].rsplit("_", 1)
        number = [a.replace(" ", "_") for a in arms].index(arm)
        result = {"frames": 10 * number + int(seed)}
        (tmp_path / run / "result.json").write_text(json.dumps(result))

    steps = (Gray(), Noise(), Shift(), Standardize())
    config = as_config(TrainSettings(appearance=APPEARANCE, transforms=steps))
    monkeypatch.setattr(commands, "call", call)
    monkeypatch.setattr(robust, "read_checkpoint", lambda path: {"config": config})
    return commands_


def test_gains_and_costs_by_hand(called, monkeypatch, tmp_path):
    def success_rates(runs, episodes):
        shares = {}
        for run in runs:
            is_all = run.name[:-2] == "all"
            good = 0.5 + 0.1 * int(run.name[-1]) if is_all else 0.4
            plain = 0.98 if is_all else 1.0
            shares[run] = {PLAIN: plain, **dict.fromkeys(AXES, 1.0)}
            shares[run] |= {"camera_height": good, "camera_sideways": good, "distractors": 0.4}
        return shares

    monkeypatch.setattr(robust, "success_rates", success_rates)
    found = bench_robust(tmp_path, [1, 2], quick=False)
    kinds = ["camera position", "field of view", "object size", "distractors", "dynamics"]
    assert found["robust_untouched"] == kinds
    # one of five kinds differs: by 0.2 with seed 1, by 0.3 with seed 2
    assert found["robust_gain_by_seed"] == pytest.approx([100 * 0.2 / 5, 100 * 0.3 / 5])
    assert found["robust_gain_points"] == pytest.approx(5.0)
    # one of all ten kinds differs
    assert found["robust_gain_all_kinds_points"] == pytest.approx(100 * 0.25 / 10)
    # two of seven axes differ
    assert found["robust_gain_by_axis_points"] == pytest.approx(100 * 0.25 * 2 / 7)
    assert found["robust_room_points"] == pytest.approx(100 * 1.2 / 5)
    assert found["robust_cost_points"] == pytest.approx(2.0)
    arms = found["robust_arms"]
    assert list(arms) == list(ARMS) and arms["all"]["frames"] == [61, 62]
    assert arms["all"]["camera position"] == pytest.approx([0.6, 0.7])
    assert arms["none"][PLAIN] == [1.0, 1.0] and arms["none"]["light"] == [1.0, 1.0]
    by_run = {
        next(c for c in command if "run.dir" in c).rsplit("/", 1)[-1]: command for command in called
    }
    assert "experiment=robust" not in by_run["default_1"] and "seed=1" in by_run["default_1"]
    assert {"experiment=robust", "seed=2"} <= set(by_run["all_2"])
    assert {"appearance=minimal", "transforms=chromaticity"} <= set(by_run["none_1"])
    assert {"appearance=relit", "transforms=chromaticity"} <= set(by_run["light_and_color_1"])
    assert "appearance=relit" not in by_run["all_but_the_shift_1"]
    assert len(by_run) == 14


def test_a_quick_benchmark_trains_one_seed_briefly(called, monkeypatch, tmp_path):
    calls = []

    def success_rates(runs, episodes, strengths):
        calls.append((episodes, strengths))
        return {run: {PLAIN: 1.0, **dict.fromkeys(AXES, 1.0)} for run in runs}

    monkeypatch.setattr(robust, "success_rates", success_rates)
    found = bench_robust(tmp_path, [1, 2], quick=True)
    assert len(called) == 7 and all("trainer.total_frames=1000" in c for c in called)
    assert calls == [(5, 1)] and found["robust_gain_points"] == 0.0


def test_policies_are_evaluated_with_minimal_appearance(monkeypatch, tmp_path):
    seen = {}

    def compare(evaluator, subjects, axes, **how):
        seen.update(subjects)
        return {name: {PLAIN: 1.0} for name in subjects}

    monkeypatch.setattr(robust, "compare", compare)
    from drone_rl.policies.policy import load_policy

    found = success_rates([load_policy("good").path, load_policy("poor").path], 2)
    assert [shares[PLAIN] for shares in found.values()] == [1.0, 1.0]
    assert all(subject.appearance.is_minimal for subject in seen.values())
