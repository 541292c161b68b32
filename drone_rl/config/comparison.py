"""Whether what is gone on with is still the same, whichever version began it."""

from collections.abc import Iterable, Mapping
from typing import Any

from drone_rl.config import COMPUTER_VISION, MINIMAL, MOVES_SETTINGS
from drone_rl.utils.errors import InputError

_MOVED = {
    "drone_rl.cli.build.threaded_collector": "drone_rl.training.build_collector.threaded_collector",
    "drone_rl.cli.build.ray_collector": "drone_rl.training.build_collector.ray_collector",
}


def modern(config: Mapping[str, Any]) -> dict[str, Any]:
    """A training's configuration in today's words.

    Until version 0.1 the group of networks was called policy, the collector's maker stood under
    "make", and settings told Hydra how to make things (`_partial_`, and `_target_` of task and
    camera). Until 0.2 a training learned on as many threads as it collected on, took its running
    mean at its word, and took every step and gradient in Python; worlds had one look,
    and drones moved in computer-vision mode alone.

    Args:
        config: Of any version, as it stands in a checkpoint or a sweep's folder.
    """
    groups = {name: _without(group, "_partial_") for name, group in config.items()}
    if "policy" in groups:
        groups["network"] = groups.pop("policy")
    changes = {
        "task": lambda task: _without(task, "_target_"),
        "camera": lambda camera: _without(camera, "_target_"),
        "collector": _collector,
        "transforms": _transforms,
    }
    groups = {name: changes.get(name, lambda group: group)(group) for name, group in groups.items()}
    if {"trainer", "collector"} <= groups.keys():
        groups["trainer"] = _trainer(groups["trainer"], groups["collector"])
    if "task" in groups:
        groups.setdefault("appearance", MINIMAL.values())
        groups.setdefault("dynamics", COMPUTER_VISION.values())
        groups.setdefault("actions", MOVES_SETTINGS.values())
    return groups


def check_same_config(
    saved: Mapping[str, Any], now: Mapping[str, Any], may_change: Iterable[str]
) -> None:
    """Refuses to go on under another configuration.

    Args:
        saved: The configuration that it was begun with, of any version.
        now: The one asked for.
        may_change: Dotted keys, and groups of them, that don't change what is learned.

    Raises:
        InputError: A setting differs; it is named with both values.
    """
    allowed = tuple(may_change)
    before, after = _flatten(modern(saved)), _flatten(modern(now))
    for key in sorted(before.keys() | after.keys()):
        if any(key == name or key.startswith(f"{name}.") for name in allowed):
            continue
        old, new = before.get(key, "absent"), after.get(key, "absent")
        if old != new:
            raise InputError(
                f"can't resume with {key}={new}: the run was started with {key}={old}; "
                "leave it as it was or start a new run"
            )


def _without(group: Any, *names: str) -> Any:
    if not isinstance(group, Mapping):
        return group
    return {name: value for name, value in group.items() if name not in names}


def _collector(group: Any) -> Any:
    if not isinstance(group, Mapping):
        return group
    maker = group.get("make", group.get("_target_"))
    target = _MOVED.get(maker, maker) if isinstance(maker, str) else maker
    made = {**_without(group, "make"), **({} if target is None else {"_target_": target})}
    return {"compiled": False, **made} if target in _MOVED.values() else made


def _trainer(group: Any, collector: Any) -> Any:
    if not (isinstance(group, Mapping) and isinstance(collector, Mapping)):
        return group
    flights = {"confirm_episodes": 0, "confirm_share": 1.0}
    learning = {"num_threads": collector.get("num_threads", 1), "compiled": False}
    return {**learning, **flights, **group}


def _transforms(group: Any) -> Any:
    """Stacked frames had arguments that are always the same."""
    if not isinstance(group, Mapping):
        return group
    stacks = {name for name, step in group.items() if _makes(step, "CatFrames")}
    return {n: _without(s, "dim", "in_keys") if n in stacks else s for n, s in group.items()}


def _makes(step: Any, name: str) -> bool:
    target = step.get("_target_") if isinstance(step, Mapping) else None
    return isinstance(target, str) and target.endswith(f".{name}")


def _flatten(config: Any, prefix: str = "") -> dict[str, Any]:
    if isinstance(config, Mapping) and config:
        return {
            k: v
            for name, value in config.items()
            for k, v in _flatten(value, f"{prefix}{name}.").items()
        }
    return {prefix.removesuffix("."): list(config) if isinstance(config, tuple) else config}
