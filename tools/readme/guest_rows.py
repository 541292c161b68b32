"""What the table of programs of others says, row by row, of which keys of docs/results.json."""

import statistics

from tools.readme.tables import Figures, Row


def _beside(figures: Figures) -> str:
    peers = figures["peers"]
    names = ("reinforce", "ppo", "sb3_ppo", "sb3_a2c", "torchrl")
    return "; ".join(f"{statistics.mean(peers[name]['seconds']):.1f}" for name in names)


GUESTS = (
    Row(
        "peers",
        "seconds from the start of the process until solved, mean of three seeds: our default; our "
        "PPO; Stable-Baselines3's PPO; its A2C; TorchRL's collector",
        _beside,
        "ours the least",
    ),
    Row(
        "peers",
        "our default's seconds over those of the best of the others",
        lambda f: f"{f['solve_over_best_peer']:.2f}",
        "0.6",
    ),
    Row(
        "gymnasium",
        "Gymnasium's vector environment over the batched environment itself, frames/s",
        lambda f: f"{f['gym_over_batched']:.2f} ({f['gym_fps']:,.0f} frames/s)",
        "0.8",
    ),
    Row(
        "pillars",
        "flying through pillars, share of 1,000 held-out episodes that touch none, lower end of "
        "the exact 95% interval, three seeds",
        lambda f: ", ".join(f"{lower:.3f}" for lower in f["pillars_lower95"]),
        "0.95",
    ),
    Row(
        "pillars",
        "minutes to train each, from the start of the command",
        lambda f: ", ".join(f"{seconds / 60:.1f}" for seconds in f["pillars_train_s"]),
        "5",
    ),
    Row(
        "onnx",
        "greatest difference of a probability between the shipped policies and their ONNX models",
        lambda f: f"{f['onnx_max_difference']:.1e} on {f['onnx_frames']:,} pictures",
        "1e-5",
    ),
    Row(
        "onnx",
        "pictures of which they call different actions the most probable",
        lambda f: f"{f['onnx_actions_differ']} of {f['onnx_frames']:,}",
        "0",
    ),
)
"""What works with programs of others."""
