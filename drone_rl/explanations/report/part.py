"""A part of the page: what one section of an explanation looks like to people.

Each part is a module of `report/sections`, called like the section of `explanations/sections` whose
numbers and arrays it shows, with a template of the same name. A new part is those two files; the
page finds it. What no part shows is laid out plainly all the same.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from drone_rl.evaluation.plots.saving import Rows
from drone_rl.explanations.report.explanation import Explanation
from drone_rl.utils.text import Sentence

Drawn = Mapping[str, Image.Image | Figure | NDArray]
"""Pictures, charts and films by name. A film: (T, H, W, 3), uint8, sizes multiples of 16."""


def _nothing(_: Any) -> dict[str, Any]:
    return {}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Part:
    """What to show of an explanation, and where."""

    title: str
    """Heading."""
    label: str
    """The heading in a word or two, for links."""
    place: int
    """Order on the page: low ones first. Gaps leave room for others."""
    needs: tuple[str, ...]
    """Entries of `explanation.json` that it shows; without one of them it is left out."""
    is_slow: bool = False
    """Whether it is rendered after the other parts, so that their errors are found first."""
    words: Mapping[str, Sequence[Sentence]] = dataclasses.field(default_factory=dict)
    """Sentences by the paragraph in which they stand."""
    draw: Callable[[Explanation], Drawn] = _nothing
    """Figures of one policy, saved under these names."""
    tables: Callable[[Explanation], Mapping[str, Rows]] = _nothing
    """Numbers behind figures, saved as CSV under these names."""
    extras: Callable[[Explanation], Mapping[str, Any]] = _nothing
    """What else the template needs to know of one policy."""
    compare: Callable[[Sequence[Explanation]], Drawn] = _nothing
    """Figures of all policies together."""

    def fits(self, explanation: Explanation) -> bool:
        """Whether an explanation holds what this part shows."""
        return all(explanation.numbers.get(key) is not None for key in self.needs)
