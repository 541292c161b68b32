"""Complete the command line of `drone-rl train`: a sweep's folder, `resume=`."""

import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml
from hydra.core.hydra_config import HydraConfig
from omegaconf import OmegaConf

from drone_rl.sweeps.manifest import is_sweep, path_argument, quoted, sweep_name
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import last_of, refuse_links, trained_policies, write_atomically
from drone_rl.utils.overrides import must_be_typed, taken_over

_FOLDER = "hydra.sweep.dir=${paths.outputs}/${hydra.job.config_name}/multiruns/"
_NO_EARLY_FILES = ("hydra.output_subdir=null", "++hydra.job_logging.handlers.file.delay=true")
"""Keep Hydra from writing settings before they are checked, and from opening a log."""


def complete(overrides: Sequence[str]) -> list[str]:
    """Add the folder of a sweep, or the folder and settings of a resumed run, to a command line.

    Raises:
        InputError: There is no run to resume, or it has a setting that may not come from a file.
    """
    folders = [o.split("=", 1)[1] for o in overrides if o.startswith("resume=")]
    if is_sweep(overrides) and folders:
        raise InputError(
            "resume= continues one run, not with -m; to continue a sweep, repeat its command"
        )
    if is_sweep(overrides):
        is_named = any(o.startswith("hydra.sweep.dir=") for o in overrides)
        return [*overrides] if is_named else [*overrides, _FOLDER + sweep_name(overrides)]
    if not folders or folders[-1] in ("", "null"):
        return [*overrides]
    if any(o.startswith("hydra.run.dir=") for o in overrides):
        return [*overrides, *_NO_EARLY_FILES]  # a sweep's command line has all settings
    folder = Path(_unquoted(folders[-1]))
    if folders[-1] == "latest":
        folder = _newest_run(_outputs(overrides))
    if not _is_run(folder):
        above = next(filter(_is_run, folder.parents), None)
        remedy = (
            "the folder of a run" if above is None else f"its folder, resume={path_argument(above)}"
        )
        raise InputError(f"resume={folder} has no checkpoints/last.pt; give {remedy}")
    refuse_links(folder)
    kept = taken_over(folder, overrides)
    plain = [f"resume={path_argument(folder)}" if o.startswith("resume=") else o for o in overrides]
    place = ["hydra.mode=RUN", f"hydra.run.dir={quoted(str(folder))}", *_NO_EARLY_FILES]
    return [*kept, *plain, *place]


def spare_run(overrides: Sequence[str]) -> list[str]:
    """Keep Hydra from replacing the settings in a run's folder, if `hydra.run.dir=` names one.

    `resume=` and model cards read them; those of another command, or a refused one, are not its.
    """
    folders = [o.partition("=")[2] for o in overrides if o.startswith("hydra.run.dir=")]
    is_run = bool(folders) and _is_run(Path(_unquoted(folders[-1])))
    is_kept = not is_run or _NO_EARLY_FILES[0] in overrides
    return [*overrides] if is_kept else [*overrides, _NO_EARLY_FILES[0]]


def _is_run(folder: Path) -> bool:
    return last_of(folder).is_file()


def _outputs(typed: Sequence[str]) -> Path:
    """Return the folder of all outputs."""
    folders = [o.partition("=")[2] for o in typed if o.startswith("paths.outputs=")]
    return Path(_unquoted((folders or ["outputs"])[-1]))


def _newest_run(outputs: Path) -> Path:
    """Return the folder of the run that `policy=latest` names too."""
    newest = next(iter(trained_policies(outputs)), None)
    if newest is None:
        raise InputError(
            f"resume=latest, but there is no run under {outputs}/train; give the folder of a run"
        )
    return newest.parents[1]


def check_folder(resume: str, folder: Path) -> None:
    """Raise an `InputError` if hydra.run.dir, `folder`, is not the folder of the resumed run."""
    if Path(resume).resolve() != folder.resolve():
        raise InputError(
            f"resume={resume} resumes in that folder, but hydra.run.dir={folder} differs; omit "
            "hydra.run.dir"
        )


def note_settings(folder: Path) -> None:
    """Write the accepted settings of this command into a run's folder, for `resume=`."""
    path = folder / ".hydra" / "overrides.yaml"
    path.parent.mkdir(exist_ok=True)
    write_atomically(path, yaml.safe_dump(_overrides(), allow_unicode=True, width=10_000))


def resume_command(folder: Path) -> str:
    """Return the shell command that resumes the run in a folder, from any working directory."""
    settings = [f"resume={path_argument(folder.absolute())}", *must_be_typed(_overrides())]
    return shlex.join(["drone-rl", "train", *settings])


def _overrides() -> list[str]:
    """The settings of the running command."""
    values: Any = OmegaConf.to_container(HydraConfig.get().overrides.task)  # without interpolation
    return [str(override) for override in values]


def _unquoted(value: str) -> str:
    """A value without its quotes for Hydra."""
    is_quoted = len(value) > 1 and value[0] == value[-1] and value[0] in "'\""
    return re.sub(r"\\(.)", r"\1", value[1:-1]) if is_quoted else value
