"""Explanations and verdicts: how long they take, and whether the verdicts are right."""

import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from drone_rl.bench.commands import call, watch
from drone_rl.bench.parts import default_pipeline
from drone_rl.explain import tsne
from drone_rl.explain.hooks import feature_layer
from drone_rl.explain.recording import record
from drone_rl.explain.response import response_map
from drone_rl.explain.scenes import Scenes

SHIPPED = {"good": "good", "poor": "poor", "right_and_forward": "one-sided (right)"}
"""Policies that travel with the package, and what they are."""
BASELINES = {"random": "poor", "oracle": "good", "forward": "poor", "left": "poor", "right": "poor"}
"""Policies that are no network, and what they are."""
RATES = (1e-3, 2e-3, 7e-3, 1e-2)
SEEDS = (1, 2, 3)
OUTCOMES = (0, 10, 11, 12, 13)
"""Exit statuses of a verdict."""


def bench_explain(folder: Path, quick: bool) -> dict[str, Any]:
    """The whole of `drone-rl explain policy=good`, and its dearest parts."""
    run = folder / "explain"
    frames = 100 if quick else 600
    small = ["frames=100", "episodes=20", "perplexity=10"] if quick else []
    seconds, peak = watch("explain", "policy=good", f"hydra.run.dir={run}", *small)
    numbers = json.loads((run / "0_good" / "explanation.json").read_text())
    reached = numbers["class_model"]["logit"]["probabilities"]
    return {
        "explain_s": seconds,
        "explain_peak_memory_mib": peak,
        "explain_frames": frames,
        "class_model_probability": reached,
        "report_mib": (run / "report.html").stat().st_size / 2**20,
        **_parts(1000 if quick else 10_000),
    }


def _parts(many: int) -> dict[str, Any]:
    env, actor, network = default_pipeline(256)
    layer = feature_layer(network)
    features = record(env, actor, network, many, layers=(layer,)).features[layer]
    results = {}
    for count in (600, many):
        begin = time.perf_counter()
        tsne.embed(features[:count])
        results[f"tsne_{count}_s"] = time.perf_counter() - begin
    scenes = Scenes(env)
    response_map(scenes, network, num_lateral=3, num_forward=3)
    begin = time.perf_counter()
    response_map(scenes, network)
    results["response_map_s"] = time.perf_counter() - begin
    env.close()
    return results


def bench_verdicts(folder: Path, device: str, quick: bool) -> dict[str, Any]:
    """Verdicts of 400 episodes against what 2,000 others show, on policies of many kinds.

    Besides those that travel with the package and the baselines, whose kind is known, policies are
    trained at rates from low to far too high; their kind is the rule's on 2,000 episodes of other
    worlds.
    """
    wanted = dict(SHIPPED) | BASELINES
    judged = {name: _verdict(folder, name, name, device, quick) for name in wanted}
    runs = [] if quick else [(rate, seed) for rate in RATES for seed in SEEDS]
    for rate, seed in runs:
        name = f"lr={rate:g} seed={seed}"
        run = folder / f"verdict_{rate:g}_{seed}"
        settings = ["experiment=high_rate", f"optimiser.lr={rate:g}", f"seed={seed}", "logger=csv"]
        call("train", *settings, f"device={device}", f"hydra.run.dir={run}")
        policy = str(run / "checkpoints" / "last.pt")
        judged[name] = _verdict(folder, f"{run.name}_400", policy, device, quick)
        wanted[name] = _verdict(folder, f"{run.name}_2000", policy, device, quick, 2000)
    right = [judged[name] == kind for name, kind in wanted.items()]
    return {
        "verdicts_right": int(np.sum(right)),
        "verdicts_total": len(right),
        "verdicts": {name: [judged[name], kind] for name, kind in wanted.items()},
    }


def _verdict(
    folder: Path, name: str, policy: str, device: str, quick: bool, episodes: int = 400
) -> str:
    """The verdict on a policy; the long one is given on worlds that the short one never saw."""
    run = folder / f"judge_{name}"
    seed = 1 if episodes > 400 else 0
    call(
        "verdict",
        f"policy={policy}",
        f"episodes={100 if quick else episodes}",
        f"seed={seed}",
        f"device={device}",
        f"hydra.run.dir={run}",
        statuses=OUTCOMES,
    )
    return json.loads((run / "verdict.json").read_text())["kind"]
