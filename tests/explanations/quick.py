"""Small searches, grids and figures, for tests of what surrounds them."""

import contextlib
import functools
import itertools
from collections.abc import Iterator

import pytest
from matplotlib.figure import Figure

from drone_rl.explanations import class_models, explain, response
from drone_rl.explanations.context import LeftOutError
from drone_rl.explanations.explain import SECTIONS
from drone_rl.explanations.report import attribution
from drone_rl.trust.plots import saving
from drone_rl.verification import places_section as places
from drone_rl.verification.places_section import places_section

ALL_SECTIONS = {**SECTIONS, "places": places_section}


@contextlib.contextmanager
def quick() -> Iterator[None]:
    """Optimize class models for a few steps and evaluate few places of a target."""
    with pytest.MonkeyPatch.context() as patch:
        few = functools.partial(class_models.ClassModelSettings, steps=3, starts=2)
        patch.setattr(class_models, "ClassModelSettings", few)
        for make in (response.response_map, response.outcome_map):
            patch.setitem(make.__kwdefaults__, "num_lateral", 9)
            patch.setitem(make.__kwdefaults__, "num_forward", 4)
        yield


@contextlib.contextmanager
def few_sections(*names: str) -> Iterator[None]:
    """Compute these sections alone; all of them take a minute."""

    def no_map(context):
        raise LeftOutError("The test needs none.")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(explain, "SECTIONS", {name: SECTIONS[name] for name in names})
        patch.setattr(places, "places_section", no_map)
        yield


@contextlib.contextmanager
def quick_figures() -> Iterator[None]:
    """Draw charts as SVG alone, without a layout, and films of three frames.

    The fixture `report` has whole figures.
    """
    to_png, joined = saving.to_png, attribution.joined

    def no_chart(picture):
        return b"\x89PNG" if isinstance(picture, Figure) else to_png(picture)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(saving, "to_png", no_chart)
        patch.setattr(saving, "_lay_out", lambda figure: figure.set_layout_engine(None))
        patch.setattr(attribution, "joined", lambda film: joined(itertools.islice(film, 3)))
        yield
