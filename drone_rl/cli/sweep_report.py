"""`drone-rl sweep-report`."""

import json
import logging
from pathlib import Path

from omegaconf import DictConfig

from drone_rl.sweeps import read_sweep
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
    page = write_report(sweep)
    print(_lines(json.loads((sweep.folder / "summary.json").read_text())))
    if config.picture is not None:
        write_picture(sweep, Path(config.picture))
        _log.info("picture: %s", config.picture)
    _log.info("written: %s", page)
    return 0, None


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


def _lines(figures: dict) -> str:
    """The figures of the groups, for a terminal."""
    lines = [f"{figures[state]} {state}" for state in ("finished", "failed", "damaged")]
    lines = [", ".join([*lines, f"{figures['unfinished']} unfinished"])]
    for group in figures["groups"]:
        choice = ", ".join(f"{k}={v}" for k, v in group.items() if isinstance(v, str))
        kinds = ", ".join(f"{kind} {v['successes']}" for kind, v in group["verdicts"].items())
        solved = group["solved"]["successes"]
        lines.append(
            f"{choice or 'all':44} solved {solved} of {group['finished']}; verdicts: {kinds}"
        )
    lines += [f"run {r['run']} {r['state']}: {r['error']}" for r in figures["runs"] if r["error"]]
    if figures["best"]:
        lines.append(f"best run: {figures['best']['run']}; the same again: ")
        lines.append(f"  {figures['best']['command']}")
    return "\n".join(lines)
