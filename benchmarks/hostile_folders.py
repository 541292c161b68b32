"""Malicious folders of resumed runs, sweeps and explanations."""

import io
import json
import os
import shutil
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
import yaml

from benchmarks.hostile_case import Case, nested, npz, zipped_zeros


def hostile_folders(folder: Path, state: Mapping[str, Any]) -> list[Case]:
    """Create the folders and return their cases.

    Args:
        folder: Parent folder; contains a folder `canary`.
        state: State of a valid checkpoint.
    """
    return [*_runs(folder, state), *_sweeps(folder), *_explanations(folder)]


def _runs(folder: Path, state: Mapping[str, Any]) -> list[Case]:
    """Create runs that are resumed."""
    canary = folder / "canary"
    overrides: dict[str, Any] = {
        "target": ["policy._target_=os.system"],
        "nested_target": ["+optimizer.x={_target_:os.system}"],
        "output": [f"hydra.run.dir={canary}"],
        "hydra": ["hydra/job_logging=none"],
        "paths": [f"paths.outputs={canary}"],
        "logger": [f"logger.tensorboard.log_dir={canary}"],
        "collector": ["collector.make=os.system"],
        "cluster": ["collector=ray", "collector.address=ray://evil:1"],
        "interpolation": ["task.spacing=${oc.env:HOSTILE_SECRET}"],
        "path_as_choice": ["policy=../../canary/policy"],
        "flag": ["--config-dir=/tmp"],
        "no_texts": [{"a": 1}],
        "no_list": "policy",
        "many": ["seed=1"] * 1000,
        "long": ["task.spacing=" + "9" * 10_000],
        "lines": ["seed=1\nhydra.run.dir=x"],
    }
    cases = []
    for name, content in overrides.items():
        run = make_run(folder / f"resume_{name}", state)
        (run / ".hydra" / "overrides.yaml").write_text(yaml.safe_dump(content))
        cases.append((run.name, ["train", f"resume={run}"], "overrides that a run can't have"))
    raw = {
        "python_object": "- !!python/object/apply:os.system ['touch ran']\n",
        "aliases": "a: &a [x]\nb: &b [*a,*a]\n" + "- *b\n" * 10,
        "deep_yaml": "[" * 5000,
    }
    for name, text in raw.items():
        run = make_run(folder / f"resume_{name}", state)
        (run / ".hydra" / "overrides.yaml").write_text(text)
        cases.append((run.name, ["train", f"resume={run}"], "YAML that is more than plain data"))
    links = {"metrics.csv": "secret.txt", "run.yaml": "ran", ".lock": "ran", "tensorboard": "keep"}
    for name, target in links.items():
        run = make_run(folder / f"resume_link_{name.strip('.').replace('.', '_')}", state)
        (run / name).symlink_to(canary / target)
        cases.append((run.name, ["train", f"resume={run}"], "a link out of the folder"))
    broken = {"no_state": state, "no_tensors": {**state, "optimiser": 5}, "list": [1]}
    for name, content in broken.items():
        run = make_run(folder / f"resume_state_{name}", content)
        (run / ".hydra" / "overrides.yaml").write_text("- experiment=smoke\n- logger=csv\n")
        cases.append((run.name, ["train", f"resume={run}"], "an invalid training state"))
    return cases


def make_run(run: Path, state: Any) -> Path:
    """Create a run's folder with a checkpoint that contains `state`."""
    (run / ".hydra").mkdir(parents=True)
    (run / "checkpoints").mkdir()
    torch.save(state, run / "checkpoints" / "last.pt")
    return run


def _sweeps(folder: Path) -> list[Case]:
    good = {
        "format": "drone_rl sweep",
        "command": "drone-rl train -m seed=0,1",
        "settings": {},
        "runs": [{"number": 0, "overrides": ["seed=0"], "folder": "0"}],
        "versions": {},
        "git_revision": None,
        "machine": {},
    }
    contents: dict[str, Any] = {
        "run_above": {"runs": [{**good["runs"][0], "folder": "../canary"}]},
        "run_elsewhere": {"runs": [{**good["runs"][0], "folder": str(folder / "canary")}]},
        "run_dots": {"runs": [{**good["runs"][0], "folder": ".."}]},
        "command": {"command": f"touch {folder}/canary/ran"},
        "command_list": {"command": "drone-rl train; rm -rf ~"},
        "target": {"runs": [{**good["runs"][0], "overrides": ["policy._target_=os.system"]}]},
        "flag": {"runs": [{**good["runs"][0], "overrides": ["--config-dir=/tmp"]}]},
        "output": {"runs": [{**good["runs"][0], "overrides": ["hydra.run.dir=/tmp/x"]}]},
        "number": {"runs": [{**good["runs"][0], "number": 10**18}]},
        "twice": {"runs": [good["runs"][0]] * 2},
        "no_runs": {"runs": 5},
        "no_texts": {"runs": [{**good["runs"][0], "overrides": [{"a": 1}]}]},
        "more": {"plugins": ["os.system"]},
        "settings": {"settings": nested(100)},
    }
    texts = {name: json.dumps({**good, **change}) for name, change in contents.items()}
    texts |= {"deep": "[" * 10**5, "huge": '{"runs": 1' + "0" * 5000 + "}", "cut": '{"runs": ['}
    cases = []
    for i, (name, text) in enumerate(texts.items()):
        sweep = folder / f"sweep_{name}"
        sweep.mkdir()
        (sweep / "sweep.json").write_text(text)
        again = ["train", "-m", "seed=0,1", "hydra/launcher=local", f"hydra.sweep.dir={sweep}"]
        report = ["sweep-report", f"folder={sweep}"]
        cases.append((sweep.name, again if i % 3 == 0 else report, "an invalid sweep.json"))
    for name, make in {"pipe": os.mkfifo, "link": _link_to(folder / "canary")}.items():
        sweep = folder / f"sweep_{name}"
        sweep.mkdir()
        (sweep / "sweep.json").write_text(json.dumps(good))
        make(sweep / "0")
        cases.append(
            (sweep.name, ["sweep-report", f"folder={sweep}"], "a run that is not a folder")
        )
    return cases


def _explanations(folder: Path) -> list[Case]:
    def numbers(**changes: Any) -> str:
        return json.dumps({"format": "drone_rl explanation", "format_version": 2, **changes})

    arrays = {"a": np.zeros(3)}
    kinds: dict[str, tuple[str, bytes]] = {
        "missing_numbers": (numbers(name="x"), npz(arrays)),
        "future": (numbers(format_version=99), npz(arrays)),
        "list": ("[1]", npz(arrays)),
        "deep": ("[" * 10**5, npz(arrays)),
        "huge": (numbers(name="x").replace("2", "2" * 5000), npz(arrays)),
        "name": (numbers(name="../../canary/\n\x1b[2J"), npz(arrays)),
        "objects": (numbers(name="x"), npz({"a": np.array([folder], dtype=object)})),
        "bomb": (numbers(name="x"), _bomb()),
        "no_archive": (numbers(name="x"), b"PK\x03\x04 and so on"),
        "giant": (numbers(name="x"), _false_header()),
    }
    cases = []
    for name, (text, archive) in kinds.items():
        here = folder / f"explanation_{name}"
        here.mkdir()
        (here / "explanation.json").write_text(text)
        for file in ("arrays.npz", "dataset.npz"):
            (here / file).write_bytes(archive)
        cases.append(
            (here.name, ["report", f"explanations={here}"], "invalid files of an explanation")
        )
    for name, make in {"pipe": os.mkfifo, "zeros": _link_to(Path("/dev/zero"))}.items():
        here = folder / f"explanation_{name}"
        shutil.copytree(folder / "explanation_missing_numbers", here)
        (here / "arrays.npz").unlink()
        make(here / "arrays.npz")
        cases.append((here.name, ["report", f"explanations={here}"], "not a regular file"))
    return cases


def _bomb() -> bytes:
    """Return a file of one array of a GiB of zeros."""
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        file, {"descr": "<f8", "fortran_order": False, "shape": (2**27,)}
    )
    return zipped_zeros("a.npy", file.getvalue(), 2**30)


def _false_header() -> bytes:
    """Return an array file whose header declares terabytes."""
    file = io.BytesIO()
    np.savez(file, a=np.zeros(3))
    with zipfile.ZipFile(file) as archive:
        content = archive.read("a.npy").replace(b"(3,), }         ", b"(399999999999,), }")
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as archive:
        archive.writestr("a.npy", content)
    return target.getvalue()


def _link_to(target: Path) -> Callable[[Path], None]:
    return lambda path: path.symlink_to(target)
