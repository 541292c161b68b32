"""Settings as nested plain data and back: what stands in checkpoints and what Hydra composes."""

import dataclasses
import types
import typing
from collections.abc import Mapping
from typing import Any, ClassVar, TypeVar

from drone_rl.config import BaseTaskSettings, TaskSettings, named_settings
from drone_rl.config.variant import Variant
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import as_mapping, shown
from drone_rl.utils.settings import Settings, below, check_names, kinds_of, plain, types_of

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
