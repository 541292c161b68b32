"""The headline figures of README.md: at most eight that need no legend."""

import statistics
from collections.abc import Iterable

from tools.readme.tables import Figures, Row, make_cell

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
        "Seconds from process start until solved (mean of 3 seeds), divided by those of the "
        "fastest alternative (Stable-Baselines3's PPO and A2C, a loop with TorchRL's Collector)",
        lambda f: f"{f['solve_over_best_peer']:.2f}",
    ),
    Row(
        "render",
        "Rendering speed at 25x64 pixels divided by that of MuJoCo Warp on the same CPU",
        lambda f: f"{next(iter(f['render_over_warp'].values())):.1f}",
    ),
    Row(
        "gamed",
        "Policies built to deceive the audit (memorised environments, lucky episodes, rounding "
        "errors) judged good or proved",
        lambda f: f"{f['gamed_verdicts']} of {f['gamed_total']}",
    ),
    Row(
        "maps",
        "Heat maps independent of the policy that pass the placebo tests",
        lambda f: f"{f['placebo_maps_trusted']} of {f['placebo_maps_total']}",
    ),
    Row(
        "prove",
        "Simulated episodes that end differently than proved",
        lambda f: f"{f['proof_contradicted']} of {f['proof_flights']:,}",
    ),
    Row(
        "hostile",
        "Malicious policy, run and certificate files refused, with nothing executed",
        lambda f: f"{f['hostile_refused']} of {f['hostile_total']}",
    ),
)
"""Most important first."""


def make_headlines(rows: Iterable[Row], figures: Figures) -> str:
    """Return a Markdown table of figures with the commands that measure them."""
    lines = [f"| {r.label} | {make_cell(r, figures)} | `drone-rl bench {r.bench}` |" for r in rows]
    return "\n".join(["| measured | result | command |", "|---|---|---|", *lines])
