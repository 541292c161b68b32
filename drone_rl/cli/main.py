"""`drone-rl <command> [setting=value ...]`: finds the command and runs it."""

import importlib
import sys
from typing import cast

import drone_rl
from drone_rl.cli.usage import COMMANDS, DEMO_USAGE, USAGE
from drone_rl.utils.compiler import leave_compiler_unloaded
from drone_rl.utils.garbage import leave_garbage_to_the_system, look_for_garbage_rarely


def main() -> None:
    """Entry point of `drone-rl`."""
    args = sys.argv[1:]
    if not args or args[0] in ("-h", "--help", "help"):
        print(USAGE)
        return
    if args[0] in ("-V", "--version"):
        print(f"drone-rl {drone_rl.__version__}")
        return
    name, overrides = args[0], args[1:]
    if name not in ("demo", *COMMANDS):
        sys.exit(f"error: command {name!r} is unknown; use one of: demo, {', '.join(COMMANDS)}")
    if name == "demo" and {"-h", "--help"} & set(overrides):
        print(DEMO_USAGE)
        return
    look_for_garbage_rarely()
    from drone_rl.hydra_app.messages import guarded  # usage and typing errors don't wait for Hydra

    leave_compiler_unloaded()
    steps = [("train", overrides), ("evaluate", []), ("explain", [])]
    status = guarded(lambda: _run_all(steps if name == "demo" else [(name, overrides)]))
    leave_garbage_to_the_system()
    sys.exit(status)


def _run_all(steps: list[tuple[str, list[str]]]) -> int:
    """One command after the other, until one fails."""
    from drone_rl.hydra_app.composition import Command, run_command

    for name, overrides in steps:
        file = name.replace("-", "_")
        command = cast(Command, importlib.import_module(f"drone_rl.cli.{file}"))
        if status := run_command(file, command, overrides):
            return status
    return 0


if __name__ == "__main__":
    main()
