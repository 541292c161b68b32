"""What a training in worlds that look otherwise gains elsewhere, what it costs, and why.

Each arm of the ablation is trained, and all are flown in the very same worlds. What is measured are
the kinds of shift of which `experiment=robust` touches nothing, as its settings say
(`conditions.touched`), so that nobody chooses them.
"""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from benchmarks.commands import train
from benchmarks.robust_comparison import PLAIN, by_kind, compare, mean, untouched_kinds
from drone_rl.config import MINIMAL
from drone_rl.config.commands import ShiftSettings
from drone_rl.policies.policy import load_policy
from drone_rl.policies.zoo import read_checkpoint
from drone_rl.robustness.axes import AXES, GROUPS, find_axes
from drone_rl.robustness.paired_evaluation import PairedEvaluator, PolicySpec
from drone_rl.robustness.shifts import make_policy_spec
from drone_rl.training.run_folder import last_of, settings_of

DEFAULT, ALL = "default", "all"
ALL_KINDS = "all_kinds"
"""What the mean over all kinds of shift is called: no training can choose what is in it."""
ARMS: Mapping[str, tuple[str, ...]] = {
    DEFAULT: (),
    "none": ("experiment=robust", "appearance=minimal", "transforms=chromaticity"),
    "light and color": ("experiment=robust", "appearance=relit", "transforms=chromaticity"),
    "shift": ("experiment=robust", "appearance=minimal"),
    "all but the shift": ("experiment=robust", "transforms=chromaticity"),
    "all but the camera": ("experiment=robust", "appearance=relit"),
    ALL: ("experiment=robust",),
}
"""Settings of each arm's trainings. Those of the ablation see colors as `ALL` does."""
_AT_ONCE = 2
"""Trainings, of which each takes one thread for the most part."""
_BRIEF = ("trainer.total_frames=1000", "trainer.confirm_episodes=0")


def bench_robust(folder: Path, seeds: Sequence[int], quick: bool) -> dict[str, Any]:
    """Trains each arm from each seed, and flies all of them along all axes.

    Args:
        folder: For the runs.
        seeds: Of the trainings; each gain is of two policies of one seed.
        quick: Whether one seed, trained for a moment, will do.

    Returns:
        In points, means over seeds: "robust_gain_points" on kinds of shift that training does not
        touch, "robust_room_points", all that could be gained there, "robust_gain_all_kinds_points"
        on all kinds, touched or not, and "robust_cost_points" where nothing is different.
        "robust_untouched": the kinds that are not. "robust_arms": by arm, lists over
        seeds of "frames", "plain", "untouched" and each kind's mean share of successful flights.
    """
    seeds, brief = (seeds[:1], _BRIEF) if quick else (seeds, ())
    runs = {
        (arm, seed): folder / f"{arm.replace(' ', '_')}_{seed}" for arm in ARMS for seed in seeds
    }

    def frames_of(one: tuple[str, int]) -> int:
        _, result = train(runs[one], f"seed={one[1]}", *ARMS[one[0]], *brief)
        return result["frames"]

    with ThreadPoolExecutor(_AT_ONCE) as pool:
        frames = dict(zip(runs, pool.map(frames_of, runs), strict=True))
    kinds = untouched_kinds(settings_of(read_checkpoint(last_of(runs[ALL, seeds[0]]))["config"]))
    shares = fly(runs.values(), 5, 1) if quick else fly(runs.values(), 100)
    told = {arm: [_told(shares[runs[arm, s]], kinds) for s in seeds] for arm in ARMS}
    return {
        **_points(told[DEFAULT], told[ALL]),
        "robust_untouched": kinds,
        "robust_arms": {
            arm: {
                "frames": [frames[arm, seed] for seed in seeds],
                **{name: [one[name] for one in told[arm]] for name in told[arm][0]},
            }
            for arm in ARMS
        },
    }


def fly(
    runs: Iterable[Path], episodes: int, strengths: int | None = None
) -> dict[Path, dict[str, float]]:
    """How often policies succeed along every axis, all in the same worlds of minimal look.

    Args:
        runs: Folders of trainings.
        episodes: In each condition.
        strengths: How many of each axis; all by default.
    """
    asked = ShiftSettings(episodes=episodes)
    subjects = {str(run): _in_plain_worlds(run, asked) for run in runs}
    evaluator = PairedEvaluator(next(iter(subjects.values())), episodes, seed=0)
    try:
        axes = [
            dataclasses.replace(axis, strengths=axis.strengths[:strengths])
            for axis in find_axes(None, evaluator.subject)
        ]
        found = compare(evaluator, subjects, axes, possible_share=asked.possible_share)
    finally:
        evaluator.close()
    return {Path(name): shares for name, shares in found.items()}


def _in_plain_worlds(run: Path, asked: ShiftSettings) -> PolicySpec:
    """A policy, wherever it was trained; faults of its camera are none of the flights'."""
    return dataclasses.replace(make_policy_spec(load_policy(run), asked), appearance=MINIMAL)


def _told(shares: Mapping[str, float], untouched: Sequence[str]) -> dict[str, float]:
    kinds = by_kind(shares, GROUPS)
    axes = [s for name, s in shares.items() if name in AXES and AXES[name].group in untouched]
    return {
        PLAIN: shares[PLAIN],
        "untouched": mean([kinds[kind] for kind in untouched]),
        "untouched_axes": mean(axes),
        ALL_KINDS: mean([*kinds.values()]),
        **kinds,
    }


def _points(default: Sequence[Mapping[str, float]], robust: Sequence[Mapping[str, float]]) -> Any:
    """Differences between policies of one seed, and what there was to gain."""
    gains, by_axis, everywhere, losses = (
        [100 * (r[name] - d[name]) for d, r in zip(default, robust, strict=True)]
        for name in ("untouched", "untouched_axes", ALL_KINDS, PLAIN)
    )
    return {
        "robust_gain_points": mean(gains),
        "robust_gain_by_seed": gains,
        "robust_gain_by_axis_points": mean(by_axis),
        "robust_gain_all_kinds_points": mean(everywhere),
        "robust_room_points": 100 * (1.0 - mean([d["untouched"] for d in default])),
        "robust_cost_points": -mean(losses),
    }
