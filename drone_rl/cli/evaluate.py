"""`drone-rl evaluate`."""

import json
import logging
from pathlib import Path
from typing import Any

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from drone_rl.cli.build import find_checkpoint, load_trained, plain, policy_is_checkpoint
from drone_rl.cli.play import film
from drone_rl.cli.verdict import check_episodes
from drone_rl.evaluation import run_episodes, summarise
from drone_rl.utils.provenance import provenance
from drone_rl.verdicts.luck import fly_baselines

prepare = policy_is_checkpoint
_log = logging.getLogger(__name__)


def run(config: DictConfig) -> tuple[int, float]:
    """Evaluates one checkpoint. Returns the exit status and the share of complete episodes."""
    check_episodes(config)
    folder = Path(HydraConfig.get().runtime.output_dir)
    path = find_checkpoint(config.checkpoint, config.paths.outputs)
    results, trained = _fly(config, path)
    report = {
        "checkpoint": str(path),
        "seed": config.seed,
        **results,
        **provenance(),
        "trained": trained,
    }
    (folder / "evaluation.json").write_text(json.dumps(report, indent=2))
    print(table(results))
    _log.info("checkpoint: %s", path)
    _log.info("written: %s", folder / "evaluation.json")
    if config.videos:
        film(config, path, folder / "videos", config.videos)
    return 0, results["greedy"]["success"]["share"]


def _fly(config: DictConfig, path: Path) -> tuple[dict[str, dict[str, Any]], dict[str, Any]]:
    """Figures of the policy, greedy and sampled, and of the baselines; how it was trained."""
    env, actor, state = load_trained(
        path,
        min(config.num_envs, config.episodes),
        task=plain(config.task),
        seed=config.seed,
        device=config.device,
    )
    worlds, task = env.base_env.state_dict(), env.base_env.worlds.task.settings
    flown = {"greedy": run_episodes(env, actor, config.episodes)}
    env.base_env.load_state_dict(worlds)
    flown["sampled"] = run_episodes(env, actor, config.episodes, greedy=False)
    if config.baselines:
        flown |= fly_baselines(env.batch_size[0], task, worlds, config.episodes, config.device)
    env.close()
    return {name: summarise(episodes) for name, episodes in flown.items()}, state["progress"]


def table(results: dict[str, dict[str, Any]]) -> str:
    """The figures of several policies side by side, for a terminal.

    Args:
        results: As `summarise` returns them, by the policies' names.
    """
    rows = [("", list(results))]
    rows.append(("all cubes", [_interval(r["success"], "share") for r in results.values()]))
    rows.append(("mean cubes", [f"{r['mean_cubes']:.3f}" for r in results.values()]))
    rows.extend(
        (f"share {side}", [_interval(r["shares"][side], "mean") for r in results.values()])
        for side in ("all", "left", "ahead", "right")
    )
    rows.append(("never reached", [f"{r['never_reached']['mean']:.3f}" for r in results.values()]))
    for reason in next(iter(results.values()))["ends"]:
        label = f"ended: {reason.replace('_', ' ')}"
        rows.append((label, [str(r["ends"][reason]["successes"]) for r in results.values()]))
    rows.append(("mean length", [f"{r['mean_length']:.1f}" for r in results.values()]))
    rows.append(("episodes", [str(r["episodes"]) for r in results.values()]))
    return "\n".join(f"{name:21}" + "".join(f"{v:>18}" for v in values) for name, values in rows)


def _interval(found: dict[str, Any], key: str) -> str:
    if found[key] is None:
        return "not offered"
    share, low, high = (f"{100 * found[k]:.3g}" for k in (key, "lower95", "upper95"))
    return f"{share}% [{low}, {high}]"
