"""Settings: frozen classes whose fields have type, bounds, default and description.

A setting is defined in one such field, which checks files, Hydra's values and Python's arguments.
"""

import ast
import contextlib
import inspect
import itertools
import re
import textwrap
import types
import typing
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, NoReturn, Self, TypeVar

import pydantic

from drone_rl.utils.errors import InputError
from drone_rl.utils.models import Model
from drone_rl.utils.schema import as_plain

S = TypeVar("S", bound="Settings")
_STRICT = (bool, int, float, bool | None, int | None, float | None)


class Settings(Model):
    """Values that are checked before anything is built.

    A field is annotated with its type and, for bounds, a kind of `drone_rl.utils.schema`, as in
    `Annotated[int, Whole(1, 100)]`. The string below it describes it.

    Raises:
        InputError: A name is unknown, a value is of another type or out of bounds, or the values
            don't go together. The message begins with the field's name.
    """

    model_config = pydantic.ConfigDict(
        coerce_numbers_to_str=True,  # folder=2024 on the command line is a number for Hydra
        str_max_length=4000,
        validate_default=True,
    )

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Let types without a kind be strict, too: "3" is no number, and true is no 1."""
        super().__pydantic_init_subclass__(**kwargs)
        for field in cls.model_fields.values():
            if not field.metadata and field.annotation in _STRICT:
                field.metadata.append(pydantic.Strict())

    @pydantic.field_validator("*", mode="before")
    @classmethod
    def _from_libraries(cls, value: Any) -> Any:
        return as_plain(value)

    @pydantic.model_validator(mode="after")
    def _check(self) -> Self:
        self.check()
        return self

    def check(self) -> None:
        """Raise an `InputError` if valid values don't go together."""

    def refuse(self, name: str, problem: str) -> NoReturn:
        """Raise an `InputError` about a field: its value, what is wrong, and the remedy."""
        raise InputError(f"{name}={plain(getattr(self, name))} {problem}")

    def __hash__(self) -> int:
        """Return equal numbers for equal settings, those with mappings included."""
        return hash((type(self), *(_hashable(value) for _, value in self)))

    def as_base(self, cls: type[S]) -> S:
        """Return these settings as an instance of a base class, without the fields it lacks."""
        return cls(**{name: getattr(self, name) for name in cls.model_fields})

    @pydantic.model_serializer
    def _as_plain(self) -> dict[str, Any]:
        return self.values()

    def values(self) -> dict[str, Any]:
        """Return the fields by name as plain data, which `read` reads."""
        return {name: plain(value) for name, value in self}

    def config(self) -> dict[str, Any]:
        """Return `values`, and the name of what is selected by name, as in Hydra's configs."""
        return self.values()


def _hashable(value: Any) -> Any:
    if isinstance(value, Mapping):
        return frozenset((name, _hashable(item)) for name, item in value.items())
    return tuple(map(_hashable, value)) if isinstance(value, list | tuple) else value


def plain(value: Any) -> Any:
    """Return a setting's value as plain data: settings as mappings, tuples as lists.

    Several parts of a training, such as transforms, are a mapping from names; see `Parts`.
    """
    if isinstance(value, Settings):
        return value.config()
    if isinstance(value, Mapping):
        return {name: plain(item) for name, item in value.items()}
    if not isinstance(value, tuple):
        return value
    if not value or not isinstance(value[0], Settings):
        return [plain(item) for item in value]
    names = [part.name for part in value]
    numbered = [f"{n}_{i}" if n in names[:i] else n for i, n in enumerate(names)]
    return dict(zip(numbered, map(plain, value), strict=True))


def conf_dir() -> Path:
    """Return the folder conf/ of the checkout, or its copy inside an installed wheel."""
    package = Path(__file__).resolve().parents[1]
    checkout = package.parent / "conf"
    return checkout if (checkout / "train.yaml").is_file() else package / "conf"


def hints_of(cls: type[Settings]) -> Mapping[str, Any]:
    """Return the annotation of each field, in order."""
    hints = typing.get_type_hints(cls, include_extras=True)
    return {name: hints[name] for name in cls.model_fields}


def inner_types(hint: Any) -> tuple[Any, ...]:
    """Return the kinds of an annotation, or else its types without None, outermost first."""
    arguments = typing.get_args(hint)
    if typing.get_origin(hint) is Annotated:
        return arguments[1:]
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        return tuple(t for of in arguments if of is not types.NoneType for t in inner_types(of))
    return (hint,)


def unit_of(hint: Any) -> str:
    """Return the unit of an annotation, or kind, or of the values inside it; "" for none."""
    kind, *_ = inner_types(hint)
    inner = getattr(kind, "kind", None)
    return getattr(kind, "unit", "") or ("" if inner is None else unit_of(inner))


def meanings(cls: type[Model]) -> Mapping[str, str]:
    """Return the docstring of each field of a class, inherited fields included."""
    texts: dict[str, str] = {}
    for part in reversed(cls.__mro__[: cls.__mro__.index(Model)]):
        with contextlib.suppress(OSError, TypeError):  # made from a signature, without source
            (body,) = ast.parse(textwrap.dedent(inspect.getsource(part))).body
            texts |= dict(_docstrings(typing.cast(Any, body).body))
    return texts


def _docstrings(body: list[Any]) -> Iterator[tuple[str, str]]:
    for field, below in itertools.pairwise(body):
        match field, below:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=text)):
                yield name, " ".join(str(text).split())


def about(cls: type) -> str:
    """Return the first paragraph of a class's docstring."""
    return (inspect.getdoc(cls) or "").partition("\n\n")[0].replace("\n", " ")


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
