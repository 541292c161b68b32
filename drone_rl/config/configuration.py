"""Settings as nested plain data and back, as in checkpoints and in what Hydra composes."""

import dataclasses
import importlib
import types
import typing
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, ClassVar, Self, TypeVar

from drone_rl.config import (
    COMPUTER_VISION,
    MINIMAL,
    MOVES_SETTINGS,
    TASKS,
    BaseTaskSettings,
    DynamicsSettings,
    TaskSettings,
    named_settings,
)
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import as_mapping, shown
from drone_rl.utils.settings import (
    Settings,
    below,
    check_names,
    kinds_of,
    plain,
    snake_case,
    types_of,
)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Variant(Settings):
    """Settings of one way to make a part.

    Subclasses of a part's own class are its variants, which differ in what they make and need.
    """

    target: ClassVar[str]
    """Where that which makes it is to be imported from."""
    is_known: ClassVar[bool] = True
    """Whether its settings are known here, and not to the user alone."""

    def make(self, *args: Any, **kwargs: Any) -> Any:
        """Makes the part.

        Args:
            args: What is not known before there are other parts.
            kwargs: The same, by name.

        Raises:
            InputError: It doesn't exist, or does not take these settings.
        """
        return locate(self.target)(*args, **self.values(), **kwargs)

    @property
    def name(self) -> str:
        """What files in conf/ call it."""
        return snake_case(type(self))

    @classmethod
    def variants(cls) -> tuple[type[Self], ...]:
        """All subclasses that make something."""
        found = []
        for sub in cls.__subclasses__():
            found += [sub] if "target" in vars(sub) and sub.is_known else []
            found += sub.variants()
        return tuple(found)


def locate(target: str) -> Any:
    """What a dotted name stands for.

    Raises:
        InputError: There is no such thing.
    """
    module, _, name = target.rpartition(".")
    try:
        return getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise InputError(f"_target_={target} can't be imported ({error}); give another") from error


S = TypeVar("S", bound=Settings)


def as_config(settings: Settings) -> dict[str, Any]:
    """Settings as plain data; a variant says by "_target_" what makes it, several are named.

    A task says by "name" which it is, see `BaseTaskSettings.values`.
    """
    if isinstance(settings, BaseTaskSettings):
        return settings.values()
    target = {"_target_": settings.target} if isinstance(settings, Variant) else {}
    if isinstance(settings, Variant) and not settings.is_known:
        return {**target, **settings.values()}
    hints = types_of(type(settings))
    return {**target, **{n: _as_config(hint, getattr(settings, n)) for n, hint in hints.items()}}


def from_config(cls: type[S], config: Any, where: str = "") -> S:
    """Settings out of plain data; what is not given keeps its default.

    Args:
        cls: What they are.
        config: A mapping, with further ones of the settings in settings.
        where: Its name, for people; empty at the root.

    Raises:
        InputError: A name is unknown or a value unusable; the message begins with its place.
    """
    given = as_mapping(config, where or "settings")
    prefix = f"{where}." if where else ""
    check_names(cls, given)
    values = {name: _read(types_of(cls)[name], given[name], prefix + name) for name in given}
    if not where:
        return cls(**values)
    with below(where):
        return cls(**values)


def variant_of(part: type[Variant], config: Any, where: str) -> Variant:
    """A variant out of plain data.

    Args:
        part: What it is a variant of.
        config: "_target_" and values.
        where: Its name, for people.

    Returns:
        One of the part's own variants; for another target or further values one that checks what
        is known and passes on the rest. Nothing is imported before it is made.

    Raises:
        InputError: A value is unusable.
    """
    values = dict(as_mapping(config, where))
    target = values.pop("_target_", None)
    if not isinstance(target, str):
        raise InputError(f"{where}._target_={shown(target)} names nothing; give what makes it")
    known = next((v for v in part.variants() if v.target == target), part)
    if known is not part and values.keys() <= kinds_of(known).keys():
        return from_config(known, values, where)
    with below(where):
        return _another(known, target, values)


def _as_config(hint: Any, value: Any) -> Any:
    if isinstance(value, Settings):
        return as_config(value)
    if _several(hint):
        return _named(value)
    return plain(value)


def _named(variants: tuple[Variant, ...]) -> dict[str, Any]:
    """Several variants, each by a name of its own, in order."""
    named: dict[str, Any] = {}
    for variant in variants:
        name = variant.name if variant.name not in named else f"{variant.name}_{len(named)}"
        named[name] = as_config(variant)
    return named


def _several(hint: Any) -> type[Variant] | None:
    """The part of which a field holds several variants, as `tuple[Transform, ...]` does."""
    if typing.get_origin(hint) is not tuple:
        return None
    part = typing.get_args(hint)[0]
    return part if isinstance(part, type) and issubclass(part, Variant) else None


def _read(hint: Any, value: Any, where: str) -> Any:
    """A field's value: settings are made of mappings, all else is left to the field's kind."""
    part = _several(hint)
    if part is not None and not isinstance(value, tuple):
        items = as_mapping(value, where).items()
        return tuple(variant_of(part, v, f"{where}.{k}") for k, v in items if v is not None)
    hint = _given(hint) if value is not None else hint
    if not isinstance(hint, type) or not issubclass(hint, Settings) or isinstance(value, Settings):
        return value
    if issubclass(hint, Variant):
        return variant_of(hint, value, where)
    if issubclass(hint, BaseTaskSettings) and hint is not TaskSettings:
        hint, value = named_settings(value, where)
    return from_config(hint, value, where)


def _given(hint: Any) -> Any:
    """The settings themselves, where there may be none."""
    inner = [of for of in typing.get_args(hint) if of is not types.NoneType]
    is_settings = len(inner) == 1 and isinstance(inner[0], type) and issubclass(inner[0], Settings)
    return inner[0] if is_settings else hint


def _another(part: type[Variant], target: str, given: Mapping[str, Any]) -> Variant:
    """A variant of the user's own; of its settings only those of its part are known here."""

    @dataclasses.dataclass(frozen=True, kw_only=True)
    class Another(part):
        is_known: ClassVar[bool] = False

        def values(self) -> dict[str, Any]:
            return dict(given)

    Another.target = target
    return Another(**{name: value for name, value in given.items() if name in kinds_of(part)})


@dataclasses.dataclass(frozen=True)
class Changes:
    """The kind of value that gives some settings of a class; none keeps what there is."""

    of: type[Settings]

    def read(self, value: Any, where: str) -> dict[str, Any]:
        """See `drone_rl.utils.schema.Kind`."""
        given = as_mapping(value, where)
        with below(where):
            check_names(self.of, given)
            kinds = kinds_of(self.of)
            return {n: kinds[n].read(v, n) for n, v in given.items() if v is not None}


@dataclasses.dataclass(frozen=True)
class ChangesOfTask:
    """The kind of value that gives some settings of any task; none keeps what there is.

    Their values are read when it is known which task it is.
    """

    @property
    def types(self) -> dict[str, Any]:
        """The plain type of every setting that some task has."""
        return {
            name: hint for settings in TASKS.values() for name, hint in types_of(settings).items()
        }

    def read(self, value: Any, where: str) -> dict[str, Any]:
        """See `drone_rl.utils.schema.Kind`."""
        given = as_mapping(value, where)
        for name in given:
            if name not in self.types:
                known = ", ".join(self.types)
                raise InputError(f"{where}.{name} is unknown; there are: {known}")
        return {name: v for name, v in given.items() if v is not None}


TaskChanges = Annotated[Mapping[str, Any], ChangesOfTask()]
DynamicsChanges = Annotated[Mapping[str, Any], Changes(DynamicsSettings)]


def no_changes() -> Any:
    """A field without any."""
    return dataclasses.field(default_factory=dict)


_MOVED = {
    "drone_rl.cli.build.threaded_collector": "drone_rl.training.train.threaded_collector",
    "drone_rl.cli.build.ray_collector": "drone_rl.training.ray_workers.ray_collector",
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
