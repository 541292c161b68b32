"""`drone-rl <command> [setting=value ...]`: finds the command and runs it."""

import importlib
import os
import sys
from typing import cast

import drone_rl
from drone_rl.cli.usage import COMMANDS, DEMO_USAGE, USAGE
from drone_rl.utils.imports import leave_compiler_unloaded
from drone_rl.utils.memory import look_for_garbage_rarely

CLOSED = 128 + 13
"""Exit status if nobody reads standard output any more, as of a program that SIGPIPE ends."""


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
    """What is left in the buffer goes nowhere, or the interpreter would try once more."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _main(args: list[str]) -> int:
    """Runs what was typed. Returns the exit status."""
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
    from drone_rl.cli.hydra.messages import guarded  # usage and typing errors don't wait for Hydra

    leave_compiler_unloaded()
    steps = [("train", overrides), ("evaluate", []), ("explain", [])]
    return guarded(lambda: _run_all(steps if name == "demo" else [(name, overrides)]))


def _run_all(steps: list[tuple[str, list[str]]]) -> int:
    """One command after the other, until one fails."""
    from drone_rl.cli.hydra.composition import Command, run_command

    for name, overrides in steps:
        file = name.replace("-", "_")
        command = cast(Command, importlib.import_module(f"drone_rl.cli.{file}"))
        if status := run_command(file, command, overrides):
            return status
    return 0


if __name__ == "__main__":
    main()
