"""The headline figures of README.md: at most eight, each readable without a legend."""

import statistics
from collections.abc import Iterable

from tools.readme.tables import Figures, Row, make_cell


def _ratio_to_best(f: Figures) -> str:
    seconds = {name: statistics.mean(one["seconds"]) for name, one in f["peers"].items()}
    ours = seconds["reinforce"]
    return f"{ours:.1f} s, {100 * f['solve_over_best_peer']:.0f}% of the fastest of them"


HEADLINES = (
    Row(
        "solve",
        "Time to train the default task, start of the process included, median of 5 seeds",
        lambda f: f"{statistics.median(f['time_to_solve_s']):.1f} s",
    ),
    Row(
        "solve",
        "Success rate of the trained policies: lower end of the 95% CI of 1,000 held-out episodes, "
        "least of 5 seeds",
        lambda f: f"{100 * min(f['success_lower95']):.1f}%",
    ),
    Row(
        "peers",
        "The same time next to PPO and A2C of Stable-Baselines3 and REINFORCE on TorchRL's "
        "collector, mean of 3 seeds",
        _ratio_to_best,
    ),
    Row(
        "render",
        "Frames rendered per second at 25x64 pixels, and ratio to MuJoCo Warp's renderer",
        lambda f: f"{f['raw_render_fps']:,.0f}; {next(iter(f['render_over_warp'].values())):.1f}",
    ),
    Row(
        "gamed",
        "Adversarial policies (memorised, lucky, dependent on rounding) that a verdict calls good "
        "or proved",
        lambda f: f"{f['gamed_verdicts']} of {f['gamed_total']}",
    ),
    Row(
        "maps",
        "Saliency maps that do not depend on the policy and yet pass the placebo tests",
        lambda f: f"{f['placebo_maps_trusted']} of {f['placebo_maps_total']}",
    ),
    Row(
        "prove",
        "Simulated episodes that end differently than proved",
        lambda f: f"{f['proof_contradicted']} of {f['proof_flights']:,}",
    ),
    Row(
        "hostile",
        "Malicious files that are refused in one line, with nothing executed",
        lambda f: f"{f['hostile_refused']} of {f['hostile_total']}",
    ),
)
"""Most important first."""


def make_headlines(rows: Iterable[Row], figures: Figures) -> str:
    """Return a table in Markdown, each row with the command that measures it."""
    lines = [f"| {r.what} | {make_cell(r, figures)} | `drone-rl bench {r.bench}` |" for r in rows]
    return "\n".join(["| measured | result | command |", "| --- | --- | --- |", *lines])
