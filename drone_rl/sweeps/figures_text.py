"""What may be said below the figures of a sweep; the evidence is its `summary.json`."""

from drone_rl.sweeps.counts import (
    FEWEST,
    STILL,
    ended,
    entropies,
    few,
    in_words,
    one_sided,
    readable,
    solved,
    still,
    unsolved,
)
from drone_rl.utils.text import Sentence

SENTENCES = (
    Sentence(
        "curves.band",
        f"a setting with {FEWEST} ended runs or more",
        lambda e: any(readable(group) >= FEWEST for group in e["groups"]),
        lambda e: (
            "Thick line: the median over runs; band: its exact 95% interval by order statistics, "
            "at each place by itself."
        ),
    ),
    Sentence(
        "curves.runs",
        f"a setting with fewer than {FEWEST} ended runs",
        lambda e: few(e) > 0,
        lambda e: f"Thin lines: each run by itself, where fewer than {FEWEST} have ended.",
    ),
    Sentence(
        "curves.ends",
        "a run has finished",
        lambda e: e["finished"] > 0,
        lambda e: "A run that has stopped counts as staying where it was.",
    ),
    Sentence(
        "curves.failed",
        "a run failed",
        lambda e: e["failed"] > 0,
        lambda e: "One that failed counts as having learned nothing.",
    ),
    Sentence(
        "shares.bars",
        "a policy was judged",
        lambda e: e["judged"] > 0,
        lambda e: (
            f"Share of all {ended(e)} runs that ended; bars: exact 95% (Clopper-Pearson) "
            "intervals over runs."
        ),
    ),
    Sentence(
        "sides.dots",
        "a policy was offered cubes on both sides",
        lambda e: e["judged"] > e["sides_not_offered"],
        lambda e: (
            "Each dot a judged run: the share of cubes that it collects of those on its right, "
            "less the share of those on its left."
        ),
    ),
    Sentence(
        "sides.lost_left",
        "a policy is one-sided to the right",
        lambda e: one_sided(e, "right") > 0,
        lambda e: f"{in_words(one_sided(e, 'right'))} one-sided to the right.",
    ),
    Sentence(
        "sides.lost_right",
        "a policy is one-sided to the left",
        lambda e: one_sided(e, "left") > 0,
        lambda e: f"{in_words(one_sided(e, 'left'))} one-sided to the left.",
    ),
    Sentence(
        "sides.not_offered",
        "a policy was offered no cube on a side",
        lambda e: e["sides_not_offered"] > 0,
        lambda e: (
            f"{in_words(e['sides_not_offered'])} without a dot: on one of the sides no cube was "
            "offered."
        ),
    ),
    Sentence(
        "entropies.dots",
        "a judged run has an entropy",
        lambda e: entropies(e) > 0,
        lambda e: (
            "Each dot a judged run: the mean entropy of its policy over the last updates; the line "
            "is that of three actions of the same probability."
        ),
    ),
    Sentence(
        "entropies.still",
        f"a finished run ended below {STILL} nats",
        lambda e: still(e) > 0,
        lambda e: (
            f"{in_words(still(e))} ended below {STILL} nats: on average hardly any other action is "
            "tried."
        ),
    ),
    Sentence(
        "costs.dots",
        "a run was solved",
        lambda e: solved(e) > 0,
        lambda e: "Each dot a run that reached its target; above: how many did, of those ended.",
    ),
    Sentence(
        "costs.open",
        "a run ended without reaching its target",
        lambda e: unsolved(e) > 0,
        lambda e: (
            "Each open triangle one that ended without (red: failed): it needs more than that."
        ),
    ),
)
