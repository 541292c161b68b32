"""Size of the code base and of the files that a new user reads first."""

import re
from pathlib import Path
from typing import Any

from tools.size import measure

KEYS = (
    *("package_lines", "package_modules", "packages", "single_use_modules", "type_suppressions"),
    *("flagged_phrases", "readme_lines"),
)
"""Counts of `make count` that are kept."""
_ROOT = Path(__file__).resolve().parents[1]
_TASK = re.compile(r'^```python title="post.py"\n(.*?)^```$', re.DOTALL | re.MULTILINE)


def bench_size(root: Path = _ROOT) -> dict[str, Any]:
    """Count lines, modules and phrases.

    Args:
        root: Folder of the checkout.

    Returns:
        The counts of `make count` in `KEYS`; "readme_words"; "training_file_lines", of
        training/train.py; "minimal_task_lines", of the tutorial's task.

    Raises:
        ValueError: The tutorial contains no or several tasks.
    """
    counts = measure(root)
    (task,) = _TASK.findall((root / "docs" / "tutorials" / "task.md").read_text())
    training = (root / "drone_rl" / "training" / "train.py").read_text()
    return {
        **{key: counts[key] for key in KEYS},
        "readme_words": len((root / "README.md").read_text().split()),
        "training_file_lines": len(training.splitlines()),
        "minimal_task_lines": len(task.splitlines()),
    }
