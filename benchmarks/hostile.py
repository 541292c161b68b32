"""`drone-rl bench truth`, hostile files: each is refused in one line, at once, with nothing done.

All commands run as forks of one process that has imported everything, so that what is measured is
the refusal alone.
"""

import contextlib
import importlib
import json
import logging
import os
import pkgutil
import resource
import signal
import subprocess
import sys
import traceback
from pathlib import Path
from typing import Any

from benchmarks.hostile_case import NOTED

SECRET = "the canary's secret 4711"
"""Stands in the canary's file and in the environment; no command may tell it."""
MOST_SECONDS = 2.0
"""Of a refusal: processor time after the imports, which other work does not change."""
MOST_MEMORY = 2**30
"""Bytes by which a refusal may grow the process."""
MOST_ADDRESSES = 3 * 2**29
"""The same of its address space, so that a bomb ends the case and not the machine."""
PATIENCE_S = 30
"""Until a command counts as hung."""
_PACKAGES = (
    *("cli", "sweeps", "verification", "robustness", "verdicts", "evaluation", "policies"),
    *("training", "explanations", "utils"),
)
"""Imported with all their modules before any case runs."""
_MORE = ("hydra.core.plugins", "scipy.special", "matplotlib.backends.backend_agg")

_BEFORE = "resident_bytes_before"
"""File in which a case notes its own memory before it begins."""
_log = logging.getLogger(__name__)


def bench_hostile(folder: Path) -> dict[str, float]:
    """Opens each of the hostile files with one of the commands that people would.

    Args:
        folder: An empty one, for the files; made if need be.

    Returns:
        "hostile_refused" and "hostile_total"; "hostile_peak_mib" (greatest growth of the resident
        memory of any case, MiB) and "hostile_max_s" (greatest processor time of any, seconds), both
        after imports.
    """
    outcomes = run_all(folder)
    for outcome in outcomes:
        if outcome["wrong"]:
            _log.warning("%s: %s", outcome["name"], outcome["wrong"])
    refused = sum(not outcome["wrong"] for outcome in outcomes)
    return {
        "hostile_refused": refused,
        "hostile_total": len(outcomes),
        "hostile_peak_mib": max(outcome["mib"] for outcome in outcomes),
        "hostile_max_s": max(outcome["seconds"] for outcome in outcomes),
    }


def run_all(folder: Path, every: int = 1) -> list[dict[str, Any]]:
    """Makes and opens them, in a process of their own.

    Args:
        folder: An empty one, for the files; made if need be.
        every: Opens only each so many-th.

    Returns:
        Of each its "name", "why", "wrong", which says what is wrong and is empty if it was refused,
        "mib" (growth of the resident memory) and "seconds" (processor time).
    """
    environment = {
        **os.environ,
        "HOSTILE_SECRET": SECRET,
        "OMP_NUM_THREADS": "1",
        "PYTHONWARNINGS": "ignore",
    }
    folder = folder.absolute()  # each case has a folder of its own, from where it opens them
    folder.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "benchmarks.hostile", str(folder), str(every)]
    subprocess.run(command, check=True, env=environment, stdin=subprocess.DEVNULL)
    return json.loads((folder / "outcomes.json").read_text())


def _main(folder: Path, every: int) -> None:
    from benchmarks.hostile_files import hostile_files

    cases = hostile_files(folder / "files")[::every]
    program = importlib.import_module("drone_rl.cli.main")
    for package in _PACKAGES:
        _import_all(f"drone_rl.{package}")
    for name in _MORE:
        importlib.import_module(name)
    sys.modules["hydra.core.plugins"].Plugins.instance()  # looks through all packages, once
    canary = _snapshot(folder / "files" / "canary")
    outcomes = []
    for number, (name, arguments, why) in enumerate(cases):
        here = folder / "work" / str(number)
        here.mkdir(parents=True)
        outcome = _fork(program.main, arguments, here, is_noted=name.startswith(NOTED))
        if not outcome["wrong"] and _snapshot(folder / "files" / "canary") != canary:
            outcome["wrong"] = "it touched the canary"
        outcomes.append({"name": name, "arguments": arguments, "why": why, **outcome})
    (folder / "outcomes.json").write_text(json.dumps(outcomes, indent=1))


def _import_all(package: str) -> None:
    """Imports a package and what is in it, except for what needs a missing extra."""
    found = importlib.import_module(package)
    for module in pkgutil.walk_packages(found.__path__, f"{package}."):
        with contextlib.suppress(ImportError):
            importlib.import_module(module.name)


def _fork(main: Any, arguments: list[str], here: Path, *, is_noted: bool = False) -> dict[str, Any]:
    """Runs one command.

    Args:
        main: Of the program.
        arguments: After its name.
        here: Folder in which it runs.
        is_noted: Whether it must succeed and print that something is damaged.

    Returns:
        "wrong", "mib" and "seconds", see `run_all`.
    """
    child = os.fork()
    if child == 0:
        _become(main, arguments, here)
    _, status, used = os.wait4(child, 0)
    printed = (here / "stderr").read_text(errors="replace")
    grown = used.ru_maxrss * 1024 - int((here / _BEFORE).read_text())
    seconds = used.ru_utime + used.ru_stime
    said = (here / "stdout").read_text(errors="replace")
    lines, status_code = printed.splitlines(), os.waitstatus_to_exitcode(status)
    is_line = len(lines) == 1 and lines[0].startswith("error: ")
    checks = {
        f"ended by signal {os.WTERMSIG(status)}": os.WIFSIGNALED(status),
        f"ended with status {status_code}: {printed[-300:]}": status_code != (0 if is_noted else 2),
        f"printed {printed[-300:]!r}": "damaged" not in said if is_noted else not is_line,
        f"took {seconds:.1f} s": seconds > MOST_SECONDS,
        f"took {grown / 2**20:.0f} MiB": grown > MOST_MEMORY,
        "told the secret": SECRET in printed + said or _tells(here),
    }
    wrong = next((what for what, is_so in checks.items() if is_so), "")
    return {"wrong": wrong, "mib": round(grown / 2**20, 1), "seconds": round(seconds, 3)}


def _become(main: Any, arguments: list[str], here: Path) -> None:
    """Turns this fork into the command, with limits on what it may take."""
    status = 1
    try:
        os.chdir(here)
        Path(_BEFORE).write_text(str(_resident_bytes()))  # a fork has fewer pages than its parent
        for number, name in ((1, "stdout"), (2, "stderr")):
            target = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
            os.dup2(target, number)
        sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w")
        limit = _address_bytes() + MOST_ADDRESSES
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        signal.alarm(PATIENCE_S)
        sys.argv = ["drone-rl", *arguments]
        main()
        status = 0
    except SystemExit as stop:
        status = stop.code if isinstance(stop.code, int) else 1
    except BaseException:
        traceback.print_exc()
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os._exit(status)


def _resident_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def _address_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")


def _snapshot(folder: Path) -> dict[str, tuple]:
    """All that lies under a folder, with contents and times of change."""
    return {
        str(path): (path.lstat().st_mtime_ns, path.read_bytes() if path.is_file() else b"")
        for path in sorted([folder, *folder.rglob("*")])
    }


def _tells(here: Path) -> bool:
    """Whether any file that a command left holds the secret."""
    secret = SECRET.encode()
    return any(secret in path.read_bytes() for path in here.rglob("*") if path.is_file())


if __name__ == "__main__":
    _main(Path(sys.argv[1]), int(sys.argv[2]))
