"""`drone-rl explain`."""

import logging
import re
from pathlib import Path
from typing import Any

import torch
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig, ListConfig

from drone_rl.cli.build import find_checkpoint, load_trained, plain, policy_is_checkpoint
from drone_rl.explain.explanation import explain_policy
from drone_rl.explain.settings import ExplainSettings
from drone_rl.report import write_report
from drone_rl.utils.errors import InputError
from drone_rl.utils.provenance import provenance
from drone_rl.verdicts.kinds import Kind

prepare = policy_is_checkpoint
_log = logging.getLogger(__name__)


def run(config: DictConfig) -> tuple[int, str]:
    """Explains policies and reports on them. Returns the exit status and the report's path."""
    torch.set_num_threads(1)  # the same file on every machine; pictures this small gain nothing
    which = config.checkpoint
    names = list(which) if isinstance(which, ListConfig) else [which]
    if not names or len(set(names)) < len(names):
        raise InputError(f"policy={names} must name one or more policies, each once")
    kinds = [kind.value for kind in Kind]
    if config.require is not None and config.require not in kinds:
        raise InputError(f"require={config.require} is unknown; choose from: {', '.join(kinds)}")
    settings = ExplainSettings(
        **{k: config[k] for k in ExplainSettings.__dataclass_fields__ if k in config}
    )
    if config.num_envs < 1:
        raise InputError(f"num_envs={config.num_envs} is out of range; give 1 or more")
    paths = [find_checkpoint(name, config.paths.outputs) for name in names]
    folder = Path(HydraConfig.get().runtime.output_dir)
    found = {}
    for number, (name, path) in enumerate(zip(names, paths, strict=True)):
        found[name] = _explain(config, settings, name, path, folder / f"{number}_{_slug(name)}")
    report = write_report([folder / f"{i}_{_slug(n)}" for i, n in enumerate(names)], folder)
    for name, numbers in found.items():
        verdict = numbers["verdict"]
        certainty = "" if verdict["certain"] else " (not certain)"
        print(f"{name}: {verdict['kind']}{certainty}. {verdict['sentence']}")
    _log.info("report: %s", report)
    refused = [
        n["verdict"]["exit_code"] or 12
        for n in found.values()
        if config.require is not None
        and not (n["verdict"]["certain"] and config.require == n["verdict"]["kind"])
    ]
    return max(refused, default=0), str(report)


def _explain(
    config: DictConfig, settings: ExplainSettings, name: str, path: Path, folder: Path
) -> dict[str, Any]:
    env, actor, state = load_trained(
        path,
        config.num_envs,
        task=plain(config.task),
        seed=config.seed,
        device="cpu",
    )
    origin = {
        "policy": str(path),
        "trained": {
            "description": state["description"],
            "progress": state["progress"],
            "provenance": state["provenance"],
            "command": state.get("command"),
        },
        **provenance(),
    }
    try:
        return explain_policy(
            env,
            actor.module[0].module,
            folder,
            settings,
            name=_title(name, path),
            provenance=origin,
            tell=lambda title: _log.info("%s: %s", name, title),
        )
    finally:
        env.close()


def _title(name: str, path: Path) -> str:
    """What people call the policy: a run is known by its folder."""
    return path.parents[1].name if path.suffix == ".pt" and len(path.parents) > 1 else name


def _slug(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_")[-60:] or "policy"
