"""`drone-rl <command> [setting=value ...]`: find the command and run it."""

import gc
import importlib
import os
import sys
from typing import Any

import drone_rl
from drone_rl.cli.commands import COMMANDS, TABLE
from drone_rl.utils.exit_codes import INTERRUPTED, OUTPUT_CLOSED, USER_ERROR
from drone_rl.utils.unloaded_compiler import leave_compiler_unloaded

USAGE = """\
drone-rl: train, evaluate and audit vision policies of a drone.

usage: drone-rl COMMAND [setting=value ...]

commands
  demo          train with the defaults, then evaluate, film and explain the result
{commands}

examples
  drone-rl train                       train with the defaults
  drone-rl train seed=1 device=cuda    change settings
  drone-rl train -m seed=0,1,2         one run for each value, in parallel
  drone-rl train resume=RUN_FOLDER     resume an interrupted run
  drone-rl evaluate                    evaluate the newest policy
  drone-rl explain policy=good         explain a shipped policy
  drone-rl COMMAND --help              the settings and groups of a command, and examples
  drone-rl COMMAND --help all          every setting, those inside groups included
  drone-rl COMMAND --help NAME         one setting, or a group of them such as optimizer
  drone-rl --version                   the version
""".format(commands="\n".join(f"  {name:<12}  {entry['about']}" for name, entry in TABLE.items()))
DEMO_USAGE = """\
drone-rl demo [setting=value ...]

Runs three commands, each with its own folder under outputs/:
  drone-rl train [setting=value ...]   with the given settings
  drone-rl evaluate                    the trained policy
  drone-rl explain                     the same policy

The settings are those of drone-rl train; drone-rl train --help lists them.
"""


def main() -> None:
    """Entry point of `drone-rl`."""
    _replace_closed_streams()
    try:
        status = _main(sys.argv[1:])
        sys.stdout.flush()
    except KeyboardInterrupt:  # while libraries are imported; `guarded` answers later ones
        status = INTERRUPTED
        print("error: interrupted", file=sys.stderr)
    except BrokenPipeError:
        status = OUTPUT_CLOSED
        _discard_output()
    except SystemExit as stop:  # a command that a signal or a closed pipe has ended
        status = stop.code
        if status == OUTPUT_CLOSED:
            _discard_output()
    except OSError as error:
        status = USER_ERROR
        print(f"error: standard output can't be written ({error.strerror})", file=sys.stderr)
        _discard_output()
    sys.exit(status)


def _replace_closed_streams() -> None:
    """Discard output to streams that were closed before the start, as by `>&-`."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_WRONLY), "w"))


_DEMO = ("evaluate", "explain")
"""What a demo runs after its training."""


def _discard_output() -> None:
    """Discard buffered output, which the interpreter would write at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _main(args: list[str]) -> int:
    """Run a command line; return the exit status."""
    if args[:1] == ["help"] and len(args) > 1:
        args = [args[1], "--help", *args[2:]]
    if not args or args[0] in ("-h", "--help", "help"):
        print(USAGE)
        return 0
    if {"-V", "--version"} & set(args) or args == ["version"]:
        print(f"drone-rl {drone_rl.__version__}")
        return 0
    name, overrides = args[0], args[1:]
    if name not in ("demo", *COMMANDS):
        from drone_rl.cli.hydra.mistakes import no_command  # slow: imports Hydra

        print(f"error: {no_command(name, overrides, ['demo', *COMMANDS])}", file=sys.stderr)
        return USER_ERROR
    if name == "demo" and {"-h", "--help"} & set(overrides):
        print(DEMO_USAGE)
        return 0
    _configure_process()
    from drone_rl.cli.hydra.messages import guarded  # slow: imports Hydra

    leave_compiler_unloaded()
    steps = [("train", overrides), *((step, _same_policy(overrides)) for step in _DEMO)]
    steps = steps if name == "demo" else [(name, overrides)]
    return guarded(lambda: _run_all(steps))


def _configure_process() -> None:
    """Set what libraries read when they are imported."""
    gc.set_threshold(50_000, 50, 100)  # imports create half a million objects and no garbage
    # oneDNN keeps a kernel for each batch length; enough for two layers and 32 environments
    os.environ.setdefault("ONEDNN_PRIMITIVE_CACHE_CAPACITY", "128")
    os.environ["MPLBACKEND"] = "agg"  # a notebook's backend may be missing here
    if sys.platform == "linux" and not {"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys():
        os.environ["MUJOCO_GL"] = "disabled"  # only the viewer's window needs OpenGL


def _same_policy(overrides: list[str]) -> list[str]:
    """Return the settings by which other commands find the policy that a training makes."""
    shared = [o for o in overrides if o.lstrip("+").startswith(("paths.", "plugins="))]
    runs = [o for o in overrides if o.startswith(("hydra.run.dir=", "resume="))]
    folders = [run.partition("=")[2] for run in runs if run not in ("resume=latest", "resume=null")]
    return [*shared, *(f"policy={folder}" for folder in folders[-1:])]


def _run_all(steps: list[tuple[str, list[str]]]) -> int:
    """Run commands one after the other until one fails."""
    from drone_rl.cli.hydra.composition import run_command

    for name, overrides in steps:
        if status := run_command(name.replace("-", "_"), find_command(name), overrides):
            return status
    return 0


def find_command(name: str) -> Any:
    """Return the settings class of a command, such as `SweepReportCommand`."""
    module = importlib.import_module(f"drone_rl.cli.{COMMANDS[name]}")
    return getattr(module, f"{name.title().replace('-', '')}Command")


if __name__ == "__main__":
    main()
