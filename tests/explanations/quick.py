"""Small searches and grids, for tests of what surrounds them."""

import contextlib
import functools
from collections.abc import Iterator

import pytest

from drone_rl.explanations import class_models, response


@contextlib.contextmanager
def quick(*, grids: bool = True) -> Iterator[None]:
    """Optimize class models for a few steps and, if `grids`, evaluate few places of a target."""
    with pytest.MonkeyPatch.context() as patch:
        few = functools.partial(class_models.ClassModelSettings, steps=3, starts=2)
        patch.setattr(class_models, "ClassModelSettings", few)
        if grids:
            for make in (response.response_map, response.outcome_map):
                patch.setitem(make.__kwdefaults__, "num_lateral", 9)
                patch.setitem(make.__kwdefaults__, "num_forward", 4)
        yield
