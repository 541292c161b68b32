"""Which frames tell an episode's story: the first, the approach, each goal, the failure."""

from typing import Any

import numpy as np

from drone_rl.explanations.dataset import RolloutDataset
from drone_rl.sim.tasks import Task

COUNT = 6
"""Frames in a sequence, as in Figs. 13 to 15."""


def key_frames(dataset: RolloutDataset, episode: int, task: Task[Any]) -> list[tuple[int, str]]:
    """Six frames of an episode in order of time, each with why it was chosen.

    The rule: the first frame; half way to the first goal (or to the end); the frame before
    each goal is reached; the frame before one is missed, and the last one of an episode that
    failed. What is still free goes to the frames furthest from those chosen.

    Args:
        dataset: Whole flights.
        episode: One of them.
        task: What was flown.

    Returns:
        Frame number and reason; fewer than six only where the episode is shorter.
    """
    frames = np.flatnonzero(dataset.episode == episode)
    chosen: dict[int, str] = {int(frames[0]): "start"}
    reached, missed = (frames[dataset.event[frames] == event] for event in (1, -1))
    half = frames[len(frames) // 2] if not len(reached) else (frames[0] + reached[0]) // 2
    terms = task.vocabulary
    events = [(int(t), f"{terms.reaches} a {terms.goal}") for t in reached]
    events += [(int(t), f"misses a {terms.goal}") for t in missed]
    end = int(dataset.end_reason[frames[-1]])
    if end not in (0, task.success_end):
        reason = task.ends(end).name.lower().replace("_", " ")
        events.append((int(frames[-1]), f"fails: {reason}"))
    for frame, why in [*events, (int(half), "approach")]:
        if len(chosen) < COUNT:
            chosen.setdefault(frame, why)
    while len(chosen) < min(COUNT, len(frames)):
        away = np.abs(frames[:, None] - np.array(list(chosen))[None]).min(1)
        chosen[int(frames[away.argmax()])] = "in between"
    return sorted(chosen.items())
