"""From a command line to a command's settings, and from those to runs."""

import contextlib
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

import hydra
from hydra._internal.hydra import Hydra
from hydra.core import utils as hydra_utils
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf

from drone_rl.cli.hydra.choices import check_choices
from drone_rl.cli.hydra.help import show_help
from drone_rl.cli.hydra.messages import is_output_closed, one_line
from drone_rl.cli.hydra.schemas import register_schemas
from drone_rl.config.configuration import from_config
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import Settings

_MAY_ASK = re.compile(r"^[-+~]|^hydra(?!\.run\.)|^sweep|^experiment")
"""Words on a command line that may ask for many runs, or for groups that do."""
_ASKS = re.compile(r"mode:|sweep: (?!null)")
"""What does so in a file."""


class Command(Protocol):
    """A module of `drone_rl.cli`."""

    __name__: str
    Command: type[Settings]
    """What it can be told."""

    def run(self, settings: Any, folder: Path) -> tuple[int, object]:
        """Does it. Returns the exit status and what a sweep makes best."""
        ...


def conf_dir() -> Path:
    """The configuration: of the checkout, or the copy inside an installed wheel."""
    package = Path(__file__).resolve().parents[2]
    beside = package.parent / "conf"
    return beside if (beside / "train.yaml").is_file() else package / "conf"


def run_command(name: str, command: Command, overrides: Sequence[str]) -> int:
    """Composes the settings of one command and runs it.

    Args:
        name: Of its file in conf/.
        command: Its module.
        overrides: As on the command line.

    Returns:
        Exit status.
    """
    overrides = getattr(command, "prepare", list)(overrides)
    check_choices(overrides, conf_dir())
    register_schemas(**{name: command.Command})
    getattr(command, "register", lambda: None)()
    if {"--help", "-h"} & set(overrides):
        show_help(name, conf_dir(), overrides)
        return 0
    statuses: list[int] = []
    job = _job(command, statuses)
    wrapped = hydra.main(version_base="1.3", config_path=str(conf_dir()), config_name=name)(job)
    argv = sys.argv
    sys.argv = [f"drone-rl {name.replace('_', '-')}", *overrides]
    try:
        with _composed_once(name, overrides), _named_in_errors():
            wrapped()
    finally:
        sys.argv = argv
    return max(statuses, default=0)


@contextlib.contextmanager
def _composed_once(name: str, overrides: Sequence[str]) -> Iterator[None]:
    """Spares Hydra its first composition, a quarter of a second in which it only looks for a mode.

    Only where neither what was typed nor the command's own file can ask for many runs. If another
    file does, Hydra refuses its mode after the second composition.
    """
    text = (conf_dir() / f"{name}.yaml").read_text()
    if any(map(_MAY_ASK.search, overrides)) or _ASKS.search(text):
        yield
        return
    asked = Hydra.get_mode
    Hydra.get_mode = lambda *_, **__: RunMode.RUN
    try:
        yield
    finally:
        Hydra.get_mode = asked


@contextlib.contextmanager
def _named_in_errors() -> Iterator[None]:
    """Lets an error say which of Hydra's own files it is about."""
    save = hydra_utils._save_config

    def save_named(cfg: DictConfig, filename: str, output_dir: Path) -> None:
        try:
            save(cfg, filename, output_dir)
        except OSError as error:
            path = str(error.filename or output_dir / filename)
            raise OSError(error.errno, error.strerror, path) from error

    hydra_utils._save_config = save_named
    try:
        yield
    finally:
        hydra_utils._save_config = save


def read_settings(cls: type[Settings], config: DictConfig) -> Any:
    """Composed settings, every reference resolved, as those of a command."""
    return from_config(cls, OmegaConf.to_container(config, resolve=True))


def _job(command: Command, statuses: list[int]) -> Callable[[DictConfig], object]:
    """What Hydra calls for each run."""

    def job(config: DictConfig) -> object:
        try:
            settings = read_settings(command.Command, config)
            status, value = command.run(settings, Path(HydraConfig.get().runtime.output_dir))
        except (InputError, OSError) as error:  # one bad run of a sweep leaves the others alone
            if isinstance(error, BrokenPipeError) and is_output_closed():
                raise
            print(f"error: {one_line(error)}", file=sys.stderr)
            status, value = 2, None
        statuses.append(status)
        if status > 128:  # a signal ends a whole sweep, not one run of it
            sys.exit(status)
        return value

    job.__module__ = command.__name__
    vars(job)["statuses"] = statuses  # where a launcher notes how jobs ended that ran elsewhere
    return job
