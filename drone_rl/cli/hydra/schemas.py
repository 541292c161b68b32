"""Types for Hydra, made from the settings: what is misspelt or mistyped dies when it composes."""

import dataclasses
import functools
import types
import typing
from typing import Any

from hydra.core.config_store import ConfigStore
from omegaconf import MISSING

from drone_rl.config import (
    TASKS,
    ActionSettings,
    AppearanceSettings,
    BaseTaskSettings,
    CameraSettings,
    DynamicsSettings,
    TaskSettings,
)
from drone_rl.config.commands import PathsSettings
from drone_rl.config.configuration import Changes, ChangesOfTask, Variant
from drone_rl.config.learning import Collector, Objective, Optimiser, Returns, Scheduler
from drone_rl.config.networks import Network
from drone_rl.config.training import Logger, TrainerSettings
from drone_rl.config.transforms import Transform
from drone_rl.config.verification import ProvableSettings
from drone_rl.utils.settings import Settings, kinds_of, snake_case, types_of

GROUPS: dict[str, type[Settings]] = {
    "appearance": AppearanceSettings,
    "dynamics": DynamicsSettings,
    "actions": ActionSettings,
    "camera": CameraSettings,
    "trainer": TrainerSettings,
    "provable": ProvableSettings,
    "paths": PathsSettings,
}
"""Groups whose files start from the schema `base_<group>`."""
_CHANGED = (DynamicsSettings,)
"""Settings of a policy that commands may change: a file of that group gives all of them, so its
schema is one of changes, too."""
PARTS: dict[str, type[Variant]] = {
    "network": Network,
    "returns": Returns,
    "objective": Objective,
    "optimiser": Optimiser,
    "scheduler": Scheduler,
    "collector": Collector,
}
"""Groups whose files start from the schema of a variant, `base_<its name>`."""
SEVERAL: dict[str, type[Variant]] = {"transforms": Transform, "logger": Logger}
"""Groups whose files name several variants, each by `schema@<name>: <the variant's name>`."""


def register_schemas(**commands: type[Settings]) -> None:
    """Tells Hydra the schemas; called before it composes.

    Args:
        commands: The settings of each command, by the name of its file.
    """
    store = ConfigStore.instance()
    for task in TASKS.values():
        name = "base_task" if task is TaskSettings else f"base_{task.name}"
        store.store(group="task", name=name, node=schema_of(task))
    for group, settings in GROUPS.items():
        store.store(group=group, name=f"base_{group}", node=schema_of(settings))
    for group, part in PARTS.items():
        for variant in part.variants():
            store.store(group=group, name=f"base_{snake_case(variant)}", node=schema_of(variant))
    for group, part in SEVERAL.items():
        for variant in part.variants():
            name = snake_case(variant)
            store.store(group=f"{group}/schema", name=name, node=schema_of(variant))
    for command, settings in commands.items():
        store.store(name=f"base_{command}", node=schema_of(settings))


def schema_of(cls: type[Settings]) -> type:
    """A dataclass of the same fields with no defaults, for those are in conf/."""
    fields = [(name, *_field(cls, name)) for name in types_of(cls)]
    bases = (_changes_of(cls),) if cls in _CHANGED else ()
    return dataclasses.make_dataclass(f"{cls.__name__}Schema", [*_named(cls), *fields], bases=bases)


@functools.cache
def _changes_of(cls: type[Settings]) -> type:
    """A dataclass of the same fields, of which none need be given."""
    fields = [(n, _simple(h) | None, None) for n, h in types_of(cls).items()]
    return dataclasses.make_dataclass(f"{cls.__name__}Changes", fields)


def _named(cls: type[Settings]) -> list[tuple[str, Any, Any]]:
    """What says which variant or task it is."""
    if issubclass(cls, Variant):
        return [("_target_", str, cls.target)]
    if issubclass(cls, BaseTaskSettings) and cls is not TaskSettings:
        return [("name", str, cls.name)]
    return []


def _field(cls: type[Settings], name: str) -> tuple[Any, Any]:
    """A type that Hydra knows, and the value before any file gives one."""
    kind, hint = kinds_of(cls)[name], types_of(cls)[name]
    if isinstance(kind, ChangesOfTask):
        changes = [(n, _simple(h) | None, None) for n, h in kind.types.items()]
        schema = dataclasses.make_dataclass("TaskChanges", changes)
        return schema, dataclasses.field(default_factory=schema)
    if isinstance(kind, Changes):
        schema = _changes_of(kind.of)
        return schema, dataclasses.field(default_factory=schema)
    return _simple(hint), MISSING


def _simple(hint: Any) -> Any:
    """The type itself if it is made of numbers, texts and truth values, else any."""
    arguments = typing.get_args(hint)
    if typing.get_origin(hint) is tuple:
        return hint if set(arguments) <= {int, float, str, ...} else Any
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        inner = [argument for argument in arguments if argument is not types.NoneType]
        return hint if len(inner) == 1 and _simple(inner[0]) is not Any else Any
    return hint if hint in (int, float, str, bool) else Any
