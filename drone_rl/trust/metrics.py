"""Success rates, returns and failures of finished episodes.

Goals within an episode are correlated, so every interval is computed from one value per episode.
"""

from typing import Any

import torch

from drone_rl.collectors.complete_episodes import CompleteEpisodes
from drone_rl.utils.intervals import mean_bounds, proportion


def summarise(episodes: CompleteEpisodes) -> dict[str, Any]:
    """Return the figures of an evaluation as plain values, with 95% intervals over episodes.

    "success" is the success rate. "shares" are mean fractions of goals reached: of all goals, and
    by stratum over the episodes that offered such a goal (None if there are none). Goals that never
    came up ("never_reached") count as missed among all.
    """
    goals, task = episodes.goals, episodes.task
    shares = {"all": {**mean_bounds(episodes.share), "goals": goals.reached.numel()}}
    for number, name in enumerate(task.strata):
        share, count = episodes.stratum_share(number), int((goals.stratum == number).sum())
        shares[name] = {**mean_bounds(share), "goals": count}
    ends = {
        reason.name.lower(): proportion(int((episodes.end_reason == reason).sum()), len(episodes))
        for reason in task.ends
        if reason != 0
    }
    return {
        "episodes": len(episodes),
        "success": proportion(int(episodes.success.sum()), len(episodes)),
        "shares": shares,
        "never_reached": mean_bounds((goals.stratum < 0).double().mean(-1)),
        "ends": ends,
        "mean_goals": float(goals.reached.sum(-1).double().mean()),
        "mean_length": float(episodes.length.double().mean()),
        "max_length": int(episodes.length.max()),
    }


def failure_table(episodes: CompleteEpisodes) -> dict[str, Any]:
    """Count first failures by class of goal and by how the episode ended.

    An episode fails once: at the first goal that it misses, or by its end if it reached all goals
    and did not succeed. So each row is a binomial count, and
    its interval is exact. With 95% confidence the intervals of all rows hold at once (Bonferroni).

    Returns:
        "rows": each with "by", "value", "episodes" (that offered such a goal at or before their
        first failure), "failed" (whose first failure it was), "share" and its interval; "largest":
        the row with the greatest product of failures and lower bound, None if nothing failed; the
        end to which every missed goal leads only if no other row has failures; "expected_end": that
        end, None if the task has none; "bound": the fraction of episodes that failed, with its
        exact interval.
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
    failed = (first < num_goals) | (episodes.success == 0)  # all goals may not be enough
    for reason in task.ends:
        if reason not in (0, task.success_end):
            ended = int((failed & (episodes.end_reason == reason)).sum())
            counts.append(("end", reason.name.lower(), len(episodes), ended))
    each = 1.0 - 0.05 / len(counts)
    rows = [_row(*count, confidence=each) for count in counts]
    expected = next((e.name.lower() for e in task.ends if e == task.expected_end), None)
    hit = [row for row in rows if row["failed"]]
    telling = [row for row in hit if (row["by"], row["value"]) != ("end", expected)]
    largest = max(telling or hit, key=lambda row: row["failed"] * row["lower95"], default=None)
    return {
        "rows": rows,
        "largest": largest,
        "expected_end": expected,
        "bound": proportion(int(failed.sum()), len(episodes)),
    }


def _row(by: str, value: str, episodes: int, failed: int, *, confidence: float) -> dict[str, Any]:
    estimate = proportion(failed, episodes, confidence)
    interval = {key: estimate[key] for key in ("share", "lower95", "upper95")}
    return {"by": by, "value": value, "episodes": episodes, "failed": failed, **interval}
