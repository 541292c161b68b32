"""Time and memory of explanations."""

import json
import time
from typing import Any

from benchmarks.benchmark import Setup
from benchmarks.commands import watch
from benchmarks.pipeline import default_pipeline
from drone_rl.explanations import embedding
from drone_rl.explanations.hooks import feature_layer
from drone_rl.explanations.response import response_map
from drone_rl.explanations.rollouts import collect, render_frames, select_frames
from drone_rl.explanations.scenes import Scenes


def bench_explain(setup: Setup) -> dict[str, Any]:
    """Measure `drone-rl explain policy=good` and its slowest parts."""
    folder = setup.runs
    run = folder / "explain"
    frames = 100 if setup.quick else 600
    small = ["frames=100", "episodes=20", "perplexity=10"] if setup.quick else []
    seconds, peak = watch("explain", "policy=good", "seed=0", f"hydra.run.dir={run}", *small)
    numbers = json.loads((run / "0_good" / "explanation.json").read_text())
    reached = numbers["class_model"]["logit"]["probabilities"]
    return {
        "explain_s": seconds,
        "explain_peak_memory_mib": peak,
        "explain_frames": frames,
        "class_model_probability": reached,
        "report_mib": (run / "report.html").stat().st_size / 2**20,
        **_parts(1000 if setup.quick else 10_000),
    }


def _parts(many: int) -> dict[str, Any]:
    env, actor, network = default_pipeline(256)
    layer = feature_layer(network)
    assert layer is not None  # the default's network has several
    scenes = Scenes(env)
    flights = collect(env, actor, num_episodes=1, num_frames=many)
    rows = select_frames(flights.episode, many)
    frames = render_frames(flights, rows, scenes, network, (layer,))
    features = frames.arrays[f"features/{layer}"]
    results = {}
    for count in (600, many):
        begin = time.perf_counter()
        embedding.embed(features[:count])
        results[f"tsne_{count}_s"] = time.perf_counter() - begin
    response_map(scenes, network, num_lateral=3, num_forward=3)
    begin = time.perf_counter()
    response_map(scenes, network)
    results["response_map_s"] = time.perf_counter() - begin
    env.close()
    return results
