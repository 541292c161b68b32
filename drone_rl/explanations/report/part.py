"""A part of the report: how it displays one section of an explanation."""

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
"""Images, charts and films by name. A film: (T, H, W, 3), uint8, sizes multiples of 16."""


def _nothing(_: Any) -> dict[str, Any]:
    return {}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Part:
    """What the report shows of a section.

    A part is listed in `page.PARTS`; its template is `templates/sections/NAME.html`.
    """

    title: str
    """Heading."""
    label: str
    """A short heading, for links."""
    needs: tuple[str, ...]
    """Entries of `explanation.json` that it shows; if one is missing, the part is left out."""
    is_slow: bool = False
    """Whether it is rendered after the other parts, so that their errors are found first."""
    text: Mapping[str, Sequence[Sentence]] = dataclasses.field(default_factory=dict)
    """Sentences by paragraph."""
    draw: Callable[[Explanation], Drawn] = _nothing
    """Returns the figures of one policy by file name."""
    tables: Callable[[Explanation], Mapping[str, Rows]] = _nothing
    """Returns the numbers behind the figures, saved as CSV."""
    extras: Callable[[Explanation], Mapping[str, Any]] = _nothing
    """Returns further values for the template."""
    compare: Callable[[Sequence[Explanation]], Drawn] = _nothing
    """Returns figures of all policies together."""

    def fits(self, explanation: Explanation) -> bool:
        """Return whether an explanation has the entries that this part shows."""
        return all(explanation.numbers.get(key) is not None for key in self.needs)
