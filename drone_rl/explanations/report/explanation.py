"""An explanation read from its files, and the parts of the report that display its sections."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from drone_rl.sim.vocabulary import ShownActions, TaskVocabulary, shown_actions, terms_of
from drone_rl.utils.archives import read_arrays
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import parse_json, read_bytes
from drone_rl.utils.limits import EXPLANATION_BYTES
from drone_rl.utils.schema import as_mapping
from drone_rl.utils.text import SEED_KEYS, Paragraph

FORMAT = "drone_rl explanation"
FORMAT_VERSION = 3
HEADER = frozenset(
    {
        *("format", "format_version", "name", "date", "settings", "seconds", "actions", "terms"),
        *("provenance", *SEED_KEYS),
    }
)
"""Entries of explanation.json that do not belong to a section."""


METHOD_NAMES = {
    "grad_cam": "Grad-CAM",
    "grad_cam_logit": "Grad-CAM (logit)",
    "saliency": "saliency",
    "integrated_gradients": "integrated gradients",
    "occlusion": "occlusion",
}
"""Attribution methods and their display names."""


@dataclasses.dataclass
class Explanation:
    """The files that `drone-rl explain` wrote for one policy."""

    numbers: dict[str, Any]  # contents of explanation.json
    arrays: dict[str, NDArray]  # arrays of arrays.npz
    data: dict[str, NDArray]  # arrays of dataset.npz
    source: str = "explanation.json"  # display name of the file of the numbers

    @property
    def name(self) -> str:
        """Name of the policy."""
        return str(self.numbers["name"])

    @property
    def actions(self) -> ShownActions:
        """The policy's actions."""
        return shown_actions(self.numbers)

    @property
    def terms(self) -> TaskVocabulary:
        """Vocabulary of its task."""
        return terms_of(self.numbers)

    @classmethod
    def load(cls, folder: Path) -> "Explanation":
        """Read a folder.

        Raises:
            InputError: A file is missing, damaged, too large, or of another version.
        """
        try:
            content = read_bytes(folder / "explanation.json", EXPLANATION_BYTES)
            parsed = parse_json(content, "explanation.json", allow_nan=True)
            numbers = dict(as_mapping(parsed, "explanation.json"))
            version = numbers.get("format"), numbers.get("format_version")
            if version != (FORMAT, FORMAT_VERSION):
                raise InputError(f"it has no format version {FORMAT_VERSION}")
            arrays, data = (read_arrays(folder / f"{name}.npz") for name in ("arrays", "dataset"))
        except (InputError, OSError) as error:
            raise InputError(
                f"explanation {folder} can't be read ({error}); run drone-rl explain again"
            ) from None
        return cls(numbers, arrays, data, f"{folder.name}/explanation.json")


Media = Image.Image | Figure | NDArray
"""An image, a chart, or a film (T, H, W, 3), uint8, with sizes that are multiples of 16."""
Figures = Mapping[str, Media | Mapping[str, Media]]
"""Figures by name; several under one name, by caption, are laid out side by side."""


def _nothing(_: Any) -> dict[str, Any]:
    return {}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Part:
    """Display of a section in the report.

    `page.PARTS` maps a name to the part; `templates/sections/NAME.html` is its template.
    """

    title: str
    """Heading."""
    label: str
    """A short heading, for links."""
    needs: tuple[str, ...]
    """Entries of `explanation.json` that it shows; if one is missing, the part is left out."""
    text: Mapping[str, Paragraph] = dataclasses.field(default_factory=dict)
    """Paragraphs by name."""
    draw: Callable[[Explanation], Figures] = _nothing
    """Returns the figures of one policy by file name."""
    extras: Callable[[Explanation], Mapping[str, Any]] = _nothing
    """Returns further values for the template."""
    compare: Callable[[Sequence[Explanation]], Figures] = _nothing
    """Returns figures of all policies together; they are saved but not on the page."""

    def fits(self, explanation: Explanation) -> bool:
        """Return whether an explanation has the entries that this part shows."""
        return all(explanation.numbers.get(key) is not None for key in self.needs)
