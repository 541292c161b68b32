"""Parts of the report: how it displays the sections of explanations."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from drone_rl.explanations.results import Explanation

METHOD_NAMES = {
    "grad_cam": "Grad-CAM",
    "grad_cam_logit": "Grad-CAM (logit)",
    "saliency": "saliency",
    "integrated_gradients": "integrated gradients",
    "occlusion": "occlusion",
}
"""Attribution methods and their display names."""

Media = Image.Image | Figure | NDArray
"""An image, a chart, or a film (T, H, W, 3), uint8, with sizes that are multiples of 16."""
Figures = Mapping[str, Media | Mapping[str, Media]]
"""Figures by name; several under one name, by caption, are laid out side by side."""


def _nothing(*_: Any) -> dict[str, Any]:
    return {}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Part:
    """Display of a section in the report.

    `page.PARTS` maps the name of the section's result to the part; the template
    `templates/sections/NAME.html` has its sentences, each below a condition on the result.
    """

    title: str
    """Heading."""
    label: str
    """A short heading, for links."""
    draw: Callable[[Any, Explanation], Figures] = _nothing
    """Returns the figures of a result and its explanation by file name."""
    values: Callable[[Any, Explanation], Mapping[str, Any]] = _nothing
    """Returns further values for the template."""
