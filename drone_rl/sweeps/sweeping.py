"""What came out of a sweep, finished or not, without torch unless its runs are judged again."""

import json
import logging
from pathlib import Path
from typing import Any

from drone_rl.sweeps.manifest import Sweep, read_sweep
from drone_rl.sweeps.page import write_sweep_report
from drone_rl.sweeps.runs import read_result
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import newest
from drone_rl.utils.text import seed_line

_log = logging.getLogger(__name__)


def find_sweep(which: str | Path, outputs: str | Path = "outputs") -> Sweep:
    """A sweep.

    Args:
        which: Its folder, or "latest" for the newest one.
        outputs: Folder under which sweeps are kept.

    Raises:
        InputError: There is none.
    """
    if which != "latest":
        return read_sweep(Path(which).absolute())
    last = newest(Path(outputs).glob("train/multiruns/*/sweep.json"))
    if last is None:
        raise InputError(
            f"folder=latest, but there is no sweep under {outputs}/train/multiruns; "
            "run drone-rl train -m first or give the folder of a sweep"
        )
    return read_sweep(last.parent.absolute())


def judge_sweep(sweep: Sweep, episodes: int, device: str) -> None:
    """Judges the last policies of all finished runs again; one that can't be is left as it is.

    Args:
        sweep: Which.
        episodes: Of each verdict, in worlds to choose by.
        device: Where they are flown.
    """
    # imports torch, which no other report needs
    from drone_rl.sweeps.judging import draw_seed, judge_run

    seed = draw_seed()
    _log.info("%s", seed_line(seed.as_dict()))
    finished = [run for run in sweep.runs if read_result(run.folder) is not None]
    for done, run in enumerate(finished, start=1):
        try:
            verdict = judge_run(run.folder, episodes, device, seed=seed)
            _log.info("[%d/%d] %s: %s", done, len(finished), run.folder.name, verdict["kind"])
        except InputError as error:
            _log.warning("[%d/%d] %s not judged: %s", done, len(finished), run.folder.name, error)


def report_sweep(sweep: Sweep) -> tuple[Path, str]:
    """Writes a sweep's report. Returns its path and its sentences, for a terminal."""
    page = write_sweep_report(sweep)
    return page, _lines(json.loads((sweep.folder / "summary.json").read_text()))


def _lines(figures: dict[str, Any]) -> str:
    sentences = figures["sentences"]
    lines = [text for name, text in sentences.items() if name.startswith(("runs.", "verdicts."))]
    for group in figures["groups"]:
        choice = ", ".join(f"{k}={v}" for k, v in group.items() if isinstance(v, str))
        lines.append(f"{choice or 'all':44} {'; '.join(group['sentences'].values())}")
    lines += [f"run {r['run']} {r['state']}: {r['error']}" for r in figures["runs"] if r["error"]]
    best = " ".join(text for name, text in sentences.items() if name.startswith("best."))
    lines.append(f"best run: {best}" if figures["best"] else best)
    if figures["best"]:
        lines.append(f"the same again: {figures['best']['command']}")
    return "\n".join(lines)
