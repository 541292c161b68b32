"""From a training's settings to a description, for new trainings and for files from before it.

Settings name classes (`_target_`); a file is never believed that much. The names are looked up in
the registered ones, letter by letter, and nothing is imported.
"""

import inspect
from collections.abc import Mapping
from typing import Any

from drone_rl.policies.zoo.description import FORMAT, FORMAT_VERSION, PolicyDescription, parse
from drone_rl.policies.zoo.registry import (
    ENTRY_POINTS,
    NETWORKS,
    TRANSFORMS,
    Part,
    load_entry_points,
)
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import as_mapping, shown

_SETTINGS = {
    "task": "drone_rl.config.TaskSettings",
    "camera": "drone_rl.config.CameraSettings",
}


def describe(config: Any) -> PolicyDescription:
    """The policy that a training's settings ask for.

    Args:
        config: Plain settings with "task", "camera", "transforms" and "network", which until
            version 0.1 was called "policy".

    Raises:
        InputError: A part isn't registered, or a value is out of bounds.
    """
    config = as_mapping(config, "config")
    network = "policy" if "policy" in config else "network"
    for key in ("task", "camera", "transforms", network):
        if key not in config:
            raise InputError(f"config.{key} is missing; use a file that drone-rl train wrote")
    transforms = as_mapping(config["transforms"], "transforms")
    parts = ("appearance", "dynamics", "actions")
    special = {name: config[name] for name in parts if config.get(name) is not None}
    return parse(
        {
            **special,
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            **{key: _values(config[key], key, target) for key, target in _SETTINGS.items()},
            "transforms": [
                _choice(TRANSFORMS, value, f"transforms.{shown(key)}")
                for key, value in transforms.items()
                if value is not None
            ],
            "network": _choice(NETWORKS, config[network], network),
        }
    )


def _values(settings: Any, where: str, target: str) -> dict[str, Any]:
    given = dict(as_mapping(settings, where))
    if given.pop("_target_", target) != target:
        raise InputError(
            f"{where}._target_={shown(settings['_target_'])} is not {target}; leave it as it is"
        )
    return given


def _choice(parts: Mapping[str, Part], settings: Any, where: str) -> dict[str, Any]:
    """A registered name and its values, from settings of that part."""
    given = dict(as_mapping(settings, where))
    target = given.pop("_target_", None)
    name = _name(parts, target)
    if name is None:
        load_entry_points()
        name = _name(parts, target)
    if name is None:
        kind = "network" if parts is NETWORKS else "transform"
        raise InputError(
            f"{where}._target_={shown(target)} is not registered, so no file could describe it; "
            f"call drone_rl.policies.zoo.register_{kind} in a module that a package names in the "
            f"entry point group {ENTRY_POINTS}"
        )
    part = parts[name]
    if parts is NETWORKS and given.pop("_partial_", True) is not True:
        raise InputError(f"{where}._partial_ must be true; the network is sized by its pictures")
    for key, value in part.fixed.items():
        if given.pop(key, value) != value:
            raise InputError(f"{where}.{key} must be {value}; no file could describe another")
    return {"name": name, **_defaults(part), **given}


def _name(parts: Mapping[str, Part], target: Any) -> str | None:
    return next((name for name, part in parts.items() if target in part.targets), None)


def _defaults(part: Part) -> dict[str, Any]:
    """The values that a constructor has for parameters which settings leave out."""
    return {
        key: parameter.default
        for key, parameter in inspect.signature(part.make).parameters.items()
        if key in part.parameters.fields and parameter.default is not inspect.Parameter.empty
    }
