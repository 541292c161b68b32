"""Collecting rates with several inputs, stacked frames and velocities."""

from collections.abc import Callable
from functools import partial
from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.pipeline import paired
from drone_rl.config import ActionSettings, CameraSettings
from drone_rl.config.inputs import DepthImage, Goal
from drone_rl.config.learning import Episodes
from drone_rl.config.training import TrainSettings
from drone_rl.config.transforms import Gray, Stack, Standardize
from drone_rl.training.train import make_collector

SIZE = (64, 64)
"""Height and width of the images."""


def bench_input_rates(setup: Setup) -> dict[str, float]:
    """Compare the rates of complete episodes of the default task.

    Returns:
        "inputs_over_gray": that of depth and goal over gray alone, which the fused kernel
        collects; "stack_over_one": that of two stacked frames over one; "velocity_over_moves".
    """
    camera = CameraSettings(height=SIZE[0], width=SIZE[1])
    plain = (Gray(), Standardize())
    pixels = {"camera": camera, "transforms": plain}
    pairs: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
        "inputs_over_gray": ({"inputs": {"depth": DepthImage(size=SIZE), "goal": Goal()}}, pixels),
        "stack_over_one": ({**pixels, "transforms": (*plain, Stack(N=2))}, pixels),
        "velocity_over_moves": ({**pixels, "actions": ActionSettings(kind="velocity")}, pixels),
    }
    return {name: _ratio(*pair, setup.quick) for name, pair in pairs.items()}


def _ratio(first: dict[str, Any], second: dict[str, Any], quick: bool) -> float:
    works = [_collecting(settings) for settings in (first, second)]
    for work in works:  # compiles
        work()
    seconds, rounds = (0.5, 3) if quick else (2.0, 10)
    return paired(*works, seconds=seconds, rounds=rounds)[2]


def _collecting(settings: dict[str, Any]) -> Callable[[], int]:
    collector = make_collector(TrainSettings(**settings, collector=Episodes(num_envs=64))).collector
    return partial(lambda made: next(iter(made)).numel(), collector)
