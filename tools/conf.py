"""`python -m tools.conf [--check]`: writes defaults and descriptions of settings into conf/.

Both are defined in the classes of the settings. A file keeps its head, up to the first empty line.
In the files of groups' defaults all settings are generated; in files of commands, transforms and
loggers the comment above each setting. Files of a group with other values are written by hand.
"""

import re
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from drone_rl.cli.hydra.composition import GROUPS, PARTS, SEVERAL, conf_dir
from drone_rl.cli.main import COMMANDS, find_command
from drone_rl.config import TASKS
from drone_rl.utils.settings import Settings
from tools.readme.settings import about, meanings

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


def described_files(conf: Path) -> Iterator[tuple[Path, dict[str, str]]]:
    """Yield the files of commands, transforms and loggers, each with its settings' descriptions.

    Args:
        conf: The folder conf/.
    """
    for name in COMMANDS:
        yield conf / f"{name.replace('-', '_')}.yaml", {**meanings(find_command(name))}
    for group, part in SEVERAL.items():
        words = {}
        for variant in part.variants():
            name = variant.registered_name()
            words[name] = about(variant)
            words |= {f"{name}.{key}": text for key, text in meanings(variant).items()}
        yield from ((path, words) for path in sorted((conf / group).glob("*.yaml")))


def describe(text: str, words: dict[str, str]) -> str:
    """Return a file of settings with a description above each of them.

    Args:
        text: The file, whose head and values are kept.
        words: Descriptions of settings by name, those of a group as "group.name".
    """
    head, separator, body = text.partition("\n\n")
    lines, group = [head, ""], ""
    for line in body.splitlines():
        name = line.partition(":")[0].strip()
        is_inside = line.startswith("  ")
        group = group if is_inside else name
        description = words.get(f"{group}.{name}" if is_inside else name)
        if description:
            while lines[-1].lstrip().startswith("#"):
                lines.pop()
            lines += _comment(description, "  " * is_inside)
        lines.append(line)
    return "\n".join(lines) + "\n" if separator else text


def make_text(path: Path, settings: type[Settings]) -> str:
    """Return what a file should contain.

    Args:
        path: The file, whose head is kept.
        settings: Class of its settings.
    """
    head = path.read_text().partition("\n\n")[0].rstrip("\n")
    words, lines = meanings(settings), [head, ""]
    for name, value in settings().values().items():
        lines += _comment(words[name])
        lines.append(f"{name}: {_shown(value)}")
    return "\n".join(lines).rstrip("\n") + "\n"


def _comment(words: str, indent: str = "") -> list[str]:
    """A description as lines of a comment."""
    start = f"{indent}# "
    return textwrap.wrap(
        words, 100, initial_indent=start, subsequent_indent=start, break_on_hyphens=False
    )


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
    conf = conf_dir()
    texts = {path: make_text(path, settings) for path, settings in generated_files(conf)}
    texts |= {path: describe(path.read_text(), words) for path, words in described_files(conf)}
    for path, text in texts.items():
        if path.read_text() != text:
            stale.append(path)
            if "--check" not in arguments:
                path.write_text(text)
    print(*(f"{path}: written again" for path in stale), sep="\n")
    return int(bool(stale)) if "--check" in arguments else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
