"""A part of a training that comes in variants: what makes it, and its settings."""

import dataclasses
import importlib
from typing import Any, ClassVar, Self

from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import Settings, snake_case


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
