"""Settings: frozen dataclasses whose fields have type, bounds, default and description.

A setting is defined in one such field, which checks files, Hydra's values and Python's arguments.
"""

import contextlib
import dataclasses
import functools
import math
import re
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar

from drone_rl.utils.errors import InputError, did_you_mean
from drone_rl.utils.schema import Flag, Instance, Kind, Maybe, Real, Record, Text, as_mapping

S = TypeVar("S", bound="Settings")


@typing.dataclass_transform(kw_only_default=True, frozen_default=True)
@dataclasses.dataclass(frozen=True)
class Settings:
    """Values that are checked before anything is built; each subclass is a frozen dataclass.

    A field is annotated with its type and its kind, as in `Annotated[int, Whole(1, 100)]`; for
    `bool`, `str` and nested settings the type is enough.

    Raises:
        InputError: A value is of another type or out of bounds, or the values don't go together.
            The message begins with the field's name.
    """

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Make the subclass a frozen dataclass with keyword arguments."""
        super().__init_subclass__(**kwargs)
        dataclasses.dataclass(frozen=True, kw_only=True)(cls)
        _refuse_unknown_names(cls)
        _refuse_untyped(cls)

    def __post_init__(self) -> None:
        """Check every value by its kind."""
        for name, kind in kinds_of(type(self)).items():
            object.__setattr__(self, name, kind.read(getattr(self, name), name))
        self.check()

    def check(self) -> None:
        """Raise an `InputError` if valid values don't go together."""

    def replace(self, **changes: Any) -> Self:
        """Return a copy with other values; raise an `InputError` for unknown or invalid ones."""
        check_names(type(self), changes)
        return dataclasses.replace(self, **changes)

    @classmethod
    def read(cls, data: Any, where: str) -> Self:
        """Return settings from a mapping that has every field and no other.

        Raises:
            InputError: See `Settings`; the message begins with `where`.
        """
        values = Record(kinds_of(cls)).read(data, where)
        with prefixed_errors(where):
            return cls(**values)

    def as_base(self, cls: type[S]) -> S:
        """Return these settings as an instance of a base class, without the fields it lacks."""
        return cls(**{field.name: getattr(self, field.name) for field in dataclasses.fields(cls)})

    def values(self) -> dict[str, Any]:
        """Return the fields by name as plain data."""
        return {f.name: plain(getattr(self, f.name)) for f in dataclasses.fields(self)}


def conf_dir() -> Path:
    """Return the folder conf/ of the checkout, or its copy inside an installed wheel."""
    package = Path(__file__).resolve().parents[1]
    checkout = package.parent / "conf"
    return checkout if (checkout / "train.yaml").is_file() else package / "conf"


@functools.cache
def kinds_of(cls: type[Settings]) -> Mapping[str, Kind]:
    """Return the kind of each field, in order."""
    hints = typing.get_type_hints(cls, include_extras=True)
    return {field.name: _kind(hints[field.name], field.name) for field in dataclasses.fields(cls)}


@functools.cache
def types_of(cls: type[Settings]) -> Mapping[str, Any]:
    """Return the plain type of each field, in order."""
    hints = typing.get_type_hints(cls)
    return {field.name: hints[field.name] for field in dataclasses.fields(cls)}


def check_names(
    cls: type[Settings],
    given: Mapping[str, Any],
    prefix: str = "",
    others: Sequence[str] = (),
    synonyms: Mapping[str, Sequence[str]] = types.MappingProxyType({}),
) -> None:
    """Raise an `InputError` with the valid names, and others, if a name is not one of the valid.

    `synonyms` are the settings that other projects' names mean, dotted as on the command line.
    """
    kinds = kinds_of(cls)
    for name in given:
        if name not in kinds:
            names = [*kinds, *others]
            meanings = [
                name,
                *(other.rpartition(".")[2] for other in synonyms.get(name.lower(), ())),
            ]
            hints = (_inside(cls, our) or did_you_mean(our, names) for our in meanings)
            meant = next(filter(None, hints), "")
            raise InputError(f"{prefix}{name} is unknown; valid names: {', '.join(names)}{meant}")


def _inside(cls: type[Settings], name: str) -> str:
    """Return a hint at the field whose settings have a name, or ""."""
    for field in dataclasses.fields(cls):
        if isinstance(field.default, Settings) and name in kinds_of(type(field.default)):
            of = type(field.default)
            return f"; did you mean {field.name}={of.__module__}.{of.__name__}({name}=...)?"
    return ""


def _refuse_untyped(cls: type[Settings]) -> None:
    """Raise an `InputError` for a class attribute without an annotation, which is no setting."""
    own = dict(vars(cls))
    known = {name for c in cls.__mro__[1:-1] for name in (*vars(c), *c.__annotations__)}
    known -= {field.name for field in dataclasses.fields(cls)}  # whose values would be ignored
    known |= cls.__annotations__.keys()
    for name, value in own.items():
        is_typed = name in known or name.startswith("_")
        if not is_typed and isinstance(value, int | float | str):
            raise InputError(
                f"{cls.__name__}.{name} has no type, so it would have no effect; write "
                f"{name}: {type(value).__name__} = {value!r}"
            )


def _refuse_unknown_names(cls: type[Settings]) -> None:
    """Let the constructor of a class raise an `InputError` for names that it does not have."""
    construct = cls.__init__

    @functools.wraps(construct)
    def checked(self: Settings, *args: Any, **given: Any) -> None:
        try:
            construct(self, *args, **given)
        except TypeError:
            check_names(type(self), given)
            raise

    setattr(cls, "__init__", checked)  # noqa: B010


@contextlib.contextmanager
def prefixed_errors(where: str) -> Iterator[None]:
    """Prefix errors about settings, such as "num_cubes=0 ..." with "task." if that is `where`."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{where}.{error}") from error


def snake_case(cls: type) -> str:
    """Return the name of a class in snake case."""
    return re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__).lower()


def plain(value: Any) -> Any:
    """Return a setting's value as plain data: settings as mappings, tuples as lists."""
    if isinstance(value, Settings):
        return value.values()
    if isinstance(value, Mapping):
        return {k: plain(v) for k, v in as_mapping(value, "settings").items()}
    return [plain(v) for v in value] if isinstance(value, tuple) else value


def _kind(hint: Any, where: str) -> Kind:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is Annotated and hasattr(arguments[1], "read") and not isinstance(arguments[1], type):
        return arguments[1]
    inner = [argument for argument in arguments if argument is not types.NoneType]
    if origin in (typing.Union, types.UnionType) and len(inner) == 1:
        return Maybe(_kind(inner[0], where))
    if hint in (bool, str):
        return Flag() if hint is bool else Text()
    if hint is float:
        return Real(-math.inf)
    if origin is None and isinstance(hint, type):
        return Instance(hint)
    raise InputError(
        f"{where} is of type {hint}; annotate it with a kind of drone_rl.utils.schema, as in "
        "Annotated[float, Real(0.0, 1.0)]"
    )
