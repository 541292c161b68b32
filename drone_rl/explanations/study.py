"""Everything about one policy, as files: `explanation.json`, `arrays.npz` and `dataset.npz`.

These files are all that a report is made of, so that it can be made again without the policy.
"""

import dataclasses
import json
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from torchrl.envs import TransformedEnv

from drone_rl.explanations.context import Context, LeftOutError
from drone_rl.explanations.sections import Section, find_sections
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.explanations.threads import is_aside
from drone_rl.policies import PictureNetwork
from drone_rl.robustness.shifts_file import SavedShifts
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import RootSeed, with_seed
from drone_rl.verdicts.certificate import Claim

FORMAT_VERSION = 3


def explain_policy(
    env: TransformedEnv,
    network: PictureNetwork,
    folder: Path,
    settings: ExplainSettings,
    *,
    name: str,
    provenance: dict[str, Any],
    progress: Callable[[str], None] = lambda _: None,
    sections: Mapping[str, Section] | None = None,
    claim: Claim | None = None,
    measured: SavedShifts | None = None,
    unlike: Mapping[str, Any] | None = None,
    seed: RootSeed | None = None,
) -> dict[str, Any]:
    """Computes everything about one policy and writes it to a folder.

    Args:
        env: A batch of held-out worlds that have not flown yet, with the policy's pipeline.
        network: The policy's, on the CPU.
        folder: Where to; made if need be.
        settings: What to compute.
        name: Of the policy, for people.
        provenance: Where it comes from, as plain values.
        progress: Called with what is being done.
        sections: What to compute, in this order, which changes nothing but the time of each; all
            of `explanations/sections` by default.
        claim: A certificate of the policy in the task of these worlds, if there is one.
        measured: Its flights under other conditions in that task, if there are any.
        unlike: See `drone_rl.evaluation.judge.judge_policy`.
        seed: Root of all random streams, those of `env` included; that of the settings by default.

    Returns:
        The numbers, as in `explanation.json`; "left_out" says of sections that can't be made of
        this policy why.

    Raises:
        InputError: The folder can't be written or a setting doesn't fit the policy.
    """
    settings, seed = with_seed(settings, seed)
    context = Context(env, network, settings, claim, measured, unlike, seed)
    said = _ask(find_sections() if sections is None else sections, context, progress)
    made = {title: one for title, one in said.items() if one.left_out is None}
    left_out = {title: one.left_out for title, one in said.items() if title not in made}
    written = {
        "format": "drone_rl explanation",
        "format_version": FORMAT_VERSION,
        "name": name,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "settings": dataclasses.asdict(settings),
        **seed.as_dict(),
        "seconds": {title: one.seconds for title, one in made.items()},
        "actions": context.scenes.actions.as_dict(),
        "terms": context.scenes.task.vocabulary.as_dict(),
        **{key: value for one in made.values() for key, value in one.numbers.items()},
        **({"left_out": left_out} if left_out else {}),
        "provenance": provenance,
    }
    arrays = {key: value for one in made.values() for key, value in one.arrays.items()}
    _write(folder, written, arrays, context)
    return written


def _ask(
    sections: Mapping[str, Section], context: Context, progress: Callable[[str], None]
) -> dict[str, "_Said"]:
    """Asks all; those that read the data set alone in a thread of their own, beside the others."""
    said: dict[str, _Said] = {}
    twin = context.aside()
    with ThreadPoolExecutor(1) as pool:
        waiting = {}
        for title, section in sections.items():
            if is_aside(section):
                progress(f"{title} (aside)".replace("_", " "))
                waiting[title] = pool.submit(_say, section, twin)
        for title, section in sections.items():
            if title not in waiting:
                progress(title.replace("_", " "))
                said[title] = _say(section, context)
        said |= {title: future.result() for title, future in waiting.items()}
    return {title: said[title] for title in sections}


@dataclasses.dataclass(frozen=True)
class _Said:
    """What one section said."""

    numbers: dict[str, Any]
    arrays: dict[str, NDArray]
    seconds: float
    left_out: str | None = None


def _say(section: Section, context: Context) -> _Said:
    began = time.perf_counter()
    try:
        numbers, arrays = section(context)
    except LeftOutError as error:
        return _Said({}, {}, 0.0, str(error))
    return _Said(numbers, arrays, round(time.perf_counter() - began, 2))


def _write(
    folder: Path, numbers: dict[str, Any], arrays: dict[str, NDArray], context: Context
) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        context.dataset.save(folder / "dataset.npz", context.flights)
        # numpy's annotation takes any name for allow_pickle
        np.savez_compressed(folder / "arrays.npz", **arrays)  # pyright: ignore[reportArgumentType]
        (folder / "explanation.json").write_text(json.dumps(numbers, indent=1))
    except OSError as error:
        raise InputError(
            f"explanation {folder} can't be written ({error.strerror}); choose another folder"
        ) from error
