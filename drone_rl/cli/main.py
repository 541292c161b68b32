"""`drone-rl <command> [setting=value ...]`: finds the command and runs it."""

import importlib
import sys

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
_POLICIES = ("train", "evaluate", "play", "explain", "report", "verdict", "export")
COMMANDS = (*_POLICIES, "sweep-report", "bench")


def main() -> None:
    """Entry point of `drone-rl`."""
    args = sys.argv[1:]
    if not args or args[0] in ("-h", "--help", "help"):
        print(USAGE)
        return
    name, overrides = args[0], args[1:]
    if name not in ("demo", *COMMANDS):
        sys.exit(f"error: command {name!r} is unknown; use one of: demo, {', '.join(COMMANDS)}")
    from drone_rl.hydra_app.messages import guarded  # usage and typing errors don't wait for Hydra

    steps = [("train", overrides), ("evaluate", []), ("explain", [])]
    sys.exit(guarded(lambda: _run_all(steps if name == "demo" else [(name, overrides)])))


def _run_all(steps: list[tuple[str, list[str]]]) -> int:
    """One command after the other, until one fails."""
    from drone_rl.hydra_app.composition import run_command

    for name, overrides in steps:
        command = importlib.import_module(f"drone_rl.cli.{name.replace('-', '_')}")
        if status := run_command(name.replace("-", "_"), command, overrides):
            return status
    return 0


if __name__ == "__main__":
    main()
