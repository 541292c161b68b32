"""Where commands leave what they make."""

import dataclasses

from drone_rl.utils.settings import Settings


@dataclasses.dataclass(frozen=True, kw_only=True)
class PathsSettings(Settings):
    """Folders."""

    outputs: str = "outputs"
    """Folder under which every command makes a folder of its own."""
