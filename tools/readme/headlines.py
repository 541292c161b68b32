"""The headline figures of README.md: at most eight that need no legend."""

import statistics
from collections.abc import Iterable

from tools.readme.tables import Figures, Row, make_cell


def _relative_time(f: Figures) -> str:
    """Format the ratio of training times, and both times."""
    ratio, ours = f["solve_over_best_peer"], statistics.mean(f["peers"]["reinforce"]["seconds"])
    return f"{ratio:.2f} ({ours:.1f} s against {ours / ratio:.1f} s)"


HEADLINES = (
    Row(
        "solve",
        "Seconds to train the default task, start-up included, median of 5 seeds",
        lambda f: f"{statistics.median(f['time_to_solve_s']):.1f}",
    ),
    Row(
        "solve",
        "Success rate in 1,000 held-out episodes, lower end of the 95% CI, worst of 5 seeds",
        lambda f: f"{100 * min(f['success_lower95']):.1f}%",
    ),
    Row(
        "peers",
        "Time until solved, relative to the fastest other: Stable-Baselines3's PPO or A2C, or "
        "TorchRL's Collector (means of 3 seeds)",
        _relative_time,
    ),
    Row(
        "render",
        "Rendering speed at 25x64 pixels relative to MuJoCo Warp, same CPU",
        lambda f: f"{next(iter(f['render_over_warp'].values())):.1f} times",
    ),
    Row(
        "gamed",
        "Policies built to deceive `verdict` that it called good or proved",
        lambda f: f"{f['gamed_verdicts']} of {f['gamed_total']}",
    ),
    Row(
        "maps",
        "Heat maps that ignore the policy (such as noise) but pass the tests",
        lambda f: f"{f['placebo_maps_trusted']} of {f['placebo_maps_total']}",
    ),
    Row(
        "prove",
        "Simulated episodes that end differently than proved",
        lambda f: f"{f['proof_contradicted']} of {f['proof_flights']:,}",
    ),
)
"""Most important first."""


def make_headlines(rows: Iterable[Row], figures: Figures) -> str:
    """Return a Markdown table of figures with the commands that measure them."""
    lines = [f"| {r.label} | {make_cell(r, figures)} | `drone-rl bench {r.bench}` |" for r in rows]
    return "\n".join(["| measured | result | command |", "|---|---|---|", *lines])
