"""`drone-rl <command> [setting=value ...]`: find the command and run it."""

import importlib
import os
import sys
from typing import Any

import drone_rl
from drone_rl.utils.imports import leave_compiler_unloaded
from drone_rl.utils.memory import look_for_garbage_rarely

USAGE = """\
drone-rl: train, evaluate and audit vision policies of a drone.

usage: drone-rl COMMAND [setting=value ...]

commands
  demo       train with the defaults, then evaluate, film and explain the result
  train      train a policy; writes checkpoints and logs under outputs/train
  evaluate   evaluate a policy in held-out environments: table, JSON, videos
  play       film a policy, or watch it in dm_control's viewer
  explain    explain what a policy has learned, and what to trust, in an HTML report
  report     build the report of explanations again, or one report of several policies
  verdict    judge a policy: good, poor or one-sided, proved or not; JSON and an exit status
  prove      verify a policy for all placements of the cubes; writes a certificate
  check      check a certificate by new rollouts; JSON and an exit status
  places     map a policy's decisions over the positions of one cube
  shifts     measure robustness to light, camera, object sizes, faults and motion
  bodies     compare verdicts under several vehicle dynamics, winds and camera mounts
  chain      compute the exact probability of each outcome under sampled actions
  export     write a policy as safetensors with a model card, or as an ONNX model
  sweep-report  compare the runs of a sweep: CSV, JSON, one HTML page
  bench      measure the figures in the README

examples
  drone-rl train                       train with the defaults
  drone-rl train seed=1 device=cuda    change settings
  drone-rl train -m seed=0,1,2         one run for each value, in parallel
  drone-rl train resume=RUN_FOLDER     resume an interrupted run
  drone-rl evaluate                    evaluate the newest policy
  drone-rl explain policy=good         explain a policy of the package
  drone-rl COMMAND --help              every setting of a command
  drone-rl --version                   the version
"""
DEMO_USAGE = """\
drone-rl demo [setting=value ...]

Runs three commands, each with its own folder under outputs/:
  drone-rl train [setting=value ...]   with the given settings
  drone-rl evaluate                    the trained policy
  drone-rl explain                     the same policy

The settings are those of drone-rl train; drone-rl train --help lists them.
"""
COMMANDS = {
    "train": "train",
    **dict.fromkeys(("evaluate", "play"), "evaluation"),
    **dict.fromkeys(("explain", "report"), "explanation"),
    "verdict": "evaluation",
    **dict.fromkeys(("prove", "check", "places"), "verification"),
    **dict.fromkeys(("shifts", "bodies"), "evaluation"),
    "chain": "verification",
    "export": "evaluation",
    "sweep-report": "sweep_report",
    "bench": "bench",
}
"""Module in `drone_rl.cli` of each command; `demo` runs three of them."""

CLOSED = 128 + 13
"""Exit status when standard output is closed, as of a program that SIGPIPE ends."""


def main() -> None:
    """Entry point of `drone-rl`."""
    try:
        status = _main(sys.argv[1:])
        sys.stdout.flush()
    except BrokenPipeError:
        status = CLOSED
        _let_output_go()
    except OSError as error:
        status = 2
        print(f"error: standard output can't be written ({error.strerror})", file=sys.stderr)
        _let_output_go()
    sys.exit(status)


def _let_output_go() -> None:
    """Discard buffered output, which the interpreter would write at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _main(args: list[str]) -> int:
    """Run a command line; return the exit status."""
    if not args or args[0] in ("-h", "--help", "help"):
        print(USAGE)
        return 0
    if args[0] in ("-V", "--version"):
        print(f"drone-rl {drone_rl.__version__}")
        return 0
    name, overrides = args[0], args[1:]
    if name not in ("demo", *COMMANDS):
        sys.exit(f"error: command {name!r} is unknown; use one of: demo, {', '.join(COMMANDS)}")
    if name == "demo" and {"-h", "--help"} & set(overrides):
        print(DEMO_USAGE)
        return 0
    look_for_garbage_rarely()
    from drone_rl.cli.hydra.messages import guarded  # slow: imports Hydra

    leave_compiler_unloaded()
    steps = [("train", overrides), ("evaluate", []), ("explain", [])]
    return guarded(lambda: _run_all(steps if name == "demo" else [(name, overrides)]))


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
