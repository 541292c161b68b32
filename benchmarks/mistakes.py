"""Mistakes on command lines: each must be answered in one line that says what to type.

All commands run in forks of a process that has imported the command line.
"""

import gc
import importlib
import json
import logging
import os
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.hostile import PACKAGES, import_all, run_child
from drone_rl.utils.provenance import num_cores

_CASES = Path(__file__).with_suffix(".toml")
JARGON = re.compile(
    r"\b(struct|\w*Schema|\w*Config|overrides?|overriding|EQUAL|EOF|lexer|append|mismatched|viable"
    r"|primitive|full_key|object_type|ref_type|NoneType|ValueType|OmegaConf|Traceback|Exception)\b"
)
"""Words of Hydra, OmegaConf and their grammar, which users do not know."""
_TIMEOUT_S = 60
_log = logging.getLogger(__name__)


def bench_mistakes(folder: Path) -> dict[str, int]:
    """Run the wrong command lines of `mistakes.toml`.

    Args:
        folder: Working folder of the commands; created if missing.

    Returns:
        "mistakes_ok", the number that is answered in one line with the remedy, and
        "mistakes_total".
    """
    outcomes = run_all(folder)
    for outcome in outcomes:
        if outcome["wrong"]:
            _log.warning("drone-rl %s: %s", outcome["line"], outcome["wrong"])
    ok = sum(not outcome["wrong"] for outcome in outcomes)
    return {"mistakes_ok": ok, "mistakes_total": len(outcomes)}


def read_cases() -> list[list[str]]:
    """Return the command lines, each with the words that the answer must contain."""
    return tomllib.loads(_CASES.read_text(encoding="utf-8"))["cases"]


def run_all(folder: Path, every: int = 1) -> list[dict[str, Any]]:
    """Run every n-th command line in a separate process.

    Returns:
        For each the "line", its "answer" and what is "wrong", empty if nothing is.
    """
    folder = folder.absolute()
    folder.mkdir(parents=True, exist_ok=True)
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONWARNINGS": "ignore", "DISPLAY": ""}
    command = [sys.executable, "-m", "benchmarks.mistakes", str(folder), str(every)]
    subprocess.run(command, check=True, env=environment, stdin=subprocess.DEVNULL)
    return json.loads((folder / "outcomes.json").read_text())


def find_fault(status: int, stdout: str, stderr: str, line: str, words: Sequence[str]) -> str:
    """Return what is wrong with the answer to a mistake; empty if nothing is.

    Args:
        status: Exit status of the command.
        stdout: What it printed.
        stderr: What it printed as error.
        line: The command line.
        words: What the answer must contain.
    """
    lines = [text for text in stderr.splitlines() if text.strip()]
    answer = lines[0] if lines else ""
    unknown = [word for word in JARGON.findall(answer) if word not in line]
    missing = [word for word in words if word not in answer]
    faults = {
        "ended with status 0": status == 0,
        "printed a traceback": "Traceback" in stderr + stdout,
        f"printed {len(lines)} lines": len(lines) != 1 and not _is_usage(lines[1:]),
        "printed no error": not answer.startswith("error: "),
        f"has words that users do not know: {', '.join(unknown)}": bool(unknown),
        f"lacks: {', '.join(missing)}": bool(missing),
    }
    return next((fault for fault, is_found in faults.items() if is_found), "")


def _is_usage(lines: Sequence[str]) -> bool:
    return len(lines) == 1 and lines[0].startswith("usage: ")


def _main(folder: Path, every: int) -> None:
    for package in PACKAGES:
        import_all(f"drone_rl.{package}")
    program = importlib.import_module("drone_rl.cli.main")
    sys.modules["hydra.core.plugins"].Plugins.instance()  # scans all packages once
    gc.freeze()
    outcomes = []
    cases = read_cases()[::every]
    for first in range(0, len(cases), num_cores()):
        started = []
        for number, (line, *words) in enumerate(cases[first : first + num_cores()], start=first):
            here = folder / str(number)
            (here / "empty").mkdir(parents=True, exist_ok=True)
            (here / "notes.txt").write_text("no policy\n")
            child = os.fork()
            if child == 0:
                run_child(program.main, shlex.split(line), here, _TIMEOUT_S)
            started.append((child, here, line, words))
        for child, here, line, words in started:
            status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
            stdout, stderr = ((here / n).read_text(errors="replace") for n in ("stdout", "stderr"))
            wrong = find_fault(status, stdout, stderr, line, words)
            outcomes.append({"line": line, "answer": stderr.strip(), "wrong": wrong})
    (folder / "outcomes.json").write_text(json.dumps(outcomes, indent=1))


if __name__ == "__main__":
    _main(Path(sys.argv[1]), int(sys.argv[2]))
