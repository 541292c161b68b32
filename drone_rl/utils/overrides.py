"""Read and check the overrides (`key=value`) in the folder of an earlier run.

Overrides on the command line may name classes, files and programs. Those in foreign files may not.
"""

import re
import shlex
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Annotated

from annotated_types import Predicate

from drone_rl.utils.errors import InputError
from drone_rl.utils.readers import read_yaml
from drone_rl.utils.schema import Annotation, Several, Text, shown

_OF_ONE_FOLDER = re.compile(r"\+{0,2}(resume|trial|demonstrations|paths(\.\w+)?)")
"""Overrides that do not affect how a run continues: its folder (it may have been moved), its sweep,
and the demonstrations that it has cloned."""
MOST_OVERRIDES = 200
"""Largest number of overrides of a run."""
_LONGEST = 500
_NAME = r"[A-Za-z]\w*"
_HARMLESS = re.compile(rf"(\+{{0,2}}{_NAME}([./@]{_NAME})*=.*|~{_NAME}([./@]{_NAME})*)")
_SCALAR = r"[\w.+-]*"
_VALUE = rf"({_SCALAR}|\[({_SCALAR}(, ?{_SCALAR})*)?\])"
_SECTIONS = (
    "task|appearance|dynamics|actions|camera|trainer|network|returns|objective|optimizer|"
    "scheduler|transforms|inputs|provable|cloning"
)
_TAKEN_OVER = (
    r"(seed|evaluate_after|renderer)=\w*",
    r"device=(cpu|cuda)(:\d+)?",
    rf"({_SECTIONS}|collector|logger|experiment|sweep)=[A-Za-z][\w-]*",
    rf"\+{{0,2}}({_SECTIONS})(\.{_NAME}){{1,3}}={_VALUE}",
    rf"~transforms\.{_NAME}",
    rf"inputs=\[({_NAME}(, ?{_NAME})*)?\]",
    rf"\+{{0,2}}inputs@inputs\.{_NAME}={_NAME}",
    rf"collector\.(num_envs|num_threads|num_cpus|max_lost_workers|compiled)={_SCALAR}",
)
"""Overrides that a resumed run takes from the file: choices by name and plain values."""


class _Command(Annotation):
    hint = Annotated[Text(20_000).hint, Predicate(lambda text: _is_safe_command(text))]

    @property
    def reason(self) -> str:
        return "must be a training command: drone-rl train and settings, each quoted for a shell"


def _is_safe_command(text: str) -> bool:
    try:
        words = shlex.split(text)
    except ValueError:
        return False
    return words[:2] == ["drone-rl", "train"] and shlex.join(words) == text and "`" not in text


COMMAND = _Command()
"""Kind (see `schema`) of a training command that is safe to copy into a shell."""


def check_harmless(override: str, where: str) -> str:
    """Return an override if it is safe to copy into a shell.

    Raises:
        InputError: It refers to code, a Hydra setting or the value of another setting.
    """
    text = Text(_LONGEST).read(override, where)
    key = text.partition("=")[0].lstrip("+~")
    if not _HARMLESS.fullmatch(text) or key.startswith("hydra") or "${" in text or "`" in text:
        raise InputError(
            f"{where} sets {shown(text)}, which is not a plain setting; remove it from the file"
        )
    return text


def read_overrides(folder: Path) -> list[str]:
    """Return the overrides in a run's folder, if any; see `read_yaml` and `check_harmless`."""
    path = folder / ".hydra" / "overrides.yaml"
    if not path.exists():
        return []
    content = read_yaml(path)
    texts = Several(Text(_LONGEST), 0, MOST_OVERRIDES).read(content, str(path))
    return [check_harmless(text, str(path)) for text in texts]


def taken_over(folder: Path, typed: Collection[str]) -> list[str]:
    """Return the recorded overrides of a resumed run, except those on the command line (`typed`).

    Raises:
        InputError: An override may not be taken from a file.
    """
    keys = {_key(override) for override in typed}
    recorded = [
        o for o in read_overrides(folder) if _key(o) not in keys and not _is_of_one_folder(o)
    ]
    for override in must_be_typed(recorded):
        raise InputError(
            f"{folder}/.hydra/overrides.yaml sets {shown(override)}, which can't be read from a "
            "file for safety; if you trust it, repeat it on the command line; if there is no such "
            "setting now, start a new run"
        )
    return recorded


def must_be_typed(overrides: Iterable[str]) -> list[str]:
    """Return the overrides of a run that `taken_over` rejects."""
    return [
        override
        for override in overrides
        if not _is_of_one_folder(override)
        and not any(re.fullmatch(pattern, override) for pattern in _TAKEN_OVER)
    ]


def _is_of_one_folder(override: str) -> bool:
    return bool(_OF_ONE_FOLDER.fullmatch(override.partition("=")[0]))


def _key(override: str) -> str:
    return override.partition("=")[0].lstrip("+~")
