"""How a policy fails: its first failure in each episode, by where and when it happens.

An episode fails once, at the first goal that it doesn't reach; what comes after is a consequence.
Of the episodes that offered a kind of goal up to then, those that failed at one are a binomial
count whatever depends on what within an episode. So the intervals are exact, and wide enough that
those of all rows hold at once.
"""

from typing import Any

import torch

from drone_rl.evaluation.metrics import Episodes
from drone_rl.utils.intervals import proportion


def failure_table(episodes: Episodes, confidence: float = 0.95) -> dict[str, Any]:
    """Rows by the task's classes of goals and by how the episode ended.

    Args:
        episodes: Finished episodes.
        confidence: That all the rows' intervals hold at once.

    Returns:
        "rows": each with "by", "value", "episodes" (that offered such a goal at or before their
        first failure), "failed" (whose first failure it was), "share" and its interval; "largest":
        the row that holds many failures and little else, by the number of failures times the least
        share of them, None if nothing failed (the end that every missed goal leads to, as that of
        the field does who flies on behind a passed cube, is left out);
        "expected_end": that end; "bound": the share of episodes that failed, with its exact
        interval.
    """
    reached, task = episodes.goals.reached, episodes.task
    first = reached.long().cumprod(-1).sum(-1)  # number of goals where none failed
    num_goals = reached.shape[-1]
    index = torch.arange(num_goals)
    until, failing = index <= first[:, None], index == first[:, None]
    counts = [
        (by, value, int((of & until).any(-1).sum()), int((of & failing).any(-1).sum()))
        for by, value, of in task.classes(episodes.goals)
    ]
    failed = first < num_goals
    for reason in task.ends:
        if reason not in (0, task.success_end):
            ended = int((failed & (episodes.end_reason == reason)).sum())
            counts.append(("end", reason.name.lower(), len(episodes), ended))
    each = 1.0 - (1.0 - confidence) / len(counts)
    rows = [_row(*count, confidence=each) for count in counts]
    expected = task.ends(task.expected_end).name.lower()
    hit = [row for row in rows if row["failed"] and row["value"] != expected]
    largest = max(hit, key=lambda row: row["failed"] * row["lower95"], default=None)
    return {
        "rows": rows,
        "largest": largest,
        "expected_end": expected,
        "bound": proportion(int(failed.sum()), len(episodes), confidence),
    }


def _row(by: str, value: str, episodes: int, failed: int, *, confidence: float) -> dict[str, Any]:
    found = proportion(failed, episodes, confidence)
    interval = {key: found[key] for key in ("share", "lower95", "upper95")}
    return {"by": by, "value": value, "episodes": episodes, "failed": failed, **interval}
