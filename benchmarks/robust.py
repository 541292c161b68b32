"""Ablation of `experiment=robust`: gain under new kinds of shift, and cost without shift.

Each arm of the ablation is trained, and all policies are evaluated in the same environments. The
kinds of shift that are new to `experiment=robust` follow from its settings (`untouched_kinds`), so
they are not selected by hand.
"""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.commands import train
from benchmarks.robust_comparison import PLAIN, by_kind, compare, mean, untouched_kinds
from drone_rl.config import MINIMAL
from drone_rl.config.commands import ShiftSettings
from drone_rl.policies.policy import load_policy
from drone_rl.policies.zoo import read_checkpoint
from drone_rl.training.run_folder import settings_of
from drone_rl.trust.axes import AXES, GROUPS, find_axes
from drone_rl.trust.paired_evaluation import EvaluatedPolicy, PairedEvaluator
from drone_rl.utils.files import last_of

DEFAULT, ALL = "default", "all"
ALL_KINDS = "all_kinds"
"""Key of the mean over all kinds of shift, which does not depend on a training."""
ARMS: Mapping[str, tuple[str, ...]] = {
    DEFAULT: (),
    "none": ("experiment=robust", "appearance=minimal", "transforms=chromaticity"),
    "light and color": ("experiment=robust", "appearance=relit", "transforms=chromaticity"),
    "shift": ("experiment=robust", "appearance=minimal"),
    "all but the shift": ("experiment=robust", "transforms=chromaticity"),
    "all but the camera": ("experiment=robust", "appearance=relit"),
    ALL: ("experiment=robust",),
}
"""Settings of each arm's trainings. All arms but the default have the color transform of `ALL`."""
_PARALLEL = 2
"""Number of parallel trainings; each uses mainly one thread."""
_BRIEF = ("trainer.total_frames=1000", "trainer.confirm_episodes=0")


def bench_robust(setup: Setup) -> dict[str, Any]:
    """Train each arm from each seed and evaluate all policies along all axes.

    Returns:
        In percentage points, means over seeds: "robust_gain_points" under new kinds of shift,
        "robust_room_points", the largest possible gain there, "robust_gain_all_kinds_points" under
        all kinds, and "robust_cost_points" without shift. "robust_untouched": the new kinds.
        "robust_arms": by arm, lists over seeds of "frames", "plain", "untouched" and the mean
        success rate under each kind.
    """
    folder = setup.runs / "robust"
    seeds, brief = setup.seeds[:3], _BRIEF if setup.quick else ()
    runs = {
        (arm, seed): folder / f"{arm.replace(' ', '_')}_{seed}" for arm in ARMS for seed in seeds
    }

    def train_run(key: tuple[str, int]) -> int:
        _, result = train(runs[key], f"seed={key[1]}", *ARMS[key[0]], *brief)
        return result.frames

    with ThreadPoolExecutor(_PARALLEL) as pool:
        frames = dict(zip(runs, pool.map(train_run, runs), strict=True))
    kinds = untouched_kinds(settings_of(read_checkpoint(last_of(runs[ALL, seeds[0]])).config))
    shares = success_rates(runs.values(), *((5, 1) if setup.quick else (100,)))
    rows = {arm: [_row(shares[runs[arm, s]], kinds) for s in seeds] for arm in ARMS}
    return {
        **_points(rows[DEFAULT], rows[ALL]),
        "robust_untouched": kinds,
        "robust_arms": {
            arm: {
                "frames": [frames[arm, seed] for seed in seeds],
                **{name: [row[name] for row in rows[arm]] for name in rows[arm][0]},
            }
            for arm in ARMS
        },
    }


def success_rates(
    runs: Iterable[Path], episodes: int, strengths: int | None = None
) -> dict[Path, dict[str, float]]:
    """Return the success rates of policies along every axis, in environments of minimal appearance.

    Args:
        runs: Folders of trainings.
        episodes: Episodes under each condition.
        strengths: Number of strengths of each axis; all by default.
    """
    settings = ShiftSettings(episodes=episodes)
    subjects = {str(run): _plain_spec(run, settings) for run in runs}
    evaluator = PairedEvaluator(next(iter(subjects.values())), episodes, seed=0)
    try:
        axes = [
            dataclasses.replace(axis, strengths=axis.strengths[:strengths])
            for axis in find_axes(None, evaluator.subject)
        ]
        rates = compare(evaluator, subjects, axes, possible_share=settings.possible_share)
    finally:
        evaluator.close()
    return {Path(name): shares for name, shares in rates.items()}


def _plain_spec(run: Path, settings: ShiftSettings) -> EvaluatedPolicy:
    """Return a policy with minimal appearance and without the camera faults of its training."""
    subject = EvaluatedPolicy.of(
        load_policy(run), device=settings.device, renderer=settings.renderer
    )
    return dataclasses.replace(subject, appearance=MINIMAL)


def _row(shares: Mapping[str, float], untouched: Sequence[str]) -> dict[str, float]:
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
    """Return differences between policies of the same seed, in percentage points."""
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
