"""Settings that are selected by name: tasks, and the parts of a training such as its network."""

import dataclasses
import functools
import importlib
import inspect
from collections.abc import Callable, Mapping
from importlib import metadata
from typing import Annotated, Any, ClassVar, Self, TypedDict, Unpack

import pydantic
from annotated_types import MaxLen
from pydantic_core import PydanticCustomError

from drone_rl.utils.errors import InputError, did_you_mean
from drone_rl.utils.schema import Annotation
from drone_rl.utils.settings import Settings, plain, snake_case

ENTRY_POINTS = "drone_rl.policies"
"""Entry point group of modules that register parts."""


class NetworkOptions(TypedDict, total=False):
    """What is given by name where a part is built."""

    generator: Any
    """The `torch.Generator` of a network's first weights; None for torch's global one."""


class Named(Settings):
    """Settings of one of several choices, such as tasks, which have names in a registry.

    Where settings of the class with the registry are read, a name selects a choice with its
    defaults, and a mapping contains the name of a choice, as "name", and its values.
    """

    name: ClassVar[str]
    """The name of a choice."""
    registry: ClassVar[dict[str, Any]]
    """The choices by name."""
    default_name: ClassVar[str | None] = None
    """Name in mappings that have none."""

    @pydantic.model_validator(mode="wrap")
    @classmethod
    def _select(cls, data: Any, handler: pydantic.ModelWrapValidatorHandler[Self]) -> Self:
        if "registry" not in vars(cls) or not isinstance(data, str | Mapping):
            return handler(data)
        if isinstance(data, str):
            return cls.named(data)()
        return cls.select(dict(data))

    @pydantic.model_serializer
    def _as_plain(self) -> dict[str, Any]:
        return {"name": self.name, **self.values()}

    @classmethod
    def select(cls, values: dict[str, Any]) -> Self:
        """Return the choice that a mapping names, with its values."""
        return cls.named(values.pop("name", cls.default_name), "name").read(values)

    @classmethod
    def named(cls, name: Any, *where: str) -> type[Self]:
        """Return the choice with a name; raise pydantic's error, or an `InputError`, for others.

        The registry is searched again after the import of packages with entry points.
        """
        if not (isinstance(name, str) and name in cls.registry):
            load_entry_points()
        if isinstance(name, str) and name in cls.registry:
            return cls.registry[name]
        reason = (
            f"must be one of {', '.join(cls.registry)}; a module of your own that registers it is "
            "given by plugins=[MODULE], or imported in Python"
            f"{did_you_mean(name, cls.registry)}"
        )
        error = PydanticCustomError("name", "{reason}", {"reason": reason})
        raise pydantic.ValidationError.from_exception_data(
            cls.__name__, [{"type": error, "loc": where, "input": name}]
        )


class Part(Named):
    """Settings of one variant of a part of a training, such as a network.

    Each class below `Part` is a part and has a registry. `implements` in
    `drone_rl.config.registry` connects a variant with the class or function that builds it.

    In Hydra's configs the name is "_target_". It may also be the dotted name of a class of another
    package, which is imported when it is built and gets all values, declared or not.
    """

    target: ClassVar[str]
    """The registered name, or the dotted name of a class of another package."""
    factory: ClassVar[Callable[..., Any] | None] = None
    """Builds the part; None for a class of another package, which is imported when needed."""
    is_known: ClassVar[bool] = True
    """Whether the class declares all settings, so that files may contain them."""

    def __init_subclass__(cls, *, target: str = "", **kwargs: Any) -> None:
        """Register a variant, as in `class Adam(Optimizer, target="torch.optim.Adam")`."""
        super().__init_subclass__(**kwargs)
        if Part in cls.__bases__:
            cls.registry = {}
        target = target or vars(cls).get("target", "")
        cls.name = target if target and "." not in target else snake_case(cls)
        if target:
            cls.target = target
            cls.registry[cls.name] = cls

    def make(self, *parts: Any, **options: Unpack[NetworkOptions]) -> Any:
        """Build the part from objects, such as parameters, and the settings.

        Raises:
            InputError: There is no class of this name, or it takes other arguments.
        """
        factory = type(self).factory or locate(self.target)
        arguments = self.arguments()
        if not self.is_known:
            try:
                inspect.signature(factory).bind(*parts, **arguments, **options)
            except TypeError as error:
                raise InputError(
                    f"_target_={self.target}: {error}; give arguments of this class"
                ) from error
        return factory(*parts, **arguments, **options)

    def arguments(self) -> dict[str, Any]:
        """Return the settings that are passed to the factory."""
        return self.values()

    def config(self) -> dict[str, Any]:
        """See `Settings`."""
        return {"_target_": self.target, **self.values()}

    @classmethod
    def select(cls, values: dict[str, Any]) -> Self:
        """See `Named`."""
        if "_target_" not in values:
            return super().select(values)
        target = values.pop("_target_")
        variants = {variant.target: variant for variant in cls.registry.values()}
        of = variants.get(target)
        if of is None and not (isinstance(target, str) and "." in target):
            of = cls.named(target, "_target_")
        if of is not None and ("." not in of.target or values.keys() <= of.model_fields.keys()):
            return of.read(values)

        base: Any = of or cls

        class Unregistered(base):
            model_config = pydantic.ConfigDict(extra="allow")
            is_known: ClassVar[bool] = False

            def values(self) -> dict[str, Any]:
                return {name: plain(v) for name, v in self if name in self.model_fields_set}

        Unregistered.target, Unregistered.factory = target, of.factory if of else None
        Unregistered.name = of.name if of else target
        return Unregistered.read(values)


@dataclasses.dataclass(frozen=True)
class Parts(Annotation):
    """The kind of a tuple of variants of one part, which is also read from a mapping.

    A key of the mapping is the name of a variant if the value has no "_target_"; values of None are
    left out.
    """

    of: type[Part]
    most: int

    @property
    def registry(self) -> dict[str, Any]:
        """The variants by name."""
        return self.of.registry

    @property
    def hint(self) -> Any:
        """See `Annotation`."""
        return Annotated[
            dict[Any, self.of],
            pydantic.BeforeValidator(self._by_name),
            MaxLen(self.most),
            pydantic.AfterValidator(lambda parts: tuple(parts.values())),
        ]

    @staticmethod
    def _by_name(value: Any) -> Any:
        if not isinstance(value, Mapping):
            return dict(enumerate(value)) if isinstance(value, list | tuple) else value
        items = {name: item for name, item in value.items() if item is not None}
        return {
            name: {"_target_": name, **item} if isinstance(item, Mapping) else item
            for name, item in items.items()
        }


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
