"""Malicious files in folders of runs and sweeps: damaged, too large, or not regular files."""

import io
import json
import os
import socket
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.hostile_case import NOTED, Case, Make, put, sparse

_HEADER = b"update,frames,episodes,seconds,train/running_reward,loss/entropy\n"
_ROW = b"1,100,4,1.0,0.5,0.7\n"
METRICS: dict[str, bytes] = {
    "no_text": b"\xff\xfe" + _HEADER,
    "one_line_of_a_megabyte": b"a" * 2**20,
    "field_of_a_megabyte": _HEADER + b'"' + b"a" * 2**20 + b'"\n',
    "commas": b"," * 2**22,
    "too_many_commas": _HEADER + b"," * (2**22 + 1),
    "unnamed_columns": b",,,,,\n",
    "lines": _HEADER + b"\n" * 2**19,
    "many_rows": _HEADER + _ROW * 200_000,
}
"""Invalid contents of `metrics.csv`."""


def hostile_runs(folder: Path, checkpoint: Callable[[Path], Path]) -> list[Case]:
    """Create the folders and return their cases.

    Args:
        folder: Parent folder.
        checkpoint: Create a run's folder with a checkpoint.
    """
    return [
        *_resumed(folder, checkpoint),
        *_proofs(folder),
        *_sweeps(folder),
        *_journals(folder),
        *_targets(),
    ]


def _resumed(folder: Path, checkpoint: Callable[[Path], Path]) -> list[Case]:
    """Create runs to resume in which one entry is not a regular file."""
    kinds: dict[str, tuple[str, Make]] = {
        "lock_folder": (".lock", Path.mkdir),
        "lock_pipe": (".lock", os.mkfifo),
        "overrides_folder": (".hydra/overrides.yaml", Path.mkdir),
        "overrides_pipe": (".hydra/overrides.yaml", os.mkfifo),
        "overrides_sparse": (".hydra/overrides.yaml", sparse),
        "log_folder": ("train.log", Path.mkdir),
        "log_pipe": ("train.log", os.mkfifo),
        "rounds_folder": ("provable.json", Path.mkdir),
        "socket": ("x.socket", _socket),
        "many_files": ("tensorboard", lambda path: _many_links(path, 50_100)),
    }
    cases = []
    for name, (where, make) in kinds.items():
        run = _started_run(folder / f"resumed_{name}", checkpoint)
        if where.endswith("overrides.yaml"):
            (run / where).unlink()
        make(run / where)
        command = ["train", f"resume={run}"]
        if name == "rounds_folder":
            command.append("provable.rounds=1")
        cases.append((run.name, command, "not a regular file in a run"))
    return cases


def _proofs(folder: Path) -> list[Case]:
    """Create proofs to resume with an invalid state."""
    file = io.BytesIO()
    np.savez(file, subject=np.zeros(4, np.uint8), counts=np.zeros(6))
    states: dict[str, bytes | Make] = {
        "archive": b"PK\x03\x04",
        "others": file.getvalue(),
        "text": b"hello",
        "folder": Path.mkdir,
        "pipe": os.mkfifo,
        "sparse": sparse,
    }
    cases = []
    for name, content in states.items():
        here = folder / f"proof_{name}"
        here.mkdir()
        put(here / "state.npz", content)
        settings = ["task.num_cubes=1", "compared=1", f"hydra.run.dir={here}"]
        command = ["prove", "policy=right_and_forward", *settings]
        cases.append((here.name, command, "an invalid state of a proof"))
    return cases


def _sweeps(folder: Path) -> list[Case]:
    cases = []
    for name, content in METRICS.items():
        sweep = _sweep(folder / f"{NOTED}metrics_{name}", {"0": content})
        cases.append((sweep.name, ["sweep-report", f"folder={sweep}"], "invalid metrics"))
    makers: dict[str, Make] = {
        "metrics_large": lambda run: (run / "metrics.csv").write_bytes(_HEADER + _ROW * 3 * 10**6),
        "metrics_sparse": lambda run: sparse(run / "metrics.csv"),
        "metrics_folder": lambda run: (run / "metrics.csv").mkdir(),
        "metrics_missing": lambda run: None,
    }
    for name, make in makers.items():
        sweep = _sweep(folder / f"{NOTED}{name}", {"0": None})
        make(sweep / "0")
        cases.append((sweep.name, ["sweep-report", f"folder={sweep}"], "invalid metrics"))
    sweep = _sweep(folder / f"{NOTED}sweep_of_60_mb", {str(i): None for i in range(4)})
    for i in range(4):
        (sweep / str(i) / "metrics.csv").write_bytes(_HEADER + _ROW * 3 * 10**6)
    cases.append((sweep.name, ["sweep-report", f"folder={sweep}"], "60 MB of metrics for each run"))
    for name in ("summary.csv", "summary.json", "report.html"):
        sweep = _sweep(folder / f"sweep_{name.replace('.', '_')}_folder", {"0": None})
        (sweep / name).mkdir()
        cases.append(
            (sweep.name, ["sweep-report", f"folder={sweep}"], "a folder instead of an output file")
        )
    sweep = _sweep(folder / "sweep_of_large_results", {"0": None})
    data = json.loads((sweep / "sweep.json").read_text())
    data["runs"] = [{"number": i, "overrides": [], "folder": str(i)} for i in range(70)]
    (sweep / "sweep.json").write_text(json.dumps(data))
    result = b'{"reason": "frames", "a": [' + b"{}," * 80_000 + b"{}]}"
    (sweep / "0" / "result.json").write_bytes(result)
    for i in range(1, 70):
        (sweep / str(i)).mkdir()
        os.link(sweep / "0" / "result.json", sweep / str(i) / "result.json")
    return [*cases, (sweep.name, ["sweep-report", f"folder={sweep}"], "one result, many times")]


def _journals(folder: Path) -> list[Case]:
    """Create Optuna searches to resume with invalid journals."""
    line = b'{"op_code": 7, "worker_id": "x", "trial_id": 0, "step": 1}\n'
    journals: dict[str, bytes | Make] = {
        "text": b"hello\n",
        "list": b"[1]\n",
        "deep": b"[" * 40_000 + b"\n",
        "unknown_operation": b'{"op_code": 4711}\n',
        "operation_of_nothing": b'{"op_code": 4}\n',
        "large": line * 200_000,
        "folder": Path.mkdir,
        "pipe": os.mkfifo,
        "sparse": sparse,
    }
    cases = []
    for name, content in journals.items():
        here = folder / f"search_{name}"
        here.mkdir()
        put(here / "optuna.journal", content)
        settings = ["hydra/sweeper=optuna", "hydra/launcher=local", f"hydra.sweep.dir={here}"]
        command = ["train", "-m", *settings, "optimizer.lr=interval(1e-4,1e-1)"]
        cases.append((here.name, command, "an invalid journal"))
    return cases


def _targets() -> list[Case]:
    """Return cases of output names and paths that are outside the folder or not writable."""
    names = {
        "above": "../x",
        "below": "a/b",
        "absolute": "/tmp/x",
        "hidden": ".x",
        "empty": "''",
        "home": "'~x'",
        "lines": '"a\\tb"',
        "long": "x" * 300,
    }
    export = ["export", "policy=good"]
    cases = [(f"export_{n}", [*export, f"name={v}"], "a name as a path") for n, v in names.items()]
    for name, where in {
        "device": "/dev/null/x",
        "system": "/proc/x",
        "self": "/proc/self/x",
    }.items():
        command = ["check", "certificate=none.json", f"hydra.run.dir={where}"]
        cases.append((f"target_{name}", command, "a path that is not writable"))
    return cases


def _started_run(run: Path, checkpoint: Callable[[Path], Path]) -> Path:
    run = checkpoint(run)
    (run / ".hydra" / "overrides.yaml").write_text("- experiment=smoke\n- logger=csv\n")
    return run


def _sweep(sweep: Path, metrics: dict[str, bytes | None]) -> Path:
    """Create the folder of a sweep with finished runs and given metrics."""
    sweep.mkdir()
    runs = [{"number": int(n), "overrides": [f"seed={n}"], "folder": n} for n in metrics]
    about = {"format": "drone_rl sweep", "command": "drone-rl train -m seed=0,1", "settings": {}}
    about |= {"versions": {}, "git_revision": None, "machine": {}}
    (sweep / "sweep.json").write_text(json.dumps({**about, "runs": runs}))
    result = {"reason": "frames", "frames": 100, "episodes": 4, "seconds": 1.0}
    result |= {"running_reward": 0.5, "largest_reward": 3.0}
    for name, content in metrics.items():
        (sweep / name).mkdir()
        (sweep / name / "result.json").write_text(json.dumps(result))
        if content is not None:
            (sweep / name / "metrics.csv").write_bytes(content)
    return sweep


def _many_links(folder: Path, count: int) -> None:
    folder.mkdir()
    first = folder / "0"
    first.touch()
    for i in range(1, count):
        os.link(first, folder / str(i))


def _socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as unix_socket:
        here = os.open(path.parent, os.O_RDONLY)
        try:
            unix_socket.bind(f"/proc/self/fd/{here}/{path.name}")  # paths are limited to 108 bytes
        finally:
            os.close(here)
