"""Success rates, returns and failures of finished episodes.

Goals within an episode are correlated, so every interval is computed from one value per episode.
"""

import torch

from drone_rl.collectors.complete_episodes import CompleteEpisodes
from drone_rl.trust.results import Failure, Failures, Figures, GoalShare
from drone_rl.utils.intervals import mean_bounds, proportion, rate_of


def summarise(episodes: CompleteEpisodes) -> Figures:
    """Return the figures of an evaluation."""
    goals, task = episodes.goals, episodes.task
    values = {"all": (episodes.share, goals.reached.numel())}
    for number, name in enumerate(task.strata):
        count = int((goals.stratum == number).sum())
        values[name] = (episodes.stratum_share(number), count)
    shares = {
        name: GoalShare(**dict(mean_bounds(share)), goals=count)
        for name, (share, count) in values.items()
    }
    ends = {
        reason.name.lower(): rate_of(episodes.end_reason == reason)
        for reason in task.ends
        if reason != 0
    }
    return Figures(
        episodes=len(episodes),
        success=rate_of(episodes.success),
        shares=shares,
        never_reached=mean_bounds((goals.stratum < 0).double().mean(-1)),
        ends=ends,
        mean_goals=float(goals.reached.sum(-1).double().mean()),
        mean_length=float(episodes.length.double().mean()),
        max_length=int(episodes.length.max()),
    )


def failure_table(episodes: CompleteEpisodes) -> Failures:
    """Count first failures by class of goal and by how the episode ended.

    An episode fails once: at the first goal that it misses, or by its end if it reached all goals
    and did not succeed. So each row is a binomial count, and
    its interval is exact. With 95% confidence the intervals of all rows hold at once (Bonferroni).
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
    hit = [row for row in rows if row.failed]
    telling = [row for row in hit if (row.by, row.value) != ("end", expected)]
    largest = max(telling or hit, key=lambda row: row.failed * row.lower95, default=None)
    bound = rate_of(failed)
    return Failures(rows=tuple(rows), largest=largest, expected_end=expected, bound=bound)


def _row(by: str, value: str, episodes: int, failed: int, *, confidence: float) -> Failure:
    of = proportion(failed, episodes, confidence)
    interval = {"share": of.share, "lower95": of.lower95, "upper95": of.upper95}
    return Failure(by=by, value=value, episodes=episodes, failed=failed, **interval)
