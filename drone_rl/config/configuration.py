"""Conversion of settings to and from nested plain data, as in checkpoints and Hydra's configs."""

import dataclasses
import functools
import importlib
import inspect
import tomllib
import types
import typing
from collections.abc import Callable, Iterable, Mapping
from importlib import metadata
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self, TypedDict, TypeVar, Unpack

from drone_rl.config import (
    TASKS,
    BaseTaskSettings,
    DynamicsSettings,
    TaskSettings,
    named_settings,
)
from drone_rl.utils.errors import InputError, did_you_mean
from drone_rl.utils.schema import as_mapping, shown
from drone_rl.utils.settings import (
    Settings,
    check_names,
    kinds_of,
    plain,
    prefixed_errors,
    snake_case,
    types_of,
)

ENTRY_POINTS = "drone_rl.policies"
"""Entry point group of modules that register parts."""

S = TypeVar("S", bound=Settings)


class NetworkOptions(TypedDict, total=False):
    """What is given by name where a part is built."""

    generator: Any
    """The `torch.Generator` of a network's first weights; None for torch's global one."""


class Variant(Settings):
    """Settings of one variant of a part of a training.

    Each subclass of a part's class, such as `Network`, is a variant of it. `implements` in
    `drone_rl.config.registry` connects a variant with the class or function that builds it.
    """

    target: ClassVar[str]
    """The registered name, or the dotted name of a class of another package."""
    factory: ClassVar[Callable[..., Any] | None] = None
    """Builds the part; None for a class of another package, which is imported when needed."""
    is_known: ClassVar[bool] = True
    """Whether the class declares all settings, so that files may contain them."""

    def __init_subclass__(cls, *, target: str = "", **kwargs: Any) -> None:
        """Set the registered name of a variant, as in `class Adam(Optimizer, target=...)`."""
        if target:
            cls.target = target
        super().__init_subclass__(**kwargs)

    def make(self, *parts: Any, **options: Unpack[NetworkOptions]) -> Any:
        """Build the part from objects, such as parameters, and the settings; see `locate`."""
        factory = type(self).factory or locate(self.target)
        return factory(*parts, **self.arguments(), **options)

    def arguments(self) -> dict[str, Any]:
        """Return the settings that are passed to the factory."""
        return self.values()

    @classmethod
    def registered_name(cls) -> str:
        """Return the name of the variant in policy files and Hydra's schemas."""
        is_own = "target" in vars(cls) and "." not in cls.target
        return cls.target if is_own else snake_case(cls)

    @property
    def name(self) -> str:
        """The name of the variant."""
        return self.registered_name()

    @classmethod
    def variants(cls) -> tuple[type[Self], ...]:
        """Return all variants of this part."""
        variants = []
        for sub in cls.__subclasses__():
            variants += [sub] if "target" in vars(sub) and sub.is_known else []
            variants += sub.variants()
        return tuple(variants)

    @classmethod
    def named(cls, name: object, where: str) -> type[Self]:
        """Return the variant with a registered name; `where` is the setting's name for messages."""
        for load in (lambda: None, load_entry_points):
            load()
            variants = {variant.registered_name(): variant for variant in cls.variants()}
            if isinstance(name, str) and name in variants:
                return variants[name]
        raise InputError(
            f"{where}={shown(name)} is not registered; valid names: {', '.join(variants)}; if it "
            "is a part of your own, give plugins=[MODULE] with the module that registers it, or "
            "import it in Python"
            f"{did_you_mean(name, variants)}"
        )

    @classmethod
    def from_name(cls, name: str, where: str) -> Self:
        """Return a variant with its default settings; see `named`."""
        return cls.named(name, where)()


@functools.cache
def load_entry_points() -> None:
    """Import the modules that installed packages name in the entry point group, once."""
    for point in metadata.entry_points(group=ENTRY_POINTS):
        point.load()


def locate(target: str) -> Any:
    """Import an object by its dotted name; raise an `InputError` if there is none."""
    module, _, name = target.rpartition(".")
    try:
        return getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise InputError(f"_target_={target} can't be imported ({error}); give another") from error


def as_config(settings: Settings) -> dict[str, Any]:
    """Return settings as plain data.

    A variant has its target as "_target_", several variants are named. Tasks other than
    collect_cubes contain their name, see `BaseTaskSettings.values`.
    """
    if isinstance(settings, BaseTaskSettings):
        return settings.values()
    target = {"_target_": settings.target} if isinstance(settings, Variant) else {}
    if isinstance(settings, Variant) and not settings.is_known:
        return {**target, **settings.values()}
    hints = types_of(type(settings)).items()
    return {**target, **{n: _plain(getattr(settings, n), bool(_several(h))) for n, h in hints}}


def from_config(cls: type[S], config: Any, where: str = "") -> S:
    """Read settings from plain data; missing fields have their defaults.

    Args:
        cls: Class of the settings.
        config: A mapping; nested settings are mappings, too.
        where: Its name, for messages; empty at the root.

    Raises:
        InputError: A name is unknown or a value invalid; the message begins with its place.
    """
    given = as_mapping(config, where or "settings")
    prefix = f"{where}." if where else ""
    check_names(cls, given, prefix)
    values = {name: _read(types_of(cls)[name], given[name], prefix + name) for name in given}
    if not where:
        return cls(**values)
    with prefixed_errors(where):
        return cls(**values)


def variant_of(part: type[Variant], config: Any, where: str) -> Variant:
    """Read a variant of a part from "_target_" and values.

    A dotted name is imported only when the variant is built. Another name that is not registered
    loads the entry points of installed packages.

    Returns:
        A registered variant. For the dotted name of another class, or for further values, a variant
        that checks the fields of the part and passes all values on.
    """
    values = dict(as_mapping(config, where))
    target = values.pop("_target_", None)
    if not isinstance(target, str):
        must = "must be a registered name or a dotted class name"
        raise InputError(f"{where}._target_ {must}, got {shown(target)}")
    variant = next((v for v in part.variants() if v.target == target), part)
    if variant is part and "." not in target:
        variant = part.named(target, f"{where}._target_")
    if variant is not part and values.keys() <= kinds_of(variant).keys():
        return from_config(variant, values, where)
    with prefixed_errors(where):
        return _unregistered(variant, target, values)


def _plain(value: Any, is_several: bool) -> Any:
    if isinstance(value, Settings):
        return as_config(value)
    if not is_several:
        return plain(value)
    named: dict[str, Any] = {}
    for variant in value:
        name, number = variant.name, len(named)
        while name in named:
            name, number = f"{variant.name}_{number}", number + 1
        named[name] = as_config(variant)
    return named


def _several(hint: Any) -> type[Variant] | None:
    """Return the part of which a field holds several variants, as `tuple[Transform, ...]` does."""
    if typing.get_origin(hint) is not tuple:
        return None
    part = typing.get_args(hint)[0]
    return part if isinstance(part, type) and issubclass(part, Variant) else None


def _read(hint: Any, value: Any, where: str) -> Any:
    """Read nested settings from mappings; the field's kind reads all other values."""
    part = _several(hint)
    if part is not None and isinstance(value, Mapping):
        items = as_mapping(value, where).items()
        return tuple(
            variant_of(part, _with_target(part, k, v), f"{where}.{k}")
            for k, v in items
            if v is not None
        )
    if value is None or isinstance(value, Settings | str):
        return value
    classes = [of for of in (typing.get_args(hint) or (hint,)) if of is not types.NoneType]
    cls = classes[0]
    if len(classes) > 1 or not isinstance(cls, type) or not issubclass(cls, Settings):
        return value
    if issubclass(cls, Variant):
        return variant_of(cls, value, where)
    if issubclass(cls, BaseTaskSettings) and cls is not TaskSettings:
        cls, value = named_settings(value, where)
    return from_config(cls, value, where)


def _with_target(part: type[Variant], name: str, value: Any) -> Any:
    """Add "_target_" to an entry of `transforms` or `logger` whose key is a registered name."""
    if not isinstance(value, Mapping) or "_target_" in value:
        return value
    variant = next((v for v in part.variants() if v.registered_name() == name), None)
    return value if variant is None else {"_target_": variant.target, **value}


def _unregistered(part: type[Variant], target: str, given: Mapping[str, Any]) -> Variant:
    """A variant of which only the fields of its part are checked."""

    class Unregistered(part):
        is_known: ClassVar[bool] = False

        def values(self) -> dict[str, Any]:
            return dict(given)

    Unregistered.target = target
    Unregistered.factory = part.factory if target == getattr(part, "target", None) else None
    return Unregistered(**{name: value for name, value in given.items() if name in kinds_of(part)})


@dataclasses.dataclass(frozen=True)
class Changes:
    """The kind of a mapping with some settings of a class; others, and those of None, are kept."""

    of: type[Settings] | None = None
    """The class; None for the settings of all tasks, whose values are checked by the task later."""

    @property
    def types(self) -> dict[str, Any]:
        """The plain type of each setting."""
        classes = TASKS.values() if self.of is None else (self.of,)
        return {name: hint for cls in classes for name, hint in types_of(cls).items()}

    def read(self, value: Any, where: str) -> dict[str, Any]:
        """See `drone_rl.utils.schema.Kind`."""
        changes = as_mapping(value, where)
        own = getattr(self.of, "name", None)
        if own and "name" in changes and "name" not in self.types:
            if changes["name"] != own:
                raise InputError(
                    f"{where}.name={shown(changes['name'])} would replace the task, which is "
                    f"{own}; give values of that task's settings"
                )
            changes = {name: v for name, v in changes.items() if name != "name"}
        for name in changes:
            if name not in self.types:
                names, meant = ", ".join(self.types), did_you_mean(name, self.types)
                raise InputError(f"{where}.{name} is unknown; valid names: {names}{meant}")
        changes = {name: v for name, v in changes.items() if v is not None}
        if self.of is None:
            return changes
        kinds = kinds_of(self.of)
        return {name: kinds[name].read(v, f"{where}.{name}") for name, v in changes.items()}


def as_changes(value: Any, where: str) -> Mapping[str, Any]:
    """Return changes of settings by name: those of a mapping, all of a settings object, or none."""
    if value is None:
        return {}
    if isinstance(value, Mapping | Settings):
        return value if isinstance(value, Mapping) else value.values()
    raise InputError(
        f"{where}={shown(value)} gives no changes; give values by name, as in "
        "task={'num_cubes': 5} or dynamics={'wind': [5, 0, 0]}"
    )


@functools.cache
def read_other_names() -> dict[str, Any]:
    """Return names of other projects' settings and commands, with ours; see `names.toml`."""
    return tomllib.loads(Path(__file__).with_name("names.toml").read_text("utf-8"))


def from_arguments(
    of: type[S], settings: S | None, changes: Mapping[str, object], function: Callable[..., Any]
) -> S:
    """Return a function's settings, the defaults if None, with its changes to them.

    `function` is the one that has these arguments; messages name its further ones.

    Raises:
        InputError: `settings` is of another class, or a change is no setting.
    """
    if not isinstance(settings, of | None):
        several = ", and several policies as a list" if isinstance(settings, str) else ""
        raise InputError(
            f"settings={shown(settings)} is no {of.__name__}; give settings by name, such as "
            f"{next(iter(kinds_of(of)))}=...{several}"
        )
    base = of() if settings is None else settings
    parameters = inspect.signature(function).parameters.values()
    others = [p.name for p in parameters if p.kind is inspect.Parameter.KEYWORD_ONLY]
    groups = {"task": Changes(), "dynamics": Changes(DynamicsSettings)}
    for name in (name for name in changes if name not in kinds_of(of)):
        group = next((group for group, its in groups.items() if name in its.types), "")
        if group in others:
            text = f"{group}={{{name!r}: {shown(changes[name])}}}"
            raise InputError(f"{name} is a setting of {group}; give {text}")
    check_names(of, changes, others=others, synonyms=read_other_names()["settings"])
    return base.replace(**changes)


TaskChanges = Annotated[Mapping[str, Any], Changes()]
DynamicsChanges = Annotated[Mapping[str, Any], Changes(DynamicsSettings)]


def no_changes() -> Any:
    """Return a dataclass field whose default is no changes."""
    return dataclasses.field(default_factory=dict)


def check_same_config(
    saved: Mapping[str, Any], now: Mapping[str, Any], may_change: Iterable[str]
) -> None:
    """Raise an `InputError` if a resumed run or sweep has other settings than at its start.

    `may_change` are dotted keys, and groups of them, that don't change what is learned.
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
