"""Which files of conf/ a group offers: the schemas that they start from are not choices."""

import re
from collections.abc import Sequence
from pathlib import Path

from drone_rl.utils.errors import InputError

SCHEMA = "base_"
"""What names of schemas begin with, see `drone_rl.cli.hydra.schemas`."""
_NOT_FOUND = re.compile(
    r"Could not find '(?P<what>[^']+)' Available options in '[^']+': (?P<all>.*)"
)
_SEARCH_PATH = re.compile(r" ?Config search path: .*")
_OWN_FOLDERS = ("--config-dir", "-cd", "hydra.searchpath")
"""What adds folders of the user's own, whose files are not known here."""


def check_choices(overrides: Sequence[str], conf: Path) -> None:
    """Makes sure that a command line chooses no schema, and no sweep that there is not.

    Hydra takes both: a schema is to it one more file, and the group sweep is optional.

    Args:
        overrides: As on the command line.
        conf: The folder of the configuration.

    Raises:
        InputError: It does; the message lists the choices.
    """
    has_own = any(override.startswith(_OWN_FOLDERS) for override in overrides)
    for override in overrides:
        key, _, value = override.partition("=")
        group = key.lstrip("+").partition("@")[0]
        if not (conf / group).is_dir() or group.startswith((".", "/")) or not group:
            continue
        names = [name.strip() for name in value.split(",")]
        wrong = [name for name in names if name.startswith(SCHEMA)]
        if group == "sweep" and not has_own:
            wrong += [
                n for n in names if n != "null" and not (conf / group / f"{n}.yaml").is_file()
            ]
        if wrong:
            offered = sorted(path.stem for path in (conf / group).glob("*.yaml"))
            raise InputError(_message(f"{group}/{wrong[0]}", offered))


def without_schemas(text: str) -> str:
    """A message of Hydra's, on one line: its choices without schemas, nor where it looked."""
    text = _SEARCH_PATH.sub("", text)
    found = _NOT_FOUND.search(text)
    if found is None:
        return text
    offered = [name for name in found["all"].split() if not name.startswith(SCHEMA)]
    return _message(found["what"], offered)


def _message(what: str, offered: Sequence[str]) -> str:
    group, _, name = what.rpartition("/")
    return f"could not find {what} ({group}={name}); give one of: {', '.join(offered)}"
