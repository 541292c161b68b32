"""`drone-rl evaluate`."""

import json
import logging
from pathlib import Path
from typing import Any

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from drone_rl.cli.build import (
    build_env,
    find_checkpoint,
    load_trained,
    plain,
    policy_is_checkpoint,
    trained_config,
)
from drone_rl.cli.play import film
from drone_rl.evaluation import Oracle, RandomPolicy, run_episodes, summarise
from drone_rl.utils.errors import InputError
from drone_rl.utils.provenance import provenance
from drone_rl.utils.seeding import Stream, torch_generator

prepare = policy_is_checkpoint
_log = logging.getLogger(__name__)


def run(config: DictConfig) -> tuple[int, float]:
    """Evaluates one checkpoint. Returns the exit status and the share of complete episodes."""
    if config.episodes < 1 or config.num_envs < 1:
        raise InputError(
            f"episodes={config.episodes} and num_envs={config.num_envs} must be 1 or more"
        )
    folder = Path(HydraConfig.get().runtime.output_dir)
    path = find_checkpoint(config.checkpoint, config.paths.outputs)
    task = plain(config.task)
    env, actor, state = load_trained(
        path,
        min(config.num_envs, config.episodes),
        task=task,
        seed=config.seed,
        device=config.device,
    )
    policy = run_episodes(env, actor, config.episodes, greedy=config.greedy)
    env.close()
    results = {"policy": summarise(policy)}
    if config.baselines:
        results |= _baselines(config, trained_config(state, task))
    report = {
        "checkpoint": str(path),
        "greedy": config.greedy,
        "seed": config.seed,
        **results,
        **provenance(),
        "trained": state["progress"],
    }
    (folder / "evaluation.json").write_text(json.dumps(report, indent=2))
    print(table(results))
    _log.info("checkpoint: %s", path)
    _log.info("written: %s", folder / "evaluation.json")
    if config.videos:
        film(config, path, folder / "videos", config.videos)
    return 0, results["policy"]["all_cubes"]["share"]


def table(results: dict[str, dict[str, Any]]) -> str:
    """The figures of several policies side by side, for a terminal."""
    rows = [("", list(results))]
    rows.append(("mean cubes", [f"{r['mean_cubes']:.3f}" for r in results.values()]))
    rows.append(("all cubes", [_share(r["all_cubes"]) for r in results.values()]))
    rows.extend(
        (f"collected {side}", [_share(r["by_side"][side]) for r in results.values()])
        for side in ("left", "ahead", "right")
    )
    for reason in next(iter(results.values()))["end_reason"]:
        label = f"ended: {reason.replace('_', ' ')}"
        rows.append((label, [str(r["end_reason"][reason]) for r in results.values()]))
    rows.append(("mean length", [f"{r['mean_length']:.1f}" for r in results.values()]))
    rows.append(("episodes", [str(r["episodes"]) for r in results.values()]))
    return "\n".join(f"{name:24}" + "".join(f"{v:>26}" for v in values) for name, values in rows)


def _share(value: dict[str, Any]) -> str:
    if value["share"] is None:
        return "none offered"
    return f"{value['share']:.3f} [{value['lower95']:.3f}, {value['upper95']:.3f}]"


def _baselines(config: DictConfig, trained: DictConfig) -> dict[str, dict[str, Any]]:
    """The random policy and the oracle, each in a fresh copy of the policy's worlds."""
    results = {}
    for name in ("random", "oracle"):
        num_envs = min(config.num_envs, config.episodes)
        env = build_env(
            trained,
            num_envs,
            seed=config.seed,
            device=config.device,
            stream=Stream.REPORT,
            pixels=False,
        )
        generator = torch_generator(config.seed, Stream.ACTIONS, device=env.device)
        actor = (
            Oracle(env.base_env.worlds.settings)
            if name == "oracle"
            else RandomPolicy(env.action_spec.space.n, generator)
        )
        results[name] = summarise(run_episodes(env, actor, config.episodes))
        env.close()
    return results
