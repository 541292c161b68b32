"""Settings: frozen dataclasses whose fields carry type, bounds, default and meaning.

A setting stands in code in one such field and nowhere else: what files may say, what Hydra accepts
and what is passed in Python are all checked by it.
"""

import contextlib
import dataclasses
import functools
import re
import types
import typing
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Self, TypeVar

from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Flag, Instance, Kind, Maybe, Record, Text, as_mapping

S = TypeVar("S", bound="Settings")


class _Frozen:
    """Values that can't be assigned or deleted."""

    def __setattr__(self, name: str, value: object) -> None:
        raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")

    def __delattr__(self, name: str) -> None:
        raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")


@typing.dataclass_transform(kw_only_default=True, frozen_default=True)
@dataclasses.dataclass(frozen=True)
class Settings(_Frozen):
    """Values that are checked before anything is built; each subclass is a frozen dataclass.

    A field is annotated with its type and its kind, as in `Annotated[int, Whole(1, 100)]`; of true
    or false, texts and other settings the type alone is enough.

    Raises:
        InputError: A value is of another type or out of bounds, or the values don't go together.
            The message begins with the field's name.
    """

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Make the subclass a frozen dataclass with keyword arguments.

        A subclass may repeat `@dataclasses.dataclass(frozen=True)`: the decorator finds the fields
        as they were written, and no methods that it refuses to replace.
        """
        super().__init_subclass__(**kwargs)
        fields = {name: f for name, f in vars(cls).items() if isinstance(f, dataclasses.Field)}
        dataclasses.dataclass(frozen=True, kw_only=True)(cls)
        for name, field in fields.items():
            setattr(cls, name, field)
        del cls.__setattr__, cls.__delattr__

    def __post_init__(self) -> None:
        """Reads every value by its kind."""
        for name, kind in kinds_of(type(self)).items():
            object.__setattr__(self, name, kind.read(getattr(self, name), name))
        self.check()

    def check(self) -> None:
        """Refuses values that are in bounds, each by itself, but don't go together."""

    def replace(self, **changes: Any) -> Self:
        """The same with other values.

        Raises:
            InputError: There is no such setting, or its value can't be.
        """
        check_names(type(self), changes)
        return dataclasses.replace(self, **changes)

    @classmethod
    def read(cls, data: Any, where: str) -> Self:
        """Settings out of plain data that has every field and no other.

        Args:
            data: A mapping.
            where: Its name, for people.

        Raises:
            InputError: See `Settings`; the message begins with `where`.
        """
        values = Record(kinds_of(cls)).read(data, where)
        with below(where):
            return cls(**values)

    def narrowed(self, cls: type[S]) -> S:
        """Those of a class that this one extends, without what was added."""
        return cls(**{field.name: getattr(self, field.name) for field in dataclasses.fields(cls)})

    def values(self) -> dict[str, Any]:
        """The fields by name; other settings in them as mappings, tuples as lists."""
        return {f.name: plain(getattr(self, f.name)) for f in dataclasses.fields(self)}


@functools.cache
def kinds_of(cls: type[Settings]) -> Mapping[str, Kind]:
    """What each field may be, in order."""
    hints = typing.get_type_hints(cls, include_extras=True)
    return {field.name: _kind(hints[field.name]) for field in dataclasses.fields(cls)}


@functools.cache
def types_of(cls: type[Settings]) -> Mapping[str, Any]:
    """The plain type of each field, in order."""
    hints = typing.get_type_hints(cls)
    return {field.name: hints[field.name] for field in dataclasses.fields(cls)}


def check_names(cls: type[Settings], given: Mapping[str, Any]) -> None:
    """Refuses names that are no settings.

    Raises:
        InputError: There is one; those that exist are named.
    """
    for name in given:
        if name not in kinds_of(cls):
            raise InputError(f"{name} is unknown; there are: {', '.join(kinds_of(cls))}")


@contextlib.contextmanager
def below(where: str) -> Iterator[None]:
    """Puts the name of what holds the settings before that of the setting, in errors from within.

    Args:
        where: Such as "task", which makes "task.num_cubes=0 ..." of "num_cubes=0 ...".
    """
    try:
        yield
    except InputError as error:
        raise InputError(f"{where}.{error}") from error


def snake_case(cls: type) -> str:
    """The name of a class as a file would be called."""
    return re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__).lower()


def plain(value: Any) -> Any:
    """A setting's value as plain data."""
    if isinstance(value, Settings):
        return value.values()
    if isinstance(value, Mapping):
        return {k: plain(v) for k, v in as_mapping(value, "settings").items()}
    return [plain(v) for v in value] if isinstance(value, tuple) else value


def _kind(hint: Any) -> Kind:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is Annotated:
        return arguments[1]
    if origin in (typing.Union, types.UnionType):
        (inner,) = (argument for argument in arguments if argument is not types.NoneType)
        return Maybe(_kind(inner))
    if hint in (bool, str):
        return Flag() if hint is bool else Text()
    return Instance(hint)
