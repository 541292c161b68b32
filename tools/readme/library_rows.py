"""Rows of the table of figures with other libraries."""

import statistics

from tools.readme.tables import Figures, Row, percent


def _peer_seconds(figures: Figures) -> str:
    peers = figures["peers"]
    names = ("reinforce", "ppo", "sb3_ppo", "sb3_a2c", "torchrl")
    return "; ".join(f"{statistics.mean(peers[name]['seconds']):.1f}" for name in names)


LIBRARIES = (
    Row(
        "peers",
        "seconds from process start until solved, mean of 3 seeds: our default; our PPO; "
        "Stable-Baselines3's PPO; its A2C; TorchRL's collector",
        _peer_seconds,
        "ours lowest",
    ),
    Row(
        "peers",
        "ratio of our default's seconds to those of the fastest other library",
        lambda f: f"{f['solve_over_best_peer']:.2f}",
        "0.6",
    ),
    Row(
        "gymnasium",
        "frames/s of the Gymnasium vector environment relative to the batched environment",
        lambda f: f"{f['gym_over_batched']:.2f} ({f['gym_fps']:,.0f} frames/s)",
        "0.8",
    ),
    Row(
        "pillars",
        "task pillars: success rate in 1,000 held-out episodes, lower end of the exact 95% CI, "
        "3 seeds",
        lambda f: ", ".join(map(percent, f["pillars_lower95"])),
        "95%",
    ),
    Row(
        "pillars",
        "minutes to train each seed, from the start of the command",
        lambda f: ", ".join(f"{seconds / 60:.1f}" for seconds in f["pillars_train_s"]),
        "5",
    ),
    Row(
        "onnx",
        "greatest difference of a probability between the bundled policies and their ONNX models",
        lambda f: f"{1e6 * f['onnx_max_difference']:.1f} millionths on {f['onnx_frames']:,} images",
        "10 millionths",
    ),
    Row(
        "onnx",
        "images with a different most probable action",
        lambda f: f"{f['onnx_actions_differ']} of {f['onnx_frames']:,}",
        "0",
    ),
)
"""Other libraries."""
