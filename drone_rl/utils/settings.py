"""Settings as nested mappings."""

from collections.abc import Iterable, Mapping
from typing import Any

from drone_rl.utils.errors import InputError


def check_same_config(
    saved: Mapping[str, Any], now: Mapping[str, Any], may_change: Iterable[str]
) -> None:
    """Refuses to resume a run under another configuration.

    Args:
        saved: The run's resolved configuration.
        now: The one asked for.
        may_change: Dotted keys, and groups of them, that don't change what is learned.

    Raises:
        InputError: A setting differs; it is named with both values.
    """
    allowed = tuple(may_change)
    before, after = _flatten(saved), _flatten(now)
    for key in sorted(before.keys() | after.keys()):
        if any(key == name or key.startswith(f"{name}.") for name in allowed):
            continue
        old, new = before.get(key, "absent"), after.get(key, "absent")
        if old != new:
            raise InputError(
                f"can't resume with {key}={new}: the run was started with {key}={old}; "
                "leave it as it was or start a new run"
            )


def _flatten(config: Any, prefix: str = "") -> dict[str, Any]:
    if isinstance(config, Mapping) and config:
        return {
            k: v
            for name, value in config.items()
            for k, v in _flatten(value, f"{prefix}{name}.").items()
        }
    return {prefix.removesuffix("."): list(config) if isinstance(config, tuple) else config}
