"""`drone-rl sweep-report`."""

import json
import logging
from pathlib import Path
from typing import Any

from omegaconf import DictConfig

from drone_rl.sweeps import Sweep, read_result, read_sweep
from drone_rl.sweeps.page import write_picture, write_report
from drone_rl.utils.errors import InputError

_log = logging.getLogger(__name__)


def prepare(overrides: list[str]) -> list[str]:
    """Makes `drone-rl sweep-report FOLDER` mean `folder=FOLDER`."""
    from drone_rl.sweeps.runs import quoted

    return [
        o if "=" in o.split("/")[0] or o.startswith("-") else f"folder={quoted(o)}"
        for o in overrides
    ]


def run(config: DictConfig) -> tuple[int, None]:
    """Reports on a sweep, finished or not. Returns the exit status."""
    folder = _newest(Path(config.paths.outputs)) if config.folder == "latest" else config.folder
    sweep = read_sweep(Path(folder).absolute())
    if config.judge:
        _judge(sweep, config)
    page = write_report(sweep)
    print(_lines(json.loads((sweep.folder / "summary.json").read_text())))
    if config.picture is not None:
        write_picture(sweep, Path(config.picture))
        _log.info("picture: %s", config.picture)
    _log.info("written: %s", page)
    return 0, None


def _judge(sweep: Sweep, config: DictConfig) -> None:
    """Judges the last policies of all finished runs again; one that can't be is left as it is."""
    from drone_rl.cli.judging import judge_run  # imports torch, which no other report needs

    if config.episodes < 1:
        raise InputError(f"episodes={config.episodes} must be 1 or more")
    finished = [run for run in sweep.runs if read_result(run.folder) is not None]
    for done, run in enumerate(finished, start=1):
        try:
            verdict = judge_run(run.folder, config.episodes, config.device)
            _log.info("[%d/%d] %s: %s", done, len(finished), run.folder.name, verdict["kind"])
        except InputError as error:
            _log.warning("[%d/%d] %s not judged: %s", done, len(finished), run.folder.name, error)


def _newest(outputs: Path) -> Path:
    found = sorted(
        outputs.glob("train/multiruns/*/sweep.json"), key=lambda path: path.stat().st_mtime
    )
    if not found:
        raise InputError(
            f"folder=latest, but there is no sweep under {outputs}/train/multiruns; "
            "run drone-rl train -m first or give the folder of a sweep"
        )
    return found[-1].parent


def _lines(figures: dict[str, Any]) -> str:
    """The sentences of a sweep, for a terminal."""
    told = figures["sentences"]
    lines = [text for name, text in told.items() if name.startswith(("runs.", "verdicts."))]
    for group in figures["groups"]:
        choice = ", ".join(f"{k}={v}" for k, v in group.items() if isinstance(v, str))
        lines.append(f"{choice or 'all':44} {'; '.join(group['sentences'].values())}")
    lines += [f"run {r['run']} {r['state']}: {r['error']}" for r in figures["runs"] if r["error"]]
    best = " ".join(text for name, text in told.items() if name.startswith("best."))
    lines.append(f"best run: {best}")
    if figures["best"]:
        lines.append(f"the same again: {figures['best']['command']}")
    return "\n".join(lines)
