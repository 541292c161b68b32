"""Malicious files: commands must refuse each with one line, fast, and without side effects.

All commands run in forks of a process that has imported all modules, so only the refusal is
measured.
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
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

from benchmarks.hostile_case import NOTED

SECRET = "the canary's secret 4711"
"""Content of a canary file and of an environment variable; no command may reveal it."""
MAX_SECONDS = 2.0
"""Largest processor time of a refusal after imports; other processes do not affect it."""
MAX_MEMORY = 2**30
"""Largest growth of the process in bytes."""
MAX_ADDRESS_SPACE = 3 * 2**29
"""Largest growth of the address space in bytes, so that a decompression bomb ends its case only."""
TIMEOUT_S = 30
"""Time after which a command counts as hung."""
PACKAGES = (
    *("cli", "sweeps", "verification", "robustness", "verdicts", "evaluation", "policies"),
    *("training", "explanations", "utils"),
)
"""Packages that are imported completely before any case runs."""
_MORE = ("hydra.core.plugins", "scipy.special", "matplotlib.backends.backend_agg")

_BEFORE = "resident_bytes_before"
"""File to which a case writes its resident memory before the command starts."""
_log = logging.getLogger(__name__)


def bench_hostile(folder: Path) -> dict[str, float]:
    """Open each malicious file with one of the commands that users would run.

    Args:
        folder: Empty folder for the files; created if missing.

    Returns:
        "hostile_refused" and "hostile_total", numbers of files; "hostile_peak_mib", the largest
        growth of resident memory (MiB), and "hostile_max_s", the largest processor time (s), both
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
    """Create and open the files in a separate process.

    Args:
        folder: Empty folder for the files; created if missing.
        every: Open only every n-th file.

    Returns:
        For each file "name", "why" (the attack), "wrong" (what went wrong; empty if the command
        refused the file), "mib" (growth of resident memory) and "seconds" (processor time).
    """
    environment = {
        **os.environ,
        "HOSTILE_SECRET": SECRET,
        "OMP_NUM_THREADS": "1",
        "PYTHONWARNINGS": "ignore",
    }
    folder = folder.absolute()  # cases run in folders of their own
    folder.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "benchmarks.hostile", str(folder), str(every)]
    subprocess.run(command, check=True, env=environment, stdin=subprocess.DEVNULL)
    return json.loads((folder / "outcomes.json").read_text())


def _main(folder: Path, every: int) -> None:
    from benchmarks.hostile_files import hostile_files

    cases = hostile_files(folder / "files")[::every]
    program = importlib.import_module("drone_rl.cli.main")
    for package in PACKAGES:
        import_all(f"drone_rl.{package}")
    for name in _MORE:
        importlib.import_module(name)
    sys.modules["hydra.core.plugins"].Plugins.instance()  # scans all packages once
    canary = _snapshot(folder / "files" / "canary")
    outcomes = []
    for number, (name, arguments, why) in enumerate(cases):
        here = folder / "work" / str(number)
        here.mkdir(parents=True)
        outcome = _fork(program.main, arguments, here, is_noted=name.startswith(NOTED))
        if not outcome["wrong"] and _snapshot(folder / "files" / "canary") != canary:
            outcome["wrong"] = "changed the canary"
        outcomes.append({"name": name, "arguments": arguments, "why": why, **outcome})
    (folder / "outcomes.json").write_text(json.dumps(outcomes, indent=1))


def import_all(package: str) -> None:
    """Import a package and its modules, except those that need a missing extra."""
    found = importlib.import_module(package)
    for module in pkgutil.walk_packages(found.__path__, f"{package}."):
        with contextlib.suppress(ImportError):
            importlib.import_module(module.name)


def _fork(main: Any, arguments: list[str], here: Path, *, is_noted: bool = False) -> dict[str, Any]:
    """Run one command in a fork.

    Args:
        main: Entry point of the program.
        arguments: Arguments of the command.
        here: Working folder.
        is_noted: Whether the command must succeed and print that something is damaged.

    Returns:
        "wrong", "mib" and "seconds", see `run_all`.
    """
    child = os.fork()
    if child == 0:
        run_child(main, arguments, here, TIMEOUT_S, _limit_memory)
    _, status, used = os.wait4(child, 0)
    stderr = (here / "stderr").read_text(errors="replace")
    grown = used.ru_maxrss * 1024 - int((here / _BEFORE).read_text())
    seconds = used.ru_utime + used.ru_stime
    stdout = (here / "stdout").read_text(errors="replace")
    lines, status_code = stderr.splitlines(), os.waitstatus_to_exitcode(status)
    is_line = len(lines) == 1 and lines[0].startswith("error: ")
    checks = {
        f"ended by signal {os.WTERMSIG(status)}": os.WIFSIGNALED(status),
        f"ended with status {status_code}: {stderr[-300:]}": status_code != (0 if is_noted else 2),
        f"printed {stderr[-300:]!r}": "damaged" not in stdout if is_noted else not is_line,
        f"took {seconds:.1f} s": seconds > MAX_SECONDS,
        f"took {grown / 2**20:.0f} MiB": grown > MAX_MEMORY,
        "revealed the secret": SECRET in stderr + stdout or _has_secret(here),
    }
    wrong = next((text for text, is_wrong in checks.items() if is_wrong), "")
    return {"wrong": wrong, "mib": round(grown / 2**20, 1), "seconds": round(seconds, 3)}


def run_child(
    main: Callable[[], object],
    arguments: list[str],
    here: Path,
    timeout_s: int,
    prepare: Callable[[], object] = lambda: None,
) -> NoReturn:
    """Run a command in this fork, which ends; its output is in the files stdout and stderr.

    Args:
        main: Entry point of the program.
        arguments: Arguments of the command.
        here: Working folder.
        timeout_s: Time after which the fork is killed.
        prepare: Called in the working folder before the command.
    """
    status = 1
    try:
        os.chdir(here)
        for number, name in ((1, "stdout"), (2, "stderr")):
            target = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
            os.dup2(target, number)
        sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w")
        prepare()
        signal.alarm(timeout_s)
        sys.argv = ["drone-rl", *arguments]
        main()
        status = 0
    except SystemExit as stop:
        status = stop.code if isinstance(stop.code, int) else 1
        if isinstance(stop.code, str):  # as the interpreter prints it
            sys.stderr.write(f"{stop.code}\n")
    except BaseException:
        traceback.print_exc()
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os._exit(status)


def _limit_memory() -> None:
    """Note the resident memory, which is less than the parent's, and limit the address space."""
    Path(_BEFORE).write_text(str(_resident_bytes()))
    limit = _address_bytes() + MAX_ADDRESS_SPACE
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def _resident_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def _address_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")


def _snapshot(folder: Path) -> dict[str, tuple]:
    """Return all files and folders below a folder with contents and modification times."""
    return {
        str(path): (path.lstat().st_mtime_ns, path.read_bytes() if path.is_file() else b"")
        for path in sorted([folder, *folder.rglob("*")])
    }


def _has_secret(here: Path) -> bool:
    """Return whether any file that a command left contains the secret."""
    secret = SECRET.encode()
    return any(secret in path.read_bytes() for path in here.rglob("*") if path.is_file())


if __name__ == "__main__":
    _main(Path(sys.argv[1]), int(sys.argv[2]))
