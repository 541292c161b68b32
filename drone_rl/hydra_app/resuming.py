"""What a training's command line leaves out: a sweep's folder, the settings of a run."""

from collections.abc import Sequence
from pathlib import Path

from drone_rl.hydra_app.names import former, networks
from drone_rl.sweeps.naming import is_sweep, sweep_name
from drone_rl.sweeps.runs import quoted
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import refuse_links
from drone_rl.utils.overrides import taken_over

_FOLDER = "hydra.sweep.dir=${paths.outputs}/${hydra.job.config_name}/multiruns/"


def complete(overrides: Sequence[str]) -> list[str]:
    """Makes `resume=FOLDER` mean the settings of that run and its folder; names a sweep's.

    Raises:
        InputError: There is no such run, or it is not plain what its settings were.
    """
    typed = networks(overrides)
    if is_sweep(typed):
        is_named = any(o.startswith("hydra.sweep.dir=") for o in typed)
        return typed if is_named else [*typed, _FOLDER + sweep_name(typed)]
    folders = [o.split("=", 1)[1] for o in typed if o.startswith("resume=")]
    if not folders or folders[-1] in ("", "null"):
        return typed
    if any(o.startswith("hydra.run.dir=") for o in typed):
        return typed  # a sweep gives all settings itself
    folder = Path(folders[-1])
    if not (folder / "checkpoints" / "last.pt").is_file():
        raise InputError(f"resume={folder} has no checkpoints/last.pt; give the folder of a run")
    refuse_links(folder)
    kept = networks(taken_over(folder, [*typed, *former(typed)]))
    return [*kept, *typed, "hydra.mode=RUN", f"hydra.run.dir={quoted(str(folder))}"]
