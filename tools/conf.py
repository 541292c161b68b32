"""`python -m tools.conf [--check]`: writes the files of conf/ that hold the defaults of settings.

The defaults and their descriptions are defined in `drone_rl/config`. A generated file keeps its
head, up to the first empty line; the settings below are generated. Files with other values than the
defaults are written by hand.
"""

import re
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from drone_rl.cli.hydra.composition import GROUPS, PARTS, conf_dir
from drone_rl.config import TASKS
from drone_rl.utils.settings import Settings
from tools.readme.settings import meanings

_START = re.compile(r"^defaults: \[(base_\w+), _self_\]$", re.MULTILINE)
_PARTLY_OF_OTHERS = ("a2c", "ppo")
"""Objectives whose files also choose other groups."""


def generated_files(conf: Path) -> Iterator[tuple[Path, type[Settings]]]:
    """Yield the files that are generated, each with the class of its settings.

    Args:
        conf: The folder conf/.
    """
    chosen = {
        "appearance": "minimal",
        "dynamics": "computer_vision",
        "actions": "moves",
        "camera": "small",
    }
    for task in TASKS.values():
        yield conf / "task" / f"{task.name}.yaml", task
    for group, settings in GROUPS.items():
        yield conf / group / f"{chosen.get(group, 'default')}.yaml", settings
    for group, part in PARTS.items():
        bases = {f"base_{v.registered_name()}": v for v in part.variants()}
        for path in sorted((conf / group).glob("*.yaml")):
            found = _START.search(path.read_text())
            if (found and found[1] in bases) or path.stem in _PARTLY_OF_OTHERS:
                yield path, bases[found[1] if found else f"base_{path.stem}"]


def make_text(path: Path, settings: type[Settings]) -> str:
    """Return what a file should contain.

    Args:
        path: The file, whose head is kept.
        settings: Class of its settings.
    """
    head = path.read_text().partition("\n\n")[0].rstrip("\n")
    words, lines = meanings(settings), [head, ""]
    for name, value in settings().values().items():
        comment = re.sub(r"\bnone\b(?= (for|of|keeps|takes|starts))", "null", words[name])
        lines += textwrap.wrap(comment, 100, initial_indent="# ", subsequent_indent="# ")
        lines.append(f"{name}: {_shown(value)}")
    return "\n".join(lines).rstrip("\n") + "\n"


def _shown(value: Any) -> str:
    if isinstance(value, float):
        text = repr(value)
        return text if "e" not in text or "." in text else text.replace("e", ".0e")
    if isinstance(value, list):
        return f"[{', '.join(map(_shown, value))}]"
    return yaml.safe_dump(value, default_flow_style=True, width=1000).splitlines()[0]


def main(arguments: list[str]) -> int:
    """Write the files, or check them; returns the exit status."""
    stale = []
    for path, settings in generated_files(conf_dir()):
        text = make_text(path, settings)
        if path.read_text() != text:
            stale.append(path)
            if "--check" not in arguments:
                path.write_text(text)
    print(*(f"{path}: written again" for path in stale), sep="\n")
    return int(bool(stale)) if "--check" in arguments else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
