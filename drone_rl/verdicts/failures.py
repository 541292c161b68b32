"""How a policy fails: its first failure in each episode, by where and when it happens.

An episode fails once, at the first cube that it doesn't collect; what comes after is a consequence.
Of the episodes that offered a kind of cube up to then, those that failed at one are a binomial
count whatever depends on what within an episode. So the intervals are exact, and wide enough that
those of all rows hold at once.
"""

from collections.abc import Iterator
from typing import Any

import torch
from torch import Tensor

from drone_rl.evaluation.metrics import ENDS, Episodes
from drone_rl.sim.settings import TaskSettings
from drone_rl.sim.tasks.collect_cubes.rules import EndReason, Side
from drone_rl.utils.intervals import proportion

EXPECTED_END = "front_boundary"
"""How an episode ends in which a cube was passed and nothing else went wrong."""
ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth")


def failure_table(
    episodes: Episodes, task: TaskSettings, confidence: float = 0.95
) -> dict[str, Any]:
    """Rows by number of the cube, side, sideways distance, height and how the episode ended.

    Args:
        episodes: Finished episodes.
        task: Theirs.
        confidence: That all the rows' intervals hold at once.

    Returns:
        "rows": each with "by", "value", "episodes" (that offered such a cube at or before their
        first failure), "failed" (whose first failure it was), "share" and its interval; "largest":
        the row that holds many failures and little else, by the number of failures times the least
        share of them, None if nothing failed (who passed a cube flies on to the end of the field,
        so that this end is left out);
        "bound": the share of episodes that failed, with its exact interval.
    """
    first = episodes.collected.long().cumprod(-1).sum(-1)  # number of cubes where none failed
    num_cubes = episodes.collected.shape[-1]
    index = torch.arange(num_cubes)
    until, failing = index <= first[:, None], index == first[:, None]
    counts = [
        (by, value, int((of & until).any(-1).sum()), int((of & failing).any(-1).sum()))
        for by, value, of in _strata(episodes, task)
    ]
    failed = first < num_cubes
    for reason in ENDS:
        if reason is not EndReason.ALL_CUBES:
            ended = int((failed & (episodes.end_reason == reason)).sum())
            counts.append(("end", reason.name.lower(), len(episodes), ended))
    each = 1.0 - (1.0 - confidence) / len(counts)
    rows = [_row(*count, confidence=each) for count in counts]
    hit = [row for row in rows if row["failed"] and row["value"] != EXPECTED_END]
    largest = max(hit, key=lambda row: row["failed"] * row["lower95"], default=None)
    return {
        "rows": rows,
        "largest": largest,
        "bound": proportion(int(failed.sum()), len(episodes), confidence),
    }


def _strata(episodes: Episodes, task: TaskSettings) -> Iterator[tuple[str, str, Tensor]]:
    """What is looked at, its value, and which cubes have it. Shape of these: (n, C)."""
    for number in range(episodes.collected.shape[-1]):
        of = torch.zeros_like(episodes.collected)
        of[:, number] = True
        yield "cube", ordinal(number), of
    for side in Side:
        yield "side", side.name.lower(), episodes.side == side
    aside = episodes.lateral.abs()
    edges = sideways_edges(task)
    for low, high in zip(edges, [*edges[1:], torch.inf], strict=True):
        label = f"{low:g} to {high:g} m" if high < torch.inf else f"more than {low:g} m"
        yield "sideways", label, (aside > low) & (aside <= high)
    if task.vertical_bound > 0:
        level = task.vertical_bound / 3
        yield "height", "lower", episodes.height < -level
        yield "height", "level", episodes.height.abs() <= level
        yield "height", "higher", episodes.height > level


def sideways_edges(task: TaskSettings) -> list[float]:
    """Bounds of the classes of sideways distance, metres: from what is ahead, outwards."""
    touch, bound = task.touch_distance, task.lateral_bound
    edges = [round(2 * edge) / 2 for edge in ((touch + bound) / 2, bound, 1.5 * bound)]
    return [touch, *sorted({edge for edge in edges if edge > touch})]


def ordinal(number: int) -> str:
    """What people call the cube with this index."""
    return ORDINALS[number] if number < len(ORDINALS) else f"{number + 1}th"


def _row(by: str, value: str, episodes: int, failed: int, *, confidence: float) -> dict[str, Any]:
    found = proportion(failed, episodes, confidence)
    interval = {key: found[key] for key in ("share", "lower95", "upper95")}
    return {"by": by, "value": value, "episodes": episodes, "failed": failed, **interval}
