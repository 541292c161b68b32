"""What the sentences of a sweep count in its `summary.json`."""

from drone_rl.utils.text import Evidence

FEWEST = 6
"""Runs from which on their median has an exact 95% interval."""
STILL = 0.01
"""Entropy, nats, below which another action is hardly ever tried."""


def in_words(number: int) -> str:
    """A number of runs."""
    return "1 run" if number == 1 else f"{number} runs"


def count(evidence: Evidence) -> int:
    """All runs."""
    return len(evidence["runs"])


def from_to(values: list) -> str:
    """Least and greatest of sorted numbers."""
    return f"{values[0]}" if len(values) == 1 else f"{values[0]} to {values[-1]}"


def readable(group: Evidence) -> int:
    """Runs of a setting that ended and whose files can be read."""
    return group["ended"] - group["damaged"]


def few(evidence: Evidence) -> int:
    """Settings with such runs, too few of them for an interval of their median."""
    return sum(0 < readable(group) < FEWEST for group in evidence["groups"])


def censored(evidence: Evidence) -> int:
    """Settings of whose runs at least half never reached the target."""
    return sum(group["frames_to_solve"]["more_than"] is not None for group in evidence["groups"])


def solved(evidence: Evidence) -> int:
    """Runs that reached their target."""
    return sum(group["solved"]["successes"] for group in evidence["groups"])


def ended(evidence: Evidence) -> int:
    """Runs that finished, failed or left damaged files."""
    return count(evidence) - evidence["unfinished"]


def unsolved(evidence: Evidence) -> int:
    """Runs that are known to have ended without reaching their target."""
    return evidence["finished"] + evidence["failed"] - solved(evidence)


def one_sided(evidence: Evidence, kept: str) -> int:
    """Runs whose policy keeps to one side, "left" or "right"."""
    return sum(run["verdict"] == f"one-sided ({kept})" for run in evidence["runs"])


def still(evidence: Evidence) -> int:
    """Finished runs whose policy hardly tries another action any more."""
    runs = [run for run in evidence["runs"] if run["state"] == "finished"]
    return sum(run["entropy"] is not None and run["entropy"] < STILL for run in runs)


def entropies(evidence: Evidence) -> int:
    """Judged runs of which the entropy at the end is known."""
    judged = [run for run in evidence["runs"] if run["certain"] is not None]
    return sum(run["entropy"] is not None for run in judged)
