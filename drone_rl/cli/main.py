"""`drone-rl <command> [setting=value ...]`: finds the command, runs it under Hydra."""

import importlib
import os
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

USAGE = """\
drone-rl: a drone learns to fly from its camera, and you learn whether to trust it.

usage: drone-rl COMMAND [setting=value ...]

commands
  demo       train with the defaults, then evaluate, film and explain the result
  train      learn a policy; writes checkpoints and logs under outputs/train
  evaluate   test a policy on unseen worlds: table, JSON, videos
  play       film a policy, or watch it in dm_control's viewer
  explain    see what a policy sees, and whether to trust it: one HTML report
  report     make the report of explanations again, or of several side by side
  verdict    good, poor or one-sided? as JSON and as an exit status
  export     write a policy as safetensors with a model card
  sweep-report  compare the runs of a sweep: CSV, JSON, one HTML page
  bench      measure every figure that the README quotes

examples
  drone-rl train                       train with the defaults
  drone-rl train seed=1 device=cuda    change settings
  drone-rl train -m seed=0,1,2         one run for each value, side by side
  drone-rl train resume=RUN_FOLDER     go on with an interrupted run
  drone-rl evaluate                    test the newest policy
  drone-rl explain policy=good         explain a policy that travels with the package
  drone-rl COMMAND --help              every setting of a command
"""
COMMANDS = (
    "train",
    "evaluate",
    "play",
    "explain",
    "report",
    "verdict",
    "export",
    "sweep-report",
    "bench",
)


def conf_dir() -> Path:
    """The configuration: of the checkout, or the copy inside an installed wheel."""
    package = Path(__file__).resolve().parents[1]
    beside = package.parent / "conf"
    return beside if (beside / "train.yaml").is_file() else package / "conf"


def main() -> None:
    """Entry point of `drone-rl`."""
    args = sys.argv[1:]
    if not args or args[0] in ("-h", "--help", "help"):
        print(USAGE)
        return
    command, overrides = args[0], args[1:]
    if command == "demo":
        sys.exit(_guarded(_demo, overrides))
    if command not in COMMANDS:
        sys.exit(f"error: command {command!r} is unknown; use one of: demo, {', '.join(COMMANDS)}")
    sys.exit(_guarded(lambda o: run_command(command, o), overrides))


def run_command(command: str, overrides: list[str]) -> int:
    """Composes the settings of one command and runs it.

    Args:
        command: One of `COMMANDS`.
        overrides: As on the command line.

    Returns:
        Exit status.
    """
    import hydra

    from drone_rl.configs import register_configs
    from drone_rl.utils.errors import InputError

    name = command.replace("-", "_")
    stage = importlib.import_module(f"drone_rl.cli.{name}")
    overrides = getattr(stage, "prepare", lambda o: o)(overrides)
    register_configs()
    getattr(stage, "register", lambda: None)()
    statuses: list[int] = []

    def job(config: object) -> object:
        try:
            status, value = stage.run(config)
        except InputError as error:  # one bad run of a sweep leaves the others alone
            print(f"error: {_one_line(error)}", file=sys.stderr)
            status, value = 2, None
        statuses.append(status)
        if status > 128:  # a signal ends a whole sweep, not one run of it
            sys.exit(status)
        return value

    job.__module__ = stage.__name__
    job.statuses = statuses  # where a launcher that runs jobs elsewhere notes how they ended
    wrapped = hydra.main(version_base="1.3", config_path=str(conf_dir()), config_name=name)(job)
    argv = sys.argv
    sys.argv = [f"drone-rl {command}", *overrides]
    try:
        wrapped()
    finally:
        sys.argv = argv
    return max(statuses, default=0)


def _demo(overrides: list[str]) -> int:
    """The main job end to end: `make demo`."""
    status = run_command("train", overrides)
    return status or run_command("evaluate", []) or run_command("explain", [])


def _guarded(command: Callable[[list[str]], int], overrides: list[str]) -> int:
    """Turns the user's mistakes into one line each; bugs keep their traceback."""
    os.environ["HYDRA_FULL_ERROR"] = "1"  # let Hydra's own errors through to be shortened here
    warnings.filterwarnings("ignore", message=".*DISPLAY.*")  # dm_control looks for a screen
    warnings.filterwarnings("ignore", message=".*GLFW.*")
    warnings.filterwarnings(
        "ignore", message=".*WeightUpdaterBase.*"
    )  # torchrl, of its own classes
    from hydra.errors import HydraException
    from omegaconf.errors import OmegaConfBaseException

    from drone_rl.utils.errors import InputError

    try:
        return command(overrides)
    except KeyboardInterrupt:
        print("error: interrupted", file=sys.stderr)
        return 130
    except (InputError, HydraException, OmegaConfBaseException, OSError) as error:
        print(f"error: {_one_line(error)}", file=sys.stderr)
        return 2


def _one_line(error: BaseException) -> str:
    """The most telling message of an error and its causes, on one line."""
    from drone_rl.utils.errors import InputError

    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, InputError):
            return "".join(c if c.isprintable() else "?" for c in str(cause))
        cause = cause.__cause__ or cause.__context__
    text = " ".join(str(error).split()) or type(error).__name__
    if "is not in struct" in text or "Could not override" in text:
        text += "; see drone-rl COMMAND --help for the names that exist"
    if "does not support sweep type" in text:
        text += "; to search an interval, add hydra/sweeper=optuna"
    return text


if __name__ == "__main__":
    main()
